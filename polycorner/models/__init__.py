"""Worked systems, one file each; the core never imports them."""

from polycorner.models.disk_critical import CriticalConfiguration
from polycorner.models.disks import TorusDisks
from polycorner.models.drum import DumbbellDrum
from polycorner.models.dumbbell_formulas import plane_heading_formula
from polycorner.models.dumbbells import DumbbellPair
from polycorner.models.keel import Keel, RestRegion
from polycorner.models.pinball import Pinball
from polycorner.models.spheres import SphereCluster
from polycorner.models.tutorial import Tutorial

__all__ = [
    "CriticalConfiguration",
    "DumbbellDrum",
    "DumbbellPair",
    "Keel",
    "Pinball",
    "RestRegion",
    "SphereCluster",
    "TorusDisks",
    "Tutorial",
    "plane_heading_formula",
]

from .disks.configurations import CriticalConfiguration
from .disks.critical import CriticalSearch
from .disks.disks import TorusDisks
from .packings.jammed import JammedPacking
from .packings.periodic import PeriodicPacking
from .pinball import Pinball
from .spheres import SphereCluster
from .tutorial import Tutorial

__all__ = [
    "CriticalConfiguration",
    "CriticalSearch",
    "JammedPacking",
    "PeriodicPacking",
    "Pinball",
    "SphereCluster",
    "TorusDisks",
    "Tutorial",
]

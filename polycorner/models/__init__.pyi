from .disks.configurations import CriticalConfiguration
from .disks.critical import CriticalSearch
from .disks.disks import TorusDisks
from .packings.balls import CirclesIn, SpheresInCube
from .packings.hopping import BasinHopping, basin_hopping
from .packings.jammed import JammedPacking
from .packings.periodic import PeriodicPacking
from .packings.sphere_points import PointsOnSphere
from .packings.tables import CoordinateTable, read_coordinates
from .pinball import Pinball
from .planar import Tutorial
from .spheres import LennardJones, SphereCluster

__all__ = [
    "BasinHopping",
    "CirclesIn",
    "CoordinateTable",
    "CriticalConfiguration",
    "CriticalSearch",
    "JammedPacking",
    "LennardJones",
    "PeriodicPacking",
    "Pinball",
    "PointsOnSphere",
    "SphereCluster",
    "SpheresInCube",
    "TorusDisks",
    "Tutorial",
    "basin_hopping",
    "read_coordinates",
]

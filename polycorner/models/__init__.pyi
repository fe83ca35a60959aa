from .disks.critical import CriticalConfiguration
from .disks.disks import TorusDisks
from .pinball import Pinball
from .spheres import SphereCluster
from .tutorial import Tutorial

__all__ = [
    "CriticalConfiguration",
    "Pinball",
    "SphereCluster",
    "TorusDisks",
    "Tutorial",
]

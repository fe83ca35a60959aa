from .disks.configurations import CriticalConfiguration
from .disks.critical import CriticalSearch
from .disks.disks import TorusDisks
from .pinball import Pinball
from .spheres import SphereCluster
from .tutorial import Tutorial

__all__ = [
    "CriticalConfiguration",
    "CriticalSearch",
    "Pinball",
    "SphereCluster",
    "TorusDisks",
    "Tutorial",
]

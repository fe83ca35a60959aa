from .barriers import Barrier, Landscape, Merge, Minimum, Pass, Side
from .basins import Basins, basins, minimum_of
from .enumeration import landscape
from .routes import Route

__all__ = [
    "Barrier",
    "Basins",
    "Landscape",
    "Merge",
    "Minimum",
    "Pass",
    "Route",
    "Side",
    "basins",
    "landscape",
    "minimum_of",
]

from .barriers import Barrier, Landscape, Merge, Minimum, Pass, Side
from .basins import Basins, basins, minimum_of
from .enumeration import landscape
from .paving import Paving, paved_barrier
from .routes import Route
from .saddles import search_landscape

__all__ = [
    "Barrier",
    "Basins",
    "Landscape",
    "Merge",
    "Minimum",
    "Pass",
    "Paving",
    "Route",
    "Side",
    "basins",
    "landscape",
    "minimum_of",
    "paved_barrier",
    "search_landscape",
]

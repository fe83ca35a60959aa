from .barriers import Barrier, Landscape, Merge, Minimum, Pass, Side
from .enumeration import landscape
from .routes import Route

__all__ = ["Barrier", "Landscape", "Merge", "Minimum", "Pass", "Route", "Side", "landscape"]

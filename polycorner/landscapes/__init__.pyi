from .enumeration import landscape
from .landscape import Barrier, Landscape, Merge, Minimum, Pass, Side
from .routes import Route

__all__ = ["Barrier", "Landscape", "Merge", "Minimum", "Pass", "Route", "Side", "landscape"]

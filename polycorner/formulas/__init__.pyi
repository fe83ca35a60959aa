from .families import Family
from .functions import SmoothFunction

__all__ = [
    "Family",
    "SmoothFunction",
]

from .functions import Family, SmoothFunction

__all__ = [
    "Family",
    "SmoothFunction",
]

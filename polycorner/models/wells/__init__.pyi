from .escape import mean_escape_time, overdamped_escape_time
from .holding import Comparison, Escapes, compare, escapes, kick_of, ladder, rests
from .wells import KINDS, Well

__all__ = [
    "KINDS",
    "Comparison",
    "Escapes",
    "Well",
    "compare",
    "escapes",
    "kick_of",
    "ladder",
    "mean_escape_time",
    "overdamped_escape_time",
    "rests",
]

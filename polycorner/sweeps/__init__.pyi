from .execution import SweepError, sweep
from .grid import Axis
from .store import open_results

__all__ = [
    "Axis",
    "SweepError",
    "open_results",
    "sweep",
]

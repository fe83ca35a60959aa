from .execution import sweep
from .grid import Axis, Grid
from .store import open_results
from .study import SweepError
from .study_files import NamedStudy, StudyFile, read_study

__all__ = [
    "Axis",
    "Grid",
    "NamedStudy",
    "StudyFile",
    "SweepError",
    "open_results",
    "read_study",
    "sweep",
]

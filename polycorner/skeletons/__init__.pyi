from .elements import Completeness, Corner, Edge, Face, Skeleton
from .refinement import traced
from .search import resume, skeleton
from .walks import End

__all__ = [
    "Completeness",
    "Corner",
    "Edge",
    "End",
    "Face",
    "Skeleton",
    "resume",
    "skeleton",
    "traced",
]

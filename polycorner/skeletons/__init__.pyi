from .elements import Completeness, Contact, Corner, Edge, Face, Skeleton
from .explorer import Budget
from .refinement import traced
from .search import resume, skeleton
from .walks import End

__all__ = [
    "Budget",
    "Completeness",
    "Contact",
    "Corner",
    "Edge",
    "End",
    "Face",
    "Skeleton",
    "resume",
    "skeleton",
    "traced",
]

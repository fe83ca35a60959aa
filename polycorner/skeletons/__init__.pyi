from .elements import Skeleton
from .parts import Completeness, Contact, Corner, Edge, Face
from .search import examine_faces, resume, skeleton, traced
from .states import Budget
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
    "examine_faces",
    "resume",
    "skeleton",
    "traced",
]

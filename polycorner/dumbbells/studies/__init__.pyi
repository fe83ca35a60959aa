from .catalogue import STUDIES
from .functions import bunch, climbing, heading

__all__ = [
    "STUDIES",
    "bunch",
    "climbing",
    "heading",
]

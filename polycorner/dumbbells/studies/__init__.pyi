from .catalogue import STUDIES
from .driven import driven
from .functions import bunch, climbing, heading

__all__ = [
    "STUDIES",
    "bunch",
    "climbing",
    "driven",
    "heading",
]

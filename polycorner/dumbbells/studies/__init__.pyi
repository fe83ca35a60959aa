from .bunches import bunch
from .catalogue import STUDIES
from .driven import driven
from .functions import climbing, heading
from .turning import turning

__all__ = [
    "STUDIES",
    "bunch",
    "climbing",
    "driven",
    "heading",
    "turning",
]

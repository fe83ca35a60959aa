from .parameter_boxes import ParameterCell
from .proof import Proof
from .statements import Status
from .verification import prove

__all__ = [
    "ParameterCell",
    "Proof",
    "Status",
    "prove",
]

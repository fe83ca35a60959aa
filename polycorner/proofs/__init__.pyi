from .hypotheses import Status
from .parameter_boxes import ParameterCell
from .proof import Proof
from .verification import prove

__all__ = [
    "ParameterCell",
    "Proof",
    "Status",
    "prove",
]

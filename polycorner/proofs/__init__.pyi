from .lists.enumeration import stationary_points
from .lists.stationary import StationaryList, StationaryLocus, StationaryPoint
from .parameter_boxes import ParameterCell
from .proof import Proof
from .statements import Status
from .verification import prove

__all__ = [
    "ParameterCell",
    "Proof",
    "StationaryList",
    "StationaryLocus",
    "StationaryPoint",
    "Status",
    "prove",
    "stationary_points",
]

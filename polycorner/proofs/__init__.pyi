from .hypotheses import Status
from .lists.corners import CornerList, CornerPoint, corners
from .lists.enumeration import stationary_points
from .lists.stationary import StationaryList, StationaryLocus, StationaryPoint
from .parameter_boxes import ParameterCell
from .verification import Proof, prove

__all__ = [
    "CornerList",
    "CornerPoint",
    "ParameterCell",
    "Proof",
    "StationaryList",
    "StationaryLocus",
    "StationaryPoint",
    "Status",
    "corners",
    "prove",
    "stationary_points",
]

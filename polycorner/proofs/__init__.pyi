from .lists.corner_lists import CornerList, CornerPoint
from .lists.corners import corners
from .lists.enumeration import stationary_points
from .lists.stationary import StationaryList, StationaryLocus, StationaryPoint
from .parameter_boxes import ParameterCell
from .proof import Proof
from .statements import Status
from .verification import prove

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

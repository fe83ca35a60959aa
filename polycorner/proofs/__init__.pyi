from .exact_points import exact_point
from .hypotheses import Status
from .lists.corners import CornerList, CornerPoint, corners
from .lists.enumeration import stationary_points
from .lists.stationary import StationaryList, StationaryLocus, StationaryPoint
from .membership import Membership, Violation
from .parameter_boxes import ParameterCell
from .proof import Proof
from .verification import prove

__all__ = [
    "CornerList",
    "CornerPoint",
    "Membership",
    "ParameterCell",
    "Proof",
    "StationaryList",
    "StationaryLocus",
    "StationaryPoint",
    "Status",
    "Violation",
    "corners",
    "exact_point",
    "prove",
    "stationary_points",
]

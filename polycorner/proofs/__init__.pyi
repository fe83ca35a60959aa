from .exact_points import exact_point
from .hypotheses import Status
from .lists.corners import CornerList, CornerPoint, corners
from .lists.critical import CriticalList, CriticalPoint, critical_points
from .lists.domains import Domain, domain
from .lists.enumeration import Limits, stationary_points
from .lists.images import Motion
from .lists.stationary import StationaryList, StationaryLocus, StationaryPoint
from .membership import Membership, Violation
from .parameter_boxes import ParameterCell
from .proof import Proof
from .verification import prove

__all__ = [
    "CornerList",
    "CornerPoint",
    "CriticalList",
    "CriticalPoint",
    "Domain",
    "Limits",
    "Membership",
    "Motion",
    "ParameterCell",
    "Proof",
    "StationaryList",
    "StationaryLocus",
    "StationaryPoint",
    "Status",
    "Violation",
    "corners",
    "critical_points",
    "domain",
    "exact_point",
    "prove",
    "stationary_points",
]

from .diagram import Arc, BranchEvent, BranchKind, Diagram
from .event_curves import event_curves
from .event_map import EventCurve, EventMap, MeetingKind, MeetingPoint
from .hysteresis import Hysteresis, Jump, Leg, hysteresis
from .proof import BranchProof, prove_branches
from .proof_options import BranchProofOptions
from .search import branches

__all__ = [
    "Arc",
    "BranchEvent",
    "BranchKind",
    "BranchProof",
    "BranchProofOptions",
    "Diagram",
    "EventCurve",
    "EventMap",
    "Hysteresis",
    "Jump",
    "Leg",
    "MeetingKind",
    "MeetingPoint",
    "branches",
    "event_curves",
    "hysteresis",
    "prove_branches",
]

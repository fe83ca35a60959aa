from .events import Event, EventKind
from .friction import ConvexPolygon, ConvexSet, CutDisc, Disc, Ellipse, Interval
from .noise import Noise, Solver
from .simulation import simulate, step
from .system import Friction, State, System, velocities
from .trajectory import Trajectory

__all__ = [
    "ConvexPolygon",
    "ConvexSet",
    "CutDisc",
    "Disc",
    "Ellipse",
    "Event",
    "EventKind",
    "Friction",
    "Interval",
    "Noise",
    "Solver",
    "State",
    "System",
    "Trajectory",
    "simulate",
    "step",
    "velocities",
]

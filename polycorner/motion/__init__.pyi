from .accelerations import Accelerations, Consistency, accelerations
from .assembly import Assembly
from .attraction import Attraction
from .checkpoints import Checkpoint
from .contacts import (
    ContactFamily,
    Friction,
    PairFriction,
    motions,
    pair_coordinates,
    pair_velocities,
    time_symbol,
    velocities,
)
from .drifts import Drift
from .events import Event, EventKind
from .friction import ConvexPolygon, ConvexSet, CutDisc, Disc, Ellipse, Interval
from .mechanics import MechanicalSystem, State
from .noise import MotionOptions, Noise, Solver
from .random_functions import random_field, random_signal
from .rotations import angular_velocity, rotational_energy
from .scenes import ContactForce, ContactForces
from .simulation import simulate, step
from .splits import Split
from .system import System
from .ties import Tie
from .trajectory import MotionOfKind, Trajectory, contact_forces
from .viability import SpeedZones

__all__ = [
    "Accelerations",
    "Assembly",
    "Attraction",
    "Checkpoint",
    "Consistency",
    "ContactFamily",
    "ContactForce",
    "ContactForces",
    "ConvexPolygon",
    "ConvexSet",
    "CutDisc",
    "Disc",
    "Drift",
    "Ellipse",
    "Event",
    "EventKind",
    "Friction",
    "Interval",
    "MechanicalSystem",
    "MotionOfKind",
    "MotionOptions",
    "Noise",
    "PairFriction",
    "Solver",
    "SpeedZones",
    "Split",
    "State",
    "System",
    "Tie",
    "Trajectory",
    "accelerations",
    "angular_velocity",
    "contact_forces",
    "motions",
    "pair_coordinates",
    "pair_velocities",
    "random_field",
    "random_signal",
    "rotational_energy",
    "simulate",
    "step",
    "time_symbol",
    "velocities",
]

"""Curvilinear polyhedra: faces, corners, where an energy comes to rest and why, and motion on them.

The names below are loaded when they are first used, so that importing the package costs NumPy
and little more.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from polycorner.errors import PolycornerError, SolverError
    from polycorner.geometry.functions import SmoothFunction
    from polycorner.geometry.manifold import Manifold
    from polycorner.minima.certificate import Certificate, certify
    from polycorner.minima.minimise import minimise, stationary_on
    from polycorner.minima.proof import Proof, prove
    from polycorner.minima.search import Minima, minima
    from polycorner.minima.sensitivity import Sensitivity, sensitivity
    from polycorner.minima.verdicts import Entrapment, Verdict
    from polycorner.motion.events import Event, EventKind
    from polycorner.motion.friction import (
        ConvexPolygon,
        ConvexSet,
        CutDisc,
        Disc,
        Ellipse,
        Interval,
    )
    from polycorner.motion.noise import Noise, Solver
    from polycorner.motion.reference import reference_step
    from polycorner.motion.simulate import simulate, step
    from polycorner.motion.system import Friction, State, System, velocities
    from polycorner.motion.trajectory import Trajectory
    from polycorner.polyhedra.atlas import Completeness, Corner, Edge, Face, Skeleton
    from polycorner.polyhedra.polyhedron import AllOf, AnyOf, Polyhedron
    from polycorner.polyhedra.skeleton import resume, skeleton
    from polycorner.polyhedra.strata import LocalType, Stratum, stratum_at
    from polycorner.polyhedra.symmetry import Element, Symmetry
    from polycorner.polyhedra.tracing import traced
    from polycorner.polyhedra.walks import End

__version__ = "0.1.0"

_HOMES = {
    "PolycornerError": "errors",
    "SolverError": "errors",
    "SmoothFunction": "geometry.functions",
    "Manifold": "geometry.manifold",
    "Certificate": "minima.certificate",
    "certify": "minima.certificate",
    "minimise": "minima.minimise",
    "stationary_on": "minima.minimise",
    "Proof": "minima.proof",
    "prove": "minima.proof",
    "Minima": "minima.search",
    "Sensitivity": "minima.sensitivity",
    "sensitivity": "minima.sensitivity",
    "Entrapment": "minima.verdicts",
    "Verdict": "minima.verdicts",
    "Event": "motion.events",
    "EventKind": "motion.events",
    "ConvexPolygon": "motion.friction",
    "ConvexSet": "motion.friction",
    "CutDisc": "motion.friction",
    "Disc": "motion.friction",
    "Ellipse": "motion.friction",
    "Interval": "motion.friction",
    "Noise": "motion.noise",
    "Solver": "motion.noise",
    "reference_step": "motion.reference",
    "simulate": "motion.simulate",
    "step": "motion.simulate",
    "Friction": "motion.system",
    "State": "motion.system",
    "System": "motion.system",
    "velocities": "motion.system",
    "Trajectory": "motion.trajectory",
    "Completeness": "polyhedra.atlas",
    "Corner": "polyhedra.atlas",
    "Edge": "polyhedra.atlas",
    "Face": "polyhedra.atlas",
    "Skeleton": "polyhedra.atlas",
    "End": "polyhedra.walks",
    "AllOf": "polyhedra.polyhedron",
    "AnyOf": "polyhedra.polyhedron",
    "Polyhedron": "polyhedra.polyhedron",
    "resume": "polyhedra.skeleton",
    "skeleton": "polyhedra.skeleton",
    "LocalType": "polyhedra.strata",
    "Stratum": "polyhedra.strata",
    "stratum_at": "polyhedra.strata",
    "Element": "polyhedra.symmetry",
    "Symmetry": "polyhedra.symmetry",
    "traced": "polyhedra.tracing",
}

__all__ = [
    "AllOf",
    "AnyOf",
    "Certificate",
    "Completeness",
    "ConvexPolygon",
    "ConvexSet",
    "Corner",
    "CutDisc",
    "Disc",
    "Edge",
    "Element",
    "Ellipse",
    "End",
    "Entrapment",
    "Event",
    "EventKind",
    "Face",
    "Friction",
    "Interval",
    "LocalType",
    "Manifold",
    "Minima",
    "Noise",
    "PolycornerError",
    "Polyhedron",
    "Proof",
    "Sensitivity",
    "Skeleton",
    "SmoothFunction",
    "Solver",
    "SolverError",
    "State",
    "Stratum",
    "Symmetry",
    "System",
    "Trajectory",
    "Verdict",
    "certify",
    "minima",
    "minimise",
    "prove",
    "reference_step",
    "resume",
    "sensitivity",
    "simulate",
    "skeleton",
    "stationary_on",
    "step",
    "stratum_at",
    "traced",
    "velocities",
]


def __getattr__(name: str) -> object:
    if name == "minima":  # a room that is called like a verb
        return import_module("polycorner.minima")
    if name not in _HOMES:
        msg = f"module 'polycorner' has no attribute {name!r}"
        raise AttributeError(msg)
    value = getattr(import_module(f"polycorner.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])

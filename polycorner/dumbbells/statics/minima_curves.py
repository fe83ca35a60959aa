"""Curves of ``t/r`` and ``l/r`` on which a minimum of a pair changes, at one ``l/R``.

They are curves of events of equilibria that are followed over the rod's radius and continued over
the length.  Two kinds of minima have to be made isolated before.

*More contacts than forces determine* (``crossed 211``): the gradients of its five contacts have one
relation, and the forces are an interval.  Each end of it is the only choice without one contact,
and is followed where that is left out.  The minimum changes at the latest where both ends do.

*Rod on rod* (``crossed``): the upper dumbbell may shift along the lower one.  It is followed with
the shift held, up to where it no longer lies level, and so are the ends of the interval of shifts
that have room: corners of the set of level crossings, which vanish where the interval does.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from polycorner.branches import Diagram, EventCurve, branches, event_curves
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.statics.minima import kind_of
from polycorner.formulas import SmoothFunction
from polycorner.minimisation import Certificate, certify, minimise
from polycorner.polyhedra import AllOf, Polyhedron, Symmetry
from polycorner.toolkit import TOLERANCE, Array

SHIFT = Symmetry(lambda _: np.array([[0.0, 1, 0, 0, 1, 0]]))  # along the drum


@dataclass(frozen=True)
class Rectangle:
    """Rods and lengths at one ``l/R``, in ball radii."""

    curvature: float
    rods: tuple[float, float]
    lengths: tuple[float, float]

    def contains(self, rod: float, length: float) -> bool:
        """Whether a place lies in it."""
        (a, b), (c, d) = self.rods, self.lengths
        return a <= rod <= b and c <= length <= d


def change_events(start: Certificate, within: Rectangle) -> Diagram:
    """Return a minimum over the rod's radius, with the events at which something stable ends."""
    found = branches(start, "t", within.rods, symmetry=SHIFT)
    stable = [k for k, arc in enumerate(found.arcs) if arc.stable]
    events = tuple(event for event in found.events if {*event.arcs}.intersection(stable))
    return replace(found, events=events)


def change_curves(found: Diagram, length: float, within: Rectangle) -> tuple[EventCurve, ...]:
    """Return the curves of a diagram's events, in the plane of ``t/r`` and ``l/r``."""
    rates = {"l": 1.0, "R": 1.0, "rho": 1.0}
    if within.curvature:
        rates |= {"R": 1 / within.curvature, "rho": 1 / within.curvature}
    known = found.problem.parameter_values
    change = {name: rate for name, rate in rates.items() if name in known}
    low, high = within.lengths
    followed = event_curves(found, change, (low - length, high - length), symmetry=SHIFT)
    moved = np.array([0.0, length])
    return tuple(replace(c, parameters=c.parameters + moved) for c in followed.curves)


def isolated(pair: DumbbellPair, minimum: Certificate) -> Iterator[Certificate]:
    """Yield equilibria that are isolated, and end where the minimum does."""
    if kind_of(minimum) == "crossed":
        yield from _crossed(pair, minimum.point)
    elif minimum.analysis.independent:
        yield minimum
    else:
        yield from _determined(pair, minimum)


def _determined(pair: DumbbellPair, minimum: Certificate) -> Iterator[Certificate]:
    """Yield the minimum with just as many contacts as forces determine."""
    scales, q = np.array(pair.manifold.scales), minimum.point
    gaps = {gap.name: gap for gap in pair.polyhedron.functions}
    gradients = {name: gaps[name].gradient(q) * scales for name in minimum.active}
    pull = pair.energy.gradient(q) * scales
    rank = np.linalg.matrix_rank(np.array([*gradients.values()]), tol=TOLERANCE)
    for names in combinations(minimum.active, int(rank)):
        matrix = np.array([gradients[name] for name in names]).T
        forces, left, rank, _ = np.linalg.lstsq(matrix, pull)
        if rank == len(names) and (forces > TOLERANCE).all() and (left < TOLERANCE**2).all():
            kept = [g for name, g in gaps.items() if name in names or name not in minimum.active]
            yield certify(Polyhedron(pair.manifold, AllOf(*kept)), pair.energy, q)


def _crossed(pair: DumbbellPair, q: Array) -> Iterator[Certificate]:
    """Yield a level crossing with its shift held, and the ends of the interval of shifts."""
    import sympy

    manifold, functions = pair.manifold, [*pair.polyhedron.functions]
    phi1, eta1, theta1, phi2, eta2, theta2 = manifold.symbols
    flat = np.abs(np.sin(q[[2, 5]]))
    lower, upper = (theta1, theta2) if flat[0] < flat[1] else (theta2, theta1)
    zeros = {"first": phi1, "second": phi2, "lower": lower}
    level = [SmoothFunction(name, sympy.sin(zero), manifold) for name, zero in zeros.items()]
    (contact,) = (gap for gap in functions if gap.name == "ab")
    others = AllOf(*(gap for gap in functions if gap is not contact))
    for side in (1, -1):
        energy = SmoothFunction("energy", side * (eta2 - eta1), manifold)
        yield minimise(Polyhedron(manifold, others, AllOf(*level, contact)), energy, q)
    held = SmoothFunction("shift", eta2 - eta1 - float(q[4] - q[1]), manifold)
    wide = Polyhedron(manifold, contact, AllOf(*level, held))
    side = -1 if np.cos(q[5 if upper is theta2 else 2]) > 0 else 1
    yield minimise(wide, SmoothFunction("energy", side * sympy.cos(upper), manifold), q)

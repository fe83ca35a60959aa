"""Arcs as chains of tubes, along which nothing vanishes but at their ends.

Along an arc these are watched: the open inequalities, the multipliers of the held ones and of the
energy, the distances of the parameter from both ends of its interval, and its derivative.  What
vanishes at an end is shown to be monotone on the tubes next to it, all else to be positive on every
tube.  As what is monotone is positive at the glue to the next tube, it is positive on the whole arc
and vanishes once, in the last tube, where the event is shown to be (:mod:`.enclosed_events`).

The parameter's derivative and the energy's multiplier do not vanish along the arc, so that its KKT
matrix is regular and the index is the same everywhere: ``J x' = 0`` with ``t' = 0`` is a vector
that the KKT matrix annihilates.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from polycorner.branches.proof_options import BranchProofOptions
from polycorner.branches.system import Face
from polycorner.branches.tubes import (
    CurveSystem,
    Setting,
    Tube,
    joined,
    point,
    tube,
)
from polycorner.intervals.balls import Ball, ball, balls, middles
from polycorner.intervals.enclosures import Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.kkt import bordered, newton
from polycorner.proofs.lists.faces import inertia
from polycorner.spaces.manifold import Array


class Watched:
    """What is watched, by number: functions, then what follows them.

    These are the energy's multiplier, the distances of the parameter from the start and the end of
    its interval, which are ``low`` and ``high``, and its derivative, ``turn``.
    """

    def __init__(self, inequalities: int, low: Fraction, high: Fraction) -> None:
        m = inequalities
        self.inequalities, self.low, self.high = m, low, high
        self.energy, self.start, self.end, self.turn = m, m + 1, m + 2, m + 3

    def at(self, setting: Setting, face: Face, x: "Sequence[Ball]") -> "list[Ball]":
        """Return enclosures of all that is watched but the derivative, on a box of unknowns."""
        box = Box([*x[: len(setting.units)], ball(0)])
        values = setting.formulas.values(box, range(self.inequalities))
        return self._assembled(setting, face, x, values)

    def values(self, tube: Tube) -> "list[Ball]":
        """Return enclosures of all that is watched, along a tube."""
        setting, v = tube.system.setting, tube.velocity
        found = self._assembled(
            setting, tube.face, tube.solution, tube.values(range(self.inequalities))
        )
        return [*found, ball(0, 1) if v is None else self.by_time(setting, v)]

    def _assembled(
        self, setting: Setting, face: Face, x: "Sequence[Ball]", found: "list[Ball]"
    ) -> "list[Ball]":
        d = len(setting.units)
        for place, i in enumerate(face, d):
            found[i] = x[place]
        t = setting.time(x[setting.n : d])
        return [*found, x[-1], t - ball(self.low), ball(self.high) - t]

    def rate(self, tube: Tube, which: int) -> "Ball | None":
        """Return an enclosure of the derivative of something that is watched, by the pin."""
        setting, v = tube.system.setting, tube.velocity
        if v is None:
            return None
        if which in tube.face:
            return v[tube.system.dimension + tube.face.index(which)]
        if which < self.inequalities:
            return tube.rate(which)
        if which == self.energy:
            return v[-1]
        if which == self.turn:
            a = tube.acceleration
            return None if a is None else self.by_time(setting, a)
        t = self.by_time(setting, v)
        return t if which == self.start else -t

    @staticmethod
    def by_time(setting: Setting, x: "Sequence[Ball]") -> "Ball":
        """Return the derivative of the parameter, of those of all unknowns."""
        k = setting.moved
        return x[k] / ball(setting.rates[k - setting.n])


@dataclass(frozen=True, eq=False)
class EnclosedArc:
    """What is shown of an arc.

    Attributes
    ----------
    face : tuple of int
    tubes : tuple of Tube
    ends : (array, array)
        Approximate unknowns at both ends.
    zeros : (frozenset of int, frozenset of int)
        What vanishes there.
    reached : (bool, bool)
        Whether the tubes go to its start and its end.
    index : int
        Of the tubes; -1 where it is not shown.
    reason : str
        What is not shown; empty if nothing.
    nodes : tuple of array
        Approximate unknowns at the ends of the tubes.
    """

    face: Face
    tubes: tuple[Tube, ...]
    ends: tuple[Array, Array]
    zeros: tuple[frozenset[int], frozenset[int]]
    reached: tuple[bool, bool]
    index: int
    reason: str
    nodes: tuple[Array, ...] = ()


def enclosed_arc(
    system: CurveSystem,
    points: Sequence[Array],
    zeros: tuple[frozenset[int], frozenset[int]],
    watched: Watched,
    options: BranchProofOptions,
) -> EnclosedArc:
    """Return the chain of tubes along approximate points of an arc, in ascending parameter."""
    units, tubes, flags = np.array(system.units), list[Tube](), list[_Ways]()
    ends, nodes = (points[0], points[-1]), list[Array]()

    def result(reached: tuple[bool, bool], reason: str) -> EnclosedArc:
        index = _index(tubes, options.bits)
        reason = reason or ("" if index >= 0 else "the index is not shown")
        places = (*nodes, points[-1])
        return EnclosedArc(system.face, tuple(tubes), ends, zeros, reached, index, reason, places)

    waiting = [list(points)]
    missed = ""
    while waiting:
        course = waiting.pop()
        one, two = course[0], course[-1]
        found = tube(system, one, two, options)
        ways = found if isinstance(found, Undecided) else _ways(found, zeros, watched)
        if isinstance(found, Tube) and isinstance(ways, _Ways):
            if tubes and not joined(tubes[-1], found, one, options.bits):
                ways = Undecided("two tubes", "they are not shown to be pieces of one curve")
            else:
                tubes.append(found)
                nodes.append(one)
                flags.append(ways)
                continue
        if len(course) == 2 and np.linalg.norm((two - one) / units) >= options.shortest:
            middle = _between(system, one, two, options.bits)
            course = course if middle is None else [one, middle, two]
        k = len(course) // 2
        if len(course) > 2 and len(tubes) < options.most_tubes:
            waiting += [course[k:], course[: k + 1]]
        elif (missed or not tubes) and waiting:
            missed = f"up to {_time(system, two):.6g}: {ways}"
            tubes.clear()
            flags.clear()
        else:
            return result(
                (not missed, False), f"{missed or f'from {_time(system, one):.6g} on: {ways}'}"
            )
    if not _ordered(flags):
        missed = missed or "what vanishes at one end is not shown to be positive before"
    return result((not missed, True), missed)


def _time(system: CurveSystem, x: Array) -> float:
    setting = system.setting
    return float(setting.time(balls(x[setting.n : system.dimension])).mid())


@dataclass(frozen=True)
class _Ways:
    """What grows from zero at the start of an arc, and what falls to zero at its end."""

    grows: frozenset[int]
    falls: frozenset[int]


def _ways(
    found: Tube, zeros: tuple[frozenset[int], frozenset[int]], watched: Watched
) -> _Ways | Undecided:
    grows, falls = set[int](), set[int]()
    for k, value in enumerate(watched.values(found)):
        if value > 0:
            continue
        rate = watched.rate(found, k) if k in zeros[0] | zeros[1] else None
        if rate is not None and k in zeros[0] and rate > 0:
            grows.add(k)
        elif rate is not None and k in zeros[1] and rate < 0:
            falls.add(k)
        else:
            return Undecided(_named(found, watched, k), "it may vanish along the arc")
    return _Ways(frozenset(grows), frozenset(falls))


def _named(found: Tube, watched: Watched, which: int) -> str:
    names = found.system.setting.formulas.names
    if which < watched.inequalities:
        return f"the multiplier of {names[which]}" if which in found.face else names[which]
    others = (
        "the energy's multiplier",
        "the start of the interval",
        "the end of the interval",
        "the derivative of the parameter",
    )
    return others[which - watched.energy]


def _ordered(flags: Sequence[_Ways]) -> bool:
    """Whether nothing that falls to the end of an arc grows from its start later on."""
    fallen = set[int]()
    for ways in flags:
        if ways.grows & fallen:
            return False
        fallen |= ways.falls
    return True


def _between(system: CurveSystem, one: Array, two: Array, bits: int) -> Array | None:
    """Return an approximate point of the curve between two of its points."""
    units, middle = np.array(system.units), (one + two) / 2
    pin = system.pinned(((two - one) / units**2).tolist(), middle.tolist())
    found = newton(pin, balls(middle), bits=bits)
    if isinstance(found, Undecided):
        return None
    x = middles(found)
    near = np.linalg.norm((x - middle) / units) < np.linalg.norm((two - one) / units)
    return x if near else None


def _index(tubes: Sequence[Tube], bits: int) -> int:
    """Return the index at the middle of some tube: the same on all of them."""
    for each in sorted(tubes, key=lambda t: -abs(float(t.solution[-1].mid())))[:3]:
        predictor = each.enclosure.predictor
        there = point(each.system, predictor.centre, bits)
        if isinstance(there, Undecided):
            continue
        rows, n = there.linear.rows, each.system.setting.n
        matrix = bordered(there.linear.curvature, rows)
        for row in matrix[:n]:
            row[n:] = [-x for x in row[n:]]
        found = inertia(matrix)
        if found is not None:
            return found[0] - len(rows)
    return -1

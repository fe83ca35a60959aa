"""Arcs of equilibria as chains of tubes, along which nothing vanishes but at their ends.

*Watched* are the functions that are open, the multipliers of those that are held and of the
energy, the distances of the parameter from both ends of its interval, and its derivative along the
arc, in this order, those of a function under its number.  On each tube each of them is positive;
or it vanishes at the start of the arc and grows, or at its end and falls.  As nothing falls before
it grows, all are positive between the ends.

Between them ``mu_0 > 0`` and ``t' > 0``, so that the KKT matrix is regular: a vector ``(u, v)``
that it annihilates gives one, ``(u, 0, v + s mu)``, that the derivatives of the equations
annihilate, and which is not along the curve.  The index, the number of negative eigenvalues of the
Lagrangian's Hessian along the face, is therefore the same on all of the arc.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from flint import arb

from .balls import NotShownError, dot, need, negatives_along, places
from .curves import StoredFace, StoredFamily, Tube, between
from .statement import zero_near

HALVINGS = 6  # of the way between two points of a file
GROWS, FALLS = 1, -1


class Watched:
    """Numbers of what is watched beside the functions."""

    def __init__(self, family: StoredFamily) -> None:
        m = family.p.m
        self.m, self.energy, self.start, self.end, self.turn = m, m, m + 1, m + 2, m + 3
        self.count = m + 4
        self.low, self.high = arb(family.low), arb(family.high)

    def values(self, tube: Tube) -> list[arb]:
        """Enclose all that is watched on a tube."""
        face = tube.face
        held = {i: tube.x[face.d + k] for k, i in enumerate(face.active)}
        found = [held[i] if i in held else tube.value(i) for i in range(self.m)]
        t = tube.x[face.n]
        return [*found, tube.x[-1], t - self.low, self.high - t, tube.velocity[face.n]]

    def rate(self, tube: Tube, which: int) -> arb:
        """Enclose the derivative of something that is watched."""
        face = tube.face
        if which in face.active:
            return tube.velocity[face.d + face.active.index(which)]
        if which < self.m:
            return tube.rate(which)
        if which == self.energy:
            return tube.velocity[-1]
        if which == self.turn:
            return tube.acceleration()[face.n]
        t = tube.velocity[face.n]
        return t if which == self.start else -t

    def signs(self, tube: Tube) -> list[int]:
        """Return the signs of all but the derivative of the parameter: 0 where it may change.

        Of these the rates have to be positive or negative.
        """
        found = [1 if x > 0 else -1 if x < 0 else 0 for x in self.values(tube)[: self.turn]]
        if -1 not in found:
            rates = [self.rate(tube, which) for which, sign in enumerate(found) if not sign]
            need(all(x > 0 or x < 0 for x in rates), "something may vanish twice on a tube")
        return found


class StoredArc:
    """An arc of a file: a face, points along it, and what vanishes at its ends."""

    def __init__(self, family: StoredFamily, record: dict[str, Any], name: str) -> None:
        self.name, self.watched = name, Watched(family)
        active = places(record["active"], family.p.m, f"{name}: active functions")
        need(all(a < b for a, b in pairwise(active)), f"{name}: active")
        self.face = StoredFace(family, active)
        zeros = [places(some, self.watched.count, f"{name}: zeros") for some in record["zeros"]]
        need(len(zeros) == 2, f"{name}: zeros at both ends")
        self.zeros = [frozenset(some) for some in zeros]
        nodes = [[arb(float.fromhex(text)) for text in row] for row in record["points"]]
        fine = all(len(row) == self.face.size and all(x.is_finite() for x in row) for row in nodes)
        need(fine and len(nodes) > 1, f"{name}: points")
        self.nodes = nodes
        self.tubes, self.glue, self.ways = list[Tube](), list[list[arb]](), list[dict[int, int]]()
        try:
            for one, two in pairwise(nodes):
                self.follow(one, two, HALVINGS)
            self.check_order()
        except NotShownError as error:
            msg = f"{name}: {error}"
            raise NotShownError(msg) from None
        self.ends: list[list[arb]] = [[], []]  # the unknowns at the events

    def follow(self, one: Sequence[arb], two: Sequence[arb], halvings: int) -> None:
        """Go on from one point to the next, in several tubes where needed."""
        try:
            tube = Tube.between(self.face, one, two)
            ways, shared = self.signs(tube), self.shared(tube, one)
        except NotShownError:
            if not halvings:
                raise
            middle = between(self.face, one, two)
            self.follow(one, middle, halvings - 1)
            self.follow(middle, two, halvings - 1)
            return
        self.glue += shared
        self.tubes.append(tube)
        self.ways.append(ways)

    def shared(self, tube: Tube, at: Sequence[arb]) -> list[list[arb]]:
        """Return the point at which the curve goes on from the last tube to the next."""
        if not self.tubes:
            return []
        last = self.tubes[-1]
        x = zero_near(self.face.pinned(last.normal, at), at)
        need(last.contains(x) and tube.contains(x), "two tubes are not shown to have one curve")
        onwards = dot(tube.normal, last.velocity_at(x))
        need(onwards > 0, "the curve is not shown to go on in one direction")
        return [x]

    def signs(self, tube: Tube) -> dict[int, int]:
        """Return what grows from zero at the start or falls to zero at the end, by number."""
        ways = dict[int, int]()
        for which, value in enumerate(self.watched.values(tube)):
            if value > 0:
                continue
            some = [which in zeros for zeros in self.zeros]
            need(any(some), f"{self.words(which)} may vanish")
            rate = self.watched.rate(tube, which)
            grows, falls = some[0] and rate > 0, some[1] and rate < 0
            need(grows or falls, f"{self.words(which)} may vanish more than once")
            ways[which] = GROWS if grows else FALLS
        return ways

    def words(self, which: int) -> str:
        w = self.watched
        if which < w.m:
            return (
                f"the multiplier of function {which}"
                if which in self.face.active
                else f"function {which}"
            )
        others = (
            "the multiplier of the energy",
            "the distance from the start of the interval",
            "the distance from its end",
            "the derivative of the parameter",
        )
        return others[which - w.m]

    def check_order(self) -> None:
        """Check that nothing grows after it fell, and that points come one after another."""
        fallen = set[int]()
        for ways in self.ways:
            grown = {which for which, way in ways.items() if way == GROWS}
            need(not grown & fallen, "something may vanish between the ends")
            fallen |= ways.keys() - grown
        for tube, one, two in zip(self.tubes[1:], self.glue, self.glue[1:], strict=False):
            need(tube.place(one) < tube.place(two), "the points are not in order")

    def end(self, side: int) -> Tube:
        return self.tubes[-side]

    def near(self, side: int) -> list[arb]:
        """Return approximate unknowns at an end."""
        return self.nodes[-side]

    def close(self, side: int, x: list[arb]) -> None:
        """Check that the arc comes from a point, or ends there, behind all others."""
        need(self.end(side).contains(x), f"{self.name}: is not shown to end at its event")
        need(not self.ends[side], f"{self.name}: has two events at one end")
        self.ends[side] = x
        if self.ends[1 - side]:
            course = [self.ends[0], *self.glue, self.ends[1]]
            for tube, one, two in zip(self.tubes, course, course[1:], strict=False):
                need(tube.place(one) < tube.place(two), f"{self.name}: its ends are not in order")

    def index(self) -> int:
        """Return the index, once both ends are known."""
        course = [self.ends[0], *self.glue, self.ends[1]]
        face, most = self.face, max(self.tubes, key=lambda tube: tube.centre[-1].mid())
        for tube in (most, *self.tubes):
            k = self.tubes.index(tube)
            if not tube.place(course[k]) < 0 < tube.place(course[k + 1]):
                continue
            try:
                _, jacobian = face.at(tube.point())
            except NotShownError:
                continue
            n = face.n
            *rows, _ = [row[:n] for row in jacobian]
            found = negatives_along(rows[:n], rows[n:])
            if found is not None:
                return found
        msg = f"{self.name}: the index is not decided"
        raise NotShownError(msg)

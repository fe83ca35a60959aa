"""Events in balls: where they are, and that exactly the arcs of a diagram leave them.

*Contacts.*  Let ``W`` be what vanishes at a point where the gradients of all functions that vanish
are independent; several only where a symmetry of the formulas takes them to each other and the
point to itself.  A stationary point nearby has positive multipliers on ``F + V``, with ``F`` the
functions whose multipliers do not vanish there and ``V`` a part of ``W``; for each ``V`` the
equations have one curve through the point, along which what belongs to ``W`` has a derivative other
than zero: an arc leaves along it where all of them grow.

*A corner with one function too many.*  Let ``A`` hold at a point, one function more than there are
coordinates.  A stationary point nearby is that of some ``A`` without ``l``, with the multipliers of
the corner, none of which vanishes: an arc leaves where they are positive and ``f_l`` grows.

*Dependent gradients.*  Where the energy's multiplier vanishes and those of ``A`` are positive and
are the only ones, all stationary points nearby have positive multipliers on ``A``: they are on the
curve, on the side where the energy's multiplier grows.  If the Hessian of ``sum mu_i f_i`` along
the face is negative definite, the polyhedron is a point there.

*A fold.*  Where the parameter's derivative vanishes and the second does not, the two sides of the
curve are the two arcs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np

from polycorner.branches.diagram import BranchKind
from polycorner.branches.enclosed_arcs import EnclosedArc, Watched
from polycorner.branches.proof_options import BranchProofOptions
from polycorner.branches.system import Face
from polycorner.branches.tubes import (
    CurveSystem,
    Setting,
    Tube,
    point,
    tube_about,
)
from polycorner.intervals.balls import Ball, ball, balls, dot, middles
from polycorner.intervals.enclosures import Undecided
from polycorner.proofs.definite import is_regular, pivots, tangent_form
from polycorner.proofs.kkt import Enclosure
from polycorner.proofs.witnesses import UnshownError, decided, need
from polycorner.spaces.manifold import Array


@dataclass(frozen=True, eq=False)
class Through:
    """The curve of a face through an event.

    Attributes
    ----------
    face : tuple of int
    at : list of Ball
        Its unknowns at the event.
    direction : array
        Approximate direction of the curve, in units.
    weak : tuple of int
        What is watched and vanishes there.
    """

    face: Face
    at: "list[Ball]"
    direction: Array
    weak: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class EnclosedEvent:
    """What is shown of an event.

    Attributes
    ----------
    where : list of Ball
        Enclosures of its coordinates and parameters; empty where there are none.
    kind : BranchKind
        What it is shown to be.
    reason : str
        What is not shown; empty if nothing.
    curves : tuple of Through
        Of all faces on which there may be stationary points nearby.
    """

    where: "list[Ball]"
    kind: BranchKind = BranchKind.UNDECIDED
    reason: str = ""
    curves: "tuple[Through, ...]" = ()


@dataclass(frozen=True, eq=False)
class End:
    """An end of an arc: of its start (0) or its end (1)."""

    arc: EnclosedArc
    side: int

    @property
    def zeros(self) -> frozenset[int]:
        """What vanishes there."""
        return self.arc.zeros[self.side]

    @property
    def near(self) -> Array:
        """Approximate unknowns there."""
        return self.arc.ends[self.side]

    @property
    def tube(self) -> Tube:
        """The last tube."""
        return self.arc.tubes[-self.side]

    def holds(self, x: "Sequence[Ball]") -> bool:
        """Whether a solution on the arc's face is shown to lie on its curve."""
        return self.tube.contains(x)


def enclosed_event(
    setting: Setting, ends: Sequence[End], watched: Watched, options: BranchProofOptions
) -> EnclosedEvent:
    """Return the event at which some arcs end, by what vanishes there.

    Raises
    ------
    UnshownError
        Where it is not shown.
    """
    need(all(end.arc.reached[end.side] for end in ends), "an arc is not proved to come near")
    about = _Event(setting, ends, watched, options)
    zeros = frozenset[int]().union(*(end.zeros for end in ends))
    if zeros in ({watched.start}, {watched.end}):
        return about.end()
    if zeros == {watched.turn}:
        return about.fold()
    if watched.energy in zeros:
        return about.dependent()
    contacts = sorted(k for k in zeros if k < watched.inequalities)
    known = contacts and len(contacts) == len(zeros)
    need(known, "events of this kind are followed, not proved")
    return about.contacts(contacts)


@dataclass(frozen=True, eq=False)
class Arm:
    """An arc that is shown to leave, with the point on its face."""

    face: Face
    side: int  # 0 where the parameter grows away from the event
    at: "list[Ball]"


class _Event:
    def __init__(
        self, setting: Setting, ends: Sequence[End], watched: Watched, options: BranchProofOptions
    ) -> None:
        self.setting, self.ends, self.watched = setting, ends, watched
        self.options = options
        self.d = len(setting.units)
        self.curves: list[Through] = []

    def end(self) -> EnclosedEvent:
        """Show an end of the interval."""
        (end,) = self.ends[:1]
        t = self.watched.high if self.watched.end in end.zeros else self.watched.low
        k = self.setting.moved
        value = self.setting.at_time(t)[k - self.setting.n]
        system = CurveSystem(self.setting, end.arc.face).coordinate(k, value)
        found = point(system, balls(end.near), self.options.bits)
        if isinstance(found, Undecided) or len(self.ends) != 1:
            msg = f"the end of the interval: {found}"
            raise UnshownError(msg)
        return self._told(found, [Arm(end.arc.face, end.side, found.solution)], BranchKind.END)

    def fold(self) -> EnclosedEvent:
        """Show a fold."""
        alike = {(end.side, end.arc.face) for end in self.ends}
        need(len(self.ends) == 2 and len(alike) == 1, "two arcs of one face have to meet at a fold")
        one, two = self.ends
        system = one.tube.system
        for reach in self.options.near:
            about = tube_about(system.pinned(system.normal, one.near.tolist()), one.near, reach,
                               self.options.bits)  # fmt: skip
            if isinstance(about, Undecided):
                continue
            rate = self.watched.rate(about, self.watched.turn)
            centre = point(about.system, about.enclosure.predictor.centre, self.options.bits)
            if rate is None or isinstance(centre, Undecided) or rate.contains(0):
                continue
            turn = self.watched.values(Tube(centre))[self.watched.turn]
            away = [e.tube.velocity for e in self.ends]
            if abs(turn) < reach * abs(rate) and all(v is not None for v in away):
                # Away from the fold the pin grows along one arc and falls along the other.
                onwards = [dot(system.normal, v or ()) for v in away]
                x = about.solution
                if onwards[0] * onwards[1] < 0 and one.holds(x) and two.holds(x):
                    return EnclosedEvent(x[: self.d], BranchKind.FOLD)
        msg = "the parameter is not shown to turn back once"
        raise UnshownError(msg)

    def dependent(self) -> EnclosedEvent:
        """Show an event at which the energy's multiplier vanishes."""
        end, n = self.ends[0], self.setting.n
        system = CurveSystem(self.setting, end.arc.face)
        found = self._point(system.coordinate(system.size - 1), end.near)
        there = Tube(found)
        others = self.watched.values(there)[: self.watched.energy]
        need(all(x > 0 for x in others), "more than the energy's multiplier vanishes")
        # Any regular pin shows that the equations have one curve there, and no other relation.
        self._through(system, found.solution, [self.watched.energy])
        need(there.velocity is not None, "the equations are singular there")
        kind = BranchKind.DEPENDENT
        # One of the inequalities' gradients depends on the others: which one does not matter.
        form = tangent_form(found.linear.curvature, found.linear.rows[1:], [1.0] * n)
        left = None if form is None else pivots(form)
        if left is not None and len(left) == len(form or ()) and all(x > 0 for x in left):
            kind = BranchKind.VANISHES
        else:
            falls = left is not None and any(x < 0 for x in left)
            need(falls, "whether the polyhedron is a point is not shown")
        return self._told(found, [Arm(end.arc.face, end.side, found.solution)], kind)

    def contacts(self, weak: list[int]) -> EnclosedEvent:
        """Show an event at which multipliers vanish and functions do."""
        faces = [set(end.arc.face) for end in self.ends]
        full = tuple(sorted(set.union(set(weak), *faces)))
        if len(full) + len(self.setting.equations) > self.setting.n:
            return self._corner(full)
        system = CurveSystem(self.setting, full)
        place = self.d + full.index(weak[0])
        near = self._unknowns(full, self.ends[0])
        found = self._point(system.coordinate(place), near)
        together = all(self._together(full, weak[0], k, found.solution) for k in weak[1:])
        need(together, "no symmetry shows that several functions vanish at once")
        values = self.watched.values(Tube(found))[: self.watched.energy + 1]
        alone = all(x > 0 for k, x in enumerate(values) if k not in weak)
        need(alone, "more than the named functions may vanish")
        arms: list[Arm] = []
        for v in chain.from_iterable(combinations(weak, r) for r in range(len(weak) + 1)):
            face = tuple(i for i in full if i not in weak or i in v)
            x = [found.solution[k] for k in self._places(full, face)]
            arms += self._arms(face, x, weak)
        return self._told(found, arms, _kind(arms))

    def _together(self, full: Face, first: int, other: int, x: "list[Ball]") -> bool:
        """Whether some symmetry shows that two multipliers are the same at a point of a face.

        It takes the face to itself and keeps the parameter, of which the solution is a function
        that is unique nearby: where the image of the point is near, it is the point.
        """
        system = CurveSystem(self.setting, full)
        normal, k = [0.0] * system.size, self.setting.moved
        normal[k] = 1 / system.units[k]
        middle, near, bits = middles(x), self.options.near[1], self.options.bits
        about = tube_about(system.pinned(normal, middle.tolist()), middle, near, bits)
        if isinstance(about, Undecided) or not about.contains(x) or self.setting.equations:
            return False
        for g in self.setting.images:
            if g.functions[other] == first and {g.functions[i] for i in full} == set(full):
                mu = [x[self.d + full.index(g.functions[i])] for i in full]
                image = [s * x[i] for i, s in zip(g.order, g.signs, strict=True)]
                if about.contains([*image, *x[len(image) : self.d], *mu, x[-1]]):
                    return True
        return False

    def _corner(self, full: Face) -> EnclosedEvent:
        held = len(full) + len(self.setting.equations)
        need(held == self.setting.n + 1, "several functions too many vanish")
        first: Enclosure | None = None
        arms: list[Arm] = []
        for gap in full:
            face = tuple(i for i in full if i != gap)
            system = CurveSystem(self.setting, face).closing(gap)
            near = null_unknowns(self.setting, face, self.ends[0].near[: self.d])
            found = self._point(system, near)
            first = first or found
            same = self._same_corner(full, first, found)
            need(same, "the corner is not shown to be a single point")
            values = self.watched.values(Tube(found))[: self.watched.energy + 1]
            alone = all(x > 0 for i, x in enumerate(values[:-1]) if i not in full)
            need(alone, "more than the named functions may vanish")
            mu = [*(values[i] for i in face), values[-1]]
            if all(x > 0 for x in mu):
                arms += self._arms(face, found.solution, [gap])
            else:
                need(any(x < 0 for x in mu), "a multiplier of a corner may vanish")
                self._through(system, found.solution, [gap])
        assert first is not None
        kind = BranchKind.VANISHES if len(arms) == 1 else _kind(arms)
        return self._told(first, arms, kind)

    def _same_corner(self, full: Face, one: Enclosure, two: Enclosure) -> bool:
        """Whether the functions vanish together at most once in the hull of two boxes."""
        pairs = zip(one.solution[: self.d], two.solution[: self.d], strict=True)
        hull = [a.union(b) for a, b in pairs]
        system = CurveSystem(self.setting, full).coordinate(0)
        linear = system.at([*hull, *[ball(0)] * len(system.rows)])
        if isinstance(linear, Undecided):
            return False
        return is_regular([row[: self.d] for row in linear.jacobian[self.setting.n : -2]])

    def _arms(self, face: Face, x: "list[Ball]", weak: Sequence[int]) -> list[Arm]:
        """Return the sides of a face's curve on which all that vanishes grows.

        The curve is cut where ``x`` is by a pin along its approximate direction.
        """
        system, reason = CurveSystem(self.setting, face), "a derivative may vanish"
        direction = self._through(system, x, weak)
        if direction is None:
            raise UnshownError(reason)
        near, bits = self.options.near[1], self.options.bits
        about = about_event(system, middles(x), direction, near, bits)
        if isinstance(about, Undecided) or not about.contains(x):
            raise UnshownError(reason)
        rates = [self.watched.rate(about, k) for k in weak]
        turn = self.watched.values(about)[self.watched.turn]
        known = [r for r in rates if r is not None and not r.contains(0)]
        need(len(known) == len(weak) and not turn.contains(0), reason)
        sides = [s for s in (1, -1) if all(s * r > 0 for r in known)]
        return [Arm(face, int(bool(s * turn < 0)), x) for s in sides]

    def _through(self, system: CurveSystem, x: "list[Ball]", weak: Sequence[int]) -> Array | None:
        direction = direction_at(system, x)
        if direction is not None:
            self.curves.append(Through(system.face, x, direction, tuple(weak)))
        return direction

    def _told(self, found: Enclosure, arms: Sequence[Arm], kind: BranchKind) -> EnclosedEvent:
        """Return the event if the arms that leave are those of the diagram, one for one."""
        left = list(self.ends)
        for arm in arms:
            same = [
                end for end in left
                if end.arc.face == arm.face and end.side == arm.side and end.holds(arm.at)
            ]  # fmt: skip
            names = ", ".join(self.setting.formulas.names[i] for i in arm.face) or "nothing"
            need(same, f"an arc with {names} active leaves, which is not in the diagram")
            left.remove(same[0])
        need(not left, "it is not shown that all of its arcs end there")
        return EnclosedEvent(found.solution[: self.d], kind, curves=tuple(self.curves))

    def _point(self, system: CurveSystem, near: Array) -> Enclosure:
        return decided(point(system, balls(near), self.options.bits))

    def _places(self, full: Face, face: Face) -> list[int]:
        """Return the places of the unknowns of a face among those of a larger one."""
        mu = [self.d + k for k, i in enumerate(full) if i in face]
        others = range(self.d + len(full), self.d + len(full) + len(self.setting.equations) + 1)
        return [*range(self.d), *mu, *others]

    def _unknowns(self, full: Face, end: End) -> Array:
        """Return the approximate unknowns of an arc's end on a larger face."""
        found = np.zeros(CurveSystem(self.setting, full).size)
        face = end.arc.face
        if not set(face) <= set(full):
            return found
        found[self._places(full, face)] = end.near
        return found


def _kind(arms: Sequence[Arm]) -> BranchKind:
    """Return the kind of an event of contacts, by the arcs that leave it."""
    if len(arms) != 2:
        return BranchKind.BRANCH if len(arms) > 2 else BranchKind.UNDECIDED
    if arms[0].side == arms[1].side:
        return BranchKind.CORNER_LIMIT
    before, after = sorted(arms, key=lambda arm: -arm.side)
    if len(before.face) == len(after.face):
        return BranchKind.EXCHANGE
    return BranchKind.OPENS if len(before.face) > len(after.face) else BranchKind.CLOSES


def about_event(
    system: CurveSystem, middle: Array, direction: Array, reach: float, bits: int
) -> Tube | Undecided:
    """Return the tube about a point on a curve, of a reach in units."""
    pinned = system.pinned((direction / np.array(system.units)).tolist(), middle.tolist())
    return tube_about(pinned, middle, reach, bits)


def direction_at(system: CurveSystem, x: "Sequence[Ball]") -> Array | None:
    """Return the unit tangent of a curve at a point, in units, approximately; None if none."""
    some = system.coordinate(0).at(x)
    if isinstance(some, Undecided):
        return None
    rows = middles(some.jacobian[:-1])
    if not np.isfinite(rows).all():
        return None
    return np.asarray(np.linalg.svd(rows * np.array(system.units))[2][-1])


def null_unknowns(setting: Setting, face: Face, place: Array) -> Array:
    """Return unknowns at a place, with the multipliers that nearly relate the gradients."""
    system = CurveSystem(setting, face).coordinate(0)
    x = [*balls(place), *[ball(0)] * len(system.rows)]
    linear = system.at(x)
    n, d = setting.n, len(setting.units)
    if isinstance(linear, Undecided):
        return np.concatenate([place, np.full(len(system.rows), np.nan)])
    slopes = middles([row[d:] for row in linear.jacobian[:n]])
    mu = np.linalg.svd(slopes)[2][-1]
    total = mu @ np.array([float(row not in setting.equations) for row in system.rows])
    return np.concatenate([place, mu / total if total else mu])

"""Pitchforks in balls: the symmetric curve, the two curves that break a symmetry, nothing else.

Let ``g`` be an involution that keeps the energy and the functions of a face, and ``x = s + e u``
with ``g s = s``, ``g u = -u`` (:mod:`~polycorner.branches.mirrors`).  The even equations
``F_s(s + e u)`` are even in ``e``; the odd ones are odd, so that ``F_a(s + e u) = e A(s, e u) u``
with ``A(s, a) = int_0^1 F_a'(s + r a) dr``.  With one component of ``u`` equal to 1, the equations

    ``F_s(s + e u) = 0``,  ``A(s, e u) u = 0``,  ``u_k = 1``

have as many unknowns ``(s, u)`` as equations, for each ``e``; at ``e = 0`` they say that the
linearisation has an odd kernel ([WernerSpence]).  Krawczyk's test shows one solution
for each ``e`` of an interval.  These are the *arms*: a change of the sign of ``e`` is ``g``.
As functions of ``e^2 / 2`` the equations have the derivatives ``F_s''(u, u)`` and ``F_a'''(u, u,
u) / 3`` at points between, which tell whether the parameter grows along the arms.

The *trunk* are the solutions with ``u = 0``: a curve of the even equations alone.

In a box all solutions are on these: those with ``a = 0`` on the trunk; any other has ``A(s, a) a =
0``, which encloses ``u = a / a_k``, and the equations above are regular between it and the arm.
Where the trunk is shown in this way not to have another zero of ``A(s, 0) u``, its KKT matrices are
regular beside the branch point.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import dropwhile
from typing import Any

import numpy as np

from polycorner.branches.diagram import BranchKind
from polycorner.branches.enclosed_arcs import Watched
from polycorner.branches.enclosed_events import EnclosedEvent, End, about_event, direction_at
from polycorner.branches.mirrors import Image, Mirror
from polycorner.branches.proof_options import BranchProofOptions
from polycorner.branches.system import Face
from polycorner.branches.tubes import CurveSystem, Setting, Tube, point
from polycorner.intervals.balls import (
    Ball,
    ball,
    balls,
    column,
    dot,
    entries,
    left_inverse,
    matrix,
    middle_inverse,
    middles,
    midpoints,
    square,
)
from polycorner.intervals.enclosures import Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.definite import is_regular
from polycorner.proofs.kkt import Enclosure, Linearisation, enclose, newton
from polycorner.proofs.witnesses import need
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property


@dataclass(frozen=True, eq=False)
class Divided:
    """The equations of a pitchfork, in adapted coordinates, for all ``e`` of an interval.

    Attributes
    ----------
    system : CurveSystem
    mirror : Mirror
    way : int
        The component of ``u`` that is 1.
    eps : Ball
        The interval, about 0.
    """

    system: CurveSystem
    mirror: Mirror
    way: int
    eps: "Ball"

    @property
    def dimension(self) -> int:
        """The number of unknowns that formulas read."""
        return self.system.dimension

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return self.system.size

    @property
    def units(self) -> tuple[float, ...]:
        """Unit of each unknown; odd ones are ratios to that which is 1."""
        units = self.system.units
        return tuple(u / units[self.way] if k in self.mirror.odd else u
                     for k, u in enumerate(units))  # fmt: skip

    def at(self, z: "Sequence[Ball]", p: "Sequence[Ball]" = ()) -> Linearisation | Undecided:
        """Return the equations and their derivatives on boxes of unknowns."""
        return self.linear(z, Box([*z[: self.dimension], *p]))

    def linear(self, z: "Sequence[Ball]", box: Box) -> Linearisation | Undecided:
        """Return the same; a joint enclosure is not used."""
        del box
        mirror, odd, u = self.mirror, self.mirror.odd_equations, self.mirror.vector(z)
        here, rows, change = self.system.at(mirror.point(z, 0)), self.jacobian(z), self.change(z)
        if isinstance(here, Undecided):
            return here
        if isinstance(rows, Undecided):
            return rows
        if isinstance(change, Undecided):
            return change
        even = mirror.sides(here.residual)
        along = mirror.sides([dot(row, u) for row in here.jacobian])
        half = square(self.eps) / 2
        left = [along[r] if r in odd else even[r] for r in range(self.size)]
        left = [x + half * y for x, y in zip(left, change, strict=True)]
        left[-1] = z[self.way] - 1
        return replace(here, residual=left, jacobian=rows)

    def jacobian(self, z: "Sequence[Ball]") -> "list[list[Ball]] | Undecided":
        """Return the derivatives of the equations."""
        mirror, odd = self.mirror, self.mirror.odd_equations
        near, turned = self.system.at(mirror.point(z, self.eps)), self.turned(z)
        if isinstance(near, Undecided):
            return near
        if isinstance(turned, Undecided):
            return turned
        rows, bent = mirror.adapted(near.jacobian), mirror.adapted(turned)
        for r, (row, more) in enumerate(zip(rows, bent, strict=True)):
            for c in range(self.size):
                if r in odd and c not in mirror.odd:
                    row[c] = more[c]
                elif r not in odd and c in mirror.odd:
                    row[c] *= self.eps
        return [*rows[:-1], [ball(int(c == self.way)) for c in range(self.size)]]

    def bend(self, *_: Any) -> Undecided:
        """Return nothing: the equations have no parameters that are predicted."""
        return Undecided("the equations of a pitchfork", "they have no predictor")

    def turned(self, z: "Sequence[Ball]") -> "list[list[Ball]] | Undecided":
        """Return ``F''(u, .)`` on all points between both arms."""
        x, u, box = self._between(z)
        return self.system.turned(x, u, box)

    def change(self, z: "Sequence[Ball]") -> "list[Ball] | Undecided":
        """Return the derivatives of the equations by ``e^2 / 2``."""
        (x, u, box), turned = self._between(z), self.turned(z)
        third = self.system.third(x, u, box)
        if isinstance(turned, Undecided):
            return turned
        if isinstance(third, Undecided):
            return third
        second = self.mirror.sides([dot(row, u) for row in turned])
        third = self.mirror.sides(third)
        odd = self.mirror.odd_equations
        return [third[r] / 3 if r in odd else second[r] for r in range(self.size)]

    def _between(self, z: "Sequence[Ball]") -> "tuple[list[Ball], list[Ball], Box]":
        x, u, d = self.mirror.point(z, self.eps), self.mirror.vector(z), self.dimension
        hull, slopes = [*x[:d], ball(0)], [[y] for y in (*u[:d], ball(0))]
        return x, u, Box(hull, hull, slopes, [ball(0)])


@dataclass(frozen=True, eq=False)
class Pitchfork:
    """A neighbourhood of a branch point in which all solutions are on four curves.

    Attributes
    ----------
    centre : list of Ball
        The branch point and the kernel there, in adapted coordinates.
    trunk : Tube
        Of the even equations, along which the parameter grows.
    arms : Enclosure
        Of adapted coordinates, for all ``e``.
    grows : bool
        Whether the parameter grows along the arms, away from the branch point.
    """

    centre: "list[Ball]"
    trunk: Tube
    arms: Enclosure
    grows: bool

    @property
    def divided(self) -> Divided:
        """The equations of the arms."""
        system: Any = self.arms.predictor.system
        assert isinstance(system, Divided)
        return system

    @property
    def face(self) -> Face:
        """The inequalities that are held."""
        return self.trunk.face

    @property
    def where(self) -> "list[Ball]":
        """The unknowns at the branch point."""
        return self.divided.mirror.point(self.centre, 0)

    @cached_property
    def solution(self) -> "list[Ball]":
        """Enclosures of all unknowns along the four curves."""
        arms = self.divided.mirror.point(self.arms.solution, self.divided.eps)
        return [a.union(b) for a, b in zip(arms, self.trunk.solution, strict=True)]

    def covers(self, x: "Sequence[Ball]") -> bool:
        """Whether all solutions in a box of unknowns are on the four curves."""
        divided = self.divided
        mirror, y = divided.mirror, divided.mirror.parts(x)
        return bool(
            divided.eps.contains(y[divided.way])
            and (not y[divided.way].contains(0) or self.trunk.covers(mirror.point(y, 0)))
            and _alone(divided, y, self.arms.solution)
        )

    def pinned(self, x: Array, *, even: bool) -> CurveSystem:
        """Return the equations of the trunk or of the arms with a pin at a point."""
        if even:
            return self.trunk.system.pinned(self.trunk.system.normal, x.tolist())
        divided, normal = self.divided, [0.0] * len(x)
        ((i, j, s),) = [pair for pair in divided.mirror.unknowns if pair[1] == divided.way]
        normal[i], normal[j] = 0.5, 1.0 if i == j else -s / 2
        return divided.system.pinned(normal, x.tolist())

    def place(self, x: "Sequence[Ball]", *, even: bool) -> "Ball":
        """Return where points are along trunk or arms; 0 is at the branch point."""
        if even:
            return self.trunk.place(x)[0] - self.trunk.place(self.where)[0]
        return self.divided.mirror.parts(x)[self.divided.way]

    def is_trunk(self, points: Sequence[Array], tolerance: float) -> bool:
        """Whether approximate points are symmetric."""
        mirror, units = self.divided.mirror, self.divided.system.units
        parts = (mirror.parts(balls(x)) for x in points)
        return all(abs(y[j]) <= tolerance * units[j] for y in parts for j in mirror.odd)

    def cut(
        self, points: list[Array], side: int, tolerance: float, options: BranchProofOptions
    ) -> list[Array]:
        """Return the approximate points of an arc outside, and one at which it comes in.

        Empty if there is none.
        """
        course = points if side == 0 else points[::-1]
        even = self.is_trunk(points, tolerance)
        (reach,) = self.trunk.enclosure.predictor.cell.reach if even else (self.divided.eps,)
        far = reach.upper() * options.inside
        outer = list(dropwhile(lambda x: not abs(self.place(balls(x), even=even)) > far, course))
        if not outer:
            return []
        at = far if self.place(balls(outer[0]), even=even) > 0 else -far
        if even:
            line = self.trunk.enclosure.predictor.tangents
            near = [x + t[0] * at for x, t in zip(self.where, line, strict=True)]
        else:
            near = self.divided.mirror.point(midpoints(self.arms.solution), at)
        middle = middles(near)
        found = newton(self.pinned(middle, even=even), balls(middle), bits=options.bits)
        if isinstance(found, Undecided):
            return []
        course = [middles(found), *outer]
        return course if side == 0 else course[::-1]

    def beside(self, x: Array, *, even: bool, bits: int) -> "list[Ball]":
        """Return the point of trunk or arms beside an approximate one, or the branch point."""
        found = point(self.pinned(x, even=even), balls(x), bits)
        if isinstance(found, Undecided):
            return self.where
        shown = self.trunk.contains if even else self.covers
        return found.solution if shown(found.solution) else self.where

    def event(self, ends: Sequence[End], tolerance: float, bits: int) -> EnclosedEvent:
        """Return the branch point if the four curves are those of arcs that end there."""
        left = {(True, -1): 1, (True, 1): 0, **dict.fromkeys([(False, -1), (False, 1)],
                                                             int(not self.grows))}  # fmt: skip
        for end in ends:
            even = self.is_trunk(end.arc.nodes, tolerance)
            x = self.beside(end.near, even=even, bits=bits)
            place = self.place(x, even=even)
            comes = not place.contains(0) and end.holds(x)
            need(comes, "an arc is not shown to come from the branch point")
            side = left.pop((even, 1 if place > 0 else -1), None)
            need(side == end.side, "its arcs are not those of a pitchfork")
        need(not left, "an arc leaves a pitchfork, which is not in the diagram")
        where = self.where[: len(self.divided.system.setting.units)]
        return EnclosedEvent(where, BranchKind.BRANCH)


def pitchfork(
    setting: Setting,
    face: Face,
    g: Image,
    at: Array,
    near: Sequence[Array],
    watched: Watched,
    options: BranchProofOptions,
) -> Pitchfork | Undecided:
    """Return the pitchfork of a symmetry at an approximate point, with points on its curves."""
    subject = "the branch point"
    held = [row - setting.inequalities for row in setting.equations]
    mirror = Mirror.of(g, face, len(setting.units), held)
    if mirror is None:
        return Undecided(subject, "no symmetry that is an involution keeps its active functions")
    system = CurveSystem(setting, face).coordinate(0)
    y, apart = mirror.parts(balls(at)), [mirror.parts(balls(x)) for x in near]
    sizes = [(abs(float(off[j].mid())) / system.units[j], j, k)
             for k, off in enumerate(apart) for j in mirror.odd if j < setting.n]  # fmt: skip
    size, way, k = max(sizes, default=(0.0, 0, 0))
    if not size:
        return Undecided(subject, "the symmetry keeps all curves that leave")
    off = apart[k]
    for j in mirror.odd:
        y[j] = off[j] / off[way]
    divided = Divided(system, mirror, way, ball(0))
    centre = point(divided, y, options.bits)
    if isinstance(centre, Undecided):
        return centre
    arms = _arms(divided, centre.solution, watched, options)
    trunk = _trunk(divided, centre.solution, watched, options)
    if arms is None:
        return Undecided(subject, "the curves that break the symmetry are not enclosed")
    if trunk is None:
        return Undecided(subject, "the symmetric curve is not shown to be the only other one")
    return Pitchfork(centre.solution, trunk, *arms)


def _arms(
    divided: Divided, centre: "list[Ball]", watched: Watched, options: BranchProofOptions
) -> tuple[Enclosure, bool] | None:
    setting, reach = divided.system.setting, options.widest * divided.system.units[divided.way]
    for _ in range(options.halvings):
        some = replace(divided, eps=ball(0, reach))
        found = enclose(some, midpoints(centre), bits=options.bits)
        reach /= 2
        if isinstance(found, Undecided):
            continue
        apart = zip(found.candidate, centre, found.predictor.centre, strict=True)
        x = divided.mirror.point(found.solution, some.eps)
        growth = _growth(some, found)
        if (
            growth is not None
            and not growth.contains(0)
            and all(w.contains(a - b) for w, a, b in apart)
            and all(v > 0 for v in watched.at(setting, divided.system.face, x))
        ):
            return found, bool(growth > 0)
    return None


def _growth(divided: Divided, arms: Enclosure) -> "Ball | None":
    """Enclose the derivative of the parameter by ``e^2 / 2`` along the arms."""
    change, backwards = divided.change(arms.solution), arms.preconditioner
    if isinstance(change, Undecided):
        return None
    try:
        near = backwards * matrix(arms.linear.jacobian)
        rates = entries(near.solve(-(backwards * column(change))))
        return Watched.by_time(divided.system.setting, rates)
    except ZeroDivisionError:
        return None


def _trunk(
    divided: Divided, centre: "list[Ball]", watched: Watched, options: BranchProofOptions
) -> Tube | None:
    system, x = replace(divided.system, mirror=divided.mirror), divided.mirror.point(centre, 0)
    setting, reach = system.setting, options.widest
    along = direction_at(system, x)
    if along is None:
        return None
    along *= np.sign(along[setting.moved] * float(setting.rates[setting.moved - setting.n]))
    middle = middles(x)
    for _ in range(options.halvings):
        found = about_event(system, middle, along, reach, options.bits)
        reach /= 2
        if (
            isinstance(found, Tube)
            and found.contains(x)
            and all(v > 0 for v in watched.values(found))
            and _alone(divided, divided.mirror.parts(found.solution), centre)
        ):
            return found
    return None


def _alone(divided: Divided, y: "Sequence[Ball]", known: "Sequence[Ball]") -> bool:
    """Whether all solutions ``s + a`` in a box with ``a != 0`` are known ones for the same ``e``.

    Or, where the box is one of symmetric points, all of them with an odd kernel.
    """
    mirror, way = divided.mirror, divided.way
    near = divided.system.at(mirror.point(y, ball(0.5, 0.5)))
    if isinstance(near, Undecided):
        return False
    hull = _kernel(divided, mirror.adapted(near.jacobian), y)
    if not hull:
        return False
    some = replace(divided, eps=y[way].union(-y[way]))
    found = some.jacobian([a.union(b) for a, b in zip(hull, known, strict=True)])
    backwards = None if isinstance(found, Undecided) else middle_inverse(found)
    if backwards is None or isinstance(found, Undecided):
        return False
    return is_regular((backwards * matrix(found)).tolist())


def _kernel(divided: Divided, rows: "list[list[Ball]]", y: "Sequence[Ball]") -> "list[Ball]":
    """Return adapted coordinates with all ``u`` that matrices of ``A`` annihilate, ``u_k = 1``.

    Empty where these are not enclosed, or where ``u_k`` may be 0.
    """
    mirror, units, way = divided.mirror, divided.system.units, divided.way
    others, hull = sorted(mirror.odd - {way}), list(y)
    hull[way] = ball(1)
    if others:
        pairs = zip(mirror.unknowns, mirror.equations, strict=True)
        places = [(j, row) for (_, j, _), (_, row, _) in pairs]
        table = [[units[j] * rows[r][c] * units[c] for c in others] for j, r in places]
        right = column([-units[j] * rows[r][way] for j, r in places])
        left = left_inverse(table)
        if left is None:
            return []
        try:
            found = entries((left * matrix(table)).solve(left * right))
        except ZeroDivisionError:
            return []
        for c, x in zip(others, found, strict=True):
            hull[c] = x * units[c]
    return hull

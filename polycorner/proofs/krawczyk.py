"""Krawczyk's test for boxes in which the KKT equations have exactly one solution.

Without parameters, ``Y`` being near the inverse of the Jacobian at ``z0`` and ``J`` enclosing the
Jacobian over ``z0 + W``,

``K = -Y F(z0) + (I - Y J) W``

inside the interior of ``W`` proves that there is exactly one solution in ``z0 + W``, that it lies
in ``z0 + K``, and that every matrix in ``J`` is regular ([Krawczyk], [Neumaier] sec. 5.1, [Rump]).

With parameters ``p = p0 + delta`` the same holds for the remainder ``w`` added to a predictor
``z0 + Z1 delta``.  There ``F(z0)`` becomes ``F`` along the predictor: its Taylor polynomial of
first order at ``delta = 0`` and its second derivatives over the cell.

Since ``J`` is convex and all its matrices are regular, the inertia of the KKT matrix is the same at
``z0`` and at every solution.  Whether the reduced Hessian is definite, which the inertia says
([NW] thm 16.3), is therefore decided at ``z0``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from polycorner.intervals.balls import (
    ball,
    column,
    dot,
    entries,
    identity,
    matrix,
    middle_inverse,
    midpoints,
)
from polycorner.intervals.enclosures import Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.kkt import SUBJECT, KKTSystem, Linearisation
from polycorner.values import cached_property

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball, Matrix

MOST_INFLATIONS = 6
SLACK_BITS = 16  # last binary digits of a unit that a candidate box covers at least
GROWTH = 1.3  # ratio of a candidate box to the image it has to contain
WIDEST = 10  # size in units from which on a candidate box is given up


@dataclass(frozen=True, eq=False)
class Cell:
    """Parameters ``p0 + delta``, for ``delta`` in a box that contains 0; or none."""

    middle: "Sequence[Ball]" = ()
    reach: "Sequence[Ball]" = ()


@dataclass(frozen=True, eq=False)
class Predictor:
    """Unknowns ``z0 + Z1 delta`` for the parameters of a cell.

    Attributes
    ----------
    system : KKTSystem
        The equations.
    cell : Cell
        The parameters.
    centre : list of Ball
        ``z0``.
    tangents : list of list of Ball
        ``Z1``, ``[N][p]``; empty without parameters.
    """

    system: KKTSystem
    cell: Cell
    centre: "list[Ball]"
    tangents: "list[list[Ball]]"

    def unknowns(self, remainder: "Sequence[Ball]") -> "list[Ball]":
        """Return enclosures of all unknowns over the cell, for a remainder."""
        around = [a + b for a, b in zip(self.centre, remainder, strict=True)]
        if not self.tangents:
            return around
        return [a + dot(t, self.cell.reach) for a, t in zip(around, self.tangents, strict=True)]

    def box(self, remainder: "Sequence[Ball]") -> Box:
        """Return a joint enclosure of the point and the parameters."""
        n, cell = self.system.dimension, self.cell
        around = [a + b for a, b in zip(self.centre[:n], remainder[:n], strict=True)]
        if not self.tangents:
            return Box(around)
        own = unit_rows(len(cell.reach))
        return Box.moving([*around, *cell.middle], [*self.tangents[:n], *own], cell.reach)

    def part(self, reach: "Sequence[Ball]") -> "Predictor":
        """Return the same predictor for ``delta`` in a part of the cell."""
        start = midpoints(reach)
        centre = [c + dot(t, start) for c, t in zip(self.centre, self.tangents, strict=True)]
        middle = [p + s for p, s in zip(self.cell.middle, start, strict=True)]
        cell = Cell(middle, [d - s for d, s in zip(reach, start, strict=True)])
        return Predictor(self.system, cell, centre, self.tangents)


def unit_rows(size: int) -> "list[list[Ball]]":
    """Return the rows of the unit matrix."""
    rows: list[list[Ball]] = identity(size).tolist()
    return rows


@dataclass(frozen=True, eq=False)
class Enclosure:
    """A box with exactly one solution for every parameter in a cell.

    Attributes
    ----------
    predictor : Predictor
        The centre of the box, as a function of the parameters.
    candidate : list of Ball
        ``W``, in which the remainder of the solution is unique.
    remainder : list of Ball
        ``K``, which contains it, in the interior of ``W``.
    preconditioner : Matrix
        ``Y``.
    start, linear : Linearisation
        The equations and their derivatives at the centre, and over the whole box.
    """

    predictor: Predictor
    candidate: "list[Ball]"
    remainder: "list[Ball]"
    preconditioner: "Matrix"
    start: Linearisation
    linear: Linearisation

    @cached_property
    def solution(self) -> "list[Ball]":
        """Enclosures of all unknowns of the solution, over the whole cell."""
        return self.predictor.unknowns(self.remainder)

    def neighbourhood(self, part: "Sequence[Ball]" = ()) -> Box:
        """Return a neighbourhood of the solution, for ``delta`` in a part of the cell."""
        return (self.predictor.part(part) if part else self.predictor).box(self.candidate)


def enclose(
    system: KKTSystem, centre: "list[Ball]", cell: Cell | None = None, *, bits: int
) -> Enclosure | Undecided:
    """Prove that the equations have exactly one solution in a box about ``centre``.

    The candidate box starts slightly larger than ``Y F`` and grows until it contains the image.
    The working precision is ``bits`` binary digits, set by the caller.
    """
    cell = cell or Cell()
    start = system.at(centre, cell.middle)
    if isinstance(start, Undecided):
        return start
    preconditioner = middle_inverse(start.jacobian)
    if preconditioner is None:
        return Undecided(SUBJECT, "their Jacobian is singular")
    tangents = (-(preconditioner * matrix(start.drift))).mid().tolist() if cell.reach else []
    predictor = Predictor(system, cell, centre, tangents)
    base = _base(predictor, start, preconditioner)
    if isinstance(base, Undecided):
        return base
    least = [unit * ball(2) ** (SLACK_BITS - bits) for unit in system.units]
    image = entries(base)
    for _ in range(MOST_INFLATIONS):
        grown = zip(image, least, strict=True)
        candidate = [ball(0, (GROWTH * x.abs_upper() + small).upper()) for x, small in grown]
        if not all(
            w.rad() < WIDEST * unit for w, unit in zip(candidate, system.units, strict=True)
        ):
            break
        linear = system.linear(predictor.unknowns(candidate), predictor.box(candidate))
        if isinstance(linear, Undecided):
            return linear
        image = entries(base + _defect(linear, preconditioner) * column(candidate))
        if all(w.contains_interior(x) for w, x in zip(candidate, image, strict=True)):
            return Enclosure(predictor, candidate, image, preconditioner, start, linear)
    return Undecided(
        SUBJECT, "Krawczyk's operator does not map the box into itself: it is too wide"
    )


def _defect(linear: Linearisation, preconditioner: "Matrix") -> "Matrix":
    """Return ``I - Y J``."""
    return identity(preconditioner.nrows()) - preconditioner * matrix(linear.jacobian)


def _base(
    predictor: Predictor, start: Linearisation, preconditioner: "Matrix"
) -> "Matrix | Undecided":
    """Return ``-Y F`` along the predictor."""
    system, tangents = predictor.system, predictor.tangents
    value = column(start.residual)
    if tangents:
        nothing = [ball(0)] * system.size
        bend = system.bend(predictor.unknowns(nothing), tangents, predictor.box(nothing))
        if isinstance(bend, Undecided):
            return bend
        drift = matrix(start.jacobian) * matrix(tangents) + matrix(start.drift)
        value = value + drift * column(predictor.cell.reach) + column(bend)
    return -(preconditioner * value)


def widened(enclosure: Enclosure, attempts: int = 12) -> "list[Ball]":
    """Return the widest box tried, without parameters, in which the solution is unique.

    If ``|I - Y J| w < w`` over the box of radii ``w``, no matrix in ``J`` is singular, and two
    solutions in the box would contradict the mean value theorem ([Neumaier] sec. 5.1).
    """
    predictor = enclosure.predictor
    for power in range(1, attempts + 1):
        candidate = [ball(0, ball(unit / 10**power)) for unit in predictor.system.units]
        linear = predictor.system.linear(predictor.unknowns(candidate), predictor.box(candidate))
        if isinstance(linear, Undecided):
            continue
        image = entries(_defect(linear, enclosure.preconditioner) * column(candidate))
        alone = all(x.abs_upper() < w.abs_upper() for w, x in zip(candidate, image, strict=True))
        inside = zip(candidate, enclosure.remainder, strict=True)
        if alone and all(w.contains(x) for w, x in inside):
            return candidate
    return enclosure.candidate

"""KKT equations of a face as a square system in balls: Newton's method and Krawczyk's test.

Unknowns are ``z = (q, lam, nu)``: the point, the multipliers of the active functions and
equations, and one multiplier for every gauge.  The equations are

- ``dE - sum lam_i df_i - sum nu_k n_k = 0``,
- ``f_i = 0`` for the active functions and the equations of the set,
- ``n_k (q - q0) = 0`` for the gauges.

Krawczyk's test is for boxes in which they have exactly one solution.  Without parameters, ``Y``
being near the inverse of the Jacobian at ``z0`` and ``J`` enclosing the Jacobian over ``z0 + W``,

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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Protocol

from polycorner.intervals.balls import (
    Ball,
    Matrix,
    ball,
    column,
    dot,
    entries,
    identity,
    matrix,
    middle_inverse,
    midpoints,
    precision,
    square,
)
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.values import cached_property

FIRST_BITS = 128  # precision at which Newton's method starts; it then doubles
MOST_STEPS = 25
SUBJECT = "the KKT equations"
MOST_INFLATIONS = 6
SLACK_BITS = 16  # last binary digits of a unit that a candidate box covers at least
GROWTH = 1.3  # ratio of a candidate box to the image it has to contain
WIDEST = 10  # size in units from which on a candidate box is given up


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Enclosures of the equations and their derivatives on a box.

    Attributes
    ----------
    residual : list of Ball
        The left-hand sides, ``[N]``.
    jacobian, drift : list of list of Ball
        Their derivatives by the unknowns ``[N][N]`` and by the parameters ``[N][p]``.
    energy : Ball
        The energy.
    rows : list of list of Ball
        Gradients of the active functions and equations, then the gauges, ``[m][n]``.
    curvature : list of list of Ball
        The Lagrangian's Hessian, ``[n][n]``.
    forms : SmoothForms
        Active functions, equations and energy, smooth on the box.
    """

    residual: "list[Ball]"
    jacobian: "list[list[Ball]]"
    drift: "list[list[Ball]]"
    energy: "Ball"
    rows: "list[list[Ball]]"
    curvature: "list[list[Ball]]"
    forms: SmoothForms


class Equations(Protocol):
    """Square equations with parameters, as of :class:`KKTSystem`, which Krawczyk's test is for."""

    @property
    def dimension(self) -> int:
        """The number of unknowns that formulas read, which come first."""

    @property
    def size(self) -> int:
        """The number of unknowns."""

    @property
    def units(self) -> tuple[float, ...]:
        """Unit of each unknown."""

    def at(self, z: "Sequence[Ball]", p: "Sequence[Ball]" = ()) -> Linearisation | Undecided:
        """Return the equations and their derivatives on boxes of unknowns and parameters."""

    def linear(self, z: "Sequence[Ball]", box: Box) -> Linearisation | Undecided:
        """Return the same where what formulas read is enclosed jointly by ``box``."""

    def bend(
        self, z: "Sequence[Ball]", tangents: "Sequence[Sequence[Ball]]", box: Box
    ) -> "list[Ball] | Undecided":
        """Return the second-order remainder of the equations along a predictor."""


@dataclass(frozen=True, eq=False)
class KKTSystem:
    """The KKT equations of one face; see the module.

    Attributes
    ----------
    formulas : Formulas
        Inequalities, equations and energy of the problem, in this order.
    held : tuple of int
        The active functions, then the equations, as rows of ``formulas``.
    gauges : tuple of tuple of float
        The normals ``n_k``.
    anchor : tuple of float
        The point ``q0``.
    units : tuple of float
        Unit of each unknown: the scales of the coordinates, then the multipliers with which the
        gradient of a function is as large as that of the energy.
    """

    formulas: Formulas
    held: tuple[int, ...]
    gauges: tuple[tuple[float, ...], ...]
    anchor: tuple[float, ...]
    units: tuple[float, ...]

    @property
    def dimension(self) -> int:
        """The number of coordinates ``n``."""
        return self.formulas.dimension

    @property
    def scales(self) -> tuple[float, ...]:
        """The units of the coordinates."""
        return self.units[: self.dimension]

    @property
    def size(self) -> int:
        """The number of unknowns ``N``."""
        return self.dimension + len(self.held) + len(self.gauges)

    def at(self, z: "Sequence[Ball]", p: "Sequence[Ball]" = ()) -> Linearisation | Undecided:
        """Return the equations and their derivatives on boxes of unknowns and parameters."""
        return self.linear(z, Box([*z[: self.dimension], *p]))

    def linear(self, z: "Sequence[Ball]", box: Box) -> Linearisation | Undecided:
        """Return the same for a point and parameters that are enclosed jointly by ``box``."""
        n, k = self.dimension, len(self.held)
        forms = self._smooth(box)
        if isinstance(forms, Undecided):
            return forms
        values, gradients, hessians = forms.evaluate(box, 2)
        weights = [*(-lam for lam in z[n : n + k]), ball(1)]
        normals = [[ball(x) for x in gauge] for gauge in self.gauges]
        slope, bent = lagrangian(weights, gradients, hessians, range(n), range(len(gradients[0])))
        for nu, normal in zip(z[n + k :], normals, strict=True):
            slope = [u - nu * v for u, v in zip(slope, normal, strict=True)]
        away = [q - a for q, a in zip(z[:n], self.anchor, strict=True)]
        rows = [*(g[:n] for g in gradients[:k]), *normals]
        no_drift = [ball(0)] * (self.formulas.inputs - n)
        return Linearisation(
            residual=[*slope, *values[:k], *(dot(normal, away) for normal in normals)],
            jacobian=bordered([row[:n] for row in bent], rows),
            drift=[
                *(row[n:] for row in bent),
                *(g[n:] for g in gradients[:k]),
                *(no_drift for _ in normals),
            ],
            energy=values[k],
            rows=rows,
            curvature=[row[:n] for row in bent],
            forms=forms,
        )

    def bend(
        self, z: "Sequence[Ball]", tangents: "Sequence[Sequence[Ball]]", box: Box
    ) -> "list[Ball] | Undecided":
        """Return the second-order remainder of the equations along a predictor.

        On the predictor, enclosed by ``z`` and ``box``, the unknowns have constant derivatives
        ``tangents`` by ``delta``.  The result encloses ``1/2 sum_ab d_a d_b F delta_a delta_b``.
        """
        n, k, count = self.dimension, len(self.held), len(box.reach)
        forms = self._smooth(box)
        if isinstance(forms, Undecided):
            return forms
        _, (_, turned, bent) = forms.slopes(box)
        weights = [*(-lam for lam in z[n : n + k]), ball(1)]
        growth = [*([-t for t in row] for row in tangents[n : n + k]), [ball(0)] * count]
        total = [ball(0)] * self.size
        for a, b, share in _pairs(box.reach):
            along = [*(row[a] for row in tangents[:n]), *(ball(int(a == c)) for c in range(count))]
            for i in range(n):
                second = [dot([x[b] for x in bent[r][i]], along) for r in range(k + 1)]
                first = [turned[r][i] for r in range(k + 1)]
                cross = [growth[r][a] * first[r][b] + growth[r][b] * first[r][a] for r in range(k)]
                total[i] += share * sum(cross, dot(weights, second))
            for r in range(k):
                total[n + r] += share * dot([x[b] for x in turned[r]], along)
        return total

    def _smooth(self, box: Box) -> SmoothForms | Undecided:
        return self.formulas.smooth(box, (*self.held, len(self.formulas.names) - 1))


def lagrangian(
    weights: "Sequence[Ball]",
    gradients: "list[list[Ball]]",
    hessians: "list[list[list[Ball]]]",
    places: Sequence[int],
    columns: Sequence[int],
) -> "tuple[list[Ball], list[list[Ball]]]":
    """Return gradient and Hessian of a combination of functions, in some coordinates each."""
    slope = [dot(weights, [g[i] for g in gradients]) for i in places]
    return slope, [[dot(weights, [h[i][j] for h in hessians]) for j in columns] for i in places]


def bordered(bent: "list[list[Ball]]", rows: "list[list[Ball]]") -> "list[list[Ball]]":
    """Return the Jacobian of KKT equations, from the Lagrangian's Hessian and the rows held."""
    nothing = [ball(0)] * len(rows)
    above = ([*line, *(-row[i] for row in rows)] for i, line in enumerate(bent))
    return [*above, *([*row, *nothing] for row in rows)]


def _pairs(reach: "Sequence[Ball]") -> "Iterator[tuple[int, int, Ball]]":
    """Return pairs ``a <= b`` with the factor of ``d_a d_b`` in half a quadratic form."""
    for a, b in combinations_with_replacement(range(len(reach)), 2):
        yield a, b, square(reach[a]) / 2 if a == b else reach[a] * reach[b]


def newton(
    system: Equations,
    z: "Sequence[Ball]",
    p: "Sequence[Ball]" = (),
    *,
    bits: int,
    steps: int = MOST_STEPS,
) -> "list[Ball] | Undecided":
    """Return an approximate solution near ``z``, correct to nearly ``bits`` binary digits.

    Precision is doubled as steps converge, and where they do not: the equations may be singular to
    a few digits only.
    """
    working = min(bits, FIRST_BITS)
    while True:
        with precision(working):
            found = _settled(system, z, p, ball(2) ** (-working // 2), steps)
        if working >= bits:
            return found
        z = z if isinstance(found, Undecided) else found
        working = min(2 * working, bits)


def _settled(
    system: Equations, z: "Sequence[Ball]", p: "Sequence[Ball]", small: "Ball", steps: int
) -> "list[Ball] | Undecided":
    """Take Newton steps until one is relatively small, then one more."""
    last = False
    for _ in range(steps):
        linear = system.at(z, p)
        if isinstance(linear, Undecided):
            return linear
        backwards = middle_inverse(linear.jacobian)
        if backwards is None:
            return Undecided(SUBJECT, "their Jacobian is singular")
        step = midpoints(entries(backwards * column(linear.residual)))
        if not all(dx.is_finite() for dx in step):
            return Undecided(SUBJECT, "Newton's method left the domain of the functions")
        z = midpoints([x - dx for x, dx in zip(z, step, strict=True)])
        if last:
            return list(z)
        sizes = zip(step, system.units, strict=True)
        last = all(abs(dx) <= small * unit for dx, unit in sizes)
    return Undecided(SUBJECT, "Newton's method found no solution near the point")


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
    system : Equations
    cell : Cell
        The parameters.
    centre : list of Ball
        ``z0``.
    tangents : list of list of Ball
        ``Z1``, ``[N][p]``; empty without parameters.
    """

    system: Equations
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
    system: Equations, centre: "list[Ball]", cell: Cell | None = None, *, bits: int
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
        image = entries(base + defect(linear.jacobian, preconditioner) * column(candidate))
        if strictly_inside(image, candidate):
            return Enclosure(predictor, candidate, image, preconditioner, start, linear)
    return Undecided(
        SUBJECT, "Krawczyk's operator does not map the box into itself: it is too wide"
    )


def defect(jacobian: "list[list[Ball]]", preconditioner: "Matrix") -> "Matrix":
    """Return ``I - Y J``."""
    return identity(preconditioner.nrows()) - preconditioner * matrix(jacobian)


def krawczyk(
    residual: "list[Ball]",
    jacobian: "list[list[Ball]]",
    preconditioner: "Matrix",
    unknowns: "list[Ball]",
    centre: "list[Ball]",
) -> "list[Ball]":
    """Return ``c - Y F(c) + (I - Y J) (Z - c)``."""
    apart = [x - c for x, c in zip(unknowns, centre, strict=True)]
    base = -(preconditioner * column(residual))
    moved = entries(base + defect(jacobian, preconditioner) * column(apart))
    return [c + x for c, x in zip(centre, moved, strict=True)]


def strictly_inside(inner: "Sequence[Ball]", outer: "Sequence[Ball]") -> bool:
    """Whether enclosures of unknowns lie in the interior of others."""
    return all(x.contains_interior(y) for x, y in zip(outer, inner, strict=True))


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


def widened(enclosure: Enclosure) -> "list[Ball]":
    """Return the widest box tried, without parameters, in which the solution is unique.

    If ``|I - Y J| w < w`` over the box of radii ``w``, no matrix in ``J`` is singular, and two
    solutions in the box would contradict the mean value theorem ([Neumaier] sec. 5.1).
    """
    predictor = enclosure.predictor
    for power in range(1, 13):
        candidate = [ball(0, ball(unit / 10**power)) for unit in predictor.system.units]
        linear = predictor.system.linear(predictor.unknowns(candidate), predictor.box(candidate))
        if isinstance(linear, Undecided):
            continue
        image = entries(defect(linear.jacobian, enclosure.preconditioner) * column(candidate))
        alone = all(x.abs_upper() < w.abs_upper() for w, x in zip(candidate, image, strict=True))
        inside = zip(candidate, enclosure.remainder, strict=True)
        if alone and all(w.contains(x) for w, x in inside):
            return candidate
    return enclosure.candidate

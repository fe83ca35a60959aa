"""Faces over balls: boxes in which the functions held have exactly one KKT point, or one zero.

Let ``U`` be the inequalities that may vanish in a box ``X``, ``A`` some of them, and let all
functions involved be smooth on ``X``.  The multipliers of a stationary point of the branch ``A``
satisfy ``sum lam_i df_i = dE`` over ``A`` and the equations.  With ``Y`` near the pseudoinverse,
``(Y G^T) lam = Y dE`` encloses them for all points of ``X`` at once, if this matrix is regular on
``X``; then the gradients are independent there, so that stationary points are KKT points.  If all
multipliers of inequalities are positive, every function of ``A`` vanishes at such a point, which
therefore solves the KKT equations with multipliers in the enclosure ``L``.  Krawczyk's operator on
``X x L`` shows that they have exactly one solution there ([Neumaier] sec. 5.1).

For a branch whose open functions in a part of ``X`` are a subset of ``A`` this is the only
candidate, and none if the subset is proper.

A *vertex* has, with the equations, as many functions as there are free coordinates.  The operator
on ``X`` shows that their Jacobian is regular and that they have exactly one common zero there: a
regular corner, if it lies in the set.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from polycorner.intervals.balls import (
    Ball,
    ball,
    between,
    column,
    entries,
    exact,
    left_inverse,
    matrix,
    middle_inverse,
    middles,
    narrower,
    precision,
)
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.kkt import bordered, krawczyk, lagrangian, strictly_inside
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH
from polycorner.values import Value

if TYPE_CHECKING:
    Equations = tuple[list[Ball], list[list[Ball]]]  # residual and Jacobian

BITS = 128
SLACK = 16  # last binary digits of a multiplier that its enclosure covers at least
QUARTERINGS = 10
SHARPENINGS = 6
SMALL = 2.0**-30  # of the radii of a box of unknowns: those of a small one about the solution
TIGHT = 70  # binary digits of a solution after which it is sharp enough
WIDENINGS = 3  # of a box towards the shape of its image
MOST_WIDENING = 64.0
GROWTH = 1.25
LOOSENESS = 0.01  # of enclosures of points that parameters move, relative to their width
GUESSED = (1.0, 0.7, 0.4)  # shares of a guessed box that are tried, as balls are the wider bounds


@dataclass(frozen=True, eq=False)
class Region(Value):
    """A box in which a face carries exactly one solution of the KKT equations.

    Attributes
    ----------
    lower, upper : (n,) arrays
        The box ``X``.
    active : tuple of int
        ``A``.
    sharp_lower, sharp_upper : (N,) arrays
        Enclosure of the solution: the free coordinates, the multipliers of ``A`` and of the
        equations.
    index : int or None
        Negative eigenvalues of the Hessian of the Lagrangian on the tangent space of the face.
    """

    lower: Array
    upper: Array
    active: tuple[int, ...]
    sharp_lower: Array
    sharp_upper: Array
    index: int | None


@dataclass(frozen=True, eq=False)
class EnclosedFaces:
    """The faces of a problem over balls, in the coordinates that are free.

    Attributes
    ----------
    formulas : Formulas
        Inequalities, equations, energy.
    inequalities : int
        ``m``.
    free : tuple of int
        Positions of the coordinates that are free.
    scales : (n,) array
    held : mapping from int to (float, float)
        The sides of parameters; boxes contain them.
    """

    formulas: Formulas
    inequalities: int
    free: tuple[int, ...]
    scales: Array
    held: Mapping[int, tuple[float, float]] = field(default_factory=dict)

    @property
    def equations(self) -> int:
        """The number of equations."""
        return len(self.formulas.names) - 1 - self.inequalities

    def rows(self, active: Sequence[int]) -> tuple[int, ...]:
        """Return the rows of a face: active inequalities, equations."""
        return (*active, *range(self.inequalities, len(self.formulas.names) - 1))

    def region(
        self, q: Array, active: Sequence[int], widest: float = 1.0, guess: Array | None = None
    ) -> Region | None:
        """Return the widest box tried about ``q`` in which one KKT point is shown, or None.

        Boxes reach ``widest`` scale units from ``q``, a quarter of it, and so on; before these,
        shares of one with the radii ``guess`` are tried.
        """
        rows = (*self.rows(active), len(self.formulas.names) - 1)
        with precision(BITS):
            # Balls are wider than the bounds that the guess was made with: shares of it are tried.
            for reach in [share * guess for share in GUESSED] if guess is not None else ():
                shown = self._shown(*self._sides(q, reach), rows, len(active))
                if isinstance(shown, Region):
                    return shown
            *_, last = reaches = list(self.reaches(widest))
            if self._multipliers(enclosing(*self._sides(q, last)), rows, len(active)) is None:
                return None  # as wider boxes have wider enclosures
            for radii in reaches:
                found = self._within(q, rows, len(active), radii)
                if found is not None:
                    return found
        return None

    def vertex(self, q: Array, active: Sequence[int], widest: float) -> Region | None:
        """Return the widest box tried about ``q`` in which one common zero is shown, or None.

        Its enclosure has no multipliers.
        """
        with precision(BITS):
            for radii in self.reaches(widest):
                lower, upper = q - radii, q + radii
                zero = self.zero(lower, upper, self.rows(active))
                if zero is not None:
                    ends = np.array([outward(x) for x in zero])
                    return Region(lower, upper, tuple(active), ends[:, 0], ends[:, 1], None)
        return None

    def zero(self, lower: Array, upper: Array, rows: Sequence[int]) -> "list[Ball] | None":
        """Enclose the only common zero in a box, in the free coordinates; None if not shown."""
        box = enclosing(lower, upper)
        forms = self.formulas.smooth(box, rows)
        if isinstance(forms, Undecided):
            return None
        unknowns = [box.hull[i] for i in self.free]
        found = self._image(forms, box, unknowns, kkt=False)
        # Strictly, so that a neighbourhood of the box has one zero, too, and its sides none.
        if found is None or not strictly_inside(found[0], unknowns):
            return None
        for _ in range(SHARPENINGS):
            unknowns = [narrower(x, y) for x, y in zip(unknowns, found[0], strict=True)]
            found = self._image(forms, box, unknowns, kkt=False)
            if found is None:
                break
        return unknowns

    def reaches(self, widest: float) -> Iterator[Array]:
        """Yield the radii of boxes to be tried, the widest first."""
        free = list(self.free)
        for power in range(QUARTERINGS):
            radii = np.zeros_like(self.scales)
            radii[free] = min(widest, SEARCH.widest) / 4**power * self.scales[free]
            yield radii

    def _within(self, q: Array, rows: tuple[int, ...], count: int, radii: Array) -> Region | None:
        """Try boxes with some radii or more about ``q``.

        Where the image of a box is wider than the box along a coordinate, the next is as wide.
        """
        free = list(self.free)
        for _ in range(WIDENINGS):
            found = self._shown(*self._sides(q, radii), rows, count)
            # None: multipliers may vanish, or the middle is singular; a wider box mends neither.
            if found is None or isinstance(found, Region):
                return found
            # So wide an image is that of a nearly singular Jacobian; quarters of the box do better.
            if (found > MOST_WIDENING * radii[free]).any():
                break
            radii[free] = np.maximum(radii[free], GROWTH * found)
        return None

    def _sides(self, q: Array, radii: Array) -> tuple[Array, Array]:
        """Return the ends of a box about ``q``, those of the parameters being given."""
        lower, upper = q - radii, q + radii
        for i, side in self.held.items():
            lower[i], upper[i] = side
        return lower, upper

    def _shown(
        self, lower: Array, upper: Array, rows: tuple[int, ...], count: int
    ) -> "Region | Array | None":
        """Return the region of a box; the reach of its image if that is too wide; or None."""
        box = enclosing(lower, upper)
        enclosed = self._multipliers(box, rows, count)
        if enclosed is None:
            return None
        forms, multipliers = enclosed
        # Wider than the enclosure, which may be a point: the image has to lie strictly inside.
        unknowns = [*(box.hull[i] for i in self.free), *(wider(lam) for lam in multipliers)]
        found = self._image(forms, box, unknowns)
        if found is None:
            return None
        image, start = found
        if not strictly_inside(image, unknowns):
            pairs = zip(image[: len(self.free)], unknowns, strict=False)
            return np.array([float((y - x.mid()).abs_upper()) for y, x in pairs])
        sharp = self._sharpened(forms, box, unknowns, image)
        ends = np.array([outward(x) for x in sharp])
        if self.held:  # so that others, who stop elsewhere, arrive within
            ends += LOOSENESS * (ends[:, 1:] - ends[:, :1]) * np.array([-1.0, 1.0])
        index = self._index(start, len(rows) - 1)
        return Region(lower, upper, tuple(rows[:count]), ends[:, 0], ends[:, 1], index)

    def _multipliers(
        self, box: Box, rows: tuple[int, ...], count: int
    ) -> "tuple[SmoothForms, list[Ball]] | None":
        """Return the functions on a box and their multipliers, if these are positive on it."""
        forms = self.formulas.smooth(box, rows)
        if isinstance(forms, Undecided):
            return None
        _, gradients = forms.evaluate(box, 1)
        multipliers = enclosed_multipliers([[g[i] for i in self.free] for g in gradients])
        if multipliers is None or not all(lam > 0 for lam in multipliers[:count]):
            return None
        return forms, multipliers

    def _image(
        self, forms: SmoothForms, box: Box, unknowns: "list[Ball]", *, kkt: bool = True
    ) -> "tuple[list[Ball], list[list[Ball]]] | None":
        """Return the image under Krawczyk's operator, and the Jacobian in the middle."""
        centre = [x.mid() for x in unknowns]
        # The residual in the middle alone, the Jacobian on all of the box: that is the operator.
        residual, start = self._equations(forms, box, centre, kkt)
        inverse = middle_inverse(start)
        if inverse is None:
            return None
        _, jacobian = self._equations(forms, box, unknowns, kkt)
        return krawczyk(residual, jacobian, inverse, unknowns, centre), start

    def _equations(
        self, forms: SmoothForms, box: Box, unknowns: "list[Ball]", kkt: bool
    ) -> "Equations":
        """Return the equations of a face and their Jacobian; KKT equations, or functions alone."""
        n, hull = len(self.free), list(box.hull)
        for i, x in zip(self.free, unknowns, strict=False):
            hull[i] = x
        if not kkt:
            values, gradients = forms.evaluate(Box(hull), 1)
            return values, [[g[i] for i in self.free] for g in gradients]
        values, gradients, hessians = forms.evaluate(Box(hull), 2)
        weights = [*(-lam for lam in unknowns[n:]), ball(1)]
        slope, bent = lagrangian(weights, gradients, hessians, self.free, self.free)
        rows = [[g[i] for i in self.free] for g in gradients[:-1]]
        return [*slope, *values[:-1]], bordered(bent, rows)

    def _sharpened(
        self, forms: SmoothForms, box: Box, unknowns: "list[Ball]", image: "list[Ball]"
    ) -> "list[Ball]":
        """Return a narrow enclosure of the only solution in a box of unknowns, from its image.

        Where the operator shows that a small box about the middle contains a solution, it is this
        one.  Then the operator is applied to its image again.
        """
        small = self._small(forms, box, unknowns)
        shown = small and self._image(forms, box, small)
        if small and shown and strictly_inside(shown[0], small):
            # The small box has a solution, and lies in one where there is only one: it is that.
            image = shown[0] if strictly_inside(small, unknowns) else image
        for _ in range(SHARPENINGS):
            pairs = zip(image, unknowns, strict=True)
            if all(y.rad() <= x.abs_upper() * ball(2) ** (-TIGHT) for y, x in pairs):
                break
            again = self._image(forms, box, image)
            if again is None:
                break
            image = [narrower(x, y) for x, y in zip(image, again[0], strict=True)]
        return image

    def _small(self, forms: SmoothForms, box: Box, unknowns: "list[Ball]") -> "list[Ball] | None":
        """Return a small box about the middle and the multipliers there."""
        n = len(self.free)
        point = list(box.hull)
        for i in self.free:
            point[i] = point[i].mid()
        _, gradients = forms.evaluate(Box(point), 1)
        multipliers = enclosed_multipliers([[g[i] for i in self.free] for g in gradients])
        if multipliers is None:
            return None
        middle = [*(point[i] for i in self.free), *multipliers]
        reach = [x.rad() for x in unknowns[:n]] + [abs(lam) for lam in multipliers]
        pairs = zip(middle, reach, strict=True)
        return [x.mid() + ball(0, SMALL * r + x.rad()) for x, r in pairs]

    def _index(self, jacobian: "list[list[Ball]]", rows: int) -> int | None:
        """Return the number of negative eigenvalues on the tangent space, from the inertia.

        Krawczyk's operator shows that all Jacobians in the box are regular, so that all have the
        inertia of the one in the middle, in which each row of a function adds one negative and one
        positive eigenvalue ([NW] thm 16.3).
        """
        n = len(self.free)
        # With its lower rows negated the Jacobian is symmetric.
        symmetric = [[(x if i < n else -x) for x in row] for i, row in enumerate(jacobian)]
        signs = inertia(symmetric)
        return None if signs is None else signs[0] - rows


def enclosing(lower: Array, upper: Array) -> Box:
    """Return a box of balls that contains one of doubles."""
    return Box([between(a, b) for a, b in zip(lower.tolist(), upper.tolist(), strict=True)])


def wider(x: "Ball") -> "Ball":
    """Return a ball twice as wide, and by a little more."""
    return x + ball(0, x.rad() + abs(x) * ball(2) ** (SLACK - BITS))


def inertia(rows: "list[list[Ball]]") -> tuple[int, int] | None:
    """Return the numbers of negative and positive eigenvalues of a symmetric matrix of balls."""
    if not rows:  # nothing may move
        return 0, 0
    middle = middles(rows)
    if not np.isfinite(middle).all():
        return None
    # Congruence by any regular matrix keeps the inertia, so that this one may be rounded.
    unit = np.sqrt(np.maximum(abs(middle).max(axis=1), 1e-300))
    vectors = np.linalg.eigh((middle + middle.T) / 2 / np.outer(unit, unit))[1] / unit[:, None]
    turn = matrix(vectors.tolist())
    form = (turn.transpose() * matrix(rows) * turn).tolist()
    # Sylvester's law needs a regular matrix, and it is computed in doubles.
    if (turn.det()) == 0 or turn.det().contains(0):
        return None
    negative = positive = 0
    for i, row in enumerate(form):
        # Gershgorin's circles, about numbers that are nearly the eigenvalues.
        radius = sum((abs(x) for j, x in enumerate(row) if j != i), ball(0))
        if row[i] > radius:
            positive += 1
        elif row[i] < -radius:
            negative += 1
        else:
            return None
    return negative, positive


def enclosed_multipliers(slopes: "list[list[Ball]]") -> "list[Ball] | None":
    """Enclose the solutions of ``sum lam_i g_i = dE``; None if the ``g_i`` may be dependent.

    ``slopes`` are the gradients ``g_i``, the energy's last.
    """
    count = len(slopes) - 1
    if not count:
        return []
    across = list(zip(*slopes[:-1], strict=True))
    left = left_inverse(across)
    if left is None:
        return None
    try:
        # Preconditioned: the system is square and near the identity.
        return entries((left * matrix(across)).solve(left * column(slopes[-1])))
    except ZeroDivisionError:
        return None


def outward(x: "Ball") -> tuple[float, float]:
    """Return doubles below and above a ball."""
    return _double(exact(x.lower()), -np.inf), _double(exact(x.upper()), np.inf)


def _double(value: object, towards: float) -> float:
    from fractions import Fraction

    assert isinstance(value, Fraction)
    near = value.numerator / value.denominator
    # Division of whole numbers rounds to nearest: half of the time the wrong way.
    off = Fraction(near) > value if towards < 0 else Fraction(near) < value
    return float(np.nextafter(near, towards)) if off else near

"""Boxes in which exactly one point is stationary, by Krawczyk's operator on the KKT equations.

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
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from polycorner.intervals.balls import (
    ball,
    between,
    dot,
    middle_inverse,
    narrower,
    precision,
)
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.lists.operators import (
    BITS,
    enclosed_multipliers,
    inertia,
    krawczyk,
    outward,
    wider,
)
from polycorner.spaces.manifold import Array
from polycorner.values import Value

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball

QUARTERINGS = 10
SHARPENINGS = 6
SMALL = 2.0**-30  # of the radii of a box of unknowns: those of a small one about the solution
TIGHT = 70  # binary digits of a solution after which it is sharp enough
WIDENINGS = 3  # of a box towards the shape of its image
MOST_WIDENING = 64.0
GROWTH = 1.25
LOOSENESS = 0.01  # of enclosures of points that parameters move, relative to their width
GUESSED = (1.0, 0.7, 0.4)  # shares of a guessed box that are tried, as balls are the wider bounds
WIDEST = 2.0  # reach of the widest box that is tried, in scale units


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
class Faces:
    """The KKT equations of the faces of a problem, in the coordinates that are free.

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

    def rows(self, active: Sequence[int]) -> tuple[int, ...]:
        """Return the rows of a face: active inequalities, equations, energy."""
        return (*active, *range(self.inequalities, len(self.formulas.names)))

    def region(
        self, q: Array, active: Sequence[int], widest: float = 1.0, guess: Array | None = None
    ) -> Region | None:
        """Return the widest box tried about ``q`` in which one solution is shown, or None.

        Boxes reach ``widest`` scale units from ``q``, a quarter of it, and so on; before these,
        shares of one with the radii ``guess`` are tried.
        """
        rows = self.rows(active)
        with precision(BITS):
            for reach in [share * guess for share in GUESSED] if guess is not None else ():
                shown = self._shown(*self._sides(q, reach), rows, len(active))
                if isinstance(shown, Region):
                    return shown
            reaches = [min(widest, WIDEST) / 4**power for power in range(QUARTERINGS)]
            narrowest = self._box(*self._sides(q, self._radii(reaches[-1])))
            if self._multipliers(narrowest, rows, len(active)) is None:
                return None  # as wider boxes have wider enclosures
            for reach in reaches:
                found = self._within(q, rows, len(active), reach)
                if found is not None:
                    return found
        return None

    def _within(self, q: Array, rows: tuple[int, ...], count: int, reach: float) -> Region | None:
        """Try boxes that reach ``reach`` scale units or more from ``q``.

        Where the image of a box is wider than the box along a coordinate, the next is as wide.
        """
        radii = self._radii(reach)
        for _ in range(WIDENINGS):
            found = self._shown(*self._sides(q, radii), rows, count)
            if found is None or isinstance(found, Region):
                return found
            if (found > MOST_WIDENING * radii[list(self.free)]).any():
                break
            radii[list(self.free)] = np.maximum(radii[list(self.free)], GROWTH * found)
        return None

    def _radii(self, reach: float) -> Array:
        """Return the radii of a box that reaches ``reach`` scale units from its middle."""
        radii = np.zeros_like(self.scales)
        radii[list(self.free)] = reach * self.scales[list(self.free)]
        return radii

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
        box = self._box(lower, upper)
        enclosed = self._multipliers(box, rows, count)
        if enclosed is None:
            return None
        forms, multipliers = enclosed
        _, gradients, hessians = forms.evaluate(box, 2)
        n = len(self.free)
        unknowns = [*(box.hull[i] for i in self.free), *(wider(lam) for lam in multipliers)]
        residual, start, centre = self._at_centre(forms, box, unknowns)
        _, jacobian = self._equations([], gradients, hessians, unknowns)
        inverse = middle_inverse(start)
        if inverse is None:
            return None
        image = krawczyk(residual, jacobian, inverse, unknowns, centre)
        if not _inside(image, unknowns):
            reach = [(y - c).abs_upper() for y, c in zip(image[:n], centre, strict=False)]
            return np.array([float(x) for x in reach])
        sharp = self._sharpened(forms, box, unknowns, image)
        index = self._index(start, len(rows) - 1)
        ends = np.array([outward(x) for x in sharp])
        if self.held:  # so that others, who stop elsewhere, arrive within
            ends += LOOSENESS * (ends[:, 1:] - ends[:, :1]) * np.array([-1.0, 1.0])
        return Region(lower, upper, tuple(rows[:count]), ends[:, 0], ends[:, 1], index)

    @staticmethod
    def _box(lower: Array, upper: Array) -> Box:
        return Box([between(a, b) for a, b in zip(lower.tolist(), upper.tolist(), strict=True)])

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

    def _at_centre(
        self, forms: SmoothForms, box: Box, unknowns: "list[Ball]"
    ) -> "tuple[list[Ball], list[list[Ball]], list[Ball]]":
        """Return the equations and their Jacobian in the middle of the unknowns, and the middle."""
        centre = [x.mid() for x in unknowns]
        point = list(box.hull)
        for i, x in zip(self.free, centre, strict=False):
            point[i] = x
        values, gradients, hessians = forms.evaluate(Box(point), 2)
        return *self._equations(values, gradients, hessians, centre), centre

    def _equations(
        self,
        values: "list[Ball]",
        gradients: "list[list[Ball]]",
        hessians: "list[list[list[Ball]]]",
        unknowns: "list[Ball]",
    ) -> "tuple[list[Ball], list[list[Ball]]]":
        """Return the residual of the KKT equations and their Jacobian."""
        free, n = self.free, len(self.free)
        weights = [*(-lam for lam in unknowns[n:]), ball(1)]
        rows = [[g[i] for i in free] for g in gradients[:-1]]
        slope = [dot(weights, [g[i] for g in gradients]) for i in free]
        bent = [[dot(weights, [h[i][j] for h in hessians]) for j in free] for i in free]
        nothing = [ball(0)] * len(rows)
        jacobian = [
            *([*bent[i], *(-row[i] for row in rows)] for i in range(n)),
            *([*row, *nothing] for row in rows),
        ]
        return [*slope, *values[: len(rows)]], jacobian

    def _sharpened(
        self, forms: SmoothForms, box: Box, unknowns: "list[Ball]", image: "list[Ball]"
    ) -> "list[Ball]":
        """Return a narrow enclosure of the only solution in a box of unknowns, from its image.

        Where the operator shows that a small box about the middle contains a solution, it is this
        one.  Then the operator is applied to its image again.
        """
        small = self._small(forms, box, unknowns)
        shown = small and self._image(forms, box, small)
        if small and shown and _inside(shown, small) and _inside(small, unknowns):
            image = shown
        for _ in range(SHARPENINGS):
            pairs = zip(image, unknowns, strict=True)
            if all(y.rad() <= x.abs_upper() * ball(2) ** (-TIGHT) for y, x in pairs):
                break
            again = self._image(forms, box, image)
            if again is None:
                break
            image = [narrower(x, y) for x, y in zip(image, again, strict=True)]
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

    def _image(self, forms: SmoothForms, box: Box, unknowns: "list[Ball]") -> "list[Ball] | None":
        """Return the image of unknowns under Krawczyk's operator."""
        hull = list(box.hull)
        for i, x in zip(self.free, unknowns, strict=False):
            hull[i] = x
        _, gradients, hessians = forms.evaluate(Box(hull), 2)
        residual, start, centre = self._at_centre(forms, box, unknowns)
        _, jacobian = self._equations([], gradients, hessians, unknowns)
        inverse = middle_inverse(start)
        if inverse is None:
            return None
        return krawczyk(residual, jacobian, inverse, unknowns, centre)

    def _index(self, jacobian: "list[list[Ball]]", rows: int) -> int | None:
        """Return the number of negative eigenvalues on the tangent space, from the inertia.

        Krawczyk's operator shows that all Jacobians in the box are regular, so that all have the
        inertia of the one in the middle, in which each row of a function adds one negative and one
        positive eigenvalue ([NW] thm 16.3).
        """
        n = len(self.free)
        symmetric = [[(x if i < n else -x) for x in row] for i, row in enumerate(jacobian)]
        signs = inertia(symmetric)
        return None if signs is None else signs[0] - rows


def _inside(inner: "list[Ball]", outer: "list[Ball]") -> bool:
    return all(x.contains_interior(y) for x, y in zip(outer, inner, strict=True))

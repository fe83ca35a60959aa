"""Boxes in which some functions vanish together at exactly one point.

Let ``S`` be as many inequalities as, with the equations, there are free coordinates, all smooth
on a box ``X``.  Krawczyk's operator shows that their Jacobian is regular on ``X`` and that they
have exactly one common zero there ([Neumaier] sec. 5.1): a regular corner, if it lies in the set.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from polycorner.intervals.balls import between, middle_inverse, narrower, precision
from polycorner.intervals.enclosures import Formulas, SmoothForms, Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.lists.acceptance import QUARTERINGS, SHARPENINGS, WIDEST, Region
from polycorner.proofs.lists.operators import BITS, krawczyk, outward
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.intervals.balls import Ball


@dataclass(frozen=True, eq=False)
class Vertices:
    """The equations of the corners of a polyhedron, in the coordinates that are free.

    Attributes
    ----------
    formulas : Formulas
        Inequalities, equations, and what else there is.
    inequalities, equations : int
        ``m``, ``k``.
    free : tuple of int
        Positions of the coordinates that are free.
    scales : (n,) array
    """

    formulas: Formulas
    inequalities: int
    equations: int
    free: tuple[int, ...]
    scales: Array

    def rows(self, active: Sequence[int]) -> tuple[int, ...]:
        """Return the rows of a vertex: active inequalities, equations."""
        return (*active, *range(self.inequalities, self.inequalities + self.equations))

    def region(self, q: Array, active: Sequence[int], widest: float) -> Region | None:
        """Return the widest box tried about ``q`` in which one common zero is shown, or None.

        Boxes reach ``widest`` scale units from ``q``, a quarter of it, and so on.  The enclosure of
        the zero has no multipliers.
        """
        free = list(self.free)
        with precision(BITS):
            for power in range(QUARTERINGS):
                radii = np.zeros_like(q)
                radii[free] = min(widest, WIDEST) / 4**power * self.scales[free]
                lower, upper = q - radii, q + radii
                zero = self.zero(lower, upper, active)
                if zero is not None:
                    ends = np.array([outward(x) for x in zero])
                    return Region(lower, upper, tuple(active), ends[:, 0], ends[:, 1], None)
        return None

    def zero(self, lower: Array, upper: Array, active: Sequence[int]) -> "list[Ball] | None":
        """Enclose the only common zero in a box, in the free coordinates; None if not shown."""
        sides = zip(lower.tolist(), upper.tolist(), strict=True)
        box = Box([between(a, b) for a, b in sides])
        forms = self.formulas.smooth(box, self.rows(active))
        if isinstance(forms, Undecided):
            return None
        unknowns = [box.hull[i] for i in self.free]
        image = self._image(forms, box, unknowns)
        if image is None or not all(
            x.contains_interior(y) for x, y in zip(unknowns, image, strict=True)
        ):
            return None
        for _ in range(SHARPENINGS):
            unknowns = [narrower(x, y) for x, y in zip(unknowns, image, strict=True)]
            image = self._image(forms, box, unknowns)
            if image is None:
                break
        return unknowns

    def _image(self, forms: SmoothForms, box: Box, unknowns: "list[Ball]") -> "list[Ball] | None":
        """Return Krawczyk's operator of some of the box."""
        centre = [x.mid() for x in unknowns]
        values, start = self._at(forms, box, centre)
        _, jacobian = self._at(forms, box, unknowns)
        inverse = middle_inverse(start)
        return None if inverse is None else krawczyk(values, jacobian, inverse, unknowns, centre)

    def _at(
        self, forms: SmoothForms, box: Box, unknowns: "list[Ball]"
    ) -> "tuple[list[Ball], list[list[Ball]]]":
        hull = list(box.hull)
        for i, x in zip(self.free, unknowns, strict=True):
            hull[i] = x
        values, gradients = forms.evaluate(Box(hull), 1)
        return values, [[g[i] for i in self.free] for g in gradients]

"""A chain of linear programmes that ends at a corner, and the corner to machine precision.

Every programme minimises the linearised energy over the linearised polyhedron within a box
([NW] sec. 18.5, [ADPR]).  The functions with positive multipliers are a guess at the corner.
Newton's method on them either leaves the polyhedron, and the chain goes on, or ends at a corner
with positive multipliers, which is then a strict local minimum.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from polycorner.formulas.rows import Indices, Mask, SparseRows
from polycorner.minimisation.sparse.faces import FacePoint, on_corner
from polycorner.minimisation.sparse.programmes import Linearised, step
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH

CLOSE = 0.05  # largest displacement, in scale units, from which on the corner is solved for


@dataclass(frozen=True)
class ChainEnergy:
    """What the chain minimises: a linear energy, and functions that are looked up near a point.

    All in scaled coordinates.

    Attributes
    ----------
    gradient : (n,) array
        Of the energy.
    near : callable
        ``near(q, reach)``: the functions that may be at most zero within a box around ``q``.
    level : callable
        ``level(d, used)``: a step without motions that change nothing, such as translations;
        ``used`` marks the coordinates that the held functions read.
    pinned : callable
        ``pinned(used)``: coordinates that are kept in order to exclude these motions.
    """

    gradient: Array
    near: Callable[[Array, float], SparseRows]
    level: Callable[[Array, Mask], Array]
    pinned: Callable[[Mask], Indices]


@dataclass(frozen=True)
class ChainEnd:
    """The end of a chain.

    Attributes
    ----------
    point : (n,) array
        In scaled coordinates.
    held : SparseRows
        The functions with positive multipliers.
    multipliers : (k,) array
        Theirs, ``g = sum lam_i df_i`` in scaled coordinates.
    programmes : int
        The number of linear programmes that were solved.
    corner : FacePoint or None
        None if the chain was stopped before a corner was found.
    """

    point: Array
    held: SparseRows
    multipliers: Array
    programmes: int
    corner: FacePoint | None


def descend(
    land: ChainEnergy,
    q: Array,
    *,
    reach: float,
    limit: int,
    progress: Callable[[int, float], None] | None = None,
) -> ChainEnd:
    """Solve linear programmes from a feasible ``q`` until one of them yields a corner.

    Where every function is convex, as distances are, its linearisation is a lower bound, and every
    step stays in the polyhedron.
    """
    widest = reach
    held, lam = SparseRows((), 0, len(q)), np.empty(0)
    for count in range(1, limit + 1):
        rows = land.near(q, reach)
        values, jacobian = rows.evaluate(q)
        nothing = np.empty(0), csr_array((0, len(q)))
        at = Linearised(values, jacobian, *nothing, land.gradient)
        found = step(at, np.full(len(q), reach))
        if found is None or reach < SEARCH.least_box:
            return ChainEnd(q, held, lam, count, None)
        strong = found.multipliers > DEFAULT.multiplier * found.multipliers.max(initial=0.0)
        held, lam = rows.chosen(np.flatnonzero(strong)), found.multipliers[strong]
        used = held.used
        displacement = land.level(found.displacement, used)
        size = float(abs(displacement[used]).max(initial=0.0))
        q = q + displacement
        if progress is not None:
            progress(count, size)
        if size < CLOSE:
            corner = solve_corner(land, held, q)
            if corner is not None and _settled(land, corner):
                return ChainEnd(corner.point, held, corner.multipliers, count, corner)
        reach = min(widest, SEARCH.wider_linear * size)
    return ChainEnd(q, held, lam, limit, None)


def solve_corner(land: ChainEnergy, held: SparseRows, q: Array) -> FacePoint | None:
    """Return the corner of held functions near ``q``; None unless they determine one."""
    used = held.used
    free = used.copy()
    free[land.pinned(used)] = False
    columns = np.flatnonzero(free)
    if not held.count or held.count != len(columns):
        return None

    def evaluate(u: Array) -> tuple[Array, csr_array]:
        values, jacobian = held.evaluate(_with(q, columns, u))
        return values, jacobian[:, columns]

    found = on_corner(evaluate, land.gradient[columns], q[columns])
    return None if found is None else replace(found, point=_with(q, columns, found.point))


def _with(q: Array, columns: Indices, u: Array) -> Array:
    whole = q.copy()
    whole[columns] = u
    return whole


def _settled(land: ChainEnergy, corner: FacePoint) -> bool:
    """Whether a corner has positive multipliers and lies in the polyhedron."""
    if not (corner.multipliers > 0).all():
        return False
    values = land.near(corner.point, 0.0).values(corner.point)
    return bool(values.min(initial=0.0) >= -DEFAULT.rounding)

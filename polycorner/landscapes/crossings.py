"""What joins at a stationary point, decided in doubles, and points a little below it.

Signs of multipliers and curvatures decide; with multipliers that are zero the copositivity of a
Schur complement; with multipliers that are not unique the forms that belong to their extreme
values; in a union the pieces that meet.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from polycorner.landscapes.barriers import Kind
from polycorner.landscapes.pieces import parted
from polycorner.landscapes.walks import Mask, Orbits, Walks
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.conditions import simplex_minimisers
from polycorner.minimisation.findings import OPEN, Local
from polycorner.minimisation.methods import FARTHEST
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import Rows, inward_direction, linear_programme
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.strata import local_pieces
from polycorner.polyhedra.symmetry import Symmetry, vector_field
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH, Tolerances

MOST_VERTICES = 5000  # of multipliers that are not unique, which are tried


@dataclass(frozen=True, eq=False)
class Way:
    """A way down from a pass.

    Attributes
    ----------
    direction : (n,) array
        In scaled coordinates.
    closed : frozenset of int
        The contacts that are kept closed.
    bend : (n,) array or None
        Where contacts cannot all be kept: what is added, times the square of the distance, to stay
        in the set and be lowest there.
    """

    direction: Array
    closed: Piece
    bend: Array | None = None


@dataclass(frozen=True, eq=False)
class Junction:
    """Where components of a sublevel set join at a point.

    It has a way for each component below the point nearby, fewer than two at no pass; the index
    counts negative curvatures along the face of the contacts with positive multipliers.
    """

    ways: tuple[Way, ...]
    index: int
    kind: Kind


def orbits_of(problem: Problem, symmetry: Symmetry | None) -> Orbits:
    """Return the function from points ``(B, n)`` to scaled tangent vectors of their orbits."""
    manifold, n = problem.polyhedron.manifold, problem.dimension
    if symmetry is None or (symmetry.tangents is None and not symmetry.fields):
        return lambda q: np.zeros((len(q), 0, n))
    if symmetry.tangents is not None:
        tangents = symmetry.tangents
        return lambda q: np.array([tangents(x) for x in q]).reshape(len(q), -1, n) / problem.scales
    fields = [vector_field(manifold, field) for field in symmetry.fields]

    def orbits(q: Array) -> Array:
        rows = [np.stack([f.value(q) for f in field], axis=1) for field in fields]
        return np.stack(rows, axis=1) / problem.scales

    return orbits


def crossing_at(
    problem: Problem, q: Array, tolerances: Tolerances, free: int = 0
) -> Junction | None:
    """Return how components join at a stationary point; None where they do not, or it is not seen.

    Not seen are points with dependent gradients of contacts and, in unions, with multipliers that
    are zero.  Of the flat directions as many as ``free`` are explained by a symmetry.
    """
    local = Local.at(problem, q, tolerances)
    pieces = local_pieces(problem.polyhedron, local.away, tolerances.zero)
    if not pieces or not np.isfinite(local.hessians).all():
        return None
    active = sorted(frozenset[int]().union(*pieces))
    gradients = local.gradients[[*active, *local.sections]]
    rows = Rows(gradients, tolerances.rank)
    shares = _multipliers(rows, len(active), local)
    if not len(shares) or (len(pieces) > 1 and (len(shares) > 1 or shares.min() <= local.small)):
        return None
    sizes = np.linalg.norm(gradients, axis=1)
    bends = local.hessians[[*active, *local.sections]]
    forms = local.hessians[-1] - np.einsum("ci,ijk->cjk", shares / sizes, bends)
    small = tolerances.curvature * max(local.reference, float(abs(forms).max()))
    if len(shares) > 1:
        bent = bends / sizes[:, None, None]
        return _redundant(rows, len(active), shares, forms, bent, local.slope, (local.small, small))
    curvatures, ways = np.linalg.eigh(rows.null_space.T @ forms[0] @ rows.null_space)
    ways = rows.null_space @ ways
    index = int((curvatures < -small).sum())
    if len(pieces) > 1:
        duals = np.asarray(np.linalg.pinv(rows.units), dtype=np.float64)
        found = _tip(pieces, active, shares[0], duals) if index == 0 else ()
        return Junction(found, index, "tip")
    closed = frozenset(active)
    both = tuple(Way(side * ways[:, 0], closed) for side in (1.0, -1.0)) if index == 1 else ()
    kind: Kind = "locus" if (abs(curvatures) <= small).sum() > free else "saddle"
    weak = np.flatnonzero(shares[0, : len(active)] <= local.small)
    if not len(weak):
        return Junction(both, index, kind)
    firm, opened = abs(curvatures) > small, np.linalg.pinv(rows.units)[:, weak]
    stiff = ways[:, firm]
    relaxed = opened - stiff @ ((stiff.T @ forms[0] @ opened) / curvatures[firm][:, None])
    form = opened.T @ forms[0] @ relaxed
    more = index + int((np.linalg.eigvalsh(form) < -small).sum())
    if index:
        copositive = simplex_minimisers(form)[1].min() >= -small
        return Junction(both if copositive else (), more, kind)
    found = tuple(
        Way(relaxed @ u, closed - {active[weak[i]] for i in np.flatnonzero(u)})
        for u in _components(form, small)
    )
    return Junction(found, more, kind)


def _multipliers(rows: Rows, k: int, local: Local) -> Array:
    """Return the multipliers of unit rows ``(c, k + e)`` of which all others are mixtures.

    None where there are none whose first ``k`` are not negative, or they are too many to list.
    """
    units, slope = rows.units, local.slope
    shares = rows.weights(slope)
    left = abs(slope - shares @ units).max(initial=0.0)
    if left > OPEN * local.small:
        return np.empty((0, len(units)))
    relations = rows.relations.T
    loose = len(relations)
    if not loose:
        return shares[None] if (shares[:k] >= -local.small).all() else shares[:0]
    inward = inward_direction(units[:k], units[k:])[1] > local.tolerances.rank
    if not inward or comb(k, loose) > MOST_VERTICES:  # otherwise they are not bounded
        return np.empty((0, len(units)))
    found = []
    for zero in combinations(range(k), loose):
        matrix = relations[:, zero]
        if abs(np.linalg.det(matrix)) > local.tolerances.rank:
            vertex = shares - np.linalg.solve(matrix.T, shares[list(zero)]) @ relations
            if (vertex[:k] >= -local.small).all():
                found.append(vertex)
    return np.array(found).reshape(len(found), len(units))


def _redundant(
    rows: Rows,
    k: int,
    shares: Array,
    forms: Array,
    bends: Array,
    slope: Array,
    zero: tuple[float, float],
) -> Junction | None:
    """Return how components join where multipliers are not unique, mixtures of given ones.

    Below the point are the directions in which each of the forms is negative.  Where a mixture of
    the forms has index 1 they fall apart into opposite halves.  Not seen are points where a
    function has no positive multiplier, and those where other mixtures have to be tried.
    """
    if (shares[:, :k].mean(axis=0) <= zero[0]).any():
        return None
    inner = rows.null_space.T @ forms @ rows.null_space
    for form in [inner.mean(axis=0), *inner]:
        curvatures, ways = np.linalg.eigh(form)
        index = int((curvatures < -zero[1]).sum())
        if index == 0:
            return Junction((), 0, "saddle")
        rates = np.einsum("i,cij,j->c", ways[:, 0], inner, ways[:, 0])
        if index == 1 and (rates < -zero[1]).all():
            way = rows.null_space @ ways[:, 0]
            bend = _bend(rows, k, slope, np.einsum("kij,i,j->k", bends, way, way))
            both = tuple(Way(side * way, frozenset(), bend) for side in (1.0, -1.0))
            return Junction(both, 1, "saddle")
    return None


def _bend(rows: Rows, k: int, slope: Array, bent: Array) -> Array:
    """Return ``w`` of the least ``slope w`` with ``rows w + bent / 2 >= 0``, ``= 0`` after ``k``.

    All multipliers are positive, so that on the span of the rows the least value is attained.
    """
    span = np.linalg.svd(rows.units)[2][: rows.rank]
    held = rows.units @ span.T
    first = -np.linalg.pinv(held[k:]) @ (bent[k:] / 2)
    limits = held[:k] @ first + bent[:k] / 2
    most = FARTHEST * (1.0 + float(abs(bent).max()))
    more = linear_programme(span @ slope, -held[:k], limits, bound=most, equations=held[k:])
    return np.asarray((first + more) @ span)


def _components(form: Array, small: float) -> list[Array]:
    """Return a point of each component of ``{u >= 0, u^T C u < 0}``.

    A segment between two such points is in the set unless the form is positive on it: exact for
    two coordinates; with more, two points of one component may be taken for two.
    """
    points, values = simplex_minimisers(form)
    low = [u for u, value in zip(points, values, strict=True) if value < -small]
    found: list[Array] = []
    for u in low:
        if not any(_joined(form, u, v) for v in found):
            found.append(u)
    return found


def _joined(form: Array, u: Array, v: Array) -> bool:
    a, b, c = u @ form @ u, v @ form @ v, u @ form @ v
    return bool(c < np.sqrt(a * b))


def _tip(
    pieces: Sequence[Piece], active: Sequence[int], shares: Array, duals: Array
) -> tuple[Way, ...]:
    """Return the ways down from a minimum on all contacts at once, one for each class of pieces."""
    ways = []
    for piece in parted(frozenset(active), pieces):
        kept = np.array([i in piece for i in active])
        # Contacts of the piece open a little, and the others are crossed so far that this pays.
        fall = 1.0 + 2 * shares[: len(active)][kept].sum() / shares[: len(active)][~kept].sum()
        way = duals[:, : len(active)] @ np.where(kept, 1.0, -fall)
        ways.append(Way(way / np.linalg.norm(way), frozenset()))
    return tuple(ways)


def sides_of(problem: Problem, certificate: Certificate) -> tuple[Array, ...]:
    """Return points a little below a pass, one on each side of it, in the polyhedron.

    Two or more, ``(n,)`` each; none where the certificate's point is no pass, or not seen to be
    one.
    """
    found = crossing_at(problem, certificate.point, certificate.tolerances)
    walks = Walks(problem, orbits_of(problem, None), certificate.tolerances)
    starts = starts_of(walks, certificate.point, found) if found is not None else []
    return tuple(q for q, _, _ in starts)


Start = tuple[Array, Mask, Mask]  # a point, the functions of its branch, contacts that are closed


def starts_of(walks: Walks, q: Array, crossing: Junction) -> list[Start]:
    """Return points below a pass with their branches; none unless they are at least two."""
    found = [_start(walks, q, way) for way in crossing.ways]
    starts = [start for start in found if start is not None]
    return starts if len(starts) >= max(2, len(found)) else []


def _start(walks: Walks, q: Array, way: Way) -> Start | None:
    """Return the nearest point on a way that is lower by more than rounding."""
    problem = walks.problem
    energy = float(problem.energy.value(q))
    closed = problem.mask(way.closed)
    closed = closed.copy()
    for length in sorted(SEARCH.pushes):
        bend = 0.0 if way.bend is None else length**2 * way.bend
        ahead = q + (length * way.direction + bend) * problem.scales
        allowed = _branch(problem, ahead, walks.tolerances.zero)
        reached, placed = walks.placed(ahead[None], allowed[None], closed[None])
        noise = walks.tolerances.level * length**2 * max(1.0, abs(energy))
        if reached[0] and problem.energy.value(placed[0]) < energy - noise:
            return placed[0], allowed, closed & allowed
    return None


def _branch(problem: Problem, q: Array, zero: float) -> Mask:
    d = problem.polyhedron
    if not d.is_union:
        return problem.mask(frozenset(range(problem.inequalities)))
    return problem.mask(d.selections(d.values(q).tolist(), zero)[0])

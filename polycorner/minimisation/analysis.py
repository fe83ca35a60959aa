"""Analysis of the optimality conditions at a point, over all pieces of the polyhedron there."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from polycorner.minimisation.conditions import (
    find_curvature,
    find_multipliers,
)
from polycorner.minimisation.constancy import symmetric_tangents, without
from polycorner.minimisation.degeneracy import Situation, decide, symmetric
from polycorner.minimisation.descent.statuses import NEARLY_FLAT
from polycorner.minimisation.findings import (
    OPEN,
    Analysis,
    Decision,
    FaceSize,
    Higher,
    Local,
    steepest_descent,
    undecided,
)
from polycorner.minimisation.neighbourhood import (
    falls_on_set,
    is_steady,
    obstacle,
    steady,
    unresolved,
)
from polycorner.minimisation.problem import Problem
from polycorner.minimisation.sparse.factorisation import rank as rank_of_sparse
from polycorner.minimisation.sparse.factorisation import unit
from polycorner.minimisation.sparse.optimality import first_order, leads_down, second_order
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import (
    Rows,
    independent_rows,
    inward_direction,
    null_space,
    rank,
    unit_rows,
)
from polycorner.polyhedra.faces import project
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.quotients import Quotient
from polycorner.polyhedra.strata import local_pieces
from polycorner.spaces.manifold import Array
from polycorner.tolerances import Tolerances

NEWTON = 4  # steps to a corner, the last of which is rounding
# Distances, in scale units, at which lower points are sought where a gradient vanishes: those that
# are not lost in how far the point may be off.
DISTANCES = 10.0 ** np.arange(-5, 0)
UNRESOLVED = "at the corner of the active functions beside it, their gradients may be dependent"
BLIND = "a function whose gradient vanishes may forbid these directions"
# Where several pieces meet, the first of these verdicts that any of them has decides.
DECISIVE = (
    Verdict.NOT_STATIONARY,
    Verdict.SADDLE,
    Verdict.NO_MULTIPLIER,
    Verdict.UNDECIDED,
    Verdict.MINIMUM_ALONG_LOCUS,
    Verdict.WEAK_MINIMUM,
    Verdict.STRICT_MINIMUM,
)


def corner(local: Local, active: tuple[int, ...]) -> Local | None:
    """Return the derivatives where the active functions vanish exactly.

    A point is within its tolerance of them, which is more than rounding: higher orders would tell
    it from the corner.  None where it is the corner, or where none is found as near.
    """
    held, problem, tolerances = [*active, *local.sections], local.problem, local.tolerances
    quotient = Quotient(problem.polyhedron, tolerances=tolerances, equations=tuple(local.sections))
    arrival = project(quotient, local.point, active, steps=NEWTON)
    point = arrival.point.q
    moved, u = abs(point - local.point) / problem.scales, abs(point / problem.scales)
    rounding = tolerances.rounding * (1.0 + float(u.max()))
    if not (arrival.settled and rounding < moved.max() <= OPEN * tolerances.zero):
        return None
    exact = Local.at(problem, point, tolerances, local.higher)
    return exact if abs(exact.away[held]).max() <= rounding else None


def seen_from(a: Analysis, exact: Analysis) -> Analysis:
    """Return the analysis of a point as that of the exact corner beside it."""
    # Within the tolerance both may be true: neither verdict would be evidence.
    if exact.verdict in {Verdict.NOT_STATIONARY, Verdict.NO_MULTIPLIER}:
        reason = "the exact corner of the active functions beside it is not stationary"
        return replace(a, decision=undecided(len(a.local.point), reason))
    return replace(a, verdict=exact.verdict, decision=exact.decision, second=exact.second)


def beside_inflection(a: Analysis) -> Analysis:
    """Return an analysis to second order with weak functions, where the curvature is steady.

    Beside an inflection the wall may lie on either side of it.
    """
    strict = a.verdict is Verdict.STRICT_MINIMUM
    if not is_steady(a, least=NEARLY_FLAT * a.small_curvature if strict else np.inf):
        reason = "the second order changes as much as it is over a tiny distance"
        return replace(a, verdict=Verdict.UNDECIDED, decision=undecided(len(a.local.point), reason))
    return replace(a, verdict=Verdict.WEAK_MINIMUM) if strict else a


def analyse(
    problem: Problem,
    q: Array,
    tolerances: Tolerances,
    *,
    higher: Higher = "series",
) -> Analysis:
    """Analyse every piece of the polyhedron at ``q``; return the least favourable analysis.

    Where several pieces meet, a point is a minimum of the union exactly when it is a minimum of
    each of them.  Where the second order vanishes, ``higher`` orders are seen in a series, or left
    alone; or, ``"followed"``, an energy that is constant over a distance counts as constant, which
    is no evidence: it may change very slowly.
    """
    local = Local.at(problem, q, tolerances, higher)
    values, gradients, hessians = local.values, local.gradients, local.hessians
    pieces = local_pieces(problem.polyhedron, local.away, tolerances.zero)
    if not pieces:
        return _without_conditions(local, Verdict.OUTSIDE, "")
    if not np.isfinite(values[-1]):
        reason = f"{problem.energy.name} has no finite value there"
        return _without_conditions(local, Verdict.DOMAIN_EDGE, reason)
    active = frozenset[int]().union(*pieces)
    reason = obstacle(problem, q, gradients, hessians, active, tolerances)
    if reason:
        return _without_conditions(local, Verdict.NOT_SMOOTH, reason)
    analyses = [_analyse_piece(local, piece) for piece in pieces]
    return min(analyses, key=lambda a: DECISIVE.index(a.verdict))


def _without_conditions(local: Local, verdict: Verdict, reason: str) -> Analysis:
    """Return the analysis of a point at which the conditions cannot be applied."""
    gradients, hessians = (
        np.where(np.isfinite(x), x, 0.0) for x in (local.gradients, local.hessians)
    )
    known = {"gradients": gradients, "hessians": hessians, "slope": gradients[-1]}
    finite = replace(local, **known, higher="none")
    # What an analysis holds beside its verdict, as far as derivatives are finite.
    found = _analyse_piece(finite, frozenset())
    return replace(found, verdict=verdict, obstacle=reason, local=local)


def _analyse_piece(local: Local, piece: Piece, *, settled: bool = False) -> Analysis:
    """Analyse one piece.

    A point that is not ``settled`` may lie beside the corner of its active functions.
    """
    active = tuple(sorted(piece))
    k, small = len(active), local.small
    numbers = [*active, *local.sections]
    gradients, hessians = local.gradients[numbers], local.hessians[numbers]
    blind = _blind(gradients, hessians, local.tolerances.zero)
    seen = [i for i in range(len(gradients)) if i not in blind]
    kept = sum(1 for i in seen if i < k)
    rows = Rows(gradients[seen] if blind else gradients, local.tolerances.rank)
    # Functions that vanish at the corner together may be dependent there, and not here.
    level = unresolved(local, [numbers[i] for i in seen], rows)
    if level:
        exact = None if settled else corner(local, active)
        if exact is not None:
            return _analyse_piece(exact, piece, settled=True)
        sizes = np.linalg.norm(gradients[seen], axis=1)
        # As if they were dependent exactly: multipliers are then those of the corner.
        gradients[seen] = rows.truncated(level) * sizes[:, None]
        rows = Rows(gradients[seen], local.tolerances.rank)
    slope = local.slope
    # Gradients that are dependent up to the tolerance have multipliers of up to slope / tolerance.
    most = 0.1 * float(np.linalg.norm(slope)) / local.tolerances.rank + small
    multipliers = find_multipliers(rows, kept, slope, small, most, local.tolerances.dependent)
    left = slope - multipliers.values @ rows.units
    multipliers = multipliers.spread(seen, len(gradients)) if blind else multipliers
    values = multipliers.values[:k]
    strong = [i for i in seen if i >= k or abs(values[i]) > small]
    weak = tuple(active[i] for i in seen if i < k and abs(values[i]) <= small)
    face = rows if len(strong) == len(seen) else Rows(gradients[strong], local.tolerances.rank)
    hessian = local.hessians[-1] - _combined(hessians, gradients, multipliers.values)
    small_curvature = local.tolerances.curvature * max(local.reference, float(abs(hessian).max()))
    weak_rows = local.gradients[list(weak)]
    reach = local.tolerances.zero / 10
    curvature = find_curvature(hessian, face.null_space, weak_rows, small_curvature, left, reach)
    independent = rows.independent and not blind
    positive = np.array([i for i in strong if i < k and values[i] > small], dtype=np.int64)
    result = Analysis(
        verdict=Verdict.UNDECIDED,
        active=active,
        gradients=gradients,
        rank=rows.rank,
        multipliers=multipliers,
        independent=independent,
        strong_positions=tuple(positive.tolist())
        if rows.independent
        else _independent_positions(gradients, seen, positive, k, local),
        weak=weak,
        second=curvature,
        reference=local.reference,
        small_curvature=small_curvature,
        local=local,
        blind=blind,
    )
    if not weak and np.isfinite(hessian).all():
        result = steady(result)
    verdict, higher = _verdict(result, rows), local.higher != "none"
    result = result if verdict is Verdict.UNDECIDED else replace(result, verdict=verdict)
    if level and verdict not in {Verdict.NOT_STATIONARY, Verdict.NO_MULTIPLIER}:
        decision = undecided(len(local.point), UNRESOLVED)
        result = replace(result, decision=decision, verdict=Verdict.UNDECIDED)
    elif verdict is Verdict.UNDECIDED and higher and curvature.least >= -small_curvature:
        exact = corner(local, active) if weak and independent and not settled else None
        if exact is not None:
            return seen_from(result, _analyse_piece(exact, piece, settled=True))
        decision = _decide(result, piece, strong, hessian)
        result = replace(result, decision=decision, verdict=decision.verdict)
    elif verdict in {Verdict.STRICT_MINIMUM, Verdict.SADDLE} and weak and higher:
        result = beside_inflection(result)
    result = _with_blind(result) if blind else result
    if result.verdict is Verdict.NO_MULTIPLIER and higher and falls_on_set(result):
        return replace(result, verdict=Verdict.NOT_STATIONARY)
    return result


def _blind(gradients: Array, hessians: Array, zero: float) -> tuple[int, ...]:
    """Return positions of functions whose gradients vanish, as far as the point is known.

    A function that vanishes to order ``p >= 2`` at a distance ``d`` from the point has
    ``|f| / |df| = d / p`` and ``|df| / |d^2 f| = d / (p - 1)``.  So it is active within the
    tolerance only if the second quotient is at most twice the tolerance.  Its gradient says
    nothing about the set, and a multiplier of it nothing about the energy.
    """
    sizes = abs(gradients).max(axis=1, initial=0.0)
    bends = abs(hessians).max(axis=(1, 2), initial=0.0)
    return tuple((sizes <= OPEN * zero * bends).nonzero()[0].tolist())


def _with_blind(a: Analysis) -> Analysis:
    """Return an analysis without the functions whose gradients vanish as one with them.

    A minimum of the larger set is one of the smaller.  A way down has to stay where these
    functions are not negative, which is tried at a few distances.
    """
    if a.verdict.is_minimum:
        return a
    if a.verdict is Verdict.NOT_STATIONARY and _leads_down(a, steepest_descent(a)[1]):
        return a
    if a.verdict is Verdict.SADDLE and _leads_down(a, a.curvature.vectors[:, 0]):
        return a
    if a.multipliers.exist:
        decision = undecided(len(a.local.point), BLIND)
        return replace(a, verdict=Verdict.UNDECIDED, decision=decision)
    return replace(a, verdict=Verdict.NO_MULTIPLIER)


def _leads_down(a: Analysis, way: Array) -> bool:
    """Whether the piece contains lower points in a direction, ever nearer to the point."""
    local, k = a.local, len(a.active)
    if any(i >= k for i in a.blind) or len(a.gradients) > k:
        return False
    seen = DISTANCES[DISTANCES >= local.tolerances.near / 10]
    points = local.point + seen[:, None] * way * local.problem.scales
    values, gradients = local.problem.evaluate(points, 1)
    kept = [row for i, row in enumerate(a.active) if i not in a.blind]
    vanishing = [a.active[i] for i in a.blind]
    inside = (values[:, vanishing] > 0).all() and (values[:, kept] >= -1e-12).all()
    return bool(
        inside and (values[:, -1] < local.values[-1]).all() and np.isfinite(gradients).all()
    )


def _decide(a: Analysis, piece: Piece, strong: list[int], hessian: Array) -> Decision:
    """Decide by higher orders on the face of independent strongly active functions."""
    local, flat = a.local, a.curvature.flat
    numbers = [*a.active, *local.sections]
    rows = tuple(numbers[i] for i in strong)
    if not a.weak:
        still = symmetric_tangents(local.problem, rows, local.point)
        if not without(flat, still).shape[1]:
            return symmetric(flat)
    held, values, exact = strong, a.multipliers.values, not a.blind
    # A series on the face needs independent functions: those of a basic solution are taken.
    if rank(a.gradients[strong], local.tolerances.rank) < len(strong):
        held, values = _basic_multipliers(a, strong)
        bent = _combined(local.hessians[numbers], a.gradients, values)
        hessian, exact = local.hessians[-1] - bent, False
        tangent = Rows(a.gradients[held], local.tolerances.rank).null_space
        curvature = find_curvature(hessian, tangent, local.gradients[[]], a.small_curvature)
        left = abs(local.slope - values @ unit_rows(a.gradients)).max()
        if curvature.least < -a.small_curvature or a.weak or left > local.small:
            return undecided(len(hessian), "the multipliers are not unique")
        flat = curvature.flat
        if not flat.shape[1]:
            return _second_order(a, held, values)
    sizes = np.linalg.norm(a.gradients[held], axis=1)
    return decide(
        Situation(
            analysis=a,
            piece=piece,
            rows=tuple(numbers[i] for i in held),
            multipliers=values[held] / sizes,
            exact=exact,
            hessian=hessian,
            flat=flat,
        )
    )


def _second_order(a: Analysis, held: list[int], values: Array) -> Decision:
    """Decide by positive curvature on the face of independent functions that balance the energy.

    It suffices where their multipliers are positive: other functions only make the set smaller.
    """
    n = a.gradients.shape[1]
    if all(values[i] > a.local.small for i in held if i < len(a.active)):
        return Decision(Verdict.STRICT_MINIMUM, 2, 2, np.zeros(n), "")
    return undecided(n, "the multipliers are not unique")


def _basic_multipliers(a: Analysis, strong: list[int]) -> tuple[list[int], Array]:
    """Return positions of independent functions that alone balance the energy, and multipliers.

    Equations that imply the others come first, as the face has to lie on them.  Along them
    non-negative least squares end with independent columns; the face contains that of all.
    """
    from scipy.optimize import nnls

    k, units, slope = len(a.active), unit_rows(a.gradients), a.local.slope
    equations = [i for i in strong if i >= k]
    chosen = independent_rows(units[equations], a.local.tolerances.rank)
    along = null_space(units[equations], a.local.tolerances.rank)
    rates = units @ along
    others = [i for i in strong if i < k and np.linalg.norm(rates[i]) > a.local.tolerances.rank]
    shares = (
        nnls(rates[others].T, slope @ along)[0] if others and along.size else [0.0] * len(others)
    )
    used = [i for i, share in zip(others, shares, strict=True) if share > 0]
    used += sorted(equations[i] for i in chosen)
    values = np.zeros(len(units))
    # Once more for the chosen ones together: the programme along the equations had none for these.
    values[used] = np.linalg.lstsq(units[used].T, slope, rcond=None)[0]
    return used, values


def _combined(hessians: Array, rows: Array, values: Array) -> Array:
    """Return the sum of Hessians with given multipliers of unit gradients."""
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    factors = np.divide(values, sizes, out=np.zeros_like(values), where=sizes > 0)
    k, n, _ = hessians.shape
    return np.asarray(np.dot(factors[None], hessians.reshape(k, n * n)).reshape(n, n))


def _verdict(a: Analysis, rows: Rows) -> Verdict:
    """Return the verdict before flat directions and weakly active functions are considered."""
    multipliers, curvature = a.multipliers, a.curvature
    if a.open_positions:
        return Verdict.NOT_STATIONARY  # the gap is not rounding: closing it would change the energy
    if not multipliers.exist:
        k = len(a.active)
        # With independent gradients, or a way into the set, no multiplier means not stationary.
        regular = rows.independent
        if not regular and k:
            _, rate = inward_direction(rows.units[:k], rows.units[k:])
            regular = rate > a.local.tolerances.rank
        return Verdict.NOT_STATIONARY if regular else Verdict.NO_MULTIPLIER
    if curvature.decided and curvature.least < -a.small_curvature:
        # Other multipliers may prove a minimum where they are not unique.
        return Verdict.SADDLE if multipliers.unique else Verdict.UNDECIDED
    if not curvature.decided or curvature.flat.shape[1]:
        return Verdict.UNDECIDED
    return Verdict.STRICT_MINIMUM


def _independent_positions(
    gradients: Array, seen: list[int], positive: NDArray[np.int64], k: int, local: Local
) -> tuple[int, ...]:
    """Return positions of strongly active functions with independent gradients, greedily."""
    sections = [i for i in seen if i >= k]
    chosen: list[int] = []
    reached = rank(gradients[sections], local.tolerances.rank)
    for i in positive.tolist():
        if rank(gradients[[*chosen, i, *sections]], local.tolerances.rank) > reached:
            chosen.append(i)
            reached += 1
    return tuple(chosen)


def analyse_sparse(problem: Problem, q: Array, tolerances: Tolerances) -> Analysis:
    """Analyse a point of a polyhedron without unions, with sparse matrices throughout."""
    local = Local.sparsely_at(problem, q, tolerances)
    m, zero = problem.inequalities, tolerances.zero
    active = np.flatnonzero(local.away[:m] <= zero)
    k, held = len(active), np.concatenate([active, np.array(local.sections, dtype=np.int64)])
    gradients = csr_array(local.gradients[held])
    rows = unit(gradients)
    first, level = first_order(rows, k, local.slope, local.small, tolerances)
    least = tolerances.stationary * abs(first.values).max(initial=0.0)
    strong = np.flatnonzero(first.values[:k] > least)
    carrying = rows[np.concatenate([strong, np.arange(k, len(held))])]
    read = problem.sparse_energy.used  # by the energy or a strongly active function
    read[carrying.indices] = True
    moved = np.flatnonzero(read)
    carrying = csr_array(carrying[:, moved])
    whole = level is not None and len(strong) == k
    own = level if whole else rank_of_sparse(carrying, tolerances.rank)
    result = Analysis(
        verdict=Verdict.STRICT_MINIMUM,
        active=tuple(active.tolist()),
        gradients=gradients,
        rank=level,
        multipliers=first,
        independent=first.unique,
        strong_positions=tuple(strong.tolist()),
        weak=tuple(np.delete(active, strong).tolist()),
        second=FaceSize(len(moved) - (own or 0), np.flatnonzero(~read)),
        reference=local.reference,
        small_curvature=NEARLY_FLAT * local.small,
        local=local,
    )
    if (local.away[:m] < -zero).any() or (abs(local.away[m:]) > zero).any():
        return replace(result, verdict=Verdict.OUTSIDE)
    if not first.exist:
        down = first.unique or leads_down(rows, k, local.slope)
        return replace(result, verdict=Verdict.NOT_STATIONARY if down else Verdict.NO_MULTIPLIER)
    if own is None:
        obstacle = "the rank of the active gradients is not decided"
        return replace(result, verdict=Verdict.UNDECIDED, obstacle=obstacle)
    if len(moved) == own:
        return _as_minimum(result)
    weights = np.zeros(m + len(local.sections))
    weights[held] = first.values / result.sizes
    scaling = diags_array(problem.scales)
    bent = scaling @ problem.sparse_rows.curvature(q, weights) @ scaling
    hessian = csr_array(local.hessians - bent)[moved][:, moved]
    verdict = second_order(hessian, carrying, result.small_curvature)
    if verdict is Verdict.STRICT_MINIMUM:
        return _as_minimum(result)
    return replace(result, verdict=Verdict.UNDECIDED if result.weak else verdict)


def _as_minimum(a: Analysis) -> Analysis:
    """Return an analysis whose face is a corner, or is curved upward in all that is read."""
    if isinstance(a.second, FaceSize) and len(a.second.unmoved):
        return replace(a, verdict=Verdict.MINIMUM_ALONG_LOCUS)
    return replace(a, verdict=Verdict.WEAK_MINIMUM if a.weak else Verdict.STRICT_MINIMUM)

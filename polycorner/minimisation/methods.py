"""Local minimisation of an energy on a polyhedron by three methods that must agree.

A descent measures steps in the manifold's scales.  Where these are far from the sizes over which
the functions vary, steps are short and curvatures drown in rounding errors.  A stalled descent goes
on from where it is, in scales that are estimated there, until one converges:

* ``sqrt(max_j |L_jj| / |L_ii|)`` with ``L`` the Hessian of the Lagrangian, which makes the diagonal
  of the scaled Hessian constant ([NW] sec. 2.2); where ``L`` is flat, the magnitude below;
* ``|q_i|``, the magnitude of the coordinate, where it is larger than the manifold's scale.

A wall that touches what the equations define, without cutting anything off, shortens every
linearised step towards the point of contact: where ``f >= 0`` has the gap ``t^2 / 2`` at the
distance ``t``, by half of it.  The steps converge to that point, whatever the energy does there,
and the descent goes on from lower points beside it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.minimisation.analysis import analyse
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.descent import statuses
from polycorner.minimisation.escapes import Escape, domain_edge, escape
from polycorner.minimisation.feasibility import approach
from polycorner.minimisation.findings import steepest_descent
from polycorner.minimisation.polishing import Endpoint, slsqp
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.sparse.descent import descend
from polycorner.minimisation.sparse.faces import on_face
from polycorner.minimisation.sparse.nonlinear import Nonlinear
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import Rows
from polycorner.polyhedra.polyhedron import MAX_SELECTIONS, Piece, Polyhedron
from polycorner.polyhedra.strata import distances
from polycorner.printing import number
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, RANK_TOLERANCE, SEARCH, TOLERANCE, Tolerances

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy

CONTACTS = 50  # from which a descent goes on
NEARLY = 1000 * DEFAULT.rank  # singular value of unit gradients that is to be looked at
FARTHEST = 1e3  # longest step of Newton's method towards a chosen face, in scale units
End = tuple[int, int, Array, Array]  # status, iterations, point, multipliers
FLAT = DEFAULT.rounding / 10  # relative diagonal entry below which a coordinate is flat
UNEVEN = 1e3  # ratio of estimated scales, in the manifold's, for which a flat end is doubted
PATIENCE = 100  # a lower limit on the steps is meant to cut the descent short
Method = Literal["newton", "slsqp", "scp"]
Descent = Callable[[Problem, Piece, Array, int], Endpoint]  # from a point, inside one piece
MAX_SWITCHES = 50  # of branches in a union
FIRM = {Verdict.STRICT_MINIMUM, Verdict.WEAK_MINIMUM}  # not decided by rounding far away
DISTANT = 8.0  # scale units beyond which a flat end is doubted
FADED = 1e-2  # size of derivatives, relative to those at the start, below which it is doubted


def sparse_descent(problem: Problem, q: Array, limit: int, tolerances: Tolerances) -> Endpoint:
    """Descend from ``q`` in a sparse polyhedron; see :mod:`.sparse.descent`."""
    end = descend(Nonlinear(problem, tolerances), q / problem.scales, limit)
    return Endpoint(end.point * problem.scales, end.iterations, end.failure)


def sparse_on_face(
    problem: Problem, active: Piece, q: Array, tolerances: Tolerances
) -> tuple[Array, float]:
    """Apply Newton's method on a face; return the point and the length of the last step."""
    programme = Nonlinear(problem, tolerances)
    held = np.concatenate([np.array(sorted(active), dtype=np.int64), programme.equations])
    found = on_face(programme, held, q / problem.scales, far=FARTHEST)
    if found is None:
        return q, np.inf
    return found.point * problem.scales, found.last_step


def rescaled(problem: Problem, piece: Piece, limit: int, end: End) -> tuple[int, int, Array]:
    """Let a descent go on in estimated scales that stalled, or where it is flat and uneven.

    Returned are status, iterations of all and the point of the first descent that converges to a
    point as low, otherwise those given.
    """
    status, spent, q, multipliers = end
    if status == statuses.STALLED and spent >= limit and limit < PATIENCE:
        return status, spent, q
    for scales in estimated_scales(problem, q, multipliers):
        even = np.ptp(np.log(scales / problem.scales)) < np.log(UNEVEN)
        if even and status == statuses.UNEVEN:
            break
        ended, more, point, _ = problem.descend(piece, q, limit, scales)
        spent += more
        lower = problem.energy.value(point) <= problem.energy.value(q)
        if lower and ended in (statuses.CONVERGED, statuses.LEVEL, statuses.UNEVEN):
            return ended, spent, point
    return status, spent, q


def estimated_scales(problem: Problem, q: Array, multipliers: Array) -> Iterator[Array]:
    """Yield scales ``(n,)`` at ``q``, where the energy's multipliers by row are given."""
    magnitudes = np.maximum(abs(q), problem.scales)
    bends = problem.evaluate(q, 2)[2].diagonal(axis1=1, axis2=2)
    with np.errstate(all="ignore"):
        sizes = abs(bends[-1] - multipliers @ bends[:-1]) / problem.scales**2
    if np.isfinite(sizes).all() and sizes.max() > 0:
        flat = sizes <= FLAT * sizes.max()
        yield np.where(flat, magnitudes, np.sqrt(sizes.max() / np.where(flat, 1.0, sizes)))
    yield magnitudes


def advice(problem: Problem, q: Array) -> str:
    """Return in words which scales of the manifold the curvatures at a point suggest, if others."""
    scales = next(estimated_scales(problem, q, np.zeros(problem.rows - 1)))
    if not np.isfinite(scales).all() or np.ptp(np.log(scales / problem.scales)) < np.log(UNEVEN):
        return (
            "No other scales of single coordinates suggest themselves; more steps may help "
            "(max_iterations)."
        )
    shown = ", ".join(number(scale, 2) for scale in scales / scales.min() * problem.scales.min())
    return f"A manifold with scales=({shown}) would suit the curvatures there."


@shown
def minimise(
    polyhedron: Polyhedron,
    energy: "Energy",
    start: ArrayLike | Mapping[str, float],
    *,
    method: Method = "newton",
    max_iterations: int = 200,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Certificate:
    """Find a local minimum of the energy on the polyhedron by descent from ``start``.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    start : (n,) array or mapping from coordinate names
        Where to start.  A start outside ``D`` is first projected onto ``D``, by repeated
        linearisation or, where that fails, by least squares of the violation.  The verdict is
        ``INFEASIBLE`` where these end at a stationary point of the violation.
    method : {"newton", "slsqp", "scp"}, optional
        ``"newton"`` (default) descends inside ``D`` by an active-set method, every iterate
        feasible and lower than the last and never through a wall, then solves the KKT equations
        of the face to machine precision.  ``"slsqp"`` is SciPy's ([Kraft]), ``"scp"`` a sequence
        of convex programmes in cvxpy; both end by solving the same KKT equations.
    max_iterations : int, optional
        Limit on the steps in each piece.  A descent that stalls, or is cut after a hundred steps
        or more, goes on with scales estimated from the data, as often as there are estimates.
    tolerance, rank_tolerance : float, optional
        See :class:`~polycorner.minimisation.certificate.Certificate`.

    Returns
    -------
    Certificate
        Its verdict says what was found; a failed search gives a certificate, too.

    Notes
    -----
    In a large polyhedron without unions, of functions that read few coordinates each,
    ``"newton"`` uses sparse matrices throughout: quadratic programmes in a trust region, then
    Newton's method on the face.  The energy should be a sum of functions of few coordinates
    (:meth:`.SmoothFunction.sum`), as a SymPy sum is.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong kind, an energy that is not finite at the start, or a polyhedron
        whose full matrices are too large and that is not sparse.
    SolverError
        If cvxpy does not find its solver.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y})
    >>> c = minimise(D, x + y, [1.0, 1.5])
    >>> c.point.round(6).tolist(), c.active, c.verdict.name
    ([-0.5, 0.25], ('bowl',), 'STRICT_MINIMUM')
    """
    checks.choice("method", method, _DESCENTS)
    checks.whole("max_iterations", max_iterations, least=1, most=checks.MOST)
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    problem = pose(polyhedron, energy)
    problem.check_size()
    q = polyhedron.manifold.point(start, "start")
    if method != "newton":
        problem.check_energy(q, "start")
    if method == "newton" and problem.is_sparse:
        problem.check_energy(q, "start")
        end = sparse_descent(problem, q, int(max_iterations), tolerances)
    else:
        descent = _diagnosing(method, tolerances)
        end = _descend_union(problem, q, descent, int(max_iterations), tolerances)
    if end.failure is Verdict.INFEASIBLE:
        problem.check_energy(q, "start")
    ways = (tolerance, rank_tolerance, method, end.iterations)
    found = Certificate(problem, end.point, *ways, end.failure, end.note)
    if end.failure is None and end.note and found.verdict not in FIRM:
        return replace(found, search=Verdict.NOT_CONVERGED)  # so far away, rounding decides
    return found


@shown
def stationary_on(
    polyhedron: Polyhedron,
    energy: "Energy",
    start: ArrayLike | Mapping[str, float],
    active: "list[str] | tuple[str, ...]",
    *,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Certificate:
    """Solve the KKT equations of one face near ``start``, for any kind of stationary point.

    The energy restricted to ``{f_i = 0 for i active, h = 0}`` is stationary at the result, which
    may be a saddle or have negative multipliers; the certificate says what it is on ``D``.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    start : (n,) array or mapping from coordinate names
        Where Newton's method starts.
    active : list or tuple of str
        Names of the inequalities that vanish on the face.
    tolerance, rank_tolerance : float, optional
        See :class:`~polycorner.minimisation.certificate.Certificate`.

    Returns
    -------
    Certificate
        With the verdict ``NOT_CONVERGED`` if Newton's method finds no such point.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong kind, unknown names, or an energy that is not finite at the
        start.
    """
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    problem = pose(polyhedron, energy)
    problem.check_size()
    names = polyhedron.names
    if not isinstance(active, list | tuple):
        checks.refuse("active", f"a list of names among {', '.join(names)}", active, TypeError)
    checks.names("active", active, names)
    q = polyhedron.manifold.point(start, "start")
    problem.check_energy(q, "start")
    face = frozenset(polyhedron.names.index(name) for name in active)
    if problem.is_sparse:
        point, last = sparse_on_face(problem, face, q, tolerances)
    else:
        point, last = problem.on_face(face, q)
    failure = None if last < tolerances.zero else Verdict.NOT_CONVERGED
    return Certificate(
        problem, point if failure is None else q, tolerance, rank_tolerance, "face", 1, failure
    )


def _descend_union(
    problem: Problem, q: Array, descent: Descent, limit: int, tolerances: Tolerances
) -> Endpoint:
    """Descend in one branch of the and/or tree after another until none leads lower."""
    d = problem.polyhedron
    pieces = [frozenset(range(problem.inequalities))]
    if d.is_union:
        values = d.values(q).tolist()
        # Parts that hold here need not lead to a point at which all of a branch does.
        pieces = [*dict.fromkeys([*d.selections(values), *d.selections(values, np.inf)])]
    for piece in pieces:
        end = descent(problem, piece, q, limit)
        if end.failure is not Verdict.INFEASIBLE:
            break
    else:
        end = _descend_from_outside(problem, pieces, q, descent, limit, tolerances)
    if not d.is_union:
        return end
    spent = end.iterations
    for _ in range(MAX_SWITCHES):
        if end.failure is not None:
            break
        lower = _lower_branch(problem, end, descent, limit, tolerances.zero)
        if lower is None:
            break
        end, spent = lower, spent + lower.iterations
    return replace(end, iterations=spent)


def _descend_from_outside(
    problem: Problem,
    pieces: list[Piece],
    q: Array,
    descent: Descent,
    limit: int,
    tolerances: Tolerances,
) -> Endpoint:
    """Descend from a point of least violation; INFEASIBLE is said where that is stationary."""
    ends = []
    for piece in pieces:
        found = approach(problem, piece, q, tolerances)
        if found.feasible:
            return descent(problem, piece, found.point, limit)
        ends.append(found)
    empty = all(end.stationary for end in ends) and len(pieces) < MAX_SELECTIONS
    failure = Verdict.INFEASIBLE if empty else Verdict.NOT_CONVERGED
    return Endpoint(ends[0].point, 0, failure)


def _lower_branch(
    problem: Problem, end: Endpoint, descent: Descent, limit: int, touching: float
) -> Endpoint | None:
    """Return the end of a descent in another branch at this point that leads lower, or None."""
    d = problem.polyhedron
    values, gradients, hessians = problem.evaluate(end.point, 2)
    m = problem.inequalities
    noise = 1e-10 * (abs(values[-1]) + abs(gradients[-1]).max() + abs(hessians[-1]).max())
    for piece in d.selections(distances(values[:m], gradients[:m]).tolist(), touching):
        other = descent(problem, piece, end.point, limit)
        if other.failure is Verdict.INFEASIBLE:
            continue
        lower = float(problem.energy.value(other.point)) < values[-1] - noise
        if lower or other.failure is Verdict.UNBOUNDED:
            return other
    return None


def _newton(problem: Problem, piece: Piece, q: Array, limit: int, _: Tolerances) -> Endpoint:
    status, iterations, point, multipliers = problem.descend(piece, q, limit)
    if status in {statuses.STALLED, statuses.UNEVEN}:
        status, iterations, point = rescaled(
            problem, piece, limit, (status, iterations, point, multipliers)
        )
    failures = {
        statuses.INFEASIBLE: Verdict.INFEASIBLE,
        statuses.UNBOUNDED: Verdict.UNBOUNDED,
        statuses.STALLED: Verdict.NOT_CONVERGED,
    }
    return Endpoint(
        point, iterations, failures.get(status), flat=status in {statuses.LEVEL, statuses.UNEVEN}
    )


def _scp(problem: Problem, piece: Piece, q: Array, limit: int, tolerances: Tolerances) -> Endpoint:
    from polycorner.minimisation.scp import scp

    return scp(problem, piece, q, limit, tolerances)


_DESCENTS: dict[str, Callable[[Problem, Piece, Array, int, Tolerances], Endpoint]] = {
    "newton": _newton,
    "slsqp": slsqp,
    "scp": _scp,
}


def _diagnosing(method: Method, tolerances: Tolerances) -> Descent:
    """Return a method's descent whose failures say where they end, as far as that is seen."""

    def plain(problem: Problem, piece: Piece, q: Array, limit: int) -> Endpoint:
        return _DESCENTS[method](problem, piece, q, limit, tolerances)

    def descent(problem: Problem, piece: Piece, q: Array, limit: int) -> Endpoint:
        end = plain(problem, piece, q, limit)
        if end.failure is not None and problem.rows - problem.inequalities > 2:
            end = _without_dependent(problem, piece, q, plain, limit, end, tolerances)
        # Newton's method converges at stationary points only, beside which nothing is lower to
        # first order; the others are believed less.
        if method != "newton" or end.failure is not None:
            end = go_on(problem, piece, end, plain, limit, tolerances)
        if end.failure is None and not end.flat:
            return end
        if end.failure is Verdict.INFEASIBLE:
            return end
        if _is_doubtful(problem, q, end, tolerances):
            return _diagnosed(problem, piece, q, limit, end, tolerances)
        return replace(end, failure=None)

    return descent


def _without_dependent(
    problem: Problem,
    piece: Piece,
    q: Array,
    plain: Descent,
    limit: int,
    end: Endpoint,
    tolerances: Tolerances,
) -> Endpoint:
    """Repeat a failed descent with independent equations that imply the others nearby."""
    smaller = problem.with_independent_equations(piece, [end.point, q], tolerances)
    if len(smaller.polyhedron.equations) == len(problem.polyhedron.equations):
        return end
    found = plain(smaller, frozenset(range(len(piece))), q, limit)
    values, gradients = problem.evaluate(found.point, 1)
    return found if problem.holds(frozenset(), values, gradients, tolerances.zero) else end


def _is_doubtful(problem: Problem, start: Array, end: Endpoint, tolerances: Tolerances) -> bool:
    """Whether a descent ended at no minimum, or far away where nothing is decided.

    One that stalls at a minimum, as where gradients are dependent, has not failed.
    """
    far = bool(abs((end.point - start) / problem.scales).max() >= DISTANT)
    if end.failure not in {None, Verdict.NOT_CONVERGED}:
        return True
    if end.failure is None and not far:
        return False
    with np.errstate(all="ignore"):
        found = analyse(problem, end.point, tolerances, higher="followed")
    if end.failure is None:
        return found.verdict is Verdict.UNDECIDED
    if not found.verdict.is_minimum:
        return True
    # Where derivatives fade, rounding decides.
    return far and found.reference < FADED * Certificate(problem, start).analysis.reference


def _diagnosed(
    problem: Problem, piece: Piece, q: Array, limit: int, end: Endpoint, tolerances: Tolerances
) -> Endpoint:
    """Return the end of a failed descent with what is seen of where it leads."""
    edge = domain_edge(problem, piece, end.point, tolerances)
    if edge is not None:
        return _ended(end, edge)
    if end.failure is Verdict.NOT_CONVERGED and limit < PATIENCE:
        return replace(end, note=f"It was stopped after {end.iterations} steps.")
    found = escape(problem, piece, q, tolerances)
    if found.verdict is Verdict.NOT_CONVERGED or (found.verdict is None and end.failure is None):
        note = f"{found.note} {advice(problem, end.point)}".lstrip()
        return end if end.failure is None else replace(end, failure=found.verdict, note=note)
    point = end.point if end.failure is found.verdict else found.point
    if not np.isfinite(problem.energy.value(point)):
        edge = domain_edge(problem, piece, point, tolerances)
        if edge is not None:
            return _ended(end, edge)
    return _ended(end, replace(found, point=point))


def _ended(end: Endpoint, found: Escape) -> Endpoint:
    return Endpoint(found.point, end.iterations, found.verdict, found.note)


def go_on(
    problem: Problem,
    piece: Piece,
    end: Endpoint,
    descent: Descent,
    limit: int,
    tolerances: Tolerances,
) -> Endpoint:
    """Repeat a descent from lower points beside its end, as long as there are any."""
    for _ in range(CONTACTS):
        lower = _lower_point(problem, piece, end, tolerances)
        if lower is None:
            break
        further = descent(problem, piece, lower, limit)
        if not problem.energy.value(further.point) < problem.energy.value(end.point):
            break
        end = replace(further, iterations=end.iterations + further.iterations)
    return end


def _lower_point(
    problem: Problem, piece: Piece, end: Endpoint, tolerances: Tolerances
) -> Array | None:
    """Return a point of the piece that is lower than the end of a descent at a contact."""
    if end.failure not in {None, Verdict.NOT_CONVERGED}:
        return None
    values, gradients = problem.evaluate(end.point, 1)
    away, m = distances(values[:-1], gradients[:-1]), problem.inequalities
    near = [i for i in piece if away[i] <= tolerances.zero]
    numbers = [*near, *range(m, problem.rows - 1)]
    if not near or len(numbers) < 2 or not np.isfinite(gradients[numbers]).all():
        return None
    if Rows(gradients[numbers], NEARLY).independent:
        return None
    with np.errstate(all="ignore"):
        found = analyse(problem, end.point, tolerances, higher="followed")
    if found.verdict is not Verdict.NOT_STATIONARY or found.independent:
        return None
    rate, way = steepest_descent(found)
    for step in SEARCH.pushes:
        reached, point = problem.restore(piece, end.point + step * way * problem.scales)
        if reached and problem.energy.value(point) < values[-1] - rate * step / 4:
            return point
    return None

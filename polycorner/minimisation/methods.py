"""Where an energy comes to rest on a polyhedron, by three methods that must agree."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.cones import Rows, unit_rows
from polycorner.polyhedra.polyhedron import Piece, Polyhedron
from polycorner.polyhedra.strata import RANK_TOLERANCE, TOLERANCE, check_tolerance, distances
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy

Method = Literal["newton", "slsqp", "scp"]

MAX_SWITCHES = 50
FAR = 1e8  # a search that ends farther away, in scale units, found no rest
NEAR = 1e-3  # scaled distance within which a function may be active at an unpolished minimum


@dataclass(frozen=True)
class Rest:
    """Where a search ended inside one piece."""

    point: Array
    iterations: int
    failure: Verdict | None


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
    """Let the energy come to rest on the polyhedron, starting at ``start``.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    start : (n,) array or mapping from coordinate names
        Where to start.  Outside ``D`` the start is first moved to the nearest point that
        repeated linearisation finds; if there is none the verdict is ``INFEASIBLE``.
    method : {"newton", "slsqp", "scp"}, optional
        ``"newton"`` (default) descends inside ``D`` by an active-set method, every iterate
        feasible and lower than the last and never through a wall, then solves the KKT equations
        of the face to machine precision.  ``"slsqp"`` is SciPy's ([Kraft]), ``"scp"`` a sequence
        of convex programmes stated in cvxpy; both are finished on the face in the same way.
    max_iterations : int, optional
        Limit on the steps in each piece.
    tolerance, rank_tolerance : float, optional
        See :class:`~polycorner.minimisation.certificate.Certificate`.

    Returns
    -------
    Certificate
        Always; its verdict says what was found.

    Raises
    ------
    TypeError, ValueError
        For arguments of the wrong kind, or an energy that is not finite at the start.
    SolverError
        If a back end breaks.

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
    search = _SEARCHES.get(method) if isinstance(method, str) else None
    if search is None:
        msg = f"method: expected one of {', '.join(map(repr, _SEARCHES))}; got {method!r}"
        raise ValueError(msg)
    whole = isinstance(max_iterations, Integral) and not isinstance(max_iterations, bool)
    if not whole or max_iterations < 1:
        msg = f"max_iterations: expected a positive whole number; got {max_iterations!r}"
        raise ValueError(msg)
    check_tolerance("tolerance", tolerance)
    check_tolerance("rank_tolerance", rank_tolerance)
    problem = pose(polyhedron, energy)
    q = polyhedron.manifold.point(start, "start")
    if search is not _newton:
        problem.check_energy(q, "start")
    rest = _descend_union(problem, q, search, max_iterations)
    if rest.failure is Verdict.INFEASIBLE:
        problem.check_energy(q, "start")
    return Certificate(
        problem, rest.point, tolerance, rank_tolerance, method, rest.iterations, rest.failure
    )


def stationary_on(
    polyhedron: Polyhedron,
    energy: "Energy",
    start: ArrayLike | Mapping[str, float],
    active: "list[str] | tuple[str, ...]",
    *,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Certificate:
    """Solve the KKT equations of one face near ``start``, whatever kind of point that gives.

    The result may be a saddle or have negative multipliers: it is where the energy restricted to
    ``{f_i = 0 for i active, h = 0}`` is stationary, and the certificate says what it is on ``D``.
    The verdict is ``NOT_CONVERGED`` when Newton's method finds no such point.
    """
    check_tolerance("tolerance", tolerance)
    check_tolerance("rank_tolerance", rank_tolerance)
    problem = pose(polyhedron, energy)
    names = polyhedron.names
    if not isinstance(active, list | tuple) or not all(isinstance(name, str) for name in active):
        msg = f"active: expected a list of names among {', '.join(names)}; got {active!r}"
        raise TypeError(msg)
    unknown = [name for name in active if name not in names]
    if unknown:
        msg = f"active: expected names among {', '.join(names)}; got {', '.join(unknown)}"
        raise ValueError(msg)
    q = polyhedron.manifold.point(start, "start")
    problem.check_energy(q, "start")
    face = frozenset(polyhedron.names.index(name) for name in active)
    point, last = problem.on_face(face, q)
    failure = None if last < 1e-8 else Verdict.NOT_CONVERGED
    return Certificate(
        problem, point if failure is None else q, tolerance, rank_tolerance, "face", 1, failure
    )


def _descend_union(problem: Problem, q: Array, search: "Search", limit: int) -> Rest:
    """Descend in one branch of the tree after another until none leads lower."""
    d = problem.polyhedron
    first, *others = (
        d.selections(d.values(q).tolist())
        if d.is_union
        else [frozenset(range(problem.inequalities))]
    )
    rest = search(problem, first, q, limit)
    for piece in others:
        if rest.failure is not Verdict.INFEASIBLE:
            break
        rest = search(problem, piece, q, limit)
    if not d.is_union:
        return rest
    spent = rest.iterations
    for _ in range(MAX_SWITCHES):
        if rest.failure is not None:
            break
        lower = _lower_branch(problem, rest, search, limit)
        if lower is None:
            break
        rest, spent = lower, spent + lower.iterations
    return Rest(rest.point, spent, rest.failure)


def _lower_branch(problem: Problem, rest: Rest, search: "Search", limit: int) -> Rest | None:
    """Return a rest in another branch that meets here and leads lower, if there is one."""
    d = problem.polyhedron
    values, gradients, hessians = problem.evaluate(rest.point, 2)
    m = problem.inequalities
    noise = 1e-10 * (abs(values[-1]) + abs(gradients[-1]).max() + abs(hessians[-1]).max())
    for piece in d.selections(distances(values[:m], gradients[:m]).tolist(), 1e-8):
        other = search(problem, piece, rest.point, limit)
        if other.failure is Verdict.INFEASIBLE:
            continue
        if other.failure is Verdict.UNBOUNDED or _energy(problem, other.point) < values[-1] - noise:
            return other
    return None


def _energy(problem: Problem, q: Array) -> float:
    return float(problem.energy.value(q))


def _newton(problem: Problem, piece: Piece, q: Array, limit: int) -> Rest:
    from polycorner.minimisation.descent import sqp

    status, iterations, point, _ = problem.descend(piece, q, limit)
    failures = {
        sqp.INFEASIBLE: Verdict.INFEASIBLE,
        sqp.UNBOUNDED: Verdict.UNBOUNDED,
        sqp.STALLED: Verdict.NOT_CONVERGED,
    }
    return Rest(point, iterations, failures.get(status))


def _slsqp(problem: Problem, piece: Piece, q: Array, limit: int) -> Rest:
    """SciPy's SLSQP in scaled coordinates, energy and gaps scaled to their own size."""
    from scipy.optimize import minimize

    scales, m = problem.scales, problem.inequalities
    values, gradients, hessians = problem.evaluate(q, 2)
    size = float(max(abs(gradients[-1]).max(), abs(hessians[-1]).max())) or 1.0
    rows = sorted(piece)
    sections = list(range(m, problem.rows - 1))
    floor = float(values[-1])
    options: Any = {"ftol": 1e-15, "maxiter": limit}

    def constraint(kind: str, kept: list[int]) -> Any:
        return {
            "type": kind,
            "fun": lambda u: problem.evaluate(u * scales, 0)[0][kept],
            "jac": lambda u: problem.evaluate(u * scales, 1)[1][kept],
        }

    def energy(u: Array) -> float:
        return float(problem.evaluate(u * scales, 0)[0][-1] - floor) / size

    def slope(u: Array) -> Array:
        return np.asarray(problem.evaluate(u * scales, 1)[1][-1] / size)

    found = minimize(
        energy,
        q / scales,
        jac=slope,
        method="SLSQP",
        constraints=[constraint(k, kept) for k, kept in (("ineq", rows), ("eq", sections)) if kept],
        options=options,
    )
    stopped = found.status in (0, 8)
    return _finished(problem, piece, q, found.x * scales, int(found.nit), stopped=stopped)


def _scp(problem: Problem, piece: Piece, q: Array, limit: int) -> Rest:
    from polycorner.minimisation.scp import sequential_convex

    point, iterations, settled = sequential_convex(problem, piece, q, limit)
    return _finished(problem, piece, q, point, iterations, stopped=settled)


def _finished(
    problem: Problem, piece: Piece, start: Array, q: Array, iterations: int, *, stopped: bool
) -> Rest:
    """Polish an approximate minimum on the face of the functions that hold it."""
    if not np.isfinite(q).all():
        q = start
    values, gradients = problem.evaluate(q, 1)
    if abs(q / problem.scales).max() > FAR and _missed(problem, piece, q, 1e-6) == frozenset():
        return Rest(start, iterations, Verdict.UNBOUNDED)
    if np.isfinite(values).all() and np.isfinite(gradients).all():
        point = _polished(problem, piece, q, _holding(problem, piece, values, gradients))
        if point is not None:
            return Rest(point, iterations, None if stopped else Verdict.NOT_CONVERGED)
    for origin in (q, start):
        reached, point = problem.restore(piece, origin)
        if reached and np.isfinite(problem.energy.value(point)):
            return Rest(point, iterations, Verdict.NOT_CONVERGED)
    return Rest(q, iterations, Verdict.INFEASIBLE)


def _polished(problem: Problem, piece: Piece, q: Array, face: Piece) -> Array | None:
    """Return the stationary point of a face near ``q``, the face corrected as it turns out.

    Functions that are missed join the face; functions with negative multipliers leave it.
    """
    seen: set[Piece] = set()
    while face not in seen:
        seen.add(face)
        point, last = problem.on_face(face, q)
        if not last < 1e-8 or abs((point - q) / problem.scales).max() > 0.1:
            return None
        missed = _missed(problem, piece, point)
        if missed is None:
            return None
        pulling = _pulling(problem, face, point)
        if not missed and not pulling:
            return point
        face = (face | missed) if missed else face - pulling
    return None


def _pulling(problem: Problem, face: Piece, point: Array) -> Piece:
    """Return the functions of an independent face with negative multipliers."""
    _, gradients = problem.evaluate(point, 1)
    chosen = sorted(face)
    rows = Rows(gradients[[*chosen, *range(problem.inequalities, problem.rows - 1)]], 1e-8)
    if not chosen or not rows.independent:
        return frozenset()
    weights = rows.weights(gradients[-1])[: len(chosen)]
    small = 1e-9 * float(abs(gradients[-1]).max())
    return frozenset(i for i, weight in zip(chosen, weights, strict=True) if weight < -small)


def _holding(problem: Problem, piece: Piece, values: Array, gradients: Array) -> Piece:
    """Return the functions near zero that carry a share of the energy's gradient."""
    from scipy.optimize import nnls

    m = problem.inequalities
    away = distances(values[:-1], gradients[:-1])
    near = [i for i in sorted(piece) if away[i] <= NEAR]
    if not near:
        return frozenset()
    sections = unit_rows(gradients[m:-1])
    columns = np.vstack([unit_rows(gradients[near]), sections, -sections])
    shares, _ = nnls(columns.T, gradients[-1])
    size = abs(gradients[-1]).max()
    return frozenset(i for i, share in zip(near, shares, strict=False) if share > 1e-6 * size)


def _missed(problem: Problem, piece: Piece, q: Array, tolerance: float = 1e-10) -> Piece | None:
    """Return the inequalities of a piece that fail at ``q``, or None where an equation does."""
    values, gradients = problem.evaluate(q, 1)
    away = distances(values[:-1], gradients[:-1])
    m = problem.inequalities
    if not (abs(away[m:]) <= tolerance).all():
        return None
    return frozenset(i for i in piece if not away[i] >= -tolerance)


Search = Callable[[Problem, Piece, Array, int], Rest]
_SEARCHES: dict[str, Search] = {"newton": _newton, "slsqp": _slsqp, "scp": _scp}

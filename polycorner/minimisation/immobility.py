"""Whether a point of a polyhedron is isolated: immobility to first and second order.

Let ``f_i`` be active at ``q`` and ``h_j`` be the equations, with the cone ``C`` of velocities ``v``
such that ``df_i v >= 0`` and ``dh_j v = 0``.

- *First order*: if ``C = {0}``, then ``q`` is isolated, since differences to points of ``D`` that
  tend to ``q`` have a limit direction in ``C``.  Of a rigid body this is form closure
  ([Reuleaux]).
- *Second order*: if a stress ``lam >= 0``, ``mu`` with ``sum lam_i df_i + sum mu_j dh_j = 0`` makes
  ``L = sum lam_i f_i + sum mu_j h_j`` negative definite on the span of ``C``, then ``q`` is
  isolated: along points of ``D`` that tend to ``q``, ``L = sum lam_i f_i >= 0``, and also
  ``L < 0`` to second order ([RB], [CW]).
- *Mobile*: if ``v`` in ``C`` and ``w`` have ``df_i w + v' d2f_i v > 0`` wherever ``df_i v = 0``,
  and ``dh_j w + v' d2h_j v = 0`` with independent ``dh_j``, then ``D`` contains a curve
  ``q + t v + t^2 w / 2 + ...``.  Or no function falls along a line (a great circle) from ``q``, as
  where a flat side slides: compared at three points, to rounding.

A positive ``lam_i`` has ``df_i v = 0`` on all of ``C``, so that ``L`` matters on its span only.
Where second derivatives jump, as where a contact reaches the end of an edge, only the first order
counts.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import instance, refuse
from polycorner.errors import SolverError
from polycorner.kinds import checked
from polycorner.minimisation.scp import ONE_AT_A_TIME, solve
from polycorner.polyhedra.cones import Rows, linear_programme, null_space
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import stratum_at
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH, TOLERANCE, Tolerances
from polycorner.values import Checked

JUMP = 1e-2  # change of a scaled second derivative that counts as one


class Mobility(Enum):
    """Whether a point can move, and which theorem says so."""

    FIRST_ORDER = "immobile to first order: form closure (Reuleaux)"
    SECOND_ORDER = "immobile to second order, by a stress (Rimon and Burdick)"
    MOBILE = "mobile: a motion leaves the point"
    UNDECIDED = "undecided: neither first nor second order tells"


@dataclass(frozen=True, eq=False)
class Immobility(Checked):
    """What holds a point, or how it moves.

    Attributes
    ----------
    mobility : Mobility
    stress : mapping from str to float
        Of functions and equations: weights whose gradients balance, those of functions at least
        zero with the sum 1.  They hold the point to second order; empty otherwise.
    motion : (N,) array, optional
        The velocity of a motion that leaves the point, in the manifold's coordinates.
    """

    mobility: Mobility
    stress: Mapping[str, float]
    motion: Array | None = None

    def __repr__(self) -> str:
        """Return the verdict."""
        return f"Immobility({self.mobility.value})"


@checked
def immobility(
    polyhedron: Polyhedron,
    q: ArrayLike | Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
) -> Immobility:
    """Say whether a point is isolated in ``D``, as that of a part in a grip should be.

    Parameters
    ----------
    polyhedron : Polyhedron
    q : (N,) array or mapping from str to float
        A point of it.
    tolerance : float, optional
        As for :func:`~polycorner.stratum_at`.

    Returns
    -------
    Immobility
        In a union of pieces a point is immobile if it is so in each; the stress is then that of
        the first piece.

    Raises
    ------
    ValueError
        If the point is not in ``D``.
    SolverError
        If a small programme cannot be solved.

    Examples
    --------
    Three fingers against the middles of the sides of a triangle can only be told to hold it to
    second order: to first order it turns.

    >>> from polycorner.bodies import Arrangement, disc, polygon
    >>> triangle = polygon([[2, 0], [-1, 3**0.5], [-1, -(3**0.5)]])
    >>> at = [[-1.5, 0], [0.75, 0.75 * 3**0.5], [0.75, -0.75 * 3**0.5]]
    >>> fingers = {f"finger{k}": disc(0.5, at=p) for k, p in enumerate(at)}
    >>> grip = Arrangement({"T": triangle}, fixed=fingers)
    >>> immobility(grip.polyhedron, grip.point({"T": [0, 0]}))
    Immobility(immobile to second order, by a stress (Rimon and Burdick))
    """
    instance("polyhedron", polyhedron, Polyhedron)
    tolerances = Tolerances.of(tolerance)
    point = polyhedron.manifold.point(q)
    pieces = stratum_at(polyhedron, point, tolerance=tolerance).pieces
    if not pieces:
        refuse("q", "a point of the polyhedron", point.tolist())
    found = list(_of_pieces(polyhedron, point, pieces, tolerances))
    kinds = [some.mobility for some in found]
    for kind in (Mobility.MOBILE, Mobility.UNDECIDED, Mobility.SECOND_ORDER):
        if kind in kinds:
            return found[kinds.index(kind)]
    return found[0]


def _of_pieces(
    polyhedron: Polyhedron, q: Array, pieces: tuple[tuple[str, ...], ...], tolerances: Tolerances
) -> Iterator[Immobility]:
    """Yield the answer for each piece, in scaled coordinates with unit gradients."""
    scales = polyhedron.manifold.scale_array
    values, gradients, hessians = polyhedron.bundle.evaluate(q, 2)
    names = (*polyhedron.names, *polyhedron.equation_names)
    finite = np.asarray(np.isfinite(gradients).all(axis=1))
    gradients = np.where(finite[:, None], gradients, 0.0) * scales
    lengths = np.linalg.norm(gradients, axis=1)[:, None]
    lengths[lengths == 0] = 1.0
    units = gradients / lengths
    hessians = hessians * np.outer(scales, scales) / lengths[..., None]
    count = len(polyhedron.names)
    held = list(range(count, len(names)))
    beside = 10 * tolerances.difference * scales  # across which second derivatives may jump
    jumps = _jumps(polyhedron, q, beside) * np.outer(scales, scales) / lengths[..., None]
    # What active functions and equations miss zero by, as far as that violates them.
    missed = np.where(abs(values) <= tolerances.zero * lengths[:, 0], values, 0.0)
    missed[:count] = np.minimum(missed[:count], 0.0)

    def slides(v: Array) -> bool:
        """Whether no function falls along a line, up to rounding."""
        along = np.array(SEARCH.pushes)[:, None] * v * scales
        points = polyhedron.manifold.placed(polyhedron.manifold.moved(q, along))
        away = (polyhedron.bundle.evaluate(points, 0)[0] - missed) / lengths[:, 0]
        inside, off = away[:, :count], abs(away[:, count : count + len(polyhedron.stated)])
        rounding = tolerances.zero / 1e4
        return bool((polyhedron.implicit_of(inside) >= -rounding).all() and (off <= rounding).all())

    for piece in pieces:
        rows = [names.index(name) for name in piece]
        if not finite[rows + held].all():
            yield Immobility(Mobility.UNDECIDED, {})
            continue
        local = _Local(units[rows], units[held], hessians[rows + held], tolerances.rank)
        sizes, changes = np.maximum(1, abs(hessians[rows + held])), jumps[rows + held]
        smooth = bool((np.isfinite(sizes + changes) & (changes <= JUMP * sizes)).all())
        mobility, forces, motion = local.answer(slides, smooth=smooth)
        forces = forces / lengths[rows + held, 0] if len(forces) else forces
        total = forces[: len(rows)].sum() or 1.0
        stress = dict(zip([*piece, *names[count:]], (forces / total).tolist(), strict=False))
        yield Immobility(mobility, stress, None if motion is None else motion * scales)


def _jumps(polyhedron: Polyhedron, q: Array, beside: Array) -> Array:
    """Return by how much second derivatives differ among points nearby."""
    rng = np.random.default_rng(0)
    hessians = polyhedron.bundle.evaluate(q + beside * rng.uniform(-1, 1, (16, len(q))), 2)[2]
    with np.errstate(invalid="ignore"):  # of infinite ones
        return np.asarray(np.ptp(hessians, axis=0))


@dataclass(frozen=True)
class _Local:
    """Unit gradients of active functions and equations, and their scaled second derivatives.

    Slopes and singular values up to ``rank`` count as zero.
    """

    functions: Array
    equations: Array
    bends: Array
    rank: float

    def answer(
        self, slides: Callable[[Array], bool], *, smooth: bool
    ) -> tuple[Mobility, Array, Array | None]:
        """Return the verdict, to first order only if second derivatives jump, stress and motion.

        ``slides`` says whether no function falls along a line.
        """
        nothing = np.empty(0)
        tight, inner = self._tight()
        if not tight and inner.any():
            return Mobility.MOBILE, nothing, inner
        span = null_space(np.vstack([self.functions[tight], self.equations]), self.rank)
        if not span.shape[1]:
            return Mobility.FIRST_ORDER, nothing, None
        if not smooth:
            return Mobility.UNDECIDED, nothing, None
        weights, largest = self._stress(span)
        if largest < -self.rank:
            return Mobility.SECOND_ORDER, weights, None
        for v in self._candidates(span, inner, weights):
            if self._moves(v) or slides(v):
                return Mobility.MOBILE, nothing, v
        return Mobility.UNDECIDED, nothing, None

    def _tight(self) -> tuple[list[int], Array]:
        """Return the functions that vanish on the whole cone, and a vector inside the others."""
        n = self.equations.shape[1]
        inner = np.zeros(n)
        tight = []
        limits = np.zeros(len(self.functions))
        for i, row in enumerate(self.functions):
            found = linear_programme(
                -row, -self.functions, limits, bound=1.0, equations=self.equations
            )
            if row @ found > self.rank:
                inner = inner + found
            else:
                tight.append(i)
        if not len(self.functions):
            free = null_space(self.equations, self.rank)
            inner = free[:, 0] if free.shape[1] else inner
        return tight, inner

    def _stress(self, span: Array) -> tuple[Array, float]:
        """Return the stress whose form is most negative on a subspace, and its largest value.

        Without any stress the value is infinite.
        """
        import cvxpy as cp

        k, count = len(self.functions), len(self.bends)
        rows = np.vstack([self.functions, self.equations])
        # All stresses: the relations of the gradients.
        relations = Rows(rows, self.rank).relations if k else np.empty((0, 0))
        if not relations.shape[1]:
            return np.zeros(count), np.inf
        forms = np.array([span.T @ bend @ span for bend in self.bends])
        forms = np.tensordot(relations.T, forms, axes=1)
        with ONE_AT_A_TIME:
            x, top = cp.Variable(relations.shape[1]), cp.Variable()
            total = sum(x[j] * (form + form.T) / 2 for j, form in enumerate(forms))
            weights = relations @ x
            limits = [weights[:k] >= 0, cp.sum(weights[:k]) <= 1, cp.abs(x) <= 1]
            limits.append(top * np.eye(span.shape[1]) - total >> 0)
            problem = cp.Problem(cp.Minimize(top), limits)
            if not solve(problem):
                msg = "Clarabel found no solution of a small semidefinite programme"
                raise SolverError(msg)
        return np.asarray(weights.value), float(top.value)

    def _candidates(self, span: Array, inner: Array, weights: Array) -> Iterator[Array]:
        """Yield velocities of the cone that a motion may have."""
        if inner.any():
            yield inner / np.linalg.norm(inner)
        form = np.tensordot(weights, self.bends, axes=1)
        _, axes = np.linalg.eigh(span.T @ form @ span)
        for axis in axes.T[::-1]:
            for side in (1, -1):
                v = side * span @ axis
                if (self.functions @ v >= -self.rank).all():
                    yield v

    def _moves(self, v: Array) -> bool:
        """Whether a velocity and an acceleration have all tight functions grow."""
        slopes = self.functions @ v
        tight = [i for i, slope in enumerate(slopes) if slope <= self.rank]
        k, n = len(self.functions), len(v)
        bent = np.array([v @ bend @ v for bend in self.bends])
        # Accelerations up to a thousand times the largest curvature are tried.
        reach = 1e3 * max(1.0, float(np.abs(bent).max(initial=0.0)))
        equations = self.equations
        start = np.zeros(n)
        if len(equations):
            start = np.linalg.lstsq(equations, -bent[k:], rcond=None)[0]
            if not Rows(equations, self.rank).independent:
                return False
        rest = bent[:k] + self.functions @ start
        found = linear_programme(
            np.array([0.0] * n + [-1.0]),
            np.hstack([-self.functions[tight], np.ones((len(tight), 1))]),
            rest[tight],
            bound=reach,
            equations=np.hstack([equations, np.zeros((len(equations), 1))]),
        )
        return bool(found[n] > self.rank)

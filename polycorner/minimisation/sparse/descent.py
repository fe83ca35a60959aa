"""Descent in large sparse polyhedra by sequential quadratic programming with feasible iterates.

At a feasible point each step minimises a convex model of the energy over the linearised polyhedron
within a box ([NW] ch. 18):

- the model's curvature is that of the Lagrangian, every summand of which reads few coordinates and
  is replaced by the nearest one without negative curvature;
- the trial point is projected onto the set, and accepted if the energy falls by a tenth of a
  per mille of what the model promises; otherwise the box shrinks.

The functions with positive multipliers are a guess at the face of the minimum.  Newton's method on
it, with the exact curvature, ends the descent: if it stays near, in the set, and no higher, with no
negative multiplier.  Where the inertia of the KKT matrix shows negative curvature along the face,
a Lanczos method finds a direction of it, and the descent goes on from a lower point there.

Feasible points near a given one are found by projections, and by steps that lower the violation.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array, eye_array

from polycorner.formulas.rows import Indices
from polycorner.minimisation.sparse.faces import on_face
from polycorner.minimisation.sparse.factorisation import Saddle
from polycorner.minimisation.sparse.nonlinear import Nonlinear, Point
from polycorner.minimisation.sparse.optimality import (
    basic_multipliers,
    first_order,
    second_order,
)
from polycorner.minimisation.sparse.programmes import Linearised, elastic_step, quadratic_step
from polycorner.minimisation.verdicts import Verdict
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH, Tolerances

THICK = 0.5  # depth, in scale units, of a wall that no step crosses
SAMPLES = 64  # of a step, at most
FACTORS = (1.0, 0.5, 0.25, 0.125)  # parts of a step that are tried before the box shrinks
CLOSE = 0.5  # step from which on Newton's method on the face is tried
CORRECTIONS = 20  # of the face on which Newton's method is tried
IDLE = 5  # steps without any promise after which a descent has stalled
AROUND = 100.0  # box of a step on a flat face, in units of the violation
FARTHEST = 10.0  # violation, in scale units, beyond which a projection is given up
NONE = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Restored:
    """A feasible point, or the last point of a search whose violation is not zero.

    ``stationary`` says that no step lowers the violation there to first order.
    """

    at: Point
    feasible: bool
    stationary: bool = False


def violation(problem: Nonlinear, at: Point) -> Array:
    """Return the distances ``(M,)`` by which constraints are missed."""
    missed = abs(at.distances)
    m = problem.inequalities
    missed[:m] = np.maximum(-at.distances[:m], 0.0)
    return missed


def worst(problem: Nonlinear, at: Point) -> float:
    """Return the largest violation; infinite where anything is not finite."""
    return float(violation(problem, at).max(initial=0.0)) if at.is_finite else np.inf


def near(problem: Nonlinear, at: Point, reach: float) -> Indices:
    """Return the inequalities that a step in a box of the size ``reach`` can close."""
    m = problem.inequalities
    sums = abs(at.rows[:m]).sum(axis=1)
    return np.flatnonzero(at.distances[:m] <= 1.2 * reach * sums + problem.tolerances.zero)


def linearised(problem: Nonlinear, at: Point, kept: Indices, size: float) -> Linearised:
    """Return the programme of some inequalities at a point, with the energy in units of ``size``.

    What is missed by rounding counts as zero.
    """
    values = np.where(abs(at.distances) < problem.tolerances.zero, 0.0, at.distances)
    own, rows = problem.equations, at.rows
    return Linearised(
        values[kept],
        csr_array(rows[kept]),
        values[own],
        csr_array(rows[own]),
        at.gradient / size,
    )


def projected(
    problem: Nonlinear, at: Point, limit: int, held: Indices = NONE, *, onto: bool = False
) -> Point | None:
    """Return the point after Gauss-Newton steps onto the held functions and those that are missed.

    The steps end in the set, up to what counts as zero, as the solver of the programmes is no more
    accurate; with ``onto``, also where all held functions vanish.  None if they do not.
    """
    face, miss = held if onto else NONE, problem.tolerances.zero
    missed = np.zeros(len(at.distances), dtype=np.bool_)
    missed[problem.equations] = missed[held] = True
    for _ in range(limit):
        if worst(problem, at) <= miss and abs(at.distances[face]).max(initial=0.0) <= miss:
            return at
        # Never dropped again: a function that was missed once stays on the way onto the others.
        missed |= violation(problem, at) > miss
        chosen, n = np.flatnonzero(missed), len(at.place)
        right = np.concatenate([np.zeros(n), -at.distances[chosen]])
        try:
            system = Saddle(eye_array(n), csr_array(at.rows[chosen]))
            change = system.solve(right, np.zeros(len(right)))
        except ValueError:
            return None
        if not np.isfinite(change).all():
            return None
        at = problem.at(at.place + change[:n])
        if not worst(problem, at) < FARTHEST:
            return None
    return at if worst(problem, at) <= miss else None


def restored(problem: Nonlinear, at: Point, limit: int) -> Restored:
    """Lower the sum of violations by elastic programmes in a trust region until it vanishes."""
    reach, miss = SEARCH.first_restoring, problem.tolerances.zero
    total = float(violation(problem, at).sum())
    for _ in range(limit):
        # Near the set Newton's steps arrive at once; elastic programmes would creep.
        if worst(problem, at) < 1e-3:
            ended = projected(problem, at, 10)
            if ended is not None:
                return Restored(ended, feasible=True)
        kept = np.flatnonzero(at.distances[: problem.inequalities] <= 2.4 * reach + miss)
        kept = np.union1d(kept, near(problem, at, reach))
        model = linearised(problem, at, kept, 1.0)
        step = elastic_step(model, reach)
        if step is None:
            return Restored(at, feasible=False)
        left = np.maximum(-(model.values + model.rows @ step), 0.0).sum()
        left += abs(model.sections + model.section_rows @ step).sum()
        # No model step lowers the violation to first order: evidence that nothing is feasible
        # nearby.
        if total - left <= 100 * problem.tolerances.stationary * total:
            return Restored(at, feasible=False, stationary=True)
        trial = problem.at(at.place + step)
        after = float(violation(problem, trial).sum()) if trial.is_finite else np.inf
        size = float(abs(step).max())
        if after <= total - 0.1 * (total - left):
            at, total = trial, after
            reach = 2 * reach if size > 0.9 * reach else reach
        else:
            reach = 0.25 * min(reach, size)
        if reach < SEARCH.least_box:
            break
    return Restored(at, feasible=worst(problem, at) <= miss)


def inside(problem: Nonlinear, at: Point, held: Indices) -> Point:
    """Return the nearest point of the set where held functions vanish, if a few steps lead there.

    For a face that is flat, of which the point has been chosen by chance.
    """
    others = np.setdiff1d(np.arange(problem.inequalities), held)
    for _ in range(5):
        short = worst(problem, at)
        if short <= problem.tolerances.feasible:
            break
        reach = AROUND * short
        kept = others[at.distances[others] <= 10 * reach]
        model = Linearised(
            at.distances[kept],
            csr_array(at.rows[kept]),
            at.distances[held],
            csr_array(at.rows[held]),
            np.zeros(len(at.place)),
        )
        step = quadratic_step(model, csr_array(eye_array(len(at.place))), reach)
        if step is None:
            break
        at = problem.at(at.place + step.displacement)
    return at


@dataclass(frozen=True)
class DescentEnd:
    """The end of a descent: a point in scaled coordinates, the number of steps, and a failure."""

    point: Array
    iterations: int
    failure: Verdict | None


def descend(problem: Nonlinear, start: Array, limit: int) -> DescentEnd:
    """Descend from ``start``, never through a wall, until a face carries a minimum.

    From a start that is not feasible the violation is lowered first.  The limit is that of the
    number of quadratic programmes.
    """
    at = problem.at(start)
    found = projected(problem, at, 30) if at.is_finite else None
    if found is None:
        search = restored(problem, at, limit)
        if not search.feasible:
            failure = Verdict.INFEASIBLE if search.stationary else Verdict.NOT_CONVERGED
            return DescentEnd(search.at.place, 0, failure)
        found = search.at
    return _Descent(problem, found).run(limit)


class _Descent:
    """The state of a descent: a feasible point, the box of the next step, the last multipliers."""

    def __init__(self, problem: Nonlinear, at: Point) -> None:
        self.problem, self.at, self.origin, self.reach = problem, at, at.place, SEARCH.first_box
        self.multipliers = np.zeros(len(at.distances))
        self.tried: tuple[Indices, float] | None = None
        self.idle = 0

    def run(self, limit: int) -> DescentEnd:
        """Take steps until the descent ends."""
        for count in range(1, limit + 1):
            ended = self.advanced()
            if ended is not None:
                return DescentEnd(ended[0], count, ended[1])
            if abs(self.at.place - self.origin).max() > self.problem.tolerances.unbounded:
                return DescentEnd(self.at.place, count, Verdict.UNBOUNDED)
        return DescentEnd(self.at.place, limit, Verdict.NOT_CONVERGED)

    def advanced(self) -> tuple[Array, Verdict | None] | None:
        """Take one step; return the end of the descent, if this is it, with its failure."""
        problem, at = self.problem, self.at
        # With multipliers of the step before: those of this one are not known yet.
        curved = problem.hessian(at, self.multipliers, convex=True)
        size = max(float(abs(at.gradient).max()), float(abs(curved).max())) or 1.0
        kept = near(problem, at, self.reach)
        model = linearised(problem, at, kept, size)
        step = quadratic_step(model, csr_array(curved / size), self.reach)
        if step is None:
            return self.shrunk(self.reach)
        d, lam = step.displacement, step.multipliers
        gaps = model.values + model.rows @ d
        # Functions out of reach have none, whatever they had before.
        self.multipliers[:] = 0.0
        self.multipliers[kept] = lam * size
        # Complementarity: of a multiplier and a gap the smaller one is the one that is zero.
        held = kept[lam > gaps]
        moved = float(abs(d).max())
        promised = -float(model.gradient @ d + d @ (curved @ d) / (2 * size)) * size
        if self.is_worth_trying(held, moved):
            ended = self.on_face_of(held) or self.on_face_of(self.basic(held), basic=True)
            if ended is not None:
                return ended
        # Near the end promises are smaller than rounding of the energy, and may not be held against
        # it.
        noise = 1e-15 * (abs(at.energy) + size)
        self.idle = self.idle + 1 if promised <= noise else 0
        if self.idle > IDLE:
            return at.place, Verdict.NOT_CONVERGED
        for factor in FACTORS:
            trial = self.trial(factor * d, held)
            if (
                trial is not None
                and trial.energy <= at.energy - SEARCH.promised * factor * promised + noise
            ):
                self.at = trial
                whole = factor == 1.0 and moved > 0.9 * self.reach
                next_box = max(SEARCH.wider * factor * moved, SEARCH.finest_box)
                self.reach = 2 * self.reach if whole else next_box
                return None
        return self.shrunk(FACTORS[-1] * moved)

    def shrunk(self, reach: float) -> tuple[Array, Verdict | None] | None:
        """Make the box smaller; return the end where it has become too small."""
        self.reach = 0.5 * min(self.reach, reach)
        return (self.at.place, Verdict.NOT_CONVERGED) if self.reach < SEARCH.least_descent else None

    def is_worth_trying(self, held: Indices, moved: float) -> bool:
        """Whether Newton's method on a face may succeed: it is new, or much nearer than before."""
        if moved > CLOSE and self.tried is None:
            self.tried = held, np.inf
            return False
        same = self.tried is not None and np.array_equal(self.tried[0], held)
        before = self.tried[1] if self.tried is not None else np.inf
        worth = moved < 1e-3 or same
        if worth and same and moved > 0.1 * before:
            return False
        self.tried = held, moved if worth else np.inf
        return worth

    def trial(self, d: Array, held: Indices) -> Point | None:
        """Return the projected end of a step; None if there is none or a wall is in between."""
        problem, u = self.problem, self.at.place
        end = problem.at(u + d)
        if not end.is_finite:
            return None
        # With the face if possible: otherwise each step would leave a curved wall and come back.
        found = projected(problem, end, 8, held) or projected(problem, end, 8)
        if found is None:
            return None
        way = found.place - u
        samples = min(SAMPLES, int(np.ceil(abs(way).max() / THICK)))
        m = problem.inequalities
        for k in range(1, samples):
            # Values alone, sizes of gradients as at the start: this is asked at many points.
            depth = -problem.values(u + k / samples * way)[:m] / self.at.sizes[:m]
            if not depth.max(initial=0.0) <= THICK:
                return None
        return found

    def on_face_of(
        self, held: Indices, *, basic: bool = False
    ) -> tuple[Array, Verdict | None] | None:
        """Return the minimum on a face that is corrected on the way; None if there is none here.

        Functions that are violated join it, those with negative multipliers leave it.  On the face
        of basic functions, where others vanish with multipliers that may be zero, the nearest point
        of the set is taken instead.  From a saddle the descent goes on.
        """
        problem, tolerances = self.problem, self.problem.tolerances
        for _ in range(CORRECTIONS):
            everything = np.concatenate([held, problem.equations])
            near = self.multipliers[everything]
            found = on_face(problem, everything, self.at.place, near=near)
            if found is None or not found.last_step < tolerances.settled:
                return None
            at = problem.at(found.point)
            at = inside(problem, at, everything) if basic else at
            missed = at.distances[: problem.inequalities] < -tolerances.feasible
            violated = np.flatnonzero(missed)
            if len(violated):
                held = np.union1d(held, violated)
                continue
            lam = signed_multipliers(at, everything, len(held), found.multipliers, tolerances)
            small = tolerances.multiplier * float(abs(at.gradient).max())
            negative = lam[: len(held)] < -small
            if not negative.any():
                return self.judged(at, everything, lam)
            held = held[~negative]
        return None

    def basic(self, held: Indices) -> Indices:
        """Return functions with independent gradients that balance the energy without the others.

        Those with positive multipliers at a corner of all multipliers.
        """
        at, k = self.at, len(held)
        rows = csr_array(at.rows[np.concatenate([held, self.problem.equations])])
        found = basic_multipliers(rows, k, at.gradient)
        least = self.problem.tolerances.multiplier
        return held if found is None else held[found[:k] > least * abs(found).max(initial=0.0)]

    def judged(
        self, at: Point, held: Indices, multipliers: Array
    ) -> tuple[Array, Verdict | None] | None:
        """Return a stationary point that is no higher, unless the descent can leave a saddle."""
        problem = self.problem
        missed = violation(problem, self.at)[held] @ abs(multipliers)
        noise = 1e-12 * (abs(self.at.energy) + float(abs(at.gradient).max())) + missed
        tolerances = problem.tolerances
        if worst(problem, at) > tolerances.feasible or not at.energy <= self.at.energy + noise:
            return None
        lam = np.zeros(len(at.distances))
        lam[held] = multipliers
        closed = np.flatnonzero(at.distances[: problem.inequalities] <= tolerances.zero)
        held = np.union1d(held, closed)  # weakly active ones, too
        rows, hessian = csr_array(at.rows[held]), problem.hessian(at, lam)
        size = max(float(abs(at.gradient).max()), float(abs(hessian).max())) or 1.0
        if second_order(hessian, rows, tolerances.flat * size) is Verdict.SADDLE:
            lower = self.beyond(at, held, downward(hessian, rows))
            if lower is not None:
                self.at, self.reach, self.tried = lower, SEARCH.first_box, None
                self.multipliers = lam
                return None
        return at.place, None

    def beyond(self, at: Point, held: Indices, way: Array | None) -> Point | None:
        """Return a lower point of a face in a direction of negative curvature, or against it."""
        if way is None:
            return None
        way = way / abs(way).max()
        noise = 1e-14 * (abs(at.energy) + float(abs(at.gradient).max()))
        for push in SEARCH.pushes:
            # A direction of negative curvature has no sign; the wall may be on either side.
            for sign in (1.0, -1.0):
                ahead = self.problem.at(at.place + sign * push * way)
                found = projected(self.problem, ahead, 10, held, onto=True)
                if found is not None and found.energy < at.energy - noise:
                    return found
        return None


def signed_multipliers(
    at: Point, held: Indices, inequalities: int, lam: Array, tolerances: Tolerances
) -> Array:
    """Return multipliers none of which is negative, if gradients are dependent and there are such.

    Where gradients are independent, there are no others than those given.
    """
    if not lam[:inequalities].min(initial=0.0) < 0:
        return lam
    small = tolerances.multiplier * float(abs(at.gradient).max())
    found, _ = first_order(csr_array(at.rows[held]), inequalities, at.gradient, small, tolerances)
    return lam if found.unique or not found.exist else found.values


def downward(hessian: csr_array, rows: csr_array) -> Array | None:
    """Return a direction of the least curvature along ``{A d = 0}``, by Lanczos' method."""
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

    n, k = hessian.shape[0], rows.shape[0]
    saddle = Saddle(eye_array(n), rows)

    def tangential(v: Array) -> Array:
        right = np.concatenate([np.ravel(v), np.zeros(k)])
        return saddle.solve(right, np.zeros(n + k))[:n]

    operator: Any = LinearOperator(
        (n, n), matvec=lambda v: tangential(hessian @ tangential(v)), dtype=np.float64
    )
    # The same start every time, and not orthogonal to what is sought.
    start = tangential(np.random.default_rng(0).standard_normal(n))
    try:
        # Any direction of clearly negative curvature does: no eigenvector is needed.
        _, vectors = eigsh(operator, k=1, which="SA", v0=start, tol=1e-3)
    except ArpackError:
        return None
    return tangential(vectors[:, 0])

"""The step of :mod:`step_inclusion` as a convex programme, to be read.

With the loads given, the velocity after the step is the only minimiser of

.. code-block:: text

    |v - v_free|_M^2 / 2 + sum_b L_b h_b(-B_b v - d_b)      subject to      J v >= bounds

with ``h_b`` the support function of the friction set ``C_b``.  The impulses are its multipliers:
``p`` is in ``L C`` and maximises ``-s.p`` there exactly if it is a subgradient of ``L h`` at ``-s``
([Moreau]; [Rockafellar] sec. 23).  Where friction grows with the impulse of a unilateral contact
the loads are a fixed point: solve, press with the impulses found, solve again ([AB]).

A step takes tens of milliseconds.  It is the yardstick of the compiled step, not a part of it.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from step_inclusion import (
    FrictionBlock,
    StepProblem,
    assemble,
    bent_shut,
    slips_at_end,
    stopped,
    turned_back,
)
from step_residual import NO_LOAD, compliance, natural_residual, nearest, speed

from polycorner.errors import SolverError
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.friction import CutDisc, Disc, Ellipse, Interval
from polycorner.motion.mechanics import State
from polycorner.motion.system import System
from polycorner.spaces.manifold import Array

SETTLED = 1e-11  # residual, relative to the step's speed, at which a step is solved
ROUNDS = 200  # at most so many programmes for the loads
# Clarabel's options, as exact as it may be, then as robust.
FINE = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-12)
ATTEMPTS: tuple[dict[str, float], ...] = (FINE, {}, {"equilibrate_enable": False})
HOLDING = 1e6  # friction that can hold so many times the step's impulse holds all
NEWTON, NUDGES = 20, (1e-6, 1e-8, 1e-10)  # steps, and reach of the differences for their slopes
PARTS = (1.0, 0.5, 0.25, 0.1, 0.01)  # of a Newton step
RATES = (1.0, 1e2, 1e4, 1e6, 1e-2)
STICKING = 1e-9  # slip below this part of the step's speed is none


@dataclass(frozen=True, eq=False)
class StepSolution:
    """Velocity and impulses of a step.

    Attributes
    ----------
    velocity : (n,) array
        ``v+``.
    normal : (m,) array
        Impulses ``lam >= 0`` of the unilateral contacts.
    friction : tuple of (d,) array
        Impulses ``p_b`` of the friction blocks.
    residual : float
        Their :func:`~step_residual.natural_residual`.
    rounds : int
        How many convex programmes were solved.
    """

    velocity: Array
    normal: Array
    friction: tuple[Array, ...]
    residual: float
    rounds: int


def reference_step(system: System, state: State, dt: float) -> State:
    """Return the state after a step of length ``dt``; see :func:`solve_step`.

    A friction contact sticks where its slip is zero up to ``STICKING``.  The velocity is as exact
    as the solver, so that rest is not rest bit for bit.

    Raises
    ------
    SolverError
        As :func:`solve_step`.

    Examples
    --------
    A block pulled along a table by 5 N per kg: ``0.3 g`` of that is friction.

    >>> from polycorner import Manifold, Polyhedron
    >>> from polycorner.motion.friction import Interval
    >>> from polycorner.motion.contacts import Friction, velocities
    >>> from polycorner.motion.system import System
    >>> M = Manifold.euclidean("x")
    >>> (x,), (vx,) = M.symbols, velocities(M)
    >>> table = Friction("table", (vx,), Interval(0.3), 9.81)
    >>> block = System(Polyhedron(M, {"wall": 5 - x}), vx**2 / 2, -5 * x, friction=(table,))
    >>> round(float(reference_step(block, block.state([0.0]), 0.1).v[0]), 12)
    0.2057
    """
    problem, v = _turned(system, assemble(system, state, dt))
    pressed = solve_step(problem).normal
    whole = STICKING * speed(problem, v)
    at_end = slips_at_end(system, problem, v, dt)
    anew = stopped(problem, v, pressed, at_end, same=whole) or problem
    anew = bent_shut(system, replace(problem, blocks=anew.blocks), v, dt) or anew
    if anew is not problem:
        problem, v = _turned(system, anew)
    slips = [np.linalg.norm(b.matrix @ v + b.drift) for b in problem.blocks]
    sizes = [1 / np.sqrt(compliance(problem, b.matrix)) for b in problem.blocks]
    sticking = np.array(
        [s * size <= whole for s, size in zip(slips, sizes, strict=True)], dtype=bool
    )
    return State(state.time + dt, problem.middle + dt / 2 * v, v, sticking)


def _turned(system: System, problem: StepProblem) -> tuple[StepProblem, Array]:
    """Return a step and its velocity, with static sets where slip reversed."""
    v = solve_step(problem).velocity
    while (turned := turned_back(system, problem, v)) is not None:
        problem = turned
        v = solve_step(problem).velocity
    return problem, v


def solve_step(problem: StepProblem, rounds: int = ROUNDS) -> StepSolution:
    """Return velocity and impulses of a step, by convex programmes.

    The velocity is unique if all loads are known.  If some are not there may be several, as
    where more contacts press than their impulses can be told apart, or none ([AB]).

    After each programme Newton's method on the natural map takes the last digits, first with the
    loads free, then, if that does not settle, under the programme's loads.  The next loads are
    averaged with the last, more and more cautiously, which breaks cycles.

    Raises
    ------
    SolverError
        If the mass matrix is singular, no velocity meets the bounds, Clarabel breaks, or the
        loads grow beyond all bounds or do not settle within ``rounds`` programmes; the message
        then has the residual.
    """
    if rounds < 1:
        msg = f"rounds: expected at least one programme; got {rounds}"
        raise ValueError(msg)
    scaled = _Scaled.of(problem)
    z, count = _settled(scaled, _Programme.state(scaled), rounds)
    v, normal, friction = scaled.unscaled(problem, z)
    residual = natural_residual(problem, v, normal, friction)
    if not residual <= SETTLED:
        msg = (
            f"the impulses of a step did not settle in {count} convex programmes: the "
            f"residual is {residual:.3g} of the step's speed"
        )
        raise SolverError(msg)
    return StepSolution(v, normal, friction, residual, count)


def support(shape: ConvexSet, s: Any) -> Any:
    """Return the support function of a friction set at a cvxpy expression.

    That of an intersection, here of disc and strip, is the infimal convolution of those of its
    parts ([Rockafellar] cor. 16.4.1).
    """
    import cvxpy as cp

    match shape:
        case Interval():
            return cp.maximum(shape.lower * s[0], shape.upper * s[0])
        case Disc():
            return shape.mu * cp.norm2(s)
        case Ellipse():
            return cp.norm2(cp.multiply(np.array([shape.mu_1, shape.mu_2]), s))
        case CutDisc():
            across = cp.Variable()
            return shape.mu * cp.norm2(s - cp.hstack([across, 0])) + shape.width * cp.abs(across)
        case _:
            return cp.max(shape.tips @ s)


@dataclass(frozen=True, eq=False)
class _Scaled:
    """The programme in units where everything is of order one.

    With ``M = R R'`` its unknown is ``x = R' (v - v_free) / V``, where ``V`` is the largest speed
    that the free velocity fails a bound or slips by.  Each row, and each block of rows, is divided
    by the square root of its compliance, impulses are multiplied by it.
    """

    root: Array
    speed: float
    sizes: Array
    rows: Array
    bounds: Array
    block_sizes: Array
    matrices: list[Array]
    slips: list[Array]
    blocks: tuple[FrictionBlock, ...]

    @classmethod
    def of(cls, problem: StepProblem) -> "_Scaled":
        sizes = np.linalg.eigvalsh(problem.mass)
        if not sizes[0] > 1e-13 * sizes[-1]:
            msg = "the mass matrix of a step is not positive definite"
            raise SolverError(msg)
        root = np.linalg.cholesky(problem.mass)
        free = problem.v_free
        sizes = np.array([1 / np.sqrt(compliance(problem, row[None])) for row in problem.normals])
        rows = sizes[:, None] * np.linalg.solve(root, problem.normals.T).T
        bounds = sizes * (problem.bounds - problem.normals @ free)
        block_sizes = np.array([1 / np.sqrt(compliance(problem, b.matrix)) for b in problem.blocks])
        pairs = list(zip(problem.blocks, block_sizes, strict=True))
        matrices = [np.asarray(size * np.linalg.solve(root, b.matrix.T).T) for b, size in pairs]
        slips = [size * (b.matrix @ free + b.drift) for b, size in pairs]
        speeds = [float(bounds.max(initial=0.0)), *(float(np.linalg.norm(s)) for s in slips)]
        unit = max(speeds) or 1.0
        slips = [s / unit for s in slips]
        return cls(
            root, unit, sizes, rows, bounds / unit, block_sizes, matrices, slips, problem.blocks
        )

    def loads(self, normal: Array) -> Array:
        """Return the scaled loads under scaled normal impulses (or the start of ``z``)."""
        normal = np.maximum(0.0, normal[: len(self.sizes)]) * self.sizes
        known = [b.load / self.speed if b.owner < 0 else normal[b.owner] for b in self.blocks]
        return np.asarray(np.array(known, dtype=float) / self.block_sizes)

    def parts(self, z: Array) -> list[Array]:
        """Return normal impulses and the impulses of each block in ``z``."""
        lengths = [len(self.bounds), *(len(s) for s in self.slips)]
        return np.split(z, np.cumsum(lengths)[:-1])

    def move(self, z: Array) -> Array:
        """Return the change ``x`` of velocity that impulses bring."""
        return np.asarray(np.vstack([self.rows, *self.matrices]).T @ z)

    def miss(self, z: Array, loads: Array | None = None, rate: float = 1.0) -> Array:
        """Return the natural map of impulses, under given loads or those they make themselves.

        It is what a step of the projected gradient method with the given rate takes away.
        """
        x = self.move(z)
        normal, *friction = self.parts(z)
        parts = [np.minimum(normal, rate * (self.rows @ x - self.bounds))]
        pressing = self.loads(z) if loads is None else loads
        given = zip(self.blocks, pressing, self.matrices, self.slips, friction, strict=True)
        for block, load, matrix, slip, p in given:
            parts.append(p - nearest(block.shape, float(load), p - rate * (matrix @ x + slip)))
        return np.concatenate(parts)

    def unscaled(self, problem: StepProblem, z: Array) -> tuple[Array, Array, tuple[Array, ...]]:
        """Return velocity, normal impulses and friction impulses in their own units."""
        v = problem.v_free + self.speed * np.linalg.solve(self.root.T, self.move(z))
        normal, *friction = self.parts(z)
        pairs = zip(friction, self.block_sizes, strict=True)
        impulses = tuple(self.speed * size * p for p, size in pairs)
        return v, self.speed * self.sizes * np.maximum(0.0, normal), impulses


@dataclass(frozen=True, eq=False)
class _Programme:
    """The scaled programme in cvxpy, its loads left open; sets have size one in it."""

    change: Any
    loads: list[Any]
    contacts: Any
    slips: list[Any]
    programme: Any
    reaches: list[float]

    @classmethod
    def state(cls, scaled: _Scaled) -> "_Programme":
        import cvxpy as cp

        x = cp.Variable(len(scaled.root))
        loads = [cp.Parameter(nonneg=True) for _ in scaled.blocks]
        contacts = scaled.rows @ x >= scaled.bounds if len(scaled.bounds) else None
        cost, slips = cp.sum_squares(x) / 2, []
        reaches = [float(abs(block.shape.tips).max()) for block in scaled.blocks]
        given = zip(scaled.blocks, loads, reaches, scaled.matrices, scaled.slips, strict=True)
        for block, load, reach, matrix, slip in given:
            against = cp.Variable(len(slip))
            slips.append(against + matrix @ x + slip == 0)
            if reach > NO_LOAD:
                cost += load * support(block.shape, against / reach)
        rules = slips if contacts is None else [contacts, *slips]
        return cls(x, loads, contacts, slips, cp.Problem(cp.Minimize(cost), rules), reaches)

    def solve(self, loads: Array) -> Array:
        """Return the multipliers under given loads: normal impulses, then those of the blocks."""
        for parameter, load, reach in zip(self.loads, loads, self.reaches, strict=True):
            parameter.value = min(load * reach, HOLDING)
        status = next(filter(None, (self._attempt(**options) for options in ATTEMPTS)), "")
        if status == "infeasible":
            msg = "a step's bounds are met by no velocity"
            raise SolverError(msg)
        if self.change.value is None:
            msg = f"Clarabel broke on a step: {status or 'numerical failure'}"
            raise SolverError(msg)
        pushes = [] if self.contacts is None else [self.contacts.dual_value]
        pushes += [-s.dual_value for s in self.slips]
        return np.concatenate([np.zeros(0), *(np.atleast_1d(p) for p in pushes)])

    def _attempt(self, **options: float) -> str:
        """Return the status of the programme, or nothing if Clarabel fails on it."""
        import cvxpy as cp

        with warnings.catch_warnings():
            # An inaccurate solution is a start for Newton's method: its end is what is judged.
            warnings.simplefilter("ignore", UserWarning)
            try:
                self.programme.solve(solver=cp.CLARABEL, **options)
            except cp.error.SolverError:
                return ""
        return str(self.programme.status)


def _settled(scaled: _Scaled, programme: _Programme, rounds: int) -> tuple[Array, int]:
    """Return scaled impulses, settled or the last, and the number of programmes solved."""
    loads = scaled.loads(np.zeros(len(scaled.bounds)))
    for count in range(1, rounds + 1):
        start = programme.solve(loads)
        z = _polished(scaled.miss, start)
        if not _is_zero(scaled.miss(z)):
            z = _polished(partial(scaled.miss, loads=loads), start)
        new = scaled.loads(z)
        if _is_zero(scaled.miss(z)) or (new == loads).all() or loads.max() > HOLDING:
            break
        loads = loads + (new - loads) / (2 + count / 10)
    return z, count


def _polished(natural_map: Callable[..., Array], z: Array) -> Array:
    """Return ``z`` after Newton's method on the natural maps of several rates.

    They have the same zeros, but the rate decides what counts as pressing and what as open while
    neither impulse nor gap is zero: with redundant contacts a wrong choice would be for good.
    """
    for rate in RATES:
        end = _newton(partial(natural_map, rate=rate), z)
        if _is_zero(natural_map(end)):
            return _newton(natural_map, end)
    return _newton(natural_map, z)


def _newton(natural_map: Callable[..., Array], z: Array) -> Array:
    """Return ``z`` after Newton steps towards a zero of the map, each as far as it helps.

    Slopes are central differences; where they reach across a kink a smaller nudge may not.
    """
    miss = natural_map(z)
    for nudge in NUDGES:
        moves = nudge * np.eye(len(z))
        for _ in range(NEWTON):
            if not miss.any():
                break
            slopes = [natural_map(z + e) - natural_map(z - e) for e in moves]
            step = np.linalg.lstsq(np.array(slopes).T / (2 * nudge), -miss, rcond=1e-9)[0]
            trials = [(z + part * step, natural_map(z + part * step)) for part in PARTS]
            best = min(trials, key=lambda trial: float(np.linalg.norm(trial[1])))
            if not np.linalg.norm(best[1]) < np.linalg.norm(miss):
                break
            z, miss = best
    return z


def _is_zero(miss: Array) -> bool:
    return float(abs(miss).max(initial=0.0)) <= SETTLED

"""One step of :mod:`polycorner.motion.simulation` as an inclusion, written out in NumPy."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polycorner.motion.formulation import moment
from polycorner.motion.friction import ConvexSet
from polycorner.motion.mechanics import State
from polycorner.motion.noise import OPTIONS
from polycorner.motion.system import System
from polycorner.spaces.manifold import Array

CLOSED = OPTIONS.zero_gap
STILL = 1e-9  # slip over the speeds below which it is none
PRESSED = 1e-12  # impulse up to which nothing presses
BEND = OPTIONS.bending  # scaled depth beyond which no gap may close by its curvature within a step


@dataclass(frozen=True)
class FrictionBlock:
    """Friction in one step.

    Attributes
    ----------
    matrix, drift : (d, n) and (d,) array
        The law reads ``matrix @ v + drift``, the slip but for its target.
    shape : ConvexSet
        Admissible force per unit load.
    load : float
        Impulse that presses; not used when ``owner >= 0``.
    owner : int
        Row of the unilateral contact that presses, or -1.
    target : (d,) array or 0
        ``c``: the slip is ``matrix @ v + drift + target``.
    holds : bool
        Whether it stuck before, so that it is the mean slip that is to vanish.
    bounces : bool
        Whether the contact that presses does, so that its slip does not stop.
    """

    matrix: Array
    drift: Array
    shape: ConvexSet
    load: float
    owner: int
    target: Array | float = 0.0
    holds: bool = False
    bounces: bool = False

    def slip(self, v: Array) -> Array:
        """Return the slip at a velocity."""
        return np.asarray(self.matrix @ v + self.drift + self.target)


@dataclass(frozen=True)
class StepProblem:
    """One step as an inclusion; see :mod:`polycorner.motion.simulation`.

    Attributes
    ----------
    mass : (n, n) array
    v, v_free : (n,) array
    middle : (n,) array
        ``q_M``.
    gaps, bounds, bends : (m,) array
        ``bends`` are the ``c_i``.
    normals : (m, n) array
        Gradients ``J_i`` of the gaps.
    blocks : tuple of FrictionBlock
    """

    mass: Array
    v: Array
    v_free: Array
    middle: Array
    gaps: Array
    normals: Array
    bounds: Array
    bends: Array
    blocks: tuple[FrictionBlock, ...]


def assemble(system: System, state: State, dt: float, after: Array | None = None) -> StepProblem:
    """Return what a step of length ``dt`` from ``state`` asks.

    Forces that depend on the velocity are those at its mean with the one ``after`` the step.
    """
    middle = state.q + dt / 2 * state.v
    now = moment(system.formulation, system.parameters, middle, state.v)
    mean = state.v if after is None else (state.v + after) / 2
    force = moment(system.formulation, system.parameters, middle, mean).force
    v_free = state.v + dt * np.linalg.solve(now.mass, force)
    gaps, normals = system.polyhedron.bundle.evaluate(middle, 1)
    normals = normals.reshape(gaps.size, middle.size)
    before, free = normals @ state.v, normals @ v_free
    bends = _bends(system, middle + dt * state.v, gaps, dt * before)
    bounds = _bounds(system, gaps, before, free, bends, dt)
    blocks = _blocks(system, state.sticking, now.slip_matrix, now.drift, dt * now.loads)
    start = moment(system.formulation, system.parameters, state.q, state.v)
    slips, row = start.slip_matrix @ state.v + start.drift, 0
    bouncing = _bounces(system, gaps, before, free, dt)
    chosen = []
    for block, stuck in zip(blocks, state.sticking, strict=True):
        left = np.abs(slips[row : row + len(block.matrix)]).sum()
        row += len(block.matrix)
        # What a contact presses on at the start of a run was open before; slip where it sticks is
        # stopped.
        open_before = block.owner >= 0 or (stuck and left > STILL * np.abs(state.v).sum())
        aim = block if open_before else aimed(block, state.v, stuck=bool(stuck))
        chosen.append(replace(aim, bounces=block.owner >= 0 and bool(bouncing[block.owner])))
    blocks = tuple(chosen)
    return StepProblem(now.mass, state.v, v_free, middle, gaps, normals, bounds, bends, blocks)


def _bends(system: System, ahead: Array, gaps: Array, moved: Array) -> Array:
    bends = _gaps_at(system, ahead) - gaps - moved
    along = (np.abs(bends) > CLOSED * length_scale(system)) & (np.abs(moved) <= 4 * np.abs(bends))
    return np.where(along, bends, 0.0)


def _gaps_at(system: System, q: Array) -> Array:
    values: Array = system.polyhedron.bundle.evaluate(q, 0)[0]
    return values


def _bounces(
    system: System, gaps: Array, before: Array, free: Array, dt: float
) -> NDArray[np.bool_]:
    closing = (gaps + dt * free < 0) & (before < 0)
    return np.asarray(closing & (-system.restitutions * before > np.abs(free - before)))


def _bounds(
    system: System, gaps: Array, before: Array, free: Array, bends: Array, dt: float
) -> Array:
    e, bounces = system.restitutions, _bounces(system, gaps, before, free, dt)
    reached = gaps + bends
    depth = np.where((reached < 0) & (reached > -CLOSED * length_scale(system)), 0.0, reached)
    limit = np.where(depth < 0, np.abs(free - before) + np.abs(bends) / dt, np.inf)
    half = (free - before) / 2  # forces act before and after the bounce
    return np.where(bounces, half - e * (before + half), np.minimum(-depth / dt, limit))


def aimed(block: FrictionBlock, v: Array, *, stuck: bool) -> FrictionBlock:
    """Return the friction of a contact that was closed with the law at the mean slip, if it has it.

    That is where it stuck before, with little slip, or may slide in more than one direction.
    """
    before = block.slip(v)
    size = math.hypot(*(block.matrix * v).ravel(), *(before - block.matrix @ v))
    holds = stuck and np.linalg.norm(before) <= OPTIONS.left_over * size
    if not holds and (stuck or len(before) == 1):
        return block
    return replace(block, drift=block.drift + before, target=-before, holds=holds)


def stopped(
    problem: StepProblem,
    velocity: Array,
    pressed: Array,
    at_end: Array,
    *,
    same: float,
    after: Array | None = None,
    opened: Array | None = None,
    islands: Sequence[int] | None = None,
) -> StepProblem | None:
    """Return the step in which slip that stops vanishes at its end; nothing if none does.

    Parameters
    ----------
    velocity, pressed : array
        After the step, and the impulses of gaps.
    at_end : (d_1 + d_2 + ...,) array
        All slips at the end of the step, with the velocity ``after`` it; default ``velocity``.
    same : float
        Slip that is none.
    opened : (m,) array of bool
        Gaps that were open before; default all.
    islands : sequence of int
        Of the blocks; default the same.
    """
    presses = pressed > PRESSED  # what programmes leave of nothing does not
    struck = presses & (True if opened is None else opened)
    numbers = [0] * len(problem.blocks) if islands is None else islands
    stops = []
    for block in problem.blocks:
        loaded = block.load > 0 if block.owner < 0 else presses[block.owner]
        loaded = loaded and not block.bounces
        before, moved = block.slip(problem.v), block.slip(velocity)
        sticks = np.abs(block.matrix @ velocity + block.drift).sum() <= same
        reverses = np.any(block.target) and float(before @ moved) <= 0
        stops.append((loaded and sticks, loaded and not block.holds and (sticks or reverses)))
    jumping = {number for number, (_, anew) in zip(numbers, stops, strict=True) if anew}
    jumping |= {*numbers} if struck.any() else set()
    if not jumping:
        return None
    blocks, row = [], 0
    for block, number, (sticks, anew) in zip(problem.blocks, numbers, stops, strict=True):
        slip = block.slip(velocity if after is None else after)
        target = slip - at_end[row : row + len(slip)]
        row += len(slip)
        if anew or (block.holds and sticks and number in jumping):
            drift = block.drift + block.target - target
            block = replace(block, drift=drift, target=target, holds=False)  # noqa: PLW2901
        blocks.append(block)
    return replace(problem, blocks=tuple(blocks))


def slips_at_end(system: System, problem: StepProblem, velocity: Array, dt: float) -> Array:
    """Return all slips where a system is at the end of the step."""
    place = problem.middle + dt / 2 * velocity
    now = moment(system.formulation, system.parameters, place, velocity)
    return now.slip_matrix @ velocity + now.drift


def turned_back(system: System, problem: StepProblem, velocity: Array) -> StepProblem | None:
    """Return the step with static sets where slip reversed; nothing if none did."""
    blocks, found = [], False
    for friction, block in zip(system.friction, problem.blocks, strict=True):
        before, after = block.slip(problem.v), block.slip(velocity)
        reverses = block.shape != friction.static and float(before @ after) < 0
        blocks.append(replace(block, shape=friction.static) if reverses else block)
        found = found or reverses
    return replace(problem, blocks=tuple(blocks)) if found else None


def bent_shut(
    system: System, problem: StepProblem, velocity: Array, dt: float
) -> StepProblem | None:
    """Return the step with higher bounds where gaps close by curvature; nothing if none does."""
    ahead = _gaps_at(system, problem.middle + dt * velocity)
    aim = np.minimum(0.0, problem.gaps + dt * problem.bounds + problem.bends)
    short = ahead < aim - BEND * length_scale(system)
    if not short.any():
        return None
    raised = problem.normals @ velocity + (aim - ahead) / dt
    return replace(problem, bounds=np.where(short, raised, problem.bounds))


def length_scale(system: System) -> float:
    """Return the smallest scale of the coordinates, in which closed gaps are measured."""
    return min(system.manifold.scales)


def _blocks(
    system: System, sticking: NDArray[np.bool_], matrix: Array, drift: Array, loads: Array
) -> tuple[FrictionBlock, ...]:
    blocks, row = [], 0
    for number, friction in enumerate(system.friction):
        rows = slice(row, row + len(friction.slip))
        row = rows.stop
        pressing = max(0.0, float(sum(loads[i] for i in system.load_sources[number])))
        shape = friction.static if sticking[number] else friction.moving
        owner = system.owners[number]
        blocks.append(FrictionBlock(matrix[rows], drift[rows], shape, pressing, owner))
    return tuple(blocks)

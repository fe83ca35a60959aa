"""One step of :mod:`polycorner.motion.simulation` as an inclusion, written out in NumPy."""

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
BEND = OPTIONS.bending  # scaled depth beyond which no gap may close by its curvature within a step


@dataclass(frozen=True)
class FrictionBlock:
    """Friction in one step.

    Attributes
    ----------
    matrix, drift : (d, n) and (d,) array
        The slip is ``matrix @ v + drift``.
    shape : ConvexSet
        Admissible force per unit load.
    load : float
        Impulse that presses; not used when ``owner >= 0``.
    owner : int
        Row of the unilateral contact that presses, or -1.
    """

    matrix: Array
    drift: Array
    shape: ConvexSet
    load: float
    owner: int


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
    return StepProblem(now.mass, state.v, v_free, middle, gaps, normals, bounds, bends, blocks)


def _bends(system: System, ahead: Array, gaps: Array, moved: Array) -> Array:
    bends = _gaps_at(system, ahead) - gaps - moved
    along = (np.abs(bends) > CLOSED * length_scale(system)) & (np.abs(moved) <= 4 * np.abs(bends))
    return np.where(along, bends, 0.0)


def _gaps_at(system: System, q: Array) -> Array:
    values: Array = system.polyhedron.bundle.evaluate(q, 0)[0]
    return values


def _bounds(
    system: System, gaps: Array, before: Array, free: Array, bends: Array, dt: float
) -> Array:
    e = system.restitutions
    closing = (gaps + dt * free < 0) & (before < 0)
    bounces = closing & (-e * before > np.abs(free - before))
    reached = gaps + bends
    depth = np.where((reached < 0) & (reached > -CLOSED * length_scale(system)), 0.0, reached)
    limit = np.where(depth < 0, np.abs(free - before) + np.abs(bends) / dt, np.inf)
    half = (free - before) / 2  # forces act before and after the bounce
    return np.where(bounces, half - e * (before + half), np.minimum(-depth / dt, limit))


def turned_back(system: System, problem: StepProblem, velocity: Array) -> StepProblem | None:
    """Return the step with static sets where slip reversed; nothing if none did."""
    blocks, found = [], False
    for friction, block in zip(system.friction, problem.blocks, strict=True):
        before = block.matrix @ problem.v + block.drift
        after = block.matrix @ velocity + block.drift
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

"""A dumbbell in an imperfect drum, from the definition: two balls in space, in NumPy."""

import math
from dataclasses import replace

import numpy as np
from reference_step import solve_step
from step_inclusion import FrictionBlock, StepProblem, aimed, stopped

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells.drum import GRAVITY
from polycorner.formulas.kernels import address
from polycorner.motion.friction import Disc, Interval

ENDS = (-1, 1)
NUDGES = np.array([1e-5, 1e-3, 1e-5])  # of azimuth, axial position and heading


def acceleration(drum, t):
    """Acceleration of the drum across, along and up, summed mode by mode."""
    if drum.shaking is None:
        return np.zeros(3)
    axes = np.reshape(drum.shaking.numbers, (3, -1))
    f, p = np.split(axes[:, 1:], 2, axis=1)
    return axes[:, 0] * np.cos(2 * np.pi * f * t + p).sum(axis=1)


def effective_gravity(drum, t):
    """Force on a unit of mass in the frame of the drum: gravity less the acceleration."""
    tilt = drum.tilt
    if drum.wobble is not None:
        tilt += drum.wobble.angle * math.cos(drum.spin * t + drum.wobble.phase)
    return GRAVITY * np.array([0.0, -math.sin(tilt), -math.cos(tilt)]) - acceleration(drum, t)


def wall(drum, azimuth, t):
    """By how much the wall is further out."""
    if drum.out_of_round is None:
        return 0.0
    material, phases = azimuth - drum.spin * t, drum.out_of_round.phases
    terms = drum.out_of_round.amplitudes.items()
    return sum(a * math.cos(k * material + phases.get(k, 0.0)) for k, a in terms)


def curve(drum, azimuth, t):
    """Where in the section of the drum the centre of a ball is that lies at an azimuth."""
    out = drum.centre_radius + wall(drum, azimuth, t)
    return out * np.array([math.sin(azimuth), -math.cos(azimuth)])


def ball(drum, q, e):
    """Azimuth and axial position of a ball."""
    phi, eta, theta = q[:3]
    half = drum.length / 2 * math.sin(theta) / drum.centre_radius
    return phi + e * math.asin(half), eta + e * drum.length / 2 * math.cos(theta)


def potential(drum, q, t):
    """Energy of both balls under the effective gravity."""
    total = 0.0
    for e in ENDS:
        azimuth, eta = ball(drum, q, e)
        x, z = curve(drum, azimuth, t)
        total -= drum.ball_mass * effective_gravity(drum, t) @ [x, eta, z]
    return total


def force(drum, q, t):
    """Generalised force, by central differences of the potential."""
    found = np.zeros(4)
    for i, nudge in enumerate(NUDGES):
        ahead, behind = (np.array(q[:3]) + s * nudge * np.eye(3)[i] for s in (1, -1))
        found[i] = (potential(drum, behind, t) - potential(drum, ahead, t)) / (2 * nudge)
    return found


def unevenness(drum, azimuth, eta, t):
    """Factor of the coefficients of friction at a place of the wall."""
    if drum.uneven_friction is None:
        return 1.0
    amplitude, *rest = drum.uneven_friction.numbers(2 * math.pi * drum.centre_radius)
    waves, along, start = np.reshape(rest, (-1, 3)).T
    turns = waves * (azimuth - drum.spin * t) + along * eta + start
    return max(0.0, 1 + amplitude * np.cos(turns).sum())


def normal_of_wall(drum, azimuth, t, *, exact):
    """Unit normal of the wall, outwards; or up to first order in its slope."""
    if exact:
        tangent = (curve(drum, azimuth + 1e-6, t) - curve(drum, azimuth - 1e-6, t)) / 2e-6
        return np.array([tangent[1], -tangent[0]]) / np.linalg.norm(tangent)
    slope = (wall(drum, azimuth + 1e-5, t) - wall(drum, azimuth - 1e-5, t)) / 2e-5
    out = np.array([math.sin(azimuth), -math.cos(azimuth)])
    return out - slope / drum.centre_radius * np.array([-out[1], out[0]])


def pressing(drum, q, t, *, exact=True):
    """How much each ball presses on the wall: effective gravity along the normal of the wall."""
    found = []
    for e in ENDS:
        normal = normal_of_wall(drum, ball(drum, q, e)[0], t, exact=exact)
        found.append(max(0.0, drum.ball_mass * effective_gravity(drum, t)[[0, 2]] @ normal))
    return np.array(found)


def loads(drum, q, t, *, exact=True):
    """Loads on which the friction of the balls depends."""
    factors = [unevenness(drum, *ball(drum, q, e), t) for e in ENDS]
    return pressing(drum, q, t, exact=exact) * factors


def reference_motion(drum, q, v, sticks, dt, steps):
    """Placements of a dumbbell after each of some steps, solved as convex programmes."""
    found = []
    for n in range(steps):
        problem = _problem(drum, q, v, sticks, (n + 0.5) * dt, dt)
        after = solve_step(problem).velocity
        problem, turned = _turned(drum, problem, after)
        after = solve_step(problem).velocity if turned else after
        there = _problem(drum, problem.middle, after, sticks, (n + 0.5) * dt, dt)
        at_end = np.concatenate([b.slip(after) for b in there.blocks])
        anew = stopped(problem, after, np.empty(0), at_end, same=1e-8)
        if anew is not None:
            problem, after = anew, solve_step(anew).velocity
        slips = [np.linalg.norm(b.matrix @ after + b.drift) for b in problem.blocks]
        sticks = [slip < 1e-8 for slip in slips]
        q, v = problem.middle + dt / 2 * after, after
        found.append(q)
    return np.array(found)


def _sets(drum, static):
    slide, roll = (pair[0 if static else 1] for pair in (drum.sliding, drum.rolling))
    return Disc(slide), Disc(slide), Interval(roll)


def _problem(drum, q, v, sticks, t, dt):
    middle = q + dt / 2 * v
    size = drum.length, drum.ball_radius, drum.centre_radius
    mass = drum_formulas.inertia(*size, drum.ball_mass)
    numbers = np.array([*size, drum.spin * drum.centre_radius, 0.0])
    grip = drum_formulas.grip()
    value, slope = grip.kernel.at(np.array([middle[0], middle[2], *v]), address(numbers), 1)
    both = loads(drum, middle, t, exact=False)
    rows, blocks = ([0, 1], [2, 3], [4]), []
    for i, load in enumerate((*both, both.sum())):
        matrix = slope[rows[i], 2:]
        shape = _sets(drum, sticks[i])[i]
        block = FrictionBlock(matrix, value[rows[i]] - matrix @ v, shape, dt * load, -1)
        blocks.append(aimed(block, v, stuck=bool(sticks[i])))
    none, free = np.empty(0), v + dt * force(drum, middle, t) / mass
    rest = none, np.empty((0, 4)), none, none
    return StepProblem(np.diag(mass), v, free, middle, *rest, tuple(blocks))


def _turned(drum, problem, after):
    """Return the step with static sets where slip reversed, and whether it did anywhere."""
    blocks, found = [], False
    for block, static in zip(problem.blocks, _sets(drum, static=True), strict=True):
        slips = [block.slip(x) for x in (problem.v, after)]
        reverses = block.shape != static and float(slips[0] @ slips[1]) < 0
        blocks.append(replace(block, shape=static) if reverses else block)
        found = found or reverses
    return replace(problem, blocks=tuple(blocks)), found

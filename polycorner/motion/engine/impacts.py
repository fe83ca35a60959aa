"""Laws of impact, and the energy that none of them may exceed.

An impact has two phases.  In the *compression* contacts are plastic: it ends with the velocities
``v_C`` and the impulses ``p_C``.  What follows differs:

- *Poisson's* law: in an *expansion* from ``v_C`` a contact gets back ``e p_C``, or more if it would
  close otherwise, and friction is loaded by that ([GlockerPfeiffer]);
- *Newton's* law: one phase, in which normal velocities are reversed, ``J v+ >= -e J v-``;
- *Stronge's* law, of one contact in the plane: slip is followed through the impact as Routh did,
  and the expansion ends when the normal impulse has given back ``e^2`` of the work that it took in
  the compression ([Stronge]).

The first two may gain energy, Newton's with friction, Poisson's where coefficients differ.  Then
the velocities are ``v_C + s (v+ - v_C)`` with the greatest ``s`` at which nothing is gained.
Impulses remain in their cones and gaps closed or opening, for both are convex.
"""

import numpy as np

from polycorner.motion.engine.arrays import BENT, OWN_FRICTION, OWN_LIMIT, TIE_FRICTION
from polycorner.motion.engine.bounds import contact_of
from polycorner.motion.engine.gauss_seidel import copy_impulses, recompute_velocities
from polycorner.motion.engine.jit import NONE, ONE, TWO, ZERO, compiled
from polycorner.motion.engine.rows import (
    apply_impulses,
    copy_velocity,
    row_at,
    row_times,
    rows_product,
    velocity_of,
)
from polycorner.motion.engine.sets import INTERVAL
from polycorner.motion.engine.sizes import WIDTH
from polycorner.motion.engine.vectors import load, total, zeros

PIECES = 4  # of an impact at most: slip that ends or not, in compression or expansion


@compiled
def is_unilateral(block, b):
    """Return whether a block is that of a contact."""
    return block.rows[b] == 0 and not block.bilateral[b] and block.origin[b, 0] != OWN_LIMIT


@compiled
def has_bounces(block, first, last):
    """Return whether a contact of an island bounces in this step."""
    for s in range(first, last):
        b = block.order[s]
        if is_unilateral(block, b) and block.bounces[b]:
            return True
    return False


@compiled
def forced(block, b):
    """Return by how much forces change the normal velocity of a contact in the step."""
    return block.free[b, 0] - block.before[b, 0]


@compiled
def compress(block, first, last):
    """Let contacts that bounce be plastic: their velocity vanishes in the middle of the step."""
    for s in range(first, last):
        b = block.order[s]
        if is_unilateral(block, b) and block.bounces[b] and block.bound[b] != BENT:
            block.offset[b, 0] = plastic_offset(block, b)


@compiled
def plastic_offset(block, b):
    """Return ``d`` of the bound ``J v + d >= 0`` of a contact that bounces, were it plastic."""
    return -0.5 * forced(block, b)


@compiled
def promise(model, velocity, block, first, last):
    """Let the bounds of contacts that bounce be the velocities that they have."""
    for s in range(first, last):
        b = block.order[s]
        velocity_of(model, block, b, velocity.new, block.after[b])
        if is_unilateral(block, b) and block.bounces[b]:
            block.offset[b, 0] -= block.after[b, 0]
            block.after[b, 0] = 0.0


@compiled
def returned(model, state, work, b, h, instant):
    """Return the impulse that a contact gives back after a compression.

    Where it would open more slowly than forces close it within a step, it is at rest.  Beside
    impacts forces act in a step that is no ``instant``: only contacts that bounce are known to be
    struck.
    """
    block = work.block
    p = block.impulse[b, 0]
    if not is_unilateral(block, b) or p <= 0.0:
        return 0.0
    _, _, bounce = contact_of(model, state, work.mid, work.pair, work.tie, block, b)
    struck = instant and bounce * p * block.delassus[b, 0] > abs(forced(block, b)) * (
        model.step / h
    )
    return bounce * p if block.bounces[b] or struck else 0.0


@compiled
def begin_expansion(model, state, work, first, last, h, instant):
    """Give back impulses after a compression; return whether there are any.

    The compression is kept: its impulses, and the velocities after forces alone.  Instead of these
    are those with the impulses that are given back, and of impulses there are none.
    """
    velocity, body, block = work.velocity, work.body, work.block
    found = False
    for s in range(first, last):
        b = block.order[s]
        block.returned[b] = returned(model, state, work, b, h, instant)
        found = found or block.returned[b] > 0.0
    if not found:
        return False
    copy_impulses(block, first, last, block.impulse, block.compressed)
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i >= 0 and body.awake[i]:
                copy_velocity(model, velocity.free, velocity.forced, i)
    for s in range(first, last):
        b = block.order[s]
        apply_impulses(model, velocity, block, b, block.returned[b], 0.0)
        block.impulse[b, 0] = block.impulse[b, 1] = 0.0
    for s in range(first, last):
        for side in range(2):
            i = block.bodies[block.order[s], side]
            if i >= 0 and body.awake[i]:
                copy_velocity(model, velocity.new, velocity.free, i)
    return True


@compiled
def end_expansion(model, work, first, last):
    """Add the impulses of both phases."""
    velocity, body, block = work.velocity, work.body, work.block
    for s in range(first, last):
        b = block.order[s]
        block.impulse[b, 0] += block.compressed[b, 0] + block.returned[b]
        block.impulse[b, 1] += block.compressed[b, 1]
        block.returned[b] = 0.0
        for side in range(2):
            i = block.bodies[b, side]
            if i >= 0 and body.awake[i]:
                copy_velocity(model, velocity.forced, velocity.free, i)


@compiled
def gain(model, velocity, block, first, last):
    """Return the work of contacts and friction in the step, at their mean velocities."""
    work = 0.0
    for s in range(first, last):
        b = block.order[s]
        if block.rows[b] == 0 and block.bilateral[b]:
            continue
        i, j = block.bodies[b, 0], block.bodies[b, 1]
        for r in range(max(ONE, block.rows[b])):
            p = block.impulse[b, r]
            if p != 0.0:
                after = row_times(model, block.jacobian, row_at(model, b, r), velocity.new, i, j)
                slip = block.offset[b, r] if block.rows[b] > 0 else 0.0
                work += p * (slip + 0.5 * (block.before[b, r] + after))
    return work


@compiled
def go_back(model, velocity, block, first, last, lost):
    """Take back, towards the compression, whose work is ``lost``, as much as an impact gains."""
    whole = gain(model, velocity, block, first, last)
    if not whole > max(0.0, lost):
        return
    copy_impulses(block, first, last, block.impulse, block.expanded)
    mix(model, velocity, block, first, last, 0.5)
    half = gain(model, velocity, block, first, last)
    mix(model, velocity, block, first, last, share_without_gain(lost, half, whole))


@compiled
def share_without_gain(lost, half, whole):
    """Return the greatest share of an impact, after its compression, that gains nothing.

    Given are the works of contacts and friction up to the compression, with half of what follows,
    and with all of it: too much.  What the compression gains, by gaps that open, may be gained.
    """
    # The work is lost + b s + a s^2, with a >= 0: what begins below the most crosses it once.
    a = 2.0 * (lost - 2.0 * half + whole)
    b, spare = whole - lost - a, max(0.0, lost) - lost
    root = np.sqrt(max(0.0, b * b + 4.0 * a * spare))
    s = 2.0 * spare / (b + root) if b > 0.0 else (root - b) / (2.0 * a)
    return min(s, 1.0)


@compiled
def mix(model, velocity, block, first, last, s):
    """Set impulses between those of the compression and those of the whole impact."""
    for t in range(first, last):
        b = block.order[t]
        for r in range(2):
            block.impulse[b, r] = mixed(block, b, r, s)
    recompute_velocities(model, velocity, block, first, last)


@compiled
def mixed(block, b, r, share):
    """Return an impulse between that of the compression and that of the whole impact."""
    p = block.compressed[b, r]
    return p + share * (block.expanded[b, r] - p)


@compiled
def only_contact(block, first, last):
    """Return the only contact of an impact in the plane, or -1, and its friction, or -1."""
    contact, friction = NONE, NONE
    for s in range(first, last):
        b = block.order[s]
        if block.rows[b] > 0 and block.pressing[b] < 0:
            continue
        if block.bilateral[b] or block.rows[b] > 1:
            return NONE, NONE
        if block.rows[b] == 0:
            if contact >= 0 or not (block.bounces[b] and block.impulse[b, 0] > 0.0):
                return NONE, NONE
            contact = b
        else:
            if friction >= 0:
                return NONE, NONE
            friction = b
    return contact, friction


@compiled
def set_of(model, block, b, which):
    """Return the static (0) or the dynamic (1) set of a block of friction."""
    kind, f = block.origin[b, 0], block.origin[b, 2]
    if kind == OWN_FRICTION:
        return model.friction_sets[f, which]
    if kind == TIE_FRICTION:
        return model.tie_sets[f, which]
    return model.pair_sets[f, which]


@compiled
def limits_of(model, shape):
    """Return the least and the greatest force of a set of one dimension, per unit load."""
    a, b = model.set_sizes[shape, 0], model.set_sizes[shape, 1]
    return (a, b) if model.set_kinds[shape] == INTERVAL else (-a, a)


@compiled
def coupling(model, block, b, f):
    """Return ``J M^-1 J'`` of a contact and its friction, which may have the bodies exchanged."""
    J, response, at, to = block.jacobian, block.response, row_at(model, b, 0), row_at(model, f, 0)
    sides = ONE if block.bodies[b, 1] < 0 else TWO
    if block.bodies[b, 0] == block.bodies[f, 0]:
        return rows_product(model, J, at, response, to, sides)
    value, K = zeros(), model.lanes
    for c in range(0, K, WIDTH):
        value = value + load(J, at + c) * load(response, to + K + c)
        value = value + load(J, at + K + c) * load(response, to + c)
    return total(value)


@compiled
def strike_alone(model, state, work, first, last, b, f):
    """Let one contact in the plane bounce by Stronge's law, after a compression of the island.

    What else acts in the step, forces and known loads, acts half before and half after it.
    """
    velocity, block, u = work.velocity, work.block, work.scratch.slip
    _, _, bounce = contact_of(model, state, work.mid, work.pair, work.tie, block, b)
    velocity_of(model, block, b, velocity.new, u)
    p, q, a = block.impulse[b, 0], 0.0, block.delassus[b, 0]
    normal, slip, across, c = u[0] - block.offset[b, 0], 0.0, 0.0, 0.0
    static = dynamic = ZERO
    if f >= 0:
        velocity_of(model, block, f, velocity.new, u)
        q, across, c = block.impulse[f, 0], coupling(model, block, b, f), block.delassus[f, 0]
        slip = u[0] - across * p - c * q - 0.5 * forced(block, f)
        static, dynamic = set_of(model, block, f, 0), set_of(model, block, f, 1)
    normal -= a * p + across * q + 0.5 * forced(block, b)
    new, rubbed = follow_slip(model, a, across, c, normal, slip, bounce, static, dynamic)
    apply_impulses(model, velocity, block, b, new - p, 0.0)
    block.impulse[b, 0] = new
    if f >= 0:
        apply_impulses(model, velocity, block, f, rubbed - q, 0.0)
        block.impulse[f, 0] = rubbed


@compiled
def slope(model, b, c, slip, static, dynamic):
    """Return friction per normal impulse, and the change of slip that goes with it."""
    if not c > 0.0:
        return 0.0, 0.0
    least, most = limits_of(model, dynamic)
    if slip == 0.0:
        low, high = limits_of(model, static)
        hold = -b / c
        if low <= hold <= high:
            return hold, 0.0
        k = most if hold > high else least
    else:
        k = least if slip > 0.0 else most
    return k, b + c * k


@compiled
def follow_slip(model, a, b, c, normal, slip, bounce, static, dynamic):
    """Return the impulses of one contact in the plane, and of its friction, by Stronge's law.

    ``a, b, c`` are the inverse masses of normal and slip, ``normal < 0`` and ``slip`` the
    velocities before.  As the normal impulse grows, friction has a constant ratio to it until the
    slip ends, and another one afterwards ([Routh]).
    """
    p, q, taken, left, expands = 0.0, 0.0, 0.0, 0.0, False
    for _ in range(PIECES):
        k, change = slope(model, b, c, slip, static, dynamic)
        rate = a + b * k
        grip = -slip / change if slip * change < 0.0 else np.inf
        if expands:
            # Where the work of the piece is what is left: normal l + rate l^2 / 2.
            stop = 2.0 * left / (normal + np.sqrt(normal * normal + 2.0 * rate * left))
        else:
            stop = -normal / rate if rate > 0.0 else np.inf
        length = min(stop, grip)
        p, q = p + length, q + k * length
        if expands and stop <= grip:
            break
        done = (normal + 0.5 * rate * length) * length
        taken, left = taken - done, left - done
        normal, slip = normal + rate * length, 0.0 if grip <= stop else slip + change * length
        if not expands and stop <= grip:
            normal, left, expands = 0.0, bounce * bounce * taken, True
    return p, q

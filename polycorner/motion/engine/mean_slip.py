"""The slip at which friction acts: the mean one of a step, and that at its end where slip stops.

With the rows ``G`` and the drift ``d`` of a contact at the midpoint ``q_M`` the slips before and
after the step are ``s- = G v- + d`` and ``s+ = G v+ + d``; ``L`` is the load and ``C`` the set of
its friction ``p``.  The law of a step is

    -(s+ - c) in N_{L C}(p),

with one of two targets ``c``:

(A)  ``c = -s-``, so that ``s+ - c = s- + s+`` is twice the mean slip.  A contact that sticks has
     no mean slip, and does no work, ``p . (s- + s+) / 2 = 0``; one that slides does so against
     its mean slip, and dissipates ``L`` times the support function of ``C`` there.  Rows that
     turn are those of the middle of the step: the law is symmetric in time, hence of second
     order, and where the contact sticks it is the leapfrog of non-holonomic mechanics
     ([MP]).
(B)  ``c = s+ - s(q_M + h v+ / 2, v+)``, so that the slip at the end of the step vanishes, where
     the bodies are then.  It does where a contact begins to stick, and (A) would reverse its slip,
     undamped; one step of it leaves a slip of second order, which (A) keeps with alternating sign.

A step is solved with (A), and once more, with (B) for contacts that did not stick before and that
now stick or reverse.  Something jumps in such a step, as where a contact closes: then (B) also
holds for the other contacts of the island that stick.  Contacts that close in the step have
``c = 0`` in the first solution: with (A) an impact would return their slip.  So has what slides
along one line, where the targets differ in nothing but that.  What stuck is stopped anew, by (B),
where a run starts with slip at a contact that sticks, and where the slip before a step is no longer
small beside the speeds that cancel in it, as what is left of it if a body comes slowly to rest.
All that is decided by the first solution only where it is one, to the solver's tolerance.

The law with ``c = 0`` throughout holds for large islands, whose impacts are not located, crowds
among them, whose steps are not solved; for ties, slips that depend on the time, and contacts of
sharp hulls, whose slips belong to the features that are next to each other at ``q_M``.  In parts of
no length nothing turns, and ``c = 0`` is (B).
"""

from polycorner.motion.engine.arrays import (
    AT_END,
    AT_MEAN,
    HOLDS,
    LEFT_OVER,
    OWN_FRICTION,
    STOPS,
)
from polycorner.motion.engine.bounds import STRAIGHT
from polycorner.motion.engine.evaluation import call_pair_slips, call_slips, settled
from polycorner.motion.engine.families import family_of, kind_of
from polycorner.motion.engine.jit import ONE, ZERO, compiled
from polycorner.motion.engine.rows import load_on, row_at, speed_at, sticks, terms_square


@compiled
def slip_before(block, b, r):
    """Return the slip before the step, at the midpoint."""
    return block.before[b, r] + block.offset[b, r]


@compiled
def aim(model, velocity, block, b, stuck, h):
    """Choose the slip at which friction, which ``stuck`` or not, is solved first.

    Velocities before the step must be known in its rows.
    """
    pressing = block.pressing[b]
    # What bounces opens: it has no slip at the end of the step.
    if pressing >= 0 and block.bounces[pressing]:
        return
    closed = pressing < 0 or block.law[pressing] == AT_END
    block.law[b] = HOLDS if stuck and closed else AT_MEAN
    if not closed or h <= STRAIGHT * model.step or (block.rows[b] == 1 and not stuck):
        return
    slip, size, i, j = 0.0, 0.0, block.bodies[b, 0], block.bodies[b, 1]
    for r in range(block.rows[b]):
        slip += slip_before(block, b, r) ** 2
        size += block.offset[b, r] ** 2
        size += terms_square(model, block.jacobian, row_at(model, b, r), velocity.old, i, j)
    if stuck == LEFT_OVER or (stuck and slip > model.left_over**2 * size):
        block.law[b] = AT_MEAN
        return
    # A slip that is none to the solver would only pass on its errors from step to step.
    if slip > model.tolerance**2 * size:
        for r in range(block.rows[b]):
            block.target[b, r] = -slip_before(block, b, r)


@compiled
def act_at_end(block, first, last):
    """Let friction in an island act at the slip at the end of the step, ``c = 0``."""
    for s in range(first, last):
        b = block.order[s]
        block.law[b], block.target[b, 0], block.target[b, 1] = AT_END, 0.0, 0.0


@compiled
def stop_slips(model, work, first, last, h):
    """Let the slip vanish at the end of the step where it stops; return whether a target changed.

    The blocks ``order[first:last]`` must be solved.
    """
    body, block = work.body, work.block
    jumps, found = ZERO, ZERO
    if h <= STRAIGHT * model.step:
        return found
    for s in range(first, last):
        b = block.order[s]
        if block.rows[b] == 0:
            if block.law[b] == AT_MEAN and block.impulse[b, 0] > 0.0:
                jumps = ONE
        elif block.law[b] == STOPS or (block.law[b] == AT_MEAN and stops(model, body, block, b)):
            block.law[b], jumps = STOPS, ONE
    if not jumps:
        return found
    for s in range(first, last):
        b = block.order[s]
        if block.rows[b] == 0:
            continue
        if block.law[b] == HOLDS and load_on(block, b) > 0.0 and sticks(model, body, block, b):
            block.law[b] = STOPS
        if block.law[b] == STOPS and aim_at_end(model, work, b, h):
            found = ONE
    return found


@compiled
def stops(model, body, block, b):
    """Return whether the slip of a contact stops or reverses in a step that was solved."""
    if not load_on(block, b) > 0.0:
        return False
    along, aimed = 0.0, False
    for r in range(block.rows[b]):
        along += slip_before(block, b, r) * block.after[b, r]
        aimed = aimed or block.target[b, r] != 0.0
    return (aimed and along <= 0.0) or sticks(model, body, block, b)


@compiled
def aim_at_end(model, work, b, h):
    """Set the target with which the slip at the end of the step vanishes; return if it changed."""
    block, at_end = work.block, work.scratch.slip
    for side in range(2):
        i = block.bodies[b, side]
        for c in range(model.dimension if i >= 0 else ZERO):
            work.path.q[i, c] = work.mid.q[i, c] + 0.5 * h * work.velocity.new[i, c]
    if block.origin[b, 0] == OWN_FRICTION:
        own_slip_at(model, work, block.bodies[b, 0], block.origin[b, 2], at_end)
    else:
        pair_slip_at(model, work, b, at_end)
    share = model.tolerance
    if model.follows_velocity:
        share = settled(model, work.body, block.bodies[b, 0])
    change = 0.0
    for r in range(block.rows[b]):
        change += abs(block.after[b, r] - at_end[r] - block.target[b, r])
    if not change > share * speed_at(work.body, block, b):
        return False
    for r in range(block.rows[b]):
        block.target[b, r] = block.after[b, r] - at_end[r]
    return True


@compiled
def own_slip_at(model, work, i, f, out):
    """Evaluate a slip of a body and its surroundings where it is on its way, after the step."""
    kind, values = kind_of(model, i), work.scratch.values
    first = model.slip_start[model.first_friction[i]]
    for call in range(model.first_slip_call[kind], model.first_slip_call[kind + 1]):
        n, m, w0 = model.slip_calls[call, 1], model.slip_calls[call, 2], model.slip_calls[call, 4]
        called = False
        for o in range(w0, w0 + m):
            if model.slip_contacts[o] != f - model.first_friction[i]:
                continue
            if not called:
                call_slips(model, work.scratch, i, call, work.path.q, work.velocity.new)
                called = True
            out[first + model.slip_places[o] - model.slip_start[f]] = values[n + o - w0]


@compiled
def pair_slip_at(model, work, b, out):
    """Evaluate a slip of two bodies where they are on their way, after the step."""
    block, pair = work.block, work.pair
    i, j, f = block.bodies[b, 0], block.bodies[b, 1], block.origin[b, 2]
    family, g = family_of(model, i, j), pair.contact[block.origin[b, 1], 2]
    at = call_pair_slips(
        model, work.scratch, i, j, model.first_pair_slip[family] + g, work.path.q, work.velocity.new
    )
    for r in range(block.rows[b]):
        out[r] = work.scratch.values[at + model.law_start[f] + r]


@compiled
def goes_on_sticking(model, body, block, b):
    """Return whether a friction contact sticks after the step.

    One that stuck, is not loaded, and slips as before, does: nothing has happened to it.
    """
    if sticks(model, body, block, b):
        return True
    if block.law[b] != HOLDS or load_on(block, b) > 0.0:
        return False
    change = 0.0
    for r in range(block.rows[b]):
        change += abs(block.after[b, r] - slip_before(block, b, r))
    return change <= 2.0 * model.tolerance * speed_at(body, block, b)

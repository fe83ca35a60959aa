"""Rest of a single body: its velocity, and the impulses that prove it."""

from polycorner.motion.engine.families import coordinates_of, kind_of
from polycorner.motion.engine.jit import compiled
from polycorner.motion.engine.linear_algebra import add_square, solve_spd
from polycorner.motion.engine.sets import contains
from polycorner.motion.engine.ties import is_tied

SET_SLACK = 1e-9  # relative slack with which forces at rest may lie outside their sets
SLEEP_MARGIN = 0.01  # share of friction left unused by sleepers that need no check
REST_FACTOR = 10.0  # multiple of the tolerance up to which a velocity counts as that of rest


@compiled
def load_of(model, mid, lam, i, f):
    """Return the normal impulse that presses on a friction contact of a body."""
    pressing = model.pressing_gap[f]
    if pressing < 0:
        return mid.load[f]
    return abs(lam[pressing]) if pressing >= model.first_equation[i] else lam[pressing]


@compiled
def holds(model, lam, i, g):
    """Return whether a gap of a body remains zero at rest: it is pressed, or an equation."""
    return g >= model.first_equation[i] or lam[g] > 0.0


@compiled
def compliance(model, mid, lam, i, g):
    """Return the weight of a normal impulse in the least change that restores balance.

    It is the impulse squared; for an equation at least that of the impulse that would take the
    kinetic energy of all forces.
    """
    k, square, weight = model.dimension, 0.0, 0.0
    # The square of the load makes small loads yield little: contacts that hardly press stay
    # pressed.
    if g < model.first_equation[i]:
        return lam[g] ** 2
    for c in range(k):
        for a in range(k):
            entry = mid.inverse_mass[i, c, a]
            weight += mid.gradient[g, c] * entry * mid.gradient[g, a]
            square += mid.force[i, c] * entry * mid.force[i, a]
    return max(lam[g] ** 2, square / weight if weight > 0.0 else 0.0)


@compiled
def find_rest_velocity(model, mid, limit, scratch, lam, i, out):
    """Find the velocity at which no loaded contact slips or opens; return whether there is one."""
    k, A = coordinates_of(model, i), scratch.matrix
    for c in range(k):
        out[c] = 0.0
        for a in range(k):
            A[c, a] = 0.0
    for g in range(model.first_gap[i], model.first_gap[i + 1]):
        if holds(model, lam, i, g):
            add_square(A, mid.gradient[g], 1.0, k)
            if model.timed:
                for c in range(k):
                    out[c] -= mid.gradient[g, model.dimension] * mid.gradient[g, c]
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        if load_of(model, mid, lam, i, f) > 0.0:
            for r in range(model.slip_start[f], model.slip_start[f + 1]):
                add_square(A, mid.slip_rows[r], 1.0, k)
                for c in range(k):
                    out[c] -= mid.slip_offset[r] * mid.slip_rows[r, c]
    for g in range(model.first_limit[i], model.first_limit[i + 1]):
        if limit.holds[g]:
            add_square(A, limit.row[g], 1.0, k)
    if not solve_spd(A, out, k):
        return False
    top, units = 0.0, model.units[kind_of(model, i)]
    for c in range(k):
        top = max(top, abs(out[c]) * units[c])
    for c in range(k):
        # Exact zeros, so that the velocity of rest is the same number in each step.
        if abs(out[c]) * units[c] <= 1e-13 * top:
            out[c] = 0.0
    for c in range(k, model.dimension):
        out[c] = 0.0
    return keeps_contacts(model, mid, lam, i, out) and keeps_limits(model, limit, i, out)


@compiled
def keeps_contacts(model, mid, lam, i, v):
    """Return whether no loaded contact of a body slips or opens at a velocity."""
    k = model.dimension
    for g in range(model.first_gap[i], model.first_gap[i + 1]):
        if holds(model, lam, i, g):
            value = mid.gradient[g, k] if model.timed else 0.0
            size = abs(value)
            for c in range(k):
                value += mid.gradient[g, c] * v[c]
                size += abs(mid.gradient[g, c] * v[c])
            if abs(value) > 1e-11 * size:
                return False
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        if load_of(model, mid, lam, i, f) > 0.0:
            for r in range(model.slip_start[f], model.slip_start[f + 1]):
                value = mid.slip_offset[r]
                size = abs(value)
                for c in range(k):
                    value += mid.slip_rows[r, c] * v[c]
                    size += abs(mid.slip_rows[r, c] * v[c])
                if abs(value) > 1e-11 * size:
                    return False
    return True


@compiled
def keeps_limits(model, limit, i, v):
    """Return whether a velocity leaves none of the limits that a body may be at rest on."""
    for g in range(model.first_limit[i], model.first_limit[i + 1]):
        value, size = 0.0, 0.0
        for c in range(model.dimension):
            value += limit.row[g, c] * v[c]
            size += abs(limit.row[g, c] * v[c])
        if limit.holds[g] and abs(value) > 1e-11 * size:
            return False
    return True


@compiled
def remains_at_rest(model, state, mid, sleep, scratch, i, others):
    """Return whether a body at rest provably remains so; see :func:`balances`.

    First the impulses of the last step are tried, if they leave some friction unused, then others.
    """
    # The order matters: what leaves a reserve can sleep long, and is asked first.
    return (
        balances(model, state, mid, sleep, scratch, i, others, True, -SLEEP_MARGIN)
        or balances(model, state, mid, sleep, scratch, i, others, False, SET_SLACK)
        or balances(model, state, mid, sleep, scratch, i, others, True, SET_SLACK)
    )


@compiled
def balances(model, state, mid, sleep, scratch, i, others, again, slack):
    """Return whether admissible impulses balance the forces on a body at rest, which proves rest.

    The impulses of the last step (friction under a known load only with ``again``, else zero) get
    the smallest change, weighted by the loads, that restores balance.  If the result lies in its
    sets, up to a relative slack, it proves that the body remains at rest.  It is left in
    ``sleep.proof_friction`` and ``sleep.proof_normal``.
    """
    k, A, r = coordinates_of(model, i), scratch.matrix, scratch.vector
    first_gap, last_gap = model.first_gap[i], model.first_gap[i + 1]
    first, last = model.first_friction[i], model.first_friction[i + 1]
    lam, friction = sleep.proof_normal, sleep.proof_friction
    for c in range(k):
        r[c] = -(mid.force[i, c] + mid.kick[i, c]) - others[i, c]
        for a in range(k):
            A[c, a] = 0.0
    for g in range(first_gap, last_gap):
        lam[g] = state.normal[g]
        if holds(model, lam, i, g):
            add_square(A, mid.gradient[g], compliance(model, mid, lam, i, g), k)
            for c in range(k):
                r[c] -= lam[g] * mid.gradient[g, c]
    for f in range(first, last):
        load = load_of(model, mid, state.normal, i, f)
        # From zero the least change is the impulse farthest from slipping; from that of the last
        # step it follows loads that change slowly.
        central = model.pressing_gap[f] < 0 and not again
        for a in range(2):
            friction[f, a] = 0.0 if central else state.friction[f, a]
        if load > 0.0:
            for row in range(model.slip_start[f], model.slip_start[f + 1]):
                add_square(A, mid.slip_rows[row], load * load, k)
                for c in range(k):
                    r[c] -= friction[f, row - model.slip_start[f]] * mid.slip_rows[row, c]
    # Where the contacts do not hold the body in all directions the matrix is singular, and its rest
    # is not proved by them.
    if not keeps_contacts(model, mid, state.normal, i, state.v[i]) or not solve_spd(A, r, k):
        return False
    for g in range(first_gap, last_gap):
        if holds(model, lam, i, g):
            change = 0.0
            for c in range(k):
                change += mid.gradient[g, c] * r[c]
            lam[g] += compliance(model, mid, state.normal, i, g) * change
            if lam[g] < 0.0 and g < model.first_equation[i]:
                return False
    for f in range(first, last):
        before = load_of(model, mid, state.normal, i, f)
        if before <= 0.0:
            continue
        for row in range(model.slip_start[f], model.slip_start[f + 1]):
            change = 0.0
            for c in range(k):
                change += mid.slip_rows[row, c] * r[c]
            friction[f, row - model.slip_start[f]] += before * before * change
        load = load_of(model, mid, lam, i, f)
        if not contains(
            model, model.friction_sets[f, 0], friction[f, 0], friction[f, 1], load, slack
        ):
            return False
    return True


@compiled
def comes_to_rest(model, state, work, i, rest):
    """Return whether a body is at rest after the step; then it gets exactly the velocity of rest.

    It falls asleep if it was at rest before, so that its impulses are in balance, and if they prove
    that it remains at rest.
    """
    mid, velocity, sleep, scratch = work.mid, work.velocity, work.sleep, work.scratch
    k = model.dimension
    for f in range(model.first_friction[i], model.first_friction[i + 1]):
        if load_of(model, mid, state.normal, i, f) > 0.0 and not state.sticks[f]:
            return False
    if not find_rest_velocity(model, mid, work.limit, scratch, state.normal, i, rest):
        return False
    size, far, old = work.body.island_speed[i], 0.0, 0.0
    for c in range(k):
        unit = model.units[kind_of(model, i), c]
        size = max(size, abs(rest[c]) * unit)
        far = max(far, abs(velocity.new[i, c] - rest[c]) * unit)
        old = max(old, abs(state.v[i, c] - rest[c]) * unit)
    if far > REST_FACTOR * model.tolerance * size:
        return False
    # It keeps its bits: a velocity computed anew would differ in the last ones, and work would be
    # booked for them.
    still = old <= 1e-13 * size
    for c in range(k):
        velocity.new[i, c] = state.v[i, c] if still else rest[c]
    others = sleep.neighbour_impulse
    if (
        still
        and not work.manner.located[0]
        and not is_tied(model, i)  # see `island_sleep`
        and model.first_limit[i] == model.first_limit[i + 1]  # which are no part of the proof
        and remains_at_rest(model, state, mid, sleep, scratch, i, others)
    ):
        state.asleep[i] = 1
    return True

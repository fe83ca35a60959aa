"""The compiled core of :func:`~polycorner.motion.step.step` and ``simulate``.

Everything Numba compiles for motion stands in this one file, because Numba's disk cache notices
changes of the file a function stands in and of no other.

A scene is ``N`` bodies of one kind with ``k`` coordinates each (a system without repetition is one
body), whose equations of motion, gaps and slips are kernels called by address.  Within a step the
unknowns are impulses in *blocks*: a unilateral contact is a block of one row, a friction contact
one of one or two.  Each block knows the bodies it acts on, its Jacobian and, for friction, the
block that presses on it.  A step (:func:`step_once`) is

1. drift half a step and evaluate every body; wake what can no longer rest;
2. blocks of the bodies that are awake and of the contacts between them; islands of contacts;
3. solve each island: Gauss-Seidel sweeps over the blocks, Newton's method on the natural map
   ``p = proj(p - rho u)`` ([Acary]); an island at rest is first asked whether it stays so;
4. bodies at rest within the solver's accuracy get exactly the velocity of rest; an island whose
   forces fit in their sets sleeps, and is only asked whether they still fit;
5. events, energies, and drift the other half of the step.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from polycorner.formulas.compilation import call_kernel, never_inline

# Without reference counts, which would cost more than the arithmetic: work space comes in Room.
inner = njit(
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
    error_model="numpy",
    _nrt=False,
    forceinline=False,
)

# A scene and a room are some hundred arrays: what is called for every contact is copied into its
# caller, where handing them over would cost more than the work.
small = njit(
    no_cpython_wrapper=True,
    no_cfunc_wrapper=True,
    error_model="numpy",
    _nrt=False,
    forceinline=True,
)

Field = Any  # an array or a number, as Numba finds it

# NumPy's numbers: of Python's own, Numba would compile a version of a function for each value.
NONE, ZERO, ONE, TWO = np.int64(-1), np.int64(0), np.int64(1), np.int64(2)
INTERVAL, DISC, ELLIPSE, CUT_DISC, POLYGON = 0, 1, 2, 3, 4
MADE, LOST, IMPACT = np.int64(0), np.int64(1), np.int64(2)
REST, MOTION, EXIT = np.int64(3), np.int64(4), np.int64(5)
DONE, CROWDED, EVENTFUL = 0, 1, 2  # why advance returns

CLOSED = 1e-9  # scaled depth up to which a gap counts as zero
TOUCH = 1e-7  # scaled gap up to which bodies touch
NEAR = 1e-2  # scaled gap up to which a contact is watched
FIT = 1e-9  # relative slack with which forces at rest fit in their sets
SKIN = 0.4  # of the reach, by which lists of neighbours are wider
SPARE = 0.01  # share of friction that lets a sleeper sleep unasked
LONGEST = np.int64(50)  # steps for which it does
BEND = 1e-4  # scaled depth beyond which a gap must not close by its curvature within a step
NEARLY = 10.0  # times the tolerance, up to which speeds count as those of rest
PRESS = 0.2  # of the pressure that would stop a body, on contacts at rest that need not press
AWAY = 0.1  # relative distance from the boundary of sets from which forces at rest are sought
INWARD = 1e-9  # relative distance from the boundary of sets that forces at rest keep
BALANCE = 1e-2  # of the tolerance, to which they balance
PATIENCE = 25  # steps in which they are sought
CENTRING = 2  # steps towards the centre of their sets
SOFTEST = 1e-13  # relative softness of bodies in those steps
SOFT = 1e2  # times the tolerance: softness of contacts in Newton steps, relative to the contacts
SOFTER = 1e-2  # the most at first; three times that in the next round, and so on
ROUNDS = 3  # of a cycle
SWEEPS = 10  # in a round
MOST = 20  # Newton steps in a round
IDLE = 6  # Newton steps in vain after which it ends


class Scene(NamedTuple):
    """What does not change during a simulation."""

    bodies: Field  # N
    size: Field  # k
    force_at: Field  # address: upper triangle of M, F, applied forces, loads
    slip_at: Field  # address: slips
    numbers: Field  # parameters of all kernels
    loads: Field  # number of known loads
    row: Field  # (F + 1,) first slip row of each friction contact
    shape: Field  # (F, 2) sets: static, dynamic
    owner: Field  # (F,) gap that presses, or -1
    source: Field  # (F, loads) which known loads press
    cause: Field  # (F,) under which its dissipation is booked
    kinds: Field  # (S,) kind of each set
    sizes: Field  # (S, 4) its numbers
    corner: Field  # (S + 1,) its first vertex
    vertices: Field  # (V, 2)
    gap_table: Field  # (U, 6) address, variables, outputs, reads, rows, parameters
    gap_reads: Field
    gap_rows: Field
    bounce: Field  # (m,) restitution of a body's own gaps
    pair_at: Field  # address of the gaps of a pair, or 0
    pair_number: Field  # where its parameters start
    pair_reads: Field  # (R, 2) body 0 or 1, coordinate
    pair_gaps: Field  # how many gaps a pair has
    rub_table: Field  # (pair gaps, 3) address, swapped, parameters
    rub_shape: Field  # (2,) sets
    rub_cause: Field
    pair_bounce: Field
    place: Field  # (2,) coordinates that say where a body is
    unit: Field  # (k,) length of a unit of each coordinate
    carried: Field  # speed of the substrate along the first of these
    reach: Field  # distance of centres beyond which bodies cannot touch
    exit_place: Field  # coordinate, or -1
    exit_limit: Field
    scale: Field  # unit of gaps
    chatter: Field  # amplitude of the loads' noise
    chatter_time: Field  # how long a value holds
    kicks: Field  # (k,) intensity of random impulses
    seed: Field
    tolerance: Field
    sweeps: Field
    constant: Field  # whether the mass matrix is


class Motion(NamedTuple):
    """What changes: all of it together is the state, bit for bit."""

    q: Field  # (N, k)
    v: Field
    stick: Field  # (N, F)
    grip: Field  # (N, F, 2) friction impulses
    lam: Field  # (N, m) impulses of own gaps
    touch: Field  # (N, m)
    alive: Field  # (N,)
    rests: Field
    asleep: Field
    worked: Field  # (N, F, 2) friction impulses when the work was booked last
    due: Field  # (N,) step in which a sleeper is asked again
    since: Field  # (N,) step up to which its work is booked
    pull: Field  # (N, k) impulses from other bodies
    keys: Field  # (C,) contacts between bodies, ascending
    press: Field  # (C, 3) their impulses: normal, rubbing
    shove: Field  # (C, 2k) what they do to the coordinates of both
    flags: Field  # (C, 2) sticks, touches
    counts: Field  # contacts, steps, islands not solved, sweeps, Newton steps, islands
    sums: Field  # work of substrate, of forces, of noise, deepest overlap, worst residual, causes


class Room(NamedTuple):
    """Work space of a step."""

    work: Field
    qm: Field
    force: Field
    applied: Field
    kick: Field
    inverse: Field
    slope: Field  # (N, rows, k)
    drift: Field  # (N, rows)
    load: Field  # (N, F)
    gap: Field  # (N, m)
    normal: Field  # (N, m, k)
    ahead: Field  # (N, k) where bodies are at the next half step
    gap_then: Field  # (N, m)
    normal_then: Field  # (N, m, k)
    pair_then: Field  # (pair gaps,)
    awake: Field
    asked: Field  # (N,) evaluated in this step
    speed: Field
    pace: Field  # the same, kept to the end of the step
    error: Field  # (N,) residual of each island
    shut: Field  # (N,) whether its gaps would close by their curvature
    root: Field
    free: Field  # (N, k)
    new: Field  # (N, k)
    pull: Field
    touched: Field  # (N,) sleepers whose contacts changed
    fit_grip: Field
    fit_lam: Field
    seen_rest: Field
    own: Field  # (m,) block of each gap of the body at hand
    size: Field  # (N + 1,)
    next: Field  # (N + 1,)
    pairs: Field  # (P, 2)
    listed: Field  # [number of pairs, valid]
    seen: Field  # (P,)
    where: Field  # (N, 2) when the list was made
    near: Field  # (C, 3) body, body, which gap
    near_gap: Field
    near_old: Field  # (C,) where it stood in the list of the last step, or -1
    near_press: Field  # (C, 3) impulses to start from
    near_normal: Field  # (C, 2k)
    body: Field  # (B, 2)
    rows: Field  # (B,) dimension; 0 for a unilateral contact
    press_by: Field  # (B,) block that presses, -1
    block_shape: Field
    origin: Field  # (B, 4) where the block comes from, and a mark
    weight: Field  # (B,) load; of a gap, by how much its curvature closes it
    offset: Field  # (B, 2)
    slant: Field  # (B, 2, 2k) Jacobian
    pushed: Field  # (B, 2, 2k) mass^-1 Jacobian'
    stiff: Field  # (B, 4) d00, d01, d11, rho
    p: Field  # (B, 2)
    order: Field  # (B,)
    mass: Field  # (N, k, k)
    turned: Field  # (B,) whose slip passed through zero in this step
    best: Field  # (B, 2) impulses of the least residual
    hat: Field  # (B, 2) impulses before it was asked whether an island stays at rest
    held: Field  # (B,) whether a block can bear at rest
    curve: Field  # (B, 9) derivative of the law of a block, and of the contact that presses on it
    answer: Field  # (B, 2) impulses of a Newton step before the velocities answer
    lean: Field  # (B, 2k) what is left of a normal when friction is eliminated
    lead: Field  # (B, 2) by how much friction changes with its load
    jac: Field  # (3, 2k)
    bent: Field  # (3, 2k)
    square: Field  # (k, k)
    side: Field  # (k,)
    rest: Field  # (k,)
    two: Field
    image: Field  # (12,) of a projection, and its derivative
    slots: Field  # (max(C, P),)
    members: Field  # (N,) bodies of an island
    local: Field  # (N,) their numbers in it
    ring: Field  # (N,) first side of a contact of each, as 2 block + side
    chain: Field  # (B, 2) the side after it
    step: Field  # (N k,)
    reach: Field  # (N k,) end of each of its rows
    matrix: Field  # band, row by row


# ------------------------------------------------------------------------------------ convex sets


@small
def inside(scene, shape, x, y, load, slack):
    """Return whether ``(x, y)`` lies in ``load`` times a set, up to a relative slack."""
    kind = scene.kinds[shape]
    a, b = scene.sizes[shape, 0], scene.sizes[shape, 1]
    top = load * (1.0 + slack)
    if kind == INTERVAL:
        return a * top <= x <= b * top
    if kind == DISC:
        return x * x + y * y <= (a * top) ** 2
    if kind == ELLIPSE:
        return (x / a) ** 2 + (y / b) ** 2 <= top * top
    if kind == CUT_DISC:
        return x * x + y * y <= (a * top) ** 2 and abs(x) <= b * top
    first, last = scene.corner[shape], scene.corner[shape + 1]
    for i in range(first, last):
        j = i + 1 if i + 1 < last else first
        ax, ay = scene.vertices[i, 0], scene.vertices[i, 1]
        ex, ey = scene.vertices[j, 0] - ax, scene.vertices[j, 1] - ay
        if ex * (y - ay * top) - ey * (x - ax * top) < 0.0:
            return False
    return True


@small
def project(scene, shape, x, y, load, out):
    """Project ``(x, y)`` on ``load`` times a set; out: the point, its derivative (4 numbers)."""
    kind = scene.kinds[shape]
    a, b = scene.sizes[shape, 0], scene.sizes[shape, 1]
    out[0], out[1], out[2], out[3], out[4], out[5] = x, y, 1.0, 0.0, 0.0, 1.0
    if load <= 0.0:
        for a in range(6):
            out[a] = 0.0
        return
    if inside(scene, shape, x, y, load, 0.0):
        return
    if kind == INTERVAL:
        out[0], out[1] = min(max(x, a * load), b * load), 0.0
        out[2], out[5] = 0.0, 0.0
    elif kind == DISC:
        project_disc(x, y, a * load, out)
    elif kind == ELLIPSE:
        project_ellipse(x, y, a * load, b * load, out)
    elif kind == CUT_DISC:
        width, radius = b * load, a * load
        xc = min(max(x, -width), width)
        if xc * xc + y * y <= radius * radius:
            out[0], out[1] = xc, y
            out[2] = 0.0
            return
        project_disc(x, y, radius, out)
        if abs(out[0]) > width:
            high = np.sqrt(max(0.0, radius * radius - width * width))
            out[0] = width if x > 0.0 else -width
            out[1] = high if y > 0.0 else -high
            out[2], out[3], out[4], out[5] = 0.0, 0.0, 0.0, 0.0
    else:
        project_polygon(scene, shape, x, y, load, out)


@inner
def project_disc(x, y, radius, out):
    """Project a point outside a disc."""
    far = np.sqrt(x * x + y * y)
    ux, uy, f = x / far, y / far, radius / far
    out[0], out[1] = radius * ux, radius * uy
    out[2], out[3] = f * uy * uy, -f * ux * uy
    out[4], out[5] = out[3], f * ux * ux


@inner
def project_ellipse(x, y, a, b, out):
    """Project a point outside an ellipse: Newton's method, from below, for the multiplier ``t``.

    The point is ``(a^2 x / (a^2 + t), b^2 y / (b^2 + t))`` with the root ``t > 0`` of a convex
    decreasing function, so that the iterates grow to it.
    """
    aa, bb = a * a, b * b
    t = 0.0
    for _ in range(60):
        fx, fy = a * x / (t + aa), b * y / (t + bb)
        value = fx * fx + fy * fy - 1.0
        slope = -2.0 * (fx * fx / (t + aa) + fy * fy / (t + bb))
        change = -value / slope
        t += change
        if abs(change) <= 1e-15 * (t + min(aa, bb)):
            break
    sx, sy = aa / (t + aa), bb / (t + bb)
    out[0], out[1] = sx * x, sy * y
    fx, fy = a * x / (t + aa), b * y / (t + bb)
    slope = -2.0 * (fx * fx / (t + aa) + fy * fy / (t + bb))
    tx = -2.0 * fx * a / (t + aa) / slope
    ty = -2.0 * fy * b / (t + bb) / slope
    gx, gy = -sx * x / (t + aa), -sy * y / (t + bb)
    out[2], out[3] = sx + gx * tx, gx * ty
    out[4], out[5] = gy * tx, sy + gy * ty


@inner
def project_polygon(scene, shape, x, y, load, out):
    """Project a point outside a polygon on its nearest edge or vertex."""
    best = np.inf
    first, last = scene.corner[shape], scene.corner[shape + 1]
    for i in range(first, last):
        j = i + 1 if i + 1 < last else first
        ax, ay = load * scene.vertices[i, 0], load * scene.vertices[i, 1]
        ex, ey = load * scene.vertices[j, 0] - ax, load * scene.vertices[j, 1] - ay
        along = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)
        cut = min(max(along, 0.0), 1.0)
        px, py = ax + cut * ex, ay + cut * ey
        far = (x - px) ** 2 + (y - py) ** 2
        if far < best:
            best = far
            out[0], out[1] = px, py
            out[2], out[3], out[4], out[5] = 0.0, 0.0, 0.0, 0.0
            if 0.0 < along < 1.0:
                square = ex * ex + ey * ey
                out[2], out[3] = ex * ex / square, ex * ey / square
                out[4], out[5] = out[3], ey * ey / square


# ------------------------------------------------------------------------------------------ noise


@inner
def mixed(x):
    """Return a well mixed 64-bit number: the finaliser of SplitMix64 ([Steele])."""
    x = np.uint64(x) + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@inner
def gaussian(seed, when, body, which):
    """Return a standard normal number that belongs to a seed, a time, a body and a place."""
    key = mixed(np.uint64(seed) ^ mixed(np.uint64(when) ^ mixed(np.uint64(body * 64 + which))))
    other = mixed(key)
    unit = 1.0 / 9007199254740992.0
    first = (np.float64(key >> np.uint64(11)) + 0.5) * unit
    second = (np.float64(other >> np.uint64(11)) + 0.5) * unit
    return np.sqrt(-2.0 * np.log(first)) * np.cos(2.0 * np.pi * second)


# ----------------------------------------------------------------------------------------- bodies


@inner
def invert(upper, k, mass, out):
    """Invert a symmetric positive definite matrix given by its upper triangle, row by row."""
    never_inline()
    plain = True
    at = 0
    for i in range(k):
        for j in range(i, k):
            out[i, j] = out[j, i] = upper[at]
            mass[i, j] = mass[j, i] = upper[at]
            if j > i and upper[at] != 0.0:
                plain = False
            at += 1
    if plain:
        for i in range(k):
            out[i, i] = 1.0 / out[i, i]
        return
    for j in range(k):  # Gauss-Jordan, in place: pivots of a definite matrix are positive
        pivot = out[j, j]
        out[j, j] = 1.0
        for c in range(k):
            out[j, c] /= pivot
        for i in range(k):
            if i != j:
                factor = out[i, j]
                out[i, j] = 0.0
                for c in range(k):
                    out[i, c] -= factor * out[j, c]


@inner
def read_body(scene, motion, room, i, h, time, index):
    """Evaluate forces, loads, slips and own gaps of a body at the half step."""
    k, F = scene.size, scene.shape.shape[0]
    work = room.work
    for c in range(k):
        room.qm[i, c] = motion.q[i, c] + 0.5 * h * motion.v[i, c]
        work[c] = room.qm[i, c]
        work[k + c] = motion.v[i, c]
    start, base = work.ctypes.data, scene.numbers.ctypes.data
    f0 = 2 * k
    call_kernel(scene.force_at, start, base, start + 8 * f0, start, start)
    upper = k * (k + 1) // 2
    if not (scene.constant and room.mass[i, 0, 0] > 0.0):
        invert(work[f0 : f0 + upper], k, room.mass[i], room.inverse[i])
    at = f0 + upper
    for c in range(k):
        room.force[i, c] = h * work[at + c]
        room.applied[i, c] = h * work[at + k + c]
        room.kick[i, c] = 0.0
        if scene.kicks[c] > 0.0:
            room.kick[i, c] = scene.kicks[c] * np.sqrt(h) * gaussian(scene.seed, index, i, 32 + c)
    at += 2 * k
    if scene.chatter > 0.0:
        when = np.int64(np.floor(time / scene.chatter_time))
        for j in range(scene.loads):
            factor = 1.0 + scene.chatter * gaussian(scene.seed, when, i, j)
            work[at + j] *= max(0.0, factor)
    for f in range(F):
        load = 0.0
        for j in range(scene.loads):
            if scene.source[f, j]:
                load += work[at + j]
        room.load[i, f] = max(0.0, h * load)
    if F > 0:
        S = scene.row[F]
        call_kernel(scene.slip_at, start, base, start + 8 * f0, start + 8 * (f0 + S), start)
        for r in range(S):
            value = work[f0 + r]
            size = abs(value)
            for c in range(k):
                slope = work[f0 + S + r * 2 * k + k + c]
                room.slope[i, r, c] = slope
                value -= slope * motion.v[i, c]
                size += abs(slope * motion.v[i, c])
            room.drift[i, r] = value if abs(value) > 1e-14 * size else 0.0
    own_gaps(scene, room, i, room.qm, room.gap, room.normal)


@small
def own_gaps(scene, room, i, place, gap, normal):
    """Evaluate the gaps of a body at its place and their gradients."""
    work = room.work
    start, base = work.ctypes.data, scene.numbers.ctypes.data
    for call in range(scene.gap_table.shape[0]):
        address, n, m, r0, w0, p0 = scene.gap_table[call]
        for a in range(n):
            work[a] = place[i, scene.gap_reads[r0 + a]]
        j0 = n + m
        call_kernel(address, start, base + 8 * p0, start + 8 * n, start + 8 * j0, start)
        for o in range(m):
            g = scene.gap_rows[w0 + o]
            if g >= 0:
                gap[i, g] = work[n + o]
                for c in range(scene.size):
                    normal[i, g, c] = 0.0
                for a in range(n):
                    normal[i, g, scene.gap_reads[r0 + a]] += work[j0 + o * n + a]


@small
def pair_gaps(scene, room, a, b, place):
    """Evaluate the gaps of a pair at its places, behind what they read, and their gradients."""
    work, n, m = room.work, scene.pair_reads.shape[0], scene.pair_gaps
    start, base = work.ctypes.data, scene.numbers.ctypes.data
    for r in range(n):
        body = a if scene.pair_reads[r, 0] == 0 else b
        work[r] = place[body, scene.pair_reads[r, 1]]
    call_kernel(
        scene.pair_at,
        start,
        base + 8 * scene.pair_number,
        start + 8 * n,
        start + 8 * (n + m),
        start,
    )


@inner
def solve_spd(A, b, k):
    """Solve ``A x = b`` in place by Cholesky's method; return whether ``A`` is definite."""
    never_inline()
    top = 0.0
    for c in range(k):
        top = max(top, A[c, c])
    for j in range(k):
        pivot = A[j, j]
        for a in range(j):
            pivot -= A[j, a] * A[j, a]
        if pivot <= 1e-13 * A[j, j] or pivot <= 1e-26 * top:
            return False
        pivot = np.sqrt(pivot)
        A[j, j] = pivot
        for i in range(j + 1, k):
            value = A[i, j]
            for a in range(j):
                value -= A[i, a] * A[j, a]
            A[i, j] = value / pivot
    for i in range(k):
        value = b[i]
        for a in range(i):
            value -= A[i, a] * b[a]
        b[i] = value / A[i, i]
    for i in range(k - 1, -1, -1):
        value = b[i]
        for a in range(i + 1, k):
            value -= A[a, i] * b[a]
        b[i] = value / A[i, i]
    return True


@inner
def add_square(A, row, weight, k):
    """Add ``weight row row'`` to the lower triangle of ``A``."""
    for i in range(k):
        f = weight * row[i]
        if f != 0.0:
            for j in range(i + 1):
                A[i, j] += f * row[j]


@small
def load_of(scene, room, lam, i, f):
    """Return the impulse that presses on a friction contact of a body."""
    if scene.owner[f] < 0:
        return room.load[i, f]
    return lam[i, scene.owner[f]]


@inner
def velocity_of_rest(scene, room, lam, i, out):
    """Find the velocity at which no contact of a body slips or opens; return whether it is one."""
    k, F = scene.size, scene.shape.shape[0]
    A = room.square
    for c in range(k):
        out[c] = 0.0
        for a in range(k):
            A[c, a] = 0.0
    for g in range(scene.bounce.size):
        if lam[i, g] > 0.0:
            add_square(A, room.normal[i, g], 1.0, k)
    for f in range(F):
        if load_of(scene, room, lam, i, f) > 0.0:
            for r in range(scene.row[f], scene.row[f + 1]):
                add_square(A, room.slope[i, r], 1.0, k)
                for c in range(k):
                    out[c] -= room.drift[i, r] * room.slope[i, r, c]
    if not solve_spd(A, out, k):
        return False
    top = 0.0
    for c in range(k):
        top = max(top, abs(out[c]) * scene.unit[c])
    for c in range(k):
        if abs(out[c]) * scene.unit[c] <= 1e-13 * top:
            out[c] = 0.0
    return keeps(scene, room, lam, i, out)


@inner
def keeps(scene, room, lam, i, v):
    """Return whether no loaded contact of a body slips or opens at a velocity."""
    k = scene.size
    for g in range(scene.bounce.size):
        if lam[i, g] > 0.0:
            value, size = 0.0, 0.0
            for c in range(k):
                value += room.normal[i, g, c] * v[c]
                size += abs(room.normal[i, g, c] * v[c])
            if abs(value) > 1e-11 * size:
                return False
    for f in range(scene.shape.shape[0]):
        if load_of(scene, room, lam, i, f) > 0.0:
            for r in range(scene.row[f], scene.row[f + 1]):
                value = room.drift[i, r]
                size = abs(value)
                for c in range(k):
                    value += room.slope[i, r, c] * v[c]
                    size += abs(room.slope[i, r, c] * v[c])
                if abs(value) > 1e-11 * size:
                    return False
    return True


@inner
def fits(scene, motion, room, i, pull):
    """Return whether a body at rest stays so, whatever proves it; see :func:`balanced`.

    First the impulses of the last step, if they leave some friction unused; then others.
    """
    return (
        balanced(scene, motion, room, i, pull, True, -SPARE)
        or balanced(scene, motion, room, i, pull, False, FIT)
        or balanced(scene, motion, room, i, pull, True, FIT)
    )


@inner
def balanced(scene, motion, room, i, pull, again, slack):
    """Return whether a body at rest stays so: forces, pulls and impulses in their sets balance.

    The impulses of the last step (with ``again``, or else of friction with a known load none) are
    corrected by the smallest change, weighted by the loads, that restores balance; if the result
    lies in its sets, up to a relative slack, it proves rest.  It is left in ``room.fit_grip`` and
    ``room.fit_lam``.
    """
    k, F, m = scene.size, scene.shape.shape[0], scene.bounce.size
    A, r = room.square, room.side
    lam, grip = room.fit_lam, room.fit_grip
    for c in range(k):
        r[c] = -(room.force[i, c] + room.kick[i, c]) - pull[i, c]
        for a in range(k):
            A[c, a] = 0.0
    for g in range(m):
        lam[i, g] = motion.lam[i, g]
        if lam[i, g] > 0.0:
            add_square(A, room.normal[i, g], lam[i, g] ** 2, k)
            for c in range(k):
                r[c] -= lam[i, g] * room.normal[i, g, c]
    for f in range(F):
        load = load_of(scene, room, motion.lam, i, f)
        central = scene.owner[f] < 0 and not again
        for a in range(2):
            grip[i, f, a] = 0.0 if central else motion.grip[i, f, a]
        if load > 0.0:
            for row in range(scene.row[f], scene.row[f + 1]):
                add_square(A, room.slope[i, row], load * load, k)
                for c in range(k):
                    r[c] -= grip[i, f, row - scene.row[f]] * room.slope[i, row, c]
    if not keeps(scene, room, motion.lam, i, motion.v[i]) or not solve_spd(A, r, k):
        return False
    for g in range(m):
        if lam[i, g] > 0.0:
            change = 0.0
            for c in range(k):
                change += room.normal[i, g, c] * r[c]
            lam[i, g] += motion.lam[i, g] ** 2 * change
            if lam[i, g] < 0.0:
                return False
    for f in range(F):
        before = load_of(scene, room, motion.lam, i, f)
        if before <= 0.0:
            continue
        for row in range(scene.row[f], scene.row[f + 1]):
            change = 0.0
            for c in range(k):
                change += room.slope[i, row, c] * r[c]
            grip[i, f, row - scene.row[f]] += before * before * change
        load = load_of(scene, room, lam, i, f)
        if not inside(scene, scene.shape[f, 0], grip[i, f, 0], grip[i, f, 1], load, slack):
            return False
    return True


# ------------------------------------------------------------------------------------- neighbours


@small
def place_of(scene, motion, i, a, time):
    """Return a body's place, in lengths, as seen from the moving substrate."""
    c = scene.place[a]
    x = motion.q[i, c] * scene.unit[c]
    return x - scene.carried * time if a == 0 else x


@small
def stale(scene, motion, room, time):
    """Return whether a body has moved so far that the list of neighbours may lack a pair."""
    if room.listed[1] == 0:
        return True
    limit = (0.25 * SKIN * scene.reach) ** 2
    for i in range(scene.bodies):
        if motion.alive[i]:
            far = 0.0
            for a in range(2):
                far += (place_of(scene, motion, i, a, time) - room.where[i, a]) ** 2
            if far > limit:
                return True
    return False


@inner
def heap_sort(values, count):
    """Sort the first numbers of an array, in place."""
    never_inline()
    for top in range(count // 2 - 1, -count, -1):
        start, end = top, count
        if top < 0:  # the largest is on top: put it at the end
            end = count + top
            values[0], values[end] = values[end], values[0]
            start = 0
        while 2 * start + 1 < end:
            child = 2 * start + 1
            if child + 1 < end and values[child + 1] > values[child]:
                child += 1
            if values[start] >= values[child]:
                break
            values[start], values[child] = values[child], values[start]
            start = child


@inner
def list_neighbours(scene, motion, room, time):
    """List pairs of bodies close enough to meet soon, ascending; return whether there was room."""
    N = scene.bodies
    for i in range(N):
        for a in range(2):
            room.where[i, a] = place_of(scene, motion, i, a, time)
    far = scene.reach * (1.0 + SKIN)
    found, ordered = room.slots, room.root
    for i in range(N):
        ordered[i] = i
        found_at = i
        while found_at > 0 and room.where[ordered[found_at - 1], 1] > room.where[i, 1]:
            ordered[found_at] = ordered[found_at - 1]
            found_at -= 1
        ordered[found_at] = i
    count = 0
    for s in range(N):
        i = ordered[s]
        if not motion.alive[i]:
            continue
        for t in range(s + 1, N):
            j = ordered[t]
            along = room.where[j, 1] - room.where[i, 1]
            if along > far:
                break
            across = room.where[j, 0] - room.where[i, 0]
            if motion.alive[j] and across * across + along * along < far * far:
                if count == room.pairs.shape[0]:
                    return False
                found[count] = min(i, j) * N + max(i, j)
                count += 1
    heap_sort(found, count)
    for s in range(count):
        room.pairs[s, 0], room.pairs[s, 1] = found[s] // N, found[s] % N
    room.listed[0], room.listed[1] = count, 1
    return True


@small
def watch_pair(scene, motion, room, a, b, limit, count):
    """Evaluate the gaps of a pair and note the small ones; return how many are noted, or -1."""
    k, work = scene.size, room.work
    n, m = scene.pair_reads.shape[0], scene.pair_gaps
    pair_gaps(scene, room, a, b, room.qm)
    for g in range(m):
        if work[n + g] < limit:
            if count + motion.counts[0] >= room.near.shape[0]:  # contacts of sleepers are kept, too
                return -1
            room.near[count, 0], room.near[count, 1], room.near[count, 2] = a, b, g
            room.near_gap[count] = work[n + g]
            old = find(motion, (a * scene.bodies + b) * m + g)
            room.near_old[count] = old
            for c in range(3):
                room.near_press[count, c] = motion.press[old, c] if old >= 0 else 0.0
            for c in range(2 * k):
                room.near_normal[count, c] = 0.0
            for r in range(n):
                c = scene.pair_reads[r, 0] * k + scene.pair_reads[r, 1]
                room.near_normal[count, c] = work[n + m + g * n + r]
            count += 1
    return count


@small
def watched_up_to(scene, room, h):
    """Return the gap up to which contacts are watched: any body may be hit by the fastest."""
    fastest = 0.0
    for i in range(scene.bodies):
        if room.awake[i]:
            fastest = max(fastest, room.speed[i])
    return NEAR * scene.scale + 2.0 * h * fastest


@small
def watch(scene, motion, room, h, count):
    """Note all small gaps between bodies of which one is awake; return how many, or -1."""
    limit = watched_up_to(scene, room, h)
    for s in range(room.listed[0]):
        a, b = room.pairs[s, 0], room.pairs[s, 1]
        if room.seen[s] or not (room.awake[a] or room.awake[b]):
            continue
        room.seen[s] = 1
        if not (motion.alive[a] and motion.alive[b]):
            continue
        far = 0.0
        for d in range(2):
            c = scene.place[d]
            far += ((room.qm[a, c] - room.qm[b, c]) * scene.unit[c]) ** 2
        if far < (scene.reach + limit) ** 2:
            count = watch_pair(scene, motion, room, a, b, limit, count)
            if count < 0:
                return NONE
    return count


# ----------------------------------------------------------------------------------------- blocks


@small
def finish_block(scene, room, b):
    """Compute ``M^-1 J'`` and the block's own stiffness, and take its impulse into account."""
    k = scene.size
    rows = max(1, room.rows[b])
    for r in range(rows):
        for side in range(2):
            i = room.body[b, side]
            for c in range(k):
                value = 0.0
                if i >= 0 and room.awake[i]:
                    for a in range(k):
                        value += room.inverse[i, c, a] * room.slant[b, r, side * k + a]
                    room.new[i, c] += value * room.p[b, r]
                room.pushed[b, r, side * k + c] = value
    d00 = d01 = d11 = 0.0
    for c in range(2 * k):
        d00 += room.slant[b, 0, c] * room.pushed[b, 0, c]
        if rows == 2:
            d01 += room.slant[b, 0, c] * room.pushed[b, 1, c]
            d11 += room.slant[b, 1, c] * room.pushed[b, 1, c]
    half = 0.5 * (d00 + d11)
    top = half + np.sqrt((0.5 * (d00 - d11)) ** 2 + d01 * d01)
    if rows == 1:
        top = d00
    room.stiff[b, 0], room.stiff[b, 1], room.stiff[b, 2] = d00, d01, d11
    room.stiff[b, 3] = 1.0 / top if top > 0.0 else 1.0


@inner
def bend_of(gap, before, then, h, scale):
    """Return what curvature adds to a gap that bodies slide or roll along; see ``simulation``."""
    bend = then - gap - h * before
    if abs(bend) <= CLOSED * scale or abs(h * before) > 4.0 * abs(bend):
        return 0.0
    return bend


@inner
def bound_of(gap, before, free, bend, bounce, h, scale):
    """Return the least closing-free speed a contact must leave with; see ``simulation``."""
    if gap + h * free < 0.0 and before < 0.0 and -bounce * before > abs(free - before):
        return -bounce * before
    reached = gap + bend
    if -CLOSED * scale < reached < 0.0:
        return 0.0
    if reached < 0.0:  # pushed out no faster than forces and curvature do within a step
        return min(-reached / h, abs(free - before) + abs(bend) / h)
    return -reached / h


@small
def new_block(room, b, k, first, second, rows):
    """Start a block with a Jacobian of zeros."""
    room.body[b, 0], room.body[b, 1], room.rows[b] = first, second, rows
    room.press_by[b] = -1
    room.weight[b] = 0.0
    for r in range(2):
        room.offset[b, r] = 0.0
        room.p[b, r] = 0.0
        for c in range(2 * k):
            room.slant[b, r, c] = 0.0


@small
def body_blocks(scene, motion, room, i, h, limit, count):
    """Append the blocks of a body's own contacts."""
    k, m = scene.size, scene.bounce.size
    block_of, looked = room.own, False
    for g in range(m):
        block_of[g] = -1
        before, free = 0.0, 0.0
        for c in range(k):
            before += room.normal[i, g, c] * motion.v[i, c]
            free += room.normal[i, g, c] * room.free[i, c]
        gap = room.gap[i, g]
        near = gap + h * min(before, free, 0.0) < limit
        if not near and not motion.touch[i, g]:
            motion.lam[i, g] = 0.0
            continue
        if not looked:
            own_gaps(scene, room, i, room.ahead, room.gap_then, room.normal_then)
            looked = True
        b = count
        count += 1
        block_of[g] = b
        new_block(room, b, k, i, NONE, ZERO)
        for c in range(k):
            room.slant[b, 0, c] = room.normal[i, g, c]
        bend = bend_of(gap, before, room.gap_then[i, g], h, scene.scale)
        room.offset[b, 0] = -bound_of(gap, before, free, bend, scene.bounce[g], h, scene.scale)
        room.weight[b] = -bend
        room.origin[b, 0], room.origin[b, 1], room.origin[b, 2] = 0, i, g
        room.p[b, 0] = motion.lam[i, g]
        finish_block(scene, room, b)
    for f in range(scene.shape.shape[0]):
        owner = scene.owner[f]
        if (owner < 0 and room.load[i, f] <= 0.0) or (owner >= 0 and block_of[owner] < 0):
            motion.grip[i, f, 0], motion.grip[i, f, 1] = 0.0, 0.0
            motion.stick[i, f] = 0
            continue
        b = count
        count += 1
        first = scene.row[f]
        new_block(room, b, k, i, NONE, scene.row[f + 1] - first)
        for r in range(room.rows[b]):
            room.offset[b, r] = room.drift[i, first + r]
            room.p[b, r] = motion.grip[i, f, r]
            for c in range(k):
                room.slant[b, r, c] = room.slope[i, first + r, c]
        room.block_shape[b] = scene.shape[f, 0 if motion.stick[i, f] else 1]
        if owner >= 0:
            room.press_by[b] = block_of[owner]
        else:
            room.weight[b] = room.load[i, f]
        room.origin[b, 0], room.origin[b, 1], room.origin[b, 2] = 1, i, f
        finish_block(scene, room, b)
    return count


@small
def pair_blocks(scene, motion, room, slot, h, count):
    """Append the two blocks of a contact between bodies."""
    k, work = scene.size, room.work
    i, j, g = room.near[slot, 0], room.near[slot, 1], room.near[slot, 2]
    before, free = 0.0, 0.0
    for c in range(k):
        before += room.near_normal[slot, c] * motion.v[i, c]
        before += room.near_normal[slot, k + c] * motion.v[j, c]
        free += room.near_normal[slot, c] * room.free[i, c]
        free += room.near_normal[slot, k + c] * room.free[j, c]
    old = room.near_old[slot]
    n = count
    new_block(room, n, k, i, j, ZERO)
    for c in range(2 * k):
        room.slant[n, 0, c] = room.near_normal[slot, c]
    gap = room.near_gap[slot]
    bend = bend_of(gap, before, room.pair_then[g], h, scene.scale)
    room.offset[n, 0] = -bound_of(gap, before, free, bend, scene.pair_bounce, h, scene.scale)
    room.weight[n] = -bend
    room.origin[n, 0], room.origin[n, 1], room.origin[n, 2] = 2, slot, g
    room.p[n, 0] = room.near_press[slot, 0]
    finish_block(scene, room, n)
    if scene.rub_table.shape[0] == 0:
        return count + 1
    address, swapped, p0 = scene.rub_table[g]
    first, second = (j, i) if swapped else (i, j)
    reads = scene.pair_reads.shape[0]
    for a in range(reads):
        body = first if scene.pair_reads[a, 0] == 0 else second
        work[a] = room.qm[body, scene.pair_reads[a, 1]]
    for c in range(k):
        work[reads + c], work[reads + k + c] = motion.v[first, c], motion.v[second, c]
    start, base = work.ctypes.data, scene.numbers.ctypes.data
    v0 = reads + 2 * k
    call_kernel(address, start, base + 8 * p0, start + 8 * v0, start + 8 * (v0 + 2), start)
    b = count + 1
    new_block(room, b, k, first, second, TWO)
    for r in range(2):
        value = work[v0 + r]
        for c in range(2 * k):
            slope = work[v0 + 2 + r * v0 + reads + c]
            room.slant[b, r, c] = slope
            value -= slope * work[reads + c]
        room.offset[b, r] = value
        room.p[b, r] = room.near_press[slot, 1 + r]
    sticks = old >= 0 and motion.flags[old, 0]
    room.block_shape[b] = scene.rub_shape[0 if sticks else 1]
    room.press_by[b] = n
    room.origin[b, 0], room.origin[b, 1], room.origin[b, 2] = 3, slot, g
    finish_block(scene, room, b)
    return count + 2


@inner
def find(motion, key):
    """Return where a contact stands in the sorted list of the last step, or -1."""
    low, high = 0, motion.counts[0]
    while low < high:
        middle = (low + high) // 2
        if motion.keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low if low < motion.counts[0] and motion.keys[low] == key else -1


@small
def root_of(root, i):
    """Return the representative of a body's island."""
    while root[i] != i:
        root[i] = root[root[i]]
        i = root[i]
    return i


# ------------------------------------------------------------------------------------- one island


@small
def slip_of(scene, room, b, v, out):
    """Evaluate ``J v + d`` of a block."""
    k = scene.size
    i, j = room.body[b, 0], room.body[b, 1]
    for r in range(max(1, room.rows[b])):
        value = room.offset[b, r]
        for c in range(k):
            value += room.slant[b, r, c] * v[i, c]
        if j >= 0:
            for c in range(k):
                value += room.slant[b, r, k + c] * v[j, c]
        out[r] = value


@small
def push(scene, room, b, r, change):
    """Add an impulse of one row to the velocities."""
    k = scene.size
    i, j = room.body[b, 0], room.body[b, 1]
    if change == 0.0:
        return
    for c in range(k):
        room.new[i, c] += room.pushed[b, r, c] * change
    if j >= 0:
        for c in range(k):
            room.new[j, c] += room.pushed[b, r, k + c] * change


@small
def relax(scene, room, b, u, out):
    """Solve one block with all others held; return how far it was from its law, as a speed."""
    owner = room.press_by[b]
    if owner >= 0 and room.p[owner, 0] <= 0.0 and room.p[b, 0] == 0.0 and room.p[b, 1] == 0.0:
        return 0.0
    slip_of(scene, room, b, room.new, u)
    rho = room.stiff[b, 3]
    if room.rows[b] == 0:
        p = room.p[b, 0]
        new = max(0.0, p - u[0] * rho)
        if new != p:
            push(scene, room, b, ZERO, new - p)
            room.p[b, 0] = new
        return abs(new - p) / rho
    load = room.weight[b] if owner < 0 else room.p[owner, 0]
    shape = room.block_shape[b]
    x, y = room.p[b, 0], room.p[b, 1]
    if room.rows[b] == 1:
        project(scene, shape, x - u[0] * rho, 0.0, load, out)
        far = abs(out[0] - x) / rho
        if out[0] != x:
            push(scene, room, b, ZERO, out[0] - x)
            room.p[b, 0] = out[0]
        return far
    project(scene, shape, x - u[0] * rho, y - u[1] * rho, load, out)
    far = np.sqrt((out[0] - x) ** 2 + (out[1] - y) ** 2) / rho
    d00, d01, d11 = room.stiff[b, 0], room.stiff[b, 1], room.stiff[b, 2]
    determinant = d00 * d11 - d01 * d01
    if load > 0.0 and determinant > 1e-12 * d00 * d11:
        sx = x - (d11 * u[0] - d01 * u[1]) / determinant
        sy = y - (d00 * u[1] - d01 * u[0]) / determinant
        if inside(scene, shape, sx, sy, load, 0.0):
            out[0], out[1] = sx, sy
    push(scene, room, b, ZERO, out[0] - x)
    push(scene, room, b, ONE, out[1] - y)
    room.p[b, 0], room.p[b, 1] = out[0], out[1]
    return far


@small
def residual(scene, room, first, last, u, out):
    """Return the largest distance of a block from its law, as a speed."""
    worst = 0.0
    for s in range(first, last):
        b = room.order[s]
        slip_of(scene, room, b, room.new, u)
        rho = room.stiff[b, 3]
        if room.rows[b] == 0:
            far = abs(max(0.0, room.p[b, 0] - u[0] * rho) - room.p[b, 0]) / rho
        else:
            owner = room.press_by[b]
            load = room.weight[b] if owner < 0 else room.p[owner, 0]
            y = room.p[b, 1] - u[1] * rho if room.rows[b] == 2 else 0.0
            project(scene, room.block_shape[b], room.p[b, 0] - u[0] * rho, y, load, out)
            far = abs(out[0] - room.p[b, 0]) / rho
            if room.rows[b] == 2:
                far = max(far, abs(out[1] - room.p[b, 1]) / rho)
        worst = max(worst, far)
    return worst


@small
def number_bodies(scene, motion, room, first, last):
    """Give numbers to the bodies of an island; return how many, and the bandwidth.

    From the lowest on, neighbours get the next numbers ([CM]), so that the matrix of
    :func:`solve_band` is a narrow band.  Nothing is numbered (0 is returned) if it has no room.
    """
    k, n, done, reach = scene.size, ZERO, ZERO, ZERO
    members, local, ring, chain = room.members, room.local, room.ring, room.chain
    lowest = NONE
    for s in range(first, last):
        for side in range(2):
            i = room.body[room.order[s], side]
            if i >= 0:
                local[i], ring[i] = NONE, NONE
                along = motion.q[i, scene.place[1]]
                if room.awake[i] and (lowest < 0 or along < motion.q[lowest, scene.place[1]]):
                    lowest = i
    for s in range(last - 1, first - 1, -1):
        b = room.order[s]
        for side in range(2):
            i = room.body[b, side]
            if i >= 0 and room.rows[b] == 0:
                chain[b, side], ring[i] = ring[i], 2 * b + side
    members[0], local[lowest], n = lowest, ZERO, ONE
    while done < n:
        at = ring[members[done]]
        done += ONE
        while at >= 0:
            other = room.body[at // 2, 1 - at % 2]
            if other >= 0 and room.awake[other] and local[other] < 0:
                members[n], local[other] = other, n
                n += ONE
            at = chain[at // 2, at % 2]
    for s in range(first, last):
        i, j = room.body[room.order[s], 0], room.body[room.order[s], 1]
        if i >= 0 and j >= 0 and room.awake[i] and room.awake[j]:
            reach = max(reach, abs(local[i] - local[j]))
    width = (reach + 1) * k - 1
    if n * k * (2 * width + 1) > room.matrix.size:
        n = ZERO
    return n, width


@inner
def solve_band(A, b, n, width, reach):
    """Solve ``A x = b`` in place for a band matrix; row ``i`` starts with column ``i - width``.

    The symmetric part of ``A`` is definite or nearly so: no rows are exchanged.  ``reach`` gets the
    envelope: row ``j`` ends, and so does column ``j`` below the diagonal, before ``reach[j]``.
    """
    never_inline()
    stride = 2 * width + 1
    for i in range(n):
        at = i * stride + width - i
        last = min(n, i + width + 1)
        while last > i + 1 and A[at + last - 1] == 0.0:
            last -= 1
        reach[i] = last
        first = max(0, i - width)
        while first < i and A[at + first] == 0.0:
            first += 1
        for j in range(first, i):
            reach[j] = max(reach[j], i + 1)
    for j in range(n):
        pivot = A[j * stride + width]
        if not abs(pivot) > 0.0:
            return False
        last = reach[j]
        at = j * stride + width - j
        above = A[at + j + 1 : at + last]
        for i in range(j + 1, last):
            at = i * stride + width - i
            f = A[at + j] / pivot
            reach[i] = max(reach[i], last)
            if f != 0.0:
                below = A[at + j + 1 : at + last]
                for c in range(above.size):
                    below[c] -= f * above[c]
                b[i] -= f * b[j]
    for i in range(n - 1, -1, -1):
        at = i * stride + width - i
        value = b[i]
        for c in range(i + 1, reach[i]):
            value -= A[at + c] * b[c]
        b[i] = value / A[at + i]
    return True


@inner
def start_matrix(scene, room, n, width):
    """Fill the matrix with the masses of the bodies of an island."""
    k, stride = scene.size, 2 * width + 1
    for a in range(n * k * stride):
        room.matrix[a] = 0.0
    for at in range(n):
        i = room.members[at]
        for x in range(k):
            for y in range(k):
                room.matrix[(at * k + x) * stride + width + y - x] = room.mass[i, x, y]


@small
def couple(scene, room, b, width):
    """Add ``J' G J`` of a block to the matrix.

    ``G`` stands in ``room.curve``, row by row, for three rows: that of the contact that presses
    on the block, and the block's own.
    """
    k, stride = scene.size, 2 * width + 1
    jac, bent, curve, owner = room.jac, room.bent, room.curve, room.press_by[b]
    sides = 2 if room.body[b, 1] >= 0 else 1
    rows = max(1, room.rows[b])
    start = 0 if owner >= 0 else 1
    if owner >= 0:
        swap = sides == 2 and room.body[owner, 0] != room.body[b, 0]
        for x in range(sides * k):
            jac[0, x] = room.slant[owner, 0, (x + k if x < k else x - k) if swap else x]
    for r in range(rows):
        for x in range(sides * k):
            jac[1 + r, x] = room.slant[b, r, x]
    for r in range(start, 1 + rows):
        for x in range(sides * k):
            value = 0.0
            for c in range(start, 1 + rows):
                value += curve[b, 3 * r + c] * jac[c, x]
            bent[r, x] = value
    for side in range(sides):
        i = room.body[b, side]
        if not room.awake[i]:
            continue
        for other in range(sides):
            j = room.body[b, other]
            if not room.awake[j]:
                continue
            for x in range(k):
                row = room.local[i] * k + x
                at = row * stride + width - row + room.local[j] * k
                for y in range(k):
                    value = 0.0
                    for r in range(start, 1 + rows):
                        value += jac[r, side * k + x] * bent[r, other * k + y]
                    room.matrix[at + y] += value


@small
def pull_with(scene, room, b, r, value, target):
    """Add ``value J'`` of a row to a vector over the bodies of an island."""
    k = scene.size
    for side in range(2):
        i = room.body[b, side]
        if i >= 0 and room.awake[i]:
            for x in range(k):
                target[room.local[i] * k + x] += value * room.slant[b, r, side * k + x]


@small
def along_row(scene, room, b, r, vector):
    """Return ``J x`` of a row for a vector over the bodies of an island."""
    k, value = scene.size, 0.0
    for side in range(2):
        i = room.body[b, side]
        if i >= 0 and room.awake[i]:
            for x in range(k):
                value += room.slant[b, r, side * k + x] * vector[room.local[i] * k + x]
    return value


@small
def newton(scene, room, first, last, n, width, goal, soft, worst, u, out):
    """Take semismooth Newton steps on the natural map; keep the best impulses and their residual.

    The map is ``p - proj(p - rho u)`` with the velocities ``u = J v + d`` of the rows; its
    derivative is that of the projection, and for friction also that of its load ([Acary]).  The
    steps ``dp = a - G J dv`` of the blocks are put into ``M dv = J' dp``, so that what is solved is
    as large as the velocities and not as the impulses.  All contacts are a little soft, so that
    redundant ones have a solution; this also damps the steps, as in the method of multipliers, of
    which it is one step ([Rockafellar76]): softer contacts converge where hard ones cycle.
    """
    size, x = n * scene.size, room.step
    least, former, steps, idle = np.inf, np.inf, ZERO, 0
    while True:
        idle = 0 if worst < least else idle + 1
        if worst < least:
            least = worst
            keep(room, first, last, room.p, room.best)
        settled = worst <= goal and worst > 0.1 * former
        if settled or worst <= 1e-2 * goal or idle == IDLE or steps == MOST:
            break
        former = worst
        natural_map(scene, room, first, last, n, width, soft, u, out)
        if not solve_band(room.matrix, x, size, width, room.reach):
            break
        for s in range(first, last):
            take_step(scene, room, room.order[s], x)
        steps += ONE
        worst = residual(scene, room, first, last, u, out)
    if worst > least:
        keep(room, first, last, room.best, room.p)
        rebuild(scene, room, first, last)
    return steps, least


@small
def take_step(scene, room, b, x):
    """Change the impulses of a block by a Newton step; see :func:`newton`."""
    curve, owner, rows = room.curve, room.press_by[b], max(1, room.rows[b])
    pressed = along_row(scene, room, owner, ZERO, x) if owner >= 0 else 0.0
    along = along_row(scene, room, b, ZERO, x)
    across = along_row(scene, room, b, ONE, x) if rows == 2 else 0.0
    for r in range(rows):
        change = room.answer[b, r] - curve[b, 4 + 3 * r] * along
        if owner >= 0:
            change -= curve[b, 3 + 3 * r] * pressed
        if rows == 2:
            change -= curve[b, 5 + 3 * r] * across
        room.p[b, r] += change
        push(scene, room, b, r, change)


@small
def natural_map(scene, room, first, last, n, width, soft, u, out):
    """Linearise the natural map of an island.

    ``room.curve`` and ``room.answer`` get ``G`` and ``a`` of each block; see :func:`newton`.
    """
    curve, answer, x = room.curve, room.answer, room.step
    start_matrix(scene, room, n, width)
    for c in range(n * scene.size):
        x[c] = 0.0
    for s in range(first, last):
        b = room.order[s]
        slip_of(scene, room, b, room.new, u)
        rho = room.stiff[b, 3]
        if room.rows[b] == 0:
            p = room.p[b, 0]
            if p - rho * u[0] <= 0.0:
                curve[b, 4], answer[b, 0] = 0.0, -p
            else:
                curve[b, 4], answer[b, 0] = rho / soft, -rho * u[0] / soft
        else:
            friction_map(scene, room, b, soft, u, out)
        owner = room.press_by[b]
        bears = curve[b, 4] > 0.0 if room.rows[b] == 0 else owner < 0 or room.p[owner, 0] > 0.0
        if bears:
            couple(scene, room, b, width)
        for r in range(max(1, room.rows[b])):
            pull_with(scene, room, b, r, answer[b, r], x)


@small
def friction_map(scene, room, b, soft, u, out):
    """Linearise the natural map of one friction contact."""
    curve, rho, d, owner = room.curve, room.stiff[b, 3], room.rows[b], room.press_by[b]
    load = room.weight[b] if owner < 0 else room.p[owner, 0]
    px, py = room.p[b, 0], room.p[b, 1] if d == 2 else 0.0
    zx, zy = px - rho * u[0], py - rho * u[1] if d == 2 else 0.0
    project(scene, room.block_shape[b], zx, zy, load, out)
    fx, fy = px - out[0], py - out[1] if d == 2 else 0.0
    d00, d01, d10, d11 = out[2], out[3], out[4], out[5]
    if d == 1:
        d01 = d10 = d11 = 0.0
    if owner >= 0 and load > 0.0:  # the load changes, too
        change = room.answer[owner, 0] / load
        ex = out[0] - d00 * zx - d01 * zy
        ey = out[1] - d10 * zx - d11 * zy if d == 2 else 0.0
        fx -= ex * change
        fy -= ey * change
        stiff = curve[owner, 4] / load
        ex *= stiff
        ey *= stiff
    else:
        ex = ey = 0.0
    # the inverse of 1 - D, a little soft
    s00, s11 = 1.0 + soft - d00, 1.0 + soft - d11
    determinant = s00 * s11 - d01 * d10
    i00, i01, i10, i11 = s11 / determinant, d01 / determinant, d10 / determinant, s00 / determinant
    curve[b, 3], curve[b, 6] = i00 * ex + i01 * ey, i10 * ex + i11 * ey
    curve[b, 4], curve[b, 5] = rho * (i00 * d00 + i01 * d10), rho * (i00 * d01 + i01 * d11)
    curve[b, 7], curve[b, 8] = rho * (i10 * d00 + i11 * d10), rho * (i10 * d01 + i11 * d11)
    curve[b, 0] = curve[b, 1] = curve[b, 2] = 0.0
    room.answer[b, 0], room.answer[b, 1] = -(i00 * fx + i01 * fy), -(i10 * fx + i11 * fy)


@inner
def keep(room, first, last, source, target):
    """Copy the impulses of an island."""
    for s in range(first, last):
        b = room.order[s]
        for r in range(2):
            target[b, r] = source[b, r]


@inner
def rebuild(scene, room, first, last):
    """Compute the velocities of an island from its impulses."""
    for s in range(first, last):
        for side in range(2):
            i = room.body[room.order[s], side]
            if i >= 0:
                for c in range(scene.size):
                    room.new[i, c] = room.free[i, c]
    for s in range(first, last):
        b = room.order[s]
        for r in range(max(1, room.rows[b])):
            push(scene, room, b, r, room.p[b, r])


@inner
def iterate(scene, motion, room, first, last, speed, sweeps):
    """Sweep over the blocks, and go on with Newton's method; return the residual.

    Contacts are made softer from round to round, and hard again after the last of a cycle.  It ends
    when the residual has reached its goal, when ``sweeps`` are done, or when a cycle has not halved
    what its first round left.
    """
    u, out = room.two, room.image
    goal = scene.tolerance * speed
    worst = residual(scene, room, first, last, u, out)
    if worst <= goal:
        return worst
    n, width = number_bodies(scene, motion, room, first, last)
    done, cycle, former = 0, 0, np.inf
    while True:
        for _ in range(2 if done == 0 else SWEEPS):
            worst = 0.0
            for s in range(first, last):
                worst = max(worst, relax(scene, room, room.order[s], u, out))
            done += 1
            if worst <= goal:
                break
        worst = residual(scene, room, first, last, u, out)
        if worst > goal and n > 0:
            soft = min(SOFTER, SOFT * scene.tolerance) if cycle == 0 else SOFTER * 3.0**cycle
            steps, worst = newton(scene, room, first, last, n, width, goal, soft, worst, u, out)
            motion.counts[4] += steps
        if worst <= goal or done >= sweeps:
            break
        if n > 0:
            if cycle == 0:
                former = worst
            elif cycle == ROUNDS - 1 and worst > 0.5 * former:
                break
            cycle = (cycle + 1) % ROUNDS
    motion.counts[3] += done
    return worst


@small
def turn_back(scene, motion, room, first, last):
    """Give the static set to contacts whose slip passed through zero; return whether any did.

    Slip that reverses within a step was zero within it, and there it is the static set that
    decides whether it starts again.
    """
    found = False
    u = room.two
    for s in range(first, last):
        b = room.order[s]
        if room.rows[b] == 0 or room.turned[b]:
            continue
        slip_of(scene, room, b, motion.v, u)
        x, y = u[0], u[1] if room.rows[b] == 2 else 0.0
        slip_of(scene, room, b, room.new, u)
        along = x * u[0] + (y * u[1] if room.rows[b] == 2 else 0.0)
        if along < 0.0:
            room.turned[b] = 1
            kind, f = room.origin[b, 0], room.origin[b, 2]
            shape = scene.shape[f, 0] if kind == 1 else scene.rub_shape[0]
            if shape != room.block_shape[b]:
                room.block_shape[b] = shape
                found = True
    return found


# ------------------------------------------------------------------------------- a heap at rest


@small
def add_linear(c0, c1, c2, load, x, y, out):
    """Add the barrier ``-log(c0 load + c1 x + c2 y)`` to a slope (3) and a curvature (6)."""
    f = 1.0 / (c0 * load + c1 * x + c2 * y)
    c0, c1, c2 = c0 * f, c1 * f, c2 * f
    out[0], out[1], out[2] = out[0] - c0, out[1] - c1, out[2] - c2
    out[3], out[4], out[5] = out[3] + c0 * c0, out[4] + c0 * c1, out[5] + c0 * c2
    out[6], out[7], out[8] = out[6] + c1 * c1, out[7] + c1 * c2, out[8] + c2 * c2


@small
def add_quadratic(a, b, load, x, y, out):
    """Add the barrier ``-log(load^2 - (x / a)^2 - (y / b)^2)``."""
    e, f = 1.0 / (a * a), 1.0 / (b * b)
    g = 2.0 / (load * load - e * x * x - f * y * y)
    c0, c1, c2 = -g * load, g * e * x, g * f * y
    out[0], out[1], out[2] = out[0] + c0, out[1] + c1, out[2] + c2
    out[3], out[4], out[5] = out[3] + c0 * c0 - g, out[4] + c0 * c1, out[5] + c0 * c2
    out[6], out[7], out[8] = out[6] + c1 * c1 + g * e, out[7] + c1 * c2, out[8] + c2 * c2 + g * f


@small
def barrier(scene, shape, load, x, y, out):
    """Differentiate the barrier of ``load`` times a set: slope and curvature in load, x and y."""
    for a in range(9):
        out[a] = 0.0
    kind = scene.kinds[shape]
    a, b = scene.sizes[shape, 0], scene.sizes[shape, 1]
    if kind == INTERVAL:
        add_linear(-a, 1.0, 0.0, load, x, y, out)
        add_linear(b, -1.0, 0.0, load, x, y, out)
        out[8] = 1.0
    elif kind == DISC:
        add_quadratic(a, a, load, x, y, out)
    elif kind == ELLIPSE:
        add_quadratic(a, b, load, x, y, out)
    elif kind == CUT_DISC:
        add_quadratic(a, a, load, x, y, out)
        add_linear(b, 1.0, 0.0, load, x, y, out)
        add_linear(b, -1.0, 0.0, load, x, y, out)
    else:
        first, last = scene.corner[shape], scene.corner[shape + 1]
        for i in range(first, last):
            j = i + 1 if i + 1 < last else first
            ax, ay = scene.vertices[i, 0], scene.vertices[i, 1]
            ex, ey = scene.vertices[j, 0] - ax, scene.vertices[j, 1] - ay
            add_linear(ey * ax - ex * ay, -ey, ex, load, x, y, out)


@inner
def bears(scene, motion, room, first, last, speed, goal):
    """Note in ``room.held`` which blocks can bear at rest; return whether rest is possible at all.

    Those of contacts that neither open nor close; none may slip or have to open.  All get
    impulses in the interior of their sets.  Bounds that are off by a few tolerances are moved to
    what rest asks for, whatever the answer: where they were not, heaps missed the tolerance a third
    more often, and one jam twitched for seconds.
    """
    u, out = room.two, room.image
    for s in range(first, last):
        b = room.order[s]
        owner, shape = room.press_by[b], room.block_shape[b]
        slip_of(scene, room, b, motion.v, u)
        if room.rows[b] == 0:
            if u[0] < -NEARLY * goal:
                return False
            room.held[b] = 0.0
            if u[0] <= NEARLY * goal:  # shut
                room.held[b] = 1.0
                room.offset[b, 0] -= u[0]
            least = PRESS * room.stiff[b, 3] * speed
            room.p[b, 0] = max(room.p[b, 0], least) * room.held[b]
            continue
        room.held[b] = 1.0
        if owner >= 0:
            room.held[b] = room.held[owner]
        if room.held[b] == 0.0:
            room.p[b, 0], room.p[b, 1] = 0.0, 0.0
            continue
        if abs(u[0]) > NEARLY * goal or (room.rows[b] == 2 and abs(u[1]) > NEARLY * goal):
            return False
        load = room.weight[b] if owner < 0 else room.p[owner, 0]
        if scene.kinds[shape] == INTERVAL or room.rows[b] == 1:
            room.p[b, 1] = 0.0
        tries = 0
        while not inside(scene, shape, room.p[b, 0], room.p[b, 1], load, -AWAY):
            tries += 1
            share = 0.8 if tries < 20 else 0.0
            room.p[b, 0] *= share
            room.p[b, 1] *= share
            if tries > 20:
                return False
        barrier(scene, shape, load, room.p[b, 0], room.p[b, 1], out)
        if not (load > 0.0 and out[6] < np.inf):  # a set without interior
            return False
    return True


@inner
def weigh(scene, room, first, last, n, width, speed):
    """Set up the Newton step of :func:`stays`: matrix and right side.

    Of each block that bears, ``room.curve`` gets the inverse of its curvature (2 x 2) and how its
    slope changes with its load (2); of each contact, ``room.lean`` the row that is left of its
    normal when its friction is eliminated.
    """
    k, curve, answer, out, x = scene.size, room.curve, room.answer, room.image, room.step
    stiffest = 0.0
    for s in range(first, last):
        b = room.order[s]
        for a in range(9):
            curve[b, a] = 0.0
        if room.rows[b] == 0 and room.held[b] > 0.0:
            p = room.p[b, 0]
            slope = 1.0 / (PRESS * room.stiff[b, 3] * speed) - 1.0 / p
            curve[b, 0], answer[b, 0], answer[b, 1] = 1.0 / (p * p), slope, slope
            for c in range(2 * k):
                room.lean[b, c] = room.slant[b, 0, c]
    for s in range(first, last):
        b = room.order[s]
        owner, rows = room.press_by[b], room.rows[b]
        if rows == 0 or room.held[b] == 0.0:
            continue
        load = room.weight[b] if owner < 0 else room.p[owner, 0]
        barrier(scene, room.block_shape[b], load, room.p[b, 0], room.p[b, 1], out)
        flat = rows == 1 or scene.kinds[room.block_shape[b]] == INTERVAL
        if flat:
            x00, x01, x11 = 1.0 / out[6], 0.0, 0.0
        else:
            determinant = out[6] * out[8] - out[7] * out[7]
            x00, x01, x11 = out[8] / determinant, -out[7] / determinant, out[6] / determinant
        curve[b, 4], curve[b, 5], curve[b, 7], curve[b, 8] = x00, x01, x01, x11
        answer[b, 0], answer[b, 1] = out[1], out[2]
        stiffest = max(stiffest, max(x00, x11) / room.stiff[b, 3])
        if owner < 0:
            continue
        t0, t1 = x00 * out[4] + x01 * out[5], x01 * out[4] + x11 * out[5]
        room.lead[b, 0], room.lead[b, 1] = t0, t1
        curve[owner, 0] += out[3] - t0 * out[4] - t1 * out[5]
        answer[owner, 0] += out[0] - t0 * out[1] - t1 * out[2]
        answer[owner, 1] += out[0]
        shift = 0 if room.body[owner, 0] == room.body[b, 0] else k
        for c in range(2 * k):
            at = (c + shift) % (2 * k)
            room.lean[owner, at] -= t0 * room.slant[b, 0, c]
            if rows == 2:
                room.lean[owner, at] -= t1 * room.slant[b, 1, c]
    for s in range(first, last):
        b = room.order[s]
        if room.rows[b] == 0 and room.held[b] > 0.0:
            stiffest = max(stiffest, 1.0 / (curve[b, 0] * room.stiff[b, 3]))
    start_matrix(scene, room, n, width)
    for a in range(n * k * (2 * width + 1)):
        room.matrix[a] *= SOFTEST * stiffest
    for s in range(first, last):
        b = room.order[s]
        if room.held[b] == 0.0:
            continue
        if room.rows[b] > 0:
            couple(scene, room, b, width)
            g0, g1 = answer[b, 0], answer[b, 1]
            pull_with(scene, room, b, ZERO, curve[b, 4] * g0 + curve[b, 5] * g1, x)
            if room.rows[b] == 2:
                pull_with(scene, room, b, ONE, curve[b, 7] * g0 + curve[b, 8] * g1, x)
        else:
            lean_on(scene, room, b, width)


@small
def lean_on(scene, room, b, width):
    """Add what is left of a contact's normal to the matrix and the right side."""
    k, x, lean = scene.size, room.step, room.lean
    stride, share = 2 * width + 1, 1.0 / room.curve[b, 0]
    for side in range(2):
        i = room.body[b, side]
        if i < 0 or not room.awake[i]:
            continue
        for c in range(k):
            row = room.local[i] * k + c
            value = share * lean[b, side * k + c]
            x[row] += value * room.answer[b, 0]
            for other in range(2):
                j = room.body[b, other]
                if j < 0 or not room.awake[j]:
                    continue
                at = row * stride + width - row + room.local[j] * k
                for d in range(k):
                    room.matrix[at + d] += value * lean[b, other * k + d]


@inner
def changes(scene, room, first, last):
    """Put the Newton step of the impulses into ``room.best``; return its squared local length."""
    k, x, curve, answer, best = scene.size, room.step, room.curve, room.answer, room.best
    square = 0.0
    for s in range(first, last):
        b = room.order[s]
        best[b, 0], best[b, 1] = 0.0, 0.0
        if room.rows[b] > 0 or room.held[b] == 0.0:
            continue
        value = 0.0
        for side in range(2):
            i = room.body[b, side]
            if i >= 0 and room.awake[i]:
                for c in range(k):
                    value += room.lean[b, side * k + c] * x[room.local[i] * k + c]
        best[b, 0] = (value - answer[b, 0]) / curve[b, 0]
        square += best[b, 0] * (along_row(scene, room, b, ZERO, x) - answer[b, 1])
    for s in range(first, last):
        b = room.order[s]
        owner = room.press_by[b]
        if room.rows[b] == 0 or room.held[b] == 0.0:
            continue
        a0 = along_row(scene, room, b, ZERO, x) - answer[b, 0]
        a1 = along_row(scene, room, b, ONE, x) - answer[b, 1] if room.rows[b] == 2 else 0.0
        best[b, 0] = curve[b, 4] * a0 + curve[b, 5] * a1
        best[b, 1] = curve[b, 7] * a0 + curve[b, 8] * a1
        if owner >= 0:
            best[b, 0] -= room.lead[b, 0] * best[owner, 0]
            best[b, 1] -= room.lead[b, 1] * best[owner, 0]
        square += best[b, 0] * a0 + best[b, 1] * a1
    return square


@inner
def within(scene, room, first, last, share):
    """Return whether impulses changed by a share of a step are in the interior of their sets."""
    p, best = room.p, room.best
    for s in range(first, last):
        b = room.order[s]
        if room.held[b] == 0.0:
            continue
        x = p[b, 0] + share * best[b, 0]
        if room.rows[b] == 0:
            if x <= INWARD * p[b, 0]:
                return False
            continue
        owner = room.press_by[b]
        y = p[b, 1] + share * best[b, 1]
        load = room.weight[b] if owner < 0 else p[owner, 0] + share * best[owner, 0]
        if not inside(scene, room.block_shape[b], x, y, load, -INWARD):
            return False
    return True


@inner
def centre(scene, motion, room, first, last, n, width, speed, goal):
    """Move impulses towards balance and the centre of their sets; return whether they balance."""
    k, x, p, best = scene.size, room.step, room.p, room.best
    balanced_for, stuck = 0, 0
    for _ in range(PATIENCE):
        far = 0.0
        for at in range(n):
            i = room.members[at]
            for c in range(k):
                value = 0.0
                for a in range(k):
                    value += room.mass[i, c, a] * (motion.v[i, a] - room.free[i, a])
                x[at * k + c] = value
        for s in range(first, last):
            b = room.order[s]
            for r in range(max(1, room.rows[b])):
                pull_with(scene, room, b, r, -p[b, r], x)
        for at in range(n):
            i = room.members[at]
            for c in range(k):
                value = 0.0
                for a in range(k):
                    value += room.inverse[i, c, a] * x[at * k + a]
                far = max(far, abs(value) * scene.unit[c])
        if far <= BALANCE * goal:
            balanced_for += 1
        if balanced_for > CENTRING:
            return True
        weigh(scene, room, first, last, n, width, speed)
        if not solve_band(room.matrix, x, n * k, width, room.reach):
            return balanced_for > 0
        motion.counts[4] += 1
        square = changes(scene, room, first, last)
        share, least = 1.0, 0.0
        if balanced_for > 0:
            if square < 0.1:
                return True
            least = 1.0 / (1.0 + np.sqrt(square))  # goes down, and stays inside ([BV] sec. 9.6)
        while not within(scene, room, first, last, share):
            share *= 0.7
            if share < 1e-3:
                return balanced_for > 0
        if share < 1.0:
            share = max(least, 0.7 * share)
        stuck += 1 if share < 0.1 else 0
        if stuck == 2:
            return balanced_for > 0
        for s in range(first, last):
            b = room.order[s]
            for r in range(2):
                p[b, r] += share * best[b, r]
    return balanced_for > 0


@inner
def stays(scene, motion, room, first, last, speed):
    """Return whether an island at rest stays so; then its impulses prove it.

    At rest nothing slips, so that De Saxce's term vanishes and the question is convex: are there
    impulses in the sets that balance the forces?  They are sought in the interior, at the least of
    ``sum n / n_0 - sum log(distance from the boundary)`` over the balanced ones, by Newton's method
    from unbalanced ones ([BV] sec. 10.3; the sums hold no force that grows without end in a jam).
    Forces far from their bounds go on to balance while the loads change: the heap can sleep.
    """
    k = scene.size
    n, width = number_bodies(scene, motion, room, first, last)
    if n == 0:
        return False
    goal = scene.tolerance * speed
    keep(room, first, last, room.p, room.hat)
    proved = False
    if bears(scene, motion, room, first, last, speed, goal):
        proved = centre(scene, motion, room, first, last, n, width, speed, goal)
    if not proved:
        keep(room, first, last, room.hat, room.p)
        return False
    for at in range(n):
        i = room.members[at]
        for c in range(k):
            room.new[i, c] = motion.v[i, c]
    return True


# ------------------------------------------------------------------------------------ all islands


@small
def solve_island(scene, motion, room, first, last):
    """Solve the blocks ``order[first:last]``; return the residual relative to the speeds.

    An island at rest is first asked whether it stays so: see :func:`stays`.
    """
    u = room.two
    speed, quiet = 0.0, True
    for s in range(first, last):
        b = room.order[s]
        room.turned[b] = 0
        slip_of(scene, room, b, room.free, u)
        for r in range(max(1, room.rows[b])):
            speed = max(speed, abs(u[r]))
    for s in range(first, last):
        for side in range(2):
            i = room.body[room.order[s], side]
            if i >= 0:
                room.pace[i] = max(room.pace[i], speed)
                if room.awake[i] and not motion.rests[i]:
                    quiet = False
    motion.counts[5] += 1
    if speed == 0.0:  # nothing moves and nothing pulls
        for s in range(first, last):
            for r in range(2):
                room.p[room.order[s], r] = 0.0
        for s in range(first, last):
            for side in range(2):
                i = room.body[room.order[s], side]
                if i >= 0:
                    for c in range(scene.size):
                        room.new[i, c] = room.free[i, c]
        return 0.0
    if quiet and stays(scene, motion, room, first, last, speed):
        return residual(scene, room, first, last, u, room.image) / speed
    while True:
        worst = iterate(scene, motion, room, first, last, speed, scene.sweeps)
        if worst > scene.tolerance * speed or not turn_back(scene, motion, room, first, last):
            break
    return worst / speed


# ----------------------------------------------------------------------------------------- a step


@small
def rouse(scene, motion, room, h, time, index):
    """Put to work the bodies that are awake and sleepers whose forces fit no more.

    Return whether there is any.  A sleeper whose forces fit with room to spare is not even asked
    until they could have used it up, at the rate at which they changed when it was asked before.
    """
    busy = False
    for i in range(scene.bodies):
        room.awake[i], room.asked[i], room.touched[i] = 0, 0, 0
        if not motion.alive[i]:
            continue
        if motion.asleep[i] and motion.due[i] > index:
            for c in range(scene.size):
                room.qm[i, c] = motion.q[i, c] + 0.5 * h * motion.v[i, c]
            continue
        if not ask(scene, motion, room, i, motion.pull, h, time, index):
            room.awake[i], busy = 1, True
    if busy and scene.pair_at != 0:
        rouse_heaps(scene, motion, room, h, time, index)
    return busy


@small
def rouse_heaps(scene, motion, room, h, time, index):
    """Wake all of a heap at rest in which one was woken: it is asked as a whole (:func:`stays`)."""
    N, root, struck, busy = scene.bodies, room.root, room.touched, room.next
    woken = False
    for i in range(N):
        root[i] = i
        struck[i], busy[i] = 0, 0
        woken = woken or (motion.asleep[i] and room.awake[i])
    if not woken:
        return
    for s in range(motion.counts[0]):
        if motion.flags[s, 1]:
            pair = motion.keys[s] // scene.pair_gaps
            x, y = root_of(root, pair // N), root_of(root, pair % N)
            root[max(x, y)] = min(x, y)
    for i in range(N):
        if motion.alive[i]:
            r = root_of(root, i)
            if not motion.rests[i]:
                busy[r] = 1
            if motion.asleep[i] and room.awake[i]:
                struck[r] = 1
    for i in range(N):
        r = root_of(root, i)
        if motion.alive[i] and not room.awake[i] and struck[r] and not busy[r]:
            if not room.asked[i]:
                ask(scene, motion, room, i, motion.pull, h, time, index)
            room.awake[i] = 1


@inner
def ask(scene, motion, room, i, pull, h, time, index):
    """Evaluate a body; return whether it goes on sleeping, and book the work done meanwhile."""
    room.asked[i] = 1
    read_body(scene, motion, room, i, h, time, index)
    if not motion.asleep[i]:
        return False
    asleep = fits(scene, motion, room, i, pull)
    steps = index - motion.since[i]
    if steps > 0:  # by the trapezium rule, if there is a new value
        share = 0.5 * steps if asleep else 0.0
        for f in range(scene.shape.shape[0]):
            for r in range(scene.row[f + 1] - scene.row[f]):
                p = (steps - share) * motion.worked[i, f, r] + share * room.fit_grip[i, f, r]
                motion.sums[0] -= p * room.drift[i, scene.row[f] + r]
                if asleep:
                    motion.worked[i, f, r] = room.fit_grip[i, f, r]
        motion.since[i] = index
    return asleep


@inner
def sleep_on(scene, motion, room, i, h, index):
    """Decide when a sleeper is asked again."""
    rate = 0.0
    for f in range(scene.shape.shape[0]):
        load = load_of(scene, room, room.fit_lam, i, f)
        if load <= 0.0:
            continue
        x, y = room.fit_grip[i, f, 0], room.fit_grip[i, f, 1]
        if not inside(scene, scene.shape[f, 0], x, y, load * (1.0 - SPARE), 0.0):
            return index + 1
        change = abs(x - motion.grip[i, f, 0]) + abs(y - motion.grip[i, f, 1])
        rate = max(rate, change / load)
    steps = LONGEST
    if rate * LONGEST > 0.1 * SPARE:
        steps = np.int64(0.1 * SPARE / rate)
    for c in range(scene.size):
        if scene.kicks[c] > 0.0:
            return index + 1
    for g in range(scene.bounce.size):
        if room.fit_lam[i, g] > 0.0:
            return index + 1
    if scene.chatter > 0.0:  # a new draw comes at a known time
        now = np.floor((index + 0.5) * h / scene.chatter_time)
        while steps > 0 and np.floor((index + steps + 0.5) * h / scene.chatter_time) != now:
            steps -= 1
    return index + 1 + steps


@small
def start_bodies(scene, motion, room):
    """Give bodies that are awake the velocities of forces alone, and measure their speeds."""
    k = scene.size
    for i in range(scene.bodies):
        if not motion.alive[i]:
            continue
        for c in range(k):
            value = motion.v[i, c]
            if room.awake[i]:
                for a in range(k):
                    value += room.inverse[i, c, a] * (room.force[i, a] + room.kick[i, a])
            room.free[i, c] = value
            room.new[i, c] = value
        speed = 0.0
        for c in range(k):
            still = scene.carried / scene.unit[c] if c == scene.place[0] else 0.0
            before = abs(motion.v[i, c] - still) * scene.unit[c]
            speed += max(before, abs(room.free[i, c] - still) * scene.unit[c])
        room.speed[i], room.pace[i] = speed, speed


@inner
def home(room, b):
    """Return the island of a block: that of a body in it which is awake."""
    first = room.body[b, 0]
    return room.root[first if room.awake[first] else room.body[b, 1]]


@small
def islands(scene, room, blocks):
    """Order blocks by islands of touching bodies; ``room.size`` says where islands start."""
    N = scene.bodies
    for i in range(N):
        room.root[i] = i
    for b in range(blocks):
        if room.body[b, 1] >= 0 and room.awake[room.body[b, 0]] and room.awake[room.body[b, 1]]:
            x, y = root_of(room.root, room.body[b, 0]), root_of(room.root, room.body[b, 1])
            if x != y:
                room.root[max(x, y)] = min(x, y)
    sizes, place = room.size, room.next
    sizes[0] = 0
    for i in range(N):
        sizes[i + 1] = 0
    for i in range(N):
        room.root[i] = root_of(room.root, i)
    for b in range(blocks):
        sizes[home(room, b) + 1] += 1
    for i in range(N):
        sizes[i + 1] += sizes[i]
    for i in range(N):
        place[i] = sizes[i]
    for b in range(blocks):
        r = home(room, b)
        room.order[place[r]] = b
        place[r] += 1


@small
def solve_islands(scene, motion, room, blocks, h):
    """Solve all islands; those in which gaps would close by their curvature once more."""
    starts = room.size
    for look in range(2):
        for i in range(scene.bodies):
            if starts[i + 1] > starts[i] and (look == 0 or room.shut[i]):
                room.error[i] = solve_island(scene, motion, room, starts[i], starts[i + 1])
        if look == 1 or not look_ahead(scene, motion, room, blocks, h):
            break


@small
def look_ahead(scene, motion, room, blocks, h):
    """Raise the bounds of gaps that close more than their slopes say; return whether any does.

    See ``simulation``.  Between bodies it is asked only if they move fast enough.
    """
    k, u, found = scene.size, room.two, False
    for i in range(scene.bodies):
        room.shut[i] = 0
        speed = 0.0
        for c in range(k):
            room.ahead[i, c] = room.qm[i, c] + h * room.new[i, c]
            still = scene.carried if c == scene.place[0] else 0.0
            speed += abs(room.new[i, c] * scene.unit[c] - still)
        room.speed[i] = speed
    swift = np.sqrt(0.5 * BEND) * scene.scale / h
    first, second = NONE, NONE
    for b in range(blocks):
        if room.rows[b] > 0:
            continue
        i, g = room.body[b, 0], room.origin[b, 2]
        if room.origin[b, 0] == 0:
            if i != first:
                own_gaps(scene, room, i, room.ahead, room.gap_then, room.normal_then)
            first, second = i, NONE
            gap, then = room.gap[i, g], room.gap_then[i, g]
        else:
            j = room.body[b, 1]
            if room.speed[i] + room.speed[j] <= swift:
                continue
            if i != first or j != second:
                pair_gaps(scene, room, i, j, room.ahead)
            first, second = i, j
            gap = room.near_gap[room.origin[b, 1]]
            then = room.work[scene.pair_reads.shape[0] + g]
        aim = min(0.0, gap - h * room.offset[b, 0] - room.weight[b])
        if then < aim - BEND * scene.scale:
            slip_of(scene, room, b, room.new, u)
            room.weight[b] = gap + h * (u[0] - room.offset[b, 0]) - then
            room.offset[b, 0] = (gap - room.weight[b] - aim) / h
            room.shut[home(room, b)] = 1
            found = True
    return found


@small
def account(scene, motion, room, blocks, h):
    """Book the work of this step by cause."""
    k, u = scene.size, room.two
    for b in range(blocks):
        kind = room.origin[b, 0]
        if room.rows[b] == 0:
            slip_of(scene, room, b, motion.v, u)
            x = u[0]
            slip_of(scene, room, b, room.new, u)
            motion.sums[5] -= room.p[b, 0] * (0.5 * (x + u[0]) - room.offset[b, 0])
            continue
        cause = scene.rub_cause if kind == 3 else scene.cause[room.origin[b, 2]]
        for r in range(room.rows[b]):
            slip_of(scene, room, b, motion.v, u)
            x = u[r]
            slip_of(scene, room, b, room.new, u)
            motion.sums[5 + cause] -= room.p[b, r] * 0.5 * (x + u[r])
            motion.sums[0] -= room.p[b, r] * room.offset[b, r]
    for i in range(scene.bodies):
        if not motion.alive[i]:
            continue
        if not (room.awake[i] or room.asked[i]):
            continue
        for c in range(k):
            mean = 0.5 * (motion.v[i, c] + room.new[i, c])
            motion.sums[1] += mean * room.applied[i, c]
            motion.sums[2] += mean * room.kick[i, c]
        if not room.awake[i] and room.asked[i]:
            for f in range(scene.shape.shape[0]):
                for r in range(scene.row[f + 1] - scene.row[f]):
                    drift = room.drift[i, scene.row[f] + r]
                    motion.sums[0] -= room.fit_grip[i, f, r] * drift


@small
def gather_pulls(scene, motion, room, blocks, h, time, index):
    """Add up what contacts do to each body; return whether it woke one that cannot bear it."""
    k, N = scene.size, scene.bodies
    for i in range(N):
        room.touched[i] = 0
        for c in range(k):
            room.pull[i, c] = 0.0
    for s in range(motion.counts[0]):
        pair = motion.keys[s] // scene.pair_gaps
        i, j = pair // N, pair % N
        if room.awake[i] or room.awake[j]:
            room.touched[i] = room.touched[j] = 1
            continue
        for c in range(k):
            room.pull[i, c] += motion.shove[s, c]
            room.pull[j, c] += motion.shove[s, k + c]
    for b in range(blocks):
        if room.origin[b, 0] >= 2:
            for side in range(2):
                i = room.body[b, side]
                room.touched[i] = 1
                for r in range(max(1, room.rows[b])):
                    for c in range(k):
                        room.pull[i, c] += room.slant[b, r, side * k + c] * room.p[b, r]
    woken = False
    for i in range(N):
        if room.touched[i] and motion.alive[i] and not room.awake[i]:
            if not room.asked[i]:
                ask(scene, motion, room, i, motion.pull, h, time, index)
            if not fits(scene, motion, room, i, room.pull):
                room.awake[i] = 1
                woken = True
    return woken


@small
def keep_impulses(motion, room, blocks):
    """Store the impulses: of this step's solution, or for another round of it to start from."""
    for b in range(blocks):
        kind, i, f = room.origin[b, 0], room.origin[b, 1], room.origin[b, 2]
        if kind == 0:
            motion.lam[i, f] = room.p[b, 0]
        elif kind == 2:
            room.near_press[i, 0] = room.p[b, 0]
        for r in range(room.rows[b]):
            if kind == 1:
                motion.grip[i, f, r] = room.p[b, r]
            else:
                room.near_press[i, 1 + r] = room.p[b, r]


@small
def keep_sticking(scene, motion, room, blocks):
    """Store which friction contacts of bodies stick."""
    for b in range(blocks):
        if room.origin[b, 0] == 1:
            sticks = holds(scene, room, b, room.two)
            motion.stick[room.origin[b, 1], room.origin[b, 2]] = 1 if sticks else 0


@small
def holds(scene, room, b, u):
    """Return whether a friction contact sticks: its slip vanishes within the solver's accuracy."""
    slip_of(scene, room, b, room.new, u)
    slip = abs(u[0]) + (abs(u[1]) if room.rows[b] == 2 else 0.0)
    size = room.pace[room.body[b, 0]]
    if room.body[b, 1] >= 0:
        size = max(size, room.pace[room.body[b, 1]])
    return slip <= 2.0 * scene.tolerance * size


@small
def settle(scene, motion, room, h, index):
    """Give bodies that have come to rest exactly the velocity of rest; let what fits sleep."""
    k = scene.size
    rest = room.rest
    for i in range(scene.bodies):
        if not motion.alive[i]:
            continue
        if room.awake[i]:
            motion.rests[i], motion.asleep[i] = 0, 0
            if comes_to_rest(scene, motion, room, i, rest):
                motion.rests[i] = 1
        if room.awake[i] or room.touched[i]:
            for c in range(k):
                motion.pull[i, c] = room.pull[i, c]
        if room.awake[i]:
            motion.since[i], motion.due[i] = index + 1, index + 1
        if motion.asleep[i] and room.asked[i]:
            if not room.awake[i]:
                motion.since[i] = index + 1
                motion.due[i] = sleep_on(scene, motion, room, i, h, index)
            for f in range(scene.shape.shape[0]):
                for r in range(2):
                    motion.grip[i, f, r] = room.fit_grip[i, f, r]
                    motion.worked[i, f, r] = room.fit_grip[i, f, r]
            for g in range(scene.bounce.size):
                motion.lam[i, g] = room.fit_lam[i, g]


@small
def comes_to_rest(scene, motion, room, i, rest):
    """Return whether a body rests after the step; then its velocity is exactly that of rest.

    It sleeps if it was at rest before, so that its impulses are those of balance, and they fit.
    """
    k = scene.size
    for f in range(scene.shape.shape[0]):
        if load_of(scene, room, motion.lam, i, f) > 0.0 and not motion.stick[i, f]:
            return False
    if not velocity_of_rest(scene, room, motion.lam, i, rest):
        return False
    size, far, old = room.pace[i], 0.0, 0.0
    for c in range(k):
        unit = scene.unit[c]
        size = max(size, abs(rest[c]) * unit)
        far = max(far, abs(room.new[i, c] - rest[c]) * unit)
        old = max(old, abs(motion.v[i, c] - rest[c]) * unit)
    if far > NEARLY * scene.tolerance * size:
        return False
    still = old <= 1e-13 * size
    for c in range(k):
        room.new[i, c] = motion.v[i, c] if still else rest[c]
    if still and fits(scene, motion, room, i, room.pull):
        motion.asleep[i] = 1
    return True


@small
def note(events, numbers, count, kind, i, j, which, time, value):
    """Record an event."""
    events[count, 0], events[count, 1] = kind, i
    events[count, 2], events[count, 3] = j, which
    numbers[count, 0], numbers[count, 1] = time, value
    return count + 1


@small
def touch_event(room, motion, b, was, gap, h, time, scale, u, out):
    """Compare a contact with what it was: out is whether it touches, which event, and when."""
    closes = room.weight[b] / h
    bounces = room.offset[b, 0] + closes < 0.0 < gap
    after = u[0] - room.offset[b, 0] - closes
    touches = gap + h * after <= (100.0 * TOUCH if was else TOUCH) * scale
    out[0], out[1], out[2] = 1.0 if touches else 0.0, -1.0, time + h
    if room.p[b, 0] > 0.0 and bounces and not touches and not was:
        out[1] = IMPACT
    elif touches and not was:
        out[1] = MADE
    elif was and not touches:
        out[1] = LOST


@small
def contact_events(scene, motion, room, blocks, h, time, events, numbers, count):
    """Record which contacts were made, lost or bounced; renew the list of contacts."""
    u, out = room.two, room.image
    k, C = scene.size, 0
    slots = room.slots
    for b in range(blocks):
        kind = room.origin[b, 0]
        if room.rows[b] > 0:
            continue
        i, g = room.origin[b, 1], room.origin[b, 2]
        slip_of(scene, room, b, motion.v, u)
        before = u[0] - room.offset[b, 0]
        slip_of(scene, room, b, room.new, u)
        if kind == 0:
            gap, was = room.gap[i, g], motion.touch[i, g]
            j = NONE
        else:
            slots[C] = b
            C += 1
            gap = room.near_gap[i]
            j, old = room.near[i, 1], room.near_old[i]
            was = old >= 0 and motion.flags[old, 1]
            i = room.near[i, 0]
        motion.sums[3] = max(motion.sums[3], -gap)
        touch_event(room, motion, b, was, gap, h, time, scene.scale, u, out)
        if out[1] >= 0.0:
            when = out[2]
            if out[1] != LOST and before < 0.0 and gap > 0.0:
                when = min(time + 0.5 * h + gap / -before, time + 1.5 * h)
            count = note(events, numbers, count, int(out[1]), i, j, g, when, room.p[b, 0])
        if kind == 0:
            motion.touch[i, g] = 1 if out[0] > 0.0 else 0
        else:
            room.origin[b, 3] = 1 if out[0] > 0.0 else 0
    if scene.pair_at == 0:
        return count
    old = motion.counts[0]
    size = 0
    for s in range(old):  # contacts whose bodies both sleep stay as they are
        pair = motion.keys[s] // scene.pair_gaps
        i, j = pair // scene.bodies, pair % scene.bodies
        if room.awake[i] or room.awake[j] or not (motion.alive[i] and motion.alive[j]):
            if motion.flags[s, 1] and not listed_again(scene, room, slots, C, motion.keys[s]):
                g = motion.keys[s] % scene.pair_gaps
                count = note(events, numbers, count, LOST, i, j, g, time + h, 0.0)
            continue
        motion.keys[size] = motion.keys[s]
        for a in range(3):
            motion.press[size, a] = motion.press[s, a]
        for a in range(2):
            motion.flags[size, a] = motion.flags[s, a]
        for a in range(2 * k):
            motion.shove[size, a] = motion.shove[s, a]
        size += 1
    for s in range(C):
        b = slots[s]
        motion.keys[size] = key_of(scene, room, room.origin[b, 1])
        motion.press[size, 0] = room.p[b, 0]
        motion.press[size, 1] = motion.press[size, 2] = 0.0
        motion.flags[size, 0] = 0
        for a in range(2 * k):
            motion.shove[size, a] = room.slant[b, 0, a] * room.p[b, 0]
        if scene.rub_table.shape[0] > 0:
            motion.press[size, 1], motion.press[size, 2] = room.p[b + 1, 0], room.p[b + 1, 1]
            motion.flags[size, 0] = 1 if holds(scene, room, b + 1, u) else 0
            shift = 0 if room.body[b + 1, 0] == room.body[b, 0] else k
            for r in range(2):
                for a in range(2 * k):
                    at = (a + shift) % (2 * k)
                    motion.shove[size, at] += room.slant[b + 1, r, a] * room.p[b + 1, r]
        motion.flags[size, 1] = room.origin[b, 3]
        size += 1
    motion.counts[0] = size
    sort_contacts(motion, size)
    return count


@small
def key_of(scene, room, slot):
    """Return the number under which a contact between bodies is kept."""
    a, b, g = room.near[slot, 0], room.near[slot, 1], room.near[slot, 2]
    return (a * scene.bodies + b) * scene.pair_gaps + g


@small
def listed_again(scene, room, slots, C, key):
    """Return whether a contact is in this step's list."""
    found = False
    for s in range(C):
        found = found or key_of(scene, room, room.origin[slots[s], 1]) == key
    return found


@small
def sort_contacts(motion, size):
    """Sort contacts by key, by insertion: they are nearly sorted already."""
    for s in range(1, size):
        t = s
        while t > 0 and motion.keys[t - 1] > motion.keys[t]:
            motion.keys[t - 1], motion.keys[t] = motion.keys[t], motion.keys[t - 1]
            for a in range(3):
                x = motion.press[t, a]
                motion.press[t, a] = motion.press[t - 1, a]
                motion.press[t - 1, a] = x
            for a in range(motion.shove.shape[1]):
                x = motion.shove[t, a]
                motion.shove[t, a] = motion.shove[t - 1, a]
                motion.shove[t - 1, a] = x
            for a in range(2):
                y = motion.flags[t, a]
                motion.flags[t, a] = motion.flags[t - 1, a]
                motion.flags[t - 1, a] = y
            t -= 1


@small
def collect(scene, motion, room, h, near):
    """Build the blocks of all bodies that are awake and of all contacts noted; return how many."""
    blocks = ZERO
    for i in range(scene.bodies):
        for c in range(scene.size):
            room.ahead[i, c] = room.qm[i, c] + h * motion.v[i, c]
    limit = watched_up_to(scene, room, h)
    for i in range(scene.bodies):
        if motion.alive[i] and room.awake[i]:
            blocks = body_blocks(scene, motion, room, i, h, limit, blocks)
    slots = room.slots
    for s in range(near):  # in the order of their numbers, whatever was met first
        slots[s] = key_of(scene, room, s) * near + s
    heap_sort(slots, near)
    first, second = NONE, NONE
    for s in range(near):
        slot = slots[s] % near
        if room.near[slot, 0] != first or room.near[slot, 1] != second:
            first, second = room.near[slot, 0], room.near[slot, 1]
            pair_gaps(scene, room, first, second, room.ahead)
            for g in range(scene.pair_gaps):
                room.pair_then[g] = room.work[scene.pair_reads.shape[0] + g]
        blocks = pair_blocks(scene, motion, room, slot, h, blocks)
    return blocks


@small
def solve(scene, motion, room, h, time, index):
    """Solve a step of the bodies that are awake and of those they wake.

    Return whether there was room for all contacts, and how many blocks there are.
    """
    near, blocks = ZERO, ZERO
    if scene.pair_at != 0:
        if stale(scene, motion, room, time) and not list_neighbours(scene, motion, room, time):
            return False, blocks
        for s in range(room.listed[0]):
            room.seen[s] = 0
    while True:
        if scene.pair_at != 0:
            near = watch(scene, motion, room, h, near)
            if near < 0:
                return False, blocks
        blocks = collect(scene, motion, room, h, near)
        islands(scene, room, blocks)
        solve_islands(scene, motion, room, blocks, h)
        keep_impulses(motion, room, blocks)
        if scene.pair_at == 0 or not gather_pulls(
            scene, motion, room, blocks, h, time + 0.5 * h, index
        ):
            break
        start_bodies(scene, motion, room)
    for i in range(scene.bodies):
        if room.size[i + 1] > room.size[i]:
            motion.sums[4] = max(motion.sums[4], room.error[i])
            motion.counts[2] += 1 if room.error[i] > scene.tolerance else 0
    return True, blocks


@small
def step_once(scene, motion, room, h, events, numbers, count):
    """Advance by one step; return whether there was room for all contacts, and the events."""
    k, N = scene.size, scene.bodies
    index = motion.counts[1]
    time = index * h
    blocks, busy = ZERO, rouse(scene, motion, room, h, time + 0.5 * h, index)
    start_bodies(scene, motion, room)
    if busy:
        enough, blocks = solve(scene, motion, room, h, time, index)
        if not enough:
            return False, count
    account(scene, motion, room, blocks, h)
    if busy:
        count = contact_events(scene, motion, room, blocks, h, time, events, numbers, count)
    keep_sticking(scene, motion, room, blocks)
    for i in range(N):
        room.seen_rest[i] = motion.rests[i]
    settle(scene, motion, room, h, index)
    for i in range(N):
        if not motion.alive[i]:
            continue
        if room.awake[i] and motion.rests[i] != room.seen_rest[i]:
            kind = REST if motion.rests[i] else MOTION
            when = time + h if motion.rests[i] else time
            count = note(events, numbers, count, kind, i, NONE, NONE, when, 0.0)
        for c in range(k):
            if room.awake[i]:
                motion.v[i, c] = room.new[i, c]
            motion.q[i, c] = room.qm[i, c] + 0.5 * h * motion.v[i, c]
        if scene.exit_place >= 0 and motion.q[i, scene.exit_place] > scene.exit_limit:
            motion.alive[i] = 0
            count = note(events, numbers, count, EXIT, i, NONE, NONE, time + h, 0.0)
            for s in range(motion.counts[0]):
                pair = motion.keys[s] // scene.pair_gaps
                if i in (pair // N, pair % N):
                    motion.due[pair // N] = motion.due[pair % N] = 0
                    motion.asleep[pair // N] = motion.asleep[pair % N] = 0
    motion.counts[1] = index + 1
    return True, count


@njit(cache=True, error_model="numpy")
def advance(scene, motion, room, h, steps, events, numbers):
    """Advance by several steps; return why it stopped, the steps done and the events recorded."""
    count = ZERO
    most = 2 * room.near.shape[0] + scene.bodies * (2 + scene.bounce.size)
    for done in range(steps):
        if count + most > events.shape[0]:
            return EVENTFUL, done, count
        enough, count = step_once(scene, motion, room, h, events, numbers, count)
        if not enough:
            room.listed[1] = 0
            return CROWDED, done, count
    index = motion.counts[1]
    for i in range(scene.bodies):
        if motion.alive[i] and motion.asleep[i] and motion.since[i] < index:
            ask(scene, motion, room, i, motion.pull, h, index * h, index)
    return DONE, steps, count

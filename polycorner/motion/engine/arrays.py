"""Arrays of the engine, each declared once: name, type, shape and meaning.

Allocation, the records that are handed to compiled code, checkpoints and growth follow from these
declarations.  Shapes are written in the letters of :class:`Sizes`; ``*`` is any length.
"""

from collections.abc import Mapping
from functools import cache
from math import prod
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from polycorner.motion.engine.sizes import Sizes

# Indices into `counts` and `sums` of the state; the dissipation by cause follows DISSIPATED.
CONTACTS, STEPS, UNSOLVED, SWEEPS, NEWTON_STEPS, ISLANDS, PARTS = range(7)
SUBSTRATE_WORK, APPLIED_WORK, NOISE_WORK, DRIVE_WORK, PENETRATION, RESIDUAL, DISSIPATED = range(7)

# Kinds of blocks: contacts with the surroundings, and contacts between bodies; limits and equations
# of ties, and their friction.
OWN_GAP, OWN_FRICTION, PAIR_GAP, PAIR_FRICTION, TIE_GAP, TIE_FRICTION, OWN_LIMIT = range(7)

# Of a form of ties: kernels of its rows, slips and forces, or 0; limits, rows, slips; whether its
# equations follow the time.
ROW_KERNEL, SLIP_KERNEL, FORCE_KERNEL, LIMITS, ROWS, SLIPS, DRIVEN = range(7)

# Stages of an island between solutions of a step: it has settled, is solved, or has to be again.
SETTLED, SOLVED, CHANGED = range(3)

# The velocity bound of a gap: as it is; an error so small that it may be left; raised by curvature.
PLAIN, SMALL, BENT = range(3)

# Of the strips of a crowd: their number; whether the first follows the last; whether friction that
# is apart from the contact that presses on it looks at its impulse; whether a contact bounces.
STRIPS, AROUND, WATCHED, BOUNCES = range(4)

# The slip at which friction is solved: that at the end of the step; the mean one; the mean one, of
# what stuck before; that at the end, where the bodies are then.
AT_END, AT_MEAN, HOLDS, STOPS = range(4)

# Of a contact that sticks, but may slip where the bodies are: at the start of a run, and after a
# step with the law `AT_END`.
LEFT_OVER = 2

# What follows if an island is not solved: nothing; shorter steps; halves of this part of a step.
LAST, DIVIDED, HALVED = range(3)

# Laws of impact, as in IMPACT_LAWS; where nothing bounces none is needed.
POISSON, NEWTON, STRONGE, UNPROJECTED, PLASTIC = range(5)

# Why compiled code returns.
DONE, CONTACTS_FULL, EVENTS_FULL, NOT_FINITE = range(4)


class Declaration(NamedTuple):
    """Type, shape and initial value of an array, or of a number if the shape is empty."""

    kind: type[np.float64] | type[np.int64]
    shape: str
    initial: float

    def extents(self, sizes: Sizes) -> tuple[int, ...]:
        """Return the shape; -1 stands for any length."""
        return tuple(_extent(token, sizes) for token in self.shape.split())


def _extent(token: str, sizes: Sizes) -> int:
    """Return the value of a sum of products such as ``2*k`` or ``N+1``."""
    if token == "*":
        return -1
    return sum(
        prod(
            int(factor) if factor.isdigit() else getattr(sizes, factor)
            for factor in term.split("*")
        )
        for term in token.split("+")
    )


def real(shape: str = "", initial: float = 0.0) -> Declaration:
    """Declare real numbers."""
    return Declaration(np.float64, shape, initial)


def whole(shape: str = "", initial: int = 0) -> Declaration:
    """Declare whole numbers: counts, indices, flags and addresses."""
    return Declaration(np.int64, shape, initial)


class Model(NamedTuple):
    """Model constants: what does not change during a simulation.

    Gaps, friction contacts and slips with the surroundings are numbered body after body.
    """

    bodies: Annotated[Any, whole()]  # N
    kinds: Annotated[Any, whole()]  # A
    kind: Annotated[Any, whole("N")]  # of each body
    dimension: Annotated[Any, whole()]  # k: coordinates of a body; bodies with fewer have zeros
    lanes: Annotated[Any, whole()]  # K: coordinates of a body, and zeros up to whole vectors
    coordinates: Annotated[Any, whole("A")]  # of a body of each kind
    force_kernel: Annotated[Any, whole("A")]  # address: upper triangle of M, F, applied, loads
    force_parameters: Annotated[Any, whole("A")]  # their first parameter
    first_slip_call: Annotated[Any, whole("A+1")]  # kernels of a body's slips; as those of its gaps
    slip_calls: Annotated[Any, whole("* 6")]
    slip_reads: Annotated[Any, whole("*")]  # coordinates, then velocities
    slip_places: Annotated[Any, whole("*")]
    slip_contacts: Annotated[Any, whole("*")]  # of each output, among those of its body, or -1
    contact_room: Annotated[Any, whole()]  # C: contacts between bodies for which there is room
    neighbour_room: Annotated[Any, whole()]  # P: pairs of neighbours
    event_room: Annotated[Any, whole()]  # events after which no step begins, nor a part of one
    parameters: Annotated[Any, real("*")]  # of all kernels
    loads: Annotated[Any, whole("A")]  # number of known loads of a body
    first_friction: Annotated[Any, whole("N+1")]  # of each body's friction contacts, among all
    slip_start: Annotated[Any, whole("F+1")]  # first slip row of each friction contact
    friction_sets: Annotated[Any, whole("F 2")]  # static and dynamic set
    pressing_gap: Annotated[Any, whole("F")]  # gap whose contact presses, or -1
    load_sources: Annotated[Any, whole("F L")]  # whether a known load presses
    friction_causes: Annotated[Any, whole("F")]  # cause under which its dissipation is booked
    friction_turns: Annotated[Any, whole("F")]  # whether its slip is asked for at the mean
    scatter: Annotated[Any, real("F")]  # relative scatter of the threshold from stop to stop
    scatter_least: Annotated[Any, real("F")]  # its least factor, that of the dynamic set
    set_kinds: Annotated[Any, whole("*")]
    set_sizes: Annotated[Any, real("* 4")]
    first_vertex: Annotated[Any, whole("*")]  # of each set, and one more
    vertices: Annotated[Any, real("* 2")]  # of polygons
    first_gap_call: Annotated[Any, whole("A+1")]  # kernels of a body's gaps
    gap_calls: Annotated[Any, whole("* 6")]  # address, sizes in and out; first read, row, parameter
    gap_reads: Annotated[Any, whole("*")]  # coordinates, call after call; k is the time
    timed: Annotated[Any, whole()]  # whether equations have the time: then its lane is k
    gap_places: Annotated[Any, whole("*")]  # gap of each output among those of its body, or -1
    first_gap: Annotated[Any, whole("N+1")]  # of each body's gaps, among all
    first_equation: Annotated[Any, whole("N")]  # of them that is an equation, as all further ones
    equations: Annotated[Any, whole()]  # their number, of all bodies
    impact: Annotated[Any, whole()]  # POISSON, ...
    restitution: Annotated[Any, real("U")]  # of contacts with surroundings
    families: Annotated[Any, whole()]  # J: of contacts between bodies; 0: none
    family: Annotated[Any, whole("A A")]  # of two bodies, by their kinds; -1: none
    pair_kernel: Annotated[Any, whole("J")]  # address: gaps of a pair
    pair_values: Annotated[Any, whole("J")]  # address: gaps without gradients
    pair_parameters: Annotated[Any, whole("J")]  # their first parameter
    first_read: Annotated[Any, whole("J+1")]  # of the coordinates that they read
    pair_reads: Annotated[Any, whole("* 2")]  # body 0 or 1, coordinate
    pair_gaps: Annotated[Any, whole("J")]  # number of gaps of a pair
    most_pair_gaps: Annotated[Any, whole()]  # G
    first_law: Annotated[Any, whole("J+1")]  # of the laws of friction at each of these
    first_pair_slip: Annotated[Any, whole("J")]
    # Address, whether bodies are exchanged, parameters, whether they are asked for at the mean.
    pair_slips: Annotated[Any, whole("* 4")]
    law_start: Annotated[Any, whole("H")]  # first slip row of each law, among those of its family
    law_rows: Annotated[Any, whole("H")]  # number of its slip rows
    pair_sets: Annotated[Any, whole("H 2")]  # static and dynamic set
    pair_causes: Annotated[Any, whole("H")]  # cause under which dissipation is booked
    pair_restitution: Annotated[Any, real("J")]
    attracts: Annotated[Any, whole()]  # whether any two bodies attract each other
    pair_attraction: Annotated[Any, real("J")]  # force where gaps are closed
    pair_range: Annotated[Any, real("J")]  # gap at which it vanishes; 0: there is none
    attraction_account: Annotated[Any, whole()]  # place of its work among the sums
    pair_reach: Annotated[Any, real("J")]  # distance of positions beyond which two cannot touch
    reach: Annotated[Any, real()]  # the largest of them
    position: Annotated[Any, whole("A 3")]  # coordinates that are a body's position, or -1
    period: Annotated[Any, real("3")]  # after which it repeats, as lengths, or inf
    units: Annotated[Any, real("A k")]  # length of a unit of each coordinate
    lever: Annotated[Any, real("A k")]  # how far a unit of each coordinate turns points of a body
    substrate_coordinate: Annotated[Any, whole("A")]  # along which the substrate moves
    substrate_speed: Annotated[Any, real()]  # along the first component of the position
    exit_coordinate: Annotated[Any, whole("A")]  # or -1
    exit_limit: Annotated[Any, real("A")]
    gap_unit: Annotated[Any, real()]  # length by which gaps are scaled
    chatter: Annotated[Any, real()]  # relative amplitude of the noise of known loads
    correlation_time: Annotated[Any, real()]  # for which one of its values holds
    kicks: Annotated[Any, real("A k")]  # intensities of random impulses
    kick_time: Annotated[Any, real()]  # for which a random force is held; 0: white noise
    seed: Annotated[Any, whole()]
    tolerance: Annotated[Any, real()]  # of residuals, relative to speeds
    sweeps: Annotated[Any, whole()]  # most Gauss-Seidel sweeps over an island
    refines: Annotated[Any, whole()]  # whether bodies take shorter steps where they need them
    touching: Annotated[Any, real()]  # lengths of `MotionOptions`
    parting: Annotated[Any, real()]
    zero_gap: Annotated[Any, real()]
    detection: Annotated[Any, real()]
    crowd_overlap: Annotated[Any, real()]
    bending: Annotated[Any, real()]  # its other numbers
    slow_bounce: Annotated[Any, real()]
    shortest_part: Annotated[Any, real()]
    dependent: Annotated[Any, real()]
    left_over: Annotated[Any, real()]
    near: Annotated[Any, real()]  # scaled travel in a step up to which a plastic impact is slow
    near_many: Annotated[Any, real()]  # the same for bodies in a crowd
    constant_mass: Annotated[Any, whole("A")]  # whether the mass matrix is constant
    follows_velocity: Annotated[Any, whole()]  # whether forces depend on the velocity
    time_parameter: Annotated[Any, whole("A")]  # position of the time among the parameters, or -1
    signal_kernel: Annotated[Any, whole("A")]  # address: parameters that follow the time, or 0
    signal_parameters: Annotated[Any, whole("A")]  # its first parameter
    follows_time: Annotated[Any, whole()]  # whether forces may change much from step to step
    start: Annotated[Any, real()]  # time of the first state
    step: Annotated[Any, real()]  # length of a whole step
    may_rest: Annotated[Any, whole()]  # whether surroundings alone can hold a body
    crowd_sweeps: Annotated[Any, whole()]  # sweeps over very large islands; 0: these are solved
    threads: Annotated[Any, whole()]
    give_way: Annotated[Any, whole()]  # address: lets other threads run; 0: nothing does
    ties: Annotated[Any, whole()]  # TJ
    tie_forms: Annotated[Any, whole("* 7")]  # ROW_KERNEL, ...
    tie_form: Annotated[Any, whole("TJ")]
    tie_bodies: Annotated[Any, whole("TJ 2")]  # the second is -1 for the world
    tie_parameters: Annotated[Any, whole("TJ")]  # first parameter
    tie_rows: Annotated[Any, whole("TJ+1")]  # first row of each: limits, then equations
    tie_names: Annotated[Any, whole("TU")]  # of rows: numbers in events, above those of gaps
    tie_restitution: Annotated[Any, real("TU")]
    tie_frictions: Annotated[Any, whole("TJ+1")]  # first friction of each
    tie_slip_start: Annotated[Any, whole("TX")]  # first slip of each friction, in its form
    tie_slip_rows: Annotated[Any, whole("TX")]
    tie_pressing: Annotated[Any, whole("TX")]  # row that presses, or -1
    tie_sets: Annotated[Any, whole("TX 2")]  # static and dynamic set
    tie_causes: Annotated[Any, whole("TX")]  # cause under which dissipation is booked
    tie_start: Annotated[Any, whole("N+1")]  # first tie of each body
    tie_sides: Annotated[Any, whole("*")]  # these: twice the tie, and 1 for its second body
    components: Annotated[Any, whole()]  # of bodies that hang together by ties
    component_bodies: Annotated[Any, whole("*")]  # first of each component, and one more
    component_body: Annotated[Any, whole("*")]
    component_ties: Annotated[Any, whole("*")]
    component_tie: Annotated[Any, whole("*")]
    component_closed: Annotated[Any, whole("*")]  # whether equations may follow from others
    still: Annotated[Any, whole("N")]  # whether nothing changes by itself for a body at rest
    apart_start: Annotated[Any, whole("N+1")]  # bodies with which each has no contact
    apart_from: Annotated[Any, whole("*")]
    limits: Annotated[Any, whole()]  # LU: on velocities, of all bodies, with their equations
    limit_kernel: Annotated[Any, whole("A")]  # address: of coordinates, velocities and the time
    limit_bends: Annotated[Any, whole("A")]  # the same with second derivatives; 0: all are affine
    first_limit: Annotated[Any, whole("N+1")]  # of each body's limits
    first_nonholonomic: Annotated[Any, whole("N")]  # of them that is an equation, as further ones
    limit_names: Annotated[Any, whole("LU")]  # numbers in events, as those of ties
    limit_accounts: Annotated[Any, whole("LU")]  # place of its work among the sums


class EngineState(NamedTuple):
    """State of the motion: together these arrays determine its future, bit for bit."""

    q: Annotated[Any, real("N k")]  # coordinates
    v: Annotated[Any, real("N k")]  # velocities
    sticks: Annotated[Any, whole("F")]  # whether friction with the surroundings sticks; LEFT_OVER
    stopped: Annotated[Any, whole("F")]  # step after which it came to stick; 0: the start
    friction: Annotated[Any, real("F 2")]  # its impulse
    normal: Annotated[Any, real("U")]  # normal impulses of contacts with the surroundings
    touches: Annotated[Any, whole("U")]  # whether they touch
    pressed: Annotated[Any, real("U")]  # normal impulse before the last
    release: Annotated[Any, real("U")]  # when it would vanish, as it fell last
    alive: Annotated[Any, whole("N", initial=1)]  # whether a body has not left
    rests: Annotated[Any, whole("N")]  # whether it has exactly the velocity of rest
    asleep: Annotated[Any, whole("N")]  # whether its rest is proved and it is not solved for
    pile: Annotated[Any, whole("N")]  # 1 + first of the bodies with which it fell asleep, or 0
    booked_friction: Annotated[Any, real("F 2")]  # friction impulses when work was booked last
    booked_applied: Annotated[Any, real("N k")]  # impulses of applied forces then
    check_due: Annotated[Any, whole("N")]  # step in which a sleeper is checked again
    booked_to: Annotated[Any, whole("N")]  # step up to which its work is booked
    neighbour_impulse: Annotated[Any, real("N k")]  # generalised impulses from other bodies
    rank: Annotated[Any, whole("N")]  # of a body in the order in which contacts are listed
    body_of_rank: Annotated[Any, whole("N")]
    keys: Annotated[Any, whole("C")]  # contacts between bodies, in ascending order
    pair_impulse: Annotated[Any, real("C T+1")]  # their impulses: normal, friction law after law
    pair_release: Annotated[Any, real("C")]  # when the normal impulse would vanish
    pair_action: Annotated[Any, real("C 2*k")]  # generalised impulses on both bodies
    pair_flags: Annotated[Any, whole("C 2")]  # laws that stick, as bits; whether they touch
    # Bodies that need shorter steps: the first of those with which they do, plus N for a crowd.
    cluster: Annotated[Any, whole("N", initial=-1)]
    elapsed: Annotated[Any, real("N")]  # how much of the step these have done
    watched: Annotated[Any, whole("N")]  # whether the way to the next midpoint was examined
    counts: Annotated[Any, whole("8")]
    sums: Annotated[Any, real("D+6")]
    tie_normal: Annotated[Any, real("TU")]  # of ties what `normal`, `touches`, ... are of a body
    tie_touches: Annotated[Any, whole("TU")]
    tie_pressed: Annotated[Any, real("TU")]
    tie_release: Annotated[Any, real("TU")]
    tie_friction: Annotated[Any, real("TX 2")]
    tie_sticks: Annotated[Any, whole("TX")]
    limit_acts: Annotated[Any, whole("LU")]  # whether a limit on velocities acts
    limit_force: Annotated[Any, real("LU")]  # its multiplier, times a whole step
    limit_before: Annotated[Any, real("LU")]  # the same before the last step
    limit_release: Annotated[Any, real("LU")]  # when it would vanish, as it fell last


class MannerWork(NamedTuple):
    """How the present step, or part of one, is solved."""

    near: Annotated[Any, real("1")]  # which of the two distances holds for the bodies at hand
    located: Annotated[Any, whole("1")]  # whether contacts act only where bodies are
    remedy: Annotated[Any, whole("1")]  # for islands that are not solved: LAST, DIVIDED or HALVED


class MidpointWork(NamedTuple):
    """Bodies at the midpoint of the step."""

    q: Annotated[Any, real("N k")]  # coordinates at the midpoint of the step
    force: Annotated[Any, real("N k")]  # impulse of all forces in the step
    applied: Annotated[Any, real("N k")]  # that of the applied forces among them
    kick: Annotated[Any, real("N k")]  # random impulse
    attraction: Annotated[Any, real("N k")]  # impulse of the attraction by other bodies
    inverse_mass: Annotated[Any, real("N k K")]
    slip_rows: Annotated[Any, real("R K")]  # Jacobian of the slip velocities
    slip_offset: Annotated[Any, real("R")]  # slip velocity at zero velocity
    slip_known: Annotated[Any, whole("R")]  # whether these were evaluated in this step
    slip_wanted: Annotated[Any, whole("F")]  # whether those of a friction contact are asked for
    load: Annotated[Any, real("F")]  # known normal impulse
    gap: Annotated[Any, real("U", initial=np.inf)]
    gradient: Annotated[Any, real("U K")]  # of the gaps
    mass: Annotated[Any, real("N k K")]


class LimitWork(NamedTuple):
    """Limits on velocities in the step."""

    time: Annotated[Any, real("1")]  # of the midpoint
    wanted: Annotated[Any, whole("LU")]  # whether one that did not act would be passed
    block_of: Annotated[Any, whole("LU")]  # block of each, or -1
    landing: Annotated[Any, real("N K")]  # where an impact projects a velocity onto a limit
    row: Annotated[Any, real("LU K")]  # gradient by scaled velocities, of length 1
    holds: Annotated[Any, whole("LU")]  # whether one that acts lets a body be at rest, and no less


class VelocityWork(NamedTuple):
    """Velocities of bodies in the step."""

    old: Annotated[Any, real("N K")]  # velocities before the step
    free: Annotated[Any, real("N K")]  # velocities after forces alone
    new: Annotated[Any, real("N K")]  # velocities after the step
    rest: Annotated[Any, real("N K")]  # velocities of bodies at which they would be at rest
    forced: Annotated[Any, real("N K")]  # `free` of the step, while an impact expands


class BodyWork(NamedTuple):
    """The condition of bodies in the step."""

    waits: Annotated[Any, whole("N")]  # whether a body is left as it is for the time being
    awake: Annotated[Any, whole("N")]
    apart: Annotated[Any, whole("N")]  # whether surroundings are known to be far from a body
    touched: Annotated[Any, whole("N")]  # 0: by nothing; 1: by surroundings only; 2: by bodies
    evaluated: Annotated[Any, whole("N")]  # whether forces are those of this step
    speed: Annotated[Any, real("N")]
    island_speed: Annotated[Any, real("N")]  # largest velocity in the body's island
    v_mean: Annotated[Any, real("N k")]  # mean velocities of the step
    former_force: Annotated[Any, real("N k")]  # forces with the mean velocities before


class AheadWork(NamedTuple):
    """Bodies at the next midpoint, as predicted."""

    q: Annotated[Any, real("N k")]  # prediction for the next midpoint
    gap: Annotated[Any, real("U")]  # gaps there
    gradient: Annotated[Any, real("U K")]


class PathWork(NamedTuple):
    """A body at a place on its way."""

    q: Annotated[Any, real("N k")]  # coordinates on the way
    gap: Annotated[Any, real("U")]  # gaps there
    gradient: Annotated[Any, real("U K")]


class SleepWork(NamedTuple):
    """What keeps bodies at rest, and wakes them."""

    neighbour_impulse: Annotated[Any, real("N k")]
    disturbed: Annotated[Any, whole("N")]  # whether a sleeper's contacts changed
    proof_friction: Annotated[Any, real("F 2")]  # impulses that prove rest
    proof_normal: Annotated[Any, real("U")]
    rested: Annotated[Any, whole("N")]  # `EngineState.rests` before the step


class IslandWork(NamedTuple):
    """Islands of touching bodies, each told by the body that represents it."""

    joined: Annotated[Any, whole("N")]  # union-find forest of bodies that need shorter steps
    residual: Annotated[Any, real("N")]  # of the island that a body represents
    proved: Annotated[Any, whole("N")]  # whether the velocity zero is known to solve its step
    stage: Annotated[Any, whole("N")]  # of the island that a body represents: SETTLED, ...
    curves_shut: Annotated[Any, whole("N")]  # whether its gaps would close by curvature
    sunk: Annotated[Any, whole("N")]  # of a crowd: block of a contact that is sunk in, or -1
    parent: Annotated[Any, whole("N")]  # in the union-find forest
    start: Annotated[Any, whole("N+1")]  # in `BlockWork.order`, for the body that represents it
    cursor: Annotated[Any, whole("N+1")]
    unsorted: Annotated[Any, whole("B")]  # what is to be ordered by strips


class NeighbourWork(NamedTuple):
    """Pairs of bodies that may meet within some steps."""

    column: Annotated[Any, whole("N")]  # of a body that is searched for neighbours
    ordered: Annotated[Any, whole("N")]  # bodies by columns and along them, as listed last
    pairs: Annotated[Any, whole("P 2")]
    status: Annotated[Any, whole("3")]  # numbers of neighbours; whether valid; of contacts
    examined: Annotated[Any, whole("P")]  # whether a pair was examined in this step
    least_gap: Annotated[Any, real("P")]  # of a pair at the midpoint; 0: not known
    position: Annotated[Any, real("N 3")]  # positions when the list was made
    travel: Annotated[Any, real("1")]  # how far bodies may move in a step, as listed
    meets: Annotated[Any, whole("P")]  # how many small gaps of a pair were counted


class PairWork(NamedTuple):
    """Contacts between bodies in the step."""

    contact: Annotated[Any, whole("C 3")]  # body, body, gap
    gap: Annotated[Any, real("C")]
    before: Annotated[Any, whole("C")]  # index in the list of the last step, or -1
    impulse: Annotated[Any, real("C T+1")]  # initial impulses
    attraction: Annotated[Any, real("C")]  # its magnitude in the step
    gradient: Annotated[Any, real("C 2*K")]
    sort_keys: Annotated[Any, whole("S")]
    ranked: Annotated[Any, whole("C")]  # contacts between bodies by key
    first_block: Annotated[Any, whole("C")]  # where the blocks of each begin, by key
    block_of: Annotated[Any, whole("C")]  # block of each, or -1
    met: Annotated[Any, whole("C")]  # whether a contact of the last step is found in this one


class TieWork(NamedTuple):
    """Ties of bodies in the step."""

    time: Annotated[Any, real("1")]  # of the midpoint
    gap: Annotated[Any, real("TU")]  # limits and equations at the midpoint
    rate: Annotated[Any, real("TU")]  # their derivatives by the time
    gradient: Annotated[Any, real("TU 2*K")]
    block_of: Annotated[Any, whole("TU")]  # block of each, or -1
    force: Annotated[Any, real("TJ 2*k")]  # impulses of all forces on both bodies in the step
    applied: Annotated[Any, real("TJ 2*k")]  # those of the applied forces among them
    load: Annotated[Any, real("TX")]  # known normal impulse
    kept: Annotated[Any, whole("TU", initial=1)]  # whether a row does not follow from others
    basis: Annotated[Any, real("RC")]  # gradients of a component, orthonormal with M^-1
    answer: Annotated[Any, real("RC")]  # M^-1 times these


class BlockWork(NamedTuple):
    """Blocks of the step: what acts on bodies, and how."""

    bodies: Annotated[Any, whole("B 2")]  # the second is -1 for the surroundings
    rows: Annotated[Any, whole("B")]  # rows of friction; 0 for a unilateral contact
    bilateral: Annotated[Any, whole("B")]  # whether a block is an equation
    pressing: Annotated[Any, whole("B")]  # block of the contact that presses, or -1
    set: Annotated[Any, whole("B")]  # set of admissible friction
    origin: Annotated[Any, whole("B 4")]  # kind, body or contact, gap or friction; touches
    load: Annotated[Any, real("B")]  # known load; how much curvature closes a gap; |J| of a limit
    bound: Annotated[Any, whole("B")]  # of a gap: PLAIN, SMALL or BENT
    offset: Annotated[Any, real("B 2")]  # d of the row velocities u = J v + d
    target: Annotated[Any, real("B 2")]  # c of friction, whose law reads u - c
    law: Annotated[Any, whole("B")]  # AT_END, ...; of a gap AT_MEAN if it was open or bounces
    before: Annotated[Any, real("B 2")]  # J v before the step
    free: Annotated[Any, real("B 2")]  # J v after forces alone
    after: Annotated[Any, real("B 2")]  # u after the step, as of the last residual
    jacobian: Annotated[Any, real("B 2 2*K")]  # J: K numbers for each of two bodies
    response: Annotated[Any, real("B 2 2*K")]  # M^-1 J'
    delassus: Annotated[Any, real("B 5")]  # W = J M^-1 J': W00, W01, W11; rho = 1 / norm; norm
    impulse: Annotated[Any, real("B 2")]
    order: Annotated[Any, whole("B")]  # blocks, island after island
    bounces: Annotated[Any, whole("B")]  # whether a contact bounces
    returned: Annotated[Any, real("B")]  # normal impulse that is given back in an expansion
    compressed: Annotated[
        Any, real("B 2")
    ]  # impulses of an impact up to the end of its compression
    expanded: Annotated[Any, real("B 2")]  # all impulses of an impact
    entry: Annotated[Any, whole("B")]  # of a block's two bodies, or -1


class EventWork(NamedTuple):
    """What happened to the contacts of blocks in the step."""

    release: Annotated[Any, real("B")]  # when its normal impulse would vanish
    happened: Annotated[Any, whole("B")]  # event of a block, or -1
    time: Annotated[Any, real("B")]


class SearchWork(NamedTuple):
    """Iterates of the solution of islands, block by block."""

    reversed: Annotated[Any, whole("B")]  # whether slip changed direction in this step
    best: Annotated[Any, real("B 2")]  # impulses of the least residual; Newton direction
    initial: Annotated[Any, real("B 2")]  # impulses before an equilibrium was sought
    rigid: Annotated[Any, real("B 2")]  # impulses, bounds or targets before an attempt
    loaded: Annotated[Any, real("B 2")]  # impulses for known loads
    carries: Annotated[Any, real("B")]  # whether a block can carry load at rest
    derivative: Annotated[Any, real("B 9")]  # G, for the contact that presses and the block's rows
    projection: Annotated[Any, real("B 6")]  # of the natural map, and its derivative by rows
    constant: Annotated[Any, real("B 2")]  # a of the Newton step dp = a - G J dv
    along: Annotated[Any, real("B")]  # J dv of a block's first row
    schur_row: Annotated[Any, real("B 2*K")]  # normal after elimination of friction
    load_slope: Annotated[Any, real("B 2")]  # change of friction with its load


class GraphWork(NamedTuple):
    """Graph of the bodies of an island, from which one after the other is eliminated."""

    listed: Annotated[Any, whole("N")]  # bodies of an island before they are ordered
    degree: Annotated[Any, whole("N")]  # of each: how many neighbours are left
    first_of_degree: Annotated[Any, whole("N")]  # one of those of each degree
    queue: Annotated[Any, whole("N 2")]  # those before and after it
    first_neighbour: Annotated[Any, whole("N")]  # link to a neighbour
    link: Annotated[Any, whole("2*Q+1 2")]  # neighbour, next link
    link_status: Annotated[Any, whole("2")]  # first link that is free, number of links used
    mark: Annotated[Any, whole("N")]  # the vertex by which one was seen last


class MatrixWork(NamedTuple):
    """Matrix of an island, and the order of its bodies."""

    members: Annotated[Any, whole("N")]  # bodies of an island
    number: Annotated[Any, whole("N")]  # number of a body in its island
    place: Annotated[Any, whole("N")]  # in the order of elimination
    row_start: Annotated[Any, whole("N+1")]  # first entry of each row
    columns: Annotated[Any, whole("Q+1")]  # of entries
    vector: Annotated[Any, real("N*K")]
    entries: Annotated[Any, real("M")]  # of an island, block by block


class CrowdWork(NamedTuple):
    """Contacts of crowds in compact form, and the strips that they are divided into."""

    shift: Annotated[Any, real("N K")]  # by which bodies of crowds move apart
    mass_root: Annotated[Any, real("N k K")]  # U of M^-1 = U U'
    unit_velocity: Annotated[Any, real("N K")]  # w of the velocities v_free + U w
    unit_shift: Annotated[Any, real("N K")]  # by which bodies move apart, in coordinates w
    contact: Annotated[Any, whole("B 4")]  # contacts of a crowd: FIRST, ...
    numbers: Annotated[Any, real("B 8")]  # NORMAL, ...
    across: Annotated[Any, real("B 5")]  # ACROSS, ...
    rows: Annotated[Any, real("B 2 2*K")]  # J U of the normal, and of the slip
    across_rows: Annotated[Any, real("B 2*K")]  # the same of the slip across
    order: Annotated[Any, whole("B")]  # twice a block, and whether friction follows
    strips: Annotated[Any, whole("4")]  # STRIPS, ...
    body_strip: Annotated[Any, whole("N")]  # strip of a body
    strip: Annotated[Any, whole("B")]  # of what is sorted
    strip_start: Annotated[Any, whole("Z+1")]  # in `order`
    strip_cursor: Annotated[Any, whole("Z")]


class SharedWork(NamedTuple):
    """What threads tell each other."""

    found: Annotated[Any, whole("V")]  # contacts that an item finds; from where on it adds them
    booked: Annotated[Any, real("V D+6")]  # `EngineState.sums` of an item
    finite: Annotated[Any, whole("1")]  # whether velocities and gaps are numbers
    worst: Annotated[Any, real("Z")]  # residuals of parts of an island
    gained: Annotated[Any, real("Z")]  # work of the contacts of these
    sunk: Annotated[Any, whole("Z")]  # block of a contact of these that is sunk in, or -1
    signals: Annotated[Any, whole("32")]  # TICKET, ...
    told: Annotated[Any, whole("8")]  # KIND, ...
    times: Annotated[Any, real("5")]  # LENGTH, ...
    to_solve: Annotated[Any, whole("N")]  # bodies that represent islands


class ScratchWork(NamedTuple):
    """What is in the making."""

    values: Annotated[Any, real("W")]  # arguments and results of kernels
    pair_gap: Annotated[Any, real("G")]
    wanted: Annotated[Any, real("G")]  # which gaps of a pair are wanted; all are zero in between
    told: Annotated[Any, real("64")]  # to kernels of pairs, and by them to later calls
    way_gap: Annotated[Any, real("6 Y")]  # gaps of a body or of two, at places on the way
    way_rate: Annotated[Any, real("6 Y")]  # their rates
    own_block: Annotated[Any, whole("m")]  # block of each gap of the body at hand, or -1
    equation_rows: Annotated[Any, real("m k")]  # their gradients, made orthonormal with M^-1
    matrix: Annotated[Any, real("k k")]
    vector: Annotated[Any, real("k")]
    rest_velocity: Annotated[Any, real("k")]
    slip: Annotated[Any, real("2")]
    image: Annotated[Any, real("12")]  # of a projection or barrier, with derivatives


class Work(NamedTuple):
    """Workspace of a step, by the stages that share it.

    Threads share it, but for what is in the making: see `OWN`.
    """

    manner: MannerWork
    mid: MidpointWork
    velocity: VelocityWork
    body: BodyWork
    ahead: AheadWork
    path: PathWork
    sleep: SleepWork
    island: IslandWork
    neighbours: NeighbourWork
    pair: PairWork
    tie: TieWork
    limit: LimitWork
    block: BlockWork
    event: EventWork
    search: SearchWork
    graph: GraphWork
    matrix: MatrixWork
    crowd: CrowdWork
    shared: SharedWork
    scratch: ScratchWork


# What is in the making: every thread has records of its own.
OWN = ("graph", "matrix", "scratch")


class Log(NamedTuple):
    """Events of the steps that one call does."""

    entries: Annotated[Any, whole("E 4")]  # kind, bodies (-1: none), contact (-1: none)
    numbers: Annotated[Any, real("E 2")]  # time, impulse


def declarations(record: Any) -> Mapping[str, Declaration]:
    """Return the declarations of the arrays of a record, or of all records of a class."""
    return _declared(record if isinstance(record, type) else type(record))


@cache
def _declared(kind: type) -> Mapping[str, Declaration]:
    hints = get_type_hints(kind, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items()}

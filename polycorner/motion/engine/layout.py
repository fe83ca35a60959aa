"""Bodies and their contacts as model constants of the compiled code."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.bundles import Call
from polycorner.formulas.families import Family
from polycorner.motion.bodies import IMPACT_LAWS, IdenticalBodies, MovingBodies, MovingBody
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.engine.allocation import filled
from polycorner.motion.engine.arrays import DISSIPATED, PLASTIC, Model
from polycorner.motion.engine.sizes import EVENTS, Sizes
from polycorner.motion.engine.threads import address_of_yield
from polycorner.motion.formulation import moment
from polycorner.motion.noise import MotionOptions, Noise, Solver
from polycorner.spaces.manifold import Array

MANY = 32  # bodies beyond which all are a crowd: parts of a step cost a look at each body
# Of the options: lengths, which are scaled by the unit of gaps, and others.
LENGTHS = ("touching", "parting", "zero_gap", "detection", "crowd_overlap")
SHARES = ("bending", "slow_bounce", "shortest_part", "dependent", "left_over")


def model_of(
    bodies: MovingBodies,
    sizes: Sizes,
    noise: Noise,
    solver: Solver,
    start: float,
    step: float,
) -> Model:
    """Return the model constants of bodies in motion."""
    options, sets, parameters = solver.options, _Sets(), list[float]()
    dependence = [_dependence(kind.body) for kind in bodies.kinds]
    laws = [kind.body.formulation for kind in bodies.kinds]
    if solver.crowd_sweeps and bodies.ties.bodies:
        msg = (
            "solver: expected crowd_sweeps=0 for bodies with ties, which few sweeps would leave "
            f"open; got {solver.crowd_sweeps}"
        )
        raise NotImplementedError(msg)
    if solver.crowd_sweeps and any(
        kind.body.equations and not known["constant_mass"]
        for kind, known in zip(bodies.kinds, dependence, strict=True)
    ):
        msg = (
            f"solver: expected crowd_sweeps=0 for bodies that turn in space and are no balls, or "
            f"obey equations and have a mass matrix that varies: sweeps do not follow their "
            f"rotation; got {solver.crowd_sweeps}"
        )
        raise NotImplementedError(msg)
    if solver.crowd_sweeps and bodies.limit_names:
        msg = (
            "solver: expected crowd_sweeps=0 for bodies with limits on velocities, which few "
            f"sweeps would not keep; got {solver.crowd_sweeps}"
        )
        raise NotImplementedError(msg)
    units, kicks = np.ones((sizes.A, sizes.k)), np.zeros((sizes.A, sizes.k))
    lever = np.zeros((sizes.A, sizes.k))
    for a, kind in enumerate(bodies.kinds):
        names = kind.body.formulation.coordinates
        units[a, : kind.dimension] = kind.body.units
        lever[a, : len(kind.body.lever)] = kind.body.lever
        kicks[a, : kind.dimension] = [noise.kicks.get(name, 0.0) for name in names]
    values = {
        "bodies": sizes.N,
        "kinds": sizes.A,
        "kind": bodies.kind_of,
        "dimension": sizes.k,
        "lanes": sizes.K,
        **dict.fromkeys(("contact_room", "neighbour_room"), 0),  # not yet known
        "event_room": EVENTS,
        "coordinates": [kind.dimension for kind in bodies.kinds],
        "force_kernel": [law.forces.kernel.compiled(0).point for law in laws],
        "loads": [law.loads for law in laws],
        "position": [kind.axes for kind in bodies.kinds],
        "substrate_coordinate": [kind.position[0] for kind in bodies.kinds],
        "exit_coordinate": [kind.exit_coordinate for kind in bodies.kinds],
        "exit_limit": [kind.exit_limit for kind in bodies.kinds],
        "constant_mass": [known["constant_mass"] for known in dependence],
        "follows_velocity": any(known["follows_velocity"] for known in dependence)
        or any(form.damped for form in bodies.ties.forms)
        or bool(bodies.limit_names),
        "units": units,
        "lever": lever,
        "kicks": kicks,
        "period": (*bodies.period, np.inf)[:3],
        "substrate_speed": bodies.substrate_speed,
        "timed": any(kind.body.timed for kind in bodies.kinds),
        "equations": sum(kind.count * kind.body.equations for kind in bodies.kinds),
        "gap_unit": bodies.gap_unit,
        "chatter": noise.chatter,
        "correlation_time": noise.correlation_time,
        "kick_time": noise.kick_time,
        "seed": noise.seed,
        "tolerance": solver.tolerance,
        "sweeps": solver.sweeps,
        "refines": solver.refine,
        "impact": IMPACT_LAWS.index(bodies.impact) if bodies.bounces else PLASTIC,
        "crowd_sweeps": solver.crowd_sweeps,
        "threads": solver.threads,
        "give_way": address_of_yield(),
        # What is driven never rests for good, and a velocity of rest would be one of an instant.
        "may_rest": (any(_may_rest(kind) for kind in bodies.kinds) or bool(bodies.ties.bodies))
        and not any(
            kind.body.timed or (kind.body.limits and kind.body.limits.timed)
            for kind in bodies.kinds
        ),
        "follows_time": any(
            law.time_parameter >= 0 and not kind.body.slow_signals
            for kind, law in zip(bodies.kinds, laws, strict=True)
        ),
        **{name: getattr(options, name) for name in SHARES},
        **{name: getattr(options, name) * bodies.gap_unit for name in LENGTHS},
        **_attractions(bodies, options),
        **_scatter(bodies, noise),
        **_near(bodies, noise, options),
        "start": start,
        "step": step,
        **_surroundings(bodies, sets, sizes),
        **_kernels(bodies, parameters, sizes.k),
        **_pairs(bodies, parameters, sets),
        **_ties(bodies, parameters, sets),
        **_limits(bodies),
        **_components(bodies, noise),
        **sets.values(),
    }
    return filled(Model, sizes, {**values, "parameters": [*parameters, 0.0]})


def _may_rest(kind: IdenticalBodies) -> bool:
    """Return whether surroundings alone can hold a body of a kind."""
    rows = sum(contact.rows for contact in kind.body.friction) + len(kind.body.limit_names)
    return len(kind.body.contacts) + rows >= kind.dimension


def _near(bodies: MovingBodies, noise: Noise, options: MotionOptions) -> dict[str, float]:
    """Return the scaled travel in a step up to which a plastic impact is slow, and in a crowd."""
    kicked = any(noise.kicks.values())
    near = many = options.slow_travel_kicked if kicked else options.slow_travel
    if bodies.families:
        least = min(family.reach for family in bodies.families.values())
        many = max(near, options.crowd_travel * least / bodies.gap_unit)
        near = near if bodies.total <= MANY else many
    return {"near": near, "near_many": many}


def _attractions(bodies: MovingBodies, options: MotionOptions) -> dict[str, Any]:
    """Return the entries of attraction; contacts are looked for up to its range."""
    families = [*bodies.families.values()]
    ranges = [one.range for one in families]
    return {
        "attracts": bodies.attracts,
        "pair_attraction": [one.attraction.force if one.attraction else 0.0 for one in families],
        "pair_range": ranges,
        "attraction_account": DISSIPATED + len(bodies.causes) + len(bodies.limit_names),
        "detection": max(options.detection * bodies.gap_unit, *ranges, 0.0),
    }


def _scatter(bodies: MovingBodies, noise: Noise) -> dict[str, Any]:
    """Return the entries of thresholds that scatter, of friction under known loads."""
    every = [c for kind in bodies.kinds for _ in range(kind.count) for c in kind.body.friction]
    widths = [noise.scatter.get(c.cause, 0.0) if c.gap < 0 else 0.0 for c in every]
    return {
        "scatter": [math.sqrt(math.log1p(width**2)) for width in widths],
        "scatter_least": [
            float(np.max(c.static.gauge(c.dynamic.tips))) if width > 0 else 0.0
            for c, width in zip(every, widths, strict=True)
        ],
    }


def _dependence(body: MovingBody) -> dict[str, bool]:
    """Return whether masses and forces depend on the state, by comparison at random states."""
    k = len(body.formulation.coordinates)
    draws = np.random.default_rng(0).normal(size=(3, 3, k))
    slow, *others = (moment(body.formulation, body.parameters, q, v) for q, v, _ in draws)
    fast = [moment(body.formulation, body.parameters, q, v) for q, _, v in draws]
    same = all(
        np.array_equal(one.force, other.force)
        for one, other in zip((slow, *others), fast, strict=True)
    )
    return {
        "constant_mass": all(np.array_equal(slow.mass, other.mass) for other in others),
        "follows_velocity": not same,
    }


def _surroundings(bodies: MovingBodies, sets: "_Sets", sizes: Sizes) -> dict[str, Any]:
    """Return the entries of contacts and friction between bodies and their surroundings."""
    gaps, frictions, rows = [0], [0], [0]
    equations: list[int] = []
    friction: list[tuple[int, int, int]] = []  # of all bodies: sets, and cause
    pressing: list[int] = []
    sources: list[Array] = []
    turns: list[NDArray[np.bool_]] = []
    for kind in bodies.kinds:
        contacts, m = kind.body.friction, len(kind.body.contacts)
        each = [
            (sets.add(c.static), sets.add(c.dynamic), bodies.causes.index(c.cause))
            for c in contacts
        ]
        source = np.zeros((len(contacts), sizes.L))
        for row, contact in zip(source, contacts, strict=True):
            row[list(contact.loads)] = 1
        friction += kind.count * each
        sources += kind.count * [source]
        turns += kind.count * [_turns(kind.body)]
        for _ in range(kind.count):
            pressing += [gaps[-1] + c.gap if c.gap >= 0 else -1 for c in contacts]
            rows += [c.rows for c in contacts]
            gaps.append(gaps[-1] + m)
            equations.append(gaps[-1] - kind.body.equations)
            frictions.append(frictions[-1] + len(contacts))
    known = np.array(friction, dtype=np.int64).reshape(-1, 3)
    return {
        "first_gap": gaps,
        "first_equation": equations,
        "restitution": np.concatenate(
            [np.tile(kind.body.restitution, kind.count) for kind in bodies.kinds]
        ),
        "first_friction": frictions,
        "slip_start": np.cumsum(rows),
        "friction_sets": known[:, :2],
        "friction_causes": known[:, 2],
        "friction_turns": np.concatenate(turns),
        "pressing_gap": pressing,
        "load_sources": np.concatenate(sources),
    }


def _turns(body: MovingBody) -> NDArray[np.bool_]:
    """Return of each friction contact whether its slip is asked for at the mean of a step."""
    contacts, law = body.friction, body.formulation
    of_row = [c for c, contact in enumerate(contacts) for _ in range(contact.rows)]
    found = np.full(len(contacts), not law.is_paced)
    for call in law.further:
        found[[of_row[row] for row in call.rows]] = False
    return found


def _kernels(bodies: MovingBodies, parameters: list[float], width: int) -> dict[str, Any]:
    """Return the entries of the kernels of all kinds; their parameters are appended."""
    found: dict[str, list[int]] = {
        name: []
        for name in ("force_parameters", "time_parameter", "signal_kernel", "signal_parameters")
    }
    slips, gaps, rubbing = _Calls("slip"), _Calls("gap"), list[int]()
    for kind in bodies.kinds:
        body, law, first = kind.body, kind.body.formulation, len(parameters)
        parameters += body.parameters.tolist()
        at = law.time_parameter
        found["force_parameters"].append(first)
        found["time_parameter"].append(first + at if at >= 0 else -1)
        found["signal_parameters"].append(len(parameters))
        signals = body.signals
        found["signal_kernel"].append(0 if signals is None else signals.kernel.compiled(0).point)
        parameters += body.signal_parameters.tolist()
        # Kernels read velocities after all coordinates for which there is room.
        shift = width - kind.dimension
        places = [c if c < kind.dimension else c + shift for c in range(2 * kind.dimension)]
        slips.add(law.slip_calls, parameters, places, law.slip, first)
        gaps.add(body.gaps, parameters, places)
        of_row = [c for c, contact in enumerate(body.friction) for _ in range(contact.rows)]
        rubbing += [of_row[r] if r >= 0 else -1 for r in slips.places[len(rubbing) :]]
    return {**found, **slips.values(), **gaps.values(), "slip_contacts": [*rubbing, 0]}


class _Calls:
    """The kernels of gaps or slips, kind after kind."""

    def __init__(self, what: str) -> None:
        self.what, self.first = what, [0]
        self.table: list[tuple[int, ...]] = []
        self.reads: list[int] = []
        self.places: list[int] = []

    def add(
        self,
        calls: Sequence[Call],
        parameters: list[float],
        places: Sequence[int],
        own: Family | None = None,
        start: int = 0,
    ) -> None:
        """Add the calls of a kind; their parameters are appended.

        Those of the family ``own`` begin at ``start``.
        """
        for call in calls:
            kernel = call.family.kernel
            if len(set(call.columns)) != len(call.columns):
                msg = "polyhedron: expected each gap once; got one that occurs twice"
                raise ValueError(msg)
            row_of = dict(zip(call.columns, call.rows, strict=True))
            entry = (kernel.compiled(1).point, kernel.variables, kernel.outputs)
            first = start if call.family is own else len(parameters)
            self.table.append((*entry, len(self.reads), len(self.places), first))
            self.reads += [places[c] for c in call.reads]
            self.places += [row_of.get(column, -1) for column in range(kernel.outputs)]
            parameters += call.parameters.tolist()
        self.first.append(len(self.table))

    def values(self) -> dict[str, Any]:
        """Return the entries."""
        return {
            f"first_{self.what}_call": self.first,
            f"{self.what}_calls": self.table,
            f"{self.what}_reads": [*self.reads, 0],
            f"{self.what}_places": [*self.places, 0],
        }


def _pairs(bodies: MovingBodies, parameters: list[float], sets: "_Sets") -> dict[str, Any]:
    """Return the entries of the contacts between bodies; their parameters are appended."""
    families = [*bodies.families.values()]
    family = np.full((len(bodies.kinds), len(bodies.kinds)), -1)
    for number, (a, b) in enumerate(bodies.families):
        family[a, b] = family[b, a] = number
    first: list[int] = []
    slips: list[tuple[int, bool, int, bool]] = []
    first_slip: list[int] = []
    for one in families:
        first.append(len(parameters))
        parameters += one.parameters
        first_slip.append(len(slips))
        for slip, exchanged, values in one.slips:
            # Those of hulls are no formulas: they choose what they are the slips of.
            turns = isinstance(slip, Family)
            slips.append((slip.kernel.compiled(1).point, exchanged, len(parameters), turns))
            parameters += values
    laws = [law for one in families for law in one.laws]
    starts = [np.cumsum([0, *(law.rows for law in one.laws)])[:-1] for one in families]
    reach = [one.reach + one.range / bodies.gap_unit for one in families]
    return {
        "families": len(families),
        "family": family,
        "pair_kernel": [one.gaps.kernel.compiled(1).point for one in families],
        "pair_values": [one.gaps.kernel.compiled(0).point for one in families],
        "pair_parameters": first,
        "first_read": np.cumsum([0, *(len(one.reads) for one in families)]),
        "pair_reads": [read for one in families for read in one.reads],
        "pair_gaps": [len(one.gaps.names) for one in families],
        "most_pair_gaps": max((len(one.gaps.names) for one in families), default=0),
        "first_law": np.cumsum([0, *(len(one.laws) for one in families)]),
        "first_pair_slip": first_slip,
        "pair_slips": slips,
        "law_start": np.concatenate(starts) if starts else (),
        "law_rows": [law.rows for law in laws],
        "pair_sets": [[sets.add(law.static), sets.add(law.dynamic)] for law in laws],
        "pair_causes": [bodies.causes.index(law.cause) for law in laws],
        "pair_restitution": [one.restitution for one in families],
        "pair_reach": reach,
        "reach": max(reach, default=0.0),
    }


def _limits(bodies: MovingBodies) -> dict[str, Any]:
    """Return the entries of the limits on velocities."""
    first, equations = [0], list[int]()
    names = [n for kind in bodies.kinds for _ in range(kind.count) for n in kind.body.limit_names]
    for kind in bodies.kinds:
        held = 0 if kind.body.limits is None else kind.body.limits.equations
        for _ in range(kind.count):
            first.append(first[-1] + len(kind.body.limit_names))
            equations.append(first[-1] - held)
    own = [kind.body.limits for kind in bodies.kinds]
    kernels = [one.rows.kernel.compiled(1).point if one else 0 for one in own]
    bends = [one.rows.kernel.compiled(2).point if one and one.curved else 0 for one in own]
    begin, account = tied_events(bodies), DISSIPATED + len(bodies.causes)
    return {
        "limits": len(names),
        "limit_kernel": kernels,
        "limit_bends": bends,
        "first_limit": first,
        "first_nonholonomic": equations,
        "limit_names": [begin + bodies.contact_names.index(name) for name in names],
        "limit_accounts": [account + bodies.limit_names.index(name) for name in names],
    }


def tied_events(bodies: MovingBodies) -> int:
    """Return the number from which on those of gaps in events are names, of ties and limits."""
    own = [kind.count * len(kind.body.contacts) for kind in bodies.kinds]
    return max(sum(own), *(len(one.gaps.names) for one in bodies.families.values()), 0)


def _ties(bodies: MovingBodies, parameters: list[float], sets: "_Sets") -> dict[str, Any]:
    """Return the entries of the ties; their parameters are appended."""
    ties, friction = bodies.ties, bodies.ties.friction
    forms = []
    for form in ties.forms:
        kernels = [form.rows.kernel.compiled(1).point if form.rows.names else 0]
        kernels += [form.slips.kernel.compiled(1).point if form.slips else 0]
        kernels += [form.forces.kernel.compiled(0).point if form.forces else 0]
        slips = len(form.slips.names) if form.slips else 0
        forms.append([*kernels, form.limits, len(form.rows.names), slips, form.driven])
    first = []
    for values in ties.parameters:
        first.append(len(parameters))
        parameters += values
    own = [ties.forms[form].friction for form in ties.form]
    starts = [np.cumsum([0, *(f.rows for f in some)])[:-1] for some in own]
    place = {name: tied_events(bodies) + n for n, name in enumerate(bodies.contact_names)}
    return {
        "ties": len(ties.bodies),
        "tie_forms": forms,
        "tie_form": ties.form,
        "tie_bodies": ties.bodies,
        "tie_parameters": first,
        "tie_rows": ties.row_starts,
        "tie_names": [place[name] for name in ties.names],
        "tie_restitution": ties.restitution,
        "tie_frictions": np.cumsum([0, *map(len, own)]),
        "tie_slip_start": [start for some in starts for start in some],
        "tie_slip_rows": [f.rows for f in friction],
        "tie_pressing": [f.pressing for f in friction],
        "tie_sets": [[sets.add(f.static), sets.add(f.dynamic)] for f in friction],
        "tie_causes": [bodies.causes.index(f.cause) for f in friction],
    }


def _components(bodies: MovingBodies, noise: Noise) -> dict[str, Any]:
    """Return who is tied to whom: ties of each body, components, and bodies without contacts."""
    ties, N = bodies.ties, bodies.total
    sides: list[list[int]] = [[] for _ in range(N)]
    away: list[list[int]] = [[] for _ in range(N)]
    for t, pair in enumerate(ties.bodies):
        for side, i in enumerate(pair):
            if i >= 0:
                sides[i].append(2 * t + side)
    for i, j in ties.apart:
        away[i].append(j)
        away[j].append(i)
    found = ties.components
    still = [
        kind.body.formulation.time_parameter < 0
        and not any(noise.kicks.get(name, 0.0) for name in kind.body.formulation.coordinates)
        and not (noise.chatter and kind.body.formulation.loads)
        and not (kind.body.limits and kind.body.limits.timed)
        for kind in bodies.kinds
    ]
    rests = [
        still[a] and not (bodies.kinds[a].body.limits or bodies.attracts) for a in bodies.kind_of
    ]
    for c in found:
        held = all(still[bodies.kind_of[i]] for i in c.bodies)
        for i in c.bodies:
            rests[i] = held and not any(ties.forms[ties.form[t]].timed for t in c.ties)
    return {
        "tie_start": np.cumsum([0, *map(len, sides)]),
        "tie_sides": [code for some in sides for code in some],
        "components": len(found),
        "component_bodies": np.cumsum([0, *(len(c.bodies) for c in found)]),
        "component_body": [i for c in found for i in c.bodies],
        "component_ties": np.cumsum([0, *(len(c.ties) for c in found)]),
        "component_tie": [t for c in found for t in c.ties],
        "component_closed": [c.closed for c in found],
        "still": rests,
        "apart_start": np.cumsum([0, *map(len, away)]),
        "apart_from": [j for some in away for j in sorted(some)],
    }


class _Sets:
    """Different convex sets, numbered."""

    def __init__(self) -> None:
        self.numbers: dict[Any, int] = {}
        self.codes: list[tuple[int, tuple[float, ...], Any]] = []

    def add(self, convex: ConvexSet) -> int:
        """Return the number of a set."""
        kind, sizes, vertices = convex.code
        key = (kind, tuple(sizes), np.asarray(vertices).tobytes())
        if key not in self.numbers:
            self.numbers[key] = len(self.codes)
            self.codes.append((kind, tuple(sizes), np.asarray(vertices).reshape(-1, 2)))
        return self.numbers[key]

    def values(self) -> dict[str, Any]:
        """Return the entries of all sets."""
        codes = self.codes or [(0, (0.0,) * 4, np.empty((0, 2)))]
        return {
            "set_kinds": [kind for kind, _, _ in codes],
            "set_sizes": [sizes for _, sizes, _ in codes],
            "first_vertex": np.cumsum([0, *(len(vertices) for _, _, vertices in codes)]),
            "vertices": np.concatenate([v for _, _, v in codes] + [np.zeros((1, 2))]),
        }

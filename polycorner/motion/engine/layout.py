"""Bodies and their contacts as model constants of the compiled code."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from polycorner.formulas.bundles import Call
from polycorner.formulas.families import Family
from polycorner.motion.bodies import IdenticalBodies, MovingBody
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.engine.allocation import filled
from polycorner.motion.engine.arrays import Model
from polycorner.motion.engine.sizes import EVENTS, Sizes
from polycorner.motion.engine.threads import address_of_yield
from polycorner.motion.formulation import moment
from polycorner.motion.noise import MotionOptions, Noise, Solver

MANY = 32  # bodies beyond which all are a crowd: parts of a step cost a look at each body
# Of the options: lengths, which are scaled by the unit of gaps, and others.
LENGTHS = ("touching", "parting", "zero_gap", "detection", "crowd_overlap")
SHARES = ("bending", "slow_bounce", "shortest_part", "dependent")


def model_of(
    bodies: IdenticalBodies,
    sizes: Sizes,
    noise: Noise,
    solver: Solver,
    start: float,
    step: float,
) -> Model:
    """Return the model constants of bodies in motion."""
    body, formulation, options = bodies.body, bodies.body.formulation, solver.options
    parameters = list(body.parameters)
    sets, dependence = _Sets(), _dependence(body)
    if solver.crowd_sweeps and body.equations and not dependence["constant_mass"]:
        msg = (
            f"solver: expected crowd_sweeps=0 for bodies that turn in space and are no balls, or "
            f"obey equations and have a mass matrix that varies: sweeps do not follow their "
            f"rotation; got {solver.crowd_sweeps}"
        )
        raise NotImplementedError(msg)
    values = {
        "bodies": bodies.count,
        "dimension": bodies.dimension,
        "lanes": sizes.K,
        **dict.fromkeys(("contact_room", "neighbour_room"), 0),  # not yet known
        "event_room": EVENTS,
        "force_kernel": formulation.forces.kernel.compiled(0).point,
        "loads": formulation.loads,
        "units": body.units,
        "position": bodies.position,
        "period": bodies.period,
        "substrate_speed": bodies.substrate_speed,
        "exit_coordinate": bodies.exit_coordinate,
        "exit_limit": bodies.exit_limit,
        "restitution": body.restitution,
        "unilateral": len(body.contacts) - body.equations,
        "gap_unit": body.gap_unit,
        "chatter": noise.chatter,
        "correlation_time": noise.correlation_time,
        "kicks": [noise.kicks.get(name, 0.0) for name in formulation.coordinates],
        "kick_time": noise.kick_time,
        "seed": noise.seed,
        "tolerance": solver.tolerance,
        "sweeps": solver.sweeps,
        "refines": solver.refine,
        "crowd_sweeps": solver.crowd_sweeps,
        "threads": solver.threads,
        "give_way": address_of_yield(),
        "may_rest": sizes.m + sizes.R >= sizes.k,
        **{name: getattr(options, name) for name in SHARES},
        **{name: getattr(options, name) * body.gap_unit for name in LENGTHS},
        **_near(bodies, noise, options),
        "start": start,
        "step": step,
        "time_parameter": body.formulation.time_parameter,
        "follows_time": body.formulation.time_parameter >= 0 and not body.slow_signals,
        **dependence,
        **_signals(body, parameters),
        **_friction(bodies, sets),
        **_calls("slip", formulation.slip_calls, parameters, formulation.slip),
        **_calls("gap", body.gaps, parameters),
        **_pairs(bodies, parameters, sets),
        **sets.values(),
    }
    return filled(Model, sizes, {**values, "parameters": [*parameters, 0.0]})


def _near(bodies: IdenticalBodies, noise: Noise, options: MotionOptions) -> dict[str, float]:
    """Return the scaled travel in a step up to which a plastic impact is slow, and in a crowd."""
    kicked = any(noise.kicks.values())
    near = many = options.slow_travel_kicked if kicked else options.slow_travel
    if bodies.contacts is not None and bodies.count > 1:
        many = max(near, options.crowd_travel * bodies.contacts.reach / bodies.body.gap_unit)
        near = near if bodies.count <= MANY else many
    return {"near": near, "near_many": many}


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


def _signals(body: MovingBody, parameters: list[float]) -> dict[str, int]:
    """Return the entries of the functions of the time; their parameters are appended."""
    if body.signals is None:
        return {"signal_kernel": 0, "signal_parameters": 0}
    first = len(parameters)
    parameters += body.signal_parameters.tolist()
    return {"signal_kernel": body.signals.kernel.compiled(0).point, "signal_parameters": first}


def _friction(bodies: IdenticalBodies, sets: "_Sets") -> dict[str, Any]:
    """Return the entries of the friction contacts between a body and its surroundings."""
    contacts, formulation = bodies.body.friction, bodies.body.formulation
    sources = np.zeros((len(contacts), max(1, formulation.loads)))
    for source, contact in zip(sources, contacts, strict=True):
        source[list(contact.loads)] = 1
    return {
        "frictions": len(contacts),
        "slip_start": np.cumsum([0, *(contact.rows for contact in contacts)]),
        "friction_sets": [[sets.add(c.static), sets.add(c.dynamic)] for c in contacts],
        "pressing_gap": [contact.gap for contact in contacts],
        "load_sources": sources,
        "friction_causes": [bodies.causes.index(contact.cause) for contact in contacts],
    }


def _calls(
    what: str, calls: Sequence[Call], parameters: list[float], own: Family | None = None
) -> dict[str, Any]:
    """Return the entries of a body's gaps or slips; their parameters are appended.

    Those of the family ``own`` are the first ones.
    """
    table: list[tuple[int, ...]] = []
    reads: list[int] = []
    places: list[int] = []
    for call in calls:
        kernel = call.family.kernel
        if len(set(call.columns)) != len(call.columns):
            msg = "polyhedron: expected each gap once; got one that occurs twice"
            raise ValueError(msg)
        row_of = dict(zip(call.columns, call.rows, strict=True))
        entry = (kernel.compiled(1).point, kernel.variables, kernel.outputs)
        first = 0 if call.family is own else len(parameters)
        table.append((*entry, len(reads), len(places), first))
        reads += call.reads
        places += [row_of.get(column, -1) for column in range(kernel.outputs)]
        parameters += call.parameters.tolist()
    return {
        f"{what}_kernels": len(table),
        f"{what}_calls": table,
        f"{what}_reads": [*reads, 0],
        f"{what}_places": [*places, 0],
    }


def _pairs(bodies: IdenticalBodies, parameters: list[float], sets: "_Sets") -> dict[str, Any]:
    """Return the entries of the contacts between bodies; their parameters are appended."""
    family = bodies.contacts
    if family is None or bodies.count < 2:
        numbers = (
            "pair_kernel",
            "pair_values",
            "pair_parameters",
            "pair_inputs",
            "pair_gaps",
            "pair_laws",
            "pair_restitution",
        )
        tables = ("pair_reads", "pair_slips", "pair_sets", "pair_causes")
        empty: dict[str, Any] = dict.fromkeys(tables, ())
        return {**dict.fromkeys(numbers, 0), "reach": 0.0, **empty, "pair_slip_start": [0]}
    first = len(parameters)
    parameters += family.parameters
    slips = []
    for slip, exchanged, values in family.slips:
        slips.append((slip.kernel.compiled(1).point, exchanged, len(parameters)))
        parameters += values
    return {
        "pair_kernel": family.gaps.kernel.compiled(1).point,
        "pair_values": family.gaps.kernel.compiled(0).point,
        "pair_parameters": first,
        "pair_inputs": len(family.reads),
        "pair_reads": family.reads,
        "pair_gaps": len(family.gaps.names),
        "pair_laws": len(family.laws),
        "pair_slips": slips,
        "pair_slip_start": np.cumsum([0, *(law.rows for law in family.laws)]),
        "pair_sets": [[sets.add(law.static), sets.add(law.dynamic)] for law in family.laws],
        "pair_causes": [bodies.causes.index(law.cause) for law in family.laws],
        "pair_restitution": family.restitution,
        "reach": family.reach,
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

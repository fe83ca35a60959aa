"""A system laid out as arrays for the compiled core."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.bundles import Call
from polycorner.motion.bodies import RUBBING, Body, IdenticalBodies
from polycorner.motion.formulation import moment
from polycorner.motion.friction import ConvexSet
from polycorner.motion.noise import Noise, Solver

if TYPE_CHECKING:
    from polycorner.motion.engine.compiled import Scene


def lay_out(bodies: IdenticalBodies, noise: Noise, solver: Solver) -> "Scene":
    """Return the arrays that :func:`polycorner.motion.engine.compiled.advance` reads."""
    from polycorner.motion.engine.compiled import Scene

    body, k = bodies.body, bodies.dimension
    numbers = list(body.parameters)
    tables = _gap_tables(body.gaps, len(body.contacts), numbers)
    shapes = _Shapes()
    friction = body.friction
    source = np.zeros((len(friction), max(1, body.formulation.loads)), dtype=np.int64)
    for f, contact in enumerate(friction):
        source[f, list(contact.loads)] = 1
    shape = [[shapes.add(contact.static), shapes.add(contact.dynamic)] for contact in friction]
    pair = _pair_entries(bodies, numbers, shapes)
    kicks = [float(noise.kicks.get(name, 0.0)) for name in body.formulation.coordinates]
    return Scene(
        bodies=bodies.count,
        size=k,
        force_at=body.formulation.forces.kernel.compiled(0).point,
        slip_at=body.formulation.slip.kernel.compiled(1).point if friction else 0,
        loads=body.formulation.loads,
        row=_whole(np.cumsum([0, *(contact.rows for contact in friction)])),
        shape=_whole(shape).reshape(-1, 2),
        owner=_whole([contact.gap for contact in friction]),
        source=source,
        cause=_whole([bodies.causes.index(contact.cause) for contact in friction]),
        bounce=np.asarray(body.restitution, dtype=np.float64),
        place=_whole(bodies.position),
        unit=np.asarray(body.units, dtype=np.float64),
        carried=float(bodies.substrate_speed),
        exit_place=bodies.exit_coordinate,
        exit_limit=float(bodies.exit_limit),
        scale=float(body.gap_unit),
        chatter=float(noise.chatter),
        chatter_time=float(noise.correlation_time),
        kicks=np.array(kicks),
        seed=int(noise.seed),
        tolerance=float(solver.tolerance),
        sweeps=int(solver.sweeps),
        constant=int(_mass_is_constant(body)),
        numbers=np.array([*numbers, 0.0]),
        **tables,
        **pair,
        **shapes.arrays(),
    )


def _mass_is_constant(body: Body) -> bool:
    """Return whether the mass matrix is the same at three points drawn at random."""
    k = len(body.formulation.coordinates)
    draws = np.random.default_rng(0).normal(size=(3, 2, k))
    first, *others = (moment(body.formulation, body.parameters, q, v).mass for q, v in draws)
    return all(np.array_equal(first, other) for other in others)


def _whole(values: Any) -> NDArray[np.int64]:
    return np.array(values, dtype=np.int64)


def _gap_tables(calls: Sequence[Call], rows: int, numbers: list[float]) -> dict[str, Any]:
    table: list[tuple[int, ...]] = []
    reads: list[int] = []
    places: list[int] = []
    for call in calls:
        kernel = call.family.kernel
        if len(set(call.columns)) != len(call.columns) or max(call.rows) >= rows:
            msg = "polyhedron: expected each gap once; got one that occurs twice"
            raise ValueError(msg)
        where = dict(zip(call.columns, call.rows, strict=True))
        entry = (kernel.compiled(1).point, kernel.variables, kernel.outputs)
        table.append((*entry, len(reads), len(places), len(numbers)))
        reads += call.reads
        places += [where.get(column, -1) for column in range(kernel.outputs)]
        numbers += call.parameters.tolist()
    return {
        "gap_table": _whole(table).reshape(-1, 6),
        "gap_reads": _whole([*reads, 0]),
        "gap_rows": _whole([*places, 0]),
    }


def _pair_entries(
    bodies: IdenticalBodies, numbers: list[float], shapes: "_Shapes"
) -> dict[str, Any]:
    family = bodies.contacts
    entries: dict[str, Any] = {
        "pair_at": 0,
        "pair_number": len(numbers),
        "pair_reads": _whole([]).reshape(-1, 2),
        "pair_gaps": 0,
        "rub_table": _whole([]).reshape(-1, 3),
        "rub_shape": _whole([0, 0]),
        "rub_cause": 0,
        "pair_bounce": 0.0,
        "reach": 0.0,
    }
    if family is None or bodies.count < 2:
        return entries
    numbers += family.parameters
    rubs = []
    for slip, swapped, values in family.slips:
        rubs.append((slip.kernel.compiled(1).point, int(swapped), len(numbers)))
        numbers += values
    entries["pair_at"] = family.gaps.kernel.compiled(1).point
    entries["pair_reads"] = _whole(family.reads)
    entries["pair_gaps"] = len(family.gaps.names)
    entries["rub_table"] = _whole(rubs).reshape(-1, 3)
    entries["rub_shape"] = _whole([shapes.add(family.static), shapes.add(family.dynamic)])
    entries["rub_cause"] = bodies.causes.index(RUBBING) if family.slips else 0
    entries["pair_bounce"] = float(family.restitution)
    entries["reach"] = float(family.reach)
    return entries


class _Shapes:
    """Convex sets, each once."""

    def __init__(self) -> None:
        self.found: dict[Any, int] = {}
        self.codes: list[tuple[int, tuple[float, ...], Any]] = []

    def add(self, shape: ConvexSet) -> int:
        kind, numbers, vertices = shape.code
        key = (kind, tuple(numbers), np.asarray(vertices).tobytes())
        if key not in self.found:
            self.found[key] = len(self.codes)
            self.codes.append((kind, tuple(numbers), np.asarray(vertices).reshape(-1, 2)))
        return self.found[key]

    def arrays(self) -> dict[str, Any]:
        codes = self.codes or [(0, (0.0,) * 4, np.empty((0, 2)))]
        return {
            "kinds": _whole([kind for kind, _, _ in codes]),
            "sizes": np.array([numbers for _, numbers, _ in codes], dtype=np.float64),
            "corner": _whole(np.cumsum([0, *(len(v) for _, _, v in codes)])),
            "vertices": np.concatenate([v for _, _, v in codes] + [np.zeros((1, 2))]),
        }

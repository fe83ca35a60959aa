"""A drift as a table for compiled code, and room for its state and its work."""

from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.bundles import Bundle
from polycorner.motion.drifts import Drift
from polycorner.motion.noise import Solver
from polycorner.motion.sweeping.records import LOG, STATE, SYSTEM, WORK
from polycorner.tolerances import DEFAULT

EVENTS = 1024  # for which there is room, beside those of one step
Arrays = dict[str, NDArray[Any]]


def system_values(
    drift: Drift, solver: Solver, start: float, step: float, seed: int
) -> dict[str, Any]:
    """Return the entries of the table of a drift."""
    d, bodies, options = drift.polyhedron, drift.bodies, solver.options
    body, k = bodies.body, drift.manifold.size
    energies = [] if drift.energy is None else [drift.energy]
    gaps = Bundle(drift.manifold, (*d.functions, *d.equations)).tabulated(0, 1)
    energy = Bundle(drift.manifold, energies).tabulated(0, 1)
    constant = np.eye(k) if drift.mobility_varies else drift.mobility_at(np.zeros(k))
    codes = [
        0 if family is None else family.kernel.compiled(order).point
        for family, order in (
            (drift.limit_family, 1),
            (drift.flow, 0),
            (drift.mobilities if drift.mobility_varies else None, 0),
        )
    ]
    return {
        "bodies": bodies.total,
        "k": k,
        **{name: gaps[name] for name in ("calls", "reads", "outputs", "parameters")},
        "inequalities": len(d.functions),
        "m": len(d.functions) + len(d.equations),
        "limits": len(drift.limits),
        "limit_code": codes[0],
        "flow_code": codes[1],
        "mobility_code": codes[2],
        **{f"energy_{name}": energy[name] for name in ("calls", "reads", "outputs", "parameters")},
        "mobility": constant,
        "metric": np.linalg.inv(constant),
        "factor": np.linalg.cholesky(constant),
        "noise": drift.noise,
        "seed": seed,
        **_unions(drift),
        **_pairs(drift),
        "position": bodies.axes,
        "period": [*bodies.period, np.inf][:3],
        "units": body.units,
        "exit_coordinate": bodies.exit_coordinate,
        "exit_limit": bodies.exit_limit,
        "step": step,
        "start": start,
        "tolerance": solver.tolerance,
        "rounding": DEFAULT.rounding,
        "sweeps": solver.sweeps,
        "zero": options.zero_gap,
        "touching": options.touching,
        "parting": options.parting,
        "shortest": options.shortest_part,
        "detection": options.detection,
        "buffer": max(gaps["size"], energy["size"], (2 * k + 1) * (len(drift.limits) + 2)),
    }


def _unions(drift: Drift) -> dict[str, Any]:
    """Return the rows that always hold, and the pieces of unions."""
    always, unions = drift.polyhedron.unions
    pieces = [sorted(piece) for union in unions for piece in union]
    return {
        "always": [i in always for i in range(len(drift.polyhedron.functions))],
        "piece_of_union": np.cumsum([0, *map(len, unions)]),
        "row_of_piece": np.cumsum([0, *map(len, pieces)]),
        "rows": [*chain.from_iterable(pieces)],
    }


def _pairs(drift: Drift) -> dict[str, Any]:
    """Return the contacts between bodies."""
    contacts = drift.bodies.families.get((0, 0))
    if contacts is None:
        return {
            "pair_codes": [0, 0],
            "pair_gaps": 0,
            "pair_reads": np.zeros((0, 2)),
            "pair_parameters": [0.0],
            "reach": 0.0,
        }
    kernel = contacts.gaps.kernel
    return {
        "pair_codes": [kernel.compiled(order).point for order in (0, 1)],
        "pair_gaps": len(contacts.gaps.names),
        "pair_reads": contacts.reads,
        "pair_parameters": [*contacts.parameters, 0.0],
        "reach": contacts.reach,
    }


def room_for(values: dict[str, Any], pairs: int) -> tuple[Arrays, Arrays, Arrays]:
    """Return state, work and log of a drift, with room for so many pairs of neighbours."""
    N, k = values["bodies"], values["k"]
    per, G = values["m"] + values["limits"], values["pair_gaps"]
    sizes = {
        "N": N,
        "k": k,
        "S": N * per,
        "C": pairs * G,
        "R": N * per + pairs * G + 1,  # the last is that of the energy
        "D": 2 * k,
        "P": pairs,
        "E": EVENTS + 4 * (N * per + pairs * G + 1 + 3 * N),
    }
    state, work, log = (_allocated(layout, sizes) for layout in (STATE, WORK, LOG))
    unions = len(values["piece_of_union"]) - 1
    work["chosen"], work["forced"] = (np.full((N, unions), -1) for _ in range(2))
    work["meeting"] = np.full(len(values["row_of_piece"]) + 1, -1)
    code_room = G * (1 + 2 * k) + 2 * k
    work["buffer"] = np.zeros(max(values["buffer"], k * (k + 3), code_room) + 1)
    work["room"][2] = np.inf
    return state, work, log


def _allocated(layout: Any, sizes: dict[str, int]) -> Arrays:
    kinds = {np.float64: np.float64, np.int64: np.int64}
    found = {}
    for name, (kind, shape) in layout.declared.items():
        lengths = [int(x) if x.isdigit() else sizes.get(x, 0) for x in shape.split()]
        found[name] = np.zeros(lengths, dtype=kinds[kind])
    return found


def tables_of(*records: tuple[Any, dict[str, Any]]) -> tuple[list[bytes], list[Any]]:
    """Return the tables of records, and the arrays in them, which have to be kept."""
    tables, kept = [], []
    for layout, values in records:
        table, arrays = layout.table(values[name] for name in layout.declared)
        tables.append(table)
        kept.append(arrays)
    return tables, kept


LAYOUTS = SYSTEM, STATE, WORK, LOG

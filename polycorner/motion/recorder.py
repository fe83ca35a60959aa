"""Recording of a running engine as a trajectory.

What the arrays of an engine's state may be, checked before compiled code follows them.

Many of them are indices, and compiled code does not look whether these are within its arrays.
"""

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import forms
from polycorner.checks import refuse
from polycorner.motion.engine.arrays import (
    APPLIED_WORK,
    CONTACTS,
    DISSIPATED,
    DRIVE_WORK,
    LEFT_OVER,
    NOISE_WORK,
    PENETRATION,
    STEPS,
    SUBSTRATE_WORK,
    EngineState,
    declarations,
)
from polycorner.motion.engine.driver import Engine
from polycorner.motion.engine.sizes import Sizes
from polycorner.motion.events import EventKind, EventTable, joined
from polycorner.motion.scenes import FrictionTable, friction_table
from polycorner.motion.tables import read_events, read_friction, read_touches
from polycorner.motion.trajectory import Touch, Trajectory
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from collections.abc import Mapping

    from polycorner.motion.mechanics import MechanicalSystem

FLAGS = (
    *("sticks", "touches", "alive", "rests", "asleep", "watched"),
    *("tie_touches", "tie_sticks", "limit_acts"),
)
TIES = {name for name in EngineState._fields if name.startswith("tie_")}
LIMITS = {name for name in EngineState._fields if name.startswith("limit_")}
# Not in states saved before there were these.
NOW = {"rank", "body_of_rank", "stopped", "pile", *TIES, *LIMITS}
WORK = {"substrate": SUBSTRATE_WORK, "applied": APPLIED_WORK, "noise": NOISE_WORK}


def check_state(engine: Engine, arrays: Mapping[str, Any], steps: int) -> None:
    """Check the saved arrays of a state after so many steps.

    Raises
    ------
    TypeError, ValueError
        Naming the array.
    """
    bodies = engine.bodies
    sizes = Sizes.of(bodies, len(arrays["keys"]))
    N, last, pairs = sizes.N, np.iinfo(np.int64).max, sizes.N * sizes.N * sizes.G
    # Whole numbers that are neither flags nor, between two steps, free: lowest and highest.
    ranges = dict.fromkeys(FLAGS, (0, 1)) | {
        "sticks": (0, LEFT_OVER),
        "rank": (0, N - 1),
        "body_of_rank": (0, N - 1),
        "check_due": (0, last),
        "booked_to": (0, steps + 1),
        "stopped": (0, steps),
        "pile": (0, N),
        "pair_flags": (0, 2 ** max(1, sizes.H) - 1),
        "cluster": (-1, -1),  # no body is within a step
        "counts": (0, last),
        "elapsed": (0.0, engine.dt),
    }
    for name, declared in declarations(EngineState).items():
        needed = (name in TIES and bodies.ties.bodies) or (name in LIMITS and bodies.limit_names)
        if name in NOW - arrays.keys() and not needed:
            continue
        kind = "f" if declared.kind is np.float64 else "i"
        least, most = ranges.get(name, (-np.inf, np.inf))
        forms.array(name, arrays[name], kind, declared.extents(sizes), least=least, most=most)
    if "rank" in arrays and (arrays["body_of_rank"][arrays["rank"]] != np.arange(N)).any():
        refuse("rank", "the inverse of body_of_rank", "another order")
    counts = arrays["counts"]
    if counts[STEPS] != steps:
        refuse("counts", f"{steps} steps, as were recorded", int(counts[STEPS]))
    if counts[CONTACTS] > sizes.C:
        refuse("counts", f"at most {sizes.C} contacts, for which there is room", counts[CONTACTS])
    keys = arrays["keys"][: counts[CONTACTS]]
    forms.array("keys", keys, "i", (-1,), least=0, most=pairs - 1)
    first, second = np.divmod(keys // max(1, sizes.G), N)
    if (np.diff(keys) <= 0).any() or (first >= second).any():
        refuse("keys", "ascending pairs of bodies", "others")


def _body_after_body(state: "Mapping[str, Any]") -> dict[str, Any]:
    """Return a state whose contacts stand body after body; once they stood in a row for each."""
    found = dict(state)
    for name, declared in declarations(EngineState).items():
        rows = np.asarray(state.get(name))
        if declared.shape[0] in "UF" and rows.ndim == 1 + len(declared.shape.split()):
            found[name] = rows.reshape(-1, *rows.shape[2:])
    return found


class Recorder:
    """Instants and events of one run."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.columns: dict[str, list[Any]] = {
            name: [] for name in ("t", "q", "v", "rests", "alive", "energies", "sums")
        }
        self.touching: list[tuple[Touch, ...]] = []
        self.friction: list[FrictionTable] = []  # of one instant after the other
        self.events: list[EventTable] = []  # of one advance after the other
        self.left: list[float] = []
        self.gone = 0.0

    def instant(self) -> None:
        """Record the present state."""
        motion, add = self.engine.motion, self.columns
        add["t"].append(self.engine.time)
        add["q"].append(motion.q.copy())
        add["v"].append(motion.v.copy())
        add["rests"].append(motion.rests != 0)
        add["alive"].append(motion.alive != 0)
        add["energies"].append(self.engine.energies())
        add["sums"].append(motion.sums.copy())
        self.touching.append(tuple(self.engine.touching()))
        self.friction.append(self._rubbing(len(self.left)))
        self.left.append(self.gone)

    def begin(self) -> None:
        """Do the first step, and note what touches at the start, with the forces of this step.

        The engine knows of contacts after steps only.
        """
        engine = self.engine
        limit = float(engine.model.touching) / engine.bodies.gap_unit
        self.advance(1)
        touched = engine.bodies.touching(self.columns["q"][0], limit)
        every = {*touched, *((some, name) for some, name, _ in self.touching[0])}  # and equations
        acting = [touch for touch in engine.touching() if touch[:2] in every]
        opened = every - {touch[:2] for touch in acting}
        acting += [(*touch, 0.0) for touch in touched if touch in opened]
        self.touching[0] = tuple(acting)
        self.friction[0] = self._rubbing(0)

    def _rubbing(self, instant: int) -> FrictionTable:
        """Return the present friction forces, as those of an instant."""
        motion, model, bodies = self.engine.motion, self.engine.model, self.engine.bodies
        found = [(np.zeros((0, 3), dtype=np.int64), np.zeros((0, 2)))]
        own = 0
        for kind, at in bodies.slices:
            rows, gaps = (
                slice(*first[[at.start, at.stop]])
                for first in (model.first_friction, model.first_gap)
            )
            count = len(kind.body.friction)
            friction = motion.friction[rows].reshape(kind.count, count, 2)
            touching = motion.touches[gaps].reshape(kind.count, -1) != 0
            pressing = np.array([contact.gap for contact in kind.body.friction], dtype=np.int64)
            acts = np.ones((kind.count, count), dtype=np.bool_)
            acts[:, pressing >= 0] = touching[:, pressing[pressing >= 0]]
            acts[motion.alive[at] == 0] = False
            i, f = np.nonzero(acts & friction.any(axis=2))
            found.append(
                (np.column_stack([at.start + i, np.full_like(i, -1), own + f]), friction[i, f])
            )
            own += count
        s = np.flatnonzero(motion.pair_flags[: int(motion.counts[CONTACTS]), 1])
        key, g = np.divmod(motion.keys[s], max(1, model.most_pair_gaps))
        both = np.sort(motion.body_of_rank[np.column_stack(np.divmod(key, bodies.total))], axis=1)
        kinds = bodies.kind_of[both]
        for (a, b), family in bodies.families.items():
            here = np.flatnonzero((kinds == (a, b)).all(axis=1))
            laws = len(family.laws)
            starts = np.cumsum([0, *(law.rows for law in family.laws)]).tolist()
            for h, (first, last) in enumerate(pairwise(starts)):
                forces = np.zeros((len(here), 2))
                forces[:, : last - first] = motion.pair_impulse[s[here], 1 + first : 1 + last]
                some = forces.any(axis=1)
                law = own + g[here] * laws + h
                found.append((np.column_stack([both[here], law])[some], forces[some]))
            own += laws * len(family.gaps.names)
        whole, forces = (np.concatenate(parts) for parts in zip(*found, strict=True))
        instants = np.full((len(whole), 1), instant)
        table = FrictionTable(np.hstack([instants, whole]), forces / self.engine.dt)
        return table if instant else self._at_first(table)

    def _at_first(self, table: FrictionTable) -> FrictionTable:
        """Return the friction of what touches at the start, and of what has a known load."""
        bodies, touched = self.engine.bodies, {touch[:2] for touch in self.touching[0]}
        known = {law.contact for law in bodies.rubbing} - {*bodies.contact_names}
        kept = [
            ((i,) if j < 0 else (i, j), contact) in touched or contact in known
            for _, i, j, law in table.whole.tolist()
            for contact in [bodies.rubbing[law].contact]
        ]
        chosen = np.array(kept, dtype=np.bool_)
        return FrictionTable(table.whole[chosen], table.forces[chosen])

    def advance(self, steps: int) -> None:
        """Advance the engine, recording events and the energy that leaves with bodies."""
        if not steps:
            return
        happened = self.engine.advance(steps)
        self.events.append(happened)
        for event in happened.of_kind(EventKind.EXIT):
            self.gone -= self.engine.energy_of(event.bodies[0])

    def extend(self, chunk: "Mapping[str, Any]") -> None:
        """Record what was recorded and saved before, after a check of every number.

        Raises
        ------
        TypeError, ValueError
            Naming the array.
        """
        bodies = self.engine.bodies
        N, k, count = bodies.total, bodies.width, len(chunk["left"])
        shapes: dict[str, tuple[str, tuple[int, ...]]] = {
            "t": ("f", ()),
            "q": ("f", (N, k)),
            "v": ("f", (N, k)),
            "rests": ("b", (N,)),
            "alive": ("b", (N,)),
            "energies": ("f", (2,)),
            "sums": ("f", self.engine.motion.sums.shape),
        }
        for name, (kind, shape) in shapes.items() if count else ():  # empty lists have no shape
            self.columns[name].extend(forms.array(name, chunk[name], kind, (count, *shape)))
        self.left += forms.array("left", chunk["left"], "f", (count,)).tolist()
        self.touching += read_touches(chunk, bodies.contact_names, count, N)
        table = read_friction(chunk, bodies.rubbing, count, N)
        for k in range(count):
            one = slice(*np.searchsorted(table.whole[:, 0], [k, k + 1]))
            whole = table.whole[one].copy()
            whole[:, 0] += len(self.friction) - k
            self.friction.append(FrictionTable(whole, table.forces[one]))
        self.events.append(read_events(chunk, bodies.contact_names, N))

    def load(self, state: "Mapping[str, Any]") -> None:
        """Bring the engine to a saved state, which has to be that of the last instant.

        Raises
        ------
        TypeError, ValueError
            Naming the array.
        """
        engine, columns, state = self.engine, self.columns, _body_after_body(state)
        for name, first in (("q", engine.motion.q), ("v", engine.motion.v)):
            if (columns[name][0] != first).any():
                refuse(name, "the start of the run at first", columns[name][0].tolist())
        check_state(engine, state, round((columns["t"][-1] - engine.start) / engine.dt))
        for name in ("q", "v", "rests", "alive", "sums"):
            if (state[name] != columns[name][-1]).any():
                refuse(name, "the state at the last instant", "another one")
        engine.load(dict(state))
        forms.array("energies", np.array(engine.energies()), "f", (2,))

    def trajectory(self, system: "MechanicalSystem", **run: Any) -> Trajectory:
        """Return what was recorded; ``run`` are the arguments of the simulation."""
        bodies, sums = self.engine.bodies, np.array(self.columns["sums"])
        work = {name: sums[:, i] for name, i in WORK.items()}
        if any(kind.body.timed for kind in bodies.kinds) or bodies.ties.drives:
            work["drive"] = sums[:, DRIVE_WORK]
        dissipated = {cause: sums[:, DISSIPATED + i] for i, cause in enumerate(bodies.causes)}
        first = DISSIPATED + len(bodies.causes)
        work |= {name: sums[:, first + j] for j, name in enumerate(bodies.limit_names)}
        if bodies.attracts:
            work["attraction"] = sums[:, first + len(bodies.limit_names)]
        deepest = float(self.engine.motion.sums[PENETRATION])
        return self._trajectory(system, dissipated, work, deepest, **run)

    def _trajectory(
        self,
        system: "MechanicalSystem",
        dissipated: "Mapping[str, Array]",
        work: dict[str, Array],
        deepest: float,
        **run: Any,
    ) -> Trajectory:
        bodies, columns = self.engine.bodies, self.columns
        hidden = system.hidden
        touching = [[t for t in some if t[1] not in hidden] for some in self.touching]
        energies = np.array(columns["energies"])
        if any(kind.exit_coordinate >= 0 for kind in bodies.kinds):
            work["left"] = np.array(self.left)
        return Trajectory(
            system=system,
            dt=self.engine.dt,
            times=np.array(columns["t"]),
            q=bodies.unpadded(np.array(columns["q"])),
            v=bodies.unpadded(np.array(columns["v"])),
            rests=np.array(columns["rests"]),
            present=np.array(columns["alive"]),
            touching=tuple(map(tuple, touching)),
            friction=friction_table(self.friction),
            kinetic=energies[:, 0],
            potential=energies[:, 1],
            dissipated=dissipated,
            work=work,
            events=joined(self.events, bodies.contact_names).in_time(),
            max_penetration=deepest,
            effort=self.engine.effort,
            **run,
        )

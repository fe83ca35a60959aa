"""The engine of first-order motion: bodies, advanced step by step by compiled code."""

from collections.abc import Iterator, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from polycorner import forms
from polycorner.checks import fits, refuse
from polycorner.errors import SolverError
from polycorner.motion.drifts import Drift
from polycorner.motion.engine.driver import Effort
from polycorner.motion.events import EventKind, EventTable, joined
from polycorner.motion.mechanics import State
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.splits import Split
from polycorner.motion.sweeping.intermediate import SHIPPED
from polycorner.motion.sweeping.records import (
    BODY,
    CORRECTIONS,
    DONE,
    NOT_FINITE,
    PAIRS_FULL,
    PART,
    PARTS,
    PROGRAMMES,
    RESIDUAL,
    SPLIT,
    STEPS,
    SWEEPS,
    UNION,
    UNSOLVED,
)
from polycorner.motion.sweeping.records import PAIRS as KEPT
from polycorner.motion.sweeping.tables import LAYOUTS, Arrays, room_for, system_values, tables_of
from polycorner.spaces.manifold import Array

PAIRS = 8  # of neighbours, for which there is room at first, for each body
PAIRED = ("keys", "pair_force", "pair_touches", "pair_since")  # arrays of as many contacts as meet


class DriftEngine:
    """Bodies in first-order motion.

    Parameters
    ----------
    drift : Drift
    q : (N, k) array
    dt : float
        Step, in s.
    start : float
        Time of the first state.
    noise : Noise
        Its seed.
    solver : Solver
    """

    def __init__(
        self, drift: Drift, q: Array, dt: float, *, start: float, noise: Noise, solver: Solver
    ) -> None:
        self.drift, self.bodies, self.dt, self.start = drift, drift.bodies, float(dt), float(start)
        self.noise, self.solver, self.before = noise, solver, 0
        self.splits: list[Split] = []
        self._values = system_values(drift, solver, self.start, self.dt, noise.seed)
        self.capacity = PAIRS * self.bodies.total * bool(self._values["pair_gaps"])
        self._allocate()
        self.state["q"][:], self.state["alive"][:] = q, 1
        self._settle()
        if not drift.noise:
            self._touch()

    def _allocate(self) -> None:
        N, k = self.bodies.total, self.bodies.dimension
        rows = N * self._values["m"] + self.capacity * self._values["pair_gaps"]
        fits("count", 8.0 * (rows * (4 * k + 16) + N * (4 * k * k + 16 * k)), f"{N} bodies")
        self.state, self.work, self._log = room_for(self._values, self.capacity)
        self._build()

    def _build(self) -> None:
        every = zip(LAYOUTS, (self._values, self.state, self.work, self._log), strict=True)
        self._tables, self._kept = tables_of(*every)

    @property
    def motion(self) -> SimpleNamespace:
        """The present state, as what records it reads it."""
        s = self.state
        return SimpleNamespace(
            q=s["q"], v=self.work["v"], rests=s["rests"], alive=s["alive"], sums=s["sums"],
            sticks=np.zeros(0, dtype=np.int64),
        )  # fmt: skip

    @property
    def time(self) -> float:
        """The time of the present state."""
        return self.start + (self.before + self.steps) * self.dt

    @property
    def steps(self) -> int:
        """The number of steps done in this run."""
        return int(self.state["counts"][STEPS]) - self.before

    @property
    def effort(self) -> Effort:
        """The cost so far."""
        counts = self.state["counts"].tolist()
        residual = float(self.state["sums"][RESIDUAL])
        solved = counts[PROGRAMMES], counts[SWEEPS], counts[CORRECTIONS], counts[UNSOLVED]
        return Effort(self.steps, *solved, residual, counts[PARTS])

    def advance(self, steps: int) -> EventTable:
        """Advance by so many steps and return the events in them."""
        events: list[EventTable] = []
        while steps > 0:
            why, done = self._run(steps, events)
            steps -= done
            if why == SPLIT:
                events += self._split()
            elif why == PAIRS_FULL:
                self._make_room()
            elif why == NOT_FINITE:
                raise SolverError(self._what_is_not_finite())
        self._settle()
        return joined(events, self.bodies.contact_names)

    def _run(self, steps: int, events: list[EventTable]) -> tuple[int, int]:
        """Advance until something has to be done here; return what, and the steps done."""
        advance, _ = SHIPPED.functions
        why, done, count = advance(*self._tables, steps)
        events.append(self._read(count))
        return why, done

    def _settle(self) -> None:
        """Find the velocities that are admitted at present."""
        _, admit = SHIPPED.functions
        why = PAIRS_FULL
        while why == PAIRS_FULL:
            why, _, _ = admit(*self._tables, self.before + self.steps)
            if why == PAIRS_FULL:
                self._make_room()
        if why == NOT_FINITE:
            raise SolverError(self._what_is_not_finite())

    def _touch(self) -> None:
        """Let what touches at the start have closed before."""
        w, own = self.work, len(self.state["touches"])
        inequalities, per = self._values["inequalities"], own // self.bodies.total
        touch = w["listed"] != 0
        if per:
            touch[:own] &= np.arange(own) % per < inequalities
        self.state["touches"][:] = touch[:own]
        G, N = self._values["pair_gaps"], self.bodies.total
        rows = own + np.flatnonzero(touch[own:-1])
        self.state["counts"][KEPT] = len(rows)
        pairs = w["owner"][rows]
        self.state["keys"][: len(rows)] = (pairs[:, 0] * N + pairs[:, 1]) * G + (rows - own) % max(
            G, 1
        )
        self.state["pair_touches"][: len(rows)] = 1

    def _make_room(self) -> None:
        """Double the room for pairs of neighbours."""
        held, room, chosen = self.state, self.work["room"], self.work["forced"]
        self.capacity *= 2
        self._allocate()
        for name, array in held.items():
            self.state[name][: len(array)] = array
        self.work["room"][:], self.work["forced"][:] = room, chosen

    def _split(self) -> list[EventTable]:
        """Go on in each of the pieces that meet where a step was stopped; take the nearest."""
        body, union = self.work["status"][[BODY, UNION]].tolist()
        meeting, corner = self.work["meeting"].tolist(), self.work["x"][body].copy()
        pieces = meeting[: meeting.index(-1)]
        time = self.time + float(self.work["room"][PART]) * self.dt
        kept = {name: array.copy() for name, array in self.state.items()}
        forced = self.work["forced"].copy()
        ends, far = [], []
        for piece in pieces:
            self.work["forced"][:] = forced
            self.work["forced"][body, union] = piece
            self._step_once()
            ends.append(self._at_present())
            gone = self.work["d"][body] - self.work["wish"][body]
            far.append(float(gone @ self.work["metric"][body] @ gone))
            self._put_back(kept)
        near = self._values["touching"] / self.bodies.body.units
        apart = any((abs(end.q - ends[0].q) > near).any() for end in ends)
        taken = int(np.argmin(np.round(far, 12)))
        self.work["forced"][:] = forced
        self.work["forced"][body, union] = pieces[taken]
        if not apart:
            return []
        self.splits.append(Split(time, body, corner, self._named(pieces), tuple(ends), taken))
        whole = np.array([[int(EventKind.SPLIT), body, -1, -1]])
        return [EventTable(whole, np.array([[time, 0.0]]), self.bodies.contact_names)]

    def _step_once(self) -> None:
        """Take a step; where it is stopped at further corners, in the first of the pieces there."""
        while (why := self._run(1, [])[0]) != DONE:
            if why == SPLIT:
                body, union = self.work["status"][[BODY, UNION]].tolist()
                self.work["forced"][body, union] = self.work["meeting"][0]
            elif why == PAIRS_FULL:
                self._make_room()
            elif why == NOT_FINITE:
                raise SolverError(self._what_is_not_finite())

    def _named(self, pieces: list[int]) -> tuple[tuple[str, ...], ...]:
        """Return pieces of unions by the names of their functions."""
        rows, start = self._values["rows"], self._values["row_of_piece"]
        names = self.drift.polyhedron.names
        return tuple(tuple(names[r] for r in rows[start[p] : start[p + 1]]) for p in pieces)

    def _at_present(self) -> State:
        q = self.state["q"].copy()
        self._settle()
        shape = q.shape if self.bodies.total > 1 else q.shape[1:]
        v = self.work["v"].reshape(shape).copy()
        return State(self.time, q.reshape(shape), v, np.zeros((*shape[:-1], 0), dtype=np.bool_))

    def _put_back(self, kept: Arrays) -> None:
        for name, array in kept.items():
            self.state[name][: len(array)] = array

    def _read(self, count: int) -> EventTable:
        """Return the events in the log, whose contacts are numbered as their names are."""
        whole, numbers = self._log["entries"][:count].copy(), self._log["numbers"][:count].copy()
        known = self.bodies.contact_names
        families = self.bodies.families.values()
        every = (*self.bodies.body.contacts, *(n for f in families for n in f.gaps.names))
        order = np.array([known.index(name) for name in every], dtype=np.int64)
        some = whole[:, 3] >= 0
        whole[some, 3] = order[whole[some, 3]]
        return EventTable(whole, numbers, known)

    def _what_is_not_finite(self) -> str:
        """Return a sentence on why the next step cannot be computed."""
        for i, q in enumerate(self.state["q"]):
            who = f" of {self.bodies.called(i)}" if self.bodies.total > 1 else ""
            named = zip(self.drift.manifold.names, q.tolist(), strict=True)
            where = ", ".join(f"{name} = {x:.6g}" for name, x in named)
            B = self.drift.mobility_at(q)
            if not np.isfinite(B).all() or not np.linalg.eigvalsh(B)[0] > 0:
                return f"the mobility{who} at {where} is not positive definite"
            u = self.drift.wished(q, self.time)
            if not np.isfinite(u).all():
                return f"the wished velocity{who} at t = {self.time:.6g}, {where} is not finite"
        return f"the wished velocities soon after t = {self.time:.6g} are not finite"

    def save(self) -> dict[str, Any]:
        """Return the arrays that are the state, bit for bit (not copied)."""
        splits, known = self.splits, self._pieces()
        most = max((len(s.pieces) for s in splits), default=0)
        pieces = np.full((len(splits), most), -1)
        ends = np.zeros((len(splits), most, *self.state["q"].shape))
        for split, row, places in zip(splits, pieces, ends, strict=True):
            for k, (piece, state) in enumerate(zip(split.pieces, split.states, strict=True)):
                row[k] = known.index(piece)
                places[k] = state.q.reshape(places[k].shape)
        return {
            **self.state,
            "v": self.work["v"],
            "sticks": self.motion.sticks,
            "split_times": np.array([[s.time, s.states[0].time] for s in splits]).reshape(-1, 2),
            "split_bodies": np.array([[s.body, s.taken] for s in splits], np.int64).reshape(-1, 2),
            "split_places": np.array([s.q for s in splits]).reshape(-1, self.bodies.dimension),
            "split_pieces": pieces,
            "split_ends": ends,
        }

    def _pieces(self) -> list[tuple[str, ...]]:
        return list(self._named([*range(len(self._values["row_of_piece"]) - 1)]))

    def load(self, arrays: Mapping[str, Any]) -> None:
        """Continue, bit for bit, from arrays saved before.

        Raises
        ------
        TypeError, ValueError
            Naming the array.
        """
        while self._values["pair_gaps"] * self.capacity < len(arrays["keys"]):
            self.capacity *= 2
        self._allocate()
        for name, array in self.state.items():
            saved = np.asarray(arrays[name])
            shape = saved.shape if name in PAIRED else array.shape
            forms.array(name, saved, "f" if array.dtype == np.float64 else "i", shape)
            array[: len(saved)] = saved
        counts = self.state["counts"]
        forms.array("counts", counts, "i", counts.shape, least=0)
        if counts[KEPT] > len(arrays["keys"]):
            refuse("counts", f"at most {len(arrays['keys'])} contacts", int(counts[KEPT]))
        self._settle()
        self._load_splits(arrays)

    def _load_splits(self, arrays: Mapping[str, Any]) -> None:
        known, self.splits = self._pieces(), []
        taken, pieces = arrays["split_bodies"], arrays["split_pieces"]
        forms.array("split_pieces", pieces, "i", (len(taken), -1), least=-1, most=len(known) - 1)
        shape = self.state["q"].shape if self.bodies.total > 1 else (self.bodies.dimension,)
        for k, (body, chosen) in enumerate(taken.tolist()):
            time, end = arrays["split_times"][k].tolist()
            told = tuple(known[p] for p in pieces[k].tolist() if p >= 0)
            states = tuple(
                State(end, q.reshape(shape), np.zeros(shape), np.zeros((*shape[:-1], 0), np.bool_))
                for q in arrays["split_ends"][k, : len(told)]
            )
            place = np.array(arrays["split_places"][k])
            self.splits.append(Split(time, body, place, told, states, chosen))

    def resume(self, arrays: Mapping[str, Any]) -> None:
        """Go on from the end of another run, with accounts of its own."""
        kept = np.zeros_like(arrays["counts"])
        kept[[STEPS, KEPT]] = arrays["counts"][[STEPS, KEPT]]
        self.load({**arrays, "counts": kept, "sums": np.zeros_like(arrays["sums"])})
        self.before, self.splits = int(kept[STEPS]), []

    def energies(self) -> tuple[float, float]:
        """Return no kinetic energy, and the potential one of the bodies that have not left."""
        if self.drift.energy is None:
            return 0.0, 0.0
        alive = self.state["alive"] != 0
        return 0.0, float(np.sum(self.drift.energy.value(self.state["q"][alive])))

    def energy_of(self, body: int) -> float:
        """Return the potential energy of one body, also when it has left."""
        energy, q = self.drift.energy, self.state["q"][body]
        return 0.0 if energy is None else float(energy.value(q))

    def touching(self) -> list[tuple[tuple[int, ...], str, float]]:
        """Return the contacts that touch, and all equations: bodies, name, and force at present."""
        return list(self._touching())

    def _touching(self) -> Iterator[tuple[tuple[int, ...], str, float]]:
        w, names = self.work, self.bodies.body.contacts
        m, per = len(names), len(names) + len(self.drift.limits)
        own = self.bodies.total * per
        pairs = w["status"][0] * self._values["pair_gaps"]
        for r in np.flatnonzero(w["listed"][: own + pairs]).tolist():
            i, j = w["owner"][r].tolist()
            if r < own and r % per < m and self.state["alive"][i]:
                yield (i,), names[r % per], float(w["force"][r])
            elif r >= own:
                family = self.bodies.families[0, 0]
                name = family.gaps.names[(r - own) % len(family.gaps.names)]
                yield (i, j), name, float(w["force"][r])

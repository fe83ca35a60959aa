"""The engine: bodies in motion, advanced step by step by compiled code."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from polycorner.checks import fits, refuse
from polycorner.errors import SolverError
from polycorner.formulas.tables import Layout
from polycorner.motion.bodies import MovingBodies
from polycorner.motion.engine.allocation import (
    allocate,
    own_workspace,
    restored,
    size_of,
    workspace,
)
from polycorner.motion.engine.arrays import (
    CONTACTS,
    CONTACTS_FULL,
    ISLANDS,
    LEFT_OVER,
    NEWTON_STEPS,
    NOT_FINITE,
    PARTS,
    RESIDUAL,
    STEPS,
    SWEEPS,
    UNSOLVED,
    EngineState,
    Log,
    declarations,
)
from polycorner.motion.engine.intermediate import ANY, compiled_advance
from polycorner.motion.engine.layout import model_of, tied_events
from polycorner.motion.engine.sizes import Sizes
from polycorner.motion.engine.threads import assisted
from polycorner.motion.events import EventTable, joined
from polycorner.motion.formulation import moment
from polycorner.motion.noise import Noise, Solver
from polycorner.spaces.manifold import Array

CONTACTS_PER_BODY = 8  # for which there is room at first
LARGEST_KEY = 2.0**63


@dataclass(frozen=True)
class Effort:
    """What a simulation cost, and how well its steps were solved.

    Attributes
    ----------
    steps, islands, sweeps, newton_steps : int
        Steps; islands of touching bodies solved; Gauss-Seidel sweeps and Newton steps in them.
    unconverged : int
        Islands left with a residual above the tolerance.
    residual : float
        The worst residual, relative to the speeds in its island.
    parts : int
        Shorter steps that islands took.
    """

    steps: int
    islands: int
    sweeps: int
    newton_steps: int
    unconverged: int
    residual: float
    parts: int = 0


class Engine:
    """Bodies in motion.

    Parameters
    ----------
    bodies : MovingBodies
    q, v : (N, k) array
        Zero beyond the coordinates of a body, where kinds have different numbers of them.
    sticking : array of bool
        Which friction contacts stick, body after body.
    dt : float
        Step, in s.
    start : float
        Time of the first state.
    noise : Noise
    solver : Solver, optional
    """

    def __init__(
        self,
        bodies: MovingBodies,
        q: Array,
        v: Array,
        sticking: NDArray[np.bool_],
        dt: float,
        *,
        start: float = 0.0,
        noise: Noise,
        solver: Solver | None = None,
    ) -> None:
        self.bodies, self.dt, self.start, self.noise = bodies, float(dt), float(start), noise
        self.before = 0  # steps that were done before this run
        self.capacity = max(16, CONTACTS_PER_BODY * bodies.total)
        self._own, self._pairs = _own_contacts(bodies), _pair_contacts(bodies)
        self._first_tied = tied_events(bodies)
        self._check_size()
        self.model = model_of(bodies, self._sizes, noise, solver or Solver(), self.start, self.dt)
        self.motion = allocate(EngineState, self._sizes)
        self.motion.q[:], self.motion.v[:], self.motion.sticks[:] = q, v, np.ravel(sticking)
        self.motion.rank[:] = self.motion.body_of_rank[:] = np.arange(bodies.total)
        for first, end in zip(self.model.first_equation, self.model.first_gap[1:], strict=True):
            self.motion.touches[first:end] = 1
        for first, end in zip(
            self.model.first_nonholonomic, self.model.first_limit[1:], strict=True
        ):
            self.motion.limit_acts[first:end] = 1
        self._mark_slips()
        self._start_ties()
        self._allocate()

    def _mark_slips(self) -> None:
        """Mark contacts with surroundings that stick although they slip."""
        motion, found, share = self.motion, [], self.model.tolerance
        for kind, at in self.bodies.slices:
            law, k, v = kind.body.formulation, kind.dimension, motion.v[at, : kind.dimension]
            known = law.at(kind.body.parameters, self.start)
            slips, slopes = law.slip_velocities(known, np.hstack([motion.q[at, :k], v]))
            terms = slopes[:, :, k:] * v[:, None]
            size = np.abs(terms).sum(axis=2) + np.abs(slips - terms.sum(axis=2))
            left = np.zeros((len(v), sum(contact.rows for contact in kind.body.friction)), bool)
            left[:, : slips.shape[1]] = np.abs(slips) > share * size
            found.append(left.ravel())
        if motion.sticks.size:
            starts = self.model.slip_start[:-1]
            slipping = np.logical_or.reduceat(np.concatenate(found), starts)
            motion.sticks[(motion.sticks != 0) & slipping] = LEFT_OVER

    def _start_ties(self) -> None:
        """Let equations of ties touch, and friction of ties stick where its slip is zero."""
        model, motion, ties = self.model, self.motion, self.bodies.ties
        for t, form in enumerate(ties.form):
            limits = model.tie_rows[t] + ties.forms[form].limits
            motion.tie_touches[limits : model.tie_rows[t + 1]] = 1
        for which, (slips,) in ties.evaluate("slips", motion.q, motion.v, self.start):
            for t, row in zip(which, slips, strict=True):
                for x in range(model.tie_frictions[t], model.tie_frictions[t + 1]):
                    begin = model.tie_slip_start[x]
                    motion.tie_sticks[x] = not row[begin : begin + model.tie_slip_rows[x]].any()

    @property
    def _sizes(self) -> Sizes:
        return Sizes.of(self.bodies, self.capacity)

    def _check_size(self) -> None:
        """Raise ValueError if there are more bodies or contacts than memory and keys can hold."""
        sizes, N = self._sizes, self.bodies.total
        what = f"the steps of {N} bodies with {sizes.U} gaps to their surroundings"
        fits("count", size_of(sizes), what)
        # Keys of pairs are sorted with an index as their last digit.
        if float(N) * N * max(1, sizes.G) * sizes.C >= LARGEST_KEY:
            refuse("count", "bodies whose contacts can be numbered in 63 bits", N)

    def _allocate(self) -> None:
        """Allocate the workspace, and tell compiled code where everything is."""
        sizes = self._sizes
        self.work, self.log = workspace(sizes), allocate(Log, sizes)
        if self.model.timed:
            for velocity in self.work.velocity:
                velocity[:, sizes.k] = 1.0  # of the time
        self.model = self.model._replace(contact_room=sizes.C, neighbour_room=sizes.P)
        others = range(self.model.threads - 1)
        self._works = [self.work, *(own_workspace(self.work, sizes) for _ in others)]
        shared = [_table_of(record) for record in (self.model, self.motion, self.log)]
        parts = [[_table_of(part) for part in work] for work in self._works]
        own = [np.array([part.ctypes.data for part in tables]) for tables in parts]
        self._tables = (shared, parts, own)  # kept as long as they are used
        model, motion, log = (table.ctypes.data for table in shared)
        self._addresses = [np.array([model, motion, work.ctypes.data, log]) for work in own]

    @property
    def time(self) -> float:
        """The time of the present state."""
        return self.start + (self.before + self.steps) * self.dt

    @property
    def steps(self) -> int:
        """The number of steps done in this run."""
        return int(self.motion.counts[STEPS]) - self.before

    @property
    def effort(self) -> Effort:
        """The cost so far."""
        counts, sums = self.motion.counts.tolist(), self.motion.sums
        return Effort(
            steps=self.steps,
            islands=counts[ISLANDS],
            sweeps=counts[SWEEPS],
            newton_steps=counts[NEWTON_STEPS],
            unconverged=counts[UNSOLVED],
            residual=float(sums[RESIDUAL]),
            parts=counts[PARTS],
        )

    def advance(self, steps: int) -> EventTable:
        """Advance by so many steps and return the events in them."""
        # Compiles the engine, unless the cache has it.
        advance = compiled_advance(self.bodies.width if len(self.bodies.kinds) == 1 else ANY)
        events: list[EventTable] = []
        while steps > 0:
            first, *others = self._addresses
            with assisted(advance, self.work, others):
                why, done, count = advance(first, steps)
            events.append(self._read(count))
            steps -= done
            if why == NOT_FINITE:
                raise SolverError(self._what_is_not_finite())
            if why == CONTACTS_FULL:
                self._make_room()
            elif not done and not count:
                msg = f"the step after t = {self.time:.6g} cannot be begun: events have no room"
                raise SolverError(msg)
        return joined(events, self.bodies.contact_names)

    def _make_room(self) -> None:
        """Double the room for contacts, unless there was enough for all that there can be."""
        pairs = self.bodies.total * (self.bodies.total - 1) // 2
        # Twice, as those of sleepers are kept.
        if self.capacity >= 2 * pairs * self.model.most_pair_gaps:
            msg = f"the step after t = {self.time:.6g} finds more contacts than there can be"
            raise SolverError(msg)
        self.capacity *= 2
        try:
            self._check_size()
            self.load(self.save())
        except ValueError as error:
            msg = f"{error}, at t = {self.time:.6g}"
            raise SolverError(msg) from error

    def __reduce__(self) -> NoReturn:
        msg = "an engine cannot be copied or pickled: load what it saves into another"
        raise TypeError(msg)

    def _what_is_not_finite(self) -> str:
        """Return a sentence on why the next step cannot be computed."""
        bodies, motion = self.bodies, self.motion
        for i in np.flatnonzero(motion.alive).tolist():
            kind = bodies.kinds[bodies.kind_of[i]]
            body, names = kind.body, kind.body.formulation.coordinates
            parameters = self._parameters(int(bodies.kind_of[i]))
            q, v = motion.q[i, : len(names)], motion.v[i, : len(names)]
            which = f" of {bodies.called(i)}" if bodies.total > 1 else ""
            state = ", ".join(f"{name} = {x:.6g}" for name, x in zip(names, q, strict=True))
            where = f"{which} at t = {self.time:.6g}, {state}"
            middle = q + 0.5 * self.dt * v
            at = moment(body.formulation, parameters, middle, v)
            if not np.isfinite(at.mass).all() or np.linalg.eigvalsh(at.mass)[0] <= 0:
                return f"the mass matrix{where} is not positive definite"
            for name, force in zip(names, at.force, strict=True):
                if not np.isfinite(force):
                    return f"the force on {name}{where} is {force}"
            gaps = self.work.mid.gap[slice(*self.model.first_gap[i : i + 2])]
            for name, gap in zip(body.contacts, gaps, strict=True):
                if np.isnan(gap):
                    return f"the gap {name!r}{where} is not a number"
            if body.limits is not None:
                (values,) = body.limits.rows.evaluate(np.concatenate([q, v, [self.time]]))
                for name, value in zip(body.limits.names, values, strict=True):
                    if np.isnan(value):
                        return f"the limit {name!r}{where} is not a number"
        for row in np.flatnonzero(np.isnan(self.work.tie.gap)):
            return f"{bodies.ties.names[row]!r} is not a number at t = {self.time:.6g}"
        for t in np.flatnonzero(~np.isfinite(self.work.tie.force).all(axis=1)):
            tied = " and ".join(bodies.called(i) for i in bodies.ties.bodies[t] if i >= 0)
            return f"a force of a tie of {tied} at t = {self.time:.6g} is not finite"
        return f"the velocities after t = {self.time:.6g}, dt = {self.dt:.6g} later, are not finite"

    def _parameters(self, kind: int) -> Array:
        """Return the parameters of a kind's equations of motion, with the time."""
        first = self.model.force_parameters[kind]
        count = len(self.bodies.kinds[kind].body.parameters)
        return np.asarray(self.model.parameters[first : first + count])

    def _read(self, count: int) -> EventTable:
        whole, numbers = self.log.entries[:count].copy(), self.log.numbers[:count].copy()
        first = self._first_tied
        gaps = (whole[:, 3] >= 0) & (whole[:, 3] < first)
        of_pair, own = gaps & (whole[:, 2] >= 0), gaps & (whole[:, 2] < 0)
        whole[whole[:, 3] >= first, 3] -= first
        whole[own, 3] = self._own[whole[own, 3]]
        i, j, g = whole[of_pair, 1:].T
        whole[of_pair, 3] = self._between(i, j, g)
        numbers[:, 0] += self.start
        return EventTable(whole, numbers, self.bodies.contact_names)

    def save(self) -> dict[str, Any]:
        """Return the arrays that are the state, bit for bit (not copied)."""
        return dict(self.motion._asdict())

    def load(self, arrays: dict[str, Any]) -> None:
        """Continue, bit for bit, from arrays saved before, with at least as much room."""
        order = np.arange(self.bodies.total)  # that of states saved before bodies had ranks
        untied: dict[str, Any] = {
            name: [] for name in EngineState._fields if name.startswith(("tie_", "limit_"))
        }
        stops = np.zeros(self.bodies.frictions, dtype=np.int64)  # of states saved before scatter
        arrays = {"rank": order, "body_of_rank": order, "stopped": stops, **untied, **arrays}
        arrays |= self._sleepers(arrays)
        while self.capacity < len(arrays["keys"]):
            self.capacity *= 2
        self.bodies.check_places(arrays["q"], arrays["v"], self.dt)
        self.motion = restored(EngineState, self._sizes, arrays)
        self._allocate()

    def _sleepers(self, arrays: Mapping[str, Any]) -> dict[str, Any]:
        """Return who sleeps, and in which pile: none that the noise of this run moves.

        States saved before there were piles have all bodies awake.
        """
        asleep = arrays["asleep"]
        pile = arrays.get("pile", np.ones_like(asleep))
        moved = np.isin(pile, pile[np.asarray(self.model.still) == 0]) & (pile > 0)
        woken = moved if "pile" in arrays else np.ones_like(moved)
        return {"asleep": np.where(woken, 0, asleep), "pile": np.where(woken, 0, pile)}

    def resume(self, arrays: Mapping[str, Any]) -> None:
        """Go on from the end of another run, with accounts of its own."""
        kept = np.zeros_like(arrays["counts"])
        kept[[CONTACTS, STEPS]] = arrays["counts"][[CONTACTS, STEPS]]
        # What the noise of this run moves may have been left alone until some later step.
        due = np.where(np.asarray(self.model.still) == 0, 0, arrays["check_due"])
        fresh = {"counts": kept, "sums": np.zeros_like(arrays["sums"]), "check_due": due}
        self.load({**arrays, **fresh})
        self.before = int(kept[STEPS])

    def energies(self) -> tuple[float, float]:
        """Return kinetic and potential energy of the bodies that have not left."""
        total = self._energies()[self.motion.alive != 0].sum(axis=0)
        return float(total[0]), float(total[1]) + self.bodies.ties.energy(self.motion.q)

    def energy_of(self, body: int) -> float:
        """Return the energy of one body, also when it has left."""
        return float(self._energies()[body].sum())

    def _energies(self) -> Array:
        found = []
        for a, (kind, at) in enumerate(self.bodies.slices):
            k, kernel = kind.dimension, kind.body.formulation.energies.kernel
            state = np.concatenate([self.motion.q[at, :k], self.motion.v[at, :k]], axis=1)
            # Up to the end: kernels of bodies without parameters read one number as well.
            known = self.model.parameters[self.model.force_parameters[a] :]
            (values,) = kernel.over(state, known.ctypes.data, 0)
            found.append(values)
        return np.concatenate(found)

    def touching(self) -> list[tuple[tuple[int, ...], str, float]]:
        """Return the contacts that touch, and all equations: bodies, name, and normal force."""
        motion, h, names = self.motion, self.dt, self.bodies.contact_names
        touching = np.flatnonzero(motion.touches)
        of_gap = np.searchsorted(self.model.first_gap, touching, side="right") - 1
        own: list[tuple[tuple[int, ...], str, float]] = [
            ((int(i),), names[self._own[g]], float(motion.normal[g]) / h)
            for i, g in zip(of_gap.tolist(), touching.tolist(), strict=True)
            if motion.alive[i]
        ]
        pairs = np.flatnonzero(motion.pair_flags[: int(motion.counts[CONTACTS]), 1])
        keys, gaps = np.divmod(motion.keys[pairs], max(1, self.model.most_pair_gaps))
        ranks = np.stack(np.divmod(keys, self.bodies.total))
        first, second = np.sort(motion.body_of_rank[ranks], axis=0)
        forces = (motion.pair_impulse[pairs, 0] / h).tolist()
        which = self._between(first, second, gaps).tolist()
        bodies = zip(first.tolist(), second.tolist(), strict=True)
        between = zip(bodies, which, forces, strict=True)
        pairs_too = ((two, names[c], force) for two, c, force in between)
        return [*own, *pairs_too, *self._tied(), *self._limited()]

    def _tied(self) -> Iterator[tuple[tuple[int, ...], str, float]]:
        """Yield limits that touch, and equations, of ties."""
        ties, motion, starts = self.bodies.ties, self.motion, self.model.tie_rows
        for row in np.flatnonzero(motion.tie_touches):
            i, j = ties.bodies[int(np.searchsorted(starts, row, side="right")) - 1]
            force = float(motion.tie_normal[row]) / self.dt
            yield ((i,) if j < 0 else (i, j)), ties.names[row], force

    def _limited(self) -> Iterator[tuple[tuple[int, ...], str, float]]:
        """Yield limits on velocities that act, and nonholonomic equations."""
        motion, first = self.motion, self.model.first_limit
        names = [self.bodies.kinds[a].body.limit_names for a in self.bodies.kind_of]
        for g in np.flatnonzero(motion.limit_acts).tolist():
            i = int(np.searchsorted(first, g, side="right")) - 1
            if motion.alive[i]:
                yield (i,), names[i][g - int(first[i])], float(motion.limit_force[g]) / self.dt

    def pair_of(self, s: int) -> tuple[tuple[int, int], int]:
        """Return the two bodies of a contact in the list, the lower number first, and the gap."""
        pair, g = divmod(int(self.motion.keys[s]), max(1, self.model.most_pair_gaps))
        ranks = np.array(divmod(pair, self.bodies.total))
        i, j = sorted(self.motion.body_of_rank[ranks].tolist())
        return (i, j), g

    def _between(
        self, i: NDArray[np.int64], j: NDArray[np.int64], gaps: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """Return the numbers of contacts between bodies among the names of all."""
        kinds = self.bodies.kind_of
        return np.asarray(self._pairs[self.model.family[kinds[i], kinds[j]], gaps])


def _pair_contacts(bodies: MovingBodies) -> NDArray[np.int64]:
    """Return for the gaps between bodies of each family the numbers of their names."""
    numbers = {name: n for n, name in enumerate(bodies.contact_names)}
    families = [family.gaps.names for family in bodies.families.values()]
    table = np.zeros((len(families), max(map(len, families), default=0)), dtype=np.int64)
    for row, names in zip(table, families, strict=True):
        row[: len(names)] = [numbers[name] for name in names]
    return table


def _own_contacts(bodies: MovingBodies) -> NDArray[np.int64]:
    """Return for the gaps between all bodies and their surroundings the numbers of their names."""
    known, found = bodies.contact_names, [np.empty(0, dtype=np.int64)]
    for kind in bodies.kinds:
        every = np.array([known.index(name) for name in kind.body.contacts], dtype=np.int64)
        found.append(np.tile(every, kind.count))
    return np.concatenate(found)


def _table_of(record: Any) -> NDArray[np.int64]:
    """Return the table by which compiled code finds a record, whose arrays have to be kept."""
    table, _ = Layout(declarations(record)).table(record)
    return np.frombuffer(table, dtype=np.int64)

"""The engine: bodies in motion, advanced step by step by compiled code."""

from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from polycorner.errors import SolverError
from polycorner.formulas.tables import Layout
from polycorner.motion.bodies import IdenticalBodies
from polycorner.motion.engine.allocation import allocate, own_workspace, restored, workspace
from polycorner.motion.engine.arrays import (
    CONTACTS,
    CONTACTS_FULL,
    ISLANDS,
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
from polycorner.motion.engine.intermediate import compiled_advance
from polycorner.motion.engine.layout import model_of
from polycorner.motion.engine.sizes import Sizes
from polycorner.motion.engine.threads import assisted
from polycorner.motion.events import EventTable, joined
from polycorner.motion.formulation import moment
from polycorner.motion.noise import Noise, Solver
from polycorner.spaces.manifold import Array

CONTACTS_PER_BODY = 8  # for which there is room at first


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
    """Identical bodies in motion.

    Parameters
    ----------
    bodies : IdenticalBodies
    q, v : (N, k) array
    sticking : (N, F) array of bool
        Which friction contacts stick.
    dt : float
        Step, in s.
    start : float
        Time of the first state.
    noise : Noise
    solver : Solver, optional
    """

    def __init__(
        self,
        bodies: IdenticalBodies,
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
        self.capacity = max(16, CONTACTS_PER_BODY * bodies.count)
        self.model = model_of(bodies, self._sizes, noise, solver or Solver(), self.start, self.dt)
        self.motion = allocate(EngineState, self._sizes)
        self.motion.q[:], self.motion.v[:], self.motion.sticks[:] = q, v, sticking
        self.motion.rank[:] = self.motion.body_of_rank[:] = np.arange(bodies.count)
        self.motion.touches[:, self.model.unilateral :] = 1
        self._allocate()

    @property
    def _sizes(self) -> Sizes:
        return Sizes.of(self.bodies, self.capacity)

    def _allocate(self) -> None:
        """Allocate the workspace, and tell compiled code where everything is."""
        sizes = self._sizes
        self.work, self.log = workspace(sizes), allocate(Log, sizes)
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
        return self.start + self.steps * self.dt

    @property
    def steps(self) -> int:
        """The number of steps done since the start."""
        return int(self.motion.counts[STEPS])

    @property
    def effort(self) -> Effort:
        """The cost so far."""
        counts, sums = self.motion.counts.tolist(), self.motion.sums
        return Effort(
            steps=counts[STEPS],
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
        advance = compiled_advance(self.bodies.dimension)
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
        pairs = self.bodies.count * (self.bodies.count - 1) // 2
        if self.capacity >= 2 * pairs * len(
            self.bodies.pair_contacts
        ):  # those of sleepers are kept
            msg = f"the step after t = {self.time:.6g} finds more contacts than there can be"
            raise SolverError(msg)
        self.capacity *= 2
        try:
            self.load(self.save())
        except ValueError as error:
            msg = f"{error}, at t = {self.time:.6g}"
            raise SolverError(msg) from error

    def __reduce__(self) -> NoReturn:
        msg = "an engine cannot be copied or pickled: load what it saves into another"
        raise TypeError(msg)

    def _what_is_not_finite(self) -> str:
        """Return a sentence on why the next step cannot be computed."""
        body, motion = self.bodies.body, self.motion
        names = body.formulation.coordinates
        parameters = self.model.parameters[: len(body.parameters)]  # with the time
        for i in np.flatnonzero(motion.alive):
            q, v = motion.q[i], motion.v[i]
            which = f" of body {i}" if self.bodies.count > 1 else ""
            state = ", ".join(f"{name} = {x:.6g}" for name, x in zip(names, q, strict=True))
            where = f"{which} at t = {self.time:.6g}, {state}"
            middle = q + 0.5 * self.dt * v
            at = moment(body.formulation, parameters, middle, v)
            if not np.isfinite(at.mass).all() or np.linalg.eigvalsh(at.mass)[0] <= 0:
                return f"the mass matrix{where} is not positive definite"
            for name, force in zip(names, at.force, strict=True):
                if not np.isfinite(force):
                    return f"the force on {name}{where} is {force}"
            for name, gap in zip(body.contacts, self.work.mid.gap[i], strict=True):
                if np.isnan(gap):
                    return f"the gap {name!r}{where} is not a number"
        return f"the velocities after t = {self.time:.6g}, dt = {self.dt:.6g} later, are not finite"

    def _read(self, count: int) -> EventTable:
        whole, numbers = self.log.entries[:count].copy(), self.log.numbers[:count].copy()
        between = (whole[:, 2] >= 0) & (whole[:, 3] >= 0)
        whole[between, 3] += len(self.bodies.body.contacts)
        numbers[:, 0] += self.start
        return EventTable(whole, numbers, self.bodies.contact_names)

    def save(self) -> dict[str, Any]:
        """Return the arrays that are the state, bit for bit (not copied)."""
        return dict(self.motion._asdict())

    def load(self, arrays: dict[str, Any]) -> None:
        """Continue, bit for bit, from arrays saved before, with at least as much room."""
        order = np.arange(self.bodies.count)  # that of states saved before bodies had ranks
        arrays = {"rank": order, "body_of_rank": order, **arrays}
        while self.capacity < len(arrays["keys"]):
            self.capacity *= 2
        self.bodies.check_places(arrays["q"], arrays["v"], self.dt)
        self.motion = restored(EngineState, self._sizes, arrays)
        self._allocate()

    def energies(self) -> tuple[float, float]:
        """Return kinetic and potential energy of the bodies that have not left."""
        total = self._energies()[self.motion.alive != 0].sum(axis=0)
        return float(total[0]), float(total[1])

    def energy_of(self, body: int) -> float:
        """Return the energy of one body, also when it has left."""
        return float(self._energies()[body].sum())

    def _energies(self) -> Array:
        kernel = self.bodies.body.formulation.energies.kernel
        at = np.concatenate([self.motion.q, self.motion.v], axis=1)
        (values,) = kernel.over(at, self.model.parameters.ctypes.data, 0)
        return values

    def touching(self) -> list[tuple[tuple[int, ...], str, float]]:
        """Return the contacts that touch, and all equations: bodies, name, and normal force."""
        motion, h = self.motion, self.dt
        own: list[tuple[tuple[int, ...], str, float]] = [
            ((int(i),), self.bodies.body.contacts[g], float(motion.normal[i, g]) / h)
            for i, g in np.argwhere(motion.touches != 0)
            if motion.alive[i]
        ]
        names = self.bodies.pair_contacts
        for s in np.flatnonzero(motion.pair_flags[: int(motion.counts[CONTACTS]), 1]):
            pair, g = divmod(int(motion.keys[s]), len(names))
            ranks = np.array(divmod(pair, self.bodies.count))
            bodies = tuple(sorted(motion.body_of_rank[ranks].tolist()))
            own.append((bodies, names[g], float(motion.pair_impulse[s, 0]) / h))
        return own


def _table_of(record: Any) -> NDArray[np.int64]:
    """Return the table by which compiled code finds a record, whose arrays have to be kept."""
    table, _ = Layout(declarations(record)).table(record)
    return np.frombuffer(table, dtype=np.int64)

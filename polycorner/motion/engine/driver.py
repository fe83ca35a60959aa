"""A running simulation: the compiled core with its state, work space and recorded events."""

from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.cache import one_at_a_time
from polycorner.motion.bodies import IdenticalBodies
from polycorner.motion.engine.layout import lay_out
from polycorner.motion.events import Event, EventKind
from polycorner.motion.noise import Noise, Solver
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.motion.engine.compiled import Motion, Room

CONTACTS_PER_BODY = 8  # for a start; more room is made when needed
EVENTS = 4096
BAND = 192  # columns of the widest band in which Newton's method is tried


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
    """

    steps: int
    islands: int
    sweeps: int
    newton_steps: int
    unconverged: int
    residual: float


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
        self.scene = lay_out(bodies, noise, solver or Solver())
        self.capacity = max(16, CONTACTS_PER_BODY * bodies.count)
        self.motion = _still(bodies, q, v, sticking, self.capacity)
        self.room = _room(bodies, self.capacity)
        self._events = np.empty((EVENTS + 4 * self.capacity, 4), dtype=np.int64)
        self._numbers = np.empty((len(self._events), 2))

    @property
    def time(self) -> float:
        """The time of the present state."""
        return self.start + int(self.motion.counts[1]) * self.dt

    @property
    def steps(self) -> int:
        """The number of steps done since the start."""
        return int(self.motion.counts[1])

    @property
    def effort(self) -> Effort:
        """What it cost so far."""
        counts, sums = self.motion.counts, self.motion.sums
        steps, unconverged, sweeps, newton, islands = (int(counts[i]) for i in (1, 2, 3, 4, 5))
        return Effort(steps, islands, sweeps, newton, unconverged, float(sums[4]))

    def advance(self, steps: int) -> list[Event]:
        """Advance by so many steps and return what happened."""
        compiled = self._core()
        happened: list[Event] = []
        while steps > 0:
            why, done, count = compiled.advance(
                self.scene, self.motion, self.room, self.dt, steps, self._events, self._numbers
            )
            happened += self._read(count)
            steps -= done
            if why == compiled.CROWDED:
                self._grow()
        return happened

    def _core(self) -> ModuleType:
        """Return the compiled core; the first call compiles it, unless another process has."""
        from polycorner.motion.engine import compiled

        if not compiled.advance.overloads:
            with one_at_a_time("motion"):
                compiled.advance(
                    self.scene, self.motion, self.room, self.dt, 0, self._events, self._numbers
                )
        return compiled

    def _read(self, count: int) -> list[Event]:
        contacts, names = self.bodies.body.contacts, self.bodies.pair_contacts
        events = []
        for (kind, i, j, which), (time, value) in zip(
            self._events[:count].tolist(), self._numbers[:count].tolist(), strict=True
        ):
            contact = "" if which < 0 else (contacts[which] if j < 0 else names[which])
            bodies = (i,) if j < 0 else (i, j)
            events.append(Event(self.start + time, EventKind(kind), bodies, contact, value))
        return events

    def _grow(self) -> None:
        self.capacity *= 2
        self.load({name: array.copy() for name, array in self.save().items()})

    def save(self) -> dict[str, Any]:
        """Return the arrays that are the state, bit for bit (not copied)."""
        return dict(self.motion._asdict())

    def load(self, arrays: dict[str, Any]) -> None:
        """Go on from arrays saved before, with as much room, so that it is bit for bit the same."""
        needed = len(arrays["keys"])
        while self.capacity < needed:
            self.capacity *= 2
        empty = _still(
            self.bodies, arrays["q"], arrays["v"], arrays["stick"].astype(np.bool_), self.capacity
        )
        for name, array in empty._asdict().items():
            saved = arrays[name]
            array[: min(len(array), len(saved))] = saved[: len(array)]
        self.motion = empty
        self.room = _room(self.bodies, self.capacity)
        self._events = np.empty((EVENTS + 4 * self.capacity, 4), dtype=np.int64)
        self._numbers = np.empty((len(self._events), 2))

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
        (values,) = kernel.over(at, self.scene.numbers.ctypes.data, 0)
        return values

    def touching(self) -> list[tuple[tuple[int, ...], str, float]]:
        """Return the contacts that touch: bodies, name, and the force that presses."""
        motion, h = self.motion, self.dt
        own: list[tuple[tuple[int, ...], str, float]] = [
            ((int(i),), self.bodies.body.contacts[g], float(motion.lam[i, g]) / h)
            for i, g in np.argwhere(motion.touch != 0)
            if motion.alive[i]
        ]
        count = int(motion.counts[0])
        gaps = len(self.bodies.pair_contacts)
        for s in np.flatnonzero(motion.flags[:count, 1]):
            pair, g = divmod(int(motion.keys[s]), gaps)
            bodies = divmod(pair, self.bodies.count)
            own.append((bodies, self.bodies.pair_contacts[g], float(motion.press[s, 0]) / h))
        return own


def _still(
    bodies: IdenticalBodies, q: Array, v: Array, sticking: NDArray[np.bool_], capacity: int
) -> "Motion":
    """Return the state of bodies that have not moved yet."""
    from polycorner.motion.engine.compiled import Motion

    N, k = bodies.count, bodies.dimension
    F, m = len(bodies.body.friction), len(bodies.body.contacts)

    def flags(*shape: int) -> Any:
        return np.zeros(shape, dtype=np.int64)

    return Motion(
        q=np.array(q, dtype=np.float64).reshape(N, k),
        v=np.array(v, dtype=np.float64).reshape(N, k),
        stick=np.array(sticking, dtype=np.int64).reshape(N, F),
        grip=np.zeros((N, F, 2)),
        lam=np.zeros((N, m)),
        touch=flags(N, m),
        alive=np.ones(N, dtype=np.int64),
        rests=flags(N),
        asleep=flags(N),
        worked=np.zeros((N, F, 2)),
        due=flags(N),
        since=flags(N),
        pull=np.zeros((N, k)),
        keys=flags(capacity),
        press=np.zeros((capacity, 3)),
        shove=np.zeros((capacity, 2 * k)),
        flags=flags(capacity, 2),
        counts=flags(8),
        sums=np.zeros(5 + len(bodies.causes)),
    )


def _room(bodies: IdenticalBodies, capacity: int) -> "Room":
    """Return the work space for bodies."""
    from polycorner.motion.engine.compiled import Room

    N, k = bodies.count, bodies.dimension
    F, m = len(bodies.body.friction), len(bodies.body.contacts)
    rows = sum(contact.rows for contact in bodies.body.friction)
    families = [bodies.body.formulation.forces, *(call.family for call in bodies.body.gaps)]
    if bodies.contacts is not None:
        families += [bodies.contacts.gaps, *(family for family, _, _ in bodies.contacts.slips)]
    outputs = [len(f.names) * (1 + len(f.variables)) + len(f.variables) for f in families]
    B = N * (F + m) + 2 * capacity
    pairs = min(N * (N - 1) // 2, 64 * N) if N > 1 else 0

    def whole(*shape: int) -> Any:
        return np.zeros(shape, dtype=np.int64)

    return Room(
        work=np.zeros(max([*outputs, rows * (1 + 2 * k) + 2 * k]) + 16),
        qm=np.zeros((N, k)),
        force=np.zeros((N, k)),
        applied=np.zeros((N, k)),
        kick=np.zeros((N, k)),
        inverse=np.zeros((N, k, k)),
        slope=np.zeros((N, rows, k)),
        drift=np.zeros((N, rows)),
        load=np.zeros((N, F)),
        gap=np.full((N, m), np.inf),
        normal=np.zeros((N, m, k)),
        ahead=np.zeros((N, k)),
        gap_then=np.zeros((N, m)),
        normal_then=np.zeros((N, m, k)),
        pair_then=np.zeros(len(bodies.pair_contacts)),
        awake=whole(N),
        asked=whole(N),
        speed=np.zeros(N),
        pace=np.zeros(N),
        error=np.zeros(N),
        shut=whole(N),
        root=whole(N),
        free=np.zeros((N, k)),
        new=np.zeros((N, k)),
        pull=np.zeros((N, k)),
        touched=whole(N),
        fit_grip=np.zeros((N, F, 2)),
        fit_lam=np.zeros((N, m)),
        seen_rest=whole(N),
        own=whole(m),
        size=whole(N + 1),
        next=whole(N + 1),
        pairs=whole(pairs, 2),
        listed=whole(2),
        seen=whole(pairs),
        where=np.zeros((N, 2)),
        near=whole(capacity, 3),
        near_gap=np.zeros(capacity),
        near_old=whole(capacity),
        near_press=np.zeros((capacity, 3)),
        near_normal=np.zeros((capacity, 2 * k)),
        body=whole(B, 2),
        rows=whole(B),
        press_by=whole(B),
        block_shape=whole(B),
        origin=whole(B, 4),
        weight=np.zeros(B),
        offset=np.zeros((B, 2)),
        slant=np.zeros((B, 2, 2 * k)),
        pushed=np.zeros((B, 2, 2 * k)),
        stiff=np.zeros((B, 4)),
        p=np.zeros((B, 2)),
        order=whole(B),
        mass=np.zeros((N, k, k)),
        turned=whole(B),
        best=np.zeros((B, 2)),
        hat=np.zeros((B, 2)),
        held=np.zeros(B),
        curve=np.zeros((B, 9)),
        answer=np.zeros((B, 2)),
        lean=np.zeros((B, 2 * k)),
        lead=np.zeros((B, 2)),
        jac=np.zeros((3, 2 * k)),
        bent=np.zeros((3, 2 * k)),
        square=np.zeros((k, k)),
        side=np.zeros(k),
        rest=np.zeros(k),
        two=np.zeros(2),
        image=np.zeros(12),
        slots=whole(max(capacity, pairs, 1)),
        members=whole(N),
        local=whole(N),
        ring=whole(N),
        chain=whole(B, 2),
        step=np.zeros(N * k),
        reach=whole(N * k),
        matrix=np.zeros(N * k * min(2 * N * k, BAND)),
    )

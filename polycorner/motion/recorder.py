"""Recording of a running engine as a trajectory."""

from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.motion.engine.driver import Engine
from polycorner.motion.events import EventKind, EventTable, joined
from polycorner.motion.trajectory import Touch, Trajectory

if TYPE_CHECKING:
    from polycorner.motion.mechanics import MechanicalSystem

WORK = ("substrate", "applied", "noise")


class Recorder:
    """Instants and events of one run."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.columns: dict[str, list[Any]] = {
            name: [] for name in ("t", "q", "v", "rests", "alive", "energies", "sums")
        }
        self.touching: list[tuple[Touch, ...]] = []
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
        self.left.append(self.gone)

    def advance(self, steps: int) -> None:
        """Advance the engine, recording events and the energy that leaves with bodies."""
        happened = self.engine.advance(steps)
        self.events.append(happened)
        for event in happened.of_kind(EventKind.EXIT):
            self.gone -= self.engine.energy_of(event.bodies[0])

    def trajectory(self, system: "MechanicalSystem", **run: Any) -> Trajectory:
        """Return what was recorded; ``run`` are the arguments of the simulation."""
        bodies, columns = self.engine.bodies, self.columns
        touching = [[t for t in some if t[1] not in system.hidden] for some in self.touching]
        sums, energies = np.array(columns["sums"]), np.array(columns["energies"])
        work = {name: sums[:, i] for i, name in enumerate(WORK)}
        if bodies.exit_coordinate >= 0:
            work["left"] = np.array(self.left)
        return Trajectory(
            system=system,
            dt=self.engine.dt,
            times=np.array(columns["t"]),
            q=np.array(columns["q"]),
            v=np.array(columns["v"]),
            rests=np.array(columns["rests"]),
            present=np.array(columns["alive"]),
            touching=tuple(map(tuple, touching)),
            kinetic=energies[:, 0],
            potential=energies[:, 1],
            dissipated={cause: sums[:, 5 + i] for i, cause in enumerate(bodies.causes)},
            work=work,
            events=joined(self.events, bodies.contact_names).in_time(),
            max_penetration=float(self.engine.motion.sums[3]),
            effort=self.engine.effort,
            **run,
        )

"""Recording of first-order motion as a trajectory."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from polycorner import forms
from polycorner.checks import refuse
from polycorner.motion.drifts import Drift
from polycorner.motion.recorder import Recorder
from polycorner.motion.scenes import FrictionTable
from polycorner.motion.sweeping.driver import DriftEngine
from polycorner.motion.sweeping.records import DRAG, NOISE, PENETRATION, STEPS, WISH
from polycorner.motion.trajectory import Trajectory


class DriftRecorder(Recorder):
    """Instants and events of one run of first-order motion."""

    engine: DriftEngine  # type: ignore[assignment]

    def begin(self) -> None:
        """Do nothing: velocities and forces are known at the start."""

    def _rubbing(self, instant: int) -> FrictionTable:  # noqa: ARG002  # there is no friction
        return FrictionTable()

    def load(self, state: Mapping[str, Any]) -> None:
        """Bring the engine to a saved state, which has to be that of the last instant."""
        engine, columns = self.engine, self.columns
        if (columns["q"][0] != engine.state["q"]).any():
            refuse("q", "the start of the run at first", columns["q"][0].tolist())
        steps = round((columns["t"][-1] - engine.start) / engine.dt)
        if int(np.asarray(state["counts"])[STEPS]) != steps:
            refuse("counts", f"{steps} steps, as were recorded", int(state["counts"][STEPS]))
        for name in ("q", "rests", "alive", "sums"):
            if (state[name] != columns[name][-1]).any():
                refuse(name, "the state at the last instant", "another one")
        engine.load(state)
        forms.array("energies", np.array(engine.energies()), "f", (2,))

    def trajectory(self, system: Drift, **run: Any) -> Trajectory:  # type: ignore[override]
        """Return what was recorded; ``run`` are the arguments of the simulation."""
        sums = np.array(self.columns["sums"])
        accounts = {"drag": sums[:, DRAG]}, {"velocity": sums[:, WISH], "noise": sums[:, NOISE]}
        return self._trajectory(
            system, *accounts, float(self.engine.state["sums"][PENETRATION]),
            splits=tuple(self.engine.splits), **run,
        )  # fmt: skip

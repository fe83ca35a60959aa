"""States, and the base of everything that a simulation can move."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.motion.bodies import MovingBodies
from polycorner.motion.charts import Chart
from polycorner.motion.noise import Solver
from polycorner.motion.scenes import Scene
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array
from polycorner.values import Checked, Value


@dataclass(frozen=True, eq=False)
class Memory(Value):
    """What the engine of a run knows beside placements and velocities, to go on bit for bit.

    Attributes
    ----------
    system : MechanicalSystem
    start, end, dt : float
        Times at which the run began and ended, and its step.
    arrays : mapping from str to array
    """

    system: "MechanicalSystem"
    start: float
    end: float
    dt: float
    arrays: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class State(Checked):
    """Placement, velocity, and the friction contacts that stick.

    Attributes
    ----------
    time : float
    q, v : (n,) or (N, k) array
        Coordinates (not wrapped, so that turns are counted) and velocities, of one body or of
        ``N`` bodies.
    sticking : (F,) or (N, F) array of bool
        For each friction contact, whether its slip was exactly zero: its static set holds.
    memory : Memory, optional
        Of ``Trajectory.last``: a run of the same system that goes on with the same step does so bit
        for bit.  Any other begins anew, from placements and velocities.
    """

    time: float
    q: Array
    v: Array
    sticking: NDArray[np.bool_]
    memory: Memory | None = None


class MechanicalSystem(Value, ABC):
    """Base of the systems that :func:`~polycorner.motion.simulation.simulate` moves.

    :class:`~polycorner.motion.system.System` is written in SymPy expressions; a model may derive
    from this class to bring formulas of its own.

    Attributes
    ----------
    chart : Chart or None
        Other coordinates in which motion is computed, if any.  An attribute and no field: systems
        with other laws, which ``replace`` makes, do not take it over.
    """

    chart: Chart | None = None

    @property
    @abstractmethod
    def bodies(self) -> MovingBodies:
        """The bodies and their contacts, for the engine."""

    @shown
    @abstractmethod
    def state(self, q: ArrayLike, v: ArrayLike | None = None, time: float = 0.0) -> State:
        """Return a state, after checking that nothing overlaps.

        Parameters
        ----------
        q : array
            Placement of all bodies.
        v : array, optional
            Velocities; by default every body is at rest on its substrate.
        time : float, optional
        """

    @abstractmethod
    def check_placement(self, q: Array) -> None:
        """Raise ValueError if bodies overlap, naming the worst contact."""

    @abstractmethod
    def largest_step(self, state: State) -> tuple[float, str]:
        """Return the largest step in s, and what limits it."""

    @abstractmethod
    def described(self) -> dict[str, Any]:
        """Return everything that a motion depends on, by name, as plain values."""

    @property
    def scene(self) -> Scene | None:
        """Names of the bodies in space, and where they touch; None if they are not known."""
        return None

    @property
    def hidden(self) -> frozenset[str]:
        """Names of equations whose forces are not recorded."""
        return frozenset()

    @property
    def solver(self) -> Solver:
        """How exactly steps are solved unless something else is asked for.

        To 1e-8 of the speeds, and to 1e-4 with at most 62 sweeps for more than two bodies that
        touch each other: errors of a step are errors of its velocities, not of what holds a pile,
        and a slip of 1e-4 of the speed of a drum's wall is 2 mm in four hours.
        """
        piles = self.bodies.total > 2 and self.bodies.families
        return Solver.piles() if piles else Solver()

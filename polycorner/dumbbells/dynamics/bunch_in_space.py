"""A bunch of rigid dumbbells in the drum, free to lift and to climb on each other.

The experiment of [GMBN] sec. 3.2 once more, with :class:`~polycorner.dumbbells.RigidDumbbells` in
place of dumbbells that lie on a developed drum.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum
from polycorner.dumbbells.dynamics.bunch import BunchRun, scattered, steps_between_records
from polycorner.dumbbells.dynamics.pairs import Handed
from polycorner.dumbbells.rigid import RigidDumbbells
from polycorner.motion import Checkpoint, Noise, simulate
from polycorner.toolkit import Array, Progress, cached_property, real

LAYER = 1.0  # of a ball's radius: dumbbells that are lifted less lie on the drum


@dataclass(frozen=True, eq=False)
class BunchInSpaceRun(BunchRun):
    """Analysis of the trajectory of a bunch of rigid dumbbells.

    Attributes
    ----------
    trajectory : Trajectory
        Of rigid dumbbells.
    rigid : RigidDumbbells
        What moves.
    """

    rigid: RigidDumbbells

    @property
    def drum(self) -> DumbbellDrum:
        """The drum."""
        return self.rigid.drum

    @cached_property
    def q(self) -> Array:
        """Placements ``phi, eta, theta`` as seen from the axis, ``(T, N, 3)``."""
        return self.rigid.placements(self.trajectory.q, self.times[:, None])

    @cached_property
    def lifts(self) -> Array:
        """Distances of the farther ball of each dumbbell from the drum, ``(T, N)``, in mm."""
        return self.rigid.lifts(self.trajectory.q)

    @property
    def weight_energy(self) -> Array:
        """Energy of the weight of all dumbbells present, ``(T,)``, in nJ.

        The potential of the trajectory is that in axes that turn, where the direction of the weight
        follows the time.
        """
        heights = self.rigid.seen(self.trajectory.q, self.times[:, None])[..., 1:3]
        down = GRAVITY * np.array([math.sin(self.drum.tilt), math.cos(self.drum.tilt)])
        energies = self.rigid.mass.mass * (heights @ down)
        return np.asarray(np.where(self.present, energies, 0.0).sum(axis=1))

    @property
    def climbed(self) -> Array:
        """How many dumbbells in the drum do not lie on it, ``(T,)``."""
        return np.asarray((self.present & ~self._on_drum).sum(axis=1))

    @property
    def _on_drum(self) -> NDArray[np.bool_]:
        return np.asarray(self.lifts <= LAYER * self.drum.ball_radius)

    def dyads(self, index: int) -> list[Handed]:
        """Return the dyads among dumbbells that lie on the drum; see :meth:`BunchRun.dyads`."""
        lie = self._on_drum[index]
        return [(i, j, hand) for i, j, hand in super().dyads(index) if lie[i] and lie[j]]


def kicks_of_centres(drum: DumbbellDrum, strength: float) -> dict[str, float]:
    """Return the kicks under which the velocity of a centre diffuses.

    Each component by ``strength``, in mm/s per sqrt(s); see :class:`~polycorner.Noise`.
    """
    size = real("strength", strength, least=0) * RigidDumbbells(drum).mass.mass
    return dict.fromkeys(["xD", "yD", "zD"], size)


def follow_in_space(
    drum: DumbbellDrum,
    duration: float,
    *,
    start: int | Array = 0,
    noise: Noise | None = None,
    dt: float = 2e-3,
    interval: float = 0.5,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
) -> BunchInSpaceRun:
    """Follow a bunch of rigid dumbbells for ``duration`` s.

    Parameters
    ----------
    drum : DumbbellDrum
        With a bottom, as of :func:`~polycorner.dumbbells.dynamics.bunch.drum_for_bunch`.
    start : int or (count, 3) array, optional
        The seed of a :func:`~polycorner.dumbbells.dynamics.bunch.scattered` start, or placements.
    noise : Noise, optional
        None by default.  Loads follow from the motion, so that there is no chatter.
    dt, interval : float, optional
        Step, and time between records, in s.
    progress, checkpoint : optional
        See :func:`~polycorner.motion.simulation.simulate`.
    """
    every = steps_between_records(drum, dt, interval)
    if drum.shaking is not None:
        real("dt", dt, most=drum.shaking.longest_step, unit="s")
    rigid = RigidDumbbells(drum)
    q = start if isinstance(start, np.ndarray) else scattered(drum, np.random.default_rng(start))
    path = simulate(
        rigid.system, rigid.state(q), duration, dt,
        every=every, noise=noise, progress=progress, checkpoint=checkpoint,
    )  # fmt: skip
    return BunchInSpaceRun(path, rigid)

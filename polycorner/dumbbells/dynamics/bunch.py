"""A bunch of dumbbells at the bottom of the rotating drum: rollers, sliders, and exits at the top.

The experiment of [GMBN] sec. 3.2: 60 dumbbells are placed at the bottom, and after twenty minutes
some forty have left at the top, as right-handed dyads.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum, drum_of
from polycorner.dumbbells.dynamics.pairs import (
    LEFT_AS,
    MEMORY,
    DumbbellLengths,
    Handed,
    dyads_among,
    left_as,
)
from polycorner.dumbbells.dynamics.singles import Mean
from polycorner.dumbbells.dynamics.starts import scatter
from polycorner.dumbbells.rigid import RigidDumbbells
from polycorner.motion import Checkpoint, EventKind, Noise, Trajectory, simulate
from polycorner.toolkit import Array, Progress, Value, cached_property, instance, real, refuse

TOP = 300.0  # mm, length of the drum, which [GMBN] does not give
COUNT = 60
WIDTH = 0.35  # rad, half the width of the strip in which the bunch is placed
TRIES = 1000  # rejected draws in a row after which the strip grows
WINDOW = 10.0  # s, longer than a zigzag
ROLLING = math.radians(30.0)  # own spin within the window beyond which it counts as a roller
KINDS = tuple(LEFT_AS.values())
HANDS = {1: "right", -1: "left"}
STATES = ("free", "touched")  # of a dyad, by other dumbbells


def drum_for_bunch(drum: DumbbellDrum, *, count: int = COUNT, top: float = TOP) -> DumbbellDrum:
    """Return the drum with a flat bottom, an open top and ``count`` dumbbells."""
    return replace(drum, count=count, floor=True, top=top)


def scattered(drum: DumbbellDrum, rng: np.random.Generator, *, width: float = WIDTH) -> Array:
    """Return dumbbells scattered near the bottom without overlap, ``(count, 3)``.

    Positions and headings are uniform in a strip ``|phi| <= width``; a dumbbell that overlaps is
    drawn again, and the strip, at first two lengths high, grows by a tenth whenever it is full.
    """
    height = 2 * drum.length + 2 * drum.ball_radius
    return scatter(drum, rng, width=width, height=height, tries=TRIES)


@dataclass(frozen=True)
class Leaving:
    """A dumbbell that left at the top.

    Attributes
    ----------
    time : float
        In s.
    body : int
    kind : str
        In a ``right`` or ``left`` dyad, or ``single``.
    heading : float
        In the last record before, of a direction, in rad.
    alone : float
        For how long no other dumbbell had touched it, except those with which it was in a dyad in
        the last 100 s, in s.
    above : float
        How much higher it was than the mean of all when one touched it last, or at the beginning,
        in mm.
    """

    time: float
    body: int
    kind: str
    heading: float
    alone: float
    above: float


@dataclass(frozen=True, eq=False)
class BunchRun(Value):
    """Analysis of the trajectory of a bunch.

    Attributes
    ----------
    trajectory : Trajectory
        Of dumbbells in a drum.
    """

    trajectory: Trajectory

    @property
    def drum(self) -> DumbbellDrum:
        """The drum."""
        return drum_of(self.trajectory)

    @property
    def times(self) -> Array:
        """Times of the records, ``(T,)``."""
        return self.trajectory.times

    @property
    def q(self) -> Array:
        """Placements, ``(T, N, 4)``; those of dumbbells that have left stay as they were."""
        return self.trajectory.q

    @property
    def present(self) -> NDArray[np.bool_]:
        """Which dumbbells have not left, ``(T, N)``."""
        return self.trajectory.present

    @cached_property
    def exits(self) -> tuple[tuple[float, int], ...]:
        """Time of leaving at the top, and number."""
        return tuple((e.time, e.bodies[0]) for e in self.trajectory.of_kind(EventKind.EXIT))

    def dyads(self, index: int) -> list[Handed]:
        """Return the dyads at an instant: two numbers and the chirality +1 (right) or -1.

        By :func:`polycorner.dumbbells.dynamics.pairs.is_dyad`; a dumbbell may be in several.
        """
        return dyads_among(DumbbellLengths.of_drum(self.drum), self.q[index], self.present[index])

    @cached_property
    def exit_kinds(self) -> tuple[str, ...]:
        """Kind of each of the :attr:`exits`: in a ``right`` or ``left`` dyad, or ``single``.

        By :func:`polycorner.dumbbells.dynamics.pairs.left_as`.
        """
        return tuple(left_as(self.times, self.exits, self._handed.__getitem__))

    @cached_property
    def _handed(self) -> list[list[Handed]]:
        return [self.dyads(index) for index in range(len(self.times))]

    @cached_property
    def leavings(self) -> tuple[Leaving, ...]:
        """What is known of each of the :attr:`exits`."""
        return tuple(
            self._leaving(time, body, kind)
            for (time, body), kind in zip(self.exits, self.exit_kinds, strict=True)
        )

    def _leaving(self, time: float, body: int, kind: str) -> Leaving:
        first, stop = (int(np.searchsorted(self.times, t)) for t in (time - MEMORY, time))
        recent = (pair for index in range(first, stop) for pair in self._handed[index])
        dyads = {frozenset(pair[:2]) for pair in recent}
        touched = (
            index
            for index in reversed(range(stop))
            if any(body in pair for pair in self._touching(index, index) - dyads)
        )
        last = next(touched, 0)
        heights = self.q[last, self.present[last], 1]
        return Leaving(
            time,
            body,
            kind,
            math.remainder(float(self.q[stop - 1, body, 2]), math.pi),
            time - float(self.times[last]),
            float(self.q[last, body, 1] - heights.mean()),
        )

    def heap(self, index: int) -> int:
        """Return how many dumbbells the largest group has that touch each other."""
        import networkx as nx

        graph = nx.Graph(map(tuple, self._touching(index, index)))
        return max(map(len, nx.connected_components(graph)), default=1)

    def exit_counts(self) -> dict[str, int]:
        """Return how many left, by kind."""
        return {kind: self.exit_kinds.count(kind) for kind in KINDS}

    def census(self, index: int) -> dict[str, int]:
        """Return how many dumbbells are in right and left dyads, single, and present.

        Of several dyads the more frequent chirality counts; if they balance, ``both``.
        """
        hands: dict[int, int] = {}
        for i, j, hand in self.dyads(index):
            for body in (i, j):
                hands[body] = hands.get(body, 0) + hand
        found = [{1: "right", -1: "left", 0: "both"}[int(np.sign(n))] for n in hands.values()]
        present = int(self.present[index].sum())
        counts = {kind: found.count(kind) for kind in ("right", "left", "both")}
        return counts | {"single": present - len(hands), "present": present}

    def rollers(self, index: int) -> NDArray[np.bool_]:
        """Return which dumbbells roll, ``(N,)``; those that slide or have left do not.

        A roller has turned about its own axis by more than 30 degrees, in sum, up and down, within
        the 10 s before the instant.
        """
        first = int(np.searchsorted(self.times, self.times[index] - WINDOW))
        spun = np.abs(np.diff(self.q[first : index + 1, :, 3], axis=0)).sum(axis=0)
        return np.asarray(self.present[index] & (spun > ROLLING))

    def dyad_rates(self, window: float = WINDOW) -> dict[str, Array]:
        """Return how fast dyads rise, in mm/s: ``right free``, ``right touched`` and for ``left``.

        The time is divided into intervals of ``window`` s.  A rate is the mean rise of the members
        of a dyad over an interval, at both ends of which they are in the drum as this dyad, and it
        is free if none of its records shows a third dumbbell that touches one of them.
        """
        step = max(1, int(np.searchsorted(self.times, self.times[0] + window)))
        found: dict[str, list[float]] = {f"{h} {s}": [] for h in HANDS.values() for s in STATES}
        for first in range(0, len(self.times) - step, step):
            last = first + step
            touching = self._touching(first, last)
            for i, j, hand in set(self.dyads(first)) & set(self.dyads(last)):
                free = all(len({i, j} & pair) != 1 for pair in touching)
                rise = self.q[last, [i, j], 1].mean() - self.q[first, [i, j], 1].mean()
                rate = rise / (self.times[last] - self.times[first])
                found[f"{HANDS[hand]} {STATES[not free]}"].append(float(rate))
        return {name: np.array(sorted(rates)) for name, rates in found.items()}

    def _touching(self, first: int, last: int) -> set[frozenset[int]]:
        """Return the pairs of dumbbells that touch in one of the records."""
        records = self.trajectory.touching[first : last + 1]
        return {frozenset(b) for record in records for b, *_ in record if len(b) == 2}

    def azimuths(self, index: int) -> tuple[float, float]:
        """Return the mean azimuths of rollers and of sliders, in rad; nan for none."""
        rolls = self.rollers(index)
        slides = self.present[index] & ~rolls
        phi = self.q[index, :, 0]
        return (
            float(phi[rolls].mean()) if rolls.any() else math.nan,
            float(phi[slides].mean()) if slides.any() else math.nan,
        )


def follow_bunch(
    drum: DumbbellDrum,
    duration: float,
    *,
    start: int | Array = 0,
    noise: Noise | None = None,
    dt: float = 1e-3,
    interval: float = 0.5,
    progress: Progress | None = None,
    checkpoint: Checkpoint | None = None,
) -> BunchRun:
    """Follow a bunch for ``duration`` s.

    Parameters
    ----------
    drum : DumbbellDrum
        With a bottom, as of :func:`drum_for_bunch`.
    start : int or (count, 3) array, optional
        The seed of a :func:`scattered` start, or placements.
    noise : Noise, optional
        None by default.
    dt, interval : float, optional
        Step, and time between records, in s.
    progress, checkpoint : optional
        See :func:`~polycorner.motion.simulation.simulate`.
    """
    stride = steps_between_records(drum, dt, interval)
    q = start if isinstance(start, np.ndarray) else scattered(drum, np.random.default_rng(start))
    return BunchRun(
        simulate(
            drum, drum.state(q), duration, dt,
            every=stride, noise=noise, progress=progress, checkpoint=checkpoint,
        )
    )  # fmt: skip


def steps_between_records(drum: DumbbellDrum, dt: float, interval: float) -> int:
    """Return how many steps lie between two records, if a bunch can be followed in a drum."""
    instance("drum", drum, DumbbellDrum)
    if not drum.floor:
        refuse("drum", "one with a bottom, on which the bunch lies", "floor=False")
    return max(1, round(real("interval", interval, above=0) / real("dt", dt, above=0)))


@dataclass(frozen=True)
class Exits:
    """Numbers of exits in an ensemble: mean and standard error, by kind and in total."""

    duration: float
    count: int
    by_kind: dict[str, Mean]
    total: Mean


def exit_statistics(runs: Iterable[BunchRun]) -> Exits:
    """Return means over runs of the same drum and duration."""
    many = list(runs)
    if not many:
        msg = "runs: expected at least one run; got none"
        raise ValueError(msg)
    counts = [one.exit_counts() for one in many]
    return Exits(
        float(many[0].times[-1]),
        many[0].drum.count,
        {kind: Mean.of([c[kind] for c in counts]) for kind in KINDS},
        Mean.of([len(one.exits) for one in many]),
    )


# ------------------------------------------------------------------------- rigid dumbbells in space

# The experiment of [GMBN] sec. 3.2 once more, with :class:`~polycorner.dumbbells.RigidDumbbells` in
# place of dumbbells that lie on a developed drum.

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

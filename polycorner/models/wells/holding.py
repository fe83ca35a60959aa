"""Ensembles of masses in U, half-U and half-V wells under the same noise.

[GMBN] app. C calls each of the three stronger than its predecessor.  Here many copies of one mass
are shaken independently and timed until they reach the rim.  The kinds have the same rim, depth,
mass, noise, drag and friction; what the wall takes is the only other loss.  What comes out:

- With little drag an absorbing wall decides.  A flight must gain the whole depth at once, in half-V
  against a force that is there from the start: times differ by orders of magnitude, in the order
  of the paper.
- Where drag outweighs inertia the wall takes nothing that drag has not taken already.  Half-U is
  exactly as strong as U, and half-V is *weaker* than both, by ``sqrt(pi D / T) / 4`` when deep.
- With an elastic wall half-U is the folded U whatever the drag, and half-V is again weaker.

Depth at the rim is one way to call wells alike.  Alike in the force at the rim half-V is twice as
deep as half-U; alike in their spread at rest, ``<x^2> = s^2``, it is deeper as long as
``a < sqrt(8) s``.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.minimisation.abundance import NORMAL
from polycorner.models.wells.escape import mean_escape_time
from polycorner.models.wells.wells import KINDS, Well
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate, start
from polycorner.spaces.manifold import Array
from polycorner.values import Value

LOOKS = 200  # least number of times that a run is interrupted to remove masses that have escaped


@dataclass(frozen=True, eq=False)
class Escapes(Value):
    """Escape times of copies of a mass from its well.

    Attributes
    ----------
    well : Well
    kick : float
        Intensity of the noise.
    times : (count,) array
        Time at which each reached the rim; nan for those still inside at the end.
    duration : float
        Duration of the simulation.
    """

    well: Well
    kick: float
    times: Array
    duration: float

    @property
    def escaped(self) -> NDArray[np.bool_]:
        """Whether each reached the rim, ``(count,)``."""
        return np.isfinite(self.times)

    @property
    def mean(self) -> float:
        """Mean escape time; where some are still inside, the total time inside per escape.

        The latter is the maximum-likelihood mean of an exponential distribution, which is that
        of escapes from a well that is deep compared with the noise.
        """
        spent = float(np.where(self.escaped, self.times, self.duration).sum())
        return spent / int(self.escaped.sum()) if self.escaped.any() else math.inf

    @property
    def error(self) -> float:
        """Standard error of the mean."""
        count = int(self.escaped.sum())
        if count == len(self.times) and count > 1:
            return float(self.times.std(ddof=1)) / math.sqrt(count)
        return self.mean / math.sqrt(count) if count else math.inf

    def interval(self) -> tuple[float, float]:
        """Return the 95 % confidence limits of the mean; without escapes, a lower limit only.

        Normal in the logarithm.  If none of them escaped, three times the mean number would have
        shown one with 95 per cent.
        """
        if not self.escaped.any():
            return self.duration * len(self.times) / 3, math.inf
        factor = math.exp(NORMAL * self.error / self.mean)
        return self.mean / factor, self.mean * factor


def escapes(
    well: Well,
    kick: float,
    *,
    count: int = 400,
    duration: float,
    dt: float | None = None,
    seed: int = 0,
    places: ArrayLike = 0.0,
    speeds: ArrayLike = 0.0,
) -> Escapes:
    """Simulate ``count`` copies of a mass and return when each reaches the rim.

    Parameters
    ----------
    well : Well
    kick : float
        Intensity of the white noise, as in :class:`~polycorner.motion.noise.Noise`.
    count : int, optional
        How many copies.
    duration : float
        How long they are watched at most.
    dt : float, optional
        Step; default ``well.time_step``.  Drag is explicit, so that the temperature is too high by
        the share ``c dt / 2 m``.
    seed : int, optional
    places, speeds : float or (count,) array, optional
        Where they start, and how fast; default at rest at 0.
    """
    q, v = (np.broadcast_to(np.asarray(x, float), (count,))[:, None] for x in (places, speeds))
    step = well.time_step if dt is None else dt
    copies = replace(well.system, count=count)
    noise = Noise(kicks={"x": kick}, seed=seed)
    engine = start(copies, copies.state(q, v), step, noise=noise)
    steps = math.ceil(duration / step)
    times = np.full(count, math.nan)
    while engine.steps < steps and np.isnan(times).any():
        happened = engine.advance(min(math.ceil(steps / LOOKS), steps - engine.steps))
        for event in happened:
            (body,) = event.bodies
            if event.contact == "rim" and math.isnan(times[body]):
                times[body] = event.time
                engine.motion.alive[body] = 0
    return Escapes(well, kick, np.where(times <= duration, times, math.nan), duration)


def ladder(depth: float, rim: float = 1.0, **others: float) -> tuple[Well, Well, Well]:
    """Return a U, a half-U and a half-V well of the same depth and rim.

    ``others`` go to all of them: mass, drag, friction, restitution.
    """
    first, second, third = (Well.of_depth(kind, depth, rim, **others) for kind in KINDS)
    return first, second, third


def stays(well: Well, speeds: Sequence[float], *, duration: float, dt: float) -> NDArray[np.bool_]:
    """Return whether the well captures masses that enter at the rim with given speeds.

    There is no noise.  :meth:`Well.capture_speed` is the answer in closed form.
    """
    inward = -np.asarray(speeds, dtype=np.float64)
    runs = escapes(
        well, 0.0, count=len(inward), duration=duration, dt=dt, places=well.rim, speeds=inward
    )
    return ~runs.escaped


def rests(
    well: Well, places: ArrayLike, speeds: ArrayLike, *, duration: float, dt: float
) -> tuple[Array, Array]:
    """Return places and speeds of masses after a time without noise, each ``(count,)``."""
    q, v = np.asarray(places, dtype=np.float64), np.asarray(speeds, dtype=np.float64)
    copies = replace(well.system, count=len(q))
    path = simulate(copies, copies.state(q[:, None], v[:, None]), duration, dt)
    return path.q[-1, :, 0].copy(), path.v[-1, :, 0].copy()


@dataclass(frozen=True, eq=False)
class Comparison(Value):
    """U, half-U and half-V wells of the same depth under the same noise.

    Attributes
    ----------
    wells : tuple of Well
        With an absorbing wall, and the least of the drags.
    temperature : float
        Of the noise that drag balances; the depth is a multiple of it.
    drags, over_drag : (n,) and (3, n) array
        Mean times to escape, from the backward equation.
    restitutions, over_restitution : (n,) and (3, n) array
        The same for walls between absorbing and elastic, at the least drag; all alike for U.
    runs : tuple of Escapes
        Simulations: three with an absorbing wall for each drag, two for each restitution.
    """

    wells: tuple[Well, Well, Well]
    temperature: float
    drags: Array
    over_drag: Array
    restitutions: Array
    over_restitution: Array
    runs: tuple[Escapes, ...]


def kick_of(well: Well, temperature: float) -> float:
    """Return the intensity of the noise that drag balances at a temperature."""
    return math.sqrt(2 * well.drag * temperature)


def compare(
    depth: float = 3.0,
    *,
    drags: Sequence[float] = (1.6, 3.2, 6.4),
    restitutions: Sequence[float] = (0.5, 1.0),
    count: int = 300,
    cells: int = 40,
    seed: int = 0,
) -> Comparison:
    """Compare the three kinds at rim, mass and temperature 1, for several drags and restitutions.

    Parameters
    ----------
    depth : float, optional
        Energy at the rim.
    drags, restitutions : sequence of float, optional
        What is simulated; the curves go on to 16 times the largest drag.
    count : int, optional
        Copies in each simulation.
    cells : int, optional
        Of the backward equation.
    seed : int, optional
        The same for all, so that all are shaken alike.
    """
    least = min(drags)
    measured: list[tuple[Well, ...]] = [ladder(depth, drag=c) for c in drags]
    measured += [ladder(depth, drag=least, restitution=e)[1:] for e in restitutions]
    runs = tuple(_measured(well, count, cells, seed) for wells in measured for well in wells)
    curve, losses = np.geomspace(least / 2, 16 * max(drags), 11), np.linspace(0, 1, 9)
    by_drag = [_times(ladder(depth, drag=c), cells) for c in curve.tolist()]
    walled = [ladder(depth, drag=least, restitution=e)[1:] for e in losses.tolist()]
    by_loss = np.array([_times(wells, cells) for wells in walled]).T
    unwalled = np.full(len(losses), _times(ladder(depth, drag=least)[:1], cells))
    return Comparison(
        ladder(depth, drag=least),
        1.0,
        curve,
        np.array(by_drag).T,
        losses,
        np.vstack([unwalled, by_loss]),
        runs,
    )


def _measured(well: Well, count: int, cells: int, seed: int) -> Escapes:
    kick = kick_of(well, 1.0)
    expected = mean_escape_time(well, kick, cells=cells)
    return escapes(well, kick, count=count, duration=12 * expected, seed=seed)


def _times(wells: Sequence[Well], cells: int) -> list[float]:
    return [mean_escape_time(well, kick_of(well, 1.0), cells=cells) for well in wells]

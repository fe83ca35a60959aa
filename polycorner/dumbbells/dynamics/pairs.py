"""Dyads in a drum: their recognition and chirality, their headings, climbing and exits.

Everything is computed from placements in the developed plane ``(rho phi, eta)``, for all pairs at
once.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from polycorner.dumbbells.drum import DumbbellDrum, drum_of
from polycorner.dumbbells.formulas import CONTACTS
from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.motion import EventKind
from polycorner.toolkit import Array

if TYPE_CHECKING:
    from polycorner.motion import Trajectory

Dyad = tuple[int, int, Chirality]
Handed = tuple[int, int, int]  # two numbers and the chirality, +1 right or -1 left
MEMORY = 100.0  # s; a dyad of the experiment's size climbs by its shift, 12 mm, in 50 to 70
NEAR = 0.5  # of ``r - t``: in a dyad each rod has a ball of the other closer than that
PARALLEL = math.radians(20.0)  # headings of a dyad differ by less
NO_ORDER = 1e-9  # of the length: vectors and distances this close have no orientation, no order
LEFT_AS = {1: "right", -1: "left", 0: "single"}


@dataclass(frozen=True)
class DumbbellLengths:
    """Lengths in mm: ``l``, ``r``, ``rho = R - r`` and ``t``."""

    length: float
    ball_radius: float
    centre_radius: float
    rod_radius: float

    @classmethod
    def of(cls, trajectory: "Trajectory") -> "DumbbellLengths":
        """Return the lengths of the dumbbells of a trajectory in the drum."""
        return cls.of_drum(drum_of(trajectory))

    @classmethod
    def of_drum(cls, drum: DumbbellDrum) -> "DumbbellLengths":
        """Return the lengths of a drum's dumbbells."""
        return cls(drum.length, drum.ball_radius, drum.centre_radius, drum.rod_radius)

    @property
    def reach(self) -> float:
        """``l + 2 r``: dumbbells whose centres are not closer cannot be a dyad."""
        return self.length + 2 * self.ball_radius

    @property
    def pair(self) -> DumbbellPair:
        """Two of the dumbbells."""
        return _pair(self)

    def apart(self, one: Array, other: Array) -> Array:
        """Return the distances of centres in the developed plane, in mm.

        Placements are ``(..., k)`` and begin with ``phi, eta``.
        """
        gap = other[..., :2] - one[..., :2]
        return np.asarray(np.hypot(self.centre_radius * gap[..., 0], gap[..., 1]))

    def balls(self, q: Array) -> Array:
        """Return the centres of both balls in the developed plane, ``(..., 2, 2)``, in mm.

        ``q`` is ``(..., k)`` and begins with ``phi, eta, theta``.
        """
        ends = np.array([-0.5, 0.5]) * self.length
        across = ends * np.sin(q[..., 2, None]) / self.centre_radius
        x = self.centre_radius * (q[..., 0, None] + np.arcsin(across))
        y = q[..., 1, None] + ends * np.cos(q[..., 2, None])
        return np.stack([x, y], axis=-1)


@lru_cache(maxsize=8)
def _pair(sizes: DumbbellLengths) -> DumbbellPair:
    drum_radius = sizes.centre_radius + sizes.ball_radius
    return DumbbellPair(sizes.length, sizes.ball_radius, sizes.rod_radius, drum_radius)


def chirality(balls: Array) -> NDArray[np.int64]:
    """Return +1 for right-handed pairs, -1 for left-handed ones, 0 where it is not defined.

    With ``A_i, B_j`` the farthest centres and ``A_p, B_q`` the other two, a pair is right-handed
    when ``A_i B_j`` and ``A_p B_q`` are positively oriented ([GMBN] sec. 5); undefined when they
    are parallel or the farthest pair is not unique.

    Parameters
    ----------
    balls : (..., 4, 2) array
        Centres ``A1, A2, B1, B2`` in the developed plane.
    """
    outer, inner, reach = _links(balls)
    turn = outer[..., 0] * inner[..., 1] - outer[..., 1] * inner[..., 0]
    scale = NO_ORDER * np.linalg.norm(balls[..., 1, :] - balls[..., 0, :], axis=-1)
    unclear = reach[..., 3] - reach[..., 2] <= scale
    unclear |= np.abs(turn) <= scale * reach[..., 3]
    return np.where(unclear, 0, np.sign(turn)).astype(np.int64)


def _links(balls: Array) -> tuple[Array, Array, Array]:
    """Return ``A_i B_j``, ``A_p B_q`` and all four distances in order."""
    links = balls[..., None, 2:, :] - balls[..., :2, None, :]  # (..., i, j, 2)
    flat = links.reshape(*links.shape[:-3], 4, 2)  # 11, 12, 21, 22: k and 3 - k share no ball
    reach = np.hypot(flat[..., 0], flat[..., 1])
    far = np.argmax(reach, axis=-1)
    outer = np.take_along_axis(flat, far[..., None, None], axis=-2)[..., 0, :]
    inner = np.take_along_axis(flat, 3 - far[..., None, None], axis=-2)[..., 0, :]
    return outer, inner, np.sort(reach, axis=-1)


def in_neighbourhood(balls: Array, ball_radius: float) -> NDArray[np.bool_]:
    """Return which pairs lie in the neighbourhood ``U`` of nested pairs ([GMBN] sec. 7).

    Each ball is less than ``2 r`` from the line through the other dumbbell, and no two balls are
    ``2 sqrt(l^2 + r^2)`` apart.  Distances are from lines, not from rods: the outer ball of a
    nested dumbbell is far from the other's rod.

    Parameters
    ----------
    balls : (..., 4, 2) array
        Centres ``A1, A2, B1, B2`` in the developed plane, in mm.
    """
    one, other = balls[..., :2, :], balls[..., 2:, :]
    inside = _from_line(one, other).max(axis=-1) < 2 * ball_radius
    inside &= _from_line(other, one).max(axis=-1) < 2 * ball_radius
    apart = np.linalg.norm(one[..., :, None, :] - other[..., None, :, :], axis=-1)
    length = np.linalg.norm(one[..., 1, :] - one[..., 0, :], axis=-1)
    return np.asarray(inside & (apart.max(axis=(-2, -1)) < 2 * np.hypot(length, ball_radius)))


def _from_line(points: Array, line: Array) -> Array:
    axis = line[..., 1, :] - line[..., 0, :]
    along = points - line[..., :1, :]
    turn = axis[..., None, 0] * along[..., 1] - axis[..., None, 1] * along[..., 0]
    return np.asarray(np.abs(turn) / np.linalg.norm(axis, axis=-1)[..., None])


def gaps(sizes: DumbbellDrum | DumbbellLengths, q: Array) -> Array:
    """Return the nine gaps of pairs ``(..., 2, k)`` in a drum, ``(..., 9)``, in mm.

    In the order of :attr:`polycorner.dumbbells.formulas.CONTACTS`.
    """
    flat = q[..., :3].reshape(-1, 6)
    found = np.empty((len(flat), len(CONTACTS)))
    if len(flat):
        found = sizes.pair.polyhedron.bundle.evaluate(flat, 0)[0]
    return np.asarray(found).reshape(*q.shape[:-2], len(CONTACTS))


def is_dyad(sizes: DumbbellDrum | DumbbellLengths, q: Array) -> NDArray[np.bool_]:
    """Return which pairs are dyads: those near the subset ``T`` of [GMBN] sec. 7.

    In ``T`` dumbbells are parallel and a ball of each touches the other's rod.  Here headings, as
    directions, differ by less than 20 degrees, and each rod has a ball of the other dumbbell closer
    than ``(r - t)/2``, half of what dumbbells have that touch side by side or end to end.  The
    third contact of the corner, between the inner balls, may be open: then the two have slid
    along each other and are nested all the same.

    Parameters
    ----------
    sizes : DumbbellDrum or DumbbellLengths
    q : (..., 2, k) array
        Placements of A and B, beginning with ``phi, eta, theta``.
    """
    open_by = gaps(sizes, q)
    rods = [
        open_by[..., [CONTACTS.index(name) for name in names]].min(axis=-1)
        for names in (("A1b", "A2b"), ("aB1", "aB2"))
    ]
    close = np.maximum(*rods) < NEAR * (sizes.ball_radius - sizes.rod_radius)
    return np.asarray(close & (abs(np.sin(q[..., 1, 2] - q[..., 0, 2])) < math.sin(PARALLEL)))


def dyads(trajectory: "Trajectory", index: int) -> list[Dyad]:
    """Return the dyads at a recorded instant: two numbers and the chirality, ``"R"`` or ``"L"``.

    A dyad is a pair for which :func:`is_dyad` holds and that has a chirality; a dumbbell may be in
    several.
    """
    found = dyads_among(
        DumbbellLengths.of(trajectory), trajectory.q[index], trajectory.present[index]
    )
    return [(i, j, "R" if hand > 0 else "L") for i, j, hand in found]


def dyads_among(sizes: DumbbellLengths, q: Array, present: NDArray[np.bool_]) -> list[Handed]:
    """Return the dyads among dumbbells: two numbers and the chirality, +1 right or -1 left.

    Parameters
    ----------
    sizes : DumbbellLengths
    q : (N, k) array
        Placements, beginning with ``phi, eta, theta``.
    present : (N,) array of bool
        Which count.
    """
    here = np.flatnonzero(present)
    places = q[here]
    near = np.argwhere(np.triu(sizes.apart(places[:, None], places) < sizes.reach, 1))
    pairs = places[near]
    hand = chirality(sizes.balls(pairs).reshape(-1, 4, 2))
    hand[~is_dyad(sizes, pairs)] = 0
    return [(int(i), int(j), int(h)) for (i, j), h in zip(here[near], hand, strict=True) if h]


def left_as(
    times: Array,
    exits: Sequence[tuple[float, int]],
    dyads_at: Callable[[int], list[Handed]],
    memory: float = MEMORY,
) -> list[str]:
    """Return how dumbbells left: in ``right`` or ``left`` dyads, or ``single``.

    A dumbbell counts with the dyads it was last recorded in, if that was at most ``memory`` s
    before it left; so both members count although one leaves first.  Of several dyads the commoner
    chirality counts; if they balance, the record before decides.

    Parameters
    ----------
    times : (T,) array
        Times of the records.
    exits : sequence of (float, int)
        Time of leaving, and number.
    dyads_at : callable
        Gives the dyads of a record, as :func:`dyads_among`.
    memory : float, optional
        In s.
    """
    found = cache(dyads_at)
    kinds = []
    for time, body in exits:
        first, stop = (int(np.searchsorted(times, t)) for t in (time - memory, time))
        totals = (
            sum(hand for i, j, hand in found(index) if body in (i, j))
            for index in reversed(range(first, stop))
        )
        kinds.append(LEFT_AS[int(np.sign(next((total for total in totals if total), 0)))])
    return kinds


def exits(trajectory: "Trajectory", *, memory: float = MEMORY) -> dict[str, int]:
    """Return how many dumbbells left in dyads of each chirality and single; see :func:`left_as`."""
    sizes, q, present = DumbbellLengths.of(trajectory), trajectory.q, trajectory.present
    left = [(event.time, event.bodies[0]) for event in trajectory.of_kind(EventKind.EXIT)]
    kinds = left_as(
        trajectory.times, left, lambda at: dyads_among(sizes, q[at], present[at]), memory
    )
    return {kind: kinds.count(kind) for kind in LEFT_AS.values()}


def held(trajectory: "Trajectory") -> bool:
    """Return whether two dumbbells stayed together.

    At every recorded instant both are in the drum, their centres are closer than ``l + 2 r`` in the
    developed plane, and their chirality is that of the beginning.
    """
    sizes, q = DumbbellLengths.of(trajectory), trajectory.q
    if q.shape[1] != 2:
        msg = f"trajectory: expected one of two dumbbells; got one of {q.shape[1]}"
        raise ValueError(msg)
    hands = chirality(sizes.balls(q).reshape(-1, 4, 2))
    near = bool((sizes.apart(q[:, 0], q[:, 1]) < sizes.reach).all())
    return near and bool(trajectory.present.all()) and bool(hands[0] and (hands == hands[0]).all())


def handedness(trajectory: "Trajectory", index: int = 0) -> Chirality | None:
    """Return the chirality of the first two dumbbells at a recorded instant."""
    balls = DumbbellLengths.of(trajectory).balls(trajectory.q[index, :2]).reshape(4, 2)
    return cast("Chirality | None", {1: "R", -1: "L"}.get(int(chirality(balls))))


def mean_heading(trajectory: "Trajectory") -> Array:
    """Return the mean heading of the dumbbells in the drum at each instant, ``(T,)``, in rad.

    Headings are directions modulo ``pi``, and so is their mean: half the argument of the sum of
    ``exp(2 i theta)``.  It follows the motion continuously from a value in ``(-pi/2, pi/2]``; nan
    where no dumbbell is left.
    """
    here = trajectory.present
    total = np.where(here, np.exp(2j * trajectory.q[..., 2]), 0).sum(axis=1)
    heading = np.where(here.any(axis=1), np.angle(total) / 2, np.nan)
    some = ~np.isnan(heading)
    heading[some] = np.unwrap(heading[some], period=math.pi)
    return np.asarray(heading)


def climb_rate(trajectory: "Trajectory") -> float:
    """Return the mean over dumbbells of the rise in ``eta`` per time, in mm/s, while present."""
    N = trajectory.present.shape[1]
    last = np.maximum(trajectory.present.sum(axis=0) - 1, 0)
    spent = trajectory.times[last] - trajectory.times[0]
    rise = trajectory.q[last, np.arange(N), 1] - trajectory.q[0, :, 1]
    return float((rise[spent > 0] / spent[spent > 0]).mean()) if (spent > 0).any() else math.nan


def turning_azimuths(
    trajectory: "Trajectory", *, least: float = math.radians(1.0)
) -> tuple[float, float]:
    """Return the mean azimuths, in rad, where zigzags turn at the top and at the bottom.

    A turn is an extremum of a dumbbell's azimuth between changes of more than ``least``; the record
    resolves it to what the drum turns between two instants.  nan where there is none.
    """
    tops, bottoms = [], []
    for body in range(trajectory.q.shape[1]):
        phi = trajectory.q[trajectory.present[:, body], body, 0]
        found = _turns(phi, least)
        tops += found[0]
        bottoms += found[1]
    return (
        float(np.mean(tops)) if tops else math.nan,
        float(np.mean(bottoms)) if bottoms else math.nan,
    )


def _turns(values: Array, least: float) -> tuple[list[float], list[float]]:
    """Return the maxima and minima that are followed and preceded by a change above ``least``."""
    tops: list[float] = []
    bottoms: list[float] = []
    if len(values) == 0:
        return tops, bottoms
    high = low = float(values[0])
    rising: bool | None = None
    for value in values.tolist():
        high, low = max(high, value), min(low, value)
        if rising is not False and value < high - least:
            tops += [high] if rising else []
            rising, low = False, value
        elif rising is not True and value > low + least:
            bottoms += [low] if rising is False else []
            rising, high = True, value
    return tops, bottoms

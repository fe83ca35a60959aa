"""Which dumbbells in a drum are dyads, how they are handed, and as what they leave.

Everything is read off places in the developed plane ``(rho phi, eta)``, for all pairs at once.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from polycorner.geometry.manifold import Array
from polycorner.models.drum import PARAMETERS, DumbbellDrum
from polycorner.models.dumbbells import Chirality
from polycorner.motion.events import EventKind
from polycorner.motion.scene import Herd

if TYPE_CHECKING:
    from polycorner.motion.trajectory import Trajectory

Dyad = tuple[int, int, Chirality]
Hand = TypeVar("Hand")
MEMORY = 10.0  # s, longer than a zigzag of the experiment
NEAR = 0.25  # of the ball radius: contacts of a dyad are open by less
PARALLEL = 1e-9  # of the length: vectors and distances this close have no orientation, no order


@dataclass(frozen=True)
class Sizes:
    """Lengths in mm: ``l``, ``r``, ``rho = R - r`` and ``t`` (nan if there is one dumbbell)."""

    length: float
    ball_radius: float
    centre_radius: float
    rod_radius: float

    @classmethod
    def of(cls, trajectory: "Trajectory") -> "Sizes":
        """Return those of the dumbbells of a trajectory in the drum."""
        system = trajectory.system
        if not isinstance(system, Herd) or system.body.formulation.parameters != PARAMETERS:
            msg = f"trajectory: expected one of dumbbells in a drum; got one of {system!r}"
            raise TypeError(msg)
        numbers = dict(zip(PARAMETERS, system.body.parameters.tolist(), strict=True))
        between = system.pairing
        if between is not None:
            numbers |= dict(zip(between.gaps.parameters, between.parameters, strict=True))
        return cls(numbers["l"], numbers["r"], numbers["rho"], numbers.get("t", math.nan))

    @classmethod
    def of_drum(cls, drum: DumbbellDrum) -> "Sizes":
        """Return those of a drum's dumbbells."""
        return cls(drum.length, drum.ball_radius, drum.centre_radius, drum.rod_radius)

    @property
    def reach(self) -> float:
        """``l + 2 r``: dumbbells whose centres are not closer cannot be a dyad."""
        return self.length + 2 * self.ball_radius

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
    outer, inner, reach, _ = _links(balls)
    turn = outer[..., 0] * inner[..., 1] - outer[..., 1] * inner[..., 0]
    scale = PARALLEL * np.linalg.norm(balls[..., 1, :] - balls[..., 0, :], axis=-1)
    unclear = reach[..., 3] - reach[..., 2] <= scale
    unclear |= np.abs(turn) <= scale * reach[..., 3]
    return np.where(unclear, 0, np.sign(turn)).astype(np.int64)


def _links(balls: Array) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Return ``A_i B_j``, ``A_p B_q``, all four distances in order, and ``p, q``, from 0."""
    links = balls[..., None, 2:, :] - balls[..., :2, None, :]  # (..., i, j, 2)
    flat = links.reshape(*links.shape[:-3], 4, 2)  # 11, 12, 21, 22: k and 3 - k share no ball
    reach = np.hypot(flat[..., 0], flat[..., 1])
    far = np.argmax(reach, axis=-1)
    outer = np.take_along_axis(flat, far[..., None, None], axis=-2)[..., 0, :]
    inner = np.take_along_axis(flat, 3 - far[..., None, None], axis=-2)[..., 0, :]
    near = 3 - far
    return outer, inner, np.sort(reach, axis=-1), np.stack([near // 2, near % 2], axis=-1)


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


def nested(balls: Array, sizes: Sizes) -> NDArray[np.bool_]:
    """Return which pairs are nested: those in ``U`` whose three contacts of the corner are closed.

    The inner balls ``A_p, B_q``, those that do not belong to the farthest pair, are less than
    ``r/4`` from touching each other, and each is less than ``r/4`` from touching the line of the
    other's rod.  In ``U`` the headings then agree to about ``asin((r - t) / l)``, 7 degrees.  Pairs
    that have slid along each other are left out; :func:`polycorner.studies.drum_dyads.is_dyad`
    takes them in.

    Parameters
    ----------
    balls : (..., 4, 2) array
        Centres ``A1, A2, B1, B2`` in the developed plane, in mm.
    """
    _, inner, _, which = _links(balls)
    one, other = balls[..., :2, :], balls[..., 2:, :]
    r, slack = sizes.ball_radius, NEAR * sizes.ball_radius
    close = np.hypot(inner[..., 0], inner[..., 1]) < 2 * r + slack
    for bodies, line, k in ((one, other, 0), (other, one, 1)):
        apart = np.take_along_axis(_from_line(bodies, line), which[..., k, None], axis=-1)[..., 0]
        close &= apart < r + sizes.rod_radius + slack
    return np.asarray(close & in_neighbourhood(balls, r))


def dyads(trajectory: "Trajectory", index: int) -> list[Dyad]:
    """Return the dyads at a recorded instant: two numbers and the chirality, ``"R"`` or ``"L"``.

    A dyad is a pair that is :func:`nested` and has a chirality; a dumbbell may be in several.
    """
    sizes, here = Sizes.of(trajectory), np.flatnonzero(trajectory.present[index])
    q = trajectory.q[index, here]
    close = near_pairs(sizes, q)
    balls = sizes.balls(q[close]).reshape(-1, 4, 2)
    hand = np.where(nested(balls, sizes), chirality(balls), 0)
    return [(i, j, "R" if sign > 0 else "L") for i, j, sign in listed(here[close], hand)]


def near_pairs(sizes: Sizes, q: Array) -> NDArray[np.intp]:
    """Return the pairs among dumbbells ``(N, k)`` that are near enough for a dyad, ``(n, 2)``."""
    return np.argwhere(np.triu(sizes.apart(q[:, None], q) < sizes.reach, 1))


def listed(bodies: NDArray[np.intp], hand: NDArray[np.int64]) -> list[tuple[int, int, int]]:
    """Return the numbers and the chirality of pairs ``(n, 2)`` that have one."""
    return [(int(i), int(j), int(h)) for (i, j), h in zip(bodies, hand, strict=True) if h]


def latest_hands(
    times: Array,
    time: float,
    body: int,
    dyads_at: Callable[[int], Iterable[tuple[int, int, Hand]]],
    memory: float,
) -> list[Hand]:
    """Return the chiralities of a dumbbell's dyads when it was last in one; none: an empty list.

    Records before ``time`` count, but none more than ``memory`` s before it.
    """
    last = int(np.searchsorted(times, time)) - 1
    first = int(np.searchsorted(times, time - memory))
    for index in range(last, first - 1, -1):
        hands = [hand for i, j, hand in dyads_at(index) if body in (i, j)]
        if hands:
            return hands
    return []


def exits(trajectory: "Trajectory", *, memory: float = MEMORY) -> dict[str, int]:
    """Return how many dumbbells left, as members of right or left dyads or ``single``.

    A dumbbell counts with the dyad it was last recorded in, if that was at most ``memory`` s before
    it left; so both members count although one leaves first.
    """
    counts = {"right": 0, "left": 0, "single": 0}

    @cache
    def found(index: int) -> list[Dyad]:
        return dyads(trajectory, index)

    for event in trajectory.of_kind(EventKind.EXIT):
        hands = latest_hands(trajectory.times, event.time, event.bodies[0], found, memory)
        counts[{"R": "right", "L": "left"}[hands[0]] if hands else "single"] += 1
    return counts


def held(trajectory: "Trajectory") -> bool:
    """Return whether two dumbbells stayed together.

    At every recorded instant both are in the drum, their centres are closer than ``l + 2 r`` in the
    developed plane, and their chirality is that of the beginning.
    """
    sizes, q = Sizes.of(trajectory), trajectory.q
    if q.shape[1] != 2:
        msg = f"trajectory: expected one of two dumbbells; got one of {q.shape[1]}"
        raise ValueError(msg)
    hands = chirality(sizes.balls(q).reshape(-1, 4, 2))
    near = bool((sizes.apart(q[:, 0], q[:, 1]) < sizes.reach).all())
    return near and bool(trajectory.present.all()) and bool(hands[0] and (hands == hands[0]).all())


def handedness(trajectory: "Trajectory", index: int = 0) -> Chirality | None:
    """Return the chirality of the first two dumbbells at a recorded instant."""
    balls = Sizes.of(trajectory).balls(trajectory.q[index, :2]).reshape(4, 2)
    return cast("Chirality | None", {1: "R", -1: "L"}.get(int(chirality(balls))))


def mean_heading(trajectory: "Trajectory") -> Array:
    """Return the mean heading of the dumbbells in the drum at each instant, ``(T,)``, in rad.

    Headings are directions modulo ``pi``, and so is their mean: half the argument of the sum of
    ``exp(2 i theta)``.  It follows the motion continuously from a value in ``(-pi/2, pi/2]``; nan
    where nobody is left.
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

"""Initial placements in the drum: single dumbbells, nested pairs, a bunch at the bottom."""

import math
from collections.abc import Sequence

import numpy as np

from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.minimisation import minimise
from polycorner.toolkit import Array, Quotient, project, refuse

WIDTH = 0.45  # rad, half the width of the strip in which a bunch is scattered
ROOM = 3.0  # area of that strip in areas of the dumbbells
GAP = 0.05  # mm, between dumbbells of a bunch
TRIES = 2000  # rejected draws in a row after which the strip grows


def isolated(
    drum: DumbbellDrum, headings: Sequence[float], *, azimuth: float = 0.0, eta: float = 0.0
) -> Array:
    """Return dumbbells too far apart to touch, ``(N, 3)``.

    The steepest heading is highest, so dumbbells that climb and that descend move apart.

    Parameters
    ----------
    headings : sequence of float
        One for each dumbbell, in rad.
    azimuth, eta : float, optional
        Azimuth of all, in rad, and axial position of the lowest, in mm.
    """
    angles = np.array(headings, dtype=np.float64)
    if angles.shape != (drum.count,) or not np.isfinite(angles).all():
        refuse("headings", f"{drum.count} angles in rad", list(headings))
    step = 2 * (drum.length + 2 * drum.ball_radius)
    q = np.full((drum.count, 3), azimuth)
    q[:, 1] = eta + step * np.argsort(np.argsort(angles, kind="stable"), kind="stable")
    q[:, 2] = angles
    return q


def nested_pair(
    drum: DumbbellDrum, chirality: Chirality, *, heading: float | None = None, eta: float = 0.0
) -> Array:
    """Return a nested pair on the lowest line whose three contacts just touch, ``(2, 3)``.

    Parameters
    ----------
    chirality : {"R", "L"}
    heading : float, optional
        Mean heading in rad; default that at rest in a level drum that stands still.
    eta : float, optional
        Mean axial position in mm.

    Notes
    -----
    The certified minimiser of the energy is rotated as a whole in the developed plane.  The drum's
    curvature then opens or closes the contacts slightly, and Newton's method restores them: the
    placement of one dumbbell relative to the other is three unknowns for three contacts.

    Raises
    ------
    ValueError
        If there is no such corner, as for rods almost as thick as balls or at steep headings.
    """
    pair = drum.pair
    start = pair.nested(chirality)  # raises for anything but a chirality
    rest = minimise(pair.polyhedron, pair.energy, start)
    cornered = len(rest.active) == 3 and pair.chirality(rest.point) == chirality
    q = rest.point if cornered else start
    if heading is not None or not cornered:
        now = float(q[[2, 5]].mean())
        q = _cornered(pair, _turned(pair, q, (now if heading is None else heading) - now))
    if pair.chirality(q) != chirality:
        refuse("heading", "one at which such dumbbells nest", heading)
    places = q.reshape(2, 3) - np.array([q[[0, 3]].mean(), q[[1, 4]].mean() - eta, 0.0])
    return np.asarray(places)


def _turned(pair: DumbbellPair, q: Array, angle: float) -> Array:
    """Return the pair turned about its middle as a rigid body of the developed plane."""
    places = q.reshape(2, 3) * np.array([pair.centre_radius, 1.0, 1.0])
    middle = places.mean(axis=0)
    across, along = (places - middle)[:, :2].T
    turned = places.copy()  # headings are counted from the axis towards growing azimuth
    turned[:, 0] = middle[0] + math.cos(angle) * across + math.sin(angle) * along
    turned[:, 1] = middle[1] - math.sin(angle) * across + math.cos(angle) * along
    turned[:, 2] += angle
    return np.asarray(turned / np.array([pair.centre_radius, 1.0, 1.0])).reshape(6)


def _cornered(pair: DumbbellPair, q: Array) -> Array:
    """Return the nearby pair with the same mean placement whose three nearest contacts touch."""
    nearest = np.argsort(pair.polyhedron.values(q))[:3]
    opposite = np.concatenate([-np.eye(3), np.eye(3)])
    quotient = Quotient(pair.polyhedron)
    q = project(quotient, q, nearest.tolist(), along=opposite, stride=1.0).point.q
    gaps = pair.polyhedron.values(q)
    if not (gaps.min() > -1e-9 and np.abs(gaps[nearest]).max() < 1e-9):
        msg = (
            "heading: expected one at which such dumbbells touch at three contacts; "
            f"got {math.degrees(float(q[[2, 5]].mean())):g} degrees"
        )
        raise ValueError(msg)
    return q


def bunch(drum: DumbbellDrum, rng: np.random.Generator, *, width: float = WIDTH) -> Array:
    """Return dumbbells scattered without overlap near the bottom, ``(N, 3)``.

    Positions and headings are uniform in a strip about the lowest line; a dumbbell that overlaps is
    drawn again (random sequential addition), and the strip grows when it is full.

    Parameters
    ----------
    rng : Generator
    width : float, optional
        Half the strip's width as an angle, in rad.
    """
    room = ROOM * drum.count * (2 * math.pi * drum.ball_radius**2)
    room += ROOM * drum.count * 2 * drum.rod_radius * drum.length
    height = drum.length + 2 * drum.ball_radius + room / (2 * width * drum.centre_radius)
    return scatter(drum, rng, width=width, height=height, tries=TRIES)


def scatter(
    drum: DumbbellDrum, rng: np.random.Generator, *, width: float, height: float, tries: int
) -> Array:
    """Return dumbbells scattered without overlap in a strip above the bottom, ``(N, 3)``.

    Parameters
    ----------
    rng : Generator
    width, height : float
        Half the strip's width as an angle, in rad, and its height, in mm.
    tries : int
        Rejected draws in a row after which the strip grows by a tenth.
    """
    found, vain = np.empty((0, 3)), 0
    while len(found) < drum.count:
        theta = rng.uniform(-math.pi / 2, math.pi / 2)
        low = drum.length / 2 * math.cos(theta) + drum.ball_radius + GAP
        new = np.array([rng.uniform(-width, width), rng.uniform(low, max(low, height)), theta])
        vain += 1
        if _is_free(drum, found, new):
            found, vain = np.concatenate([found, new[None]]), 0
        elif vain > tries:
            height, vain = 1.1 * height, 0
    return found


def _is_free(drum: DumbbellDrum, others: Array, new: Array) -> bool:
    apart = np.hypot(drum.centre_radius * (others[:, 0] - new[0]), others[:, 1] - new[1])
    near = others[apart < drum.length + 2 * drum.ball_radius + GAP]
    if len(near) == 0:
        return True
    pairs = np.concatenate([near, np.tile(new, (len(near), 1))], axis=1)
    return bool(drum.pair.polyhedron.bundle.evaluate(pairs, 0)[0].min() > GAP)

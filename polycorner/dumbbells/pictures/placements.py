"""The solid of forbidden relative placements of two dumbbells.

Dumbbells that overlap have a relative placement ``(x, y, delta)`` in a solid with inverted corners
and edges ([GMBN] sec. 5); everything outside it is allowed.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.pictures import SharpSurface, sharp_surface
from polycorner.toolkit import FEWEST_CELLS, Array, Function, Gaps, checked, real, reals, refuse


@checked
def relative_placements(
    pair: DumbbellPair, points: ArrayLike, *, mean_heading: float | None = None
) -> Array:
    """Return placements ``(..., 6)`` of two dumbbells with given relative placements.

    Relative placements ``(x, y, delta)`` are: lateral and axial position of B less that of A
    (mm; in the drum azimuths times ``rho``) and heading of B less that of A (radians).

    Parameters
    ----------
    pair : DumbbellPair
        The dumbbells.
    points : (..., 3) array_like
        Relative placements.
    mean_heading : float, optional
        Mean of the headings, in radians; the mean position is then the origin.  By default A lies
        at the origin with heading 0, which in the plane is no loss.

    Raises
    ------
    ValueError
        In the drum without a mean heading, where other headings are not congruent.
    """
    p = _rows("points", points, 3)
    q = np.zeros((*p.shape[:-1], 6))
    if mean_heading is None:
        if not pair.is_plane:
            refuse("mean_heading", "an angle in radians for a pair in a drum", None)
        q[..., 3:] = p
        return q
    half = p / 2 if pair.is_plane else p / np.array([2 * pair.centre_radius, 2.0, 2.0])
    q[..., :3], q[..., 3:] = -half, half
    q[..., [2, 5]] += real("mean_heading", mean_heading)
    return q


@checked
def relative_coordinates(
    pair: DumbbellPair, q: ArrayLike, *, mean_heading: ArrayLike | None = None
) -> Array:
    """Return the relative placements ``(x, y, delta)`` of placements ``(..., 6)``.

    The inverse of :func:`relative_placements` up to congruence and, at fixed mean heading, up to
    the names of balls: a placement with the opposite mean heading is turned by half a turn.
    ``delta`` is not wrapped.  Every placement may have a mean heading of its own, ``(...)``.
    """
    points = _rows("q", q, 6)
    apart = points[..., 3:] - points[..., :3]
    if mean_heading is None:
        s, c = np.sin(points[..., 2]), np.cos(points[..., 2])
        x, y, delta = np.moveaxis(apart, -1, 0)
        return np.stack([x * c - y * s, x * s + y * c, delta], axis=-1)
    if not pair.is_plane:
        apart = np.stack(
            [
                pair.centre_radius * np.angle(np.exp(1j * apart[..., 0])),
                apart[..., 1],
                apart[..., 2],
            ],
            axis=-1,
        )
    mean = (points[..., 2] + points[..., 5]) / 2
    sign = np.sign(np.cos(mean - reals("mean_heading", mean_heading)))[..., None]
    return np.asarray(apart * np.concatenate([sign, sign, np.ones_like(sign)], axis=-1))


def _rows(argument: str, given: ArrayLike, size: int) -> Array:
    array = reals(argument, given)
    if array.shape[-1:] != (size,):
        refuse(argument, f"shape (..., {size})", array.shape)
    return array


def relative_gap(pair: DumbbellPair, *, mean_heading: float | None = None) -> Function:
    """Return the least of the nine gaps (mm) as a function of relative placements ``(..., 3)``.

    It is negative exactly where the dumbbells overlap; see :func:`relative_placements`.
    """

    def gap(points: Array) -> Array:
        q = relative_placements(pair, points, mean_heading=mean_heading)
        return np.asarray(pair.polyhedron.implicit(q))

    return gap


def relative_gaps(pair: DumbbellPair, *, mean_heading: float | None = None) -> Gaps:
    """Return the nine gaps (mm) as a function of relative placements ``(N, 3)`` and an order.

    It returns the values ``(N, 9)`` and, for order 1, the gradients ``(N, 9, 3)`` by
    ``(x, y, delta)``.
    """
    origin = relative_placements(pair, np.zeros(3), mean_heading=mean_heading)
    turn = relative_placements(pair, np.eye(3), mean_heading=mean_heading) - origin

    def gaps(points: Array, order: int) -> tuple[Array, ...]:
        q = relative_placements(pair, points, mean_heading=mean_heading)
        values, *gradients = pair.polyhedron.evaluate(q, order)
        return values, *(gradient @ turn.T for gradient in gradients)  # q depends linearly on them

    return gaps


@checked
def forbidden_solid(
    pair: DumbbellPair,
    resolution: int | Sequence[int] = 96,
    *,
    period: float = math.tau,
    start: float | None = None,
    mean_heading: float | None = None,
) -> SharpSurface:
    """Return the solid of relative placements ``(x, y, delta)`` at which two dumbbells overlap.

    Faces are single contacts, mesh edges follow the curves of two contacts, and corners, where
    three and more contacts close, are vertices
    (:func:`~polycorner.pictures.sharp_surface`); labels are positions in
    ``pair.polyhedron.names``.  Its volume is in mm^2 rad.

    In the plane it is all that is forbidden up to congruence; in a drum it is a section at fixed
    mean heading, where moving both dumbbells along or around the drum changes nothing.  If the
    dumbbells can touch all around the drum, the azimuth is a periodic axis.

    Parameters
    ----------
    pair : DumbbellPair
        The dumbbells.
    resolution : int or three of them, optional
        Number of cells along each axis.  One number means that many for both positions and for
        a whole turn of the relative heading.
    period : float, optional
        ``2 pi`` (balls are labelled; default) or ``pi``: the balls of B are alike.
    start : float, optional
        Least relative heading in radians; default ``-period / 2``.
    mean_heading : float, optional
        Mean of the headings in radians, see :func:`relative_placements`; needed in a drum.

    Raises
    ------
    ValueError
        For other periods, or for ``pi`` at fixed mean heading: exchanging the balls of one
        dumbbell changes the mean heading by a quarter turn.
    """
    if not any(math.isclose(period, whole) for whole in (math.pi, math.tau)):
        refuse("period", "pi or 2 pi", period)
    half = math.isclose(period, math.pi)
    if half and mean_heading is not None:
        refuse("period", "2 pi, the only one at fixed mean heading", period)
    low = -period / 2 if start is None else real("start", start)
    if low + period == low:
        refuse("start", "an angle to which doubles can add a period", start)
    if isinstance(resolution, int | np.integer):
        turn = max(FEWEST_CELLS, resolution // 2) if half else resolution
        resolution = (resolution, resolution, turn)
    gaps = relative_gaps(pair, mean_heading=mean_heading)
    along = 1.02 * (pair.length + 2 * pair.ball_radius)
    across, around = _lateral_reach(pair)
    bounds = ((-across, across), (-along, along), (low, low + period))
    return sharp_surface(gaps, bounds, resolution, (around, False, True))


def _lateral_reach(pair: DumbbellPair) -> tuple[float, bool]:
    """Return the lateral reach of contact (mm), and whether it goes around the drum."""
    reach = pair.length + 2 * pair.ball_radius
    if pair.is_plane:
        return 1.02 * reach, False
    rho = pair.centre_radius
    half = math.asin(pair.length / (2 * rho))
    # Points that touch are 2 r apart or less and no nearer to the axis than the middle of a rod.
    depth = rho * math.cos(half)
    turn = 2 * half + 2 * math.asin(min(1.0, pair.ball_radius / depth)) if depth > 0 else math.pi
    return (math.pi * rho, True) if 1.02 * turn >= math.pi else (1.02 * turn * rho, False)

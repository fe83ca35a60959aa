"""Which placements, and which collisions, of two dumbbells end in a dyad.

They collide while one of them lies on the lowest line and the other rolls down to it.  A collision
has two coordinates: the axial offset of the second dumbbell and its heading.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.statics.minima import energy_symmetry, kind_of
from polycorner.landscapes import Basins, basins
from polycorner.minimisation import Certificate
from polycorner.toolkit import DEFAULT, Array, Progress, checked, checks, silent

STEPS = 5000  # towards a contact, at most: it is approached slowly where it grazes


@checked
def meetings(
    pair: DumbbellPair, offsets: ArrayLike, headings: ArrayLike, *, first: float = 0.0
) -> Array:
    """Return the placements in which a dumbbell that rolls down meets one on the lowest line.

    A lies on the lowest line.  B comes from larger azimuths, its axial offset and its heading
    unchanged, up to the first contact.

    Parameters
    ----------
    pair : DumbbellPair
    offsets : (k,) array
        ``eta_B - eta_A``, in mm.
    headings : (k,) array
        Of B, in radians.
    first : float, optional
        Heading of A, in radians.

    Returns
    -------
    (k, 6) array
        nan where B passes A by.

    Raises
    ------
    ValueError
        For offsets and headings of different numbers, or a drum that is not wide beside them.
    """
    checks.real("first", first)
    along, turns = (
        checks.numbers(name, values, "a few numbers")
        for name, values in (("offsets", offsets), ("headings", headings))
    )
    if along.shape != turns.shape:
        checks.refuse("headings", f"as many as offsets, {along.size}", turns.size)
    unit = 1.0 if pair.is_plane else pair.centre_radius
    far = pair.length + 4 * pair.ball_radius
    if not pair.is_plane and far > unit:
        checks.refuse("pair", f"a drum wider than {far:g} mm, from where B comes", pair)
    q = np.zeros((along.size, 6))
    q[:, 2], q[:, 3], q[:, 4], q[:, 5] = first, far / unit, along, turns
    moving = np.arange(along.size)
    for _ in range(STEPS):
        # No distance changes by more than B moves: no step goes beyond the first contact.
        gaps = pair.polyhedron.values(q[moving]).min(axis=1)
        q[moving, 3] -= gaps / unit
        touch = gaps <= DEFAULT.held * pair.ball_radius
        moving = moving[~touch & (q[moving, 3] * unit > -far)]
        if not moving.size:
            break
    q[q[:, 3] * unit <= -far] = np.nan
    return q


@checked
def meeting_basins(
    pair: DumbbellPair,
    starts: ArrayLike | int = 1000,
    *,
    widest: float = math.pi / 2,
    first: float = 0.0,
    rng: np.random.Generator | int | None = None,
    executor: Any = None,
    progress: Progress = silent,
) -> Basins:
    """Return the shares of collisions that end in dyads and in other minima, by their names.

    Parameters
    ----------
    pair : DumbbellPair
    starts : int or (k, 2) array, optional
        Axial offsets in mm and headings of B in radians; see :func:`meetings`.  A number of them is
        drawn uniformly: offsets as far as dumbbells reach, headings up to ``widest``.  Collisions
        are what is counted: a dumbbell that passes by is drawn again, or left out.
    widest : float, optional
        In radians.
    first : float, optional
        Heading of A, in radians.
    rng, executor, progress : optional
        As for :func:`~polycorner.landscapes.basins`.

    Returns
    -------
    Basins
        Minima up to shifts and relabelling; ``names`` are ``delta_R``, ``delta_L`` and those of
        :func:`~polycorner.dumbbells.minima_map`.  Offsets and headings of the collisions are
        columns 4 and 5 of ``points``.

    Raises
    ------
    TypeError, ValueError
        As for :func:`meetings`.
    """
    checks.real("widest", widest, above=0, most=math.pi / 2, unit="rad")
    if not isinstance(starts, int):
        given = checks.reals("starts", starts)
        if given.ndim != 2 or given.shape[1] != 2:
            checks.refuse("starts", "an array (k, 2) of offsets and headings", given.shape)
        return _named(pair, _met(meetings(pair, *given.T, first=first)), executor, progress)
    count = checks.whole("starts", starts, least=1, most=checks.MOST)
    generator, size = checks.generator("rng", rng), np.array([_reach(pair), widest])
    found = np.empty((0, 6))
    while len(found) < count:
        drawn = size * generator.uniform(-1, 1, (2 * count, 2))
        found = np.concatenate([found, _met(meetings(pair, *drawn.T, first=first))])
    return _named(pair, found[:count], executor, progress)


@checked
def placement_basins(
    pair: DumbbellPair,
    starts: int = 1000,
    *,
    rng: np.random.Generator | int | None = None,
    executor: Any = None,
    progress: Progress = silent,
) -> Basins:
    """Return the shares of placements within reach that end in dyads and in other minima.

    The centre of B is drawn uniformly among those less than ``l + 2 r`` from that of A in the
    developed plane, where dumbbells may touch, and so are both headings; the middle of the pair is
    on the lowest line, and placements that overlap are left out.  Otherwise this is as
    :func:`meeting_basins`.
    """
    count = checks.whole("starts", starts, least=1, most=checks.MOST)
    generator, found = checks.generator("rng", rng), np.empty((0, 6))
    unit = 1.0 if pair.is_plane else pair.centre_radius
    while len(found) < count:
        x, y, alpha, beta = generator.uniform(-1, 1, (4, 4 * count))
        half, turns = _reach(pair) / 2 * np.stack([x / unit, y]), math.pi * np.stack([alpha, beta])
        q = np.stack([*-half, turns[0], *half, turns[1]], axis=-1)[np.hypot(x, y) < 1]
        found = np.concatenate([found, q[np.asarray(pair.polyhedron.contains(q))]])
    return _named(pair, found[:count], executor, progress)


def _reach(pair: DumbbellPair) -> float:
    return pair.length + 2 * pair.ball_radius


def _met(q: Array) -> Array:
    return q[np.isfinite(q).all(axis=1)]


def _named(pair: DumbbellPair, starts: Array, executor: Any, progress: Progress) -> Basins:
    found = basins(
        pair.polyhedron,
        pair.energy,
        starts=starts,
        symmetry=energy_symmetry(pair),
        executor=executor,
        progress=progress,
    )
    return replace(found, names=tuple(_name(pair, c) for c in found.minima))


def _name(pair: DumbbellPair, minimum: Certificate) -> str:
    hand = pair.chirality(minimum.point)
    return f"{kind_of(minimum)}_{hand}" if hand else kind_of(minimum)

"""Pairs of dumbbells for the checks of section 5: distances by definition, atlases, first contacts.

The sizes are those of the paper's dyads; the drum is that of the experiment.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.dumbbells import DumbbellPair, PairAtlas, pair_atlas

Array = NDArray[np.float64]

PLANE = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5)
DRUM = replace(PLANE, drum_radius=125)
BALLS = ("A1", "A2", "B1", "B2")
# The eight contacts in which a ball takes part.
CONTACTS = ("A1B1", "A1B2", "A2B1", "A2B2", "A1b", "A2b", "aB1", "aB2")
# The contacts of the two kinds of corner, as the paper writes them.
DELTA = ("A2b", "aB1", "A2B1")
E_CORNER = ("A2b", "aB1", "A1B1", "A2B2")
# Renamings that leave a pair unchanged: of the balls of either dumbbell, and of the dumbbells.
BALL_NAMES = (
    {"A1": "A2", "A2": "A1", "B1": "B1", "B2": "B2"},
    {"A1": "A1", "A2": "A2", "B1": "B2", "B2": "B1"},
)
EXCHANGE = {"A1": "B1", "A2": "B2", "B1": "A1", "B2": "A2"}


@cache
def atlas(pair: DumbbellPair = PLANE, heading: float = 0.0) -> PairAtlas:
    """Return the atlas of a pair, computed once."""
    return pair_atlas(pair, heading=heading)


# ------------------------------------------------------------------------------------- distances


def parts(contact: str) -> tuple[str, str]:
    """Return the two parts in contact: ``A1b`` is the ball ``A1`` and the rod ``b``."""
    cut = 2 if contact[1].isdigit() else 1
    return contact[:cut], contact[cut:]


def between(pair: DumbbellPair, q: ArrayLike, first: str, second: str) -> Array:
    """Return the distance of two centres, or of a centre and an axial line, in space.

    Balls are ``A1`` to ``B2``, lines ``a`` and ``b``; a line has no ends.
    """
    centres = pair.ball_centres(q)
    at = {name: centres[..., k, :] for k, name in enumerate(BALLS)}
    if second in at and first not in at:
        first, second = second, first
    if second in at:
        return np.asarray(np.linalg.norm(at[first] - at[second], axis=-1))
    start, end = (at[f"{second.upper()}{k}"] for k in (1, 2))
    along = (end - start) / pair.length
    apart = at[first] - start
    foot = np.sum(apart * along, axis=-1, keepdims=True)
    return np.asarray(np.linalg.norm(apart - foot * along, axis=-1))


def least(pair: DumbbellPair, contact: str) -> float:
    """Return the least distance that a contact allows: ``2 r``, or ``r + t``."""
    r, t = pair.ball_radius, pair.rod_radius
    return 2 * r if len(contact) == 4 else r + t


def is_described(
    pair: DumbbellPair, q: Array, inequalities: Sequence[Callable[[Array], Array]], seed: int
) -> tuple[int, float]:
    """Compare ``D`` near a point with the inequalities ``f >= 0``.

    Returns the number of 2000 random points nearby for which they disagree with ``D``, and the
    share of the points that lies in ``D``.
    """
    rng = np.random.default_rng(seed)
    near = q + rng.uniform(-0.02, 0.02, (2000, 6)) * pair.manifold.scale_array
    inside = np.asarray(pair.polyhedron.contains(near))
    claimed = np.all([f(near) >= 0 for f in inequalities], axis=0)
    return int((inside != claimed).sum()), float(inside.mean())


def by_contacts(pair: DumbbellPair, names: Sequence[str]) -> list[Callable[[Array], Array]]:
    """Return the inequality of every contact, with axial lines in place of rods."""

    def gap(name: str) -> Callable[[Array], Array]:
        return lambda q: between(pair, q, *parts(name)) - least(pair, name)

    return [gap(name) for name in names]


def differentiated(pair: DumbbellPair, q: Array, names: Sequence[str]) -> Array:
    """Return differences of the distances over small steps, per scale unit, ``(m, 6)``."""
    steps = 1e-6 * np.diag(pair.manifold.scale_array)
    rows = [
        (between(pair, q + steps, *parts(name)) - between(pair, q - steps, *parts(name))) / 2e-6
        for name in names
    ]
    return np.array(rows)


# ---------------------------------------------------------------------------------- single contact


@cache
def first_contacts(
    pair: DumbbellPair = DRUM, count: int = 60, seed: int = 5
) -> list[tuple[str, Array]]:
    """Return pairs with one contact, all other gaps at least a quarter of a ball radius.

    From a random placement, dumbbell B is moved straight towards A until they touch.
    """
    rng = np.random.default_rng(seed)
    found = []
    for q in pair.placements(rng, count):
        ahead = q.copy()
        ahead[3:5] = q[:2]

        def moved(s: float, start: Array = q, end: Array = ahead) -> Array:
            return start + s * (end - start)

        def gap(s: float, move: Callable[[float], Array] = moved) -> float:
            return float(pair.polyhedron.values(move(s)).min())

        high = next(s for s in np.linspace(0.01, 1, 100) if gap(s) < 0)
        low = high - 0.01
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if gap(middle) >= 0 else (low, middle)
        point = moved(low)
        values = pair.polyhedron.values(point)
        if np.sort(values)[1] > pair.ball_radius / 4:
            found.append((pair.polyhedron.names[int(values.argmin())], point))
    return found


# ------------------------------------------------------------------------------------------- names


def renamed(contacts: frozenset[str], balls: dict[str, str]) -> frozenset[str]:
    """Return contacts after the balls, and with them the rods, have been renamed."""
    image = balls | {"a": balls["A1"][0].lower(), "b": balls["B1"][0].lower()}

    def new(name: str) -> str:
        first, second = (image[part] for part in parts(name))
        return first + second if first[0].upper() == "A" else second + first

    return frozenset(new(name) for name in contacts)


def kinds(strata: Sequence[frozenset[str]]) -> set[frozenset[frozenset[str]]]:
    """Return the classes of sets of contacts up to renaming; mirror images are identified."""
    classes = set()
    for contacts in strata:
        orbit = {contacts}
        while True:
            more = orbit | {renamed(c, g) for c in orbit for g in (*BALL_NAMES, EXCHANGE)}
            if more == orbit:
                break
            orbit = more
        classes.add(frozenset(orbit))
    return classes


def degrees(angle: float) -> float:
    """Return an angle in degrees between -180 and 180."""
    return math.degrees(math.remainder(angle, math.tau))

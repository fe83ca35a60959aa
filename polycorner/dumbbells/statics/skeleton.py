"""The skeleton of a pair of dumbbells: its corners and the motions that join them."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.symmetries import ball_relabellings, relabellings
from polycorner.polyhedra import Element
from polycorner.skeletons import Budget, Corner, Skeleton, skeleton
from polycorner.toolkit import (
    Array,
    Checked,
    Orbits,
    Progress,
    cached_property,
    checked,
    checks,
    orbits,
)

PLACEMENTS = 6


@dataclass(frozen=True)
class PairAtlas(Checked):
    """Corners, edges and faces of ``D`` for a pair, modulo motions of the pair as a whole.

    Attributes
    ----------
    pair : DumbbellPair
        The dumbbells.
    skeleton : Skeleton
        That of ``D`` in the plane, that of its section at a mean heading in the drum.
    heading : float or None
        That mean heading, in radians; None in the plane.
    """

    pair: DumbbellPair
    skeleton: Skeleton
    heading: float | None

    @cached_property
    def ordered(self) -> Mapping[str, Orbits]:
        """Corners, edges and faces up to relabelling of balls; A and B remain distinguished."""
        return self._orbits(ball_relabellings())

    @cached_property
    def unordered(self) -> Mapping[str, Orbits]:
        """Corners, edges and faces up to relabelling of the dumbbells and of their balls.

        Relabelling the balls of one dumbbell turns the mean heading by a quarter turn; in the drum
        the resulting relative placement is then identified with its nearest neighbour in the
        section.
        """
        return self._orbits(relabellings())

    def _orbits(self, elements: Sequence[Element]) -> Mapping[str, Orbits]:
        nearby = None if self.heading is None else self.pair.relative
        return orbits(self.skeleton, elements, nearby=nearby)

    @property
    def components(self) -> dict[int, int]:
        """Connected components of the strata of ``M x M`` by dimension, for labelled pairs.

        A corner of the relative placements is a component of ``D3``, an edge one of ``D4``, a face
        one of ``D5``; every one of them is swept out by the motions of the pair as a whole and,
        in the drum, by the mean heading.
        """
        counts = self.skeleton.components
        return {3 + k: counts[dimension] for k, dimension in enumerate(sorted(counts))}

    @property
    def components_ordered(self) -> dict[int, int]:
        """The same for ordered pairs with indistinguishable balls, headings modulo ``pi``."""
        return self._counts(self.ordered)

    @property
    def components_unordered(self) -> dict[int, int]:
        """The same for unordered pairs with indistinguishable balls."""
        return self._counts(self.unordered)

    def _counts(self, grouped: Mapping[str, Orbits]) -> dict[int, int]:
        """Count orbits by dimension; a single component of ``D6`` stays single."""
        counts = {3 + k: len(found) for k, found in enumerate(grouped.values())}
        return counts | ({6: 1} if self.components.get(6) == 1 else {})

    @checked
    def kind(self, corner: Corner) -> str:
        """Return the paper's letter for a corner with its chirality, see :func:`corner_kind`."""
        return corner_kind(corner.active, corner.chirality)


def corner_kind(active: Iterable[str], chirality: str | None) -> str:
    """Return the paper's letter for the contacts at a corner with a chirality, as ``Delta_R``.

    ``Delta``: a ball-ball contact and two ball-rod contacts; ``E``: two of either; for other
    corners the numbers of ball-ball, ball-rod and rod-rod contacts.
    """
    lengths = Counter(len(name) for name in active)
    numbers = (lengths[4], lengths[3], lengths[2])
    letter = {(1, 2, 0): "Delta", (2, 2, 0): "E"}.get(numbers, "C{}{}{}".format(*numbers))
    return f"{letter}_{chirality or 'N'}"


@checked
def pair_atlas(
    pair: DumbbellPair,
    *,
    heading: float = 0.0,
    budget: int = Budget.edges,
    progress: Progress | None = None,
    rng: np.random.Generator | int | None = None,
) -> PairAtlas:
    """Compute the atlas of a pair, in the plane or on a section of the drum.

    The search starts from nested pairs of both chiralities and from random placements.

    Parameters
    ----------
    pair : DumbbellPair
        The dumbbells.
    heading : float, optional
        Mean heading of the section in the drum, in radians.
    budget, progress, rng
        As for :func:`~polycorner.skeletons.search.skeleton`.
    """
    generator = checks.generator("rng", rng)
    found = skeleton(
        pair.polyhedron if pair.is_plane else pair.section(heading),
        pair_starts(pair, generator, heading),
        symmetry=pair.symmetry,
        budget=budget,
        progress=progress,
        rng=generator,
    )
    return PairAtlas(pair, found, None if pair.is_plane else heading)


def pair_starts(pair: DumbbellPair, rng: np.random.Generator, heading: float = 0.0) -> Array:
    """Return the starts of the search: nested pairs of both chiralities, random placements."""
    nested = [pair.nested(chirality, heading=heading) for chirality in ("R", "L")]
    fitting = [q for q in nested if pair.polyhedron.contains(q)]
    return np.array([*fitting, *pair.placements(rng, PLACEMENTS, heading=heading)])


@checked
def long_rod_length(ball_radius: float, rod_radius: float) -> float:
    """Return the length above which the rods are long enough, ``2 sqrt(4 r^2 - (r + t)^2)``.

    At this length a ball touches both balls of the other dumbbell and its rod at once: a right
    triangle with legs ``l/2`` and ``r + t`` and hypotenuse ``2 r``.  Below it the ball touches both
    balls before it reaches the rod, and no rod is ever touched.
    """
    checks.real("ball_radius", ball_radius, above=0)
    checks.real("rod_radius", rod_radius, least=0, most=ball_radius, unit="the unit of ball_radius")
    least, most = ball_radius - rod_radius, 3 * ball_radius + rod_radius
    return 2 * math.sqrt(least) * math.sqrt(most)

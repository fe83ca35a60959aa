"""The lines of a disconnectivity graph: where branches stand, end and are joined.

A *disconnectivity graph* ([BK]) shows how components of sublevel sets merge as the energy rises:
each minimum is the lower end of a vertical line, and a horizontal line at the energy of a pass
joins those of the components that merge there.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf

from polycorner.landscapes import Landscape, Merge

GAP = 0.6  # between trees that are not joined, in widths of a leaf


@dataclass(frozen=True)
class Stem:
    """A vertical line: a component of sublevel sets from where it begins to where it merges.

    Attributes
    ----------
    leaves : tuple of int
        Its minima, from left to right.
    across, low, high : float
        Its place in widths of a leaf, and the energies at its ends; infinite where it goes on.
    """

    leaves: tuple[int, ...]
    across: float
    low: float
    high: float


@dataclass(frozen=True)
class Crossbar:
    """A horizontal line: where two components merge.

    Attributes
    ----------
    merge : Merge
    left, right : float
        Its ends, in widths of a leaf.
    """

    merge: Merge
    left: float
    right: float

    @property
    def middle(self) -> float:
        """The place of the joined component."""
        return (self.left + self.right) / 2


@dataclass(frozen=True)
class Exit:
    """A height at which a component reaches the outside of a region.

    Attributes
    ----------
    number : int
        The pass over which it is left.
    across : float
        The place of its stem, in widths of a leaf.
    energy : (float, float)
    """

    number: int
    across: float
    energy: tuple[float, float]


@dataclass(frozen=True)
class DrawnTree:
    """Stems and bars of a landscape, ways out, and the places of its leaves by number."""

    stems: tuple[Stem, ...]
    bars: tuple[Crossbar, ...]
    exits: tuple[Exit, ...]
    places: dict[int, float]

    def stem(self, leaf: int, energy: float) -> Stem:
        """Return the component of a leaf just below an energy."""
        own = [s for s in self.stems if leaf in s.leaves]
        return next((s for s in own if energy <= s.high), own[-1])


def tree_of(landscape: Landscape) -> DrawnTree:
    """Lay out a landscape, each lowest minimum in the middle of what merges with it.

    Components that are nowhere joined are trees beside each other.
    """
    places: dict[int, float] = {}
    start = 0.0
    for part in sorted(_orders(len(landscape.minima), landscape.merges), key=min):
        places |= {leaf: start + k for k, leaf in enumerate(part)}
        start += len(part) + GAP
    # The components that are there, by any of their leaves.
    alive = {k: Stem((k,), x, landscape.minima[k].energy[0], inf) for k, x in places.items()}
    stems: list[Stem] = []
    bars: list[Crossbar] = []
    for merge in landscape.merges:
        pair = sorted((alive[merge.kept], alive[merge.ended]), key=lambda stem: stem.across)
        stems += [Stem(s.leaves, s.across, s.low, merge.energy[1]) for s in pair]
        bars.append(Crossbar(merge, pair[0].across, pair[1].across))
        leaves = pair[0].leaves + pair[1].leaves
        alive |= dict.fromkeys(leaves, Stem(leaves, bars[-1].middle, merge.energy[1], inf))
    stems += {id(stem): stem for stem in alive.values()}.values()
    drawn = DrawnTree(tuple(stems), tuple(bars), (), places)
    return replace(drawn, exits=tuple(_exits(landscape, drawn)))


def _exits(landscape: Landscape, tree: DrawnTree) -> Iterator[Exit]:
    """Yield the lowest ways out, once for each component, without those over other minima."""
    found = set()
    for k in range(len(landscape.minima)) if landscape.region else ():
        way = landscape.escape(k)
        stem = tree.stem(k, way.upper)
        if way.upper < inf and len(way.passes) == 1 and stem not in found:
            found.add(stem)
            yield Exit(way.passes[0], stem.across, (min(way.lower, way.upper), way.upper))


def _orders(count: int, merges: Sequence[Merge]) -> list[tuple[int, ...]]:
    """Return the leaves of each tree from left to right."""
    members: dict[int, tuple[int, ...]] = {k: (k,) for k in range(count)}
    for merge in merges:
        kept, ended = members[merge.kept], members[merge.ended]
        lowest = kept.index(min(kept))
        joined = kept + ended if 2 * lowest + 1 >= len(kept) else ended + kept
        members |= dict.fromkeys(joined, joined)
    return list(dict.fromkeys(members.values()))

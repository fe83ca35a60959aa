"""Corners and edges of a pair's skeleton up to relabelling, and drawings of the pair at them."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from numpy.typing import ArrayLike

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.bodies import contact_point, rod_outlines
from polycorner.dumbbells.pictures.symbols import CONTACT, KINDS, sizes_in_words
from polycorner.dumbbells.statics.skeleton import PairAtlas
from polycorner.toolkit import BODIES, Array


@dataclass(frozen=True)
class CornerClass:
    """A class of corners that differ by relabelling.

    Attributes
    ----------
    kind : str
        Such as ``Delta_R``.
    point : (6,) array
        A representative, and ``active`` its contacts.
    count : int
        Number of labelled corners in the class.
    """

    kind: str
    point: Array
    active: tuple[str, ...]
    count: int

    @property
    def hand(self) -> str:
        """Chirality: ``R``, ``L`` or ``N``."""
        return self.kind.split("_")[1]


@dataclass(frozen=True)
class EdgeClass:
    """A class of edges that differ by relabelling.

    Attributes
    ----------
    active : tuple of str
        Contacts of a representative.
    ends : (int, int)
        Classes of its corners; -1 where the edge ends at none.
    polyline : (k, 6) array
        The representative.
    count : int
        Number of labelled edges in the class.
    """

    active: tuple[str, ...]
    ends: tuple[int, int]
    polyline: Array
    count: int

    @property
    def contacts(self) -> str:
        """Numbers and kinds of the contacts."""
        words = ("ball–ball", "ball–rod", "rod–rod")
        numbers = zip(contact_counts(self.active), words, strict=True)
        return " + ".join(f"{n} {word}" for n, word in numbers if n)

    @property
    def colour(self) -> str:
        """Colour of the kind of edge."""
        return KINDS.get(contact_counts(self.active), "0.6")

    @property
    def names(self) -> str:
        """Names of the contacts, and the number of labelled edges."""
        return f"{', '.join(self.active)}  (×{self.count})"


def headline(atlas: PairAtlas) -> str:
    """Return the sizes of the pair, and whether it lies in the plane or in a drum."""
    pair = atlas.pair
    where = "plane" if pair.is_plane else f"drum of radius {pair.drum_radius:g} mm"
    turned = "" if atlas.heading is None else f", mean heading {math.degrees(atlas.heading):g}°"
    return f"{sizes_in_words(pair)}, {where}{turned}"


def relabelling_classes(atlas: PairAtlas) -> tuple[list[CornerClass], list[EdgeClass]]:
    """Return corners and edges up to relabelling of dumbbells and balls."""
    found, groups = atlas.skeleton, atlas.unordered
    nodes: list[CornerClass] = []
    motions: list[EdgeClass] = []
    owner: dict[int | None, int] = {None: -1}
    for group in groups["corners"]:
        corner = min((found.corners[m] for m in group), key=lambda c: _turned(c.point, c.active))
        owner |= dict.fromkeys(group, len(nodes))
        nodes.append(CornerClass(atlas.kind(corner), corner.point, corner.active, len(group)))
    for group in groups["edges"]:
        edge = min((found.edges[m] for m in group), key=lambda e: _turned(e.polyline[0], e.active))
        ends, way = (owner[edge.ends[0]], owner[edge.ends[1]]), edge.polyline
        if ends[0] > ends[1]:
            ends, way = ends[::-1], way[::-1]
        motions.append(EdgeClass(edge.active, ends, way, len(group)))
    return nodes, sorted(motions, key=lambda m: (contact_counts(m.active), m.ends))


def _turned(q: Array, active: tuple[str, ...]) -> tuple[int, tuple[str, ...]]:
    """Return a key that prefers axes the same way round, then the order of names."""
    return -round(2 * math.cos(q[5] - q[2])), active


def contact_counts(active: Iterable[str]) -> tuple[int, int, int]:
    """Return the numbers of ball-ball, ball-rod and rod-rod contacts."""
    lengths = Counter(len(name) for name in active)
    return lengths[4], lengths[3], lengths[2]


def facing(pair: DumbbellPair, q: Array, *, whole: bool) -> Array:
    """Return developed centres ``(4, 2)``, the pair or A in the middle, in the plane A upright."""
    centres = pair.developed(q)
    centres -= centres[: 4 if whole else 2].mean(axis=0)
    if not pair.is_plane:
        return centres
    x, y = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
    return np.asarray(centres @ np.array([[y, x], [-x, y]]))


def draw_flat_pair(
    axes: Axes,
    pair: DumbbellPair,
    centres: Array,
    active: Iterable[str],
    *,
    scale: float = 1.0,
    middle: ArrayLike = (0.0, 0.0),
) -> None:
    """Draw both dumbbells, developed, with the given contacts marked.

    Parameters
    ----------
    centres : (4, 2) array
        Ball centres ``A1, A2, B1, B2`` in mm.
    active : iterable of str
        Names of the contacts.
    scale, middle : optional
        Length of a millimetre in the drawing, and the place of the origin.
    """
    origin = np.asarray(middle, dtype=np.float64)
    drawn = origin + scale * centres
    rods = rod_outlines(drawn.reshape(2, 2, 2), scale * pair.rod_radius)
    for body, rod, colour in zip(drawn.reshape(2, 2, 2), rods, BODIES, strict=True):
        axes.add_patch(Polygon(rod, fc=colour, alpha=0.55, lw=0, zorder=5))
        for x, y in body:
            axes.add_patch(Circle((x, y), scale * pair.ball_radius, fc=colour, lw=0, zorder=5))
    for name in active:
        place = origin + scale * contact_point(pair, centres, name)
        axes.plot(*place, "o", color=CONTACT, mec="black", ms=6, zorder=6)

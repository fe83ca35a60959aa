"""A pair's skeleton up to relabelling: drawings at corners and edges, and the graph of them."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, PathPatch, Polygon
from matplotlib.path import Path as Curve
from numpy.typing import ArrayLike

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.bodies import contact_point, rod_outlines
from polycorner.dumbbells.pictures.symbols import (
    CONTACT,
    HANDS,
    KINDS,
    WORDS,
    corner_symbol,
    sizes_in_words,
)
from polycorner.dumbbells.statics.skeleton import PairAtlas
from polycorner.toolkit import BODIES, Array, checked


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


# -------------------------------------------------------------------------- the skeleton as a graph

BOX = 1.7  # side of a corner's box
DIAMOND = {"Delta_R": (-3.7, 0.0), "E_R": (0.0, 1.8), "E_L": (0.0, -1.8), "Delta_L": (3.7, 0.0)}


@checked
def draw_atlas(atlas: PairAtlas) -> Figure:
    """Draw the corners of the pair as small pictures, joined by its edges, up to relabelling.

    Contacts are marked; the box of a corner is coloured by its chirality.  An edge is coloured by
    its kind and labelled with the names of its contacts; the number in parentheses counts the
    labelled corners or edges of the class.  In the plane dumbbell A is upright.
    """
    nodes, motions = relabelling_classes(atlas)
    places = _places(nodes)
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    reach = np.abs(places).max(axis=0, initial=0.0) + 0.7 * BOX
    for motion, bend in _bent(motions):
        middle = _draw_edge(axes, places[motion.ends[0]], places[motion.ends[1]], bend, motion)
        reach = np.maximum(reach, np.abs(middle) + 0.4)
    shown = [facing(atlas.pair, node.point, whole=True) for node in nodes]
    size = max((np.ptp(centres, axis=0).max() for centres in shown), default=1.0)
    scale = 0.72 * BOX / (size + 2 * atlas.pair.ball_radius)
    for node, centres, place in zip(nodes, shown, places, strict=True):
        _draw_node(axes, atlas.pair, node, centres, place, scale)
    for colour, name in zip(BODIES, ("dumbbell A", "dumbbell B"), strict=True):
        axes.plot([], [], "o", color=colour, ms=9, label=name)
    axes.plot([], [], "o", color=CONTACT, mec="black", ms=6, label="contact")
    for hand in sorted({node.hand for node in nodes}, reverse=True):
        axes.plot([], [], "s", mfc="white", mec=HANDS[hand], mew=3, ms=9, label=WORDS[hand])
    figure.legend(loc="outside lower center", ncols=6, frameon=False)
    axes.set(xlim=(-reach[0], reach[0]), ylim=(-reach[1], reach[1]), aspect="equal")
    axes.set_axis_off()
    figure.set_size_inches(11, 11 * reach[1] / reach[0] + 1.1)
    few, many = atlas.components_unordered, atlas.components
    counts = [", ".join(str(sizes.get(k, 0)) for k in (3, 4, 5)) for sizes in (few, many)]
    counted = "corners, edges and faces up to relabelling {}; labelled {}".format(*counts)
    axes.set_title(f"{headline(atlas)}\n{counted}")
    return figure


def _bent(motions: Sequence[EdgeClass]) -> Iterator[tuple[EdgeClass, float]]:
    """Yield the edges that join two corners, and how far to bend each so that none coincide."""
    bundles: dict[frozenset[int], list[EdgeClass]] = {}
    for motion in motions:
        if -1 not in motion.ends:
            bundles.setdefault(frozenset(motion.ends), []).append(motion)
    for together in bundles.values():
        for k, motion in enumerate(sorted(together, key=lambda m: m.ends)):
            yield motion, k - (len(together) - 1) / 2


def _places(nodes: Sequence[CornerClass]) -> Array:
    if sorted(node.kind for node in nodes) == sorted(DIAMOND):
        return np.array([DIAMOND[node.kind] for node in nodes])
    ranks = np.argsort(np.argsort([node.hand != "R" for node in nodes], kind="stable"))
    turns = math.pi + math.tau * ranks / max(len(nodes), 1)
    reach = 0.0 if len(nodes) == 1 else max(2.4, 0.55 * len(nodes))
    return reach * np.stack([1.3 * np.cos(turns), np.sin(turns)], axis=-1)


def _draw_edge(axes: Axes, start: Array, stop: Array, bend: float, motion: EdgeClass) -> Array:
    """Draw an edge with its label, a loop if both ends are one corner; return its middle."""
    if np.array_equal(start, stop):
        turn = 0.8 * bend + (math.atan2(start[1], start[0]) if start.any() else math.pi / 2)
        arms = [3.4 * np.array([math.cos(turn + s), math.sin(turn + s)]) for s in (0.4, -0.4)]
        points, codes = [start, start + arms[0], start + arms[1], stop], [Curve.CURVE4] * 3
        middle = start + 0.375 * (arms[0] + arms[1])
    else:
        across = np.array([start[1] - stop[1], stop[0] - start[0]])
        control = (start + stop) / 2 + 0.6 * bend * across
        points, codes = [start, control, stop], [Curve.CURVE3] * 2
        middle = (start + stop) / 4 + control / 2
    curve = Curve(np.array(points), [Curve.MOVETO, *codes])
    axes.add_patch(PathPatch(curve, fc="none", ec=motion.colour, lw=3, zorder=1))
    label = {"boxstyle": "round", "fc": "white", "ec": motion.colour, "lw": 1.5}
    (x, y), text = middle, f"{motion.contacts}\n{motion.names}"
    axes.text(x, y, text, ha="center", va="center", fontsize=9, zorder=8, bbox=label)
    return np.asarray(middle)


def _draw_node(
    axes: Axes, pair: DumbbellPair, node: CornerClass, centres: Array, place: Array, scale: float
) -> None:
    x, y = place - BOX / 2
    box = FancyBboxPatch((x, y), BOX, BOX, "round,pad=0.05", fc="white", lw=3, zorder=4)
    box.set_edgecolor(HANDS[node.hand])
    axes.add_patch(box)
    middle = place + np.array([0.0, 0.09])
    draw_flat_pair(axes, pair, centres, node.active, scale=scale, middle=middle)
    caption = f"{', '.join(node.active)}  (×{node.count})"
    symbol = corner_symbol(node.kind)
    axes.text(x, y + BOX, symbol, c=HANDS[node.hand], fontsize=17, va="top", zorder=7)
    axes.text(place[0], y, caption, fontsize=8.5, ha="center", va="bottom", zorder=7)

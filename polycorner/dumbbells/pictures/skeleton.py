"""The atlas of the pair as a graph, its motions frame by frame, and the map of where it changes."""

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyBboxPatch, PathPatch
from matplotlib.path import Path as Curve

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.statics.skeleton import PairAtlas, long_rod_length
from polycorner.dumbbells.statics.skeleton_map import PairMap, Signature
from polycorner.pictures.style import BODIES, SHADES
from polycorner.skeletons.points import Quotient, projected
from polycorner.spaces.manifold import Array

HANDS = {"R": "#009E73", "L": "#CC79A7", "N": "0.55"}
WORDS = {"R": "right-handed", "L": "left-handed", "N": "without chirality"}
KINDS = {(2, 0, 0): "#0072B2", (1, 1, 0): "#E69F00", (0, 2, 0): "0.35"}
LIT = "#F0E442"
FRAMES = 5
TOUCH = 1e-6  # ball radii within which a contact of a frame counts as closed
BOX = 1.7  # side of a corner's box
DIAMOND = {"Delta_R": (-3.7, 0.0), "E_R": (0.0, 1.8), "E_L": (0.0, -1.8), "Delta_L": (3.7, 0.0)}

# ------------------------------------------------------------------------------------------- map


def draw_map(found: PairMap) -> Figure:
    """Draw where the atlas of the pair in the plane changes, over ``l/r`` and ``t/r``.

    A dot for every atlas of the grid, coloured by its signature; rings for the changes found by
    bisection; dashed the closed form.  Each signature is described where it reigns, and the one
    exactly at the closed form beside it.
    """
    figure = Figure(figsize=(9, 6.4), layout="constrained")
    axes = figure.add_subplot()
    low, high = float(found.lengths[0]), float(found.lengths[-1])
    x, y = np.meshgrid(found.lengths, found.rods)
    for k, signature in enumerate(found.signatures):
        here, colour = found.table == k, SHADES[(1 + 2 * k) % len(SHADES)]
        if here.any():
            axes.plot(x[here], y[here], "o", ms=5, ls="", color=colour, alpha=0.5, zorder=1)
            record = (float(np.median(x[here])), float(np.median(y[here])))
            box = {"boxstyle": "round", "fc": "white", "ec": colour, "lw": 1.5}
            axes.text(*record, _described(signature), ha="center", va="center", fontsize=8.5,
                      zorder=2, bbox=box)  # fmt: skip
    rods = np.linspace(0.0, 1.0, 200)
    exact = [long_rod_length(1.0, t) for t in rods.tolist()]
    axes.plot(exact, rods, "k--", lw=1.2, zorder=3, label=r"$2\sqrt{4r^2-(r+t)^2}$")
    if len(found.change_rods):
        _draw_changes(axes, found)
    axes.axvspan(0.0, 2.0, color="0.93", zorder=0)
    axes.set(xlim=(min(low, 2.0) - 0.1, high + 0.1), ylim=(0, 1))
    axes.set(xlabel="length $l/r$", ylabel="rod radius $t/r$")
    notation = "$C^{ijk}$: a corner with $i$ ball–ball, $j$ ball–rod and $k$ rod–rod contacts"
    axes.set_title(f"Corners, edges and faces of the pair in the plane\n{notation}", fontsize=11)
    axes.legend(loc="upper right", framealpha=1.0)
    return figure


def _draw_changes(axes: Axes, found: PairMap) -> None:
    middle, odd = found.change_brackets.mean(axis=1), ~found.explained
    axes.plot(middle, found.change_rods, "o", ms=9, mfc="none", mec="black", ls="", zorder=4,
              label="change, by bisection")  # fmt: skip
    if odd.any():
        axes.plot(middle[odd], found.change_rods[odd], "rx", ms=11, zorder=5, label="unexplained")
    met = sorted(set(found.critical[found.critical >= 0].tolist()))
    text = "\n".join(["exactly on the curve:", *(_described(found.signatures[k]) for k in met)])
    axes.annotate(text, (float(middle[0]), float(found.change_rods[0])), xytext=(40, 4),
                  textcoords="offset points", fontsize=8.5, va="bottom", zorder=5,
                  bbox={"boxstyle": "round", "fc": "white", "ec": "black"},
                  arrowprops={"arrowstyle": "->", "lw": 0.8})  # fmt: skip


def _described(signature: Signature) -> str:
    counts = (signature.labelled, signature.ordered, signature.pattern.counts)
    kinds = ",  ".join(_written(kind) for kind, _ in signature.pattern.corners)
    words = ("balls labelled", "dumbbells labelled", "nothing labelled")
    rows = ["{}, {}, {}  {}".format(*n, word) for n, word in zip(counts, words, strict=True)]
    return "\n".join([kinds, *rows, *([] if signature.sound else ["not whole"])])


def _written(kind: str) -> str:
    """Return a kind of corner as it is typeset."""
    letter, hand = kind.split("_")
    named = {"Delta": r"\Delta", "E": r"\mathcal{E}"}.get(letter, f"C^{{{letter[1:]}}}")
    return f"${named}_{hand}$" if hand != "N" else f"${named}$"


# ----------------------------------------------------------------------------------------- graph


@dataclass(frozen=True)
class _Node:
    """A corner up to relabelling: its kind, the one that is shown, and how many it stands for."""

    kind: str
    point: Array
    active: tuple[str, ...]
    count: int

    @property
    def hand(self) -> str:
        return self.kind.split("_")[1]


@dataclass(frozen=True)
class _Motion:
    """An edge up to relabelling: contacts, nodes at its ends (-1: none), a way along it, number."""

    active: tuple[str, ...]
    ends: tuple[int, int]
    polyline: Array
    count: int

    @property
    def contacts(self) -> str:
        words = ("ball–ball", "ball–rod", "rod–rod")
        numbers = zip(_numbers(self.active), words, strict=True)
        return " + ".join(f"{n} {word}" for n, word in numbers if n)

    @property
    def colour(self) -> str:
        return KINDS.get(_numbers(self.active), "0.6")

    @property
    def names(self) -> str:
        return f"{', '.join(self.active)}  (×{self.count})"


def draw_atlas(atlas: PairAtlas) -> Figure:
    """Draw the corners of the pair as little pictures, joined by its motions, up to relabelling.

    Contacts are lit; the box of a corner is coloured by its chirality.  A motion is coloured by
    its contacts and carries their names; behind either stands for how many labelled corners or
    edges it is there.  In the plane dumbbell A is upright.
    """
    nodes, motions = _quotient(atlas)
    records = _places(nodes)
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    reach = np.abs(records).max(axis=0, initial=0.0) + 0.7 * BOX
    for motion, bend in _bent(motions):
        middle = _draw_edge(axes, records[motion.ends[0]], records[motion.ends[1]], bend, motion)
        reach = np.maximum(reach, np.abs(middle) + 0.4)
    shown = [_facing(atlas.pair, node.point, whole=True) for node in nodes]
    size = max((np.ptp(centres, axis=0).max() for centres in shown), default=1.0)
    scale = 0.72 * BOX / (size + 2 * atlas.pair.ball_radius)
    for node, centres, record in zip(nodes, shown, records, strict=True):
        _draw_node(axes, atlas.pair, node, scale * centres, record, scale)
    for colour, name in zip(BODIES, ("dumbbell A", "dumbbell B"), strict=True):
        axes.plot([], [], "o", color=colour, ms=9, label=name)
    axes.plot([], [], "o", color=LIT, mec="black", ms=6, label="contact")
    for hand in sorted({node.hand for node in nodes}, reverse=True):
        axes.plot([], [], "s", mfc="white", mec=HANDS[hand], mew=3, ms=9, label=WORDS[hand])
    figure.legend(loc="outside lower center", ncols=6, frameon=False)
    axes.set(xlim=(-reach[0], reach[0]), ylim=(-reach[1], reach[1]), aspect="equal")
    axes.set_axis_off()
    figure.set_size_inches(11, 11 * reach[1] / reach[0] + 1.1)
    few, many = atlas.components_unordered, atlas.components
    counts = [", ".join(str(sizes.get(k, 0)) for k in (3, 4, 5)) for sizes in (few, many)]
    counted = "corners, edges and faces up to relabelling {}; labelled {}".format(*counts)
    axes.set_title(f"{_headline(atlas)}\n{counted}")
    return figure


def _bent(motions: Sequence[_Motion]) -> Iterator[tuple[_Motion, float]]:
    """Yield the motions that join two corners, and how far to bend each beside its like."""
    bundles: dict[frozenset[int], list[_Motion]] = {}
    for motion in motions:
        if -1 not in motion.ends:
            bundles.setdefault(frozenset(motion.ends), []).append(motion)
    for together in bundles.values():
        for k, motion in enumerate(sorted(together, key=lambda m: m.ends)):
            yield motion, k - (len(together) - 1) / 2


def _headline(atlas: PairAtlas) -> str:
    pair = atlas.pair
    where = "plane" if pair.is_plane else f"drum of radius {pair.drum_radius:g} mm"
    turned = "" if atlas.heading is None else f", mean heading {math.degrees(atlas.heading):g}°"
    sizes = f"l = {pair.length:g}, r = {pair.ball_radius:g}, t = {pair.rod_radius:g} mm"
    return f"{sizes}, {where}{turned}"


def _quotient(atlas: PairAtlas) -> tuple[list[_Node], list[_Motion]]:
    found, groups = atlas.skeleton, atlas.unordered
    nodes: list[_Node] = []
    motions: list[_Motion] = []
    owner: dict[int | None, int] = {None: -1}
    for group in groups["corners"]:
        corner = min((found.corners[m] for m in group), key=lambda c: _turned(c.point, c.active))
        owner |= dict.fromkeys(group, len(nodes))
        nodes.append(_Node(atlas.kind(corner), corner.point, corner.active, len(group)))
    for group in groups["edges"]:
        edge = min((found.edges[m] for m in group), key=lambda e: _turned(e.polyline[0], e.active))
        ends, way = (owner[edge.ends[0]], owner[edge.ends[1]]), edge.polyline
        if ends[0] > ends[1]:
            ends, way = ends[::-1], way[::-1]
        motions.append(_Motion(edge.active, ends, way, len(group)))
    return nodes, sorted(motions, key=lambda m: (_numbers(m.active), m.ends))


def _turned(q: Array, active: tuple[str, ...]) -> tuple[int, tuple[str, ...]]:
    """Return a key that prefers axes the same way round, then the order of names."""
    return -round(2 * math.cos(q[5] - q[2])), active


def _numbers(active: Iterable[str]) -> tuple[int, int, int]:
    lengths = Counter(len(name) for name in active)
    return lengths[4], lengths[3], lengths[2]


def _places(nodes: Sequence[_Node]) -> Array:
    if sorted(node.kind for node in nodes) == sorted(DIAMOND):
        return np.array([DIAMOND[node.kind] for node in nodes])
    ranks = np.argsort(np.argsort([node.hand != "R" for node in nodes], kind="stable"))
    turns = math.pi + math.tau * ranks / max(len(nodes), 1)
    reach = 0.0 if len(nodes) == 1 else max(2.4, 0.55 * len(nodes))
    return reach * np.stack([1.3 * np.cos(turns), np.sin(turns)], axis=-1)


def _draw_edge(axes: Axes, start: Array, stop: Array, bend: float, motion: _Motion) -> Array:
    """Draw a motion, as a loop where it returns; return the middle, where its label is."""
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
    axes: Axes, pair: DumbbellPair, node: _Node, centres: Array, record: Array, scale: float
) -> None:
    x, y = record - BOX / 2
    box = FancyBboxPatch((x, y), BOX, BOX, "round,pad=0.05", fc="white", lw=3, zorder=4)
    box.set_edgecolor(HANDS[node.hand])
    axes.add_patch(box)
    _draw_bodies(axes, pair, centres + record + np.array([0.0, 0.09]), scale, node.active)
    caption = f"{', '.join(node.active)}  (×{node.count})"
    axes.text(x, y + BOX, _written(node.kind), c=HANDS[node.hand], fontsize=17, va="top", zorder=7)
    axes.text(record[0], y, caption, fontsize=8.5, ha="center", va="bottom", zorder=7)


# --------------------------------------------------------------------------------------- motions


def draw_motions(atlas: PairAtlas) -> Figure:
    """Draw every motion of the pair up to relabelling as a strip, from one corner to the other.

    In the plane dumbbell A stands still and B moves around it; in the drum the pair is shown in
    the developed plane, the axis of the drum upright.  Every frame lies on its edge exactly.
    """
    nodes, motions = _quotient(atlas)
    pair, count, margin = atlas.pair, max(len(motions), 1), 1.04 * atlas.pair.ball_radius
    figure = Figure(figsize=(11, 0.6 + 2.3 * count), layout="constrained")
    figure.suptitle(_headline(atlas))
    for row, motion in zip(figure.subplots(count, FRAMES, squeeze=False), motions, strict=False):
        frames = _frames(atlas, motion)
        shown = np.array([_facing(pair, q, whole=not pair.is_plane) for q in frames])
        low, high = shown.min(axis=(0, 1)), shown.max(axis=(0, 1))
        for axes, q, centres in zip(row, frames, shown, strict=True):
            gaps = dict(zip(pair.polyhedron.names, pair.polyhedron.values(q), strict=True))
            closed = [name for name in gaps if abs(gaps[name]) < TOUCH * pair.ball_radius]
            _draw_bodies(axes, pair, centres, 1.0, closed)
            (left, bottom), (right, top) = low - margin, high + margin
            axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
            axes.set_axis_off()
        for axes, end in zip((row[0], row[-1]), motion.ends, strict=True):
            if end >= 0:
                colour = HANDS[nodes[end].hand]
                axes.set_title(_written(nodes[end].kind), fontsize=15, color=colour)
        row[FRAMES // 2].set_title(f"{motion.contacts}:  {motion.names}", fontsize=10)
    return figure


def _frames(atlas: PairAtlas, motion: _Motion) -> list[Array]:
    """Return points of an edge at equal distances along it, both ends included."""
    polyhedron, way = atlas.skeleton.polyhedron, motion.polyline
    scales = polyhedron.manifold.scale_array
    steps = np.linalg.norm(np.diff(way, axis=0) / scales, axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, travelled[-1], FRAMES)
    chords = np.stack([np.interp(at, travelled, x) for x in way.T], axis=-1)
    quotient = Quotient(polyhedron, atlas.pair.symmetry, TOUCH, float(travelled[-1]))
    held = [polyhedron.names.index(name) for name in motion.active]
    settled = [projected(quotient, q, quotient.at(q).basis(held), 1.0) for q in chords[1:-1]]
    inner = [q if s is None else s.q for q, s in zip(chords[1:-1], settled, strict=True)]
    return [way[0], *inner, way[-1]]


# ---------------------------------------------------------------------------------------- bodies


def _facing(pair: DumbbellPair, q: Array, *, whole: bool) -> Array:
    """Return developed centres ``(4, 2)``, the pair or A in the middle, in the plane A upright."""
    centres = pair.developed(q)
    centres -= centres[: 4 if whole else 2].mean(axis=0)
    if not pair.is_plane:
        return centres
    x, y = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
    return np.asarray(centres @ np.array([[y, x], [-x, y]]))


def _draw_bodies(
    axes: Axes, pair: DumbbellPair, centres: Array, scale: float, active: Iterable[str]
) -> None:
    """Draw both dumbbells in the plane with the given contacts lit."""
    for body, colour in zip((centres[:2], centres[2:]), BODIES, strict=True):
        along = (body[1] - body[0]) / np.linalg.norm(body[1] - body[0])
        side = scale * pair.rod_radius * np.array([-along[1], along[0]])
        rod = Curve(np.array([body[0] + side, body[1] + side, body[1] - side, body[0] - side]))
        axes.add_patch(PathPatch(rod, fc=colour, alpha=0.55, lw=0, zorder=5))
        for x, y in body:
            axes.add_patch(Circle((x, y), scale * pair.ball_radius, fc=colour, lw=0, zorder=5))
    for name in active:
        axes.plot(*_touching(pair, centres, name), "o", color=LIT, mec="black", ms=6, zorder=6)


def _touching(pair: DumbbellPair, centres: Array, name: str) -> Array:
    """Return where a contact is drawn."""
    ball = dict(zip(("A1", "A2", "B1", "B2"), centres, strict=True))
    if name == "ab":
        lines = np.stack([centres[1] - centres[0], centres[2] - centres[3]], axis=-1)
        s = np.linalg.lstsq(lines, centres[2] - centres[0], rcond=None)[0][0]
        return np.asarray(centres[0] + np.clip(s, 0, 1) * (centres[1] - centres[0]))
    if len(name) == 4:
        return np.asarray((ball[name[:2]] + ball[name[2:]]) / 2)
    one = ball[name[:2] if name.endswith("b") else name[1:]]
    start, stop = centres[2:] if name.endswith("b") else centres[:2]
    axis = stop - start
    foot = start + axis * np.clip((one - start) @ axis / (axis @ axis), 0, 1)
    share = pair.ball_radius / (pair.ball_radius + pair.rod_radius)
    return np.asarray(one + share * (foot - one))

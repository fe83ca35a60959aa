"""Figures of the minima of pairs: maps over the proportions, and an example of each kind."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon

from polycorner.branches import BranchKind
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.bodies import rod_outlines
from polycorner.dumbbells.pictures.symbols import corner_symbol
from polycorner.dumbbells.statics.minima_map import MinimaMap, MinimaSheet
from polycorner.dumbbells.statics.regions import Plane, deepest, filled
from polycorner.dumbbells.statics.skeleton import long_rod_length
from polycorner.dumbbells.statics.skeleton_map import PairMap, Signature
from polycorner.minimisation import Certificate
from polycorner.toolkit import BODIES, SHADES, Array, checked

UNSEEN, NONE = "0.75", "white"
NESTED = {"staggered": "#E69F00", "delta": "#56B4E9"}
MARKS = ("x", "+", "1", "2", "3", "4", "|", "_", "*", "P", "^", "v", "<", ">", "s", "D")
ASIDE = 0.16  # distance of marks, in logarithms of the length
TICKS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 2.2, 3, 4, 6, 8, 12, 16, 24)
COLUMNS = 4


@checked
def draw_minima_map(found: MinimaMap) -> Figure:
    """Draw, for every ``l/R``, the regions with the same minima over ``l/r`` and ``t/r``.

    The colour of a region is its nested kind; marks are further kinds beside ``G``.  Borders are
    drawn by what happens there, dashed where what is beyond was not followed but listed.
    """
    panels = max(len(found.sheets), 1)
    columns = min(2, panels)
    rows = math.ceil(panels / columns)
    figure = Figure(figsize=(5.2 * columns, 4.1 * rows + 1.2), layout="constrained")
    for i, sheet in enumerate(found.sheets):
        _draw_sheet(figure.add_subplot(rows, columns, i + 1), found, sheet)
    figure.suptitle("Kinds of minima of a pair beside G, and their numbers where there are several")
    figure.legend(handles=_handles(found), loc="outside lower center", ncols=4, frameon=False)
    return figure


@checked
def draw_kinds(found: MinimaMap) -> Figure:
    """Draw an example of each kind, seen from above and along the drum.

    Nearer bodies are drawn over farther ones; the dashed line is the lowest of the drum.
    """
    rows = math.ceil(len(found.kinds) / COLUMNS) or 1
    figure = Figure(figsize=(3.4 * COLUMNS, 4.6 * rows), layout="constrained")
    parts: Any = figure.subfigures(rows, COLUMNS, squeeze=False)
    for part, kind in zip(parts.ravel(), found.kinds, strict=False):
        pair, certificate = found.examples[kind]
        above, front = part.subplots(2, 1, height_ratios=(3, 2))
        _draw_above(above, pair, certificate)
        _draw_front(front, pair, certificate)
        sizes = f"l = {pair.length:g}, t = {pair.rod_radius:g}, R = {pair.drum_radius:.3g}"
        energy = f"E/r = {certificate.energy / pair.ball_radius:.4f}"
        part.suptitle(f"{kind}\n{sizes}\n{energy}", fontsize=9)
    return figure


def _draw_sheet(axes: Axes, found: MinimaMap, sheet: MinimaSheet) -> None:
    axes.set_facecolor(UNSEEN)
    if sheet.within is not None:
        sides = sheet.within.rods, sheet.within.lengths
        _draw_regions(axes, found, sheet, Plane(sides, len(sheet.labels)))
    for border in sheet.borders:
        style = "dashed" if border.kind is BranchKind.UNDECIDED else "solid"
        axes.plot(*border.parameters[:, ::-1].T, color="black", lw=1.2, ls=style)
    axes.set(xscale="log", yscale="log", xlabel="l/r", ylabel="t/r")
    axes.set(xlim=found.lengths, ylim=found.rods)
    for axis, ends in ((axes.xaxis, found.lengths), (axes.yaxis, found.rods)):
        ticks = [x for x in TICKS if ends[0] <= x <= ends[1]]
        axis.set_ticks(ticks, [f"{x:g}" for x in ticks])
        axis.set_ticks([], minor=True)
    axes.set_title(f"l/R = {sheet.curvature:g}" if sheet.curvature else "plane")


def _draw_regions(axes: Axes, found: MinimaMap, sheet: MinimaSheet, plane: Plane) -> None:
    colours, layer = [NONE, *NESTED.values()], np.zeros_like(sheet.labels)
    for k, region in enumerate(sheet.regions):
        nested = [i for i, kind in enumerate(NESTED, 1) if kind in region.kinds]
        layer[filled(sheet.labels) == k] = nested[-1] if nested else 0
        others = [(mark, region.kinds.get(kind, 0)) for kind, mark in _marks(found).items()]
        _mark(axes, plane.at(deepest(sheet.labels == k)), [one for one in others if one[1]])
    axes.pcolormesh(
        *plane.axes[::-1],
        layer,
        shading="nearest",
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        rasterized=True,
    )


def _mark(axes: Axes, place: tuple[float, float], marks: list[tuple[str, int]]) -> None:
    """Draw marks side by side, with the number of minima where it is not one."""
    rod, length = place
    for k, (mark, count) in enumerate(marks):
        at = length * math.exp(ASIDE * (k - (len(marks) - 1) / 2))
        axes.plot(at, rod, mark, color="black", markersize=8)
        if count > 1:
            axes.annotate(
                f"{count}", (at, rod), xytext=(3, 4), textcoords="offset points", fontsize=7
            )


def _marks(found: MinimaMap) -> dict[str, str]:
    others = [kind for kind in found.kinds if kind != "G" and kind not in NESTED]
    return dict(zip(others, MARKS, strict=False))


def _handles(found: MinimaMap) -> list[Patch | Line2D]:
    handles: list[Patch | Line2D] = [
        Patch(facecolor=NONE, edgecolor="0.6", label="none nested"),
        *[Patch(facecolor=colour, label=kind) for kind, colour in NESTED.items()],
        Patch(facecolor=UNSEEN, label="does not fit"),
        Line2D([], [], color="black", label="followed on both sides"),
        Line2D([], [], color="black", ls="dashed", label="listed on one side"),
    ]
    for kind, mark in _marks(found).items():
        handles.append(Line2D([], [], marker=mark, color="black", linestyle="", label=kind))
    return handles


def _draw_above(axes: Axes, pair: DumbbellPair, certificate: Certificate) -> None:
    centres = pair.ball_centres(certificate.point)
    along = centres[:, 1] - centres[:, 1].mean()
    flat = np.stack([centres[:, 0], along], axis=-1)
    _draw_bodies(axes, pair, flat, centres[:, 2])
    axes.axvline(0, color="0.5", linewidth=0.8, linestyle="--", zorder=0)
    reach = float(abs(flat).max()) + 1.5 * pair.ball_radius
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach))


def _draw_front(axes: Axes, pair: DumbbellPair, certificate: Certificate) -> None:
    centres = pair.ball_centres(certificate.point)
    flat = centres[:, [0, 2]]
    if not pair.is_plane:
        axes.add_patch(Circle((0, 0), pair.drum_radius, color="0.75", fill=False))
    _draw_bodies(axes, pair, flat, -centres[:, 1])
    low, high = flat.min(axis=0), flat.max(axis=0)
    middle, reach = (low + high) / 2, float((high - low).max()) / 2 + 1.5 * pair.ball_radius
    tall = max(float(high[1] - low[1]) / 2 + 1.5 * pair.ball_radius, reach / 3)
    axes.set(xlim=(middle[0] - reach, middle[0] + reach))
    axes.set(ylim=(middle[1] - tall, middle[1] + tall))


def _draw_bodies(axes: Axes, pair: DumbbellPair, flat: Array, height: Array) -> None:
    """Draw four balls and two rods, the lowest first."""
    for k, centre in enumerate(flat):
        ball = Circle((centre[0], centre[1]), pair.ball_radius, facecolor=BODIES[k // 2])
        ball.set(edgecolor="white", linewidth=0.8, zorder=1 + _rank(height[k], height))
        axes.add_patch(ball)
    for body in (slice(0, 2), slice(2, 4)):
        ends, level = flat[body], float(height[body].mean())
        colour = BODIES[0 if body.start == 0 else 1]
        rod = Polygon(rod_outlines(ends, pair.rod_radius), color=colour)
        rod.set(linewidth=0.8, zorder=0.9 + _rank(level, height))
        axes.add_patch(rod)
    axes.set_aspect("equal")
    axes.set(xticks=[], yticks=[])


def _rank(level: float, height: Array) -> float:
    """Return a drawing order between 0 and 1."""
    low, high = float(height.min()), float(height.max())
    return (level - low) / (high - low) if high - low > 1e-6 * abs(high) else 0.5


# -------------------------------------------------------- proportions at which the skeleton changes


@checked
def draw_pair_map(found: PairMap) -> Figure:
    """Draw where the skeleton of the pair in the plane changes, over ``l/r`` and ``t/r``.

    A dot for every skeleton of the grid, coloured by its signature; rings for the changes found by
    bisection; dashed the closed form.  The legend describes the signatures, those that occur only
    at the changes included.
    """
    figure = Figure(figsize=(11, 6), layout="constrained")
    axes = figure.add_subplot()
    low, high = float(found.lengths[0]), float(found.lengths[-1])
    x, y = np.meshgrid(found.lengths, found.rods)
    for k, signature in enumerate(found.signatures):
        here, colour = found.table == k, SHADES[(1 + 2 * k) % len(SHADES)]
        if here.any():
            label = _described(signature)
            axes.plot(x[here], y[here], "o", ms=5, ls="", color=colour, label=label, zorder=1)
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
    figure.legend(loc="outside right upper", frameon=False, fontsize=9, labelspacing=1.2)
    return figure


def _draw_changes(axes: Axes, found: PairMap) -> None:
    middle, odd = found.change_brackets.mean(axis=1), ~found.explained
    met = sorted(set(found.critical[found.critical >= 0].tolist()))
    rows = ["change, by bisection"]
    if met:
        rows += ["exactly there:", *(_described(found.signatures[k]) for k in met)]
    label = "\n".join(rows)
    axes.plot(
        middle, found.change_rods, "o", ms=9, mfc="none", mec="black", ls="", zorder=4, label=label
    )
    if odd.any():
        axes.plot(middle[odd], found.change_rods[odd], "rx", ms=11, zorder=5, label="unexplained")


def _described(signature: Signature) -> str:
    counts = (signature.labelled, signature.ordered, signature.pattern.counts)
    kinds = ",  ".join(corner_symbol(kind) for kind, _ in signature.pattern.corners)
    words = ("balls labelled", "dumbbells labelled", "nothing labelled")
    rows = ["{}, {}, {}  {}".format(*n, word) for n, word in zip(counts, words, strict=True)]
    return "\n".join([kinds, *rows, *([] if signature.sound else ["incomplete"])])

"""Figures of the minima of pairs: a map over the proportions, and an example of each kind."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.bodies import rod_outlines
from polycorner.dumbbells.statics.minima_map import MinimaMap, crossing_clearance
from polycorner.dumbbells.statics.skeleton import long_rod_length
from polycorner.minimisation import Certificate
from polycorner.toolkit import BODIES, Array, checked

UNSEEN, NONE = "0.75", "white"
NESTED = {"staggered": "#E69F00", "delta": "#56B4E9"}
MARKS = ("x", "+", "1", "2", "3", "4", "|", "_", "*", "P", "^", "v", "<", ">", "s", "D")
ASIDE = 0.14  # distance of marks within a cell, in logarithms of the length
FINE = 90  # points of a closed-form curve along either axis
COLUMNS = 4


@checked
def draw_minima_map(found: MinimaMap) -> Figure:
    """Draw, for every ``l/R``, the kinds of minima found over ``l/r`` and ``t/r``.

    The colour of a cell is the nested kind found there; marks are further kinds beside ``G``.
    Lines are closed forms: full, the length above which a ball reaches the other's rod; dashed,
    the boundary of the region in which a level crossing fits.
    """
    panels = len(found.curvatures)
    columns = min(2, panels)
    rows = math.ceil(panels / columns)
    figure = Figure(figsize=(5.2 * columns, 4.1 * rows + 1.2), layout="constrained")
    for i in range(panels):
        axes = figure.add_subplot(rows, columns, i + 1)
        _draw_panel(axes, found, i)
    figure.suptitle(f"Kinds of minima of a pair beside G, {found.starts} starts for each pair")
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


def _draw_panel(axes: Axes, found: MinimaMap, i: int) -> None:
    colours, layer = [UNSEEN, NONE], np.where(found.examined[i], 1, 0)
    for kind, colour in NESTED.items():
        colours.append(colour)
        layer[found.has(kind)[i]] = len(colours) - 1
    axes.pcolormesh(
        _edges(found.lengths),
        _edges(found.rods),
        layer,
        cmap=ListedColormap(colours),
        vmin=-0.5,
        vmax=len(colours) - 0.5,
        edgecolor="0.85",
        linewidth=0.5,
    )
    marks = _marks(found)
    shown = np.array([found.has(kind)[i] for kind in marks]).reshape(len(marks), *layer.shape)
    places = shown.cumsum(axis=0) - 1 - (shown.sum(axis=0) - 1) / 2
    for mark, there, place in zip(marks.values(), shown, places, strict=True):
        j, k = np.nonzero(there)
        aside = found.lengths[k] * np.exp(ASIDE * place[j, k])
        axes.plot(aside, found.rods[j], mark, color="black", markersize=9)
    _draw_curves(axes, found, float(found.curvatures[i]))
    axes.set(xscale="log", yscale="log", xlabel="l/r", ylabel="t/r")
    for axis, ticks in ((axes.xaxis, found.lengths), (axes.yaxis, found.rods)):
        axis.set_ticks(ticks, [f"{x:g}" for x in ticks])
        axis.set_ticks([], minor=True)
    curvature = found.curvatures[i]
    axes.set_title(f"l/R = {curvature:g}" if curvature else "plane")


def _draw_curves(axes: Axes, found: MinimaMap, curvature: float) -> None:
    across, up = _edges(found.lengths), _edges(found.rods)
    rods = np.geomspace(up[0], min(up[-1], 0.999), FINE)
    lengths = np.geomspace(across[0], across[-1], FINE)
    axes.plot([long_rod_length(1.0, t) for t in rods.tolist()], rods, color="black", lw=1.5)
    axes.set(xlim=(across[0], across[-1]), ylim=(up[0], up[-1]))
    if curvature:
        rows = [[_room(length, t, curvature) for length in lengths.tolist()] for t in rods.tolist()]
        room = np.array(rows)
        if (room > 0).any():
            axes.contour(lengths, rods, room, levels=[0.0], colors="black", linestyles="dashed")


def _room(length: float, rod: float, curvature: float) -> float:
    drum = length / curvature
    if length < 2 or length >= 2 * (drum - 1):
        return math.nan
    return crossing_clearance(DumbbellPair(length, 1.0, rod, drum))


def _edges(values: Array) -> Array:
    """Return boundaries of cells around values, halfway between them in logarithms."""
    logs = np.log(values)
    middles = (logs[1:] + logs[:-1]) / 2
    step = np.diff(logs) if len(logs) > 1 else np.array([0.5])
    ends = logs[0] - step[0] / 2, logs[-1] + step[-1] / 2
    return np.asarray(np.exp(np.concatenate([ends[:1], middles, ends[1:]])))


def _marks(found: MinimaMap) -> dict[str, str]:
    others = [kind for kind in found.kinds if kind != "G" and kind not in NESTED]
    return dict(zip(others, MARKS, strict=False))


def _handles(found: MinimaMap) -> list[Patch | Line2D]:
    handles: list[Patch | Line2D] = [
        Patch(facecolor=NONE, edgecolor="0.6", label="none nested"),
        *[Patch(facecolor=colour, label=kind) for kind, colour in NESTED.items()],
        Patch(facecolor=UNSEEN, label="does not fit"),
        Line2D([], [], color="black", label="long rods"),
        Line2D([], [], color="black", linestyle="dashed", label="level crossing fits"),
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

"""Figures of sphere clusters: balls joined by bars where they touch, and motions between them."""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.path import Path
from numpy.typing import ArrayLike

from polycorner.checks import instance, reals, refuse
from polycorner.kinds import checked
from polycorner.models.spheres import SphereCluster
from polycorner.pictures.arguments import sampled
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

BALL, SINGULAR_BALL = "#56B4E9", "#E69F00"  # Okabe and Ito
BAR, OPENING, CLOSING = "0.25", "#D55E00", "#009E73"
RADIUS = 0.3  # of a drawn ball, in diameters of a sphere: small enough to show the contacts
THICKNESS = 0.09  # of a bar
RINGS = (24, 12)  # circles that shade a ball, if there are few pictures and if there are many
LIGHT = np.array([-0.3, 0.35])  # the brightest point of a ball, in radii from its middle
FOG, HAZE = 0.45, 1.5  # largest fading of a ball, and the depth at which it is reached
TILTS = np.radians(np.arange(-40, 41, 5))  # rotations tried after the principal axes
CELL = (1.9, 1.5)  # width of a picture in inches, for few and for many
FEW = 12

Pair = tuple[int, int]
Layer = tuple[float, Path, Array]


@checked
def draw_clusters(
    model: SphereCluster,
    points: ArrayLike,
    *,
    labels: Sequence[str] | None = None,
    singular: Collection[int] = (),
) -> Figure:
    """Draw clusters side by side, each rotated so that few spheres hide others.

    Spheres are drawn smaller than they are and joined by a bar where they touch; far ones are
    paler.  All clusters have the same scale.  A caption gives the label and the order of the
    symmetry group, the number of relabellings that preserve all distances.

    Parameters
    ----------
    model : SphereCluster
        The number of spheres.
    points : (k, 3 n) array
        Clusters, in diameters; a single one may be ``(3 n,)``.
    labels : sequence of str, optional
        Their names; default ``C0 C1 ...`` as in a skeleton.
    singular : collection of int, optional
        Positions of singular clusters, drawn in another colour with a remark.

    Raises
    ------
    TypeError, ValueError
        For a model, points, labels or positions of another form.
    """
    clusters = _clusters(model, "points", points)
    names = _names(labels, len(clusters))
    special = _positions(singular, len(clusters))
    shapes = [_turned(q.reshape(1, -1, 3))[0] for q in clusters]
    figure, grid = _grid(len(clusters), shapes, lines=2 if special else 1)
    for k, (axes, q, shape) in enumerate(zip(grid, clusters, shapes, strict=True)):
        bars = dict.fromkeys(_touching(model, q), BAR)
        colour = SINGULAR_BALL if k in special else BALL
        _draw(axes, shape, bars, colour, RINGS[len(clusters) > FEW])
        order = len(model.symmetry.relabellings(model.manifold, q, q, DEFAULT.same))
        remark = "\nsingular" if k in special else ""
        axes.set_title(f"{names[k]}  order {order}{remark}", fontsize=9, pad=2)
    kinds = f"{len(clusters)} clusters" if len(clusters) > 1 else "A cluster"
    title = f"{kinds} of {model.count} spheres, with the order of the symmetry group"
    figure.suptitle(title, fontsize=10)
    return figure


def cluster_strip(model: SphereCluster, polyline: ArrayLike, frames: int) -> Figure:
    """Draw frames of a motion of a cluster; see :func:`draw_motion`."""
    line = _clusters(model, "polyline", polyline)
    if len(line) < 2:
        refuse("polyline", "at least two points", len(line))
    held = set.intersection(*(set(_touching(model, q)) for q in line))
    rows = [model.pairs.index(pair) for pair in sorted(held)]
    places, moments = sampled(model.polyhedron, line, rows, frames)
    opening, closing = (sorted(set(_touching(model, q)) - held) for q in (line[0], line[-1]))
    events = {0: (opening, OPENING, "opening"), frames - 1: (closing, CLOSING, "closing")}
    shown = [(k, pair) for k, (changed, *_) in events.items() for pair in changed]
    shapes = _turned(places.reshape(frames, -1, 3), shown)
    figure, grid = _grid(frames, list(shapes), lines=2, columns=frames)
    for k, (axes, shape) in enumerate(zip(grid, shapes, strict=True)):
        changed, colour, verb = events.get(k, ([], BAR, ""))
        bars = dict.fromkeys(sorted(held), BAR) | dict.fromkeys(changed, colour)
        _draw(axes, shape, bars, BALL, RINGS[frames > FEW])
        remark = f"{verb} {_named(changed)}" if changed else ""
        axes.set_title(f"{moments[k]:.2f}\n{remark}", fontsize=9, pad=2)
    figure.suptitle("A motion by arc length, in diameters", fontsize=10)
    return figure


# ------------------------------------------------------------------------------------------ shapes


def _touching(model: SphereCluster, q: Array) -> list[Pair]:
    i, j = np.nonzero(np.triu(model.contacts(q, tolerance=DEFAULT.same)))
    return list(zip(i.tolist(), j.tolist(), strict=True))


def _named(pairs: Sequence[Pair]) -> str:
    """Return the names of up to three contacts, or their number."""
    if len(pairs) > 3:
        return f"{len(pairs)} contacts"
    return ", ".join(f"{i + 1}-{j + 1}" for i, j in pairs)


def _turned(shapes: Array, shown: Iterable[tuple[int, Pair]] = ()) -> Array:
    """Return clusters ``(k, n, 3)`` under one rotation: across, upwards, and towards the eye.

    The principal axes of all centres come first, the longest across.  Among some further rotations
    we take the one that maximises the least distance between two centres on the page; the middle
    of a bar that must be visible in some picture counts as a centre there.
    """
    centred = shapes - shapes.mean(axis=1, keepdims=True)
    _, _, axes = np.linalg.svd(centred.reshape(-1, 3), full_matrices=False)
    # The sign of each axis follows from the shape, so that rotated copies are drawn alike.
    skewness = ((centred.reshape(-1, 3) @ axes[:2].T) ** 3).sum(axis=0)
    long, middle = np.where(skewness < 0, -1, 1)[:, None] * axes[:2]
    principal = centred @ np.array([long, middle, np.cross(long, middle)]).T
    i, j = np.triu_indices(principal.shape[1], 1)
    apart = [(principal[:, i] - principal[:, j]).reshape(-1, 3)]
    apart += [principal[k] - principal[k, pair].mean(axis=0) for k, pair in shown]
    turns = np.array([_turn(a, b) for a in TILTS for b in TILTS])
    page = np.concatenate(apart) @ turns[:, :2].transpose(0, 2, 1)
    clear = (page**2).sum(axis=-1).min(axis=-1)
    # The first of several that are equal up to rounding.
    best = turns[np.flatnonzero(clear > clear.max() - 1e-9)[0]]
    found = principal @ best.T
    return np.asarray(found - (found.min(axis=(0, 1)) + found.max(axis=(0, 1))) / 2)


def _turn(a: float, b: float) -> Array:
    """Return the rotation by ``b`` about the upward axis, then ``a`` about the one across."""
    up = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    across = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    return np.asarray(across @ up)


# ----------------------------------------------------------------------------------------- drawing


def _grid(
    count: int, shapes: Sequence[Array], *, lines: int, columns: int | None = None
) -> tuple[Figure, list[Axes]]:
    """Return axes in rows, all of the same scale."""
    columns = columns or _columns(count)
    rows = math.ceil(count / columns)
    reach = np.max([abs(shape[:, :2]).max(axis=0) for shape in shapes], axis=0) + 1.1 * RADIUS
    width = CELL[0] if count <= FEW else CELL[1]
    height = width * reach[1] / reach[0] + 0.16 * lines + 0.1
    figure = Figure(figsize=(max(width * columns, 5.0), height * rows + 0.4), layout="constrained")
    grid: list[Axes] = []
    for k in range(count):
        axes = figure.add_subplot(rows, columns, k + 1)
        axes.set(xlim=(-reach[0], reach[0]), ylim=(-reach[1], reach[1]))
        axes.set_aspect("equal")
        axes.set_axis_off()
        grid.append(axes)
    return figure, grid


def _columns(count: int) -> int:
    """Return a number of columns, at least that of rows, that leaves few cells empty."""
    if count <= 4:
        return count
    wide = range(math.ceil(math.sqrt(1.2 * count)), math.floor(math.sqrt(2.2 * count)) + 1)
    return min(wide, key=lambda columns: -count % columns)


def _draw(axes: Axes, shape: Array, bars: dict[Pair, str], colour: str, rings: int) -> None:
    """Draw a cluster from far to near."""
    layers: list[Layer] = []
    near = float(shape[:, 2].max())
    for centre in shape:
        layers += _ball(centre, _faded(colour, near - centre[2]), rings)
    for (i, j), shade in bars.items():
        depth = near - (shape[i, 2] + shape[j, 2]) / 2
        layers += _bar(shape[i], shape[j], _faded(shade, depth))
    layers.sort(key=lambda layer: layer[0])
    shades = np.array([shade for *_, shade in layers])
    pieces = PathCollection([path for _, path, _ in layers], facecolors=shades, linewidths=0)
    axes.add_collection(pieces, autolim=False)


def _ball(centre: Array, colour: Array, rings: int) -> Iterator[Layer]:
    """Yield the circles of a ball, dark and large to bright and small."""
    for t in np.linspace(0, 1, rings, endpoint=False):
        middle = centre[:2] + t * RADIUS * LIGHT
        dark = colour * (0.45 + 0.55 * math.sqrt(min(1.0, 1.6 * t)))
        shade = dark + (1 - dark) * 0.85 * t**3
        yield float(centre[2]), Path.circle(tuple(middle), RADIUS * (1 - t)), shade


def _bar(one: Array, other: Array, colour: Array) -> Iterator[Layer]:
    """Yield the halves of a bar between two balls, none if the bar is seen end on."""
    along = (other - one) / np.linalg.norm(other - one)
    seen = math.hypot(along[0], along[1])
    if seen < 1e-6:
        return
    side = THICKNESS / 2 / seen * np.array([-along[1], along[0]])
    start, end = one + 0.9 * RADIUS * along, other - 0.9 * RADIUS * along
    middle = (start + end) / 2
    over = 0.02 * along
    for a, b in ((start, middle + over), (middle - over, end)):
        for share, lit in ((1.0, 0.0), (0.45, 0.45)):
            s = share * side
            outline = [a[:2] + s, b[:2] + s, b[:2] - s, a[:2] - s]
            yield float(a[2] + b[2]) / 2, Path(outline), colour + lit * (1 - colour)


def _faded(colour: str, depth: float) -> Array:
    rgb = np.array(to_rgb(colour))
    return np.asarray(rgb + FOG * min(1.0, depth / HAZE) * (1 - rgb))


# --------------------------------------------------------------------------------------- arguments


def _clusters(model: Any, argument: str, given: ArrayLike) -> Array:
    instance("model", model, SphereCluster)
    points = np.atleast_2d(finite(reals(argument, given), argument))
    if points.ndim != 2 or points.shape[1] != 3 * model.count or not len(points):
        refuse(argument, f"points of shape (k, {3 * model.count}) with k >= 1", points.shape)
    return points


def _names(labels: Sequence[str] | None, count: int) -> list[str]:
    names = [f"C{k}" for k in range(count)] if labels is None else list(labels)
    if len(names) != count:
        refuse("labels", f"one for each of {count} clusters", names)
    return names


def _positions(singular: Collection[int], count: int) -> set[int]:
    positions = set(singular)
    if not positions <= set(range(count)):
        refuse("singular", f"positions from 0 to {count - 1}", sorted(positions))
    return positions

"""The solid of overlapping pairs with corners, edges and motions of its complement.

Each kind of motion has one colour in the strips of pairs and on the solid.
"""

import math
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D

from paper_checks.figures import style
from paper_checks.figures.figure import Figure
from paper_checks.figures.pairs import LETTERS, PAIR, atlas
from polycorner.dumbbells.pictures.placements import forbidden_solid
from polycorner.dumbbells.pictures.solid import relative_corners, relative_curves
from polycorner.pictures import SharpSurface, View, place_solid
from polycorner.skeletons import traced

RESOLUTION = 112  # cells of the solid along each side
REACH = (0.0, 0.45, 0.9)  # distances from the corner of the instants shown, in scales
FADED = (1.0, 0.55, 0.3)  # opacity of these instants
VIEW = View(height=1.05)
# The rod on which a ball lies distinguishes the two motions with one ball-ball contact.
COLOURS = {
    "slide": ("#1A1A1A", "two balls slide on the rods"),
    "first": ("#D55E00", "two balls touch, that of B on the rod of A"),
    "second": ("#E69F00", "two balls touch, that of A on the rod of B"),
    "twice": ("#A0457E", "ball rolls on ball, twice"),
}


def motion(contacts: tuple[str, ...]) -> str:
    """Return the kind of motion that keeps the contacts: a key of ``COLOURS``."""
    rods = [name for name in contacts if len(name) == 3]
    if len(rods) != 1:
        return "slide" if rods else "twice"
    return "first" if rods[0].startswith("a") else "second"


@cache
def solid() -> SharpSurface:
    """Return the overlapping relative placements over half a turn of the relative heading."""
    return forbidden_solid(PAIR, RESOLUTION, period=math.pi)


def out_of(kind: str) -> list[tuple[str, Any]]:
    """Return the motions out of a corner of a kind, ``Delta_R`` or ``E_R``: name and ``(k, 6)``."""
    skeleton = atlas().skeleton
    start = min(k for k, corner in enumerate(skeleton.corners) if atlas().kind(corner) == kind)
    ways = []
    for edge in skeleton.edges:
        if start in edge.ends:
            line = traced(skeleton, edge)
            ways.append((motion(edge.active), line if edge.ends[0] == start else line[::-1]))
    return sorted(ways, key=lambda way: list(COLOURS).index(way[0]))


def instants(way: Any) -> Any:
    """Return the corner and two later instants of a motion, ``(3, 6)``."""
    steps = np.linalg.norm(np.diff(way, axis=0) / PAIR.manifold.scale_array, axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    return np.stack([np.interp(REACH, travelled, x) for x in way.T], axis=-1)


@style.styled()
def draw_solid() -> Drawing:
    """Draw the motions out of two corners, and the solid with all of them."""
    figure = style.canvas(style.WIDE, 7.3)
    *rows, below = style.parts(figure, 3, 1, height_ratios=[1, 1, 2.5])
    for part, letter, kind in zip(rows, "ab", ("Delta_R", "E_R"), strict=True):
        symbol, hand = kind.split("_")
        words = rf"$\bf({letter})$ motions out of ${LETTERS[symbol]}_{hand}$"
        part.suptitle(words, x=0.01, ha="left")
        panels, ways = part.subplots(1, 5), out_of(kind)
        _draw_pair(panels[0], ways[0][1][:1], None)
        for panel, (name, way) in zip(panels[1:], ways, strict=False):
            _draw_pair(panel, instants(way), COLOURS[name][0])
        for panel in panels[1 + len(ways) :]:
            panel.set_axis_off()
    below.suptitle(r"$\bf(c)$ the solid of overlapping pairs", x=0.01, ha="left")
    place = (0.2, 0.03, 0.8, 0.99)
    axes: Any = below.add_axes(place, projection="3d", computed_zorder=False)
    palette = {name: colour for name, (colour, _) in COLOURS.items()}
    curves = relative_curves(atlas(), math.pi, motion)
    points, names = relative_corners(atlas(), math.pi, hands=True)
    mesh, caps = solid().mesh, solid().caps
    marks = list(zip(names, points, strict=True))
    place_solid(axes, mesh, curves, marks, palette=palette, caps=caps, view=VIEW)
    lines = [Line2D([], [], color=c, lw=2, label=words) for c, words in COLOURS.values()]
    below.legend(handles=lines, loc="upper left", bbox_to_anchor=(0.0, 0.93), borderaxespad=0)
    return figure


def _draw_pair(axes: Axes, qs: Any, colour: str | None) -> None:
    """Draw A in grey, at rest, and B at several instants, later ones paler."""
    radii = (PAIR.ball_radius, PAIR.rod_radius)
    for k, q in reversed(list(enumerate(qs))):
        centres = _facing(q)
        pale = 1 - FADED[k] * (1 - np.array(to_rgb(colour or style.NEITHER[0])))
        style.draw_dumbbell(axes, centres[2:], radii, to_hex(pale.tolist()), zorder=3 - 0.5 * k)
    style.draw_dumbbell(axes, centres[:2], radii, style.NEITHER[1], zorder=3.5)
    style.bare(axes)
    axes.set(xlim=(-16, 16), ylim=(-12, 24))


def _facing(q: Any) -> Any:
    """Return the centres of a pair with A upright about the origin."""
    centres = PAIR.developed(q)
    centres = centres - centres[:2].mean(axis=0)
    x, y = (centres[1] - centres[0]) / PAIR.length
    return centres @ np.array([[y, x], [-x, y]])


def _caption() -> str:
    found, surface = atlas().skeleton, solid()
    first, second = (len(out_of(kind)) for kind in ("Delta_R", "E_R"))
    _, names = relative_corners(atlas(), math.pi, hands=True)
    return (
        f"Pairs of dumbbells, {style.sizes(PAIR)}, in the developed plane. (a), (b) A "
        f"right-handed corner with three contacts and one with four: {first} and {second} motions "
        "leave them that keep two contacts; dumbbell A (grey) stands still, B is drawn at the "
        "corner and, paler, at two later instants. (c) Relative placements of B as seen from A, "
        "(x, y) in mm and relative heading, over half a turn because the balls of a dumbbell are "
        f"alike: inside the solid, of volume {surface.curved_volume:.0f} mm² rad, the dumbbells "
        f"overlap; outside is the polyhedron. On the surface, its {len(names)} corners and the "
        "motions that join them, in the colours of (a) and (b); thin and dashed is what the solid "
        "hides. "
        f"With all balls labelled there are {len(found.corners)} corners, {len(found.edges)} "
        f"edges and {len(found.faces)} faces."
    )


def _alt() -> str:
    first, second = (len(out_of(kind)) for kind in ("Delta_R", "E_R"))
    return (
        f"Two rows of pairs show {first} motions out of the corner with three contacts and "
        f"{second} out of that with four: sliding along the rods, swinging round with a ball in "
        "the notch between ball and rod of the other, in two ways, and, from the second only, "
        "rolling ball on ball at both ends. Below, a grey column that is twisted along the "
        "vertical axis of relative heading. Around its waist, at relative heading zero, run four "
        "corners in front and four behind, in the order Delta R, E R, E L, Delta L, joined by "
        "short curves; from every corner two long curves run up and down along the inverted "
        "edges of the column."
    )


FIGURES = (Figure("solid", "The solid of overlapping pairs", _caption, _alt, draw_solid),)

"""Edges of a pair's skeleton as strips of frames, and small pictures of two dumbbells."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from polycorner.dumbbells.pictures.bodies import contact_point
from polycorner.dumbbells.pictures.relabelling import (
    EdgeClass,
    draw_flat_pair,
    facing,
    headline,
    relabelling_classes,
)
from polycorner.dumbbells.pictures.symbols import CONTACT, HANDS, corner_symbol
from polycorner.dumbbells.statics.relative import MARGIN, RelativePlacements
from polycorner.dumbbells.statics.skeleton import PairAtlas
from polycorner.toolkit import Array, checked, projected

FRAMES = 5
TOUCH = 1e-6  # ball radii within which a contact of a frame counts as closed


@checked
def draw_motions(atlas: PairAtlas) -> Figure:
    """Draw every edge of the pair's skeleton, up to relabelling, as a strip of frames.

    In the plane dumbbell A is fixed and B moves around it; in the drum the pair is developed, with
    the axis of the drum upright.  Every frame is projected on its edge.
    """
    nodes, motions = relabelling_classes(atlas)
    pair, count, margin = atlas.pair, max(len(motions), 1), 1.04 * atlas.pair.ball_radius
    figure = Figure(figsize=(11, 0.6 + 2.3 * count), layout="constrained")
    figure.suptitle(headline(atlas))
    for row, motion in zip(figure.subplots(count, FRAMES, squeeze=False), motions, strict=False):
        frames = _frames(atlas, motion)
        shown = np.array([facing(pair, q, whole=not pair.is_plane) for q in frames])
        low, high = shown.min(axis=(0, 1)), shown.max(axis=(0, 1))
        for axes, q, centres in zip(row, frames, shown, strict=True):
            gaps = dict(zip(pair.polyhedron.names, pair.polyhedron.values(q), strict=True))
            closed = [name for name in gaps if abs(gaps[name]) < TOUCH * pair.ball_radius]
            draw_flat_pair(axes, pair, centres, closed)
            (left, bottom), (right, top) = low - margin, high + margin
            axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
            axes.set_axis_off()
        for axes, end in zip((row[0], row[-1]), motion.ends, strict=True):
            if end >= 0:
                colour = HANDS[nodes[end].hand]
                axes.set_title(corner_symbol(nodes[end].kind), fontsize=15, color=colour)
        row[FRAMES // 2].set_title(f"{motion.contacts}:  {motion.names}", fontsize=10)
    return figure


def _frames(atlas: PairAtlas, motion: EdgeClass) -> list[Array]:
    """Return points of an edge at equal distances along it, both ends included."""
    polyhedron, way = atlas.skeleton.polyhedron, motion.polyline
    scales = polyhedron.manifold.scale_array
    steps = np.linalg.norm(np.diff(way, axis=0) / scales, axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0.0, travelled[-1], FRAMES)
    chords = np.stack([np.interp(at, travelled, x) for x in way.T], axis=-1)
    quotient = atlas.skeleton.edges[0].quotient
    held = [polyhedron.names.index(name) for name in motion.active]
    settled = [projected(quotient, q, quotient.at(q).basis(held), 1.0) for q in chords[1:-1]]
    inner = [q if s is None else s.q for q, s in zip(chords[1:-1], settled, strict=True)]
    return [way[0], *inner, way[-1]]


# --------------------------------------------------------- small pictures for figures of landscapes


@checked
def draw_relative(model: RelativePlacements) -> Callable[[Axes, Array], None]:
    """Return what draws a relative placement into axes, with the axis of the drum upright.

    As :func:`~polycorner.pictures.draw_landscape` and :func:`~polycorner.pictures.film_route` take
    it: all pictures have one scale.

    Parameters
    ----------
    model : RelativePlacements
    """
    pair = model.pair
    reach = MARGIN * (pair.length + 2 * pair.ball_radius)

    def draw(axes: Axes, point: Array) -> None:
        gaps = dict(zip(model.polyhedron.names, model.polyhedron.values(point), strict=True))
        closed = [
            name
            for name in pair.polyhedron.names
            if name in gaps and abs(gaps[name]) < TOUCH * pair.ball_radius
        ]
        centres = pair.developed(model.placement(point))
        centres -= centres.mean(axis=0)
        draw_flat_pair(axes, pair, centres, ())
        for name in closed:
            x, y = contact_point(pair, centres, name)
            axes.add_patch(
                Circle((x, y), pair.ball_radius / 3, fc=CONTACT, ec="black", lw=0.4, zorder=6)
            )
        across = abs(centres[:, 0]).max() + MARGIN * pair.ball_radius
        axes.set(xlim=(-across, across), ylim=(-reach, reach), aspect="equal")

    return draw

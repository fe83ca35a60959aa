"""Small pictures of two dumbbells, for figures of landscapes."""

from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.patches import Circle

from polycorner.dumbbells.pictures.bodies import contact_point
from polycorner.dumbbells.pictures.motion_strips import TOUCH
from polycorner.dumbbells.pictures.relabelling import draw_flat_pair
from polycorner.dumbbells.pictures.symbols import CONTACT
from polycorner.dumbbells.statics.relative import MARGIN, RelativePlacements
from polycorner.toolkit import Array, checked


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

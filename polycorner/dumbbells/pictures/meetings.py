"""A figure of the collisions of two dumbbells, by where they end."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy.spatial import KDTree

from polycorner.dumbbells.pair import DumbbellPair
from polycorner.dumbbells.pictures.relabelling import draw_flat_pair
from polycorner.dumbbells.pictures.symbols import HANDS, sizes_in_words
from polycorner.landscapes import Basins
from polycorner.toolkit import SHADES, Array, checked, refuse

KNOWN = {"G": ("$G$", "0.85"), "delta_R": ("$\\delta_R$", HANDS["R"])}
KNOWN["delta_L"] = ("$\\delta_L$", HANDS["L"])
PANELS = 3  # collisions that are shown beside the map, at most


@checked
def draw_meetings(pair: DumbbellPair, found: Basins) -> Figure:
    """Draw where collisions end, over the axial offset and the heading of the second dumbbell.

    Where it is black they end in no minimum.  Beside the map is, of each kind, a collision far from
    those of other kinds, in the developed plane with the drum's axis upright.

    Parameters
    ----------
    pair : DumbbellPair
    found : Basins
        Of :func:`~polycorner.dumbbells.meeting_basins`, for offsets and headings on a grid.
    """
    if not found.descents:
        refuse("found", "at least one collision", found)
    figure = Figure(figsize=(10, 6.2), layout="constrained")
    kinds = sorted((k for k, n in enumerate(found.counts) if n), key=lambda k: -found.counts[k])
    styles = {k: _style(found.names[k], k) for k in kinds}
    grid = figure.add_gridspec(PANELS, 2, width_ratios=(3, 1))
    axes = figure.add_subplot(grid[:, 0])
    _draw_map(axes, found, {k: colour for k, (_, colour) in styles.items()})
    handles = [
        Patch(color=colour, label=f"{word}: {found.shares[k]:.1%}")
        for k, (word, colour) in styles.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(kinds), frameon=False)
    reach = pair.length + 3 * pair.ball_radius
    for row, k in enumerate(kinds[:PANELS]):
        q = found.points[_deepest(found, k)]
        axes.text(q[4], np.degrees(q[5]), f"{row + 1}", ha="center", va="center", weight="bold")
        side = figure.add_subplot(grid[row, 1])
        balls = pair.developed(q)
        draw_flat_pair(side, pair, balls - balls.mean(axis=0), ())
        side.set(aspect="equal", title=f"{row + 1}: to {styles[k][0]}")
        side.set(xlim=(-0.7 * reach, 0.7 * reach), ylim=(-reach, reach))
        side.set_axis_off()
    figure.suptitle(f"Collisions by where they end, {sizes_in_words(pair)}")
    return figure


def _style(name: str, k: int) -> tuple[str, str]:
    return KNOWN.get(name, (name, SHADES[k % len(SHADES)]))


def _draw_map(axes: Axes, found: Basins, colours: dict[int, str]) -> None:
    offsets, column = np.unique(found.points[:, 4], return_inverse=True)
    headings, row = np.unique(np.degrees(found.points[:, 5]), return_inverse=True)
    image = np.ones((len(headings), len(offsets), 3))
    image[row, column] = [to_rgb(colours.get(k, "black")) for k in found.ends.tolist()]
    axes.pcolormesh(_edges(offsets), _edges(headings), image)
    axes.set(xlabel="axial offset (mm)", ylabel="heading of the second dumbbell (°)")


def _edges(middles: Array) -> Array:
    """Return the boundaries of cells around values, halfway between them."""
    if len(middles) == 1:
        return np.asarray(middles + np.array([-0.5, 0.5]))
    between = (middles[1:] + middles[:-1]) / 2
    ends = 2 * middles[[0, -1]] - between[[0, -1]]
    return np.concatenate([ends[:1], between, ends[1:]])


def _deepest(found: Basins, k: int) -> int:
    """Return the number of the collision of a kind that is farthest from others and from the rim.

    On the rim are, at each heading, the outermost offsets.
    """
    headings, row = np.unique(found.points[:, 5], return_inverse=True)
    far = np.zeros(len(headings))
    np.maximum.at(far, row, abs(found.points[:, 4]))
    places = found.points[:, 4:6] / np.maximum(np.ptp(found.points[:, 4:6], axis=0), 1.0)
    others = places[(found.ends != k) | (abs(found.points[:, 4]) == far[row])]
    same = np.flatnonzero(found.ends == k)
    return int(same[np.argmax(KDTree(others).query(places[same])[0])])

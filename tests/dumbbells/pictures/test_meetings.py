"""The figure of collisions shows where they end."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from polycorner.dumbbells import DumbbellPair, meeting_basins
from polycorner.dumbbells.pictures import draw_meetings
from polycorner.dumbbells.pictures.wells import KNOWN, _deepest
from polycorner.pictures import save

PAIR = DumbbellPair(16, 3, 1.5, 125)
OFFSETS, HEADINGS = np.linspace(-21, 21, 8), np.radians(np.linspace(-60, 60, 5))


@pytest.fixture(scope="module")
def found():
    grid = np.meshgrid(OFFSETS, HEADINGS)
    return meeting_basins(PAIR, np.stack([x.ravel() for x in grid], axis=1))


def test_cells_have_the_colours_of_their_ends(found, tmp_path):
    figure = draw_meetings(PAIR, found)
    (mesh,) = figure.axes[0].collections
    colours = mesh.get_array()
    assert colours.shape == (5, 8, 3)
    for q, k in zip(found.points, found.ends, strict=True):
        i, j = abs(HEADINGS - q[5]).argmin(), abs(OFFSETS - q[4]).argmin()
        assert colours[i, j].tolist() == list(to_rgb(KNOWN[found.names[k]][1]))
    assert save(figure, tmp_path / "meetings.png").stat().st_size > 0


def test_the_legend_has_the_shares_and_examples_lie_deep_in_their_basins(found):
    figure = draw_meetings(PAIR, found)
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    for name, share in zip(found.names, found.shares, strict=True):
        assert f"{KNOWN[name][0]}: {share:.1%}" in words
    for k in range(len(found.names)):
        chosen = _deepest(found, k)
        assert found.ends[chosen] == k
        places = found.points[:, 4:6] / np.ptp(found.points[:, 4:6], axis=0)
        apart = np.linalg.norm(places[:, None] - places, axis=-1)
        rows = [found.points[:, 5] == heading for heading in found.points[:, 5]]
        outermost = [abs(found.points[row, 4]).max() for row in rows]
        others = (found.ends != k) | (abs(found.points[:, 4]) == outermost)
        margins = apart[:, others].min(axis=1)
        assert margins[chosen] == pytest.approx(margins[found.ends == k].max())

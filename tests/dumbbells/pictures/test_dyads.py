"""Pictures show what they are said to show."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from polycorner.dumbbells import DumbbellPair, dyad_minima
from polycorner.dumbbells.pictures.dyads import draw_heading, draw_pair
from polycorner.pictures.style import save


@pytest.mark.parametrize("drum", [125.0, np.inf])
def test_pair_labels_every_contact_with_its_multiplier(drum, tmp_path):
    entry = dyad_minima(DumbbellPair(16, 3, 1.5, drum))[0]
    figure = draw_pair(entry)
    texts = [text.get_text() for text in figure.axes[-1].texts]
    for contact, value in entry.multipliers.items():
        assert f"{contact}:  {value:.4g}" in texts
    assert save(figure, tmp_path / "pair.png").stat().st_size > 10_000


def test_contacts_are_drawn_where_the_bodies_touch():
    """In the plane the drawn point lies on both surfaces."""
    entry = dyad_minima(DumbbellPair(16, 3, 1.5))[0]
    axes = draw_pair(entry).axes[-1]
    centres = entry.pair.developed(entry.point)
    centres = centres - centres.mean(axis=0)
    points = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "o"]
    assert len(points) == 3
    for point in points:
        away = np.abs(np.linalg.norm(centres - point, axis=1) - 3.0)
        assert away.min() < 1e-9


def test_heading_figure_has_the_papers_curve_and_both_chiralities():
    lengths = [14.0, 16.0, 18.0]
    axes = draw_heading(DumbbellPair(16, 3, 1.5, 125), lengths, [1.0, 1.5]).axes[0]
    dashed = [line.get_ydata() for line in axes.lines if line.get_linestyle() == "--"]
    np.testing.assert_allclose(dashed[0], np.degrees(np.arctan(3 / np.array(lengths))))
    np.testing.assert_allclose(dashed[1], -dashed[0])
    full = [line.get_ydata() for line in axes.lines if line.get_linestyle() == "-"]
    curves = [y for y in full if len(y) == 3]
    assert len(curves) == 4
    np.testing.assert_allclose(curves[0], -curves[1], atol=1e-9)


def test_curves_of_headings_have_no_gaps():
    """Full and dotted parts share the samples at which they meet."""
    pair = DumbbellPair(16, 3, 1.5, 125)
    lengths = np.linspace(7, 12, 9)
    axes = draw_heading(pair, lengths.tolist(), [1.5]).axes[0]
    parts = {style: [] for style in ("-", ":")}
    for line in axes.lines:
        if len(line.get_xdata()) == len(lengths) and line.get_linestyle() in parts:
            parts[line.get_linestyle()].append(np.isfinite(line.get_ydata()))
    for full, dotted in zip(parts["-"], parts[":"], strict=True):
        assert full.any()
        assert dotted.any()
        # Every chord between neighbouring samples belongs to one part or the other.
        assert ((full[1:] & full[:-1]) | (dotted[1:] & dotted[:-1])).all()


@pytest.mark.parametrize("sizes", [(16, 3, 1.5), (8, 3, 1.5), (40, 3, 2.0)])
def test_labels_of_contacts_stay_inside_the_frame(sizes):
    figure = draw_pair(dyad_minima(DumbbellPair(*sizes, 125))[0])
    FigureCanvasAgg(figure).draw()
    axes = figure.axes[-1]
    frame = axes.get_window_extent()
    labels = [text for text in axes.texts if ":" in text.get_text()]
    assert labels
    for text in labels:
        box = text.get_window_extent()
        assert frame.x0 + 5 < box.x0
        assert box.x1 < frame.x1 - 5


@pytest.mark.parametrize(("drum", "unit"), [(125.0, "(mm/mm)"), (np.inf, "(mm)")])
def test_multipliers_have_a_unit(drum, unit):
    axes = draw_pair(dyad_minima(DumbbellPair(16, 3, 1.5, drum))[0]).axes[-1]
    assert axes.get_title().endswith(unit)

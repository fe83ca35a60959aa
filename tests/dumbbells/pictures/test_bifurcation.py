"""The figures show the branches, and where they end."""

import math

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.bifurcation import draw_bifurcation, draw_critical
from polycorner.dumbbells.statics.critical import critical_rod_radius, escape_barrier
from polycorner.pictures.style import save

PAIR = DumbbellPair(16, 3, 1.5, 125)


def drawn(axes, style):
    """Points of the curves in a style, without the parts that are left out."""
    curves = [line.get_xydata() for line in axes.lines if line.get_linestyle() == style]
    kept = [points[np.isfinite(points).all(axis=1)] for points in curves if len(points) > 2]
    return np.concatenate([np.empty((0, 2)), *kept])


@pytest.mark.parametrize("pair", [PAIR, DumbbellPair(16, 3, 1.5)])
def test_branches_change_their_style_at_the_critical_thickness(pair, tmp_path):
    figure = draw_bifurcation(pair)
    critical = critical_rod_radius(pair)
    for axes in figure.axes:
        rest, saddle, unheld = (drawn(axes, style) for style in ("-", "--", ":"))
        assert rest[:, 0].max() < critical < unheld[:, 0].min()
        assert saddle[:, 0].max() < critical
        np.testing.assert_allclose(rest[-1], saddle[-1], atol=1e-5)
    np.testing.assert_allclose(drawn(figure.axes[1], "-")[:, 1], 0, atol=1e-12)
    assert f"{critical:.4f} mm" in figure.get_suptitle()
    assert save(figure, tmp_path / "bifurcation.png").stat().st_size > 10_000


def test_the_barrier_is_written_beside_its_arrow():
    axes = draw_bifurcation(PAIR).axes[2]
    rods = drawn(axes, "-")[:, 0]
    (text,) = [note for note in axes.texts if note.get_text().startswith("barrier")]
    place = text.xy[0]
    assert np.abs(rods - place).min() < 1e-12
    barrier = escape_barrier(DumbbellPair(16, 3, float(place), 125))
    assert text.get_text() == f"barrier {barrier:.3g} mm"


def test_a_range_without_a_critical_radius_has_no_dotted_line():
    figure = draw_bifurcation(PAIR, rods=(1.0, 2.0))
    assert "critical" not in figure.get_suptitle()
    assert len(drawn(figure.axes[0], "--"))
    assert not len(drawn(figure.axes[0], ":"))


def test_markers_of_every_drum_lie_on_the_closed_form():
    axes = draw_critical(3.0, [math.inf, 30.0], longest=6.0, pairs=[PAIR]).axes[0]
    for marker in "o^":
        (line,) = [line for line in axes.lines if line.get_marker() == marker]
        length, share = line.get_xydata().T
        assert np.isfinite(share).all()
        np.testing.assert_allclose(share, 2 * np.sqrt(1 - 1 / length**2) - 1, atol=1e-9)
    (star,) = [line for line in axes.lines if line.get_marker() == "*"]
    np.testing.assert_allclose(star.get_xydata(), [[16 / 3, 0.5]])
    assert [text.get_text() for text in axes.get_legend().get_texts()][1:] == [
        "plane",
        "drum, R = 10 r",
    ]

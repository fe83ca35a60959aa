"""The map of proportions marks every skeleton, every change, and hides neither."""

from dataclasses import replace

import numpy as np
from matplotlib.colors import same_color

from polycorner.dumbbells.pictures.minima_map import draw_pair_map
from polycorner.dumbbells.statics.skeleton_map import PairMap, Pattern, Signature
from polycorner.pictures.style import save


def signature(kinds, labelled, ordered, counts, *, sound=True):
    return Signature(labelled, ordered, Pattern(counts, tuple((k, 1) for k in kinds), ()), sound)


BELOW = signature(["C300_L", "C300_R"], (8, 12, 4), (2, 3, 1), (2, 2, 1))
ABOVE = signature(["Delta_R", "E_R"], (16, 28, 12), (4, 7, 3), (4, 5, 2))
BETWEEN = signature(["C320_L"], (9, 9, 9), (7, 7, 7), (6, 6, 6))


def made(**changes):
    """Return a map made up by hand."""
    whole = PairMap(
        lengths=np.array([2.0, 3.0, 4.0]),
        rods=np.array([0.2, 0.6]),
        table=np.array([[0, 0, 1], [0, 1, 1]]),
        signatures=(BELOW, ABOVE, BETWEEN),
        change_rods=np.array([0.2, 0.6]),
        change_brackets=np.array([[3.19, 3.21], [2.39, 2.41]]),
        change_kinds=np.array([[0, 1], [0, 1]]),
        critical=np.array([2, 2]),
    )
    return replace(whole, **changes)


def line(axes, label):
    (found,) = (line for line in axes.lines if line.get_label().startswith(label))
    return found.get_xydata()


def test_the_closed_form_and_the_changes_are_where_they_are():
    (axes,) = draw_pair_map(made()).axes
    length, rod = line(axes, r"$2\sqrt{4r^2-(r+t)^2}$").T
    np.testing.assert_allclose((length / 2) ** 2 + (1 + rod) ** 2, 4, atol=1e-12)
    changes = line(axes, "change, by bisection")
    np.testing.assert_allclose(changes, [[3.2, 0.2], [2.4, 0.6]])
    assert not any(line.get_label() == "unexplained" for line in axes.lines)


def test_every_atlas_is_a_dot_with_the_colour_of_its_signature():
    (axes,) = draw_pair_map(made()).axes
    dots = [line for line in axes.lines if line.get_markersize() == 5]
    drawn = [{tuple(p) for p in line.get_xydata().tolist()} for line in dots]
    assert drawn == [{(2.0, 0.2), (3.0, 0.2), (2.0, 0.6)}, {(4.0, 0.2), (3.0, 0.6), (4.0, 0.6)}]
    assert not same_color(dots[0].get_color(), dots[1].get_color())


def described(figure):
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def test_the_legend_describes_every_signature():
    below, above, _, changes = described(draw_pair_map(made()))
    assert "8, 12, 4" in below
    assert "2, 3, 1" in below
    assert "2, 2, 1" in below
    assert "$C^{300}_L$" in below
    assert "16, 28, 12" in above
    assert r"$\Delta_R$" in above
    assert "exactly there" in changes
    assert "9, 9, 9" in changes


def test_no_text_hides_a_point():
    figure = draw_pair_map(made())
    figure.draw_without_rendering()
    (axes,), (legend,) = figure.axes, figure.legends
    assert not axes.texts
    assert not legend.get_window_extent().overlaps(axes.get_window_extent())


def test_unexplained_changes_and_incomplete_skeletons_are_marked():
    odd = made(
        change_brackets=np.array([[3.19, 3.21], [3.6, 3.61]]),
        signatures=(BELOW, replace(ABOVE, sound=False), BETWEEN),
    )
    figure = draw_pair_map(odd)
    np.testing.assert_allclose(line(figure.axes[0], "unexplained"), [[3.605, 0.6]])
    marked = [("incomplete" in text) for text in described(figure)[:2]]
    assert marked == [False, True]


def test_a_map_without_changes_is_drawn_too():
    empty = made(
        table=np.ones((2, 3), dtype=int),
        change_rods=np.empty(0),
        change_brackets=np.empty((0, 2)),
        change_kinds=np.empty((0, 2), dtype=int),
        critical=np.array([-1, -1]),
    )
    assert len(described(draw_pair_map(empty))) == 2


def test_it_is_written_as_a_picture(tmp_path):
    path = save(draw_pair_map(made()), tmp_path / "map.png")
    assert path.read_bytes().startswith(b"\x89PNG")

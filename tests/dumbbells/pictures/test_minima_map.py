"""Pictures of the minima map show every kind where it was found, and every kind once."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import same_color, to_rgb
from matplotlib.patches import Circle, Polygon

from polycorner.dumbbells.pictures.minima_map import (
    MARKS,
    NESTED,
    draw_kinds,
    draw_minima_map,
    draw_pair_map,
)
from polycorner.dumbbells.statics.minima_map import minima_map
from polycorner.dumbbells.statics.skeleton_map import PairMap, Pattern, Signature
from polycorner.pictures.style import BODIES, save


@pytest.fixture(scope="module")
def found():
    given = {"rods": [0.35, 0.6], "lengths": [5, 8], "starts": 60}
    return minima_map(curvatures=[0, 1, 1.95], **given)


def test_marks_lie_in_regions_of_their_kind(found):
    others = [kind for kind in found.kinds if kind != "G" and kind not in NESTED]
    assert "crossed" in others
    for sheet, axes in zip(found.sheets, draw_minima_map(found).axes, strict=True):
        drawn = dict.fromkeys(others, 0)
        for line in axes.lines:
            if line.get_marker() in MARKS:
                kind = others[MARKS.index(line.get_marker())]
                ((length, rod),) = line.get_xydata()
                drawn[kind] += kind in sheet.region(rod, length).kinds
        assert drawn == {k: sum(k in r.kinds for r in sheet.regions) for k in others}


def test_borders_are_drawn_where_they_are(found):
    for sheet, axes in zip(found.sheets, draw_minima_map(found).axes, strict=True):
        lines = [line.get_xydata() for line in axes.lines if line.get_marker() == "None"]
        assert len(lines) == len(sheet.borders)
        for line, border in zip(lines, sheet.borders, strict=True):
            np.testing.assert_array_equal(line, border.parameters[:, ::-1])


def test_colours_tell_what_nests(found):
    for sheet, axes in zip(found.sheets, draw_minima_map(found).axes, strict=True):
        if sheet.within is None:
            assert not axes.collections
            continue
        (mesh,) = axes.collections
        colours = mesh.cmap(mesh.norm(mesh.get_array())).reshape(*sheet.labels.shape, 4)[..., :3]
        for kind, colour in NESTED.items():
            same = (abs(colours - to_rgb(colour)) < 1e-6).all(axis=-1)
            there = [k for k, region in enumerate(sheet.regions) if kind in region.kinds]
            np.testing.assert_array_equal(same, np.isin(sheet.labels, there))


def test_the_legend_names_every_kind_that_was_found_beside_g(found):
    (legend,) = draw_minima_map(found).legends
    names = {text.get_text() for text in legend.get_texts()}
    assert {kind for kind in found.kinds if kind != "G"} <= names
    assert "G" not in names


def test_examples_are_drawn_once_from_above_and_from_the_front(found):
    figure = draw_kinds(found)
    assert len(figure.axes) == 2 * len(found.kinds)
    for kind, above in zip(found.kinds, figure.axes[::2], strict=True):
        pair, certificate = found.examples[kind]
        balls = [p for p in above.patches if isinstance(p, Circle)]
        assert [ball.get_facecolor()[:3] for ball in balls] == [
            to_rgb(BODIES[k // 2]) for k in range(4)
        ]
        centres = pair.ball_centres(certificate.point)
        drawn = np.array([ball.center for ball in balls])
        np.testing.assert_allclose(drawn[:, 0], centres[:, 0], atol=1e-12)
        np.testing.assert_allclose(np.diff(drawn[:, 1]), np.diff(centres[:, 1]), atol=1e-12)
        assert sum(isinstance(p, Polygon) for p in above.patches) == 2


def test_the_upper_rod_of_a_crossing_is_drawn_last(found):
    pair, certificate = found.examples["crossed"]
    figure = draw_kinds(found)
    above = figure.axes[2 * found.kinds.index("crossed")]
    rods = [p for p in above.patches if isinstance(p, Polygon)]
    heights = pair.ball_centres(certificate.point)[:, 2].reshape(2, 2).mean(axis=1)
    order = [rod.get_zorder() for rod in rods]
    assert np.argmax(order) == np.argmax(heights)


def test_a_map_without_a_pair_that_fits_is_grey_throughout(tmp_path):
    empty = minima_map(curvatures=[1.95], rods=[0.5, 0.6], lengths=[3, 4], starts=5)
    assert not empty.kinds
    for k, draw in enumerate((draw_minima_map, draw_kinds)):
        path = save(draw(empty), tmp_path / f"{k}.png")
        assert path.read_bytes().startswith(b"\x89PNG")


def test_both_pictures_can_be_saved(found, tmp_path):
    for k, draw in enumerate((draw_minima_map, draw_kinds)):
        path = save(draw(found), tmp_path / f"{k}.png")
        assert path.read_bytes().startswith(b"\x89PNG")


# -------------------------------------------------------------------------------------- proportions


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

"""Pictures of the minima map show every kind where it was found, and every kind once."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, Polygon

from polycorner.dumbbells.pictures.minima_map import MARKS, NESTED, draw_kinds, draw_minima_map
from polycorner.dumbbells.statics.minima_map import minima_map
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

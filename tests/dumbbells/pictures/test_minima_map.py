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
    return minima_map(curvatures=[0, 1.5], rods=[0.1, 0.5], lengths=[3, 8, 16], starts=60)


def test_every_mark_lies_in_a_cell_where_its_kind_was_found(found):
    figure = draw_minima_map(found)
    others = [kind for kind in found.kinds if kind != "G" and kind not in NESTED]
    assert "crossed" in others
    for i, axes in enumerate(figure.axes):
        drawn = dict.fromkeys(others, 0)
        for line in axes.lines:
            if line.get_marker() not in MARKS:
                continue
            kind = others[MARKS.index(line.get_marker())]
            for x, y in line.get_xydata():
                k, j = (
                    int(abs(np.log(a / b)).argmin())
                    for a, b in ((found.lengths, x), (found.rods, y))
                )
                assert found.has(kind)[i, j, k]
                drawn[kind] += 1
        assert drawn == {kind: found.has(kind)[i].sum() for kind in others}


def test_colours_tell_what_nests(found):
    figure = draw_minima_map(found)
    for i, axes in enumerate(figure.axes):
        mesh = axes.collections[0]
        colours = mesh.cmap(mesh.norm(mesh.get_array())).reshape(2, 3, 4)[..., :3]
        for kind, colour in NESTED.items():
            same = (abs(colours - to_rgb(colour)) < 1e-6).all(axis=-1)
            np.testing.assert_array_equal(same, found.has(kind)[i])
        grey = (abs(colours - to_rgb("0.75")) < 1e-6).all(axis=-1)
        np.testing.assert_array_equal(grey, ~found.examined[i])


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
    empty = minima_map(curvatures=[1.9], rods=[0.5], lengths=[3], starts=5)
    assert not empty.examined.any()
    assert not empty.kinds
    for k, draw in enumerate((draw_minima_map, draw_kinds)):
        path = save(draw(empty), tmp_path / f"{k}.png")
        assert path.read_bytes().startswith(b"\x89PNG")


def test_both_pictures_can_be_saved(found, tmp_path):
    for k, draw in enumerate((draw_minima_map, draw_kinds)):
        path = save(draw(found), tmp_path / f"{k}.png")
        assert path.read_bytes().startswith(b"\x89PNG")

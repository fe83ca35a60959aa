"""Strips of frames show every edge of a pair's skeleton from one corner to the next."""

import math

import numpy as np
import pytest
from atlases import kept_atlas
from drawn_pairs import LONG, circles, depths, lit
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from polycorner.dumbbells import DumbbellPair, RelativePlacements
from polycorner.dumbbells.pictures import draw_relative
from polycorner.dumbbells.pictures.motion_strips import draw_motions


@pytest.fixture(scope="module")
def strips():
    return draw_motions(kept_atlas(LONG))


def strips_of(figure):
    axes = figure.axes
    return [axes[k : k + 5] for k in range(0, len(axes), 5)]


def test_a_strip_of_five_frames_for_every_motion(strips):
    rows = strips_of(strips)
    assert len(rows) == 5
    ends = [{row[0].get_title()[-2], row[-1].get_title()[-2]} for row in rows]
    assert sorted(map(sorted, ends)) == [["L"], ["L", "R"], ["L", "R"], ["L", "R"], ["R"]]
    assert all("×" in row[2].get_title() for row in rows)


def test_titles_name_the_corners_at_the_ends(strips):
    """By the number of contacts, and by the chirality of the balls that are drawn."""
    for row in strips_of(strips):
        for axes in (row[0], row[-1]):
            title, count = axes.get_title(), len(lit(axes))
            assert title.startswith({3: r"$\Delta_", 4: r"$\mathcal{E}_"}[count])
            (four,), _ = circles(axes)
            i, j = max(
                ((i, j) for i in (0, 1) for j in (2, 3)),
                key=lambda ij, four=four: np.linalg.norm(four[ij[1]] - four[ij[0]]),
            )
            outer, inner = four[j] - four[i], four[5 - j] - four[1 - i]
            turn = outer[0] * inner[1] - outer[1] * inner[0]
            assert title[-2] == ("R" if turn > 0 else "L")


def test_frames_lie_on_their_edge(strips):
    """Bodies touch at the lit contacts and overlap nowhere; at the ends more contacts close."""
    for row in strips_of(strips):
        counts = [len(lit(axes)) for axes in row]
        assert counts[1:4] == [2, 2, 2]
        assert min(counts[0], counts[4]) >= 3
        for axes in row:
            (four,), radius = circles(axes)
            assert radius == LONG.ball_radius
            for mark in lit(axes):
                np.testing.assert_allclose(depths(LONG, four, 1.0, mark), 0, atol=1e-6)
            apart = np.linalg.norm(four[:2, None] - four[None, 2:], axis=-1)
            assert apart.min() >= 2 * LONG.ball_radius - 1e-6


def test_in_the_plane_a_stands_still_and_b_moves_evenly(strips):
    for row in strips_of(strips):
        frames = np.array([circles(axes)[0][0] for axes in row])
        np.testing.assert_allclose(frames[:, :2], frames[:1, :2].repeat(5, axis=0), atol=1e-9)
        steps = np.linalg.norm(np.diff(frames[:, 2:], axis=0), axis=(1, 2))
        assert steps.min() > 0.5
        assert steps.max() < 1.5 * steps.min()


def test_all_frames_of_a_strip_have_one_scale_and_hold_the_bodies(strips):
    for row in strips_of(strips):
        assert len({(axes.get_xlim(), axes.get_ylim()) for axes in row}) == 1
        for axes in row:
            (four,), radius = circles(axes)
            low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
            assert (four - radius > low).all()
            assert (four + radius < high).all()


def test_in_the_drum_the_axis_stays_upright():
    pair = DumbbellPair(16, 3, 1.5, 125)
    atlas = kept_atlas(pair, 0.3)
    for row in strips_of(draw_motions(atlas)):
        for axes in row:
            (four,), _ = circles(axes)
            means = [np.arctan2(*(four[k + 1] - four[k])) for k in (0, 2)]
            assert math.sin(sum(means) / 2 - 0.3) == pytest.approx(0, abs=1e-3)
            for mark in lit(axes):
                np.testing.assert_allclose(depths(pair, four, 1.0, mark), 0, atol=0.05)


# ----------------------------------------------------------------------------------- small pictures

SIZES = (16.0, 3.0, 1.5)


@pytest.mark.parametrize("radius", [125.0, np.inf])
def test_two_dumbbells_side_by_side_touch_at_two_balls(radius):
    model = RelativePlacements(DumbbellPair(*SIZES, radius))
    pair = model.pair
    x = 3.0 if pair.is_plane else float(np.arcsin(3 / pair.centre_radius))
    axes = Figure().add_subplot()
    draw_relative(model)(axes, np.array([x, 0.0, 0.0, 0.0]))
    circles = [patch for patch in axes.patches if isinstance(patch, Circle)]
    balls = np.array([c.center for c in circles if c.radius == pair.ball_radius])
    touching = np.array([c.center for c in circles if c.radius < pair.ball_radius])
    assert sorted(map(tuple, balls.round(2))) == [(-3, -8), (-3, 8), (3, -8), (3, 8)]
    assert sorted(map(tuple, abs(touching).round(2))) == [(0, 8), (0, 8)]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert (left, low) < (-6, -11)
    assert (right, high) > (6, 11)

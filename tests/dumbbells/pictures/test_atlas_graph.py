"""The graph of a pair's skeleton shows every corner and edge, to scale."""

from dataclasses import replace

import numpy as np
import pytest
from atlases import kept_atlas
from drawn_pairs import LONG, circles, depths, lit, texts
from matplotlib.colors import same_color
from matplotlib.patches import FancyBboxPatch, PathPatch

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.relabelling import draw_atlas
from polycorner.dumbbells.pictures.symbols import HANDS


@pytest.fixture(scope="module")
def long():
    return kept_atlas(LONG)


@pytest.fixture(scope="module")
def short():
    return kept_atlas(DumbbellPair(7, 3, 1.5))


@pytest.fixture(scope="module")
def graph(long):
    return draw_atlas(long)


def test_every_corner_up_to_relabelling_is_drawn_and_named(graph):
    (axes,) = graph.axes
    names = [r"$\Delta_R$", r"$\Delta_L$", r"$\mathcal{E}_R$", r"$\mathcal{E}_L$"]
    assert sorted(t for t in texts(axes) if t.startswith("$")) == sorted(names)
    centres, _ = circles(axes)
    assert len(centres) == 4


def test_boxes_have_the_colour_of_their_hand(graph):
    (axes,) = graph.axes
    boxes = [p for p in axes.patches if isinstance(p, FancyBboxPatch)]
    assert len(boxes) == 4
    for box in boxes:
        low, high = np.array(box.get_bbox())
        inside = [
            text.get_text() for text in axes.texts
            if text.get_text().startswith("$")
            and (low - 1e-9 <= text.get_position()).all()
            and (text.get_position() <= high + 1e-9).all()
        ]  # fmt: skip
        assert len(inside) == 1
        assert same_color(box.get_edgecolor(), HANDS[inside[0][-2]])


def test_pairs_are_to_scale_and_contacts_lie_on_both_surfaces(graph):
    (axes,) = graph.axes
    centres, radius = circles(axes)
    scale = radius / LONG.ball_radius
    for four in centres:
        for k in (0, 2):
            apart = np.linalg.norm(four[k + 1] - four[k])
            assert apart == pytest.approx(scale * LONG.length, rel=1e-9)
        up = four[1] - four[0]
        assert up[0] == pytest.approx(0, abs=1e-9)
        assert up[1] > 0
    marks = lit(axes)
    assert len(marks) == 3 + 3 + 4 + 4
    for mark in marks:
        four = min(centres, key=lambda c: np.linalg.norm(c.mean(axis=0) - mark))
        np.testing.assert_allclose(depths(LONG, four, scale, mark), 0, atol=1e-8)


def test_right_and_left_corners_are_drawn_as_mirror_images(graph):
    (axes,) = graph.axes
    centres, _ = circles(axes)
    shapes = [c - c.mean(axis=0) for c in centres]
    for shape in shapes:
        mirrored = shape * np.array([-1, 1])
        twins = [s for s in shapes if np.allclose(s, mirrored, atol=1e-7)]
        assert len(twins) == 1
        assert twins[0] is not shape


def test_five_motions_carry_contacts_and_numbers(graph):
    (axes,) = graph.axes
    curves = [p for p in axes.patches if isinstance(p, PathPatch) and p.get_zorder() == 1]
    assert len(curves) == 5
    labels = [t for t in texts(axes) if "ball–" in t]
    kinds = sorted(label.split("\n")[0] for label in labels)
    assert kinds == sorted(["2 ball–rod"] * 2 + ["1 ball–ball + 1 ball–rod"] * 2 + ["2 ball–ball"])
    numbers = sorted(int(label.split("×")[1].rstrip(")")) for label in labels)
    assert numbers == [4, 4, 4, 8, 8]
    assert "up to relabelling 4, 5, 2; labelled 16, 28, 12" in axes.get_title()


def test_motions_join_the_boxes_of_their_corners(graph):
    (axes,) = graph.axes
    boxes = [np.mean(p.get_bbox(), axis=0) for p in axes.patches if isinstance(p, FancyBboxPatch)]
    names = [t for t in texts(axes) if t.startswith("$")]
    drawn = set()
    for patch in axes.patches:
        if isinstance(patch, PathPatch) and patch.get_zorder() == 1:
            ends = patch.get_path().vertices[[0, -1]]
            at = [int(np.argmin([np.linalg.norm(b - e) for b in boxes])) for e in ends]
            drawn.add(frozenset(names[k] for k in at))
    delta, e = r"$\Delta_{}$", r"$\mathcal{{E}}_{}$"
    pairs = [(delta, "R", e, "R"), (delta, "L", e, "L"), (delta, "R", e, "L"),
             (delta, "L", e, "R"), (e, "R", e, "L")]  # fmt: skip
    assert drawn == {frozenset((f.format(a), g.format(b))) for f, a, g, b in pairs}


def test_two_motions_between_the_same_corners_are_drawn_apart(short):
    (axes,) = draw_atlas(short).axes
    curves = [p for p in axes.patches if isinstance(p, PathPatch) and p.get_zorder() == 1]
    middles = [c.get_path().vertices[1] for c in curves]
    assert len(middles) == 2
    assert np.linalg.norm(middles[0] - middles[1]) > 1
    assert sorted(t for t in texts(axes) if t.startswith("$")) == ["$C^{300}_L$", "$C^{300}_R$"]


def test_a_motion_that_returns_is_drawn_as_a_loop(long):
    """Made up: every motion with a ball-ball contact ends where it began."""
    skeleton = long.skeleton
    edges = [
        replace(e, ends=(e.ends[0], e.ends[0])) if any(len(n) == 4 for n in e.active) else e
        for e in skeleton.edges
    ]
    made = replace(long, skeleton=replace(skeleton, edges=tuple(edges)))
    (axes,) = draw_atlas(made).axes
    paths = [p.get_path().vertices for p in axes.patches if isinstance(p, PathPatch)]
    loops = [v for v in paths if len(v) == 4 and np.array_equal(v[0], v[-1])]
    assert len(loops) == 3
    reach = np.array([axes.get_xlim()[1], axes.get_ylim()[1]])
    for loop in loops:
        top = (loop[0] + 3 * loop[1] + 3 * loop[2] + loop[3]) / 8
        assert np.linalg.norm(top - loop[0]) > 1.2
        assert (abs(top) < reach).all()

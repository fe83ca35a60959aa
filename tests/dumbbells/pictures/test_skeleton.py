"""Pictures of the pair's atlas show its corners, its motions, and where it changes, as they are."""

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import same_color
from matplotlib.patches import Circle, FancyBboxPatch, PathPatch

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.skeleton import HANDS, draw_atlas, draw_map, draw_motions
from polycorner.dumbbells.statics.skeleton import pair_atlas
from polycorner.dumbbells.statics.skeleton_map import PairMap, Pattern, Signature
from polycorner.pictures.style import BODIES, save

LONG = DumbbellPair(16, 3, 1.5)


@pytest.fixture(scope="module")
def long():
    return pair_atlas(LONG)


@pytest.fixture(scope="module")
def short():
    return pair_atlas(DumbbellPair(7, 3, 1.5))


@pytest.fixture(scope="module")
def graph(long):
    return draw_atlas(long)


@pytest.fixture(scope="module")
def strips(long):
    return draw_motions(long)


def texts(axes):
    return [text.get_text() for text in axes.texts]


def circles(axes):
    """Return the balls of an axes as rows of four: A1, A2, B1, B2, with their radius."""
    found = [p for p in axes.patches if isinstance(p, Circle)]
    centres = np.array([c.center for c in found]).reshape(-1, 4, 2)
    (radius,) = {round(c.radius, 12) for c in found}
    for k, circle in enumerate(found):
        assert same_color(circle.get_facecolor(), BODIES[(k % 4) // 2])
    return centres, radius


def lit(axes):
    """Return where contacts are drawn."""
    marks = [line.get_xydata() for line in axes.lines if line.get_marker() == "o"]
    return np.array([mark[0] for mark in marks if len(mark)])


def depths(pair, centres, scale, mark):
    """Return how far outside a mark is of A and of B, each its balls and its rod."""
    found = []
    for body in (centres[:2], centres[2:]):
        u = body[1] - body[0]
        s = np.clip((mark - body[0]) @ u / (u @ u), 0, 1)
        to_rod = np.linalg.norm(mark - body[0] - s * u) - scale * pair.rod_radius
        to_balls = np.linalg.norm(mark - body, axis=1) - scale * pair.ball_radius
        found.append(min(to_rod, *to_balls))
    return found


class TestGraph:
    def test_every_corner_up_to_relabelling_is_drawn_and_named(self, graph):
        (axes,) = graph.axes
        names = [r"$\Delta_R$", r"$\Delta_L$", r"$\mathcal{E}_R$", r"$\mathcal{E}_L$"]
        assert sorted(t for t in texts(axes) if t.startswith("$")) == sorted(names)
        centres, _ = circles(axes)
        assert len(centres) == 4

    def test_boxes_have_the_colour_of_their_hand(self, graph):
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

    def test_pairs_are_to_scale_and_contacts_lie_on_both_surfaces(self, graph):
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

    def test_right_and_left_corners_are_drawn_as_mirror_images(self, graph):
        (axes,) = graph.axes
        centres, _ = circles(axes)
        shapes = [c - c.mean(axis=0) for c in centres]
        for shape in shapes:
            mirrored = shape * np.array([-1, 1])
            twins = [s for s in shapes if np.allclose(s, mirrored, atol=1e-7)]
            assert len(twins) == 1
            assert twins[0] is not shape

    def test_five_motions_carry_contacts_and_numbers(self, graph):
        (axes,) = graph.axes
        curves = [p for p in axes.patches if isinstance(p, PathPatch) and p.get_zorder() == 1]
        assert len(curves) == 5
        labels = [t for t in texts(axes) if "ball–" in t]
        kinds = sorted(label.split("\n")[0] for label in labels)
        assert kinds == sorted(
            ["2 ball–rod"] * 2 + ["1 ball–ball + 1 ball–rod"] * 2 + ["2 ball–ball"]
        )
        numbers = sorted(int(label.split("×")[1].rstrip(")")) for label in labels)
        assert numbers == [4, 4, 4, 8, 8]
        assert "up to relabelling 4, 5, 2; labelled 16, 28, 12" in axes.get_title()

    def test_motions_join_the_boxes_of_their_corners(self, graph):
        (axes,) = graph.axes
        boxes = [
            np.mean(p.get_bbox(), axis=0) for p in axes.patches if isinstance(p, FancyBboxPatch)
        ]
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

    def test_two_motions_between_the_same_corners_are_drawn_apart(self, short):
        (axes,) = draw_atlas(short).axes
        curves = [p for p in axes.patches if isinstance(p, PathPatch) and p.get_zorder() == 1]
        middles = [c.get_path().vertices[1] for c in curves]
        assert len(middles) == 2
        assert np.linalg.norm(middles[0] - middles[1]) > 1
        assert sorted(t for t in texts(axes) if t.startswith("$")) == ["$C^{300}_L$", "$C^{300}_R$"]

    def test_a_motion_that_returns_is_drawn_as_a_loop(self, long):
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

    def test_it_is_written_as_a_picture(self, graph, strips, tmp_path):
        for name, figure in (("graph", graph), ("strips", strips)):
            path = save(figure, tmp_path / f"{name}.png")
            assert path.read_bytes().startswith(b"\x89PNG")


class TestMotions:
    def rows(self, figure):
        axes = figure.axes
        return [axes[k : k + 5] for k in range(0, len(axes), 5)]

    def test_a_strip_of_five_frames_for_every_motion(self, strips):
        rows = self.rows(strips)
        assert len(rows) == 5
        ends = [{row[0].get_title()[-2], row[-1].get_title()[-2]} for row in rows]
        assert sorted(map(sorted, ends)) == [["L"], ["L", "R"], ["L", "R"], ["L", "R"], ["R"]]
        assert all("×" in row[2].get_title() for row in rows)

    def test_titles_name_the_corners_at_the_ends(self, strips):
        """By the number of contacts, and by the chirality of the balls that are drawn."""
        for row in self.rows(strips):
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

    def test_frames_lie_on_their_edge(self, strips):
        """Bodies touch at the lit contacts and overlap nowhere; at the ends more contacts close."""
        for row in self.rows(strips):
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

    def test_in_the_plane_a_stands_still_and_b_moves_evenly(self, strips):
        for row in self.rows(strips):
            frames = np.array([circles(axes)[0][0] for axes in row])
            np.testing.assert_allclose(frames[:, :2], frames[:1, :2].repeat(5, axis=0), atol=1e-9)
            steps = np.linalg.norm(np.diff(frames[:, 2:], axis=0), axis=(1, 2))
            assert steps.min() > 0.5
            assert steps.max() < 1.5 * steps.min()

    def test_all_frames_of_a_strip_have_one_scale_and_hold_the_bodies(self, strips):
        for row in self.rows(strips):
            assert len({(axes.get_xlim(), axes.get_ylim()) for axes in row}) == 1
            for axes in row:
                (four,), radius = circles(axes)
                low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
                assert (four - radius > low).all()
                assert (four + radius < high).all()

    def test_in_the_drum_the_axis_stays_upright(self):
        pair = DumbbellPair(16, 3, 1.5, 125)
        atlas = pair_atlas(pair, heading=0.3)
        for row in self.rows(draw_motions(atlas)):
            for axes in row:
                (four,), _ = circles(axes)
                means = [np.arctan2(*(four[k + 1] - four[k])) for k in (0, 2)]
                assert math.sin(sum(means) / 2 - 0.3) == pytest.approx(0, abs=1e-3)
                for mark in lit(axes):
                    np.testing.assert_allclose(depths(pair, four, 1.0, mark), 0, atol=0.05)


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


class TestMap:
    def line(self, axes, label):
        (found,) = (line for line in axes.lines if line.get_label() == label)
        return found.get_xydata()

    def test_the_closed_form_and_the_changes_are_where_they_are(self):
        (axes,) = draw_map(made()).axes
        length, rod = self.line(axes, r"$2\sqrt{4r^2-(r+t)^2}$").T
        np.testing.assert_allclose((length / 2) ** 2 + (1 + rod) ** 2, 4, atol=1e-12)
        changes = self.line(axes, "change, by bisection")
        np.testing.assert_allclose(changes, [[3.2, 0.2], [2.4, 0.6]])
        assert not any(line.get_label() == "unexplained" for line in axes.lines)

    def test_every_atlas_is_a_dot_with_the_colour_of_its_signature(self):
        (axes,) = draw_map(made()).axes
        dots = [line for line in axes.lines if line.get_markersize() == 5]
        drawn = [{tuple(p) for p in line.get_xydata().tolist()} for line in dots]
        assert drawn == [{(2.0, 0.2), (3.0, 0.2), (2.0, 0.6)}, {(4.0, 0.2), (3.0, 0.6), (4.0, 0.6)}]
        assert not same_color(dots[0].get_color(), dots[1].get_color())

    def test_regions_are_labelled_with_their_counts(self):
        (axes,) = draw_map(made()).axes
        below, above, critical = texts(axes)
        assert "8, 12, 4" in below
        assert "2, 3, 1" in below
        assert "2, 2, 1" in below
        assert "$C^{300}_L$" in below
        assert "16, 28, 12" in above
        assert r"$\Delta_R$" in above
        assert "exactly on the curve" in critical
        assert "9, 9, 9" in critical

    def test_what_is_not_explained_or_not_whole_is_marked(self):
        odd = made(
            change_brackets=np.array([[3.19, 3.21], [3.6, 3.61]]),
            signatures=(BELOW, replace(ABOVE, sound=False), BETWEEN),
        )
        (axes,) = draw_map(odd).axes
        np.testing.assert_allclose(self.line(axes, "unexplained"), [[3.605, 0.6]])
        assert [("not whole" in text) for text in texts(axes)] == [False, True, False]

    def test_a_map_without_changes_is_drawn_too(self):
        empty = made(
            table=np.ones((2, 3), dtype=int), change_rods=np.empty(0),
            change_brackets=np.empty((0, 2)), change_kinds=np.empty((0, 2), dtype=int),
            critical=np.array([-1, -1]),
        )  # fmt: skip
        (axes,) = draw_map(empty).axes
        assert len(texts(axes)) == 1

    def test_it_is_written_as_a_picture(self, tmp_path):
        path = save(draw_map(made()), tmp_path / "map.png")
        assert path.read_bytes().startswith(b"\x89PNG")

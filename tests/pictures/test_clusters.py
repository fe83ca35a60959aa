"""Pictures of clusters are projections of the clusters; frames of a motion lie on its edge."""

import math
import re
from itertools import combinations, pairwise, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from polycorner import skeleton
from polycorner.models.spheres import SphereCluster
from polycorner.pictures.arguments import sampled
from polycorner.pictures.clusters import (
    BALL,
    BAR,
    CLOSING,
    OPENING,
    RADIUS,
    SINGULAR_BALL,
    THICKNESS,
    _turned,
    draw_clusters,
)
from polycorner.pictures.motion_films import draw_motion
from polycorner.pictures.style import save

DPI = 150  # of files that are saved
HELD = [SphereCluster(3).pairs.index(pair) for pair in ((0, 2), (1, 2))]  # of a hinge


def atlas(count):
    model = SphereCluster(count)
    return model, skeleton(model.polyhedron, model.starts(), symmetry=model.symmetry)


FIVE, SIX = atlas(5), atlas(6)


def moved(rng, q):
    """Return a cluster elsewhere, turned, with other labels; never its mirror image."""
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    turn *= np.linalg.det(turn)
    centres = rng.permutation(q.reshape(-1, 3)) @ turn.T + rng.uniform(-5, 5, 3)
    return centres.ravel()


def distances(centres):
    return np.array([np.linalg.norm(a - b) for a, b in combinations(centres, 2)])


def touching(q):
    """Return the pairs of spheres, counted from 1, whose centres are one diameter apart."""
    centres = list(enumerate(np.reshape(q, (-1, 3)), 1))
    pairs = combinations(centres, 2)
    return {f"{i}-{j}" for (i, a), (j, b) in pairs if abs(math.dist(a, b) - 1) < 1e-6}


def symmetries(q):
    """Count permutations of the spheres that leave every distance as it is, trying all."""
    centres = np.reshape(q, (-1, 3))
    apart = np.linalg.norm(centres[:, None] - centres, axis=-1)
    tried = map(list, permutations(range(len(centres))))
    return sum(abs(apart[np.ix_(s, s)] - apart).max() < 1e-6 for s in tried)


def pieces(axes):
    """Return what is drawn, from first to last, as outlines with colours."""
    (drawn,) = axes.collections
    return list(zip(drawn.get_paths(), drawn.get_facecolors()[:, :3], strict=True))


def discs(axes):
    """Return the centres of the balls' outlines, from far to near."""
    circles = [path.vertices for path, _ in pieces(axes) if path.codes is not None]
    low, high = (np.array([end(v, axis=0) for v in circles]) for end in (np.min, np.max))
    return ((low + high) / 2)[high[:, 0] - low[:, 0] > 2 * RADIUS - 1e-6]


def halves(axes):
    """Return the outlines of half bars, without their highlights, and their colours."""
    return [piece for piece in pieces(axes) if piece[0].codes is None][::2]


def hue(colour):
    """Return what is left of a colour when it is faded to white: where its channels lie."""
    away = 1 - np.array(to_rgb(colour))
    return away / away.max()


def coloured(axes, colour):
    """Count the half bars of a colour."""
    return sum(np.allclose(hue(shade), hue(colour), atol=1e-6) for _, shade in halves(axes))


# ---------------------------------------------------------------------------------------- clusters


@given(st.integers(2, 9), st.integers(0, 2**32 - 1))
def test_clusters_are_turned_and_not_bent(count, seed):
    """Distances stay, and so do signed volumes of four spheres: no mirror image is drawn."""
    q = moved(np.random.default_rng(seed), SphereCluster(count).stacked()).reshape(-1, 3)
    turned = _turned(q[None])[0]
    np.testing.assert_allclose(distances(turned), distances(q), atol=1e-12)
    for four in combinations(range(count), 4):
        edges = [shape[list(four[1:])] - shape[four[0]] for shape in (q, turned)]
        assert np.linalg.det(edges[0]) == pytest.approx(np.linalg.det(edges[1]), abs=1e-12)


@given(st.integers(2, 8), st.integers(0, 2**32 - 1))
def test_far_balls_are_drawn_before_near_ones(count, seed):
    model = SphereCluster(count)
    q = moved(np.random.default_rng(seed), model.stacked())
    axes = draw_clusters(model, q).axes[0]
    turned = _turned(q.reshape(1, -1, 3))[0]
    from_far = turned[np.argsort(turned[:, 2], kind="stable")]
    np.testing.assert_allclose(discs(axes), from_far[:, :2], atol=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_a_cluster_is_drawn_alike_wherever_it_is(seed):
    model = SphereCluster(5)
    q = np.array([0, 0, 0, 1.1, 0, 0, 0.4, 1.3, 0, 0.2, 0.5, 1.7, -1.9, 0.6, 0.3])
    one, other = (
        discs(draw_clusters(model, p).axes[0]) for p in (q, moved(np.random.default_rng(seed), q))
    )
    np.testing.assert_allclose(one, other, atol=1e-6)


def test_bars_join_spheres_that_touch():
    """Every half bar lies between the drawn centres of a contact, and each contact has two."""
    model, found = SIX
    for corner in found.corners:
        axes = draw_clusters(model, corner.point).axes[0]
        page = _turned(corner.point.reshape(1, -1, 3))[0, :, :2]
        ends = [tuple(int(i) - 1 for i in name.split("-")) for name in touching(corner.point)]
        drawn = [outline.vertices for outline, _ in halves(axes)]
        for i, j in ends:
            along = (page[j] - page[i]) / np.linalg.norm(page[j] - page[i])
            away = [(outline - page[i]) @ (along[1], -along[0]) for outline in drawn]
            shares = [(outline - page[i]) @ along for outline in drawn]
            inside = [0 < min(s) and max(s) < np.linalg.norm(page[j] - page[i]) for s in shares]
            symmetric = [abs(a[:2] + a[3:1:-1]).max() < 1e-6 for a in away]
            assert sum(a and b for a, b in zip(inside, symmetric, strict=True)) == 2
        assert len(drawn) == 2 * len(ends) == coloured(axes, BAR)


def test_the_view_shows_every_ball_of_the_octahedron():
    model, found = SIX
    octahedron = max((c.point for c in found.corners), key=lambda q: len(touching(q)))
    page = discs(draw_clusters(model, octahedron).axes[0])
    assert distances(page).min() > RADIUS


@pytest.mark.parametrize("known", [FIVE, SIX], ids=["5", "6"])
def test_captions_have_the_order_of_the_symmetry_group(known):
    model, found = known
    points = [corner.point for corner in found.corners]
    titles = [axes.get_title() for axes in draw_clusters(model, points).axes]
    orders = [symmetries(q) for q in points]
    assert titles == [f"C{k}  order {order}" for k, order in enumerate(orders)]


def test_labels_replace_numbers_and_singular_clusters_stand_out():
    model, found = SIX
    points = [corner.point for corner in found.corners]
    figure = draw_clusters(model, points, labels=["a", "b"], singular={1})
    titles = [axes.get_title() for axes in figure.axes]
    assert [title[0] for title in titles] == ["a", "b"]
    assert ["singular" in title for title in titles] == [False, True]
    for axes, colour in zip(figure.axes, (BALL, SINGULAR_BALL), strict=True):
        outline = next(shade for path, shade in reversed(pieces(axes)) if path.codes is not None)
        others = {BALL, SINGULAR_BALL} - {colour}
        assert all(
            np.linalg.norm(hue(outline) - hue(colour)) < np.linalg.norm(hue(outline) - hue(other))
            for other in others
        )


@pytest.mark.parametrize("many", [1, 2, 3, 5, 13, 52])
def test_any_number_of_clusters_is_readable(many):
    """Nothing overlaps or is cut off, and a ball is at least a fifth of an inch across."""
    rng, model = np.random.default_rng(many), SphereCluster(9)
    points = [moved(rng, model.stacked()) for _ in range(many)]
    figure = draw_clusters(model, points, singular=[many - 1])
    figure.set_dpi(DPI)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    assert len(figure.axes) == many
    renderer = canvas.get_renderer()
    texts = [figure._suptitle, *(axes.title for axes in figure.axes)]
    boxes = [text.get_window_extent(renderer) for text in texts]
    balls = []
    for axes in figure.axes:
        outlines = [path for path, _ in pieces(axes)]
        ends = np.vstack([path.vertices for path in outlines if path.codes is None])
        corners = np.vstack([discs(axes) + RADIUS, discs(axes) - RADIUS, ends])
        drawn = axes.transData.transform(corners)
        assert (drawn >= axes.bbox.min - 1).all()
        assert (drawn <= axes.bbox.max + 1).all()
        np.testing.assert_allclose(discs(axes).min(axis=0), -discs(axes).max(axis=0), atol=1e-6)
        balls.append(2 * RADIUS * axes.transData.get_matrix()[0, 0])
        boxes.append(axes.bbox.shrunk(0.98, 0.98))
    assert all(not one.overlaps(other) for one, other in combinations(boxes, 2))
    assert all(box.x0 >= 0 and box.y0 >= 0 for box in boxes)
    assert all(box.x1 <= figure.bbox.x1 and box.y1 <= figure.bbox.y1 for box in boxes)
    np.testing.assert_allclose(balls, balls[0])
    assert balls[0] > DPI / 5


def test_pictures_are_saved(tmp_path):
    model, found = FIVE
    for figure in (
        draw_clusters(model, found.corners[0].point),
        draw_motion(model, found.edges[0].polyline, frames=2),
    ):
        assert save(figure, tmp_path / "file.png").read_bytes().startswith(b"\x89PNG")


# ----------------------------------------------------------------------------------------- motions


def hinge(points):
    """Return how sphere 2 rolls around sphere 3 from one side of sphere 1 to the other."""
    angle = np.linspace(math.pi / 3, 5 * math.pi / 3, points)
    line = np.zeros((points, 9))
    line[:, 0], line[:, 3], line[:, 4] = 1, np.cos(angle), np.sin(angle)
    return line


def test_frames_are_equal_steps_of_arc_length():
    """The hinge is an arc of a circle of radius one, so its points and lengths are known."""
    model, exact = SphereCluster(3), 4 * math.pi / 3 * np.linspace(0, 1, 6)
    axes = draw_motion(model, hinge(200)).axes
    assert [a.get_title().split("\n")[0] for a in axes] == [f"{s:.2f}" for s in exact]
    places, moments = sampled(model.polyhedron, hinge(200), HELD, 6)
    np.testing.assert_allclose(moments, exact, rtol=1e-3)
    np.testing.assert_allclose(places, hinge(6), atol=1e-3)


@pytest.mark.parametrize("points", [3, 4, 9])
def test_frames_between_points_of_a_coarse_polyline_lie_on_the_edge(points):
    places, _ = sampled(SphereCluster(3).polyhedron, hinge(points), HELD, 8)
    for q in places[1:-1]:
        assert touching(q) == {"1-3", "2-3"}
        a, b, c = q.reshape(3, 3)
        assert math.dist(a, c) == pytest.approx(1, abs=1e-12)
        assert math.dist(b, c) == pytest.approx(1, abs=1e-12)


EDGES = [(model, edge) for model, found in (FIVE, SIX) for edge in found.edges]


@pytest.mark.parametrize(("model", "edge"), EDGES)
def test_contacts_that_open_and_close_are_named_and_coloured(model, edge):
    ends = [touching(edge.polyline[k]) - set(edge.active) for k in (0, -1)]
    axes = draw_motion(model, edge.polyline, frames=5).axes
    remarks = [a.get_title().split("\n")[1] for a in axes]
    for remark, verb, contacts in zip(
        (remarks[0], remarks[-1]), ("opening", "closing"), ends, strict=True
    ):
        assert contacts
        assert remark.startswith(verb)
        assert set(re.findall(r"\d+-\d+", remark)) == contacts
    assert remarks[1:-1] == ["", "", ""]
    assert [coloured(a, OPENING) for a in axes] == [2 * len(ends[0]), 0, 0, 0, 0]
    assert [coloured(a, CLOSING) for a in axes] == [0, 0, 0, 0, 2 * len(ends[1])]
    assert [coloured(a, BAR) for a in axes] == 5 * [2 * len(edge.active)]


@pytest.mark.parametrize(("model", "edge"), EDGES)
def test_contacts_that_open_and_close_can_be_seen(model, edge):
    """Of the bar's length on paper, at least a third of a ball's radius shows its colour."""
    figure = draw_motion(model, edge.polyline)
    figure.set_dpi(DPI)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255
    for axes, colour in ((figure.axes[0], OPENING), (figure.axes[-1], CLOSING)):
        low, high = axes.bbox.min.astype(int), axes.bbox.max.astype(int)
        away = 1 - pixels[low[1] : high[1], low[0] : high[0]]
        strong = away.max(axis=-1)
        alike = abs(away - strong[..., None] * hue(colour)).max(axis=-1) < 0.05
        unit = axes.transData.get_matrix()[0, 0]
        assert (alike & (strong > 0.2)).sum() > RADIUS / 3 * THICKNESS * unit**2


@pytest.mark.parametrize(("model", "edge"), EDGES)
def test_frames_are_seen_from_one_side(model, edge):
    """Balls move little from frame to frame: no frame is turned by itself."""
    frames = 13
    limit = edge.length / (frames - 1) + 1e-3
    shown = [
        np.array([p.get_extents().min for p, _ in pieces(a) if p.codes is not None])
        for a in draw_motion(model, edge.polyline, frames).axes
    ]
    for one, other in pairwise(shown):
        apart = np.linalg.norm(one[:, None] - other, axis=-1).min(axis=1)
        assert apart.max() < limit + 0.05

"""Figures of landscapes: trees of known shape, maps of the plane, films of routes."""

import math
from math import inf

import numpy as np
import pytest
from landscape_values import WELLS, a_pass, double_well, minimum, random_tree, route, tree
from matplotlib.collections import LineCollection
from PIL import Image

from polycorner import Manifold, Polyhedron
from polycorner.landscapes import Landscape, Route
from polycorner.minimisation.problem import pose
from polycorner.pictures import draw_barcode, draw_landscape, draw_landscape_map, film_route, save
from polycorner.pictures.landscape_maps import evenly
from polycorner.pictures.trees import tree_of
from polycorner.polyhedra import Bar, Nerve


def components(energies, joins, height):
    """Return the sets of leaves below a height, those that are joined there together."""
    alive = [{k} for k, e in enumerate(energies) if e <= height]
    for energy, sides, _ in joins:
        if energy <= height:
            met = [part for part in alive if part & set(sides)]
            alive = [part for part in alive if part not in met] + [set().union(*met)]
    return sorted(map(sorted, alive))


def crossed(found, height):
    """Return the leaves of the stems that a horizontal line crosses."""
    return sorted(sorted(s.leaves) for s in found.stems if s.low <= height < s.high)


def joins_of(landscape):
    return [(p.energy[1], [s.minimum for s in p.sides], {}) for p in landscape.passes]


@pytest.mark.parametrize("seed", range(20))
def test_a_line_at_any_height_crosses_the_components_below_it(seed):
    landscape = random_tree(9, seed)
    energies = [m.energy[0] for m in landscape.minima]
    found = tree_of(landscape)
    for height in np.linspace(-0.1, 2.2, 60):
        assert crossed(found, height) == components(energies, joins_of(landscape), height)


@pytest.mark.parametrize("seed", range(20))
def test_lines_do_not_cross(seed):
    found = tree_of(random_tree(12, seed))
    for bar in found.bars:
        height = bar.merge.energy[1]
        passed = [
            s for s in found.stems if bar.left < s.across < bar.right and s.low < height < s.high
        ]
        assert passed == []
    assert sorted(found.places.values()) == list(range(12))


def test_components_that_are_not_joined_stand_apart():
    found = tree_of(tree([0, 0.1, 0.2], [(0.5, (0, 2), {})]))
    assert [bar.merge.number for bar in found.bars] == [0]
    apart = abs(found.places[1] - np.array([found.places[0], found.places[2]]))
    assert apart.min() > 1
    assert crossed(found, 10) == [[0, 2], [1]]


def test_each_component_that_leaves_the_region_has_a_way_out():
    exits = [(0.6, (1, 2), {}), (0.8, (0, -1), {"kind": "exit"}), (0.9, (1, -1), {"kind": "exit"})]
    found = tree_of(tree([0, 0.1, 0.2], [*exits, (1.0, (0, 1), {})], region=True))
    assert [bar.merge.number for bar in found.bars] == [0, 3]
    ways = {way.number: (way.energy[1], way.across) for way in found.exits}
    assert ways == {1: (0.8, found.places[0]), 2: (0.9, (found.places[1] + found.places[2]) / 2)}


def test_a_way_out_over_another_minimum_is_drawn_there():
    joins = [(0.6, (0, 1), {}), (0.5, (1, -1), {"kind": "exit"})]
    found = tree_of(tree([0, 0.1], joins, region=True))
    (only,) = found.exits
    assert (only.number, only.energy[1], only.across) == (1, 0.5, found.places[1])


def test_a_cage_has_no_way_out():
    assert tree_of(tree([0, 0.1], [(0.6, (0, 1), {})], region=True)).exits == ()


def placements(axes, point):
    axes.plot([0, point[0]], [0, 1], "o-")


LONG = [f"the minimum with number {k}" for k in range(5)]
FIVE = tree(
    [0, 0.1, 0.1, 0.3, 0.5],
    [
        (0.6, (1, 2), {}),
        (0.8, (0, 1), {"kind": "tip"}),
        ((0.9, 1.0), (3, 0), {}),
        (1.2, (4, 3), {"verified": False}),
        (0.7, (1, 2), {}),
    ],
)


@pytest.mark.parametrize(
    ("landscape", "options"),
    [
        (double_well(), {"pictures": placements, "names": ["left", "right"]}),
        (tree([0.3], []), {}),
        (Landscape(WELLS, (), (), True), {}),
        (FIVE, {"pictures": placements, "loops": True, "names": LONG, "title": "Five"}),
        (random_tree(30), {}),
        (random_tree(30, 1), {"pictures": placements, "height": np.sqrt}),
        (tree([0, 1], [((-inf, inf), (), {"kind": "undecided"})], cap=2.0), {}),
        (tree([0, 1], [(1.5, (0, None), {})], proved=False), {"loops": True}),
        (tree([-2.0, -2.0], [(-1.0, (0, 1), {"kind": "locus"})]), {"loops": True}),
    ],
)
def test_figures_can_be_drawn(landscape, options, tmp_path):
    figure = draw_landscape(landscape, **options)
    axes = figure.axes[0]
    shown = [text.get_text() for text in figure.texts]
    count = len(landscape.minima)
    assert shown[:count] == list(options.get("names", map(str, range(count))))
    low, high = axes.get_ylim()
    height = options.get("height", float)
    assert all(low <= height(e) <= high for m in landscape.minima for e in m.energy)
    with Image.open(save(figure, tmp_path / "tree.png")) as picture:
        assert picture.size[0] < 4000


def test_thousands_of_undecided_passes_are_a_few_bands():
    ends = np.random.default_rng(0).uniform(0.5, 0.8, 3000).tolist()
    boxes = [((e, e + 0.1), (), {"kind": "undecided"}) for e in [*ends, 2.0]]
    figure = draw_landscape(tree([0, 0.1], [(1.2, (0, 1), {}), *boxes]))
    bands = [patch.get_extents() for patch in figure.axes[0].patches if patch.get_hatch()]
    inverse = figure.axes[0].transData.inverted()
    found = sorted(tuple(inverse.transform_bbox(band).intervaly) for band in bands)
    assert np.array(found) == pytest.approx(np.array([[min(ends), max(ends) + 0.1], [2.0, 2.1]]))


def test_texts_lie_inside_the_figure():
    figure = draw_landscape(FIVE, names=LONG, pass_names=["a rather long name of a pass"] * 5)
    figure.draw_without_rendering()
    whole = figure.bbox.padded(1)
    for text in figure.texts:
        box = text.get_window_extent()
        assert whole.x0 <= box.x0
        assert box.x1 <= whole.x1
        assert whole.y0 <= box.y0


def test_images_of_one_pass_are_listed_once():
    four = [(0.5, (k, k + 1), {"orbit": 0}) for k in range(3)]
    figure = draw_landscape(tree([0, 0, 0, 0], four))
    assert [t.get_text() for t in figure.texts][4:] == ["pass 0  0.5"]


@pytest.mark.parametrize(
    ("names", "error"), [(["a"], ValueError), ("ab", TypeError), ([1, 2], TypeError)]
)
def test_another_number_of_names_is_refused(names, error):
    for draw in (draw_landscape, lambda it, **more: draw_landscape_map(it, (-2, 2, -2, 2), **more)):
        with pytest.raises((error, ValueError), match=r"^names: expected "):
            draw(double_well(), names=names)


def test_a_map_shows_minima_passes_and_routes(tmp_path):
    landscape = double_well()
    figure = draw_landscape_map(landscape, (-2, 2, -2, 2), pass_names=["ridge"])
    (axes,) = figure.axes
    points = [line.get_xydata() for line in axes.lines]
    ends = [landscape.passes[0].sides[k].route.vertices for k in (0, 1)]
    for expected in (*ends, *(one.point[None] for one in landscape.minima)):
        assert any(p.shape == expected.shape and (p == expected).all() for p in points)
    assert {t.get_text() for t in axes.texts} == {"0", "1", "ridge"}
    assert save(figure, tmp_path / "map.png").stat().st_size > 10_000


def test_a_map_is_refused_where_there_is_no_plane():
    space = Manifold.euclidean("x y z")
    x, y, z = space.symbols
    ball = pose(Polyhedron(space, [1 - x**2 - y**2 - z**2]), z)
    with pytest.raises(ValueError, match=r"^polyhedron: expected two coordinates"):
        draw_landscape_map(Landscape(ball, (), (), True), (-1, 1, -1, 1))


def test_undecided_passes_are_drawn_over_the_plane():
    open_pass = a_pass((0, 0), (0.5, 1.5), (), kind="undecided", index=None)
    landscape = Landscape(WELLS, (minimum((-1, 0), -0.1),), (open_pass,), True)
    figure = draw_landscape_map(landscape, (-2, 2, -2, 2))
    assert any(line.get_marker() == "x" for line in figure.axes[0].lines)


def test_points_of_a_film_are_equally_far_apart():
    manifold = Manifold(("x", "y"), (inf, inf), (2.0, 1.0))
    way = Route(np.array([[0, 0], [1e-9, 0], [4, 0], [4, 6.0]]), np.zeros(4), 0.0, True)
    points = evenly(way, manifold, 17)
    steps = np.linalg.norm(np.diff(points, axis=0) / [2.0, 1.0], axis=1)
    assert steps == pytest.approx(np.full(16, 0.5))
    assert points[[0, 4, -1]] == pytest.approx(np.array([[0, 0], [4, 0], [4, 6]]))


def test_a_film_shows_the_whole_route(tmp_path):
    landscape, seen = double_well(), []
    way = landscape.barrier(0, 1).route

    def seeing(axes, point):
        seen.append(point)
        placements(axes, point)

    path = film_route(landscape, way, tmp_path / "way.gif", seeing, frames=5)
    with Image.open(path) as film:
        assert film.n_frames == 5
    assert np.array(seen)[[0, -1]] == pytest.approx(way.vertices[[0, -1]])


def test_a_film_in_another_format_is_refused(tmp_path):
    landscape = double_well()
    with pytest.raises(ValueError, match=r"^path: expected a file name that ends in \.mp4 or"):
        film_route(landscape, route([[0, 0], [1, 0]]), tmp_path / "way.avi", placements)
    with pytest.raises(ValueError, match=r"^frames: expected "):
        film_route(landscape, route([[0, 0], [1, 0]]), tmp_path / "w.gif", placements, frames=1)


# ----------------------------------------------------------------------------------------- barcodes


def test_bars_go_from_birth_to_death():
    bars = (Bar(0, math.inf, -math.inf), Bar(0, 2.0, 1.0), Bar(1, 1.5, -math.inf))
    (axes,) = draw_barcode(Nerve(np.zeros(0), np.zeros(0), bars), "size").axes
    drawn = [c for c in axes.collections if isinstance(c, LineCollection)]
    ends = [segment[:, 0].tolist() for some in drawn for segment in some.get_segments()]
    left, right = axes.get_xlim()
    assert ends == [[left, right], [1.0, 2.0], [left, 1.5]]
    assert left < 1
    assert right > 2
    assert [line.get_xdata()[0] for line in axes.lines] == [2.0, 1.5, 1.0]


def test_what_is_refused():
    with pytest.raises(TypeError, match="nerve: expected a Nerve"):
        draw_barcode(1)

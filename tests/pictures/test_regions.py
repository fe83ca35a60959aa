"""Pictures of planar polyhedra show the region, its corners and its rests where they are."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, skeleton
from polycorner.models.planar import Tutorial
from polycorner.pictures.regions import MINIMA, SHADE, draw_region
from polycorner.pictures.style import save

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
# A square from which a quadrant is cut out: six corners, one of them concave.
ELL = Polyhedron(PLANE, AllOf(X, Y, 2 - X, 2 - Y, AnyOf(1 - X, 1 - Y)))
CONVEX = [(0, 0), (2, 0), (2, 1), (1, 2), (0, 2)]
CONCAVE = (1, 1)
BOUNDS = (-0.5, 2.5, -0.4, 2.4)
REGION = Tutorial()


def rendered(figure):
    """Return the canvas and its pixels, row 0 at the bottom, between 0 and 1."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas, np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255


def pixel(figure, pixels, point):
    column, row = figure.axes[0].transData.transform(point)
    return pixels[int(row), int(column)]


def colour_counts(pixels, colour):
    return int((abs(pixels - to_rgb(colour)).max(axis=-1) < 0.02).sum())


@pytest.mark.parametrize(
    ("polyhedron", "bounds"), [(ELL, BOUNDS), (REGION.polyhedron, (-4, 4, -3, 3.4))]
)
def test_the_region_is_shaded_and_nothing_else(polyhedron, bounds):
    figure = draw_region(polyhedron, bounds, resolution=300)
    _, pixels = rendered(figure)
    left, right, bottom, top = bounds
    span = max(right - left, top - bottom)
    low, high = (left + span / 50, bottom + span / 50), (right - span / 50, top - span / 50)
    points = np.random.default_rng(0).uniform(low, high, (2000, 2))
    ring = span / 200 * np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0, 6.28, 40)])
    for point in points:
        inside = polyhedron.contains(point + ring)
        if inside.all() or not inside.any():
            shade = to_rgb(SHADE) if inside.all() else (1, 1, 1)
            np.testing.assert_allclose(pixel(figure, pixels, point), shade, atol=0.01)


def test_the_boundary_is_the_zero_contour_unless_edges_are_given():
    plain = draw_region(ELL, BOUNDS, resolution=100).axes[0]
    assert len(plain.collections) == 2
    assert not plain.lines
    line = np.array([[0, 0], [2, 0]])
    drawn = draw_region(ELL, BOUNDS, edges=[line, ("bottom", line)], resolution=100).axes[0]
    assert len(drawn.collections) == 1
    for curve in drawn.lines:
        np.testing.assert_array_equal(curve.get_xydata(), line)
    assert [text.get_text() for text in drawn.texts] == ["bottom"]


def test_corners_are_full_where_convex_and_hollow_where_concave():
    points = [*CONVEX, CONCAVE]
    figure = draw_region(ELL, BOUNDS, corners=[("", p) for p in points], resolution=100)
    full, hollow = figure.axes[0].lines
    assert (full.get_markerfacecolor(), hollow.get_markerfacecolor()) == ("black", "white")
    np.testing.assert_array_equal(full.get_xydata(), CONVEX)
    np.testing.assert_array_equal(hollow.get_xydata(), [CONCAVE])
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "locally convex corner",
        "locally concave corner",
    ]


def test_one_kind_of_corner_needs_no_legend():
    figure = draw_region(ELL, BOUNDS, corners=[("", p) for p in CONVEX], resolution=100)
    assert not figure.legends
    assert len(figure.axes[0].lines) == 1


def test_labels_are_outside_and_keep_off_each_other():
    """Every letter of the tutorial is wholly outside the region and overlaps no other label."""
    corners, sides = REGION.corners(), REGION.sides()
    figure = draw_region(
        REGION.polyhedron,
        (-3.9, 4.1, -3.2, 3.5),
        corners=list(corners.items()),
        edges=list(sides.items()),
    )
    canvas, _ = rendered(figure)
    axes = figure.axes[0]
    assert [text.get_text() for text in axes.texts] == [*sides, *corners]
    boxes = [text.get_window_extent(canvas.get_renderer()) for text in axes.texts]
    for box in boxes:
        u, v = np.meshgrid(np.linspace(box.x0, box.x1, 9), np.linspace(box.y0, box.y1, 9))
        inside = axes.transData.inverted().transform(np.stack([u.ravel(), v.ravel()], axis=-1))
        assert not REGION.polyhedron.contains(inside).any()
        assert sum(box.overlaps(other) for other in boxes) == 1
    outline = axes.transData.transform(np.vstack([*sides.values()]))
    for box in boxes:
        assert not box.count_contains(outline)
        centre = np.array([(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2])
        assert np.linalg.norm(outline - centre, axis=1).min() < 60


def test_minima_are_coloured_by_label_and_explained_below():
    found = [("low", (0, 0)), ("", (2, 1)), ("low", (2, 0)), ("high", (0, 2))]
    figure = draw_region(ELL, BOUNDS, minima=found, resolution=100)
    drawn = {line.get_label(): line for line in figure.axes[0].lines}
    np.testing.assert_array_equal(drawn["low"].get_xydata(), [(0, 0), (2, 0)])
    np.testing.assert_array_equal(drawn["high"].get_xydata(), [(0, 2)])
    assert len({line.get_color() for line in drawn.values()}) == 3
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["low", "high"]
    _, pixels = rendered(figure)
    assert colour_counts(pixels, MINIMA[0]) > 20


def test_axes_are_named_after_coordinates_and_true_to_scale():
    figure = draw_region(ELL, BOUNDS, title="an L", resolution=100)
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_title()) == ("x", "y", "an L")
    assert (*axes.get_xlim(), *axes.get_ylim()) == BOUNDS
    rendered(figure)
    one, two = axes.transData.transform([(0, 0), (1, 1)])
    np.testing.assert_allclose(*(two - one), rtol=1e-9)


def test_a_view_without_boundary_is_drawn_too(tmp_path):
    for bounds in ((0.2, 0.4, 0.2, 0.4), (5, 6, 5, 6)):
        path = save(draw_region(ELL, bounds, resolution=20), tmp_path / "part.png")
        assert path.read_bytes().startswith(b"\x89PNG")


# ------------------------------------------------------------------------------------- skeletons

ONE, TWO = (X + 1) ** 2 + Y**2 - 1, (X - 1) ** 2 + Y**2 - 1
TOUCHING = {
    "two discs outside": ({"one": ONE, "two": TWO, "rim": 6 - X**2 - Y**2}, (0, 0)),
    "a crescent": ({"rim": 4 - X**2 - Y**2, "two": TWO}, (2, 0)),
    "a cusp": ({"floor": Y, "curve": X**2 - Y, "left": X, "right": 2 - X}, (0, 0)),
    "a thin cusp": ({"floor": Y, "curve": X**3 - Y, "right": 2 - X}, (0, 0)),
}


@pytest.mark.parametrize("name", TOUCHING)
def test_corners_where_sides_touch_are_shown_as_such(name):
    functions, touching = TOUCHING[name]
    figure = draw_region(
        Polyhedron(PLANE, functions), (-3, 3, -3, 4), corners=[("T", touching)], resolution=100
    )
    (mark,) = [line for line in figure.axes[0].lines if line.get_linestyle() == "None"]
    assert mark.get_marker() == "D"
    assert mark.get_markerfacecolor() not in ("black", "white")
    np.testing.assert_array_equal(mark.get_xydata(), [touching])


@pytest.mark.parametrize("name", TOUCHING)
def test_the_name_of_a_tangential_corner_is_outside(name):
    functions, touching = TOUCHING[name]
    region = Polyhedron(PLANE, functions)
    figure = draw_region(region, (-3, 3, -3, 4), corners=[("T", touching)], resolution=100)
    canvas, _ = rendered(figure)
    (text,) = figure.axes[0].texts
    box = text.get_window_extent(canvas.get_renderer())
    middle = (
        figure.axes[0]
        .transData.inverted()
        .transform([(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2])
    )
    assert not region.contains(middle)


def test_a_skeleton_labels_itself():
    rng = np.random.default_rng(0)
    found = skeleton(ELL, np.array([[0.5, 0.5]]), rng=rng)
    axes = draw_region(found, resolution=100).axes[0]
    left, right = axes.get_xlim()
    assert left < 0
    assert right > 2
    seen = {text.get_text(): text.xy for text in axes.texts}
    for k, corner in enumerate(found.corners):
        np.testing.assert_array_equal(seen[f"C{k}"], corner.point)
    assert {text for text in seen if text[0] == "f"} == {f"f{k}" for k in range(1, 7)}
    # A full circle for each convex corner, a hollow one for the other.
    marks = [line for line in axes.lines if line.get_linestyle() == "None"]
    assert [len(line.get_xydata()) for line in marks] == [5, 1]


def test_a_polyhedron_needs_bounds_and_a_skeleton_does_not():
    with pytest.raises(ValueError, match="bounds: expected left, right, bottom and top"):
        draw_region(ELL)

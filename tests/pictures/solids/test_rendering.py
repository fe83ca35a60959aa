"""Pictures of solids tell front from back, and show what they are given."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from examples import ex05_solid
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.placements import forbidden_solid
from polycorner.pictures.solids import rendering
from polycorner.pictures.solids.meshes import isosurface
from polycorner.pictures.solids.rendering import View, draw_solid, place_solid, visible
from polycorner.pictures.style import save

TAU = math.tau
PAIR = DumbbellPair(16, 3, 1.5)
few = settings(max_examples=max(5, settings.default.max_examples // 5), deadline=None)
CUBE = View(elevation=35.0, azimuth=20.0, factors=(1.0, 1.0, 1.0), height=1.0)
NAMES = ("x", "y", "z")


def to_eye(view):
    e, a = math.radians(view.elevation), math.radians(view.azimuth)
    return np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])


@pytest.fixture(scope="module")
def ball():
    return isosurface(lambda p: np.linalg.norm(p, axis=-1) - 1, [(-1.2, 1.2)] * 3, 24).mesh


@few
@given(st.floats(-85, 85), st.floats(-180, 180), st.integers(0, 2**32 - 1))
@example(0.0, 148.0, 133)  # a pixel of the silhouette on the border of the raster
def test_a_ball_shows_the_half_that_faces_the_eye(ball, elevation, azimuth, seed):
    view = View(elevation, azimuth, (1.0, 1.0, 1.0), 1.0)
    points = np.random.default_rng(seed).normal(size=(300, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    height = points @ to_eye(view)
    aside = np.linalg.norm(np.cross(points, to_eye(view)), axis=1)
    nowhere = np.full((1, 3), np.nan)
    seen = visible(ball, np.concatenate([points, 3 * points, nowhere]), view)
    on, off, none = np.split(seen, [300, 600])
    clear = abs(height) > 0.2
    np.testing.assert_array_equal(on[clear], (height > 0)[clear])
    # Three times as far away, what the ball hides is a cylinder behind it.
    clear = abs(3 * aside - 1) > 0.1
    np.testing.assert_array_equal(off[clear], ((height > 0) | (3 * aside > 1))[clear])
    assert not none.any()


def test_a_coarse_mesh_hides_too():
    """Eight corners of a cube seen from one corner: the opposite one is hidden."""
    signs = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
    cube = SimpleNamespace(vertices=signs, faces=faces)
    assert visible(cube, signs, CUBE).tolist() == [False, *[True] * 7]
    # Points on the three faces at the back, close to edges in sight.
    near = [(-1, 0.8, 0), (-1, 0, 0.8), (0, -1, 0.8), (0.8, -1, 0), (0.8, 0, -1), (0, 0.8, -1)]
    assert not visible(cube, near, CUBE).any()


def test_a_figure_tells_front_from_back(ball):
    angle = np.linspace(0, TAU, 721)
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    upright = circle[:, [0, 2, 1]]
    eye = to_eye(CUBE)
    figure = draw_solid(
        ball,
        [("level", circle), ("upright", upright), ("level", circle / 2)],
        [eye, -eye],
        ["near", "far"],
        view=CUBE,
        names=NAMES,
    )
    axes = figure.axes[0]
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["level", "upright"]
    lines = [(line, np.array(line.get_data_3d()).T) for line in axes.lines]
    dashed = [points for line, points in lines if line.get_linestyle() == "--"]
    full = [points for line, points in lines if line.get_linestyle() == "-"]
    for curve, front, back in zip((circle, upright), full, dashed, strict=False):
        height = curve @ eye
        shown, hidden = (np.isfinite(part).all(axis=1) for part in (front, back))
        assert shown[height > 0.2].all()
        assert not shown[height < -0.2].any()
        assert hidden[height < -0.2].all()
        assert (shown | hidden).all()
        # Every change from front to back is joined.
        assert (shown & hidden).sum() == np.diff(shown.astype(int)).astype(bool).sum() > 0
    assert not np.isfinite(full[2]).any()
    markers = [line.get_markerfacecolor() for line, _ in lines if line.get_marker() == "o"]
    assert markers == ["black", "white"]
    assert [text.get_text().strip() for text in axes.texts] == ["near", "far"]
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()) == NAMES


def test_a_curve_that_flickers_changes_side_once():
    """Inverted edges lie beneath the mesh here and there; sight along them is smoothed."""
    rng = np.random.default_rng(4)
    truth = np.arange(200) < 120
    seen = truth ^ (rng.random(200) < 0.2)
    assert np.diff(seen).sum() > 20
    settled = rendering._settled(seen)
    assert np.diff(settled).sum() <= 3
    assert settled[:110].all()
    assert not settled[130:].any()


def test_curves_take_the_colours_they_are_given(ball):
    axes = Figure().add_subplot(projection="3d", computed_zorder=False)
    curves = [("one", 2 * np.eye(3)), ("two", -2 * np.eye(3)), ("one", 3 * np.eye(3))]
    place_solid(axes, ball, curves, [], palette={"one": "red", "two": "blue"}, view=CUBE)
    drawn = [line for line in axes.lines if line.get_linestyle() == "-"]
    assert [line.get_color() for line in drawn] == ["red", "blue", "red"]
    assert [line.get_label()[0] for line in drawn] == ["o", "t", "_"]


def test_the_solid_is_drawn_in_millimetres_and_degrees(tmp_path):
    solid = forbidden_solid(PAIR, 40, period=math.pi)
    points, names = ex05_solid.corners()
    figure = draw_solid(
        solid.mesh, ex05_solid.edges(), points, names, caps=solid.caps, title="forbidden"
    )
    axes = figure.axes[0]
    assert axes.get_zlabel() == "relative heading (°)"
    np.testing.assert_allclose(axes.get_zlim(), (-90, 90))
    assert axes.get_xlabel() == "x (mm)"
    assert figure.get_suptitle() == "forbidden"
    assert save(figure, tmp_path / "solid.png").stat().st_size > 50_000
    full = [np.array(k.get_data_3d()).T for k in axes.lines if k.get_linestyle() == "-"]
    for (_, curve), shown in zip(ex05_solid.edges(), full, strict=True):
        seen = visible(solid.mesh, curve, View())
        # Sight is settled by a majority of nine points: away from changes and ends it is as found.
        settled = [len(set(seen[k - 4 : k + 5].tolist())) == 1 for k in range(4, len(seen) - 4)]
        assert np.mean(settled) > 0.7
        drawn = np.isfinite(shown).all(axis=1)
        np.testing.assert_array_equal(drawn[4:-4][settled], seen[4:-4][settled])
    colours = axes.collections[0].get_facecolor()[:, :3]
    # The cut is yellowish, the surface bluish; both are in sight, faces at the back left out.
    assert {bool(c[0] > c[2]) for c in colours} == {True, False}
    assert 0.3 < len(colours) / len(solid.mesh.faces) < 0.75


def test_shading_is_smooth_within_parts_and_sharp_between_them():
    """A roof of two strips: with parts, two colours; without, they run into each other."""
    along, across = np.meshgrid(np.linspace(0, 1, 21), np.linspace(-1, 1, 21), indexing="ij")
    height = -0.3 * abs(across)
    vertices = np.stack([along, across, height], axis=-1).reshape(-1, 3)
    node = np.arange(441).reshape(21, 21)
    a, b, c, d = (n.ravel() for n in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    side = (vertices[faces][..., 1].mean(axis=1) > 0).astype(int)

    def shades(**more):
        mesh = SimpleNamespace(vertices=vertices, faces=faces, **more)
        view = View(elevation=70, azimuth=20, factors=(1, 1, 1), height=0.3)
        drawn = draw_solid(mesh, view=view).axes[0].collections[0]
        return {tuple(row) for row in np.round(drawn.get_facecolor(), 6).tolist()}

    assert len(shades(face_attributes={"part": side})) == 2
    assert len(shades()) > 2

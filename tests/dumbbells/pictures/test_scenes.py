"""Scenes in three dimensions: balls where the model has them, contacts between surfaces, files."""

import io
import math

import numpy as np
import pytest
import trimesh
from atlases import kept_atlas
from hypothesis import given
from hypothesis import strategies as st

from polycorner import minimise
from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.dumbbells.pictures import bodies as scene_bodies
from polycorner.dumbbells.pictures import scenes
from polycorner.dumbbells.pictures.placements import forbidden_solid
from polycorner.pictures.solids.meshes import painted

PLANE, DRUM = DumbbellPair(16, 3, 1.5), DumbbellPair(16, 3, 1.5, 125)
PAIRS = st.sampled_from([PLANE, DRUM, DumbbellPair(9, 2, 1.2, 15)])


def reread(scene):
    return trimesh.load_scene(io.BytesIO(scenes.glb(scene)), file_type="glb")


def from_segment(points, start, stop):
    """Return the distances of points from a segment, by its definition as a minimum over it."""
    along = np.linspace(0, 1, 20001)[:, None]
    return np.linalg.norm(start + along * (stop - start) - points, axis=1).min()


# ------------------------------------------------------------------------------------ the bodies


@pytest.mark.parametrize("pair", [PLANE, DRUM])
def test_a_file_of_a_pair_has_its_bodies_where_the_model_has_them(pair):
    corner = minimise(pair.polyhedron, pair.energy, pair.nested("R"))
    found = reread(scenes.pair_scene(pair, corner.point))
    for name, centre in zip(("A1", "A2", "B1", "B2"), pair.ball_centres(corner.point), strict=True):
        place, shape = found.graph[name]
        ball = found.geometry[shape]
        np.testing.assert_allclose(place[:3, 3], centre, atol=2e-5)  # the file has single precision
        np.testing.assert_allclose(np.linalg.norm(ball.vertices, axis=1), 3, rtol=1e-5)
        assert 0.98 < ball.volume / (4 / 3 * math.pi * 3**3) < 1
    for name, ends in zip("ab", pair.ball_centres(corner.point).reshape(2, 2, 3), strict=True):
        place, shape = found.graph[name]
        rod = found.geometry[shape]
        assert rod.volume == pytest.approx(32 / 2 * math.sin(math.tau / 32) * 1.5**2 * 16, rel=1e-5)
        tips = [(place @ [0, 0, z, 1])[:3] for z in (-8, 8)]
        np.testing.assert_allclose(tips, ends, atol=5e-5)
    marked = {n.removeprefix("contact ") for n in found.graph.nodes_geometry if "contact" in n}
    assert marked == set(corner.active) == {"A2B1", "A2b", "aB1"}


@given(PAIRS, st.integers(0, 2**32 - 1), st.sampled_from(PLANE.polyhedron.names))
def test_a_contact_is_half_the_gap_from_either_surface(pair, seed, name):
    q = pair.placements(np.random.default_rng(seed), 1)[0]
    gap = dict(zip(pair.polyhedron.names, pair.polyhedron.values(q), strict=True))[name]
    a1, a2, b1, b2 = centres = pair.ball_centres(q)
    place = scene_bodies.contact_point(pair, centres, name)
    bodies = {"a": (a1, a2), "b": (b1, b2)}
    bodies |= dict(zip(("A1", "A2", "B1", "B2"), ((c, c) for c in centres), strict=True))
    one = name[:2] if name[0] == "A" else "a"
    for body in (one, name.removeprefix(one)):
        thick = pair.rod_radius if body in "ab" else pair.ball_radius
        away = from_segment(place, *bodies[body])
        assert away == pytest.approx(thick + gap / 2, abs=1e-6)


def test_contacts_of_overlapping_bodies_are_in_the_overlap():
    centres = np.array([[0, 0, 0], [0, 16, 0], [4, 0, 0], [4, 16, 0]], dtype=float)
    np.testing.assert_allclose(scene_bodies.contact_point(PLANE, centres, "A1B1"), [2, 0, 0])
    centres[2] = centres[0]
    assert np.isfinite(scene_bodies.contact_point(PLANE, centres, "A1B1")).all()


def test_dumbbells_of_a_drum_and_one_that_has_left():
    drum = DumbbellDrum(count=3)
    q = np.array([[0, 0, 0.1, 0], [math.nan] * 4, [0.2, 60, 0, 0]])
    found = reread(scenes.drum_scene(drum, q))
    names = {name for name in found.graph.nodes_geometry if name[0].isdigit()}
    assert names == {"1", "1.1", "1.2", "3", "3.1", "3.2"}
    expected = drum.pair.ball_centres(np.concatenate([q[0, :3], q[2, :3]]))
    places = [found.graph[name][0][:3, 3] for name in ("1.1", "1.2", "3.1", "3.2")]
    np.testing.assert_allclose(places, expected, atol=2e-5)


# -------------------------------------------------------------------------------------- the wall


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5))
def test_the_wall_is_below_every_ball(phi, theta):
    q = np.array([phi, 4.0, theta, phi + 0.2, 30.0, -theta])
    centres = DRUM.ball_centres(q)
    wall = scene_bodies.wall_around(DRUM, centres)
    middle = sum(wall.across) / 2
    for x, y, z in centres:
        azimuth = middle + math.remainder(math.atan2(x, -z) - middle, math.tau)
        assert wall.across[0] < azimuth < wall.across[1]  # also over the top of the drum
        assert wall.along[0] < y < wall.along[1]
        assert math.dist(wall.points(azimuth, y), (x, y, z)) == pytest.approx(3)


def test_the_wall_of_many_is_at_most_once_around():
    q = np.zeros((40, 3))
    q[:, 0] = np.linspace(-3, 3, 40)
    wall = scene_bodies.wall_around(DRUM, scene_bodies.dumbbell_centres(DRUM, q))
    assert wall.across[1] - wall.across[0] <= math.tau
    mesh = scenes.wall_mesh(wall)
    np.testing.assert_allclose(np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2]), 125)
    inward = -np.einsum("ij,ij->i", mesh.face_normals[:, [0, 2]], mesh.triangles_center[:, [0, 2]])
    assert (inward > 0).all()


def test_the_wall_of_the_plane_is_a_ball_radius_below():
    wall = scene_bodies.wall_around(PLANE, PLANE.ball_centres(PLANE.nested("R")))
    mesh = scenes.wall_mesh(wall)
    assert set(mesh.vertices[:, 2]) == {-3}
    assert (mesh.face_normals[:, 2] == 1).all()


# ------------------------------------------------------------------------------------- the atlas


def test_a_tube_is_closed_and_as_thick_as_it_should_be():
    straight = scenes.tube([[0, 0, 0], [0, 0, 3], [0, 0, 3], [0, 0, 10]], 0.5, "#000000")
    assert straight.is_watertight
    assert straight.volume == pytest.approx(12 / 2 * math.sin(math.tau / 12) * 0.5**2 * 10)
    angle = np.linspace(0, 1.5 * math.pi, 300)
    bent = scenes.tube(np.stack([np.cos(angle), np.sin(angle), angle], -1), 0.1, "#ffffff")
    assert bent.is_watertight
    length = 1.5 * math.pi * math.sqrt(2)
    assert bent.volume == pytest.approx(6 * math.sin(math.tau / 12) * 0.01 * length, rel=1e-3)


@pytest.fixture(scope="module")
def atlas():
    return kept_atlas(DumbbellPair(7, 3, 1.5))  # the rods are short: eight corners


def test_an_atlas_has_its_solid_edges_and_corners(atlas):
    found = reread(scenes.atlas_scene(atlas, resolution=24))
    solid = forbidden_solid(atlas.pair, 24, period=math.pi)
    assert found.geometry["solid"].volume == pytest.approx(solid.volume * 7 / 2, rel=1e-4)
    names = list(found.graph.nodes_geometry)
    marks = [name for name in names if name.startswith("corner ")]
    # Half a turn of B exchanges its balls: of two labelled corners one is in half a turn of delta.
    assert len(marks) == len(atlas.skeleton.corners) / 2 == 4
    low, high = found.geometry["solid"].bounds
    for name in marks:
        place = found.graph[name][0][:3, 3]
        assert (low - 0.5 < place).all()
        assert (place < high + 0.5).all()
        gap = atlas.pair.polyhedron.implicit([0, 0, 0, *(place / [1, 1, 7 / 2])])
        assert abs(gap) < 1e-5
    assert any(name.startswith("edge ") for name in names)
    for shape in found.geometry.values():
        shape.merge_vertices(merge_norm=True, merge_tex=True)
        assert shape.is_watertight


def test_caps_and_creases_of_the_solid_are_shaded_sharply():
    solid = forbidden_solid(PLANE, 24, period=math.pi)
    mesh = scenes.solid_mesh(solid.mesh, np.ones(3))
    upright = abs(mesh.vertex_normals[mesh.faces[solid.caps]][..., 2])
    np.testing.assert_allclose(upright, 1, atol=1e-9)


def test_the_solid_alone_is_the_same_one():
    for pair, heading, period in ((PLANE, None, math.pi), (DRUM, 0.2, math.tau)):
        content = scenes.solid_bytes(pair, mean_heading=heading, resolution=16)
        found = trimesh.load_scene(io.BytesIO(content), file_type="glb").geometry["solid"]
        solid = forbidden_solid(pair, 16, period=period, mean_heading=heading)
        assert found.volume == pytest.approx(8 * solid.volume, rel=1e-4)


def test_colours_of_a_file_are_linear_light(tmp_path):
    """Half of full sRGB is 21.4 per cent of the light."""
    made = painted(trimesh.creation.box(), "#808080")
    assert made.visual.material.baseColorFactor[:3].tolist() == [55, 55, 55]
    path = scenes.write_scene(trimesh.Scene(made), tmp_path / "new" / "box.glb")
    assert path.read_bytes()[:4] == b"glTF"

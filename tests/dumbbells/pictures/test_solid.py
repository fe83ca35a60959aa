"""The atlas drawn over the solid: its curves lie on the solid's surface, and both agree."""

import json
import math

import numpy as np
import pytest
import trimesh
from atlases import kept_atlas

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.placements import (
    forbidden_solid,
    relative_coordinates,
    relative_gap,
    relative_placements,
)
from polycorner.dumbbells.pictures.solid import (
    relative_corners,
    relative_curves,
    solid_facts,
    write_solid,
)

CASES = {
    "plane": (math.inf, 16.0, None),
    "plane, short rods": (math.inf, 7.0, None),
    "drum": (125.0, 16.0, 0.3),
}


@pytest.fixture(scope="module", params=CASES)
def atlas(request):
    drum, length, heading = CASES[request.param]
    pair = DumbbellPair(length=length, ball_radius=3, rod_radius=1.5, drum_radius=drum)
    return kept_atlas(pair, heading or 0.0)


def period(atlas):
    return math.pi if atlas.heading is None else math.tau


def test_edges_and_corners_lie_on_the_surface(atlas):
    gap = relative_gap(atlas.pair, mean_heading=atlas.heading)
    corners, letters = relative_corners(atlas, period(atlas))
    assert len(corners) == len(letters) > 0
    points = np.vstack([corners, *(line for _, line in relative_curves(atlas, period(atlas)))])
    np.testing.assert_allclose(gap(points), 0.0, atol=1e-9)
    assert abs(points[:, 2]).max() <= period(atlas) / 2 + 1e-12


def test_every_edge_is_there_once(atlas):
    """In the plane, balls of B being alike, half of the labelled edges are images of the others."""
    curves = relative_curves(atlas, period(atlas))
    middles = np.array([line[len(line) // 2] for _, line in curves])
    apart = np.linalg.norm(middles[:, None] - middles, axis=-1) + 1e3 * np.eye(len(middles))
    assert apart.min() > 0.1
    whole = [line for _, line in curves if abs(line[[0, -1], 2]).max() < period(atlas) / 2 - 0.1]
    if atlas.heading is None:
        ends = {tuple(np.round(line[k], 6)) for line in whole for k in (0, -1)}
        corners, _ = relative_corners(atlas, period(atlas))
        assert ends <= {tuple(np.round(corner, 6)) for corner in corners}
        assert 2 * len(corners) == len(atlas.skeleton.corners)


def test_edges_that_leave_the_period_reach_its_end(atlas):
    """Each comes in again at the other end; in the plane moved by half a turn about A."""
    half = period(atlas) / 2
    ends = np.array([line[k] for _, line in relative_curves(atlas, 2 * half) for k in (0, -1)])
    corners, _ = relative_corners(atlas, 2 * half)
    loose = np.linalg.norm(ends[:, None] - corners, axis=-1).min(axis=1) > 1e-6
    np.testing.assert_allclose(abs(ends[loose, 2]), half, atol=1e-12)
    if atlas.heading is None:
        assert loose.sum() == 2 * len(corners)
        low, high = (ends[loose & (s * ends[:, 2] > 0)][:, :2] for s in (-1, 1))
        assert np.linalg.norm(low[:, None] - high, axis=-1).min(axis=1).max() < 1e-9


def test_edges_are_named_as_asked(atlas):
    names = {name for name, _ in relative_curves(atlas, period(atlas), "+".join)}
    assert names <= {"+".join(edge.active) for edge in atlas.skeleton.edges}
    words = {name for name, _ in relative_curves(atlas, period(atlas))}
    assert words <= {"ball on ball twice", "ball on ball, ball on rod", "two balls on rods"}


def test_hands_are_those_of_the_corners(atlas):
    points, names = relative_corners(atlas, period(atlas), hands=True)
    plain = relative_corners(atlas, period(atlas))[1]
    for point, name, letter in zip(points, names, plain, strict=True):
        q = relative_placements(atlas.pair, point, mean_heading=atlas.heading)
        hand = atlas.pair.chirality(q)
        if letter.startswith("$"):
            assert name == f"{letter[:-1]}_{hand}$"
        else:
            assert name == letter


def test_mesh_and_atlas_have_the_same_euler_characteristic(atlas):
    solid = forbidden_solid(atlas.pair, 40, period=period(atlas), mean_heading=atlas.heading)
    assert solid.euler_characteristic == atlas.skeleton.euler_characteristic == 0


def test_relative_placements_come_back(atlas):
    rng = np.random.default_rng(3)
    points = rng.uniform(-1, 1, (50, 3)) * np.array([20, 20, 3])
    q = relative_placements(atlas.pair, points, mean_heading=atlas.heading)
    back = relative_coordinates(atlas.pair, q, mean_heading=atlas.heading)
    np.testing.assert_allclose(back, points, atol=1e-12)


def test_files(atlas, tmp_path):
    written = write_solid(atlas, tmp_path, resolution=24)
    assert [path.name for path in written] == ["solid.png", "solid.glb", "solid.json"]
    assert written[0].read_bytes().startswith(b"\x89PNG")
    assert written[1].read_bytes().startswith(b"glTF")
    facts = json.loads(written[2].read_text())
    scene = trimesh.load_scene(written[1])
    assert facts == {key: scene.metadata[key] for key in facts}
    stretched = atlas.pair.length / 2
    assert scene.geometry["solid"].volume == pytest.approx(stretched * facts["volume"], rel=1e-5)
    assert len(scene.geometry["solid"].faces) == facts["faces"]
    assert facts["corners"] == len(scene.geometry["points"].vertices)
    assert facts["watertight"] is True
    assert facts["unresolved"] == 0


def test_the_mesh_has_the_corners_of_the_atlas(atlas):
    """Found by walking along edges there, by marching through a grid here."""
    solid = forbidden_solid(atlas.pair, 40, period=period(atlas), mean_heading=atlas.heading)
    facts = solid_facts(solid, atlas)
    assert facts.corner_error < 1e-9
    assert facts.surface_error > 1e-4
    corners, _ = relative_corners(atlas, period(atlas))
    seam = abs(abs(corners[:, 2]) - period(atlas) / 2) < 1e-9
    inner = abs(abs(solid.corners[:, 2]) - period(atlas) / 2) > 1e-9
    assert inner.sum() == (~seam).sum()
    contacts = {names for edge in atlas.skeleton.edges for names in edge.active}
    used = {atlas.pair.polyhedron.names[k] for k in np.unique(solid.labels[solid.labels >= 0])}
    assert used == contacts

"""Motions in files of other programs, read back by other libraries or by their definition."""

import base64
import json
import struct
import sys

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    HalfSpace,
    box,
    capsule,
    compound,
    disc,
    polygon,
    polytope,
    sphere,
)
from polycorner.bodies.motions import poses_of
from polycorner.pictures import save_motion
from polycorner.pictures.pages import three_script

gsd_hoomd = pytest.importorskip("gsd.hoomd")

CUBE = polytope([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], 0.1)
DUMBBELL = compound({"1": sphere(0.5, [-1, 0, 0]), "2": sphere(0.5, [1, 0, 0])})


def tumbling():
    """A cube, a dumbbell and a rod in free flight, and a post."""
    bodies = {"Q": CUBE, "D": DUMBBELL, "R": capsule([-1, 0, 0], [1, 0, 0], 0.3)}
    post = {"post": sphere(0.5, [0, 0, 9])}
    a = Arrangement(bodies, box([-20] * 3, [20] * 3), post, orientations="all")
    q = a.point({"Q": ([0, 0, 0], Rotation.from_rotvec([1, 2, 3])), "D": [4, 0, 0], "R": [0, 5, 0]})
    v = a.velocity(q, {"Q": ([0, 0, 1], [0, 5, 2]), "D": ([1, 0, 0], [0, 0, 9]), "R": [0, 0, -1]})
    system = a.system()
    return a, simulate(system, system.state(q, v), 1.0, 0.01, every=20)


def leaving():
    """Two discs, one of which leaves; they go round a channel."""
    a = Arrangement({"A": disc(0.5)}, {"floor": HalfSpace([0, 1], [0, 0])}, period=[4, None])
    system = a.system(count=2, exits={"yA": 5.0})
    start = system.state([[1, 0.5], [3, 2]], [[7, 0], [0, 4]])
    return a, simulate(system, start, 1.0, 0.01, every=10)


# -------------------------------------------------------------------------------------------- GSD


def test_gsd_has_places_turns_velocities_and_kinds(tmp_path):
    a, path = tumbling()
    save_motion(a, path, tmp_path / "a.gsd")
    poses = poses_of(a, path)
    with gsd_hoomd.open(tmp_path / "a.gsd") as file:
        assert len(file) == len(path)
        for k, frame in enumerate(file):
            told = frame.particles
            assert told.types == ["Q", "D", "R", "post"]
            assert told.typeid.tolist() == [0, 1, 2, 3]
            assert told.body.tolist() == [0, 1, 2, -1]
            places = a.placed(path.q[k, 0])
            turned = Rotation.from_quat(told.orientation[:, [1, 2, 3, 0]])
            for number, (name, body) in enumerate(a.named.items()):
                (first, *_) = body.parts.values()
                (seen, *_) = places[name].parts.values()
                carried = turned[number].apply(first.points.copy()) + told.position[number]
                np.testing.assert_allclose(carried, seen.points, atol=1e-5)
            np.testing.assert_allclose(told.velocity[0], [0, 0, 1], atol=1e-6)
            assert frame.log["time"][0] == pytest.approx(path.times[k])
            assert (abs(told.position) < frame.configuration.box[:3] / 2).all()
        shapes = told.type_shapes
    assert [s["type"] for s in shapes] == ["ConvexPolyhedron", "SphereUnion", "Mesh", "SphereUnion"]
    assert shapes[0]["rounding_radius"] == 0.1
    np.testing.assert_allclose(shapes[0]["vertices"], CUBE.parts[""].points)
    assert len(poses) == len(path)


def test_gsd_has_images_in_a_periodic_box_and_leaves_out_who_left(tmp_path):
    a, path = leaving()
    save_motion(a, path, tmp_path / "a.gsd")
    assert not path.present[-1].all()
    with gsd_hoomd.open(tmp_path / "a.gsd") as file:
        for k, frame in enumerate(file):
            told, sides = frame.particles, frame.configuration.box[:3]
            assert frame.configuration.dimensions == 2
            assert told.body.tolist() == np.flatnonzero(path.present[k]).tolist()
            places = told.position + told.image * sides
            np.testing.assert_allclose(places[:, :2], path.q[k, told.body], atol=1e-5)
            assert (abs(told.position[:, 0]) <= 2 + 1e-6).all()
            assert sides[0] == 4
            assert told.type_shapes == [{"type": "Sphere", "diameter": 1.0}]


def test_shapes_of_the_plane(tmp_path):
    square = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.1)
    a = Arrangement({"S": square, "C": capsule([-1, 0], [1, 0], 0.3)})
    save_motion(a, [0, 0, 0, 5, 0, 0], tmp_path / "a.gsd")
    with gsd_hoomd.open(tmp_path / "a.gsd") as file:
        one, two = file[0].particles.type_shapes
    np.testing.assert_allclose(one["vertices"], square.parts[""].points)
    corners = np.array(two["vertices"])[np.array(two["indices"])]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    assert areas.sum() / 2 == pytest.approx(1.2 + np.pi * 0.09, rel=0.01)


def test_without_gsd_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "gsd", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    a = Arrangement([disc(1), disc(1)])
    with pytest.raises(ImportError, match=r"pip install 'polycorner\[gsd\]'"):
        save_motion(a, [0, 0, 3, 0], tmp_path / "a.gsd")
    assert not list(tmp_path.iterdir())


# -------------------------------------------------------------------------------------------- XYZ


def blocks(text):
    """The frames of an XYZ file: the comment and the rows."""
    lines = iter(text.splitlines())
    for count in lines:
        comment = next(lines)
        yield comment, [next(lines).split() for _ in range(int(count))]


def test_xyz_has_places_and_turns(tmp_path):
    a, path = tumbling()
    text = save_motion(a, path, tmp_path / "a.xyz").read_text()
    for k, (comment, rows) in enumerate(blocks(text)):
        assert f"Time={path.times[k]:.10g}" in comment
        assert [row[0] for row in rows] == ["Q", "D", "R", "post"]
        turn = Rotation.from_quat([float(x) for x in rows[0][4:8]])
        place = np.array([float(x) for x in rows[0][1:4]])
        seen = a.placed(path.q[k, 0])["Q"].parts[""].points
        np.testing.assert_allclose(
            turn.apply(CUBE.parts[""].points.copy()) + place, seen, atol=1e-8
        )


def test_xyz_leaves_out_who_left(tmp_path):
    a, path = leaving()
    text = save_motion(a, path, tmp_path / "a.xyz").read_text()
    assert [len(rows) for _, rows in blocks(text)] == path.present.sum(axis=1).tolist()
    assert 'pbc="T F F"' in text


# -------------------------------------------------------------------------------------------- GLB


def test_glb_stands_where_the_bodies_are(tmp_path):
    a, path = tumbling()
    save_motion(a, path.q[-1, 0], tmp_path / "a.glb")
    scene = trimesh.load(tmp_path / "a.glb")
    assert set(scene.graph.nodes_geometry) == {"Q", "D", "R", "post"}
    for name, body in a.placed(path.q[-1, 0]).items():
        place, geometry = scene.graph[name]
        seen = trimesh.transform_points(scene.geometry[geometry].vertices, place)
        low = np.min(
            [part.points.min(axis=0) - part.radius for part in body.parts.values()], axis=0
        )
        high = np.max(
            [part.points.max(axis=0) + part.radius for part in body.parts.values()], axis=0
        )
        np.testing.assert_allclose(seen.min(axis=0), low, atol=0.02)
        np.testing.assert_allclose(seen.max(axis=0), high, atol=0.02)


def test_glb_is_laid_out_as_the_format_says(tmp_path):
    a, path = tumbling()
    content = save_motion(a, path, tmp_path / "a.glb").read_bytes()
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    size, kind = struct.unpack_from("<I4s", content, 12)
    assert (size % 4, kind) == (0, b"JSON")
    told = json.loads(content[20 : 20 + size])
    rest, kind = struct.unpack_from("<I4s", content, 20 + size)
    assert (rest, kind) == (len(content) - 28 - size, b"BIN\0")
    assert told["buffers"][0]["byteLength"] == rest
    for view in told["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= rest


def test_glb_moves_as_the_bodies_do(tab, tmp_path):
    """Play the file with three.js, which is of others."""
    a, path = tumbling()
    content = save_motion(a, path, tmp_path / "a.glb").read_bytes()
    b, gone = leaving()
    other = save_motion(b, gone, tmp_path / "b.glb").read_bytes()
    (tmp_path / "page.html").write_text("<!DOCTYPE html><title>x</title>")
    tab.open(tmp_path / "page.html", width=400)
    add = (
        "(text) => document.head.append(Object.assign(document.createElement('script'), { text }))"
    )
    tab.value(f"({add})({json.dumps(three_script())})")

    def at(content, node, time):
        return tab.value(f"""new Promise((done) => {{
          const text = atob("{base64.b64encode(content).decode()}");
          const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
          new THREE.GLTFLoader().parse(bytes.buffer, "", (found) => {{
            const mixer = new THREE.AnimationMixer(found.scene);
            const action = mixer.clipAction(found.animations[0]);
            action.setLoop(THREE.LoopOnce); action.clampWhenFinished = true; action.play();
            mixer.update({time});
            const node = found.scene.getObjectByName("{node}");
            done([node.position.toArray(), node.quaternion.toArray(), node.scale.x]);
          }});
        }})""")

    for k in (0, 2, len(path) - 1):
        place, turn, _ = at(content, "Q", path.times[k])
        seen = a.placed(path.q[k, 0])["Q"].parts[""].points
        carried = Rotation.from_quat(turn).apply(CUBE.parts[""].points.copy()) + place
        np.testing.assert_allclose(carried, seen, atol=1e-4)
    assert at(other, "A_2", 0.0)[2] == 1
    assert at(other, "A_2", 0.99)[2] == 0


def test_other_suffixes_are_refused(tmp_path):
    a = Arrangement([disc(1), disc(1)])
    with pytest.raises(ValueError, match=r"path: expected a file name that ends in .glb, .gsd"):
        save_motion(a, [0, 0, 3, 0], tmp_path / "a.pdb")

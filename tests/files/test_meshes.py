"""Bodies from meshes: the same solid in every format, and refusals that say what is wrong."""

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from polycorner.bodies import capsule, mass_of, polytope
from polycorner.files import MeshOptions, read_mesh

FORMATS = ("stl", "obj", "ply", "glb", "gltf", "dae")
BRACKET = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]]


def placed(mesh, turn=(0.3, -0.4, 0.5), by=(0.1, 0.2, 0.3)):
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
    matrix[:3, 3] = by
    return mesh.apply_transform(matrix)


def write(mesh, path):
    exported = mesh.export(file_type=path.suffix[1:])
    if path.suffix == ".gltf":  # a file and its buffers
        for name, data in exported.items():
            (path if name == "model.gltf" else path.parent / name).write_bytes(data)
    else:
        path.write_bytes(exported.encode() if isinstance(exported, str) else exported)


def outcome(path):
    """Return the solid of a file, or None and the sentence that refuses it."""
    try:
        return read_mesh(path, parts="hull"), ""
    except ValueError as error:
        return None, str(error)


def bracket():
    """Return an L of height 1; its triangles are written here by hand."""
    ring = np.array(BRACKET, dtype=float)
    k = len(ring)
    points = np.vstack([np.column_stack([ring, np.full(k, z)]) for z in (0, 1)])
    lid = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = [(c, b, a) for a, b, c in lid] + [(a + k, b + k, c + k) for a, b, c in lid]
    for i in range(k):
        j = (i + 1) % k
        faces += [(i, j, j + k), (i, j + k, i + k)]
    return trimesh.Trimesh(points, faces, process=False)


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_brick_with_redundant_vertices_is_a_brick(tmp_path, suffix):
    mesh = placed(trimesh.creation.box([2, 4, 6]).subdivide().subdivide())
    write(mesh, tmp_path / f"brick.{suffix}")
    found = read_mesh(tmp_path / f"brick.{suffix}", scale=0.5, density=2.0)
    part = found.body.parts[""]
    assert (len(part.points), len(part.facets.faces), len(part.facets.edges)) == (8, 6, 12)
    assert found.difference == pytest.approx(0, abs=1e-6)
    assert found.mass.mass == pytest.approx(12, rel=1e-6)
    assert np.allclose(found.mass.centre, [0.05, 0.1, 0.15], atol=1e-6)
    moments = np.linalg.eigvalsh(found.mass.inertia)
    assert moments == pytest.approx([1 + 4, 1 + 9, 4 + 9], rel=1e-5)  # 12 (a^2 + b^2) / 12


@given(st.integers(0, 10**6), st.integers(5, 12))
def test_a_hull_has_the_mass_of_the_polytope(tmp_path_factory, seed, count):
    cloud = np.random.default_rng(seed).normal(size=(count, 3))
    points = cloud[ConvexHull(cloud).vertices]
    path = tmp_path_factory.mktemp("hull") / "hull.ply"
    trimesh.convex.convex_hull(points).export(path, encoding="ascii")
    found, expected = read_mesh(path, parts="exact"), mass_of(polytope(points))
    assert found.mass.mass == pytest.approx(expected.mass, rel=1e-4)
    assert np.allclose(found.mass.centre, expected.centre, atol=1e-4)
    assert np.allclose(found.mass.inertia, expected.inertia, rtol=1e-3, atol=1e-3)
    near = np.linalg.norm(found.body.markers[:, None] - points[None], axis=2).min(axis=1)
    assert near.max() < 1e-4


def test_what_is_not_convex_is_cut_and_keeps_its_own_mass(tmp_path):
    pytest.importorskip("coacd")
    bracket().export(tmp_path / "bracket.stl")
    found = read_mesh(tmp_path / "bracket.stl", centred=True)
    assert len(found.body.parts) == 2
    assert found.volume == pytest.approx(5)
    assert 0 <= found.difference < 0.01
    # Two bricks, 3 x 1 and 1 x 2, about their common centre of mass (1.1, 1.1).
    assert np.allclose(found.mass.centre, 0, atol=1e-9)
    about_z = 3 * ((9 + 1) / 12 + 0.4**2 + 0.6**2) + 2 * ((1 + 4) / 12 + 0.6**2 + 0.9**2)
    assert found.mass.inertia[2, 2] == pytest.approx(about_z)
    low = np.min([part.points.min(axis=0) for part in found.body.parts.values()], axis=0)
    assert np.allclose(low, [-1.1, -1.1, -0.5], atol=1e-6)


def test_hull_and_exact(tmp_path):
    bracket().export(tmp_path / "bracket.stl")
    hull = read_mesh(tmp_path / "bracket.stl", parts="hull")
    assert (len(hull.body.markers), hull.volume) == (10, pytest.approx(5))
    assert hull.difference == pytest.approx(2 / 5)  # the triangle between (3, 1) and (1, 3)
    with pytest.raises(ValueError, match=r"bracket\.stl: expected convex components; .*1 of 1"):
        read_mesh(tmp_path / "bracket.stl", parts="exact")


def test_convex_components_are_parts(tmp_path):
    pair = [trimesh.creation.box([1, 1, 1]), trimesh.creation.box([1, 2, 1])]
    pair[1].apply_translation([3, 0, 0])
    trimesh.util.concatenate(pair).export(tmp_path / "pair.obj")
    found = read_mesh(tmp_path / "pair.obj", parts="exact")
    assert [len(part.points) for part in found.body.parts.values()] == [8, 8]
    assert found.mass.centre[0] == pytest.approx(2.0)


def test_a_mesh_seen_from_inside_is_turned_outside_in(tmp_path):
    mesh = trimesh.creation.box([1, 2, 3])
    mesh.invert()
    mesh.export(tmp_path / "in.stl")
    assert read_mesh(tmp_path / "in.stl").mass.mass == pytest.approx(6)


def test_a_hollow_box_is_not_convex(tmp_path):
    hole = trimesh.creation.box([1, 1, 1])
    hole.invert()
    trimesh.util.concatenate([trimesh.creation.box([2, 2, 2]), hole]).export(tmp_path / "h.stl")
    with pytest.raises(ValueError, match="convex components"):
        read_mesh(tmp_path / "h.stl", parts="exact")
    hull = read_mesh(tmp_path / "h.stl", parts="hull")
    assert (hull.volume, hull.difference) == (pytest.approx(7), pytest.approx(1 / 7))


def test_an_open_mesh_is_refused_and_its_hull_is_not(tmp_path):
    mesh = trimesh.creation.box([1, 1, 1])
    mesh.update_faces(np.arange(12) > 0)
    mesh.export(tmp_path / "open.stl")
    with pytest.raises(ValueError, match=r"open\.stl: expected a closed mesh.*3 edges of 18"):
        read_mesh(tmp_path / "open.stl")
    assert read_mesh(tmp_path / "open.stl", parts="hull").mass.mass == pytest.approx(1)


def test_many_vertices_are_refused_or_simplified(tmp_path):
    trimesh.creation.icosphere(subdivisions=3).export(tmp_path / "ball.stl")
    with pytest.raises(ValueError, match=r"at most 64 vertices .*got 642"):
        read_mesh(tmp_path / "ball.stl")
    found = read_mesh(tmp_path / "ball.stl", options=MeshOptions(simplify=True))
    assert len(found.body.markers) == 64
    hull = ConvexHull(found.body.markers)
    assert found.difference == pytest.approx(hull.volume / found.volume - 1)
    assert -0.1 < found.difference < 0  # inside
    assert found.volume == pytest.approx(4 / 3 * math.pi, rel=0.02)
    few = read_mesh(tmp_path / "ball.stl", options=MeshOptions(4, True))
    assert len(few.body.markers) == 4
    assert len(capsule([0, 0, 0], [1, 0, 0], 1).markers) == 2


def test_gltf_reads_buffers_of_its_folder_only(tmp_path):
    (tmp_path / "deep").mkdir()
    write(trimesh.creation.box([1, 1, 1]), tmp_path / "deep" / "box.gltf")
    assert read_mesh(tmp_path / "deep" / "box.gltf").mass.mass == pytest.approx(1)
    buffer = min((tmp_path / "deep").glob("*.bin"))
    buffer.rename(tmp_path / buffer.name)
    text = (tmp_path / "deep" / "box.gltf").read_text()
    link = tmp_path / "deep" / "link.bin"
    link.symlink_to(tmp_path / buffer.name)
    for name in (
        f"../{buffer.name}",
        str(tmp_path / buffer.name),
        "link.bin",
        "file:///etc/passwd",
    ):
        (tmp_path / "deep" / "bad.gltf").write_text(text.replace(buffer.name, name))
        with pytest.raises(
            ValueError, match=r"bad\.gltf: buffer 0: expected the path of a file in"
        ):
            read_mesh(tmp_path / "deep" / "bad.gltf")


@pytest.mark.parametrize("suffix", FORMATS)
@given(cut=st.integers(0, 400), at=st.integers(0, 2000), byte=st.integers(0, 255))
def test_damaged_files_are_read_or_refused_in_a_sentence(tmp_path_factory, suffix, cut, at, byte):
    folder = tmp_path_factory.mktemp("damaged")
    path = folder / f"box.{suffix}"
    write(trimesh.creation.box([1, 1, 1]), path)
    data = bytearray(path.read_bytes())
    if cut % 2:
        data = data[: max(0, len(data) - cut)]
    if data:
        data[at % len(data)] = byte
    path.write_bytes(bytes(data))
    found, refusal = outcome(path)
    if found is None:
        assert refusal.startswith(f"path: {path.name}")
    else:
        assert np.isfinite(found.body.markers).all()


@pytest.mark.parametrize("unit", [1e-9, 1e-5, 1e3, 1e12])
def test_the_unit_of_length_is_of_no_account(tmp_path, unit):
    """Masses grow with the third power of lengths, inertias with the fifth."""
    placed(trimesh.creation.box([1, 2, 3]).subdivide()).export(tmp_path / "brick.stl")
    one, other = (read_mesh(tmp_path / "brick.stl", scale=scale) for scale in (1.0, unit))
    np.testing.assert_allclose(other.body.markers / unit, one.body.markers, atol=1e-6)
    assert other.mass.mass / unit**3 == pytest.approx(one.mass.mass)
    np.testing.assert_allclose(other.mass.centre / unit, one.mass.centre, atol=1e-6)
    np.testing.assert_allclose(other.mass.inertia / unit**5, one.mass.inertia, atol=1e-6)


ARGUMENTS = [
    ({"parts": "konvex"}, "parts: expected 'convex', 'hull' or 'exact'; got 'konvex'"),
    ({"scale": 1e100}, r"path: brick\.stl: expected a body of finite size, .*got 3\.0"),
    ({"scale": 1e300}, r"path: brick\.stl: expected a body of finite size"),
    ({"scale": 1e-200}, r"path: brick\.stl: expected a body of finite size"),
]


@pytest.mark.parametrize(("given", "words"), ARGUMENTS)
def test_arguments_that_mean_nothing_are_refused(tmp_path, given, words):
    trimesh.creation.box([1, 2, 3]).export(tmp_path / "brick.stl")
    with pytest.raises(ValueError, match=f"^{words}"):
        read_mesh(tmp_path / "brick.stl", **given)


TRIANGLES = b"f 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"
HOSTILE = {
    "huge.stl": b"x" * 80 + (2**32 - 1).to_bytes(4, "little") + b"\0" * 50,
    "nan.obj": b"v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + TRIANGLES,
    "wide.obj": b"v 1e300 0 0\nv -1e300 0 0\nv 0 1e300 0\nv 0 0 1e300\n" + TRIANGLES,
    "far.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
    "flat.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    "huge.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n"
    b"property float x\nproperty float y\nproperty float z\nend_header\n",
    "empty.glb": b"",
    "deep.gltf": b'{"buffers":' + b"[" * 100_000,
    "huge.gltf": b'{"buffers":[{"byteLength":1e18}],"accessors":[{"count":1e12}]}',
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused(tmp_path, name):
    (tmp_path / name).write_bytes(HOSTILE[name])
    with pytest.raises(ValueError, match=rf"path: {name}"):
        read_mesh(tmp_path / name, parts="hull")


def test_large_files_and_other_formats_are_refused(tmp_path):
    (tmp_path / "big.stl").write_bytes(b"\0" * 5000)
    with pytest.raises(ValueError, match=r"big\.stl: expected at most 0.001 MiB"):
        read_mesh(tmp_path / "big.stl", options=MeshOptions(megabytes=0.001))
    with pytest.raises(ValueError, match=r"path: expected a file name that ends in \.stl"):
        read_mesh(tmp_path / "part.step")


def test_a_material_library_is_not_read(tmp_path):
    path = tmp_path / "box.obj"
    text = trimesh.exchange.obj.export_obj(trimesh.creation.box([1, 1, 1]))
    path.write_text(f"mtllib ../../etc/passwd\nusemtl x\n{text}")
    assert read_mesh(path).mass.mass == pytest.approx(1)

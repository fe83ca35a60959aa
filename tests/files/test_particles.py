"""Particles and molecules from files: frames, radii of tables, and refusals with a place."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycorner import Manifold
from polycorner.bodies import Arrangement, Cylinder, capsule, disc, sphere
from polycorner.files import Particles, molecule, read_particles
from polycorner.models import read_coordinates

WATER = "3\nwater\nO 0 0 0.117\nH 0 0.757 -0.471\nH 0 -0.757 -0.471\n"
EXTENDED = (
    '2\nLattice="5 0 0 0 5 0 0 0 5" Properties=id:I:1:pos:R:3:radius:R:1:species:S:1 Time=0\n'
    "7 1 2 3 0.5 A\n8 4 5 6 0.25 B\n"
)


@pytest.fixture
def written(tmp_path):
    def write(text, name="some.xyz"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def test_frames_of_xyz(written):
    second = WATER.replace("0.117", "0.2")
    found = read_particles(written(WATER + second + "\n\n"))
    assert found.kinds == ("O", "H", "H")
    assert found.positions.shape == (2, 3, 3)
    assert found.positions[:, 0, 2].tolist() == [0.117, 0.2]
    assert found.radii is None


def test_columns_of_extended_xyz(written):
    found = read_particles(written(EXTENDED))
    assert found.kinds == ("A", "B")
    assert found.positions.tolist() == [[[1, 2, 3], [4, 5, 6]]]
    assert found.radii.tolist() == [0.5, 0.25]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected a number of particles"),
        ("x\n\n", "line 1: expected the number of particles"),
        ("99999999999999\nc\nO 0 0 0\n", "line 1: expected at most 1 particles"),
        (
            "2\nc\nO 0 0 0\n",
            "line 1: expected at most 1 particles, for the lines after the comment",
        ),
        ("0\nc\n", "line 1: expected the number of particles; got '0'"),
        ("1\nc\nO 0 0 0\nO 0 0 1\n", "line 4: expected the number of particles; got 'O 0 0 1'"),
        ("-1\nc\nO 0 0 0\n", "line 1: expected the number"),
        ("1\nc\nO 0 0\n", "line 3: expected at least 4 words; got 'O 0 0'"),
        ("1\nc\nO 0 0 nan\n", "line 3: expected finite numbers; got 'nan'"),
        ("1\nc\nO 0 0 1_0\n", "line 3: expected finite numbers"),
        (WATER + "1\nc\nO 0 0 0\n", "line 6: expected 3 particles, as in the first frame; got '1'"),
        (WATER + WATER.replace("O 0", "S 0"), "line 8: expected the particles of the first frame"),
        (EXTENDED.replace("pos:R:3", "pos:R:99"), "line 2: expected pos:R:3"),
        (EXTENDED.replace("pos:R:3", "pos:R:0"), "line 2: expected pos:R:3"),
        (EXTENDED.replace("pos:R:3", "place:R:3"), "line 2: expected species and pos"),
        (EXTENDED.replace("0.25 B", "-0.25 B"), "line 4: expected a radius > 0; got -0.25"),
    ],
)
def test_what_is_wrong_in_xyz_is_said_with_its_line(written, text, words):
    with pytest.raises(ValueError, match=rf"^path: some\.xyz: .*{words}"):
        read_particles(written(text))


def test_other_files_are_refused(written, tmp_path):
    with pytest.raises(ValueError, match=r"ends in \.xyz or \.gsd"):
        read_particles(written("", "some.pdb"))
    with pytest.raises(ValueError, match=r"some\.xyz: expected at most 1e-06 MiB"):
        read_particles(written(WATER), megabytes=1e-6)
    (tmp_path / "bytes.xyz").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"bytes\.xyz: expected text in UTF-8"):
        read_particles(tmp_path / "bytes.xyz")
    with pytest.raises(OSError, match=r"none\.xyz"):
        read_particles(tmp_path / "none.xyz")


def trajectory(path, frames=3, count=4, **chunks):
    """Write a GSD file, as HOOMD-blue does."""
    hoomd = pytest.importorskip("gsd.hoomd")
    rng = np.random.default_rng(0)
    positions = rng.normal(size=(frames, count, 3)).astype(np.float32)
    with hoomd.open(path, "w") as file:
        for k in range(frames):
            frame = hoomd.Frame()
            frame.configuration.box = [20, 20, 20, 0, 0, 0]
            frame.particles.N = count
            frame.particles.position = positions[k]
            if k == 0:
                frame.particles.types, frame.particles.typeid = ["A", "B"], [0, 1] * (count // 2)
                for name, value in chunks.items():
                    setattr(frame.particles, name, value)
            file.append(frame)
    return positions


def test_frames_of_gsd(tmp_path):
    turned = Rotation.from_rotvec([[0, 0, 0.3 * k] for k in range(4)])
    quaternions = turned.as_quat(scalar_first=True)
    expected = trajectory(tmp_path / "a.gsd", diameter=[1, 2, 3, 4], orientation=quaternions)
    found = read_particles(tmp_path / "a.gsd")
    assert found.kinds == ("A", "B", "A", "B")
    assert np.array_equal(found.positions, expected)
    assert found.radii.tolist() == [0.5, 1, 1.5, 2]
    assert np.allclose(found.orientations[0], quaternions)


@pytest.mark.parametrize(
    ("chunks", "words"),
    [
        ({"diameter": [1, 0, 1, 1]}, "radii: expected numbers > 0; got"),
        ({"orientation": np.zeros((4, 4))}, "orientations: expected quaternions that are not zero"),
        ({"typeid": [0, 1, 2, 9]}, "frame 0: typeid: expected 4 numbers of the types"),
    ],
)
def test_what_is_wrong_in_gsd_is_said_with_its_frame(tmp_path, chunks, words):
    trajectory(tmp_path / "a.gsd", **chunks)
    with pytest.raises(ValueError, match=rf"^path: a\.gsd: .*{words}"):
        read_particles(tmp_path / "a.gsd")


@given(cut=st.integers(0, 20000), at=st.integers(0, 20000), byte=st.integers(0, 255))
def test_damaged_gsd_files_are_read_or_refused(tmp_path_factory, cut, at, byte):
    path = tmp_path_factory.mktemp("damaged") / "a.gsd"
    trajectory(path)
    data = bytearray(path.read_bytes())
    data[at % len(data)] = byte
    path.write_bytes(bytes(data[: cut % len(data)] if cut % 2 else data))
    refusal = ""
    try:
        read_particles(path)
    except ValueError as error:
        refusal = str(error)
    assert not refusal or refusal.startswith("path: a.gsd")


def test_more_positions_than_allowed_are_refused(tmp_path):
    trajectory(tmp_path / "a.gsd", frames=200, count=40)
    with pytest.raises(ValueError, match=r"MiB"):
        read_particles(tmp_path / "a.gsd", megabytes=0.3)


def test_particles_are_points_of_an_arrangement(written):
    found = read_particles(written(EXTENDED + EXTENDED.replace("7 1 2", "7 2 2")))
    balls = Arrangement(
        {f"b{k}": sphere(r) for k, r in enumerate(found.radii)},
        {"room": Cylinder(50, point=[0, 0, 0])},
    )
    assert found.points(balls).tolist() == [[1, 2, 3, 4, 5, 6], [2, 2, 3, 4, 5, 6]]
    discs = Arrangement({"a": disc(1), "b": disc(1)})
    assert found.points(discs).tolist() == [[1, 2, 4, 5], [2, 2, 4, 5]]
    with pytest.raises(ValueError, match="2 bodies, one for each particle"):
        found.points(Arrangement({"a": disc(1)}, {"room": Cylinder(50)}))


def test_orientations_turn_bodies():
    quaternions = Rotation.from_rotvec([[0, 0, 0.5], [0, 0, -1.0]]).as_quat(scalar_first=True)
    found = Particles(("A", "A"), np.zeros((1, 2, 3)), quaternions[None])
    flat = Arrangement({"a": capsule([0, 0], [1, 0], 0.1), "b": disc(1)})
    assert found.points(flat)[0] == pytest.approx([0, 0, 0.5, 0, 0])
    rods = {name: capsule([0, 0, 0], [1, 0, 0], 0.1) for name in "ab"}
    deep = Arrangement(rods).placed(found.points(Arrangement(rods))[0])
    assert deep["a"].markers[1] == pytest.approx([math.cos(0.5), math.sin(0.5), 0])


def test_molecules_have_the_radii_of_tables(written):
    pytest.importorskip("ase")
    water = read_particles(written(WATER))
    for table, oxygen in (("alvarez", 1.50), ("bondi", 1.52)):
        body = molecule(water, radii=table, scale=0.1)
        assert [*body.parts] == ["O1", "H2", "H3"]
        assert body.parts["O1"].radius == pytest.approx(oxygen / 10)
        assert body.parts["H2"].radius == pytest.approx(0.12)
        assert body.parts["H3"].points[0] == pytest.approx([0, -0.0757, -0.0471])
    ghost = Particles(("Xx",), np.zeros((1, 1, 3)))
    with pytest.raises(ValueError, match="radii: expected a radius of 'Xx' as well"):
        molecule(ghost)
    with pytest.raises(ValueError, match="radii: expected a number > 0; got -1"):
        molecule(ghost, radii={"Xx": -1.0})


def test_columns_by_name_are_points_of_a_manifold():
    table = read_coordinates("t,y,x\n0,1.5,2\n1,2.5,3\n")
    assert table.points(Manifold.euclidean("x y")).tolist() == [[2, 1.5], [3, 2.5]]
    for text, words in (
        ("t,y,x\n0,1.5,2\n1,2.5,3\n", r"header has 'z' once, .*; got \['y', 'x'\]"),
        ("x,z,z\n0.5,1.5,2\n", r"header has 'z' once"),
        ("x,z\n0,1.5\n1,2.5\n", "header has 'x' once, read with index=False where a first col"),
        ("x;z\n2,5;2,5\n", "header has a word for each of its 4 numbers in a line"),
        ("0.5,1.5\n", r"header has a word for each of its 2 numbers in a line; got \[\]"),
    ):
        with pytest.raises(ValueError, match=f"^manifold: expected a table whose {words}"):
            read_coordinates(text).points(Manifold.euclidean("x z"))
    kept = read_coordinates("\ufeffx,z\n0,1.5\n1,2.5\n", index=False)
    assert kept.points(Manifold.euclidean("x z")).tolist() == [[0, 1.5], [1, 2.5]]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"positions": np.zeros((1, 2, 3))}, r"positions: expected shape \(1, 1, 3\) for 1 kinds"),
        ({"positions": np.zeros((1, 3))}, "positions: expected shape"),
        ({"positions": np.full((1, 1, 3), np.nan)}, "positions: expected finite numbers"),
        ({"orientations": np.zeros((1, 1, 4))}, "orientations: expected quaternions that are not"),
        ({"radii": np.array([0.0])}, "radii: expected numbers > 0"),
    ],
)
def test_arrays_that_are_no_particles_are_refused(given, words):
    with pytest.raises(ValueError, match=f"^{words}"):
        Particles(**{"kinds": ("H",), "positions": np.zeros((1, 1, 3)), **given})

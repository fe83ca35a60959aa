"""Robots from URDF files: what they say, and refusals with file and line."""

import math
import os
import re

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from polycorner.bodies import HalfSpace
from polycorner.files import MeshOptions, read_urdf
from polycorner.files.meshes import capsule_around

pytest.importorskip("yourdfpy")

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="grey"><color rgba="1 1 1 1"/></material>
  <link name="base link">
    <collision><geometry><box size="0.4 0.4 0.1"/></geometry></collision>
    <visual><geometry><anything/></geometry></visual>
  </link>
  <link name="upper">
    <inertial>
      <origin xyz="0 0 0.25" rpy="0.1 0.2 0.3"/>
      <mass value="2.0"/>
      <inertia ixx="0.05" ixy="0.001" ixz="0" iyy="0.04" iyz="0" izz="0.03"/>
    </inertial>
    <collision>
      <origin xyz="0 0 0.25"/>
      <geometry><cylinder radius="0.05" length="0.5"/></geometry>
    </collision>
  </link>
  <link name="hand">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision name="tip">
      <origin xyz="0 0 0.3"/><geometry><sphere radius="0.1"/></geometry>
    </collision>
    <collision><geometry><capsule radius="0.02" length="0.3"/></geometry></collision>
  </link>
  <link name="tool"/>
  <joint name="shoulder-1" type="continuous">
    <parent link="base link"/><child link="upper"/>
    <origin xyz="0 0 0.05" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 2"/>
    <dynamics damping="0.5" friction="0.1"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="hand"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="2" effort="30" velocity="3"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="hand"/><child link="tool"/></joint>
  <joint name="finger" type="prismatic">
    <parent link="tool"/><child link="jaw"/><limit lower="0" upper="0.04" effort="5" velocity="1"/>
    <mimic joint="elbow" multiplier="0.01" offset="0.02"/>
  </joint>
  <link name="jaw"/>
</robot>
"""


@pytest.fixture
def written(tmp_path):
    def write(text=ARM, name="arm.urdf"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def test_an_arm_is_what_its_file_says(written):
    arm = read_urdf(written())
    assert arm.manifold.names == ("shoulder_1", "elbow")
    assert [*arm.links] == ["base_link", "upper", "hand", "tool", "jaw"]
    turn, elbow, finger = (arm.joints[name] for name in ("shoulder_1", "elbow", "finger"))
    assert (turn.damping, turn.friction, turn.lower, elbow.effort) == (0.5, 0.1, -math.inf, 30)
    assert (elbow.lower, elbow.upper, finger.follows) == (-1.5, 2, ("elbow", 0.01, 0.02))
    assert turn.axis.tolist() == [0, 0, 1]
    assert arm.manifold.periods == (2 * math.pi, math.inf)
    mass = arm.links["upper"].mass
    turned = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix()  # about fixed axes
    tensor = np.array([[0.05, 0.001, 0], [0.001, 0.04, 0], [0, 0, 0.03]])
    assert np.allclose(mass.inertia, turned @ tensor @ turned.T)
    assert (mass.mass, mass.centre.tolist()) == (2, [0, 0, 0.25])
    upper = arm.links["upper"].body.parts[""]
    assert (upper.points.tolist(), upper.radius) == ([[0, 0, 0], [0, 0, 0.5]], 0.05)
    assert [*arm.links["hand"].body.parts] == ["1", "2"]
    box = arm.links["base_link"].body.parts[""].points
    assert sorted(map(tuple, abs(box).tolist())) == [(0.2, 0.2, 0.05)] * 8
    gaps = {f.name for f in arm.polyhedron.functions}
    assert {"elbow lower", "elbow upper", "finger lower", "finger upper"} <= gaps
    assert any(re.match(r"hand\.1.*-base_link|base_link.*-hand\.1", name) for name in gaps)


def test_declarations_of_other_versions_are_passed_over(written, tmp_path):
    plain = read_urdf(written())
    for start in ('<?xml version="0.0" ?>', '\n\n<?xml version="1.0" encoding="utf-8"?>'):
        text = ARM.replace('<?xml version="1.0"?>', start)
        assert [*read_urdf(written(text)).links] == [*plain.links]
        line = text[: text.index('value="2.0"')].count("\n") + 1
        with pytest.raises(ValueError, match=rf"line {line}: <mass>"):
            read_urdf(written(text.replace('value="2.0"', 'value="x"')))
    latin = ARM.replace('"1.0"?>', '"1.0" encoding="iso-8859-1"?>').replace("grey", "gr\u00e9")
    (tmp_path / "latin.urdf").write_bytes(latin.encode("latin-1"))
    assert [*read_urdf(tmp_path / "latin.urdf").links] == [*plain.links]


def test_limits_without_numbers_are_none(written):
    limit = '<limit lower="-1.5" upper="2" effort="30" velocity="3"/>'
    free = read_urdf(written(ARM.replace(limit, '<limit effort="30"/>')))
    assert (free.joints["elbow"].lower, free.joints["elbow"].upper) == (-math.inf, math.inf)
    one = read_urdf(written(ARM.replace(limit, '<limit upper="2"/>')))
    assert (one.joints["elbow"].lower, one.joints["elbow"].upper) == (0, 2)


def test_the_home_of_the_arm(written):
    arm = read_urdf(written())
    q = arm.point({"shoulder_1": 0.5, "elbow": 0.3})
    matrix, origin = arm.pose(q, "hand")
    first = Rotation.from_euler("z", math.pi / 2 + 0.5)
    assert np.allclose(origin, [0, 0, 0.55])
    assert np.allclose(matrix, (first * Rotation.from_euler("y", 0.3)).as_matrix())


def test_prisms_around_cylinders(written):
    arm = read_urdf(written(), sides=8)
    points = arm.links["upper"].body.parts[""].points
    assert points.shape == (16, 3)
    middles = (points[:8] + np.roll(points[:8], 1, axis=0)) / 2
    assert np.allclose(np.linalg.norm(middles[:, :2], axis=1), 0.05)


def test_inertias_of_shapes(written):
    text = ARM.replace('ixx="0.05"', 'ixx="5"')
    with pytest.raises(ValueError, match=r"arm\.urdf: link 'upper': inertia.*inertias='nearest'"):
        read_urdf(written(text))
    mass = read_urdf(written(text), inertias="shapes").links["upper"].mass
    assert (mass.mass, mass.centre.tolist()) == (pytest.approx(2), pytest.approx([0, 0, 0.25]))


@pytest.mark.parametrize("moments", [(5, 0.04, 0.03), (0, 0, 0), (-1, 1, 1), (0.05, 0.04, 0.03)])
def test_nearest_inertias_are_those_of_bodies(written, moments):
    x, y, z = moments
    text = ARM.replace('ixx="0.05"', f'ixx="{x}"').replace('iyy="0.04"', f'iyy="{y}"')
    text = text.replace('izz="0.03"', f'izz="{z}"').replace('ixy="0.001"', 'ixy="0"')
    found = read_urdf(written(text), inertias="nearest").links["upper"].mass.inertia
    second = np.array([y + z - x, z + x - y, x + y - z]) / 2
    nearest = np.maximum(second, 2e-6)  # of a mass of 2
    expected = nearest.sum() - nearest
    assert np.linalg.eigvalsh(found) == pytest.approx(sorted(expected), rel=1e-9)


def test_links_that_overlap_at_home_are_ignored(written):
    low = ARM.replace('<origin xyz="0 0 0.5"/><axis', '<origin xyz="0 0 -0.3"/><axis')
    assert read_urdf(written()).ignored == ()
    assert read_urdf(written(low)).ignored == (("hand", "base_link"),)


MESH = '<geometry><mesh filename="{}" scale="0.5 0.5 2"/></geometry>'


def with_mesh(reference):
    return ARM.replace(
        '<geometry><cylinder radius="0.05" length="0.5"/></geometry>', MESH.format(reference)
    )


def test_meshes_are_read_in_the_folder_only(written, tmp_path):
    box = trimesh.creation.box([0.2, 0.2, 0.3])
    for place in ("pack/meshes", "pack/urdf", "out"):
        (tmp_path / place).mkdir(parents=True)
        box.export(tmp_path / place / "box.stl")
    (tmp_path / "pack/urdf/link.stl").symlink_to(tmp_path / "out/box.stl")
    pack = tmp_path / "pack"
    for reference, folder in (
        ("box.stl", None),
        ("../meshes/box.stl", pack),
        ("package://pack/meshes/box.stl", pack),
        ("package://pack/meshes/box.stl", tmp_path),
    ):
        path = written(with_mesh(reference), "pack/urdf/arm.urdf")
        arm = read_urdf(path, folder=folder, shapes="hulls")
        size = np.ptp(arm.links["upper"].body.markers, axis=0)
        assert np.allclose(size, [0.1, 0.1, 0.6])
        rounded = read_urdf(path, folder=folder).links["upper"].body.parts[""]
        assert rounded.radius == pytest.approx(0.05 * math.sqrt(2))
    for reference in (
        "../meshes/box.stl",
        "../../out/box.stl",
        str(tmp_path / "out/box.stl"),
        f"file://{tmp_path}/out/box.stl",
        "http://localhost/box.stl",
        "package://pack/../out/box.stl",
        "link.stl",
        "none.stl",
    ):
        path = written(with_mesh(reference), "pack/urdf/arm.urdf")
        with pytest.raises(
            ValueError, match=r"link 'upper': collision 1: mesh: expected (the path|a file)"
        ):
            read_urdf(path)


@given(st.integers(0, 10**6))
def test_a_capsule_around_points_contains_them(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(12, 3)) * rng.uniform(0.1, 2, 3)
    (part,) = capsule_around(points).parts.values()
    a, b = part.points[0], part.points[-1]
    along = (b - a) / max(np.linalg.norm(b - a), 1e-300)
    at = np.clip((points - a) @ along, 0, np.linalg.norm(b - a))
    away = np.linalg.norm(points - a - at[:, None] * along, axis=1)
    assert away.max() <= part.radius * (1 + 1e-9)
    assert away.max() >= part.radius * (1 - 1e-6)


def test_a_capsule_around_a_capsule_is_about_as_large():
    mesh = trimesh.creation.capsule(height=2, radius=0.3, count=[32, 32])
    (part,) = capsule_around(mesh.vertices).parts.values()
    assert part.radius == pytest.approx(0.3, rel=0.02)
    assert np.linalg.norm(np.diff(part.points, axis=0)) == pytest.approx(2, rel=0.02)


WRONG = {
    '<mass value="2.0"/>': [
        (
            '<mass value="heavy"/>',
            "line {line}: <mass>: value: expected a finite number; got 'heavy'",
        ),
        ('<mass value="nan"/>', "value: expected a finite number"),
        ('<mass value="1_0"/>', "value: expected a finite number"),
        ("<mass/>", "value: expected a finite number; got None"),
        ("", "line {inertial}: <inertial>: expected an element <mass>"),
        (
            '<mass value="1"/><mass value="2"/>',
            "line {inertial}: <inertial>: expected one element <mass> at most; got 2",
        ),
        ('<mass value="-1"/>', "link 'upper': mass"),
    ],
    'ixx="0.05" ': [("", "<inertia>: ixx: expected a finite number; got None")],
    '<box size="0.4 0.4 0.1"/>': [
        ('<box size="0.4 0.4"/>', "line {line}: <box>: size: expected 3 finite numbers"),
        ('<box size="0.4 0.4 0"/>', "line {line}: <box>: size: expected numbers > 0; got"),
        ('<box size="-1 1 1"/>', "<box>: size: expected numbers > 0; got '-1 1 1'"),
        ('<sphere radius="0"/>', "<sphere>: radius: expected a number > 0; got '0'"),
        ('<cylinder radius="1" length="-1"/>', "<cylinder>: length: expected a number > 0"),
        ("<cone/>", "line {line}: <geometry>: expected one of <box>, <sphere>"),
        ("", "line {line}: <geometry>: expected one of"),
    ],
    'type="continuous"': [
        ('type="ball"', r"line {line}: <joint> 'shoulder-1': expected the type .*; got 'ball'"),
        ('type="floating"', "joint 'shoulder-1': expected a floating joint from an empty link"),
        ("", "<joint>: expected the attribute type"),
    ],
    '<child link="upper"/>': [
        ("", "<joint>: expected an element <child>"),
        ('<child link="lower"/>', "joint 'shoulder-1': link: expected"),
        ('<child link="base link"/>', "expected"),
    ],
    '<axis xyz="0 1 0"/>': [('<axis xyz="0 0 0"/>', "joint 'elbow': axis: expected a direction")],
    '<limit lower="-1.5" upper="2" effort="30" velocity="3"/>': [
        ("", "<joint> 'elbow': expected an element <limit>"),
        ('<limit effort="1"/><limit effort="2"/>', "<joint>: expected one element <limit> at most"),
        ('<limit lower="3" upper="2"/>', "joint 'elbow': upper: expected a limit above"),
    ],
    '<mimic joint="elbow"': [('<mimic joint="x"', "joint 'finger': mimic: expected")],
    '<link name="tool"/>': [
        ('<link name="tool"/><link name="tool"/>', "expected"),
        ('<link name="loose"/><link name="tool"/>', "joints: expected joints that lead"),
        ('<link name="base-link"/><link name="tool"/>', "differ in letters and digits"),
    ],
    '<robot name="arm">': [
        ("<robot>", "line {line}: <robot>: expected the attribute name"),
        ('<!DOCTYPE robot [<!ENTITY a "b">]><robot name="arm">', "no document type"),
        ('<robot name="arm"><xacro:include filename="/etc/passwd"/>', "line {line}"),
        (
            '<robot name="arm" xmlns:xacro="x"><xacro:include filename="/etc/passwd"/>',
            "expected plain URDF",
        ),
    ],
    "</robot>": [("", "expected XML"), ("</robot><robot/>", "expected XML")],
}
CASES = [(old, new, words) for old, several in WRONG.items() for new, words in several]


@pytest.mark.parametrize(("old", "new", "words"), CASES)
def test_what_is_wrong_is_said_with_file_and_place(written, old, new, words):
    line = ARM[: ARM.index(old)].count("\n") + 1
    words = words.replace("{line}", str(line)).replace("{inertial}", str(line - 2))
    with pytest.raises(ValueError, match=rf"^path: arm\.urdf: .*{words}"):
        read_urdf(written(ARM.replace(old, new, 1)))


ARGUMENTS = [
    ({"shapes": "boxes"}, "shapes: expected 'capsules', 'hulls' or 'parts'; got 'boxes'"),
    ({"inertias": "none"}, "inertias: expected 'file', 'nearest' or 'shapes'; got 'none'"),
    ({"base": "free"}, "base: expected 'fixed' or 'floating'; got 'free'"),
    ({"sides": 33}, r"sides: expected at most 32, as MeshOptions\(vertices=64\) has it; got 33"),
    ({"folder": "nowhere"}, "folder: expected a folder that exists; got 'nowhere'"),
]


@pytest.mark.parametrize(("given", "words"), ARGUMENTS)
def test_arguments_that_mean_nothing_are_refused(written, given, words):
    with pytest.raises(ValueError, match=f"^{words}"):
        read_urdf(written(), **given)


def test_bombs_and_other_documents_are_refused(written):
    laughs = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(12))
    bomb = f'<!DOCTYPE robot [<!ENTITY a0 "ha">{laughs}]><robot name="&a12;"/>'
    outside = (
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="a">&x;</robot>'
    )
    deep = '<robot name="a">' + "<link>" * 5000
    for text in (bomb, outside, deep, "", "robot", "<sdf/>", "\0", '<robot name="a"/>'):
        with pytest.raises(ValueError, match=r"^path: bad\.urdf"):
            read_urdf(written(text, "bad.urdf"))
    with pytest.raises(ValueError, match=r"at most 0\.001 MiB"):
        read_urdf(written(ARM), options=MeshOptions(megabytes=1e-3))


@given(cut=st.integers(0, len(ARM)), at=st.integers(0, len(ARM) - 1), byte=st.integers(1, 127))
def test_damaged_files_are_read_or_refused_in_a_sentence(tmp_path_factory, cut, at, byte):
    path = tmp_path_factory.mktemp("damaged") / "arm.urdf"
    text = ARM[:at] + chr(byte) + ARM[at + 1 :]
    path.write_text(text[:cut] if cut % 3 == 0 else text)
    refusal = ""
    try:
        read_urdf(path)
    except ValueError as error:
        refusal = str(error)
    assert not refusal or (refusal.startswith("path: arm.urdf") and os.linesep not in refusal)


LOOSE = """<robot name="cart">
  <link name="world"/>
  <link name="cart">
    <inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><geometry><box size="0.4 0.3 0.1"/></geometry></collision>
  </link>
  <joint name="drive" type="KIND">
    <parent link="world"/><child link="cart"/>
    <origin xyz="1 2 3" rpy="0.3 -0.2 0.5"/><axis xyz="0 1 2"/>
  </joint>
</robot>"""


def test_a_planar_joint_slides_across_its_axis_and_turns_about_it(tmp_path):
    path = tmp_path / "cart.urdf"
    path.write_text(LOOSE.replace("KIND", "planar"))
    robot = read_urdf(path)
    assert robot.manifold.names == ("drive_x", "drive_y", "drive")
    x, y, turn = 0.3, -0.7, 1.1
    matrix, place = robot.pose(robot.point({"drive_x": x, "drive_y": y, "drive": turn}), "cart")
    joint = Rotation.from_euler("xyz", [0.3, -0.2, 0.5]).as_matrix()
    axis = np.array([0, 1, 2]) / math.sqrt(5)
    about = Rotation.from_rotvec(turn * axis).as_matrix()
    np.testing.assert_allclose(matrix, joint @ about, atol=1e-12)
    moved = joint.T @ (place - [1, 2, 3])
    assert moved @ axis == pytest.approx(0, abs=1e-12)
    assert np.linalg.norm(moved) == pytest.approx(math.hypot(x, y))
    far = HalfSpace([0, 0, 1], [0, 0, -9])
    system = robot.among(walls={"floor": far}).system()
    kinetic, _ = system.energies(system.state([x, y, turn], [3.0, 4.0, 0.0]))
    assert kinetic == pytest.approx(2 * 25 / 2)


def test_a_floating_joint_below_an_empty_link_is_a_base_that_floats(tmp_path):
    path = tmp_path / "cart.urdf"
    path.write_text(LOOSE.replace("KIND", "floating"))
    robot = read_urdf(path)
    assert robot.base == "floating"
    assert robot.root == "cart"
    assert [*robot.links] == ["cart"]
    assert robot.manifold.size == 7

"""Collada files: units, places and instances, and refusals with file and line."""

import math
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner.files import MeshOptions, read_mesh, read_urdf

pytest.importorskip("collada")

SIZES = np.array([1.0, 2.0, 3.0])
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], dtype=float)
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
BRICK = f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="half" meter="0.5"/><up_axis>Y_UP</up_axis></asset>
  <library_images><image id="i"><init_from>../../secret.png</init_from></image></library_images>
  <library_geometries>
    <geometry id="brick"><mesh>
      <source id="points">
        <float_array id="numbers" count="24">{" ".join(map(str, CORNERS.ravel()))}</float_array>
        <technique_common><accessor source="#numbers" count="8" stride="3">
          <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
        </accessor></technique_common>
      </source>
      <vertices id="all"><input semantic="POSITION" source="#points"/></vertices>
      <polylist count="6" material="none">
        <input semantic="VERTEX" source="#all" offset="0"/>
        <vcount>4 4 4 4 4 4</vcount>
        <p>{" ".join(str(i) for quad in QUADS for i in quad)}</p>
      </polylist>
    </mesh></geometry>
  </library_geometries>
  <library_nodes>
    <node id="shifted"><translate>0 0 5</translate><instance_geometry url="#brick"/></node>
  </library_nodes>
  <library_visual_scenes><visual_scene id="scene">
    <node><translate>10 20 30</translate><rotate>0 0 1 90</rotate><scale>1 1 2</scale>
      <instance_geometry url="#brick"><bind_material><technique_common>
        <instance_material symbol="none" target="#gone"/>
      </technique_common></bind_material></instance_geometry>
    </node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
"""
INSTANCE = '<instance_geometry url="#brick"/>'


@pytest.fixture
def written(tmp_path):
    def write(text=BRICK, name="brick.dae"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def scene(nodes, library=""):
    """Return the file with other nodes in its scene, and more in its library."""
    begin, rest = BRICK.split('<visual_scene id="scene">')
    _, end = rest.split("</visual_scene>")
    text = f'{begin}<visual_scene id="scene">{nodes}</visual_scene>{end}'
    return text.replace("</library_nodes>", f"{library}</library_nodes>")


def same_points(found, expected):
    order = [np.lexsort(np.round(points, 6).T) for points in (found, expected)]
    np.testing.assert_allclose(found[order[0]], expected[order[1]], atol=1e-6)


def test_a_brick_is_where_units_and_nodes_put_it(written):
    found = read_mesh(written(), scale=10, density=2)
    turned = Rotation.from_euler("z", math.pi / 2).as_matrix()
    places = 10 * 0.5 * ((CORNERS * [1, 1, 2]) @ turned.T + [10, 20, 30])
    same_points(found.body.markers, places)
    assert found.mass.mass == pytest.approx(2 * 12 * 5**3)


def test_polygons_and_triangles_are_the_same_brick(written):
    begin, rest = BRICK.split('<polylist count="6" material="none">')
    inputs = '<input semantic="VERTEX" source="#all" offset="0"/>'
    end = rest.split("</polylist>")[1]
    polygons = "".join(f"<p>{' '.join(map(str, quad))}</p>" for quad in QUADS)
    halves = [(a, b, c, a, c, d) for a, b, c, d in QUADS]
    triangles = f"<p>{' '.join(str(i) for half in halves for i in half)}</p>"
    expected = read_mesh(written())
    for tag, indices in (("polygons", polygons), ("triangles", triangles)):
        text = f'{begin}<{tag} count="6">{inputs}{indices}</{tag}>{end}'
        found = read_mesh(written(text))
        same_points(found.body.markers, expected.body.markers)
        assert found.mass.mass == pytest.approx(expected.mass.mass)


def test_instances_and_mirrors(written):
    matrix = "-1 0 0 0  0 1 0 7  0 0 1 0  0 0 0 1"
    mirrored = f"<node><matrix>{matrix}</matrix>{INSTANCE}</node>"
    text = scene(f'<node><instance_node url="#shifted"/></node>{mirrored}')
    found = read_mesh(written(text), scale=2)
    parts = [part.points for part in found.body.parts.values()]
    assert found.volume == pytest.approx(12)
    same_points(parts[0], CORNERS + np.array([0, 0, 5]))
    same_points(parts[1], CORNERS * [-1, 1, 1] + [0, 7, 0])


def test_a_link_is_in_metres(tmp_path, written):
    written()
    robot = tmp_path / "one.urdf"
    robot.write_text(
        '<robot name="one"><link name="a"><collision><geometry>'
        '<mesh filename="package://p/brick.dae" scale="1 1 3"/></geometry>'
        "</collision></link></robot>"
    )
    (tmp_path / "p").mkdir()
    (tmp_path / "brick.dae").rename(tmp_path / "p" / "brick.dae")
    body = read_urdf(robot, shapes="hulls").links["a"].body
    np.testing.assert_allclose(np.ptp(body.markers, axis=0), [1, 0.5, 9], atol=1e-6)


OTHER = "a name in this file, '#...', as nothing else is read"
WRONG = {
    'url="#brick"': [
        ('url="other.dae#brick"', rf"line {{line}}: <instance_geometry>: url: expected {OTHER}"),
        ('url="file:///etc/passwd#brick"', r"<instance_geometry>: url: expected a name in this"),
        (
            'url="#none"',
            r"line {line}: <instance_geometry>: url: .* geometry of the file; got '#none'",
        ),
    ],
    'source="#points"': [
        ('source="../points.xml"', "line {line}: <input>: source: expected a name in this file"),
        ('source="#none"', "expected a mesh in the format DAE; got "),
    ],
    'count="24">0.0 0.0 0.0': [
        ('count="24">x 0.0 0.0', "line {line}: <float_array>: expected finite numbers; got 'x'"),
        ('count="24">nan 0.0 0.0', "<float_array>: expected finite numbers; got 'nan'"),
        ('count="24">0.0 0.0', "expected a mesh in the format DAE; got "),
    ],
    "<p>0 1": [
        ("<p>-1 1", "line {line}: <p>: expected whole numbers from 0 to 999999999; got '-1'"),
        ("<p>99999999999 1", "<p>: expected whole numbers"),
        ("<p>77 1", "expected a mesh in the format DAE; got "),
        ("<p>0", "<polylist>: expected indices <p> of the 24 corners that <vcount> has; got 23"),
    ],
    'offset="0"': [('offset="x"', "line {line}: <input>: offset: expected whole numbers")],
    "<vcount>4 4": [
        ("<vcount>-4 4", "<vcount>: expected whole"),
        (
            "<vcount>4 5",
            "<polylist>: expected indices <p> of the 25 corners that <vcount> has; got 24",
        ),
    ],
    "<scale>1 1 2</scale>": [
        ("<scale>1 1</scale>", "line {line}: <scale>: expected 3 finite numbers; got '1 1'"),
        ("<skew>1 1 1 0 0 0 1</skew>", "line {line}: <skew>: expected <matrix>"),
        ("<scale>0 0 0</scale>", "expected a body of finite size"),
        ("<instance_controller url='#c'/>", "<instance_controller>: expected rigid geometry"),
    ],
    'meter="0.5"': [
        ('meter="0"', "line {line}: <unit>: meter: expected a length > 0; got '0'"),
        ('meter="inch"', "<unit>: meter: expected a length > 0"),
    ],
    "<COLLADA ": [('<!DOCTYPE x [<!ENTITY a "b">]><COLLADA ', "expected no document type")],
    '<scene><instance_visual_scene url="#scene"/></scene>': [
        ("", "<COLLADA>: expected an element <scene>"),
        ("<scene/>", "<COLLADA>: expected an element <scene>"),
        ('<scene><instance_visual_scene url="#x"/></scene>', "name of a visual_scene"),
    ],
    "</COLLADA>": [("", "line [0-9]+: expected XML"), ("</COLLADA><x/>", "expected XML")],
}
CASES = [(old, new, words) for old, several in WRONG.items() for new, words in several]


@pytest.mark.parametrize(("old", "new", "words"), CASES)
def test_what_is_wrong_is_said_with_file_and_place(written, old, new, words):
    at = BRICK.rindex(old)
    line = BRICK[:at].count("\n") + 1
    with pytest.raises(
        ValueError, match=rf"^path: brick\.dae: .*{words.replace('{line}', str(line))}"
    ):
        read_mesh(written(BRICK[:at] + new + BRICK[at + len(old) :]))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected XML"),
        ("<robot/>", "line 1: <robot>: expected the element <COLLADA>"),
        ("<COLLADA/>", "<COLLADA>: expected an element <scene>"),
        (scene(""), "expected triangles; got 'none'"),
        (scene("<node/>"), "expected triangles; got 'none'"),
        (BRICK.replace("polylist", "lines"), "triangles; got 'none'"),
        (scene('<node id="a"><instance_node url="#a"/></node>'), "not within itself; got '#a'"),
        (
            scene(
                '<node><instance_node url="#n40"/></node>',
                "".join(
                    f'<node id="n{k}">' + f'<instance_node url="#n{k - 1}"/>' * 2 + "</node>"
                    for k in range(1, 41)
                )
                + f'<node id="n0">{INSTANCE}</node>',
            ),
            "line [0-9]+: <.*>: expected a smaller file, with all instances; got 'more'",
        ),
        (
            scene(
                '<node><instance_node url="#n9999"/></node>',
                "".join(
                    f'<node id="n{k}"><instance_node url="#n{k - 1}"/></node>'
                    for k in range(1, 10000)
                )
                + f'<node id="n0">{INSTANCE}</node>',
            ),
            "expected nodes that are nested less deeply",
        ),
    ],
)
def test_empty_and_endless_files_are_refused(written, text, words):
    with pytest.raises(ValueError, match=rf"^path: brick\.dae: .*{words}"):
        read_mesh(written(text), options=MeshOptions(megabytes=1))


def test_bombs_zip_files_and_large_files_are_refused(written, tmp_path):
    entities = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(12))
    bomb = f'<!DOCTYPE x [<!ENTITY a0 "1 ">{entities}]>' + BRICK.partition("?>")[2].replace(
        "4 4 4", "&a12;"
    )
    with pytest.raises(ValueError, match=r"^path: bomb\.dae: .*"):
        read_mesh(written(bomb, "bomb.dae"))
    (tmp_path / "zip.dae").write_bytes(b"PK\x03\x04" + bytes(60))
    with pytest.raises(ValueError, match=r"^path: zip\.dae: line 1: expected XML"):
        read_mesh(tmp_path / "zip.dae")
    with pytest.raises(ValueError, match=r"brick\.dae: expected at most 0\.001 MiB"):
        read_mesh(written(), options=MeshOptions(megabytes=1e-3))


@pytest.mark.parametrize(("module", "package"), [("collada", "pycollada"), ("lxml", "lxml")])
def test_what_reads_collada_is_named_where_it_is_missing(written, monkeypatch, module, package):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=rf"^{package} is not installed; .*polycorner\[meshes\]"):
        read_mesh(written())

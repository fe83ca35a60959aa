"""Forged and damaged lists: what the checker prints of a file is what it has shown, or it refuses.

Each field of a file is changed in turn, everything else being as it was.
"""

import copy
import json
import struct
import zipfile

import numpy as np
import pytest
import sympy as sp
from proof_files import changed, verdict

from polycorner import Manifold, Polyhedron
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs import corners, stationary_points

PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
TUBE = Manifold(("z", "t"), (np.inf, 2 * np.pi), (1, 1))
z, t = TUBE.symbols

BOWL = Polyhedron(PLANE, {"bowl": y - x**2, "lid": 2 - y})
DISC = Polyhedron(PLANE, {"disc": 1 - x**2 - y**2})
PIPE = Polyhedron(TUBE, {"up": 1 - z, "down": 1 + z})
PLANES = Polyhedron(PLANE, {"a": x + y, "b": x - y, "c": x, "d": 1 - x - y / 2})
SIDES = [(-2, 2), (-2, 2)]


def half_turn(q):
    return q + np.array([0, np.pi])


HALF_TURNS = Symmetry(elements=[Element(half_turn, {})])
MADE = {
    "saddle and minima": lambda: stationary_points(DISC, x**2 - y**2, box=SIDES),
    "minima": lambda: stationary_points(BOWL, x**2 - y**2 + x / 4, box=SIDES, minima_only=True),
    "locus": lambda: stationary_points(DISC, x**2, box=SIDES),
    "half turns": lambda: stationary_points(
        PIPE, sp.cos(2 * t) + z**2, box=[(-2, 2), None], symmetry=HALF_TURNS
    ),
    "corners": lambda: corners(PLANES, box=SIDES),
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return the saved list of a name, made once."""
    folder, made = tmp_path_factory.mktemp("lists"), {}

    def file(name):
        if name not in made:
            made[name] = MADE[name]().save(folder / f"{name}.zip")
        return made[name]

    return file


def parts_of(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def write(path, parts):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


def fields(data, path=()):
    """Yield the places of values in nested lists and dictionaries, with these.

    Of records of one kind the first stands for all.
    """
    yield path, data
    keys = data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ()
    for key in list(keys)[:1] if isinstance(data, list) and dict in map(type, data) else keys:
        yield from fields(data[key], (*path, key))


def forgeries(value):
    """Return other values of the same and of other types."""
    if isinstance(value, bool):
        return [not value, int(value), "false", None]
    if isinstance(value, int):
        return [value + 1, -1, True, 10**6]
    if isinstance(value, list):
        return [[], value + value[-1:], value[:-1], value[::-1]]
    if isinstance(value, dict):
        return [{k: v for k, v in value.items() if k != gone} for gone in value]
    return ["2 pi", "nan"] if value is None else ["", "-1", None]


def with_value(data, path, value):
    if not path:
        return value
    forged = copy.deepcopy(data)
    place = forged
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return forged


# Fields with which the sentence changes and stays true: the names of coordinates; in which box; all
# points of these lists but the saddle are minima; a locus need not be shown to have points.
TRUE_WORDS = {
    "saddle and minima": {("coordinates",), ("domain",)},
    "minima": {("coordinates",), ("domain",), ("minima_only",)},
    "locus": {("coordinates",), ("domain",), ("minima_only",), ("loci", 0, "sample")},
    "half turns": {("coordinates",), ("domain",)},
    "corners": {("coordinates",), ("domain",)},
}


@pytest.mark.parametrize("name", MADE)
def test_a_forged_field_is_refused_or_changes_no_word(name, files, tmp_path):
    parts = parts_of(files(name))
    data, (fine, line) = json.loads(parts["problem.json"]), verdict(files(name))
    assert fine, line
    for path, value in fields(data):
        for forged in forgeries(value):
            parts["problem.json"] = json.dumps(with_value(data, path, forged))
            verified, said = verdict(write(tmp_path / "forged.zip", parts))
            words = {path[:1], path} & TRUE_WORDS[name]
            assert not verified or said == line or words, (path, value, forged, said)


def copied(files, name, tmp_path, change):
    """Return the verdict on a changed copy."""
    path = write(tmp_path / "forged.zip", parts_of(files(name)))
    return verdict(changed(path, change))


def test_saddles_do_not_pass_for_minima(files, tmp_path):
    def claim(data):
        data["minima_only"] = True

    def drop(data):
        claim(data)
        data["points"] = [point for point in data["points"] if point["index"] == 0]

    fine, line = copied(files, "saddle and minima", tmp_path, claim)
    assert not fine
    assert "is none of the local minima" in line
    assert copied(files, "saddle and minima", tmp_path, drop)[1].startswith("verified: 2 local")


def test_a_point_that_is_called_undecided_is_counted(files, tmp_path):
    def demote(data):
        data["open_points"].append(data["points"].pop()["region"])

    for name in ("saddle and minima", "minima", "corners"):
        assert copied(files, name, tmp_path, demote) == verdict(files(name))


def test_relations_of_a_list_of_stationary_points_are_not_said_to_be_tested(files, tmp_path):
    def relate(data):
        data["relations"] = [{"rows": [0], "weights": ["1"]}]

    name = "saddle and minima"
    assert copied(files, name, tmp_path, relate) == verdict(files(name))


def tall(side):
    """Return a list of the only point of ``(x - 1)^2 + y^2``, in a box up to ``x = side``."""
    plane = Polyhedron(PLANE, {"all": 10 - x})
    return stationary_points(plane, (x - 1) ** 2 + y**2, box=[(-2, side), (-2, 2)])


def test_a_point_beside_the_box_is_not_listed(tmp_path):
    """The region with its point at ``x = 1`` is put into the proof for ``x < 1/2``."""
    region = json.loads(parts_of(tall(2.0).save(tmp_path / "more.zip"))["problem.json"])["regions"]
    assert len(region) == 1
    region[0]["sharp_lower"][0] = (0.25).hex()

    def add(data):
        data["regions"] += region
        data["points"].append({"region": len(data["regions"]) - 1, "index": 0})

    path = tall(0.5).save(tmp_path / "list.zip")
    assert verdict(path)[1].startswith("verified: 0 stationary points")
    fine, line = verdict(changed(path, add))
    assert not fine
    assert "is none of the stationary points" in line


def test_a_point_on_a_side_is_not_left_out(tmp_path):
    """Its enclosure is shifted by less than the enclosures of the checker may be wide."""

    def shift(data):
        data["points"] = []
        beyond = np.nextafter(1.0, 2).hex()
        data["regions"][0]["sharp_lower"][0] = data["regions"][0]["sharp_upper"][0] = beyond

    def around(data):
        shift(data)
        data["domain"]["upper"][0] = (1.0).hex()

    path = tall(1.0).save(tmp_path / "list.zip")
    assert verdict(path)[1].startswith("verified: 1 stationary points")
    assert not verdict(changed(path, around))[0]


def test_a_coordinate_has_the_period_that_is_stated(files, tmp_path):
    def turn(data):
        data["periods"][1] = "2"

    fine, line = copied(files, "saddle and minima", tmp_path, turn)
    assert not fine
    assert "period of y" in line


def test_a_locus_has_its_sample_in_the_box(files, tmp_path):
    """The disc reaches to ``y = 1``; of the box ``y < 1/2`` remains."""

    def cut(data):
        data["loci"][0]["sample"][1] = (0.75).hex()
        data["domain"]["upper"][1] = (0.5).hex()

    fine, line = copied(files, "locus", tmp_path, cut)
    assert not fine
    assert "the sample is not in the set" in line


@pytest.mark.parametrize("shift", ["1/2", "3/2", "0", "1"])
def test_symmetries_are_counted_once_and_the_identity_is_none(shift, files, tmp_path):
    def add(data):
        data["symmetries"].append({"order": [0, 1], "signs": [1, 1], "shifts": ["0", shift]})

    assert not copied(files, "half turns", tmp_path, add)[0]


def test_derivatives_do_not_depend_on_how_a_node_is_named(files, tmp_path):
    """The last node may not be called -1: it would come before what it is computed from."""

    def rename(data):
        data["outputs"] = [k - len(data["nodes"]) for k in data["outputs"]]

    assert not copied(files, "saddle and minima", tmp_path, rename)[0]


# ------------------------------------------------------------------------------- damaged archives


@pytest.mark.parametrize("seed", range(60))
def test_a_damaged_file_is_refused_in_one_line(seed, files, tmp_path):
    """Bytes are changed, lost and repeated; what is still verified says the same."""
    rng = np.random.default_rng(seed)
    content = bytearray(files("locus").read_bytes())
    for _ in range(rng.integers(1, 6)):
        a, b = np.sort(rng.integers(0, len(content), 2))
        if seed % 3 == 0:
            content[a] ^= 1 << rng.integers(8)
        elif seed % 3 == 1:
            content[-rng.integers(1, 250)] = rng.integers(256)  # in the directory of the archive
        else:
            content[a:b] = content[a:b][: rng.integers(0, b - a + 1)]
    (tmp_path / "damaged.zip").write_bytes(content)
    fine, line = verdict(tmp_path / "damaged.zip")
    assert "\n" not in line
    assert not fine or line == verdict(files("locus"))[1]


def in_headers(content, offset, kind, value):
    """Change an entry of all headers of the archive, given by its place in the local ones."""
    for sign, more in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
        place = content.find(sign)
        while place >= 0:
            struct.pack_into(kind, content, place + offset + more, value)
            place = content.find(sign, place + 1)


@pytest.mark.parametrize(("offset", "value"), [(6, 1), (8, 12), (8, 14), (8, 99)])
def test_encrypted_and_otherwise_packed_files_are_refused(offset, value, files, tmp_path):
    content = bytearray(files("locus").read_bytes())
    in_headers(content, offset, "<H", value)
    (tmp_path / "other.zip").write_bytes(content)
    assert not verdict(tmp_path / "other.zip")[0]


def test_a_bomb_is_refused_unopened(files, tmp_path):
    parts = parts_of(files("locus"))
    parts["tree.bin"] = bytes(1 << 24)
    fine, line = verdict(write(tmp_path / "bomb.zip", parts))
    assert not fine
    assert "far too large" in line


@pytest.mark.parametrize("text", ["[" * 100_000, '{"format": ' * 100_000, "9" * 5000, "\xff", "[]"])
def test_descriptions_that_are_none_are_refused(text, files, tmp_path):
    parts = parts_of(files("locus")) | {"problem.json": text.encode("latin-1")}
    assert not verdict(write(tmp_path / "other.zip", parts))[0]

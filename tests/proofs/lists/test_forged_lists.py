"""Forged and damaged lists: what the checker prints of a file is what it has shown, or it refuses.

Each field of a file is changed in turn, everything else being as it was.
"""

import contextlib
import json
import re
import struct

import numpy as np
import pytest
import sympy as sp
from proof_files import changed, described, parts_of, verdict, with_value, write
from stored_problems import solved

from polycorner import AnyOf, Manifold, Polyhedron, SmoothFunction
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
ARC = Polyhedron(PLANE, {"up": y}, {"circle": 1 - x**2 - y**2})
DISCS = Polyhedron(PLANE, [AnyOf(1 - x**2 - y**2, 1 - (x - 1) ** 2 - y**2)])
FAN = Polyhedron(PLANE, [y, y - x, y + x])
DISTANCE = SmoothFunction("E", (x - sp.Symbol("a")) ** 2 + y**2, PLANE, parameters={"a": 0.2})
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
    "tip": lambda: corners(Polyhedron(PLANE, {"above": y - x**2, "below": -y - x**2}), box=SIDES),
    "arc": lambda: stationary_points(ARC, x + 2 * y, box=[(-2, 2), (-2, 2)]),
    "union": lambda: stationary_points(DISCS, x + 2 * y, box=[(-3, 3), (-3, 3)]),
    "held to first order": lambda: stationary_points(FAN, y - x**2, box=[(-1, 1), (-1, 1)]),
    "parameter": lambda: stationary_points(
        DISC, DISTANCE, box=[(-0.5, 0.5), (-0.5, 0.5)], parameters={"a": (0.125, 0.25)}
    ),
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


def fields(data, path=()):
    """Yield the places of values in nested lists and dictionaries, with these.

    Of regions and points of one kind the first stands for all.
    """
    yield path, data
    keys = data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ()
    kinds = set()
    for key in list(keys):
        kind = repr(sorted(data[key])) if isinstance(data[key], dict) else repr(key)
        if isinstance(data, dict) or kind not in kinds:
            yield from fields(data[key], (*path, key))
        kinds.add(kind)


def forgeries(value):
    """Return other values of the same and of other types."""
    if isinstance(value, bool):
        return [not value, int(value), "false", None]
    if isinstance(value, int):
        return [value + 1, value - 1, -1, True, float(value), str(value), 10**6, None]
    if isinstance(value, list):
        swapped = [value[1], value[0], *value[2:]] if len(value) > 1 else []
        some = [[], value + value[-1:], value[:-1], value[1:], value[::-1], swapped]
        return [*some, None, {}, [value]]
    if isinstance(value, dict):
        return [*({k: v for k, v in value.items() if k != gone} for gone in value), None, []]
    if value is None:
        return ["2 pi", "1", "nan", 0]
    with contextlib.suppress(ValueError):
        x = float.fromhex(value)
        others = [-x, 2 * x, x + 1, 0.0, x * (1 + 2.0**-40), np.inf]
        return [*(float(y).hex() for y in others), "", value + " ", None, 0]
    return ["", "-1", "0", "2", "x", "sin", "cos", "add", "sub", f"{value} ", value[::-1], None, 0]


PROBLEM = (
    "format",
    "coordinates",
    "periods",
    "inequalities",
    "equations",
    "branches",
    "nodes",
    "outputs",
)
PROBLEM += ("domain", "fixed", "parameters", "minima_only", "symmetries")


def sentence(line):
    """Return a verdict without what depends on the proof: leaves, and the widths of enclosures."""
    return re.sub(r" \+/- [^]]*|\d+ leaves", "", line)


@pytest.mark.parametrize("name", MADE)
def test_what_is_said_of_a_forged_file_is_true(name, files, tmp_path):
    """It is refused, or says the same of the same problem, or what is found for its own problem."""
    parts = parts_of(files(name))
    data, (fine, line) = json.loads(parts["problem.json"]), verdict(files(name))
    assert fine, line
    known = {json.dumps([data[key] for key in PROBLEM]): sentence(line)}
    for path, value in fields(data):
        for forged in forgeries(value):
            told = with_value(data, path, forged)
            parts["problem.json"] = json.dumps(told)
            verified, said = verdict(write(tmp_path / "forged.zip", parts))
            if not verified or path == ("loci", 0, "sample"):  # without, a locus may be empty
                continue
            posed = json.dumps([told[key] for key in PROBLEM])
            if told["symmetries"] and told["domain"] != data["domain"]:
                continue  # which images are counted depends on the proof
            if posed not in known:
                known[posed] = sentence(verdict(solved(told).save(tmp_path / "own.zip"))[1])
            assert sentence(said) == known[posed], (path, value, forged)


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


def test_a_function_is_not_related_to_itself(files, tmp_path):
    """As ``f - f = 0`` it would need no further attention, and its corners be lost."""

    def lose(data):
        data["relations"] = [
            {"rows": [i, i], "weights": ["1", "-1"]} for i in range(data["inequalities"])
        ]
        data["regions"], data["points"] = [], []

    fine, line = copied(files, "corners", tmp_path, lose)
    assert not fine
    assert "a function is stated twice" in line


def test_a_period_or_symmetry_that_is_only_tested_is_said_to_be(files, tmp_path):
    """A step of the energy at a place that no random point meets changes its period."""
    assert verdict(files("half turns"))[1].count("tested, not proved") == 0

    def step(data):
        nodes, energy = data["nodes"], data["outputs"][-1]
        t = nodes.index(["var", 1])
        first = len(nodes)
        nodes += [["const", "2"], ["sub", t, first], ["abs", first + 1], ["const", f"1/{2**30}"]]
        nodes += [["lt", first + 2, first + 3], ["const", "1"], ["add", energy, first + 5]]
        nodes += [["select", first + 4, first + 6, energy]]
        data["outputs"][-1] = len(nodes) - 1
        data["symmetries"] = []

    path = changed(write(tmp_path / "step.zip", parts_of(files("half turns"))), step)
    assert not verdict(path)[0] or "periods of t (tested, not proved)" in verdict(path)[1]


def tall(side):
    """Return a list of the only point of ``(x - 1)^2 + y^2``, in a box up to ``x = side``."""
    plane = Polyhedron(PLANE, {"all": 10 - x})
    return stationary_points(plane, (x - 1) ** 2 + y**2, box=[(-2, side), (-2, 2)])


def test_a_point_beside_the_box_is_not_listed(tmp_path):
    """The region with its point at ``x = 1`` is put into the proof for ``x < 1/2``."""
    region = described(tall(2.0).save(tmp_path / "more.zip"))["regions"]
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


def test_functions_that_the_set_does_not_ask_for_hold_no_point(files, tmp_path):
    """A point that three functions hold is not lost where one of them may be negative."""

    def lose(data):
        gone = next(k for k, r in enumerate(data["regions"]) if r["active"] == [1, 2])
        assert data["points"][0]["region"] == gone == 0
        del data["regions"][0], data["points"][0]
        for point in data["points"]:
            point["region"] -= 1
        data["branches"] = [[1, 2]]

    fine, line = copied(files, "held to first order", tmp_path, lose)
    assert not fine
    assert "region of [0, 1, 2]: the functions" in line


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

"""Equilibria over a parameter on the command line: known events, files, what is refused."""

import json
import math

import commands
import pytest

from polycorner.files import load_diagram

TRUSS = """
coordinates = ["x", "y"]
inequalities.stop = "y >= -3/10"
parameters.load = 0.0
parameters.exact = "1/3"
points.up = [0, 0.4]
points.down = [0, -0.25]

[energy]
minimise = '''
10*((sqrt((1 + x)**2 + y**2) - sqrt(29/25))**2 + (sqrt((1 - x)**2 + y**2) - sqrt(29/25))**2)
+ load*y
'''
"""


@pytest.fixture
def truss(tmp_path):
    path = tmp_path / "truss.toml"
    path.write_text(TRUSS)
    return str(path)


def test_a_truss_snaps_through(capsys, truss, tmp_path):
    out = tmp_path / "out"
    options = ("--vary", "load=-0.6:0.6", "--loop", "--out", str(out))
    found = commands.answer(capsys, "branches", truss, *options)
    # On the axis the load is -40 y (1 - L/sqrt(1 + y^2)), greatest where 1 + y^2 = L^(2/3).
    length = math.sqrt(29 / 25)
    y = math.sqrt(length ** (2 / 3) - 1)
    load = 40 * y * (length / math.sqrt(1 + y**2) - 1)
    folds = [event for event in found["events"] if event["kind"] == "fold"]
    assert [event["load"] for event in folds] == pytest.approx([-load, load])
    assert [sorted(event["index"]) for event in folds] == [[0, 1], [0, 1]]
    (stop,) = [event for event in found["events"] if event["functions"]]
    assert (stop["kind"], stop["before"], stop["after"]) == ("closes", [], ["stop"])
    assert stop["load"] == pytest.approx(-12 * (length / math.sqrt(1.09) - 1))
    assert found["closed"]
    assert sorted({tuple(arc["active"]) for arc in found["arcs"]}) == [(), ("stop",)]
    for arc in found["arcs"]:
        assert len(arc["load"]) == len(arc["points"]) == len(arc["energies"])
    loop = found["loop"]
    assert loop["closed"]
    assert loop["work"] == pytest.approx(loop["released"], rel=1e-5)
    assert [jump["load"] for jump in loop["jumps"]] == pytest.approx([load, -load])
    names = {"branches.json", "saved_branches.json", "branches.png"}
    assert {path.name for path in out.iterdir()} == names
    assert json.loads((out / "branches.json").read_text()) == found
    assert len(load_diagram(out / "saved_branches.json").arcs) == len(found["arcs"])


SPRING = """
inequalities.wall = "x >= 0"
parameters.load = 0.5
points.begin = [0.6]
coordinates = [{names = "x", box = [-1, 2]}]

[energy]
minimise = "x**2/2 - load*x"
"""


def test_a_diagram_is_proved_and_verified(capsys, tmp_path):
    """A spring is pulled off a wall at ``load = 0``; there is nothing else in the box."""
    path, out = tmp_path / "spring.toml", tmp_path / "out"
    path.write_text(SPRING)
    options = ("--vary", "load=-1:1", "--prove", "--out", str(out))
    found = commands.answer(capsys, "branches", str(path), *options)
    proof = found["proof"]
    assert (proof["word"], proof["searched"], proof["open"]) == ("complete", True, 0)
    assert not any(proof["arcs"] + proof["events"])
    (k,) = [k for k, event in enumerate(found["events"]) if event["kind"] in ("opens", "closes")]
    low, high = proof["load"][k]
    assert low <= 0 <= high
    code, told, _ = commands.run(capsys, "verify", str(out / "branches.proof.zip"))
    assert code == 0
    assert told.startswith("verified: equilibria over load from -1.0 to 1.0")


def test_a_diagram_that_is_not_proved_has_no_file(capsys, tmp_path):
    path, out = tmp_path / "crossing.toml", tmp_path / "out"
    path.write_text(SPRING.replace("x**2/2 - load*x", "x**3/3 - load*x**2/2").replace(
        'inequalities.wall = "x >= 0"', 'inequalities.wall = "x >= -3"'
    ))  # fmt: skip
    options = ("--vary", "load=-1:1", "--prove", "--out", str(out))
    code, answer, remarks = commands.run(capsys, "branches", str(path), *options, "--json")
    assert code == 0
    assert "branches.proof.zip is not written" in remarks
    proof = json.loads(answer)["proof"]
    assert proof["word"] == "followed"
    assert any(proof["events"])
    assert "expected a diagram of which all arcs and events are proved" in proof["not_saved"]
    assert not (out / "branches.proof.zip").exists()


def test_tables(capsys, truss):
    code, out, _ = commands.run(capsys, "branches", truss, "--vary", "load=-0.1:0.1")
    assert code == 0
    assert {"Arcs", "Events", "minimum"} <= set(out.split())


def test_the_dyad_ends_at_the_critical_rod(capsys):
    """There ``t = 2 r sqrt(1 - r^2/l^2) - r``, and it meets a pass with one contact."""
    critical = 6 * math.sqrt(1 - (3 / 16) ** 2) - 3
    found = commands.answer(capsys, "branches", "dyad", "--vary", "rod=2:2.95")
    (event,) = [event for event in found["events"] if event["kind"] != "end"]
    assert event["rod"] == pytest.approx(critical, abs=1e-7)
    assert (event["kind"], event["functions"]) == ("corner_limit", ["A2b", "aB1"])
    assert sorted(event["index"]) == [0, 1]
    active = {arc["index"]: arc["active"] for arc in found["arcs"]}
    assert active == {0: ["A2B1", "A2b", "aB1"], 1: ["A2B1"]}
    assert found["vary"] == {"name": "rod", "from": 2.0, "to": 2.95}


@pytest.mark.parametrize(
    "options", [("ball=2.21:3.5", "--rod", "2.2"), ("length=10:20", "--rod", "2.85")]
)
def test_sizes_that_change_several_formulas(capsys, options):
    """The critical ball and length solve ``t = 2 r sqrt(1 - r^2/l^2) - r``, in every drum."""
    found = commands.answer(capsys, "branches", "dyad", "--vary", *options)
    name = options[0].partition("=")[0]
    sizes = {"length": 16.0, "ball": 3.0, "rod": float(options[2])}
    for event in found["events"]:
        if event["kind"] == "corner_limit":
            length, r, t = (sizes | {name: event[name]}).values()
            assert t == pytest.approx(2 * r * math.sqrt(1 - (r / length) ** 2) - r, abs=1e-7)
    assert "corner_limit" in {event["kind"] for event in found["events"]}


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ("load", "--vary: expected two numbers"),
        ("load=a:b", "--vary: expected two numbers"),
        ("load=0:1:2", "--vary: expected two numbers"),
        ("load=1:0", "--vary: expected NAME=LOW:HIGH with LOW less than HIGH"),
        ("load=1:1", "--vary: expected NAME=LOW:HIGH with LOW less than HIGH"),
        ("load=0:inf", "--vary: expected NAME=LOW:HIGH with LOW less than HIGH"),
        ("load=nan:1", "--vary: expected NAME=LOW:HIGH with LOW less than HIGH"),
        ("exact=0:1", "--vary: expected NAME=LOW:HIGH with one of the parameters load"),
        ("load=0.1:1", "--vary: expected an interval that contains 0, the value in"),
    ],
)
def test_bad_intervals_are_one_sentence(capsys, truss, vary, words):
    code, out, err = commands.run(capsys, "branches", truss, "--vary", vary)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"polycorner: {words}")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "Missing option '--vary'"),
        (("--vary", "load=0:1", "--of", "z"), "--of: expected energy, or one of the coordinates"),
        (("--vary", "load=0:1", "--point", "top"), "--point: expected one of up, down"),
    ],
)
def test_bad_options_are_one_sentence(capsys, truss, options, words):
    code, out, err = commands.run(capsys, "branches", truss, *options)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"polycorner: {words}")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--vary", "rods=1:2"), "--vary: expected one of length, ball, rod, drum, rod-weight"),
        (("--vary", "rod=2:4"), "--vary: rod: expected a number > 0 and < 3 in mm"),
        (("--vary", "rod=2:2.5", "--rod", "1"), "--rod: expected a value from 2 to 2.5; got 1"),
        (("--vary", "drum=9:99", "--drum", "inf"), "--drum: expected a value from 9 to 99"),
        (("--vary", "rod=2.92:2.95"), "start: expected an equilibrium"),
    ],
)
def test_bad_sizes_of_dyads_are_one_sentence(capsys, options, words):
    code, out, err = commands.run(capsys, "branches", "dyad", *options)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"polycorner: {words}")

"""Landscapes on the command line: numbers by hand, files that are written, what is refused."""

import json
from math import inf, nextafter

import commands
import numpy as np
import pytest
from landscape_values import double_well, tree

from polycorner.cli import landscape as told
from polycorner.cli.landscape import Telling, report_landscape
from polycorner.files import load_landscape

WELLS = """
coordinates = [{ names = "(x, y)", box = [-3, 3] }]
energy.minimise = "(x**2 - 1)**2 + y**2 + x/10"
inequalities.disc = "9 - x**2 - y**2"
"""


@pytest.fixture
def wells(tmp_path):
    path = tmp_path / "wells.toml"
    path.write_text(WELLS)
    return str(path)


def test_two_wells_are_a_quartic(capsys, wells, tmp_path):
    out = tmp_path / "out"
    found = commands.answer(capsys, "landscape", wells, "--out", str(out))
    quartic = np.polynomial.Polynomial([1, 0.1, -2, 0, 1])  # along y = 0
    low, top, high = (quartic(x) for x in sorted(quartic.deriv().roots().real))
    assert found["complete"]
    assert [row["energy"] for row in found["minima"]] == pytest.approx([low, high])
    assert [row["depth"] for row in found["minima"]] == [
        [None] * 2,
        pytest.approx([top - high] * 2),
    ]
    (only,) = found["passes"]
    assert (only["energy"], only["index"], only["kind"]) == (pytest.approx(top), 1, "saddle")
    assert sorted(only["sides"]) == ["0", "1"]
    (way,) = found["barriers"]
    assert (way["from"], way["to"], way["proved"], way["verified"]) == ("1", "0", True, True)
    assert way["lower"] <= top <= way["upper"]
    assert way["upper"] - way["lower"] < 1e-9 * top
    names = {"landscape.json", "saved_landscape.json", "landscape.png"}
    assert {path.name for path in out.iterdir()} == names
    assert json.loads((out / "landscape.json").read_text()) == found
    assert load_landscape(out / "saved_landscape.json").complete


def test_what_is_found_from_starts_is_no_theorem(capsys, tmp_path):
    path = tmp_path / "anywhere.toml"
    path.write_text(WELLS.replace("box = [-3, 3]", "scale = 2.0"))
    found = commands.answer(capsys, "landscape", str(path), "--starts", "40")
    quartic = np.polynomial.Polynomial([1, 0.1, -2, 0, 1])
    low, top, high = (quartic(x) for x in sorted(quartic.deriv().roots().real))
    assert not found["complete"]
    assert [row["energy"] for row in found["minima"]] == pytest.approx([low, high])
    (way,) = found["barriers"]
    assert not way["proved"]
    assert way["upper"] == pytest.approx(top)


def test_a_cap_below_the_pass_leaves_it_out(capsys, wells):
    found = commands.answer(capsys, "landscape", wells, "--cap", "0.5")
    assert found["passes"] == []
    (way,) = found["barriers"]
    assert (way["lower"], way["upper"]) == (pytest.approx(0.5), None)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("box = [-3, 3] }", 'unit = "m" }'), "expected a box of x, y, in which passes are listed"),
        (('energy.minimise = "(x**2', 'title = "(x**2'), "energy: expected minimise or maximise"),
    ],
)
def test_a_file_without_what_is_needed_is_refused(capsys, tmp_path, change, words):
    path = tmp_path / "other.toml"
    path.write_text(WELLS.replace(*change))
    code, out, err = commands.run(capsys, "landscape", str(path))
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_limits_of_lists_are_refused_beside_starts(capsys, wells):
    limits = ("--starts", "9", "--seconds", "3", "--max-boxes", "9")
    code, _, err = commands.run(capsys, "landscape", wells, *limits)
    assert code == 2
    assert "--starts: expected no --max-boxes, --seconds beside it" in err


def test_balls_roll_over_the_corners_of_wedges(capsys):
    """Of which the lower one of the first pocket is at (3.2, 2.4); the board leans by 1/50."""
    found = commands.answer(capsys, "landscape", "pinball", "--cap", "2.6")
    lowest, pocket = found["minima"][:2]
    assert (lowest["active"], pocket["active"]) == (["left", "floor"], ["wedge1.ab", "wedge2.ab"])
    way = next(w for w in found["barriers"] if (w["from"], w["to"]) == ("1", "0"))
    assert way["lower"] == pytest.approx(2.4 + 3.2 / 50, abs=1e-12)
    assert way["upper"] == pytest.approx(2.4 + 3.2 / 50, abs=1e-9)


def report(capsys, found, telling, *, as_json=True):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(told, "shown", lambda sheet: sheet.text(100))
        report_landscape("hand", {}, found, telling, as_json=as_json, out=None)
    out = capsys.readouterr().out
    return json.loads(out) if as_json else out


def test_bounds_of_heights_are_rounded_outwards(capsys):
    found = double_well()
    plain = report(capsys, found, Telling())
    third = report(capsys, found, Telling("mm", lambda energy: energy / 3))
    (over,) = found.passes
    assert plain["passes"][0]["bounds"] == list(over.energy)
    assert third["passes"][0]["bounds"] == [
        nextafter(over.energy[0] / 3, -inf), nextafter(over.energy[1] / 3, inf),
    ]  # fmt: skip
    rise = third["barriers"][0]["rise"]
    assert rise[0] < (over.energy[0] - found.minima[1].energy[1]) / 3 < rise[1]
    assert rise == pytest.approx([x / 3 for x in plain["barriers"][0]["rise"]])


def test_minima_of_one_name_are_one_row_with_the_lowest_barrier(capsys):
    joins = [(0.6, (1, 3), {}), (0.7, (0, 2), {}), (0.9, (0, 1), {}), (0.95, (0, 2), {})]
    found = tree([0, 0, 0.5, 0.5], joins)
    names = ["low", "low", "high", "high"]
    answer = report(capsys, found, Telling(names=lambda _: names))
    assert [(row["name"], row["numbers"]) for row in answer["minima"]] == [
        ("low", [0, 1]), ("high", [2, 3]),
    ]  # fmt: skip
    (way,) = answer["barriers"]
    assert (way["from"], way["to"]) == ("high", "low")
    assert (way["lower"], way["upper"]) == (0.6, 0.6)
    assert [row["loop"] for row in answer["passes"]] == [False, False, False, True]


def test_a_region_is_left(capsys):
    found = tree([0, 0.1], [(0.4, (0, 1), {}), (0.7, (0, -1), {"kind": "exit"})], region=True)
    ways = report(capsys, found, Telling())["barriers"]
    assert [(w["from"], w["to"], w["upper"]) for w in ways] == [
        ("1", "0", 0.4), ("0", "outside", 0.7), ("1", "outside", 0.7),
    ]  # fmt: skip


def test_what_is_not_decided_is_one_line(capsys):
    boxes = [((0.5 + k, 0.8 + k), (), {"kind": "undecided"}) for k in range(300)]
    text = report(capsys, tree([0, 0.1], boxes), Telling(), as_json=False)
    assert "300 boxes are not decided, of energies from 0.500000000 to 299.800000000." in text
    assert len(text.splitlines()) < 20

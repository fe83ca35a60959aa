"""Minima on the command line."""

import json

import commands
import pytest


def run(capsys, *arguments):
    return commands.run(capsys, "minima", *arguments)


def test_pair_rests_in_three_ways(capsys, tmp_path):
    code, out, err = run(capsys, "dyad", "--starts", "300", "--json", "--out", str(tmp_path))
    assert (code, err) == (0, "")
    found = json.loads(out)
    lowest, *mirrored = [row["name"] for row in found["minima"]]
    assert (lowest, sorted(mirrored)) == ("G", ["delta_L", "delta_R"])
    assert [len(row["active"]) for row in found["minima"]] == [0, 3, 3]
    assert [row["chirality"] for row in found["minima"]] == [None, "L", "R"]
    assert found["energy_unit"] == "mm"
    for row, sign in zip(found["minima"], (0, -1, 1), strict=True):
        assert row["heading_deg"] == pytest.approx([sign * 7.942818] * 2, abs=1e-5)
    assert sum(row["count"] for row in found["minima"]) + sum(found["elsewhere"].values()) == 300
    assert found["minima"][0]["energy"] == pytest.approx(12)
    assert json.loads((tmp_path / "minima.json").read_text()) == found


def test_no_two_rows_are_alike(capsys):
    """Hand and heading tell both nested dyads apart, and the energy has a unit."""
    out = run(capsys, "dyad", "--starts", "100")[1]
    assert "energy (mm)" in out
    assert "heading (deg)" in out
    names = [line.split()[0] for line in out.partition("\n\n")[0].splitlines()]
    assert sorted(names) == ["G", "delta_L", "delta_R", "minimum"]


def test_same_seed_same_answer(capsys):
    first = run(capsys, "pinball", "--starts", "40", "--seed", "5", "--json")
    assert first == run(capsys, "pinball", "--starts", "40", "--seed", "5", "--json")
    assert first[0] == 0


def test_table_says_how_complete_it_is(capsys):
    code, out, _ = run(capsys, "pinball", "--starts", "40")
    assert code == 0
    assert "coverage" in out

"""Depths of dyads on the command line, against heights computed from the bodies."""

import json
import tomllib
from pathlib import Path

import pytest

from polycorner.cli.output import Verbosity
from polycorner.dumbbells import DumbbellPair, dyad_minima
from polycorner.dumbbells.cli.landscape import dyad
from polycorner.files import load_landscape

ENTRY = "polycorner.dumbbells.cli.landscape:dyad"


def run(capsys, *arguments):
    dyad.main(list(arguments), standalone_mode=False, obj=Verbosity())
    return capsys.readouterr().out


def test_it_is_registered():
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["polycorner.commands"]["landscape.dyad"] == ENTRY


def test_dyads_open_over_one_contact_and_change_their_hand_over_two(capsys, tmp_path):
    answer = json.loads(run(capsys, "--cap", "0.2", "--json", "--out", str(tmp_path)))
    pair = DumbbellPair(16, 3, 1.5, 125)
    heights = {one.name: one.height for one in dyad_minima(pair)}
    rows = {row["name"]: row for row in answer["minima"]}
    assert answer["complete"]
    assert {name: row["kind"] for name, row in rows.items()} == {
        "G": "locus", "delta_L": "isolated", "delta_R": "isolated",
    }  # fmt: skip
    for name, row in rows.items():
        assert row["energy"] == pytest.approx(heights[name] - heights["G"], abs=1e-9)
    opening, turning = answer["passes"]
    assert (len(opening["active"]), len(turning["active"])) == (1, 2)
    assert (opening["index"], turning["index"]) == (1, 1)
    # Side by side, ball on ball twice: the centres are r across from the lowest line.
    side_by_side = pair.energy.value(pair.side_by_side())
    assert turning["energy"] == pytest.approx(side_by_side - heights["G"], abs=1e-9)
    ways = {(way["from"], way["to"]): way for way in answer["barriers"]}
    assert set(ways) == {("delta_L", "G"), ("delta_R", "G"), ("delta_R", "delta_L")}
    for way in ways.values():
        low, high = way["rise"]
        assert way["proved"]
        assert way["verified"]
        assert way["lower"] <= opening["energy"] <= way["upper"]
        assert 0 <= high - low < 1e-9 * low
        assert low == pytest.approx(opening["energy"] - rows["delta_R"]["energy"], abs=1e-12)
    found = load_landscape(tmp_path / "saved_landscape.json")
    assert len(found.minima) == sum(len(row["numbers"]) for row in answer["minima"]) == 24
    assert (tmp_path / "landscape.png").stat().st_size > 10_000

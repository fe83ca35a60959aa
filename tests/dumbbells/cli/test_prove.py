"""The command ``polycorner prove``: proofs, failures and files."""

import json
from decimal import Decimal

import commands
import pytest


def run(capsys, *arguments):
    return commands.run(capsys, "prove", *arguments)


def answer(capsys, *arguments):
    return commands.answer(capsys, "prove", *arguments)


def test_corner_is_proved_and_enclosed(capsys):
    found = answer(capsys, "--digits", "40")
    assert found["proved"]
    assert set(found["conditions"].values()) == {"proved"}
    lower, upper = map(Decimal, found["enclosures"]["theta1_deg"])
    assert lower < upper
    assert upper - lower < Decimal("1e-35")
    assert float(lower) == pytest.approx(7.942818, abs=1e-6)


@pytest.mark.parametrize("minimum", ["delta_L", "G"])
def test_other_places_of_rest(capsys, minimum):
    assert answer(capsys, "--minimum", minimum)["proved"]


def test_thin_rods_rest_and_thick_ones_do_not(capsys):
    """The critical rod radius is 2 r sqrt(1 - r^2/l^2) - r = 2.8936 mm."""
    thin = answer(capsys, "--rod", "2.88", "--box", "t=2.87:2.89")
    assert thin["proved"]
    assert thin["proved_fraction"] == 1
    thick = answer(capsys, "--rod", "2.91", "--box", "t=2.9:2.92")
    assert not thick["proved"]
    assert thick["conditions"]["multipliers positive"] == "failed"


def test_files(capsys, tmp_path):
    code, out, _ = run(capsys, "--box", "t=1.49:1.51", "--out", str(tmp_path))
    assert code == 0
    assert "proved" in out
    assert json.loads((tmp_path / "proof.json").read_text())["proved"]
    assert (tmp_path / "cells.png").read_bytes().startswith(b"\x89PNG")

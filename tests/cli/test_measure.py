"""The command ``polycorner measure``: shares, rates and files."""

import json
import math

import commands
import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("own_searches")


def test_the_octahedron_has_four_percent(capsys, tmp_path):
    out = tmp_path / "out"
    code, printed, _ = commands.run(capsys, "measure", "spheres", "--count", "6", "--out", str(out))
    assert code == 0
    assert "0.96" in printed
    assert "0.04" in printed
    assert "With a stickiness K edges are met 14.2039 / K times as often" in " ".join(
        printed.split()
    )
    found = json.loads((out / "measure.json").read_text())
    shares = {row["symmetry_number"]: row["probability"] for row in found["corners"]}
    assert shares == pytest.approx({4: 0.96, 48: 0.04}, abs=1e-9)
    assert found["rates"] is None
    assert found["partition"]["1"] == 0
    assert (out / "clusters.png").stat().st_size > 1000


def test_rates_of_discs_balance(capsys):
    options = ("--count", "6", "--dimension", "2", "--stickiness", "1e6", "--diffusion", "2")
    found = commands.answer(capsys, "measure", "spheres", *options)
    p = np.array([row["probability"] for row in found["corners"]])
    flux = p[:, None] * found["rates"]
    assert np.allclose(flux, flux.T, rtol=1e-4)
    assert np.allclose(np.sum(found["rates"], axis=1), 0)
    half = commands.answer(capsys, "measure", "spheres", *options[:-1], "1")
    assert np.allclose(found["rates"], 2 * np.array(half["rates"]))


def test_a_hexagon_of_discs_has_a_share_with_a_stiffness(capsys):
    """Of seven discs it alone has twelve contacts, for eleven coordinates."""
    options = ("spheres", "--count", "7", "--dimension", "2", "--stickiness", "100")
    code, printed, _ = commands.run(capsys, "measure", *options)
    assert code == 0
    assert "C3 has more contacts than dimensions, and was declined" in printed
    assert "of the weight of corners and edges" in " ".join(printed.split())
    found = commands.answer(capsys, "measure", *options, "--stiffness", "1e4")
    shares = {len(row["active"]): row["probability"] for row in found["corners"]}
    assert shares[12] > 0.9
    assert np.isfinite(found["rates"]).all()


def test_a_region_in_a_file_weighed_with_its_faces(capsys, tmp_path):
    """``E = y`` on ``x^2 <= y <= 1``: the lid ``2 / e``, the area ``int exp(-y) 2 sqrt(y) dy``."""
    path = tmp_path / "bowl.toml"
    path.write_text(
        'coordinates = [{ names = "(x, y)", box = [-2, 2] }]\nenergy.minimise = "y"\n'
        'inequalities = { bowl = "y >= x**2", lid = "y <= 1" }\n'
    )
    found = commands.answer(capsys, "measure", str(path), "--faces", "20000")
    lid = next(row for row in found["edges"] if row["active"] == ["lid"])
    assert lid["weight"] == pytest.approx(2 / math.e, rel=1e-9)
    s = np.linspace(0, 1, 20001)
    area = np.trapezoid(4 * s**2 * np.exp(-(s**2)), s)
    total = found["faces_weight"]
    assert abs(total["value"] - area) < 4 * total["error"] < 0.1
    assert [face["weight"] for face in found["faces"]] == [total]
    code, printed, _ = commands.run(capsys, "measure", str(path), "--faces", "2000")
    assert code == 0
    assert "Without stickiness all faces weigh" in printed
    assert "In the sticky limit corners with the most contacts have all the weight." in printed

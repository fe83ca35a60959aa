"""The command ``polycorner dyad``: JSON, table, files, and one line for every mistake."""

import json
import math
import subprocess
import sys
import tomllib
from pathlib import Path

import commands
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner.dumbbells import DumbbellPair

EXAMPLES = Path(__file__).parents[3] / "examples"
FIELDS = {
    "name",
    "heading_deg",
    "azimuth_deg",
    "axial_gap",
    "height",
    "active",
    "multipliers",
    "signature",
    "entrapment",
    "verdict",
    "residuals",
}


def run(capsys, *arguments):
    return commands.run(capsys, *arguments)


def answer(capsys, *arguments):
    return commands.answer(capsys, "dyad", *arguments)


def test_json_has_the_promised_fields(capsys):
    found = answer(capsys)
    assert set(found) == {
        "parameters",
        "minima",
        "paper_heading_deg",
        "plane_heading_deg",
        "critical_rod_radius",
    }
    assert found["critical_rod_radius"] == pytest.approx(6 * math.sqrt(1 - (3 / 16) ** 2) - 3)
    assert [m["name"] for m in found["minima"]] == ["delta_R", "delta_L", "G"]
    for minimum in found["minima"]:
        assert set(minimum) >= FIELDS
        assert set(minimum["entrapment"]) == {"half-V", "half-U", "U", "free"}
        assert max(minimum["residuals"].values()) < 1e-12


def test_certified_corners_of_the_experiment(capsys):
    right, left, ends = answer(
        capsys, "--length", "16", "--ball", "3", "--rod", "1.5", "--drum", "125"
    )["minima"]
    for corner in (right, left):
        assert set(corner["active"]) == {"A2B1", "A2b", "aB1"}
        assert min(corner["multipliers"].values()) > 0
        assert corner["signature"] == [3, 2, 1]
        assert corner["entrapment"] == {"half-V": 3, "half-U": 0, "U": 2, "free": 1}
        assert "local minimum" in corner["verdict"]
    assert right["heading_deg"][0] > 0 > left["heading_deg"][0]
    np.testing.assert_allclose(right["heading_deg"], np.negative(left["heading_deg"]), rtol=1e-12)
    assert ends["signature"] == [0, 4, 2]
    assert ends["axial_gap"] >= 16 + 2 * 3


def test_json_heights_follow_from_its_own_coordinates(capsys):
    rho, length = 122.0, 16.0
    for minimum in answer(capsys)["minima"]:
        height = 0.0
        for azimuth, heading in zip(minimum["azimuth_deg"], minimum["heading_deg"], strict=True):
            half = math.asin(length * math.sin(math.radians(heading)) / (2 * rho))
            for sign in (-1, 1):
                height += 125 - rho * math.cos(math.radians(azimuth) + sign * half)
        assert minimum["height"] == pytest.approx(height, abs=1e-11)


def test_multipliers_are_the_price_of_opening_a_contact(capsys):
    """Hold every contact open by a little; the energy at rest rises by multiplier times gap."""
    from scipy.optimize import minimize

    pair = DumbbellPair(16, 3, 1.5, 125)
    corner = answer(capsys)["minima"][0]
    scales = np.array(pair.manifold.scales)
    start = pair.nested("R", clearance=0.05) / scales

    def rest(wanted):
        found = minimize(
            lambda u: (pair.energy.value(u * scales) - 12.0) * 1e2,
            start,
            jac=lambda u: pair.energy.gradient(u * scales) * scales * 1e2,
            constraints={
                "type": "ineq",
                "fun": lambda u: pair.polyhedron.values(u * scales) - wanted,
                "jac": lambda u: pair.polyhedron.gradients(u * scales) * scales,
            },
            method="SLSQP",
            options={"ftol": 1e-16, "maxiter": 500},
        )
        return found.fun / 1e2

    names, gap = list(pair.polyhedron.names), 1e-3
    for contact, multiplier in corner["multipliers"].items():
        offset = np.zeros(len(names))
        offset[names.index(contact)] = gap
        slope = (rest(offset) - rest(-offset)) / (2 * gap)
        assert slope == pytest.approx(multiplier, rel=1e-5)


def test_rod_weight_changes_nothing_that_is_printed(capsys):
    light, heavy = answer(capsys), answer(capsys, "--rod-weight", "0.8")
    for one, other in zip(light["minima"], heavy["minima"], strict=True):
        np.testing.assert_allclose(one["heading_deg"], other["heading_deg"], atol=1e-9)
        np.testing.assert_allclose(one["height"], other["height"], rtol=1e-12)
        for contact, value in one["multipliers"].items():
            assert other["multipliers"][contact] == pytest.approx(value, rel=1e-8)


def test_plane_agrees_with_its_closed_form(capsys):
    found = answer(capsys, "--drum", "inf")
    right = found["minima"][0]
    np.testing.assert_allclose(right["heading_deg"], found["plane_heading_deg"], rtol=1e-12)
    assert found["parameters"]["drum"] == "inf"
    assert right["azimuth_deg"] == [0.0, 0.0]


def test_a_corner_that_is_no_minimum_stays_and_says_so(capsys):
    right = answer(capsys, "--rod", "2.95")["minima"][0]
    assert set(right["active"]) == {"A2B1", "A2b", "aB1"}
    assert min(right["multipliers"].values()) < 0
    assert right["verdict"].startswith("not a minimum")
    assert not right["is_minimum"]


@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_shipped_configurations(capsys, file):
    expected = tomllib.loads(file.read_text())
    found = answer(capsys, "--config", str(file))
    assert {name: found["parameters"][name] for name in expected} == expected
    assert found["minima"][2]["is_minimum"]


def test_table_shows_what_the_json_holds(capsys):
    _, table, _ = run(capsys, "dyad")
    for minimum in answer(capsys)["minima"]:
        assert minimum["verdict"] in table
        assert f"{minimum['heading_deg'][0]:.6f}" in table
        for contact, value in minimum["multipliers"].items():
            assert f"{value:.9f}" in next(r for r in table.splitlines() if r.startswith(contact))
        for direction in minimum["entrapment_by_direction"]:
            assert direction in table


def test_files_are_written(capsys, tmp_path):
    code, out, _ = run(capsys, "dyad", "--out", str(tmp_path / "new" / "folder"))
    assert code == 0
    written = sorted((tmp_path / "new" / "folder").iterdir())
    assert [path.name for path in written] == [
        "G.png",
        "delta_L.png",
        "delta_R.png",
        "dyad.json",
        "heading.png",
    ]
    assert all(str(path) in out.replace("\n", "") for path in written)
    assert json.loads((tmp_path / "new" / "folder" / "dyad.json").read_text()) == answer(capsys)


@pytest.mark.parametrize(
    "text",
    ["lenght = 16", "length = 'long'", "length = true", "[length]\nmm = 3", "rod = nan"],
)
def test_mistakes_in_a_file_name_the_field(capsys, tmp_path, text):
    file = tmp_path / "pair.toml"
    file.write_text(text)
    code, _, err = run(capsys, "dyad", "--config", str(file))
    assert code == 2
    assert err.count("\n") == 1
    assert any(field in err for field in ("lenght", "length", "rod"))


@given(
    st.floats(-5, 40) | st.sampled_from([math.nan, math.inf, -math.inf]),
    st.floats(-1, 8),
    st.floats(-1, 8),
    st.floats(-10, 300) | st.just(math.inf),
)
def test_any_numbers_give_an_answer_or_one_line(length, ball, rod, drum):
    """Whatever the numbers, the model is built or refused with one sentence naming an option."""
    from click.exceptions import UsageError

    from polycorner.dumbbells.cli.options import chosen_pair

    values = {"length": length, "ball": ball, "rod": rod, "drum": drum, "rod_weight": 0.0}
    message, pair = "", None
    try:
        pair = chosen_pair(values)
    except UsageError as error:
        message = error.message
    if pair is None:
        assert message.split(":")[0] in {f"--{name}" for name in values}
    else:
        assert 0 < pair.rod_radius < pair.ball_radius <= pair.length / 2 < math.inf
        assert pair.length <= 2 * (pair.drum_radius - pair.ball_radius)


@pytest.mark.parametrize("arguments", [("--version",), ()])
def test_help_is_an_answer(capsys, arguments):
    code, out, err = run(capsys, *arguments)
    assert (code, err) == (0, "")
    assert "polycorner" in out


def test_help_loads_no_numerics():
    program = (
        "import sys; sys.argv = ['polycorner', '--help']\n"
        "from polycorner.cli.main import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'sympy', 'numba', 'scipy', 'matplotlib', 'rich', 'cvxpy'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stderr.strip() == "[]"

"""Commands on problems in files, and the check of saved proofs."""

import json
from decimal import Decimal, localcontext
from pathlib import Path

import commands
import numpy as np
import pytest

from polycorner import Manifold, Polyhedron, SmoothFunction
from polycorner.files import save_problem
from polycorner.models import Tutorial
from polycorner.proofs import stationary_points

CIRCLES = str(Path(__file__).parents[2] / "examples" / "problems/circles_in_square.toml")
BOWL = """
coordinates = [{ names = "(x, y)", box = [-2, 2] }]
energy.minimise = "t*x + y"
parameters.t = 0.5
inequalities = { bowl = "y >= x**2", lid = "y <= 1" }
[points]
corner = [-0.25, 0.0625]
low = ["-0.25", 0]
"""


@pytest.fixture
def bowl(tmp_path):
    path = tmp_path / "bowl.toml"
    path.write_text(BOWL)
    return str(path)


def test_circles_are_proved_from_their_file(capsys):
    (found,) = commands.answer(capsys, "prove", CIRCLES)["proofs"]
    low, high = map(Decimal, found["maximum"])
    assert found["proved"]
    with localcontext(prec=60):
        assert low <= (Decimal(2).sqrt() - 1) / 2 <= high
    assert high - low < Decimal("1e-28")
    assert found["statement"] == "strict local minimum"
    code, out, _ = commands.run(capsys, "prove", "--digits", "10", CIRCLES)
    assert code == 0
    assert out.startswith("quincunx\n")
    assert "lies between 0.20710678" in out


def test_points_are_chosen_and_the_given_one_is_judged_apart(capsys, bowl):
    corner, low = commands.answer(capsys, "prove", bowl, "--minimise", "--digits", "12")["proofs"]
    assert (corner["point"], low["point"]) == ("corner", "low")
    assert corner["proved"]
    assert low["proved"]
    assert corner["enclosures"]["x"] == low["enclosures"]["x"]
    assert "bowl" in low["given"]["violated"]
    assert corner["given"]["violated"] == {}
    assert "maximum" not in corner
    (only,) = commands.answer(capsys, "prove", bowl, "--point", "low")["proofs"]
    assert only["point"] == "low"
    assert not only["proved"]  # certified where it is, below the bowl


def test_a_parameter_of_the_file_varies_over_a_box(capsys, bowl):
    line = ("prove", bowl, "--point", "corner", "--minimise", "--box", "t=0.4:0.6")
    (found,) = commands.answer(capsys, *line)["proofs"]
    assert found["proved"]
    assert found["box"] == {"t": [0.4, 0.6]}
    low, high = map(float, found["enclosures"]["x"])
    assert low <= -0.3
    assert high >= -0.2


def test_rattlers_are_reported_with_their_room(capsys, tmp_path):
    path = tmp_path / "rattler.toml"
    text = Path(CIRCLES).read_text()
    text = text.replace('{ names = "r"', '"free", { names = "r"').replace(
        "[0.5, 0.5]", "[0.5, 0.5, 0.2]"
    )
    path.write_text(text.replace("[points]", 'loose = "-1 <= free <= 1"\n[points]'))
    (found,) = commands.answer(capsys, "prove", str(path))["proofs"]
    assert found["proved"]
    assert [*found["rattlers"]] == ["free"]
    low, high = map(float, found["rattlers"]["free"])
    assert -1 <= low < 0.2 < high <= 1
    assert "free to move" in commands.run(capsys, "prove", str(path))[1]


def test_what_is_proved_is_written(capsys, tmp_path, bowl):
    out = tmp_path / "out"
    code, _, _ = commands.run(capsys, "prove", bowl, "--point", "corner", "--out", str(out))
    assert code == 0
    (found,) = json.loads((out / "proofs.json").read_text())["proofs"]
    assert found["proved"]
    if "file" in found:
        code, said, _ = commands.run(capsys, "verify", found["file"])
        assert code == 0
        assert said.startswith("verified: ")


def test_dumbbells_are_proved_without_a_file(capsys, tmp_path):
    (tmp_path / "pair.toml").write_text("drum = inf\ndigits = 5\n")
    line = ("prove", "--config", str(tmp_path / "pair.toml"))
    found = commands.answer(capsys, *line)
    assert found["minimum"] == "delta_R"
    assert found["proved"]


def test_the_atlas_of_a_file_is_that_of_the_model(capsys, tmp_path):
    path = tmp_path / "region.toml"
    region = Tutorial()
    save_problem(path, region.polyhedron, box=[(-3, 3), (-3, 3)])
    out = tmp_path / "out"
    code, _, _ = commands.run(capsys, "atlas", str(path), "--out", str(out))
    assert code == 0
    found = json.loads((out / "atlas.json").read_text())
    known = commands.answer(capsys, "atlas", "tutorial")
    for key in ("components", "euler_characteristic", "complete"):
        assert found[key] == known[key]
    points = sorted(corner["point"] for corner in found["corners"])
    assert np.allclose(points, sorted(corner["point"] for corner in known["corners"]))
    assert (out / "region.png").stat().st_size > 1000


def test_the_atlas_of_a_set_in_space_has_no_picture(capsys, tmp_path):
    path = tmp_path / "cube.toml"
    path.write_text(
        'coordinates = [{ names = "x[i] for i in 1..3", box = [0, 1] }]\n'
        '[inequalities]\n"side[i] for i in 1..3" = "0 <= x[i] <= 1"\n'
    )
    found = commands.answer(capsys, "atlas", str(path), "--out", str(tmp_path / "out"))
    assert found["components"] == {"0": 8, "1": 12, "2": 6, "3": 1}
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["atlas.json"]


def test_minima_of_a_file(capsys, tmp_path):
    path = tmp_path / "well.toml"
    path.write_text(
        'coordinates = [{ names = "x", box = [-2, 2] }, { names = "t", period = "2*pi" }]\n'
        'energy.minimise = "(x**2 - 1)**2 - cos(t)"\ninequalities.wall = "x >= -3"\n'
    )
    found = commands.answer(capsys, "minima", str(path), "--starts", "40")
    assert found["model"] == "well"
    assert sorted(round(row["point"][0], 6) for row in found["minima"]) == [-1.0, 1.0]
    assert sum(row["count"] for row in found["minima"]) + sum(found["elsewhere"].values()) == 40


def test_a_region_is_shown(capsys, tmp_path, bowl):
    path = tmp_path / "bowl.png"
    code, out, _ = commands.run(capsys, "view", bowl, "--out", str(path))
    assert (code, out) == (0, f"wrote {path}\n")
    assert path.read_bytes().startswith(b"\x89PNG")
    code, _, err = commands.run(capsys, "view", CIRCLES)
    assert code == 2
    assert "two coordinates" in err


MISTAKES = [
    (("prove", "nowhere.toml"), "cannot be read"),
    (("atlas", "broken.toml"), "broken.toml, line 2"),
    (("minima", "broken.toml"), "inequalities.f"),
    (("view", "broken.toml"), "inequalities.f"),
    (("prove", "broken.toml"), "inequalities.f"),
    (("prove", "set.toml"), "energy"),
    (("minima", "set.toml"), "energy"),
    (("prove", "nothing.toml"), "points"),
    (("prove", "bowl.toml", "--point", "cornr"), "did you mean corner?"),
    (("prove", "bowl.toml", "--box", "s=1:2"), "--box"),
    (("prove", "bowl.toml", "--box", "t=1"), "--box"),
    (("prove", "bowl.toml", "--digits", "0"), "--digits"),
    (("prove", "bowl.toml", "--drum", "1"), "--drum"),
    (("verify",), "FILE"),
]


@pytest.mark.parametrize(("line", "expected"), MISTAKES)
def test_a_mistake_is_one_line(capsys, monkeypatch, tmp_path, line, expected):
    monkeypatch.chdir(tmp_path)
    Path("bowl.toml").write_text(BOWL)
    Path("broken.toml").write_text('coordinates = ["x"]\ninequalities.f = "x +"\n')
    Path("set.toml").write_text('coordinates = ["x"]\ninequalities.f = "x"\npoints.p = [0]\n')
    Path("nothing.toml").write_text(
        'coordinates = ["x"]\ninequalities.f = "x"\nenergy.minimise = "x"\n'
    )
    code, out, err = commands.run(capsys, *line)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert expected in err


def test_help_is_that_of_the_file(capsys):
    code, out, _ = commands.run(capsys, "prove", CIRCLES, "--help")
    assert code == 0
    assert "--minimise" in out


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A complete list, saved."""
    M = Manifold.euclidean("x")
    (x,) = M.symbols
    f = SmoothFunction("energy", (x**2 - 1) ** 2, M)
    found = stationary_points(Polyhedron(M, {"left": x + 2, "right": 2 - x}), f, box=[(-2, 2)])
    return found.save(tmp_path_factory.mktemp("saved") / "list.zip")


def test_saved_lists_are_verified(capsys, tmp_path, saved):
    code, out, _ = commands.run(capsys, "verify", str(saved))
    assert code == 0
    assert out.startswith("verified: ")
    damaged = tmp_path / "damaged.zip"
    content = Path(saved).read_bytes()
    damaged.write_bytes(content[: len(content) // 2])
    code, out, _ = commands.run(capsys, "verify", str(damaged), "nowhere.zip", str(saved), "--json")
    assert code == 1
    assert [row["verified"] for row in json.loads(out)] == [False, False, True]
    code, out, _ = commands.run(capsys, "verify", str(damaged))
    assert code == 1
    assert out.startswith("NOT VERIFIED: ")

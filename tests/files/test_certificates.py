"""Certificates in files: certified again, and refused where the results differ."""

import json
import math

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from kept_files import rewritten
from kept_files import same_certificate as same

from polycorner import AnyOf, Manifold, Polyhedron, SmoothFunction, Verdict, certify, minimise
from polycorner.dumbbells import DumbbellPair
from polycorner.files import load_certificate, save_certificate
from polycorner.files.certificates import KIND
from polycorner.models import Pinball, SphereCluster, TorusDisks, Tutorial

M = Manifold.euclidean("x y")
X, Y = M.symbols
BOWL = Polyhedron(M, {"bowl": Y - X**2, "lid": 2 - Y})
SUM = X + Y
PAIR = DumbbellPair(16, 3, 1.5, 125)
CLUSTER = SphereCluster(4)
FREE = sympy.Add(*[CLUSTER.manifold.symbols[k] ** 2 for k in range(12)])


@pytest.fixture(scope="module")
def lowest():
    return minimise(BOWL, SUM, [1.0, 1.5])


@pytest.fixture
def saved(lowest, tmp_path):
    return save_certificate(lowest, tmp_path / "lowest.json")


def test_ones_own_polyhedron_need_not_be_passed(lowest, saved):
    for arguments in ((), (BOWL,), (BOWL, SUM), (None, SUM)):
        read = load_certificate(saved, *arguments)
        same(read, lowest)
        assert read.holds()


@pytest.mark.parametrize(
    "found",
    [
        lambda: minimise(PAIR.polyhedron, PAIR.energy, PAIR.nested("R")),
        lambda: minimise(PAIR.section(0.3), PAIR.energy, PAIR.nested("L")),
        lambda: certify(Pinball().polyhedron, Pinball().energy, [0.0, 0.0]),
        lambda: certify(Tutorial().polyhedron, Y, Tutorial().corners()["A"]),
        lambda: certify(CLUSTER.polyhedron, FREE, CLUSTER.stacked()),
        lambda: certify(TorusDisks(2).polyhedron, TorusDisks(2).energy, [0.1, 0.0, 0.6, 0.5, 0.25]),
    ],
)
def test_certificates_of_models_are_read_from_the_file_alone(tmp_path, found):
    certificate = found()
    read = load_certificate(save_certificate(certificate, tmp_path / "model.json"))
    np.testing.assert_array_equal(read.point, certificate.point)
    assert read.verdict is certificate.verdict
    assert read.active == certificate.active
    assert read.problem.polyhedron.manifold.units == certificate.problem.polyhedron.manifold.units


def test_the_file_alone_shows_that_the_point_is_stationary(tmp_path):
    """``dE = sum lam_i df_i`` from nothing but the numbers in the file."""
    certificate = minimise(PAIR.polyhedron, PAIR.energy, PAIR.nested("R"))
    written = json.loads(save_certificate(certificate, tmp_path / "pair.json").read_text())
    held = [row for row in written["functions"] if row["active"]]
    assert len(held) == 3
    pull = sum(row["multiplier"] * np.array(row["gradient"]) for row in held)
    scales = np.array([c["scale"] for c in written["coordinates"]])
    np.testing.assert_allclose(pull * scales, written["energy"]["gradient"] * scales, atol=1e-9)
    assert all(abs(row["value"]) < 1e-9 for row in held)
    assert written["verdict"] == "MINIMUM_ALONG_LOCUS"


def test_units_are_those_of_the_manifold_and_the_functions(tmp_path):
    certificate = certify(PAIR.polyhedron, PAIR.energy, PAIR.nested("R"))
    written = json.loads(save_certificate(certificate, tmp_path / "pair.json").read_text())
    units = {c["name"]: c["unit"] for c in written["coordinates"]}
    assert units == {"phi1": "rad", "eta1": "mm", "theta1": "rad"} | {
        "phi2": "rad", "eta2": "mm", "theta2": "rad"
    }  # fmt: skip
    assert {row["unit"] for row in (*written["functions"], written["energy"])} == {"mm"}
    assert [c["period"] for c in written["coordinates"]][:2] == [math.tau, "inf"]
    space = Manifold(("x",), units=("m",))
    (x,) = space.symbols
    half = Polyhedron(space, [SmoothFunction("wall", x, space, unit="m")])
    energy = SmoothFunction("work", x, space, unit="J")
    path = save_certificate(certify(half, energy, [0.0]), tmp_path / "own.json")
    written = json.loads(path.read_text())
    stated = (written["coordinates"], written["functions"], [written["energy"]])
    assert [row["unit"] for (row,) in stated] == ["m", "m", "J"]


# ---------------------------------------------------------------------------------- other problems


@pytest.mark.parametrize(
    ("parts", "energy", "told"),
    [
        ({"bowl": Y - X**2, "cap": 2 - Y}, SUM, "functions: written bowl, lid, found bowl, cap"),
        ({"bowl": Y - X**2, "lid": 2.1 - Y}, SUM, "value of 'lid'"),
        ({"bowl": Y - X**2, "lid": 2 - Y + (X + 0.5) * 1e-6}, SUM, "gradient of 'lid'"),
        ({"bowl": Y - X**2, "lid": 2 - Y}, SUM + 1e-6, "value of 'energy'"),
        ({"bowl": Y - X**2, "lid": 2 - Y}, SUM + 1e-6 * (X + 0.5), "gradient of 'energy'"),
        ({"bowl": Y - X**2, "lid": 2 - Y}, SUM + 0.01 * (X + 0.5) ** 2, "curvatures"),
        ({"bowl": Y - X**2 - (X + 0.5) ** 2, "lid": 2 - Y}, SUM, "curvatures"),
    ],
)
def test_another_problem_is_refused_naming_the_difference(saved, parts, energy, told):
    with pytest.raises(ValueError, match=rf"^path: expected a certificate .*: {told}"):
        load_certificate(saved, Polyhedron(M, parts), energy)


@pytest.mark.parametrize(
    ("manifold", "told"),
    [
        (Manifold.euclidean("x z"), "names of the coordinates: written x, y, found x, z"),
        (Manifold(("x", "y"), (math.inf, 9.0)), "periods of the coordinates"),
        (Manifold(("x", "y"), (), (1.0, 2.0)), "scales of the coordinates"),
    ],
)
def test_another_space_is_refused(saved, manifold, told):
    x, y = manifold.symbols
    y = y if manifold.periods[1] == math.inf else sympy.sin(2 * sympy.pi * y / 9)
    d = Polyhedron(manifold, {"bowl": y - x**2, "lid": 2 - y})
    with pytest.raises(ValueError, match=told):
        load_certificate(saved, d, x + y)


def test_the_tree_counts_as_well(saved):
    """Joined by *or* the lid's inequality holds below it, and the bowl's does not matter."""
    union = Polyhedron(M, AnyOf(*BOWL.functions))
    with pytest.raises(ValueError, match=r"multiplier of 'bowl'"):
        load_certificate(saved, union, SUM)


def test_the_tolerance_is_an_argument(saved):
    nearly = SUM + 1e-7
    with pytest.raises(ValueError, match="value of 'energy'"):
        load_certificate(saved, BOWL, nearly)
    assert load_certificate(saved, BOWL, nearly, tolerance=1e-6).is_minimum


@pytest.mark.parametrize(
    ("call", "kind", "argument"),
    [
        (lambda path: save_certificate("certificate", path), TypeError, "certificate"),
        (lambda path: load_certificate(path, tolerance=0), ValueError, "tolerance"),
    ],
)
def test_wrong_arguments_get_a_sentence(saved, call, kind, argument):
    with pytest.raises(kind, match=rf"^{argument}: expected"):
        call(saved)


# ------------------------------------------------------------------------- files made by someone


def moved(entries):
    entries["coordinates"][0]["value"] += 1e-6


def heavier(entries):
    entries["functions"][0]["multiplier"] *= 1.001


def better(entries):
    entries["residuals"]["stationarity"] = 0.5


def flatter(entries):
    entries["curvatures"] = []


def renamed(entries):
    entries["verdict"] = "WEAK_MINIMUM"


def lifted(entries):
    entries["entrapment"] = dict.fromkeys(entries["entrapment"], "free")


def idle(entries):
    entries["functions"][0]["active"] = False


def other(entries):
    entries["problem"]["families"][0]["formulas"]["bowl"] = "y - x**2 - 0.1"


@pytest.mark.parametrize("change", [moved, heavier, better, flatter, renamed, lifted, idle, other])
def test_results_that_are_not_computed_again_are_refused(saved, change):
    rewritten(KIND, saved, change)
    with pytest.raises(ValueError, match=r"or was not computed here: \w+"):
        load_certificate(saved)


@pytest.mark.parametrize(
    "change",
    [
        *(
            lambda entries, key=key: entries.pop(key)
            for key in ("coordinates", "functions", "energy", "problem", "search", "residuals")
        ),
        lambda entries: entries["problem"]["families"][0]["formulas"].update(bowl="open('f')"),
        lambda entries: entries["problem"].update(tree={"all": [7]}),
        lambda entries: entries.update(search="FOUND"),
    ],
)
def test_other_entries_are_damage(saved, change):
    rewritten(KIND, saved, change)
    with pytest.raises(ValueError, match=r"^path: expected a certificate .* is damaged"):
        load_certificate(saved)


def test_multipliers_that_are_not_unique_have_ranges_also_endless_ones(tmp_path):
    """A line as two half-planes: one may press as hard as the other withstands."""
    line = Polyhedron(M, {"above": Y, "below": -Y})
    certificate = certify(line, X**2 + Y, [0.0, 0.0])
    path = save_certificate(certificate, tmp_path / "line.json")
    written = json.loads(path.read_text())
    assert not written["multipliers unique"]
    (least, *most), (zero, *more) = (row["multiplier range"] for row in written["functions"])
    assert (zero, most, more) == (0.0, ["inf"], ["inf"])
    assert least == pytest.approx(1, abs=1e-14)
    same(load_certificate(path), certificate)
    rewritten(KIND, path, lambda entries: entries["functions"][0]["multiplier range"].reverse())
    with pytest.raises(ValueError, match="multiplier range of 'above': written inf, 1, found 1, i"):
        load_certificate(path)


def test_a_failed_search_is_kept(tmp_path):
    """Infeasible starts, unbounded energies: the verdict of the search is in the file."""
    far = minimise(Polyhedron(M, {"left": -1 - X, "right": X - 1}), X + Y, [0.0, 0.0])
    assert far.verdict is Verdict.INFEASIBLE
    same(load_certificate(save_certificate(far, tmp_path / "far.json")), far)


@given(st.floats(-3, 3), st.sampled_from([0.0, 1e-9, 0.5, -0.5]), st.booleans())
def test_any_certificate_survives(tmp_path_factory, x, above, lowest):
    """Minima, points of the boundary and of the inside, and points outside."""
    q = [-0.5, 0.25] if lowest else [x, x**2 + above]
    certificate = certify(BOWL, SUM, q)
    path = save_certificate(certificate, tmp_path_factory.mktemp("c") / "c.json")
    same(load_certificate(path), certificate)

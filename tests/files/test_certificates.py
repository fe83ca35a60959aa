"""Certificates in files: certified anew, and refused where they differ."""

import json
import math

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from kept_files import resealed
from kept_files import same_certificate as same

from polycorner import AnyOf, Manifold, Polyhedron, Verdict, certify, minimise
from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.files import load_certificate, save_certificate
from polycorner.models import Pinball, SphereCluster, TorusDisks, Tutorial

M = Manifold.euclidean("x y")
X, Y = M.symbols
BOWL = Polyhedron(M, {"bowl": Y - X**2, "lid": 2 - Y})
SUM = X + Y
PAIR = DumbbellPair(16, 3, 1.5, 125)


@pytest.fixture(scope="module")
def lowest():
    return minimise(BOWL, SUM, [1.0, 1.5])


@pytest.fixture
def saved(lowest, tmp_path):
    return save_certificate(lowest, tmp_path / "lowest.json")


def test_a_certificate_of_ones_own_polyhedron(lowest, saved):
    read = load_certificate(saved, BOWL, SUM)
    same(read, lowest)
    assert read.holds()


def at(model, q, energy=None):
    return certify(model.polyhedron, model.energy if energy is None else energy, q)


REGION = Tutorial(2.0)
CLUSTER = SphereCluster(4)
FREE = sympy.Add(*[CLUSTER.manifold.symbols[k] ** 2 for k in range(12)])


@pytest.mark.parametrize(
    ("model", "found", "energy"),
    [
        (PAIR, lambda: minimise(PAIR.polyhedron, PAIR.energy, PAIR.nested("R")), None),
        (PAIR, lambda: minimise(PAIR.section(0.3), PAIR.energy, PAIR.nested("L")), None),
        (DumbbellPair(16, 3, 1.5, rod_weight=0.5), None, None),
        (Pinball(), lambda: at(Pinball(), [0.0, 0.0]), None),
        (TorusDisks(2, "hexagonal"), None, None),
        (REGION, lambda: at(REGION, REGION.corners()["A"], REGION.manifold.symbols[1]), True),
        (CLUSTER, lambda: at(CLUSTER, CLUSTER.stacked(), FREE), FREE),
    ],
)
def test_a_model_is_made_again_from_the_file(tmp_path, model, found, energy):
    rng = np.random.default_rng(1)
    start = model.nested("R") if isinstance(model, DumbbellPair) else None
    if found is None:
        start = model.starts(rng, 1)[0] if start is None else start
        certificate = minimise(model.polyhedron, model.energy, start)
    else:
        certificate = found()
    path = save_certificate(certificate, tmp_path / "model.json", model=model)
    if energy is None:
        same(load_certificate(path), certificate)
    else:
        given = certificate.problem.energy
        same(load_certificate(path, energy=given), certificate)
        with pytest.raises(ValueError, match=r"^energy: expected that of the certificate"):
            load_certificate(path)


def test_the_file_alone_shows_that_the_point_is_stationary(tmp_path):
    """``dE = sum lam_i df_i`` from nothing but the numbers in the file."""
    certificate = minimise(PAIR.polyhedron, PAIR.energy, PAIR.nested("R"))
    written = json.loads(
        save_certificate(certificate, tmp_path / "pair.json", model=PAIR).read_text()
    )
    held = [row for row in written["functions"] if row["active"]]
    assert len(held) == 3
    pull = sum(row["multiplier"] * np.array(row["gradient"]) for row in held)
    scales = np.array([c["scale"] for c in written["coordinates"]])
    np.testing.assert_allclose(pull * scales, written["energy"]["gradient"] * scales, atol=1e-9)
    assert all(abs(row["value"]) < 1e-9 for row in held)
    assert written["verdict"] == "MINIMUM_ALONG_LOCUS"


def test_angles_and_lengths_have_their_units(tmp_path):
    certificate = at(PAIR, PAIR.nested("R"))
    written = json.loads(save_certificate(certificate, tmp_path / "pair.json").read_text())
    units = {c["name"]: c["unit"] for c in written["coordinates"]}
    assert units == {"phi1": "rad", "eta1": "mm", "theta1": "rad"} | {
        "phi2": "rad", "eta2": "mm", "theta2": "rad"
    }  # fmt: skip
    assert {row["unit"] for row in written["functions"]} == {"mm"}
    assert written["energy"]["unit"] == "mm"
    assert [c["period"] for c in written["coordinates"]][:2] == [math.tau, "inf"]


def test_units_can_be_stated(lowest, tmp_path):
    path = save_certificate(
        lowest, tmp_path / "c.json", units={"x": "m", "lid": "m", "energy": "J"}
    )
    written = json.loads(path.read_text())
    assert [c["unit"] for c in written["coordinates"]] == ["m", None]
    assert [row["unit"] for row in written["functions"]] == [None, "m"]
    assert written["energy"]["unit"] == "J"
    for units in ({"z": "m"}, {"x": ""}, {"x": 3}):
        with pytest.raises(ValueError, match=r"^units: expected"):
            save_certificate(lowest, tmp_path / "c.json", units=units)


# --------------------------------------------------------------------------------- other problems


@pytest.mark.parametrize(
    ("parts", "energy", "told"),
    [
        ({"bowl": Y - X**2, "cap": 2 - Y}, SUM, "functions: written bowl, lid, found bowl, cap"),
        ({"bowl": Y - X**2, "lid": 2.1 - Y}, SUM, "value of 'lid'"),
        ({"bowl": Y - X**2, "lid": 2 - Y + (X + 0.5) * 1e-6}, SUM, "scaled gradient of 'lid'"),
        ({"bowl": Y - X**2, "lid": 2 - Y}, SUM + 1e-6, "value of 'energy'"),
        ({"bowl": Y - X**2, "lid": 2 - Y}, SUM + 1e-6 * (X + 0.5), "scaled gradient of 'energy'"),
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
    d = Polyhedron(manifold, {"bowl": y - x**2, "lid": 2 - y})
    with pytest.raises(ValueError, match=told):
        load_certificate(saved, d, x + y)


def test_the_tree_counts_as_well(lowest, tmp_path):
    """Joined by *or* the lid's inequality holds below it, and the bowl's does not matter."""
    path = save_certificate(lowest, tmp_path / "c.json")
    union = Polyhedron(M, AnyOf(*BOWL.functions))
    with pytest.raises(
        ValueError,
        match=r"multiplier of 'bowl'",
    ):
        load_certificate(path, union, SUM)


def test_what_is_missing_is_named(saved):
    with pytest.raises(ValueError, match=r"^polyhedron: expected that of bowl, lid"):
        load_certificate(saved)
    with pytest.raises(ValueError, match=r"^energy: expected that of the certificate"):
        load_certificate(saved, BOWL)


def test_the_tolerance_is_an_argument(saved):
    nearly = SUM + 1e-7
    with pytest.raises(ValueError, match="value of 'energy'"):
        load_certificate(saved, BOWL, nearly)
    assert load_certificate(saved, BOWL, nearly, tolerance=1e-6).is_minimum
    with pytest.raises(ValueError, match=r"^tolerance: expected a number > 0 and < 1"):
        load_certificate(saved, BOWL, nearly, tolerance=0)


@pytest.mark.parametrize(
    "model", [DumbbellPair(16, 3, 1.5, 126), DumbbellPair(16, 3, 1.4, 125), Tutorial()]
)
def test_another_model_is_refused_when_saving(tmp_path, model):
    certificate = at(PAIR, PAIR.nested("R"))
    with pytest.raises(ValueError, match=r"^model: expected the one that the certificate is of"):
        save_certificate(certificate, tmp_path / "c.json", model=model)
    assert not list(tmp_path.iterdir())


def test_models_that_are_not_listed_are_refused(lowest, tmp_path):
    for model in (BOWL, DumbbellDrum(), "DumbbellPair"):
        with pytest.raises(TypeError, match=r"^model: expected one of DumbbellPair"):
            save_certificate(lowest, tmp_path / "c.json", model=model)
    with pytest.raises(TypeError, match=r"^certificate: expected a Certificate"):
        save_certificate("certificate", tmp_path / "c.json")


# ------------------------------------------------------------------------------------- wrong files


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


@pytest.mark.parametrize("change", [moved, heavier, better, flatter, renamed, lifted, idle])
def test_what_is_not_computed_again_is_refused_even_with_a_digest(saved, change):
    resealed(saved, change)
    with pytest.raises(ValueError, match=r"is not what is computed here: \w+"):
        load_certificate(saved, BOWL, SUM)


@pytest.mark.parametrize(
    "entry", ["coordinates", "functions", "energy", "model", "search", "residuals"]
)
def test_what_is_missing_in_a_file_is_damage(saved, entry):
    resealed(saved, lambda entries: entries.pop(entry))
    with pytest.raises(
        ValueError, match=r"^path: expected a certificate that save_certificate wrote"
    ):
        load_certificate(saved, BOWL, SUM)


@pytest.mark.parametrize(
    "model",
    [
        {"class": "Popen", "parameters": {"args": "true"}, "heading": None, "has the energy": True},
        {"class": "Tutorial", "parameters": {}, "heading": None, "has the energy": True},
        {
            "class": "Tutorial",
            "parameters": {"size": -1.0},
            "heading": None,
            "has the energy": True,
        },
    ],
)
def test_only_listed_models_are_made(saved, model):
    resealed(saved, lambda entries: entries.update(model=model))
    with pytest.raises(ValueError, match="is of a model that cannot be made"):
        load_certificate(saved)


def test_multipliers_that_are_not_unique_have_ranges_also_endless_ones(tmp_path):
    """A line as two half-planes: one may press as hard as the other withstands."""
    line = Polyhedron(M, {"above": Y, "below": -Y})
    certificate = certify(line, X**2 + Y, [0.0, 0.0])
    path = save_certificate(certificate, tmp_path / "line.json")
    written = json.loads(path.read_text())
    assert not written["multipliers unique"]
    assert [row["multiplier range"] for row in written["functions"]] == [[1.0, "inf"], [0.0, "inf"]]
    same(load_certificate(path, line, X**2 + Y), certificate)
    resealed(path, lambda entries: entries["functions"][0]["multiplier range"].reverse())
    with pytest.raises(ValueError, match="multiplier range of 'above': written inf, 1, found 1, i"):
        load_certificate(path, line, X**2 + Y)


def test_a_failed_search_is_kept(tmp_path):
    """Infeasible starts, unbounded energies: the verdict of the search is in the file."""
    far = minimise(Polyhedron(M, {"left": -1 - X, "right": X - 1}), X + Y, [0.0, 0.0])
    assert far.verdict is Verdict.INFEASIBLE
    path = save_certificate(far, tmp_path / "far.json")
    d = far.problem.polyhedron
    same(load_certificate(path, d, X + Y), far)


@given(st.floats(-3, 3), st.sampled_from([0.0, 1e-9, 0.5, -0.5]), st.booleans())
def test_any_certificate_survives(tmp_path_factory, x, above, lowest):
    """Minima, points of the boundary and of the inside, and points outside."""
    q = [-0.5, 0.25] if lowest else [x, x**2 + above]
    certificate = certify(BOWL, SUM, q)
    path = save_certificate(certificate, tmp_path_factory.mktemp("c") / "c.json")
    same(load_certificate(path, BOWL, SUM), certificate)

"""The formulas near the nested corner are those of the relative placements; cells are proved."""

import math

import numpy as np
import pytest
import sympy as sp

from paper_checks.section6 import range_of_sizes
from paper_checks.section6.range_of_sizes import BALL, CHART, NEAR, corner
from polycorner import SmoothFunction
from polycorner.dumbbells import DumbbellPair, RelativePlacements
from polycorner.proofs import stationary_points

SIZES = [(16.0, 1.5), (14.0, 1.8), (18.0, 1.2), (14.7, 1.21)]
CELL = {"l": (15.95, 16.0), "t": (1.45, 1.5)}
NEARBY = np.array([[-0.1, -0.2, -0.02, -0.01], [0.1, 0.2, 0.02, 0.01]])


def placed(q, length, rod):
    """Return the relative placement ``(..., 4)`` of points near the corner, from the geometry."""
    p = BALL + rod
    s = math.sqrt(4 * BALL**2 - p**2)
    u, v = p + q[..., 0], length - s + q[..., 1]
    rest = -math.atan2(2 * p * (length - s), (length - s) ** 2 - p**2 + length**2) / 2
    mean = rest + q[..., 2]
    x = (v * np.sin(mean) + u * np.cos(mean)) / 2
    y = v * np.cos(mean) - u * np.sin(mean)
    return np.stack([x, y, mean - q[..., 3], mean + q[..., 3]], axis=-1)


def evaluated(formulas, manifold, q, **sizes):
    found = {}
    for name, formula in formulas.items():
        known = {k: x for k, x in sizes.items() if sp.Symbol(k) in formula.free_symbols}
        found[name] = SmoothFunction(name, formula, manifold, parameters=known).value(q)
    return found


@pytest.fixture(scope="module", params=SIZES, ids=str)
def sample(request):
    length, rod = request.param
    q = np.random.default_rng(1).uniform(*NEARBY, (500, 4))
    model = RelativePlacements(DumbbellPair(length=length, ball_radius=BALL, rod_radius=rod))
    return q, model, {"l": length, "t": rod}


def test_contacts_and_energy_are_those_of_the_model(sample):
    q, model, sizes = sample
    at = placed(q, sizes["l"], sizes["t"])
    theirs = dict(zip(model.polyhedron.names, model.polyhedron.values(at).T, strict=True))
    ours = evaluated(corner().contacts, NEAR, q, **sizes)
    assert np.allclose(ours["A2B1"], (theirs["A2B1"] + 2 * BALL) ** 2 - 4 * BALL**2, atol=1e-11)
    assert np.allclose(ours["A2b"], theirs["A2b"], atol=1e-12)
    assert np.allclose(ours["aB1"], theirs["aB1"], atol=1e-12)
    energies = evaluated({"trough": corner().energy}, NEAR, q, **sizes)["trough"]
    rest = model.energy.value(at) - energies
    assert np.ptp(rest) < 1e-11


def test_what_is_apart_makes_the_other_functions_positive(sample):
    q, model, sizes = sample
    apart = np.array(list(evaluated(corner().apart, NEAR, q, **sizes).values()))
    assert (apart > 0).all()
    inside = (np.array(list(evaluated(corner().contacts, NEAR, q, **sizes).values())) >= 0).all(0)
    at = placed(q, sizes["l"], sizes["t"])
    assert np.array_equal(model.polyhedron.contains(at), inside)
    assert 0.05 < inside.mean() < 0.95


def test_coordinates_near_the_corner_are_those_of_the_placement(sample):
    q, _, sizes = sample
    at = placed(q, sizes["l"], sizes["t"]) + np.array([0, 0, math.pi, math.pi])
    at = np.column_stack([at, np.broadcast_to(list(sizes.values()), (len(q), 2))])
    found = evaluated(corner().coordinates, CHART, at)
    assert np.allclose(np.column_stack(list(found.values())), q, atol=1e-12)


def test_the_corner_is_the_only_minimum_nearby_for_all_sizes_of_a_cell():
    assert range_of_sizes.only_contacts(NEARBY, CELL)
    assert range_of_sizes.is_corner(range_of_sizes.nearby(NEARBY, CELL))


def test_a_neighbourhood_without_the_corner_is_not_taken_for_one():
    beside = NEARBY + np.array([0.3, 0, 0, 0])
    assert not range_of_sizes.is_corner(range_of_sizes.nearby(beside, CELL))
    assert not range_of_sizes.only_contacts(NEARBY * 100, CELL)


@pytest.mark.slow
@pytest.mark.parametrize(("rod", "saddles"), [(1.7, [("A1B1",), ("A1B1", "aB1")]), (1.75, [])])
def test_two_saddles_vanish_as_rods_grow_thicker(rod, saddles):
    model = RelativePlacements(DumbbellPair(length=14, ball_radius=3, rod_radius=rod))
    box = [(4.25, 4.4), (5.4, 5.6), (2.44, 2.5), (1.55, 1.59)]
    found = stationary_points(model.polyhedron, model.energy, box=box)
    assert found.complete
    assert sorted(p.active for p in found) == saddles
    assert all(p.index == 3 - len(p.active) for p in found)


@pytest.mark.slow
def test_a_cell_is_proved():
    found = range_of_sizes.proved(15.9, 1.45, (0.1, 0.05))
    assert found["proved"] == 1
    assert found["reach"].max() < 0.5


def some(length, rod):
    """Return what a search might: the cell at 16 mm is not proved."""
    return {
        "proved": float(length < 16), "boxes": 100.0, "boxes_nearby": 7.0,
        "reach": np.full(4, rod / 10),
    }  # fmt: skip


def test_the_command_counts_what_is_proved(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(range_of_sizes, "LENGTHS", (14.0, 17.0))
    monkeypatch.setattr(range_of_sizes, "CELL", (1.0, 0.6))
    monkeypatch.setattr(range_of_sizes, "proved", some)
    monkeypatch.setattr("sys.argv", ["sizes", "--workers", "1", "--store", str(tmp_path / "s")])
    range_of_sizes.main()
    said = capsys.readouterr().out.splitlines()
    assert said[-4:-1] == [
        "2 of 3 cells are proved",
        "200 boxes, near the corner 14",
        "neighbourhoods reach 0.120, 0.120, 0.120, 0.120 (U, V in mm; T, W in rad)",
    ]


@pytest.mark.parametrize("arguments", [["--workers", "0"], ["--store", __file__]])
def test_the_command_names_what_is_wrong(arguments, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["sizes", *arguments])
    with pytest.raises(SystemExit):
        range_of_sizes.main()
    assert "expected" in capsys.readouterr().err

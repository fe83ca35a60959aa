"""Proofs for whole boxes of parameters: what holds in a cell holds at every point of it."""

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction, certify, minimise
from polycorner.dumbbells import DumbbellPair
from polycorner.proofs import prove
from polycorner.proofs.hypotheses import INACTIVE, POSITIVE, UNIQUE

M = Manifold.euclidean("x y")
x, y = M.symbols
a, b = sp.symbols("a b", real=True)


def problem(parts, energy, q, **parameters):
    """Certify functions of ``x``, ``y`` that all share the same parameters."""

    def function(name, e):
        used = {s: v for s, v in parameters.items() if sp.Symbol(s, real=True) in e.free_symbols}
        return SmoothFunction(name, e, M, parameters=used)

    D = Polyhedron(M, [function(name, e) for name, e in parts.items()])
    return certify(D, function("energy", energy), q)


@pytest.fixture(scope="module")
def corner():
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
    return minimise(pair.polyhedron, pair.energy, pair.nested("R"))


def covers_exactly(cells, box):
    """Whether the cells' sides tile the box: every corner's indicator adds up."""
    total = sum(Fraction(0) + _volume(cell.parameters) for cell in cells)
    inside = all(
        box[name][0] <= low < up <= box[name][1]
        for cell in cells
        for name, (low, up) in cell.parameters.items()
    )
    return inside and total == _volume(box)


def _volume(sides):
    volume = Fraction(1)
    for low, up in sides.values():
        volume *= Fraction(up) - Fraction(low)
    return volume


def test_a_box_with_a_closed_form_is_proved_everywhere():
    # The minimum of a x + y^2 over x >= b^2 + y is found by hand: y = -a/2, x = b^2 - a/2.
    c = problem({"wall": x - y - b**2}, a * x + y**2, [0.5, -0.5], a=1.0, b=1.0)
    box = {"a": (0.5, 2.0), "b": (-1.0, 3.0)}
    p = prove(c, parameters=box)
    assert p.proved, str(p)
    assert p.proved_fraction == 1.0
    assert covers_exactly(p.cells, box)
    for cell in p.cells:
        for s, t in np.random.default_rng(0).uniform(size=(20, 2)):
            u, v = (low + r * (up - low) for r, (low, up) in
                    zip((s, t), cell.parameters.values(), strict=True))  # fmt: skip
            truth = {"x": v**2 - u / 2, "y": -u / 2, "multiplier wall": u}
            truth["energy"] = u * truth["x"] + truth["y"] ** 2
            for name, value in truth.items():
                low, up = cell.bounds[name]
                assert low - 1e-12 <= value <= up + 1e-12
    low, up = map(float, p.enclosures["y"])
    assert low <= -1.0 < -0.25 <= up
    low, up = map(float, p.enclose(sp.exp(y)))
    assert low <= math.exp(-1.0) < math.exp(-0.25) <= up


def test_where_a_multiplier_changes_sign_both_sides_are_decided():
    # At x = 0 the multiplier is a: a minimum for a > 0, none for a < 0.
    c = problem({"wall": x}, a * x + x**2 + y**2, [0, 0], a=1.0)
    p = prove(c, parameters={"a": (-1.0, 1.0)}, max_cells=60)
    assert not p.proved
    assert p.conditions[POSITIVE] == "failed"
    for cell in p.cells:
        low, up = cell.parameters["a"]
        wanted = "proved" if low > 0 else "failed" if up < 0 else "undecided"
        assert cell.status == wanted
        assert bool(cell.reason) == (wanted != "proved")
    assert 0.49 < p.proved_fraction < 0.5
    assert all(low <= 0 <= up for low, up in (cell.parameters["a"] for cell in p.undecided))


def test_where_a_gap_closes_the_rest_is_proved():
    c = problem({"wall": x, "lid": a - y}, x + y**2, [0, 0], a=1.0)
    p = prove(c, parameters={"a": (-0.5, 1.0)}, max_cells=60)
    assert p.conditions[INACTIVE] == "failed"
    assert p.proved_fraction == pytest.approx(2 / 3, abs=0.01)


def test_a_fold_leaves_its_end_undecided():
    c = problem({"far": x + 50}, x**3 / 3 - a * x + y**2, [1, 0], a=1.0)
    p = prove(c, parameters={"a": (-0.25, 1.0)}, max_cells=80)
    assert p.conditions[UNIQUE] == "undecided"
    assert 0.6 < p.proved_fraction <= 0.8
    for cell in p.cells:
        if cell.status == "proved":
            low, up = cell.parameters["a"]
            assert low > 0
            assert cell.bounds["x"][0] <= math.sqrt(low) <= math.sqrt(up) <= cell.bounds["x"][1]
    with pytest.raises(ValueError, match="enclose: expected a proof with an enclosed point"):
        prove(c, parameters={"a": (-0.5, -0.25)}, max_cells=4).enclose(x)


def test_the_box_need_not_hold_the_certificate():
    c = problem({"far": x + 50}, sp.cosh(x) - a * x + y**2, [math.asinh(1), 0], a=1.0)
    p = prove(c, parameters={"a": (4.0, 4.5)})
    assert p.proved, str(p)
    low, up = map(float, p.enclosures["x"])
    assert low <= math.asinh(4.0) < math.asinh(4.5) <= up


def test_the_pair_is_proved_for_a_range_of_sizes_at_once(corner):
    heard, totals = [], set()

    def progress(done, total, note):
        heard.append(done)
        totals.add(total)
        assert note == f"{len(heard)} cells"

    box = {"t": (1.45, 1.55), "l": (15.7, 16.3)}
    p = prove(corner, parameters=box, progress=progress)
    assert p.proved, str(p)
    assert p.symmetry == ("d/deta1 + d/deta2",)
    assert heard == sorted(heard)
    assert heard[-1] == pytest.approx(1.0)
    assert totals == {1.0}
    assert p.parameters == box
    assert "100 % proved" in str(p)
    theta = next(s for s in corner.problem.polyhedron.manifold.symbols if s.name == "theta1")
    whole = [float(side) for side in p.enclose(180 * theta / sp.pi)]
    assert 7.6 < whole[0] < 7.9428181 < whole[1] < 8.3


@settings(max_examples=10)
@given(st.floats(1.45, 1.55), st.floats(15.7, 16.3))
def test_every_pair_in_the_box_rests_where_its_cell_says(corner, rod, length):
    p = _cached(corner)
    pair = DumbbellPair(length=length, ball_radius=3, rod_radius=rod, drum_radius=125)
    c = minimise(pair.polyhedron, pair.energy, pair.nested("R"))
    (cell, *_) = [
        cell
        for cell in p.cells
        if cell.parameters["t"][0] <= rod <= cell.parameters["t"][1]
        and cell.parameters["l"][0] <= length <= cell.parameters["l"][1]
    ]
    names = pair.manifold.names
    shift = sum(corner.point[[1, 4]] - c.point[[1, 4]]) / 2
    for name, value in zip(names, c.point, strict=True):
        low, up = cell.bounds[name]
        moved = value + (shift if name.startswith("eta") else 0.0)
        assert low - 1e-8 <= moved <= up + 1e-8
    for name, value in c.multipliers.items():
        low, up = cell.bounds[f"multiplier {name}"]
        assert low - 1e-8 <= value <= up + 1e-8


_PROOFS = {}


def _cached(corner):
    if not _PROOFS:
        _PROOFS["pair"] = prove(corner, parameters={"t": (1.45, 1.55), "l": (15.7, 16.3)})
    return _PROOFS["pair"]


def test_thick_rods_are_refuted_where_a_contact_pulls(corner):
    p = prove(corner, parameters={"t": (2.885, 2.9)}, max_cells=10)
    status = {cell.parameters["t"]: cell.status for cell in p.cells}
    for (low, up), found in status.items():
        for rod in (low, up):
            pair = DumbbellPair(length=16, ball_radius=3, rod_radius=rod, drum_radius=125)
            least = min(_face_multipliers(pair).values())
            if found != "undecided" and abs(least) > 1e-9:
                assert (found == "proved") == (least > 0)
    assert set(status.values()) >= {"proved", "failed"}


def _face_multipliers(pair):
    from polycorner import stationary_on

    names = ["A2B1", "A2b", "aB1"]
    return stationary_on(pair.polyhedron, pair.energy, pair.nested("R"), names).multipliers

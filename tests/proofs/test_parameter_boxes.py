"""Proofs for whole boxes of parameters: what holds in a cell holds at every point of it."""

import math
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, SmoothFunction, certify, minimise
from polycorner.dumbbells import DumbbellPair
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.proofs import prove
from polycorner.proofs.hypotheses import INACTIVE, POSITIVE, SYMMETRIC, UNIQUE, Status

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
    assert p.conditions[POSITIVE] == "failed in part"
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
    assert p.conditions[INACTIVE] == "failed in part"
    assert p.proved_fraction == pytest.approx(2 / 3, abs=0.01)
    assert p.failed_fraction == pytest.approx(1 / 3, abs=0.01)


numbers = st.integers(-8, 8).map(lambda k: k / 4)


@st.composite
def linear_conditions(draw):
    """Three linear forms in ``a``, ``b``: a multiplier, a gap and a curvature; all hold at 0."""
    return [(draw(st.integers(1, 8)) / 4, draw(numbers), draw(numbers)) for _ in range(3)]


@settings(max_examples=4, phases=[Phase.explicit, Phase.generate])
@given(linear_conditions(), st.booleans(), st.integers(0, 2**32))
def test_cells_are_proved_or_failed_where_linear_conditions_say_so(forms, both, seed):
    """A multiplier, a gap and a curvature that are linear in the parameters: the truth is known."""
    multiplier, gap, curvature = (c0 + c1 * a + c2 * b for c0, c1, c2 in forms)
    energy = multiplier * x + x**2 + (y - 1) ** 2 * curvature
    c = problem({"wall": x, "other": y - 1 + gap}, energy, [0, 1], a=0.0, b=0.0)
    box = dict.fromkeys({str(s) for f in (energy, gap) for s in f.free_symbols}, (-1.0, 2.0))
    box = {name: side for name, side in box.items() if name in ("a", "b" if both else "a")}
    if not box:
        return
    p = prove(c, parameters=box, max_cells=50)
    assert covers_exactly(p.cells, box)
    shares = p.proved_fraction, p.failed_fraction, sum(cell.volume for cell in p.undecided)
    assert shares[0] + shares[1] + shares[2] / 3.0 ** len(box) == pytest.approx(1)
    rng = np.random.default_rng(seed)
    for cell in p.cells:
        truths = {_all_hold(forms, point) for point in _points(cell.parameters, rng)}
        assert cell.status == "undecided" or truths == {cell.status == "proved"}
    for name, status in p.conditions.items():
        everywhere = {cell.conditions[name] for cell in p.cells}
        assert everywhere == {status} or status in ("failed in part", "undecided")
        assert (status == "failed in part") == ("failed" in everywhere and len(everywhere) > 1)
    if len(box) == 1:  # halving leaves at most one cell in 2^10 for each of the three ends
        truth = np.mean([_all_hold(forms, (t, 0.0)) for t in np.linspace(-1, 2, 3001)[:-1] + 5e-4])
        assert abs(p.proved_fraction - truth) < 0.01


def _points(sides, rng):
    """Return points inside a cell and near its corners, as pairs ``(a, b)``."""
    for r in (*rng.uniform(size=(6, 2)), *np.array([[0, 0], [1, 0], [0, 1], [1, 1]])):
        inner = 1e-9 + (1 - 2e-9) * r
        ends = [sides.get(name, (0.0, 0.0)) for name in ("a", "b")]
        yield tuple(low + t * (up - low) for t, (low, up) in zip(inner, ends, strict=True))


def _all_hold(forms, point):
    """Whether all forms are positive, exactly: cells may be as narrow as neighbouring doubles."""
    u, v = map(Fraction, point)
    return all(Fraction(c0) + Fraction(c1) * u + Fraction(c2) * v > 0 for c0, c1, c2 in forms)


def test_a_wall_that_is_out_of_the_way_for_two_thirds_is_proved_on_these():
    c = problem({"wall": x - a}, (x - 1) ** 2 + y**2, [1, 0], a=0.0)
    p = prove(c, parameters={"a": (-1.0, 2.0)}, max_cells=60)
    assert p.proved_fraction == pytest.approx(2 / 3, abs=0.01)
    assert p.failed_fraction == pytest.approx(1 / 3, abs=0.01)
    assert p.conditions[INACTIVE] == "failed in part"
    assert "violated" in str(p)
    q = prove(c, parameters={"a": (1.25, 2.0)})
    assert q.conditions[INACTIVE] == "failed"
    assert q.failed_fraction == 1.0
    assert q.failed == q.cells


def test_a_contact_that_repeats_another_is_left_out_for_all_parameters():
    parts = {"wall": x - a, "twice": 2 * x - 2 * a, "scaled": (x - a) * (1 + b**2)}
    c = problem(parts, b * x + y**2, [1, 0], a=1.0, b=1.0)
    p = prove(c, parameters={"a": (-1.0, 2.0), "b": (0.5, 2.0)})
    assert p.proved, str(p)
    assert len(p.active) == 1


def test_a_symmetry_that_holds_for_one_parameter_failed_in_part():
    along = Symmetry(fields=[{"y": 1}])  # of the wall for a = 0 only
    c = problem({"wall": x - a * y}, x - a * y + y**2, [0, 0], a=0.25)
    assert prove(c, symmetry=along).conditions[SYMMETRIC] == "failed"
    p = prove(c, parameters={"a": (-0.5, 0.5)}, symmetry=along, max_cells=9)
    assert p.conditions[SYMMETRIC] == "failed in part"


def test_a_fold_leaves_its_end_undecided():
    c = problem({"far": x + 50}, x**3 / 3 - a * x + y**2, [1, 0], a=1.0)
    p = prove(c, parameters={"a": (-0.25, 1.0)}, max_cells=50)
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

    box = {"t": (1.48, 1.52), "l": (15.9, 16.1)}
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
    p = prove(corner, parameters={"t": (2.885, 2.9)}, max_cells=20)
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


def test_no_cell_fails_on_which_other_functions_may_hold_the_point():
    M = Manifold.euclidean("x y")
    (x, y), b = M.symbols, sp.Symbol("b", real=True)
    forms = {"floor": y, "left": x - b, "right": -x - b}
    D = Polyhedron(M, [SmoothFunction(k, f, M, parameters={"b": -1.0}) for k, f in forms.items()])
    # The origin is no minimum for b < 0, outside for b > 0, and alone on the floor for b = 0.
    proof = prove(certify(D, y - x**2, [0.0, 0.0]), parameters={"b": (-1.0, 0.5)}, max_cells=60)
    held = [c for c in proof.cells if c.parameters["b"][0] <= 0 <= c.parameters["b"][1]]
    assert held
    assert all(cell.status is Status.UNDECIDED for cell in held)
    assert proof.failed_fraction > 0.9

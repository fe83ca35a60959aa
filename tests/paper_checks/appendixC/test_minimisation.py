"""Appendix C: expected verdicts, and its checks against independent computations."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import simpson, solve_ivp
from scipy.optimize import minimize_scalar

from paper_checks import Verdict
from paper_checks.appendixC import chart, entrapment, lemma, minimisation, rod_weight
from paper_checks.section6.experiment import EXPERIMENT, PLANE, rests
from polycorner import Manifold, Polyhedron, certify, prove
from polycorner.dumbbells import plane_heading_formula

# ------------------------------------------------------------------------------------------ lemma


@pytest.mark.parametrize("name", lemma.counterexamples())
def test_each_hypothesis_alone_is_broken_and_needed(name):
    example = lemma.counterexamples()[name]
    assert [k for k, holds in example.hypotheses().items() if not holds] == [name]
    assert minimisation.minimum_lemma(name).verdict is Verdict.REFUTED


@pytest.mark.parametrize("name", lemma.counterexamples())
def test_counterexamples_fall_at_points_computed_by_hand(name):
    example, s = lemma.counterexamples()[name], 1e-3
    f = sympy.lambdify(example.variables, example.f)
    path = [float(x.subs(lemma.S, s)) for x in example.path]
    assert f(*path) < 0.0 == float(example.restricted())


def test_the_function_that_is_not_smooth_is_differentiable_at_the_origin():
    example = lemma.counterexamples()[lemma.SMOOTH]
    f = sympy.lambdify(example.variables, example.f)
    rng = np.random.default_rng(1)
    for size in (1e-2, 1e-4, 1e-6):
        u, v = size * abs(rng.normal(size=500)), size * rng.normal(size=500)
        remainder = abs(f(u, v) - u) / np.hypot(u, v)
        assert remainder.max() < 3 * math.sqrt(5 * size)


def test_hypotheses_are_read_off_a_function_that_meets_them():
    x1, x2 = lemma.X[:2]
    example = lemma.Example(x1 + x2**2 + x1 * x2, (1, 1, 1), (lemma.S,) * 3)
    assert all(example.hypotheses().values())
    assert lemma.cube(example) == (Fraction(1, 2), 1, 1)  # |x2| <= 1/2 keeps the slope 1 + x2
    flatter = replace(example, f=x1 + x2**2 / 4)
    assert all(flatter.hypotheses().values())
    assert lemma.cube(flatter) is None  # it requires second derivatives of at least 1
    assert lemma.cube(replace(example, f=-x1 + x2**2)) is None


@settings(max_examples=8)
@given(st.integers(0, 10**6), st.sampled_from([(1, 1, 0), (2, 1, 1), (1, 2, 0), (0, 2, 1)]))
def test_the_bound_of_the_proof_holds_in_its_cube(seed, split):
    rng = np.random.default_rng(seed)
    example = lemma.random_example(rng, split)
    assert lemma.bound_holds(example, rng, 20)
    assert lemma.first_bracket_is_an_integral(example)


def test_a_bound_that_is_too_good_is_noticed(monkeypatch):
    rng = np.random.default_rng(7)
    example = lemma.random_example(rng, (1, 1, 0))
    size, a, h = lemma.cube(example)
    monkeypatch.setattr(lemma, "cube", lambda _: (size, 5 * a, 9 * h))
    assert not lemma.bound_holds(example, rng, 50)


def test_interval_arithmetic_proves_what_the_lemma_says():
    example = lemma.random_example(np.random.default_rng(4), (2, 1, 1))
    M = Manifold.euclidean(" ".join(map(str, example.variables)))
    own = dict(zip(example.variables, M.symbols, strict=True))
    walls = {f"wall {k}": M.symbols[k] for k in range(example.split[0])}
    certificate = certify(Polyhedron(M, walls), example.f.subs(own), np.zeros(M.dimension))
    assert certificate.signature == example.split
    assert prove(certificate).proved


# ------------------------------------------------------------------------------------ coordinates


@pytest.mark.parametrize("locus", ["delta_R", "delta_L"])
def test_the_proved_determinant_is_that_of_differences(locus):
    q, h = rests(EXPERIMENT)[locus].point, 1e-6
    symbols = EXPERIMENT.manifold.symbols
    means = [(symbols[k] + symbols[k + 3]) / 2 for k in (0, 2, 1)]
    x = sympy.lambdify([symbols], [*chart.distances(), *means])
    columns = [(np.array(x(q + h * e)) - x(q - h * e)) / (2 * h) for e in np.eye(6)]
    low, high = map(float, chart.jacobian_determinant(locus))
    assert high - low < 1e-20
    assert abs(np.linalg.det(np.array(columns).T)) == pytest.approx(abs(low), rel=1e-6)


def test_multipliers_are_the_slopes_in_these_coordinates():
    multipliers = rests(EXPERIMENT)["delta_R"].certificate.multipliers
    for direction, name in enumerate(("A2B1", "aB1", "A2b")):
        slope = chart.energy_rise("delta_R", direction, 1e-6) / 1e-6
        assert slope == pytest.approx(multipliers[name], rel=1e-3)


def test_the_corner_in_the_plane_has_the_determinant_of_differences():
    length, r, t = (float(x) for x in (PLANE.length, PLANE.ball_radius, PLANE.rod_radius))
    formula = minimisation.corner_determinant()
    sizes = dict(zip(sympy.symbols("l r t", positive=True), (length, r, t), strict=True))
    q = PLANE.nested("R", heading=0.0, clearance=0.0)
    h, names = 1e-6, list(PLANE.polyhedron.names)
    rows = [names.index(name) for name in ("A2B1", "aB1", "A2b")]

    def gaps(p):
        return PLANE.polyhedron.bundle.evaluate(p, 0)[0][rows]

    columns = [(gaps(q + h * e) - gaps(q - h * e)) / (2 * h) for e in np.eye(6)[3:]]
    assert np.linalg.det(np.array(columns).T) == pytest.approx(float(formula.subs(sizes)), rel=1e-5)


# -------------------------------------------------------------------------- rods, and entrapment


def test_weightless_rods_rest_at_the_closed_form():
    symbols = {s.name: s for s in plane_heading_formula().free_symbols}
    sizes = {symbols["l"]: 16, symbols["r"]: 3, symbols["t"]: sympy.Rational(3, 2)}
    closed = math.degrees(float(plane_heading_formula().subs(sizes)))
    for weight in (0.0, 0.3, 2.0):
        assert rod_weight.heading_with_rods(EXPERIMENT, weight, 0.5) == pytest.approx(closed, 1e-12)


@given(st.floats(0, 3), st.floats(0, 1))
def test_the_heading_is_where_the_weighted_energy_is_least(weight, share):
    length, r, t = 16.0, 3.0, 1.5
    p, along = r + t, length - math.sqrt(4 * r**2 - (r + t) ** 2)

    def energy(theta):
        d = along * math.sin(theta) - p * math.cos(theta)
        outer, inner = (d + length * math.sin(theta)) / 2, (d - length * math.sin(theta)) / 2
        return (1 + weight * share) * outer**2 + (1 + weight * (1 - share)) * inner**2

    least = minimize_scalar(energy, bounds=(-0.8, 0.8), method="bounded", options={"xatol": 1e-10})
    found = rod_weight.heading_with_rods(EXPERIMENT, weight, share)
    assert math.radians(found) == pytest.approx(least.x, abs=1e-6)


def test_the_weight_of_a_rod_is_its_volume_outside_the_balls():
    length, r, t = 16.0, 3.0, 1.5
    x = np.linspace(-length / 2, length / 2, 400_001)
    ball = np.maximum(r**2 - (abs(x) - length / 2) ** 2, 0.0)
    area = math.pi * np.maximum(t**2 - ball, 0.0)
    expected = simpson(area, x=x) / (4 / 3 * math.pi * r**3)
    assert rod_weight.weight_of_rod(EXPERIMENT) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("kind", "force"), [("half-U", lambda x: 6 * x), ("half-V", lambda _: 4)])
def test_the_time_between_impacts_is_that_of_the_motion(kind, force):
    def wall(_, y):
        return y[0]

    wall.terminal, wall.direction = True, -1
    flight = solve_ivp(
        lambda _, y: [y[1], -force(y[0])], (0, 10), [0, 0.7], events=wall, rtol=1e-10, atol=1e-12
    )
    values = {entrapment.K: 3, entrapment.SLOPE: 4, entrapment.SPEED: 0.7}
    time = float(entrapment.bounce_times()[kind].subs(values))
    assert flight.t_events[0][0] == pytest.approx(time, rel=1e-6)

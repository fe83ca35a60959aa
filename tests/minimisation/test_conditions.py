"""Second order: forms on cones, vanishing forms, loci."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_minima import least_on_cone
from polynomials import linear, quadratic

from polycorner import (
    Manifold,
    Polyhedron,
    Verdict,
    certify,
    minimise,
)

M2, M3 = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = M3.symbols
QUADRANT = Polyhedron(M2, {"right": x, "up": y})


# ------------------------------------------------------- second order on a cone that is no space


entries = st.floats(-3, 3)


@given(st.tuples(entries, entries, entries))
def test_a_form_on_a_quadrant_is_a_minimum_when_copositive(numbers):
    a, b, c = numbers
    form = np.array([[a, b], [b, c]])
    least = least_on_cone(form, np.eye(2), count=20_001)
    assume(abs(least) > 0.01)
    found = certify(QUADRANT, quadratic(M2, form), [0, 0])
    assert found.verdict is (Verdict.WEAK_MINIMUM if least > 0 else Verdict.SADDLE)
    assert found.multipliers == {"right": 0, "up": 0}


@given(
    arrays(float, (3, 3), elements=st.floats(-2, 2)),
    arrays(float, (4, 3), elements=st.floats(-1, 1)),
    st.integers(1, 4),
)
def test_a_form_on_any_cone_is_a_minimum_when_copositive(matrix, rows, count):
    rows = rows[:count]
    assume((np.linalg.norm(rows, axis=1) > 0.2).all())
    assume((rows @ _inward(rows) > 0.2 * np.linalg.norm(rows, axis=1)).all())
    form = matrix + matrix.T
    least = least_on_cone(form, rows, count=60_001)
    assume(abs(least) > 0.05)
    D = Polyhedron(M3, [linear(M3, row, 0.0, f"c{i}") for i, row in enumerate(rows)])
    found = certify(D, quadratic(M3, form), [0, 0, 0])
    assert found.verdict is (Verdict.WEAK_MINIMUM if least > 0 else Verdict.SADDLE)


def _inward(rows):
    """Return a direction that leads inward from every row, or one that does not."""
    directions = np.random.default_rng(0).normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return directions[(directions @ rows.T).min(axis=1).argmax()]


def test_a_form_that_vanishes_on_the_cones_edges_is_a_minimum_along_them():
    # x y is nowhere negative on the quadrant and zero along both axes.
    assert certify(QUADRANT, x * y, [0, 0]).verdict is Verdict.MINIMUM_ALONG_LOCUS


def test_a_square_that_vanishes_inside_the_cone_is_a_minimum_along_it():
    c = certify(QUADRANT, (x - y) ** 2, [0, 0])
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS


@pytest.mark.parametrize("slope", [-0.9, 0.9, 1.1, 3.0])
def test_strongly_active_faces_leave_only_their_own_plane(slope):
    # E = z + slope^2 x^2 - y^2 on z >= 0, x >= |y|: along the cone's sides E = (slope^2 - 1) x^2.
    D = Polyhedron(M3, {"floor": z, "left": x - y, "right": x + y})
    c = certify(D, z + slope**2 * x**2 - y**2, [0, 0, 0])
    assert c.verdict is (Verdict.WEAK_MINIMUM if slope**2 > 1 else Verdict.SADDLE)
    assert c.multipliers["floor"] == pytest.approx(1, abs=1e-14)


# ---------------------------------------------------------------- where the second order vanishes


FLOOR = Polyhedron(M3, {"floor": y})


@pytest.mark.parametrize("power", range(3, 13))
@pytest.mark.parametrize("sign", [1, -1])
def test_the_first_term_that_does_not_vanish_decides(power, sign):
    c = certify(FLOOR, y + z**2 + sign * x**power, [0, 0, 0])
    rises = sign > 0 and power % 2 == 0
    assert c.verdict is (Verdict.STRICT_MINIMUM if rises else Verdict.SADDLE)
    assert c.signature == (1, 1, 1)
    assert not c.lemma[3].holds
    assert f"terms of degree {power} decide" in c.explain()


@pytest.mark.parametrize(
    "energy",
    [
        x * z * (x - z),
        x**3 - 3 * x * z**2,
        -(x**2) * z**2,
        -((x * z * (x - z)) ** 2),
        -(x**4) / 10**7,
        -(x**4) + 10**6,
    ],
    ids=str,
)
def test_an_energy_that_falls_is_never_called_a_minimum(energy):
    assert not certify(FLOOR, y**2 + y + energy, [0, 0, 0]).is_minimum
    assert not certify(Polyhedron(M3, {"far": y + 5}), y**2 + energy, [0, 0, 0]).is_minimum


@pytest.mark.parametrize(
    ("energy", "point"),
    [
        (sp.S.Zero, (1, 0, 2)),
        ((x**2 + z**2 - 1) ** 2, (1, 0, 0)),
        (sp.cos(x + z), (np.pi / 2, 0, np.pi / 2)),
        ((x + z**2) ** 2, (0, 0, 0)),
        ((x + x * z + z**2 / 4) ** 2, (0, 0, 0)),
        ((x + z - z**2) ** 2, (0, 0, 0)),
    ],
    ids=str,
)
def test_an_energy_constant_along_a_locus_is_recognised(energy, point):
    c = certify(FLOOR, y + energy, point)
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS


@given(st.floats(-1, 1), st.floats(0.1, 1))
def test_an_inflection_is_never_called_a_minimum(start, height):
    c = minimise(Polyhedron(M2, {"floor": y}), x**3 + y, [start, height], max_iterations=60)
    assert not c.is_minimum


def test_a_bent_locus_of_two_dimensions_is_recognised():
    far = Polyhedron(M3, {"far": x + 100})
    c = certify(far, (x + x * z + y**2 / 4) ** 2, [0, 0, 0])
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert c.signature == (0, 1, 2)


@pytest.mark.parametrize("seed", range(4))
def test_ranges_of_multipliers_have_the_signs_of_multipliers(seed):
    """Of six walls through a point in space some may carry nothing: their least multiplier is 0."""
    walls = np.random.default_rng(seed).normal((0.0, 0.0, 2.0), size=(6, 3))
    cone = Polyhedron(M3, [float(a) * x + float(b) * y + float(c) * z for a, b, c in walls])
    pull = walls[:4].sum(axis=0)
    found = certify(cone, float(pull[0]) * x + float(pull[1]) * y + float(pull[2]) * z, [0, 0, 0])
    assert len(found.multiplier_ranges) == 6
    assert min(low for low, _ in found.multiplier_ranges.values()) == 0.0

"""Degenerate germs of known type: higher orders decide, in bent coordinates and on curved faces."""

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from normal_forms import HALF, QUADRANT, U, V, posed

from polycorner import Manifold, Polyhedron, Verdict, certify, minimise

FEW = settings(max_examples=2)
seeds = st.integers(0, 2**32 - 1)

# Arnold's simple singularities, whose type is known, and others with elementary proofs.
MINIMA = [
    *(U**k + V**2 for k in (4, 6, 8, 10)),
    U**4 + V**4,
    U**4 + V**4 - U**2 * V**2,
    (U**2 + V**2) ** 2 - 3 * U**2 * V**2,
    U**4 + V**6,
    U**6 + V**4 + U**5 * V,
    U**2 * V**2 + U**6 + V**6,
    (U**2 - V**2) ** 2 + U**6,
    V**2 - 2 * V * U**2 + 2 * U**4,
]
OTHERS = [
    *(-(U**k) + V**2 for k in (4, 6, 8, 10)),
    *(sign * U**k + V**2 for k in (3, 5, 7, 9) for sign in (1, -1)),
    *(U**2 * V + sign * V**k for k in (3, 4, 5) for sign in (1, -1)),
    U**3 - 3 * U * V**2,  # the monkey saddle
    U**3 + V**4,
    U**3 - V**4,
    U**3 + U * V**3,
    U**3 + V**5,
    U**4 + V**4 - 3 * U**2 * V**2,
    U**4 - V**6,
    U**4 + U * V**4,
    (U**2 - V**2) ** 2 - U**6,
    (V - U**2) * (V - 2 * U**2),  # Peano's
]


def expected(verdict, *, strict=Verdict.STRICT_MINIMUM):
    return strict if verdict else Verdict.SADDLE


@pytest.mark.parametrize(
    ("form", "is_minimum"), [*((f, True) for f in MINIMA), *((f, False) for f in OTHERS)], ids=str
)
@FEW
@given(seed=seeds, setting=st.sampled_from(["free", "pushed", "held"]))
def test_germs_of_known_type(form, is_minimum, setting, seed):
    generator = np.random.default_rng(seed)
    contacts = (3,) if setting == "pushed" else ()
    equations = (3,) if setting == "held" else ()
    push = {"free": 0.0, "pushed": 1.0, "held": -1.0}[setting]
    c = posed(form, generator, contacts=contacts, equations=equations, push=push)
    assert c.verdict is expected(is_minimum)


@pytest.mark.parametrize(("form", "is_minimum"), HALF, ids=str)
@FEW
@given(seed=seeds)
def test_germs_beside_a_weak_contact(form, is_minimum, seed):
    c = posed(form, np.random.default_rng(seed), contacts=(1, 3), push=1.0)
    assert c.verdict is expected(is_minimum, strict=Verdict.WEAK_MINIMUM)


@pytest.mark.parametrize("form", [U**5 + V**4, U * V**2 + V**6 + U**3], ids=str)
@FEW
@given(seed=seeds)
def test_zeros_inside_a_half_space_may_be_declined_and_are_never_refuted(form, seed):
    c = posed(form, np.random.default_rng(seed), contacts=(1, 3), push=1.0)
    assert c.verdict in {Verdict.UNDECIDED, Verdict.WEAK_MINIMUM}


@pytest.mark.parametrize(("form", "is_minimum"), QUADRANT, ids=str)
@FEW
@given(seed=seeds)
def test_germs_between_two_weak_contacts(form, is_minimum, seed):
    c = posed(form, np.random.default_rng(seed), contacts=(1, 2, 3), push=1.0)
    assert c.verdict is expected(is_minimum, strict=Verdict.WEAK_MINIMUM)


# ------------------------------------------------------------------- loci, and what is none

M2 = Manifold.euclidean("x y")
x, y = M2.symbols
PLANE = Polyhedron(M2, {"far": y + 500})
CORNER = Polyhedron(M2, {"right": x, "up": y})


@pytest.mark.parametrize("size", [1, 10, 100, 1000])
@pytest.mark.parametrize("power", [4, 6, 10, 14])
def test_a_slow_descent_is_no_locus(size, power):
    assert certify(PLANE, -((x / size) ** power) + y**2, [0, 0]).verdict is Verdict.SADDLE


@pytest.mark.parametrize("power", [18, 22])
def test_beyond_the_degree_of_the_series_nothing_is_decided(power):
    for size in (1, 30):
        c = certify(PLANE, -((x / size) ** power) + y**2, [0, 0])
        assert c.verdict is Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("polyhedron", "energy"),
    [
        (PLANE, (x * y) ** 2),
        (PLANE, (x**2 - 4 * y**2) ** 2),
        (PLANE, (x + y - x**2) ** 2),
        (CORNER, x * y),
        (CORNER, x**2 * y + x * y**2),
        (CORNER, (x - y) ** 2),
        (CORNER, sp.sin(x) * sp.sin(y)),
    ],
    ids=str,
)
def test_a_cross_and_a_bent_line_are_loci(polyhedron, energy):
    c = certify(polyhedron, energy, [0, 0])
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert "constant along" in c.explain()


def test_the_horn_form_is_a_minimum_and_less_of_it_is_not():
    M = Manifold.euclidean("a b c d e")
    s = M.symbols
    form = sum(s) ** 2 - 4 * sum(s[i] * s[(i + 1) % 5] for i in range(5))
    D = Polyhedron(M, {f"w{i}": symbol for i, symbol in enumerate(s)})
    assert certify(D, form, [0] * 5).verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert certify(D, form + s[0] ** 2 / 1000, [0] * 5).is_minimum
    assert certify(D, form - s[0] ** 2 / 1000, [0] * 5).verdict is Verdict.SADDLE
    assert certify(D, form + sum(s) ** 2 / 1000, [0] * 5).verdict is Verdict.WEAK_MINIMUM


@pytest.mark.parametrize("power", [2, 3, 4])
def test_a_gradient_that_vanishes_holds_nothing(power):
    D = Polyhedron(M2, {"odd": (x - 1) ** power, "up": y})
    c = certify(D, x**2 + y, [1, 0])
    assert not c.is_minimum
    assert abs(c.multipliers["odd"]) < 1
    if power % 2 == 0:
        assert c.verdict is Verdict.NOT_STATIONARY  # the whole half-plane is feasible
    # A minimum without the function is one with it.
    assert certify(D, (x - 1) ** 2 + y, [1, 0]).verdict is Verdict.STRICT_MINIMUM
    for offset in (1e-9, -1e-9):
        assert not certify(D, x**2 + y, [1 + offset, 0]).is_minimum


@pytest.mark.parametrize("start", [-0.7, -0.3, 0.2, 0.9])
@pytest.mark.parametrize("power", [3, 4, 5, 6])
def test_the_end_of_a_slow_search_is_judged_as_the_point_it_nears(start, power):
    D = Polyhedron(M2, {"floor": y})
    c = minimise(D, x**power + y, [start, 0.5], max_iterations=60)
    if power % 2 == 0:
        assert c.verdict is Verdict.STRICT_MINIMUM
    else:
        assert not c.is_minimum

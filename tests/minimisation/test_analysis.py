"""The minimisation lemma on bent quadrants whose answer is known beforehand."""

import numpy as np
import pytest
from corners import LARGEST, Corner
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from oracles_minima import feasible_around

from polycorner import (
    Entrapment,
    Verdict,
)

METHODS = ("newton", "slsqp", "scp")
every_method = pytest.mark.parametrize("method", METHODS)
sizes = st.floats(0.1, 10)


@st.composite
def corners(draw, *, first_order=0, curved=0, free=None, bent_locus=False):
    """Bent quadrants with at least so many half-V and U directions; ``free`` fixes the rest.

    Where directions are free, the locus is cut out by the bent faces and, unless ``bent_locus``,
    by planes.
    """
    p = draw(st.integers(first_order, LARGEST - curved - (free or 0)))
    q = draw(st.integers(curved, LARGEST - p - (free or 0)))
    r = draw(st.integers(0, LARGEST - p - q)) if free is None else free
    assume(p + q + r > 0)
    n = p + q + r
    slopes = np.zeros(n)
    curvatures = np.zeros(n)
    slopes[:p] = draw(arrays(float, p, elements=sizes))
    # The energy may bend down behind a face, but not within the distance from which tests start.
    curvatures[:p] = slopes[:p] * draw(arrays(float, p, elements=st.floats(-1, 1)))
    curvatures[p : p + q] = draw(arrays(float, q, elements=sizes))
    bends = draw(arrays(float, n, elements=st.floats(-0.3, 0.3)))
    if r and not bent_locus:
        bends[p : p + q] = 0
    mixed = 0.0
    if p >= 1 and p + q >= 2:
        mixed = draw(st.floats(-1, 1)) * min(slopes[0], slopes[1] if p > 1 else curvatures[1])
    return Corner(
        matrix=np.eye(n) + draw(arrays(float, (n, n), elements=st.floats(-0.2, 0.2))),
        centre=draw(arrays(float, n, elements=st.floats(-3, 3))),
        bends=bends,
        contacts=p,
        slopes=slopes,
        curvatures=curvatures,
        mixed=mixed,
    )


def changed(corner, **changes):
    return Corner(**(corner.__dict__ | changes))


def counted(corner):
    """Return the ``(p, q, r)`` a corner was built with."""
    p = corner.contacts
    q = int((corner.curvatures[p:] != 0).sum())
    return p, q, corner.n - p - q


# ------------------------------------------------------------------------- the quadrant lemma


@given(corners())
def test_a_bent_quadrant_has_the_signature_it_was_built_with(corner):
    c = corner.certify()
    p, q, r = counted(corner)
    assert c.signature == (p, q, r)
    assert c.verdict is (Verdict.MINIMUM_ALONG_LOCUS if r else Verdict.STRICT_MINIMUM)
    assert c.active == tuple(f"f{i + 1}" for i in range(p))
    expected = {name: corner.slopes[i] for i, name in enumerate(c.active)}
    assert c.multipliers == pytest.approx(expected, rel=1e-10)
    assert c.entrapment_counts == {"half-V": p, "half-U": 0, "U": q, "free": r}
    assert len(c.curvatures) == q + r
    assert c.licq
    assert c.multipliers_unique
    assert c.strictly_complementary
    assert c.multiplier_ranges == {name: (lam, lam) for name, lam in c.multipliers.items()}
    assert c.stratum.rank == p
    assert c.stratum.dimension == q + r
    assert [condition.holds for condition in c.lemma] == [True] * 4
    assert c.residuals.worst < 1e-13
    assert c.holds()
    assert c.holds(1e-13)


def bent(n, bends, contacts, slopes, curvatures):
    """Return a corner whose locus bends, so that long steps along it, or short series, mislead."""
    return Corner(
        np.eye(n) + 0.125,
        np.zeros(n),
        np.array(bends),
        contacts,
        np.array(slopes),
        np.array(curvatures),
    )


@example(bent(3, [0.25, 0, 0], 0, [0.0, 0, 0], [0.1, 0, 0]))
@example(bent(3, [0, 0.25, 0], 1, [3.0, 0, 0], [0.0, 1, 0]))
@given(corners(curved=1, free=1, bent_locus=True) | corners(curved=1, free=2, bent_locus=True))
def test_a_bent_locus_is_followed(corner):
    c = corner.certify()
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert c.signature == counted(corner)


@given(corners(), st.integers(0, 2**32 - 1))
def test_no_random_point_around_a_certified_quadrant_is_lower(corner, seed):
    c = corner.certify()
    polyhedron, energy = corner.posed()
    around = feasible_around(polyhedron, c.point, (1e-4, 1e-2), np.random.default_rng(seed), 1000)
    assert len(around) > 200
    # The point itself misses its faces by rounding, times multipliers up to 10.
    assert energy.value(around).min() >= c.energy - 1e-13


@given(corners(first_order=1), st.data())
def test_a_negative_multiplier_refutes(corner, data):
    i = data.draw(st.integers(0, corner.contacts - 1))
    slopes = corner.slopes.copy()
    slopes[i] *= -1
    c = changed(corner, slopes=slopes).certify()
    p, *_ = counted(corner)
    assert c.verdict is Verdict.NOT_STATIONARY
    assert c.multipliers[f"f{i + 1}"] == pytest.approx(slopes[i], rel=1e-10)
    assert c.signature[0] == p - 1
    assert c.entrapment[f"f{i + 1}"] is Entrapment.NONE
    assert not c.lemma[1].holds
    assert not c.holds(1)


@given(corners(curved=1), st.data())
def test_a_negative_curvature_refutes(corner, data):
    p, q, r = counted(corner)
    i = data.draw(st.integers(p, p + q - 1))
    curvatures = corner.curvatures.copy()
    curvatures[i] *= -1
    c = changed(corner, curvatures=curvatures).certify()
    assert c.verdict is Verdict.SADDLE
    assert c.signature == (p, q, r)
    assert (c.curvatures < -1e-3).sum() == 1
    assert list(c.entrapment.values()).count(Entrapment.NONE) == 1
    assert [condition.holds for condition in c.lemma][:3] == [True, True, False]
    assert not c.holds(1)


@given(corners(first_order=1), st.data(), st.sampled_from([-1.0, 1.0]))
def test_a_weakly_active_face_holds_by_its_curvature(corner, data, sign):
    p, q, r = counted(corner)
    i = data.draw(st.integers(0, p - 1))
    slopes, curvatures = corner.slopes.copy(), corner.curvatures.copy()
    slopes[i], curvatures[i] = 0.0, sign
    c = changed(corner, slopes=slopes, curvatures=curvatures, mixed=0.0).certify()
    assert not c.strictly_complementary
    assert c.multipliers[f"f{i + 1}"] == pytest.approx(0, abs=1e-12)
    assert c.signature == (p - 1, q + 1, r)
    if sign < 0:
        assert c.verdict is Verdict.SADDLE
        return
    assert c.verdict is (Verdict.MINIMUM_ALONG_LOCUS if r else Verdict.WEAK_MINIMUM)
    assert c.entrapment[f"f{i + 1}"] is Entrapment.HALF_U
    assert c.entrapment_counts == {"half-V": p - 1, "half-U": 1, "U": q, "free": r}
    assert c.holds()


@every_method
@given(corner=corners(free=0), seed=st.integers(0, 2**32 - 1))
def test_every_method_comes_to_rest_in_the_bent_quadrant(method, corner, seed):
    rng = np.random.default_rng(seed)
    start = corner.centre + 0.05 * rng.normal(size=corner.n)
    c = corner.minimise(start, method=method)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.signature == counted(corner)
    assert c.point == pytest.approx(corner.point, abs=1e-9)
    assert c.residuals.worst < 1e-12


@every_method
@given(corner=corners(free=1), seed=st.integers(0, 2**32 - 1))
def test_every_method_comes_to_rest_on_the_locus(method, corner, seed):
    rng = np.random.default_rng(seed)
    start = corner.centre + 0.05 * rng.normal(size=corner.n)
    c = corner.minimise(start, method=method)
    assert c.verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert c.signature == counted(corner)
    assert c.energy == pytest.approx(0, abs=1e-12)


# -------------------------------------------------------------------- units do not matter


positive = st.floats(-5, 5).map(lambda exponent: 10.0**exponent)


@given(corners(), st.data())
def test_units_change_no_verdict(corner, data):
    flip = data.draw(st.integers(0, corner.n))  # one past the end flips nothing
    slopes, curvatures = corner.slopes.copy(), corner.curvatures.copy()
    slopes[flip:][:1] *= -1
    curvatures[max(flip, corner.contacts) :][:1] *= data.draw(st.sampled_from([1.0, -1.0]))
    corner = changed(corner, slopes=slopes, curvatures=curvatures)
    many = st.tuples(*[positive] * corner.n)
    units, gains, gain = data.draw(many), data.draw(many), data.draw(positive)
    c = corner.certify()
    other = changed(corner, units=units, gains=gains, gain=gain).certify()
    assert other.verdict is c.verdict
    assert other.signature == c.signature
    assert other.active == c.active
    assert other.entrapment_counts == c.entrapment_counts
    for i, name in enumerate(c.active):
        expected = c.multipliers[name] * gain / gains[i]
        assert other.multipliers[name] == pytest.approx(expected, rel=1e-8)
    assert other.curvatures == pytest.approx(c.curvatures * gain, rel=1e-7, abs=1e-11 * gain)
    assert other.residuals.worst < 1e-11


@every_method
@given(corner=corners(free=0), data=st.data())
def test_units_change_no_point_of_rest(method, corner, data):
    many = st.tuples(*[positive] * corner.n)
    units, gains, gain = data.draw(many), data.draw(many), data.draw(positive)
    other = changed(corner, units=units, gains=gains, gain=gain)
    c = other.minimise(corner.centre + 0.02, method=method)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.signature == counted(corner)
    assert c.point / units == pytest.approx(corner.centre, abs=1e-9)

"""Hock-Schittkowski problems: three methods against optima solved in forty digits."""

import mpmath
import numpy as np
import pytest
import sympy as sp
from oracles_minima import feasible_around, plain_residuals
from problems import DIGITS, REGULAR, hs13, hs26

from polycorner import Verdict, certify, minimise

METHODS = ("newton", "slsqp", "scp")
regular = pytest.mark.parametrize("posed", REGULAR, ids=lambda posed: posed.name)
every_method = pytest.mark.parametrize("method", METHODS)


@regular
def test_the_optimum_written_down_solves_the_kkt_equations(posed):
    point, multipliers = posed.solution
    accuracy = 1e-30 if posed.exact else 1e-4
    with mpmath.workdps(DIGITS):
        for found, written in zip(point, posed.optimum, strict=True):
            assert abs(found - mpmath.mpf(sp.N(written, DIGITS))) < accuracy
    assert all(multipliers[name] > 0 for name in posed.active)
    assert (posed.face_curvatures > 0).all()


@every_method
@regular
def test_every_method_finds_the_optimum_and_its_evidence(posed, method):
    c = minimise(posed.polyhedron, posed.energy, posed.start, method=method)
    point, multipliers = posed.solution
    assert c.point == pytest.approx(np.array(point, dtype=float), abs=1e-9)
    assert c.energy == pytest.approx(_energy(posed), abs=1e-9)
    assert c.active == posed.active
    assert c.multipliers == pytest.approx({k: float(v) for k, v in multipliers.items()}, abs=1e-8)
    assert c.verdict is Verdict.STRICT_MINIMUM
    assert c.licq
    assert c.strictly_complementary
    assert c.multipliers_unique
    p, q = len(posed.active), len(posed.face_curvatures)
    assert c.signature == (p, q, 0)
    assert c.entrapment_counts == {"half-V": p, "half-U": 0, "U": q, "free": 0}
    assert c.curvatures == pytest.approx(posed.face_curvatures, rel=1e-8)
    assert c.residuals.worst < 1e-12
    assert c.holds(1e-12)
    assert all(condition.holds for condition in c.lemma)


def _energy(posed):
    point, _ = posed.solution
    return float(posed.energy.subs(dict(zip(posed.coordinates, map(float, point), strict=True))))


@regular
def test_residuals_are_those_of_the_expressions(posed):
    c = minimise(posed.polyhedron, posed.energy, posed.start, method="slsqp")
    rng = np.random.default_rng(7)
    near = certify(posed.polyhedron, posed.energy, c.point + 1e-9 * rng.normal(size=len(c.point)))
    for certificate in (c, near):
        plain = plain_residuals(
            certificate, posed.coordinates, posed.energy, posed.inequalities, posed.equations
        )
        r = certificate.residuals
        ours = (r.infeasibility, r.stationarity, r.complementarity)
        assert ours == pytest.approx(plain, rel=1e-6, abs=1e-14)


# A random point never satisfies an equation.
@pytest.mark.parametrize(
    "posed", [p for p in REGULAR if not p.equations], ids=lambda posed: posed.name
)
def test_no_random_point_around_the_optimum_is_lower(posed):
    c = certify(posed.polyhedron, posed.energy, list(map(float, posed.solution[0])))
    rng = np.random.default_rng(11)
    around = feasible_around(posed.polyhedron, c.point, (1e-4, 1e-2, 0.1), rng, 4000)
    assert len(around) > 2000
    energies = c.problem.energy.value(around)
    assert energies.min() >= c.energy - 1e-12 * (1 + abs(c.energy))


@every_method
def test_a_cusp_without_multiplier_is_never_called_a_minimum(method):
    posed = hs13()
    for start in (posed.start, (0.5, 0.01), (0.9, 0.0), (0.2, 0.3)):
        c = minimise(posed.polyhedron, posed.energy, start, method=method)
        assert not c.is_minimum
        assert not c.holds(1e-3)


def test_the_cusp_itself_has_no_multiplier():
    posed = hs13()
    c = certify(posed.polyhedron, posed.energy, posed.optimum)
    assert c.verdict is Verdict.NO_MULTIPLIER
    assert c.active == posed.active
    assert not c.licq
    assert c.stratum.local_type.name == "DEGENERATE"


@pytest.mark.parametrize("exponent", range(1, 10))
def test_beside_the_cusp_the_way_to_its_tip_is_seen(exponent):
    # Both gaps are open by less than the tolerance long before the tip, where the energy is lower.
    posed = hs13()
    c = certify(posed.polyhedron, posed.energy, [1 - 10.0**-exponent, 0.0])
    assert not c.is_minimum


@every_method
def test_a_quartic_optimum_is_approached_and_never_misjudged(method):
    # Newton and SLSQP come close; sequential programmes converge so slowly that they may run out.
    posed = hs26()
    c = minimise(posed.polyhedron, posed.energy, posed.start, method=method)
    assert c.verdict in {Verdict.UNDECIDED, Verdict.STRICT_MINIMUM, Verdict.NOT_CONVERGED}
    assert c.energy < 1e-8 or c.verdict is Verdict.NOT_CONVERGED


@every_method
def test_a_start_inside_is_never_reported_as_infeasible(method):
    for posed in (*REGULAR, hs13()):
        start = (0.5, 0.01) if posed.name == "HS13" else posed.start
        if posed.polyhedron.contains(start):
            c = minimise(posed.polyhedron, posed.energy, start, method=method)
            assert c.verdict not in {Verdict.INFEASIBLE, Verdict.OUTSIDE}, posed.name

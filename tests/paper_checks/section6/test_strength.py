"""How strong dyads are held: from six coordinates, and by simulation over friction and rods."""

import math
from dataclasses import replace

import pytest
import sympy

from paper_checks.section6.depths import DRUM, held, landscape_of, strength_of
from paper_checks.section6.experiment import EXPERIMENT
from polycorner.dumbbells import dyad_minima
from polycorner.dumbbells.statics.critical import escape_barrier, mountain_pass

FALL = 9810.0  # mm/s^2


def scale(friction, rod):
    """Return ``(g h)^(1/4) (mu g)^(1/2)``, from the barrier in six coordinates."""
    depth = escape_barrier(replace(EXPERIMENT, rod_radius=rod))
    return (FALL * depth) ** 0.25 * math.sqrt(friction * DRUM.rolling[1] * FALL)


@pytest.mark.parametrize(("friction", "rod"), [(1.0, 1.5), (0.1, 1.5), (1.0, 2.5)])
def test_the_same_multiples_of_the_scale_open_dyads(friction, rod):
    """Friction over a factor of ten, and depth over one of six."""
    kicks = scale(friction, rod)
    assert held(kicks / 2, friction, rod) >= 9
    assert held(1.5 * kicks, friction, rod) == 0


def test_strength_from_placements():
    found = strength_of(landscape_of(EXPERIMENT))
    rest, top = dyad_minima(EXPERIMENT)[0].point, mountain_pass(EXPERIMENT).point
    b, t = (EXPERIMENT.developed(q).reshape(2, 2, 2).mean(axis=1) for q in (rest, top))
    assert found.way == pytest.approx(math.dist(b[1] - b[0], t[1] - t[0]), rel=1e-3)
    height = EXPERIMENT.energy.value(top) - EXPERIMENT.energy.value(rest)
    assert found.speed**2 == pytest.approx(FALL * height, rel=1e-9)  # two balls: m v^2 = m g h
    assert 2 * found.acceleration * found.way == pytest.approx(FALL * height, rel=1e-9)
    assert found.kicks == pytest.approx(scale(1.0, 1.5), rel=1e-9)


def test_diffusion_and_drift_of_a_body_that_slides_under_white_kicks():
    """From the stationary density of the speed and the solution of ``L phi = -v``."""
    sigma, friction, a, v = sympy.symbols("sigma f a v", positive=True)
    faster, slower = (2 * (friction - s * a) / sigma**2 for s in (1, -1))
    drift = sympy.series(1 / faster - 1 / slower, a, 0, 2).removeO()
    assert sympy.simplify(drift - sigma**2 * a / friction**2) == 0
    k = 2 * friction / sigma**2
    slope = 2 * (v + 1 / k) / (sigma**2 * k)  # of phi, for v > 0
    generator = sigma**2 / 2 * slope.diff(v) - friction * slope
    assert sympy.simplify(generator + v) == 0
    spread = sympy.integrate(k * sympy.exp(-k * v) * sigma**2 / 2 * slope**2, (v, 0, sympy.oo))
    assert sympy.simplify(spread - 5 * sigma**6 / (8 * friction**4)) == 0

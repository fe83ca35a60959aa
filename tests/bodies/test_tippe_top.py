"""The tippe top of the gallery: what is conserved, where it ends, and when it turns over.

For ``1 - a^2 < I1 / I3 < 1`` the energy of precessions has one minimum [RR], as here.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, root
from scipy.spatial.transform import Rotation

from examples import ex24_tippe_top as top
from examples.ex24_tippe_top import GRAVITY, I1, I3, A, M, R, inclinations

WEIGHT = M * GRAVITY


@pytest.fixture(scope="module")
def motions():
    return top.main()


@pytest.fixture(scope="module")
def oil(motions):
    return motions["oil"][0].system


def observed(path):
    """Jellett's integral and the slip at each instant, in the axes of space."""
    q, v = path.q[:, 0], path.v[:, 0]
    turned = Rotation.from_quat(q[:, [4, 5, 6, 3]])
    (w, u), (dw, du) = ((a[:, 3:4], a[:, 4:]) for a in (q, v))
    omega = 2 * (w * du - dw * u + np.cross(u, du))
    momentum = turned.apply([I1, I1, I3] * turned.inv().apply(omega))
    from_centre = A * R * turned.apply([0, 0, 1]) - [0, 0, R]
    slip = v[:, :3] + np.cross(omega, [0, 0, -R])
    return -(momentum * from_centre).sum(axis=1), np.linalg.norm(slip, axis=1)


def precession(theta, lam):
    """Return friction over weight in a steady precession without slip, from forces and torques.

    The axis turns about the vertical at the rate ``W``, the ball about its axis with ``n``.  The
    horizontal part ``sin(theta) (I3 n - I1 W cos(theta))`` of the angular momentum turns with
    ``W``, by the torque of the contact; the centre of mass goes round in a circle, by the friction.
    """
    s, c = math.sin(theta), math.cos(theta)
    least = lam / R / (I1 * s**2 + I3 * (c - A) ** 2)  # W without friction

    def friction(W, n):
        return -M * W * R * s * (W * (c - A) - n)

    def balance(scaled):
        W, n = least * scaled
        torque = -R * (1 - A * c) * friction(W, n) - A * R * s * WEIGHT
        kept = R * (I1 * W * s**2 + I3 * n * (c - A))
        return (W * s * (I3 * n - I1 * W * c) - torque) / (WEIGHT * R), kept / lam - 1

    found = root(balance, [1, c - A], tol=1e-9)
    assert np.abs(found.fun).max() < 1e-12
    return friction(*least * found.x) / WEIGHT


@pytest.mark.parametrize("table", ["oil", "dry"])
def test_jellett_integral_is_conserved_to_second_order(oil, table):
    system = oil if table == "oil" else top.dry(0.02)
    drifts = []
    for dt in (2e-3, 1e-3, 5e-4):
        path = top.spun(system, 70, seconds=6, dt=dt)
        lam, _ = observed(path)
        assert lam[0] == pytest.approx(R * I3 * 70 * (math.cos(top.TILT) - A), rel=1e-12)
        assert top.jellett(path)[0] == pytest.approx(lam[0], rel=1e-12)
        assert inclinations(path)[-1] > 1  # after much sliding
        drifts.append(np.ptp(lam) / lam[0])
    assert drifts[-1] < 1e-4
    np.testing.assert_allclose(np.divide(drifts[:-1], drifts[1:]), 4, rtol=0.05)


def test_energy_never_grows(motions):
    for table, limit in {"oil": 1e-7, "slippery": 1e-6}.items():
        for path in motions[table]:
            energy = path.kinetic + path.potential
            assert np.diff(energy).max() < limit * energy[0], (table, path)
            assert energy[-1] < 0.99 * energy[0]
            assert path.audit < 5e-3


def test_on_oil_the_energy_of_precessions_becomes_least(motions):
    least = [top.expected(observed(path)[0][0]) for path in motions["oil"]]
    np.testing.assert_allclose(least, [0, 1.18, 2.17, math.pi], atol=0.01)
    ends = [inclinations(path)[-1] for path in motions["oil"]]
    np.testing.assert_allclose(ends, least, atol=1e-3)


@pytest.mark.parametrize("spin", [32, 45, 60, 70, 80])
def test_least_energy_is_a_precession_without_friction(spin):
    lam = R * I3 * spin * (math.cos(top.TILT) - A)
    expected = top.expected(lam)
    theta = brentq(precession, expected - 0.1, expected + 0.1, args=(lam,), xtol=1e-12)
    assert theta == pytest.approx(expected, abs=1e-9)


def threshold(way):
    """Return the integral where a spin upright (``way`` 1) or upside down (-1) loses stability.

    With ``x = cos(theta)`` it is where ``dW / dx = 0`` at ``x = way``; upside down it is the
    threshold of [RR].
    """
    against = way * (I1 / I3 - 1) + A
    return (1 - way * A) ** 2 * math.sqrt(WEIGHT * R**3 * I3 * A / against)


def test_thresholds_are_where_the_minimum_leaves_the_poles():
    low, high = threshold(1), threshold(-1)
    assert top.expected(low * (1 - 1e-9)) == 0 < top.expected(low * (1 + 1e-6)) < 0.01
    assert top.expected(high * (1 + 1e-9)) == math.pi > top.expected(high * (1 - 1e-6)) > 3.13


@pytest.mark.parametrize(("way", "seconds"), [(1, (5, 20)), (-1, (2, 6))])
def test_small_inclinations_grow_beyond_the_thresholds(oil, way, seconds):
    rates, factors = [], [0.99, 1.01]
    for factor in factors:
        tilt = 1e-3 if way == 1 else math.pi - 1e-3
        spin = factor * threshold(way) / (R * I3 * (math.cos(tilt) - A))
        path = top.spun(oil, spin, tilt, seconds=seconds[1] + 1, dt=2e-3)
        away = inclinations(path) if way == 1 else math.pi - inclinations(path)
        early, late = (np.log(away[path.at(t) : path.at(t + 1)]).mean() for t in seconds)
        rates.append((late - early) / (seconds[1] - seconds[0]))
    assert rates[0] * way < 0 < rates[1] * way
    low, high = rates
    assert factors[0] - low * 0.02 / (high - low) == pytest.approx(1, abs=1e-3)


def test_dry_friction_ends_where_the_ball_rolls_near_the_least_energy(motions):
    for path in motions["slippery"][1:]:
        lam, slip = observed(path)
        expected = top.expected(lam[0])

        def beyond(theta, lam=lam[0]):
            return abs(precession(theta, lam)) - 0.01

        rolls_from = brentq(beyond, 0.9 * expected, expected - 1e-6)
        assert slip[-1] < 1e-9
        assert rolls_from < inclinations(path)[-100:].mean() < expected < rolls_from + 0.11


def test_dry_friction_falls_short_by_its_first_order():
    short = []
    for friction in (0.02, 0.01):
        path = top.spun(top.dry(friction), 70, seconds=0.25 / friction)
        lam, slip = observed(path)
        assert slip[-1] < 1e-9
        short.append(top.expected(lam[0]) - inclinations(path)[-100:].mean())
    assert short[0] == pytest.approx(2 * short[1], rel=0.1)


def test_on_a_rough_table_the_top_rolls_and_does_not_rise(motions):
    for path in motions["rough"]:
        _, slip = observed(path)
        later, speed = path.times > 1, np.abs(path.v).max()
        assert slip[later].max() < 2 * path.solver.tolerance * speed
        assert inclinations(path).max() < top.TILT + 1e-3


def test_picture(motions, tmp_path):
    assert top.draw(motions, tmp_path / "top.png").stat().st_size > 10_000

"""Rotating bodies: Euler's, Lagrange's and Jacobi's solutions, rolling balls and discs."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

from polycorner import Manifold, Polyhedron
from polycorner.motion import (
    Disc,
    Friction,
    System,
    angular_velocity,
    rotational_energy,
    simulate,
    velocities,
)

TURN = Manifold.rotation("a")
POSE = Manifold.euclidean("x y z") * TURN
MOMENTS = np.array([1.0, 2.0, 3.0])
ONE = np.array([1.0, 0.0, 0.0, 0.0])
G = 9.81

seeds = st.integers(0, 2**32 - 1)


def turned(a):
    return Rotation.from_quat(a, scalar_first=True)


def spins(path):
    """Return the angular velocities in the body, ``(T, 3)``."""
    q, v = TURN.onto(path.q[:, 0, -4:]), path.v[:, 0, -4:]
    return 4 * np.einsum("tni,tn->ti", TURN.frame(q), v)


def top(moments=MOMENTS, potential=0):
    return System(Polyhedron(TURN, {}), rotational_energy(TURN, moments), potential)


def free_motion(spin, t_end, dt, **options):
    body = top()
    return simulate(body, body.state(ONE, TURN.frame(ONE) @ spin), t_end, dt, **options)


class TestFormulas:
    @given(seeds)
    def test_angular_velocities_are_those_of_the_frame(self, seed):
        q, w = np.split(np.random.default_rng(seed).standard_normal(7), [4])
        q = TURN.wrap(q)
        known = dict(
            zip([*TURN.symbols, *velocities(TURN)], [*q, *(TURN.frame(q) @ w)], strict=True)
        )
        body, space = (
            np.array(angular_velocity(TURN, frame=frame).subs(known), dtype=float).ravel()
            for frame in ("body", "space")
        )
        assert body == pytest.approx(w, abs=1e-12)
        assert space == pytest.approx(turned(q).apply(w), abs=1e-12)
        energy = float(rotational_energy(TURN, MOMENTS).subs(known))
        assert energy == pytest.approx(MOMENTS @ w**2 / 2)

    def test_inertia_may_be_a_matrix(self):
        tensor = [[2, 1, 0], [1, 2, 0], [0, 0, 2]]
        q, w = ONE, np.array([1.0, -1.0, 0.5])
        known = dict(
            zip([*TURN.symbols, *velocities(TURN)], [*q, *(TURN.frame(q) @ w)], strict=True)
        )
        energy = float(rotational_energy(TURN, tensor).subs(known))
        assert energy == pytest.approx(w @ np.array(tensor) @ w / 2)

    @pytest.mark.parametrize("inertia", [[1, 2], [1, 1, -1], [[1, 2, 0], [0, 1, 0], [0, 0, 1]]])
    def test_other_moments_are_refused(self, inertia):
        with pytest.raises(ValueError, match="inertia: expected three positive moments"):
            rotational_energy(TURN, inertia)

    def test_velocities_must_be_tangent(self):
        with pytest.raises(ValueError, match="v: expected velocities along"):
            top().state(ONE, [1.0, 0.0, 0.0, 0.0])
        with pytest.raises(ValueError, match=r"q: expected a quaternion .* length 1"):
            top().state([1.0, 1.0, 0.0, 0.0])


class TestFreeRotation:
    SPIN = np.array([0.01, 1.0, 0.02])

    def jacobi(self):
        """Return amplitudes, rate and modulus for ``L^2 > 2 E J_2`` ([LL] sec. 37)."""
        energy2, momentum2 = MOMENTS @ self.SPIN**2, ((MOMENTS * self.SPIN) ** 2).sum()
        a, b, c = MOMENTS
        assert momentum2 > energy2 * b
        rate = math.sqrt((c - b) * (momentum2 - energy2 * a) / (a * b * c))
        modulus = (b - a) * (energy2 * c - momentum2) / ((c - b) * (momentum2 - energy2 * a))
        largest = math.sqrt((energy2 * c - momentum2) / (b * (c - b)))
        return largest, rate, modulus

    def test_the_intermediate_axis_turns_over_with_jacobis_period(self):
        _, rate, modulus = self.jacobi()
        path = free_motion(self.SPIN, 100.0, 0.005, every=4)
        w = spins(path)[:, 1]
        before = np.flatnonzero(w[:-1] * w[1:] < 0)
        at = path.times[before] + (path.times[1] - path.times[0]) * w[before] / (
            w[before] - w[before + 1]
        )
        assert len(at) >= 4
        assert np.diff(at) == pytest.approx(2 * ellipk(modulus) / rate, rel=1e-4)

    def test_the_angular_velocity_converges_to_jacobis_to_second_order(self):
        largest, rate, modulus = self.jacobi()
        errors = []
        for dt in (0.04, 0.02, 0.01):
            path = free_motion(self.SPIN, 16.0, dt, every=round(0.4 / dt))
            w = spins(path)[:, 1]
            start = np.arcsin(min(1.0, self.SPIN[1] / largest))
            shift = _first_kind(start, modulus)
            # w_2 = largest sn; w_1 and w_3 have one sign here, and w_2 falls.
            exact = largest * ellipj(rate * path.times * self._direction() + shift, modulus)[0]
            errors.append(abs(w - exact).max())
        orders = np.log2(np.divide(errors[:-1], errors[1:]))
        assert orders == pytest.approx([2, 2], abs=0.1)

    def _direction(self):
        """Sign of the change of ``w_2`` at first, by Euler's equation."""
        a, _, c = MOMENTS
        return np.sign((c - a) * self.SPIN[2] * self.SPIN[0])

    def test_energy_and_momentum_do_not_drift_in_a_million_steps(self):
        path = free_motion(self.SPIN, 10_000.0, 0.01)
        w = spins(path)
        energy = (w**2 @ MOMENTS) / 2
        momentum = turned(path.q[:, 0]).apply(w * MOMENTS)
        for values, bound in ((energy[:, None], 2e-6), (momentum, 3e-4)):
            off = np.linalg.norm(values - values[0], axis=1)
            assert off.max() < bound
            assert off[100:].max() < 1.05 * off[:100].max()  # reached in the first tenth
        assert abs(np.linalg.norm(path.q[:, 0], axis=1) - 1).max() < 1e-5

    def test_a_ball_turns_uniformly(self):
        """Its mass matrix is constant; steps lead exactly along a great circle."""
        body = top([2, 2, 2])
        spin = np.array([0.3, -0.4, 1.2])
        path = simulate(body, body.state(ONE, TURN.frame(ONE) @ spin), 20.0, 0.01)
        wanted = Rotation.from_rotvec(path.times[:, None] * spin)
        angles = (turned(path.q[:, 0]) * wanted.inv()).magnitude()
        assert angles.max() < 20 * 1.3**3 * 0.01**2 / 12

    def test_the_normalising_force_is_not_recorded(self):
        assert not any(free_motion(self.SPIN, 0.1, 0.01).touching)


def _first_kind(amplitude, modulus):
    from scipy.special import ellipkinc

    return ellipkinc(amplitude, modulus)


class TestHeavyTop:
    def test_a_steady_precession_remains_steady(self):
        """``J_3 w_3 W - J_1 W^2 cos t = m g l`` ([LL] sec. 35), about the vertical."""
        tilt, rate, weight = 0.6, 1.5, 2.0
        J = np.array([1.0, 1.0, 0.5])
        spin = (weight + J[0] * rate**2 * math.cos(tilt)) / (J[2] * rate)
        body = top(J, weight * TURN.matrix()[2, 2])
        start = np.array([math.cos(tilt / 2), math.sin(tilt / 2), 0, 0])
        vertical = turned(start).inv().apply([0, 0, rate])
        w = vertical + np.array([0, 0, spin - rate * math.cos(tilt)])
        path = simulate(body, body.state(start, TURN.frame(start) @ w), 10.0, 0.002)
        axes = turned(path.q[:, 0]).apply([0, 0, 1.0])
        assert axes[:, 2] == pytest.approx(math.cos(tilt), abs=4e-5)
        azimuth = np.unwrap(np.arctan2(axes[:, 1], axes[:, 0]))
        assert azimuth - azimuth[0] == pytest.approx(rate * path.times, abs=1e-3)


def body_on_floor(gap, contact, J, friction, slope=0.0):
    """Return a body of mass 1 on a floor; ``contact`` leads from its centre to the floor."""
    v = sp.Matrix(velocities(POSE)[:3])
    slip = v + angular_velocity(POSE, frame="space").cross(contact)
    kinetic = v.dot(v) / 2 + rotational_energy(POSE, J)
    x, _, z = POSE.symbols[:3]
    down = G * (math.cos(slope) * z - math.sin(slope) * x)
    rub = Friction("rub", (slip[0], slip[1]), Disc(friction), load="floor")
    return System(Polyhedron(POSE, {"floor": gap}), kinetic, down, friction=(rub,))


class TestBalls:
    """A solid ball of radius 1 has the moment of inertia 2/5."""

    def ball(self, friction, slope=0.0):
        contact = sp.Matrix([0, 0, -1])
        return body_on_floor(POSE.symbols[2] - 1, contact, [0.4] * 3, friction, slope)

    def test_it_rolls_down_a_slope_with_five_sevenths_of_the_acceleration(self):
        slope = 0.3
        body = self.ball(0.9, slope)
        path = simulate(body, body.state([0, 0, 1, *ONE]), 2.0, 1e-3)
        wanted = 5 / 7 * G * math.sin(slope)
        assert path.q[:, 0, 0] == pytest.approx(wanted * path.times**2 / 2, abs=1e-3)
        w = turned(path.q[:, 0, 3:]).apply(spins(path))
        assert w[:, 1] == pytest.approx(path.v[:, 0, 0], abs=2e-4)

    def test_thrown_it_slides_and_then_rolls_with_five_sevenths_of_the_speed(self):
        friction, speed = 0.2, 3.0
        body = self.ball(friction)
        path = simulate(body, body.state([0, 0, 1, *ONE], [speed, *[0] * 6]), 1.0, 5e-4)
        until = 2 * speed / (7 * friction * G)
        sliding = path.times < until - 2e-3
        v = path.v[:, 0, 0]
        assert v[sliding] == pytest.approx((speed - friction * G * path.times)[sliding], abs=1e-6)
        assert v[path.times > until + 2e-3] == pytest.approx(5 / 7 * speed, abs=2e-3)

    def test_spin_about_the_vertical_meets_no_friction(self):
        body = self.ball(0.5)
        v = np.concatenate([np.zeros(3), TURN.frame(ONE) @ [0, 0, 2.0]])
        path = simulate(body, body.state([0, 0, 1, *ONE], v), 1.0, 1e-3)
        assert spins(path)[-1] == pytest.approx([0, 0, 2.0], abs=1e-6)
        assert path.q[-1, 0, :3] == pytest.approx([0, 0, 1], abs=1e-9)


class TestDiscs:
    """A thin disc of radius 1 has the moments of inertia 1/4, 1/4 and 1/2."""

    J = np.array([0.25, 0.25, 0.5])

    def disc(self):
        n = POSE.matrix() * sp.Matrix([0, 0, 1])
        sine = sp.sqrt(1 - n[2] ** 2)
        lowest = -(sp.Matrix([0, 0, 1]) - n[2] * n) / sine
        return body_on_floor(POSE.symbols[2] - sine, lowest, self.J, 5.0)

    def rolling(self, tilt, rate):
        """Return place and velocity of steady rolling: the axis ``tilt`` from the vertical.

        The moment of momentum ``J_1 W sin t e + J_3 w_3 n`` turns with the rate ``W``:
        ``(J_3 + 1) w_3 W sin t - J_1 W^2 sin t cos t = -g cos t``, and the centre runs with
        ``-w_3`` along ``z x n / sin t``.
        """
        sine, cosine = math.sin(tilt), math.cos(tilt)
        spin = (self.J[0] * rate**2 * sine - G) * cosine / ((self.J[2] + 1) * rate * sine)
        start = np.array([math.cos(tilt / 2), math.sin(tilt / 2), 0, 0])
        axis = turned(start).apply([0, 0, 1.0])
        w = turned(start).inv().apply([0, 0, rate]) + np.array([0, 0, spin - rate * cosine])
        run = -spin * np.cross([0, 0, 1.0], axis) / sine
        return [0, 0, sine, *start], [*run, *(TURN.frame(start) @ w)], spin

    def test_a_coin_that_rolls_in_a_circle_keeps_its_tilt(self):
        tilt, rate = 1.0, 2.5
        body = self.disc()
        q, v, spin = self.rolling(tilt, rate)
        errors = []
        for dt in (4e-3, 2e-3):
            path = simulate(body, body.state(q, v), 2.5, dt)  # one turn
            axes = turned(path.q[:, 0, 3:]).apply([0, 0, 1.0])
            errors.append(abs(axes[:, 2] - math.cos(tilt)).max())
            radius = abs(spin) / rate
            assert np.ptp(path.q[:, 0, 0]) == pytest.approx(2 * radius, abs=2e-2)
        assert errors[1] < 0.3 * errors[0]  # second order, although directions of slip turn
        assert errors[1] < 2e-3

    def test_upright_it_rolls_straight(self):
        body = self.disc()
        start = turned([math.sqrt(0.5), math.sqrt(0.5), 0, 0])
        q = [0, 0, 1, *start.as_quat(scalar_first=True)]
        w = np.array([0, 0, 4.0])
        run = -np.cross(start.apply(w), [0, 0, -1.0])
        v = [*run, *(TURN.frame(q[3:]) @ w)]
        path = simulate(body, body.state(q, v), 1.0, 1e-3)
        assert path.q[-1, 0, :3] == pytest.approx([*run[:2], 1], abs=1e-5)
        assert path.kinetic == pytest.approx(8 + 4, rel=1e-5)

"""Prescribed motions without a limit: equations with the time, against closed forms."""

import math

import numpy as np
import pytest
import sympy
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from polycorner import Manifold, Polyhedron, System, simulate
from polycorner.bodies import Arrangement, Hinge, Mass, Prescribed, Slider, capsule, disc
from polycorner.motion import EventKind, accelerations, time_symbol, velocities

G = 9.81
NOW = time_symbol()
M = Manifold.euclidean("x y")
(X, Y), (VX, VY) = M.symbols, velocities(M)


def middles(path):
    """Times and coordinates in the middle of the steps that end at each record but the first."""
    return path.times[1:] - path.dt / 2, path.q[1:, 0] - path.dt / 2 * path.v[1:, 0]


def crank_and_piston(crank=1.0, rod=2.5):
    joints = {
        "O": Hinge("world", "crank"),
        "A": Hinge("crank", "rod", at=[crank, 0]),
        "B": Hinge("rod", "piston", at=[rod, 0]),
        "C": Slider("world", "piston", axis=[1, 0]),
    }
    bodies = {"crank": capsule([0, 0], [crank, 0], 0.1), "rod": capsule([0, 0], [rod, 0], 0.1)}
    return Arrangement({**bodies, "piston": disc(0.4)}, joints=joints)


def test_a_slider_crank_at_a_constant_rate_needs_the_known_torque():
    """At the rate ``w`` the torque is ``w^2 I'(a) / 2``, with ``2 T = w^2 I(a)`` of all parts."""
    r, rod, w, start = 1.0, 2.5, 5.0, 0.7
    masses = {
        "crank": Mass(1.0, [0.5, 0], 0.1),
        "rod": Mass(2.0, [rod / 2, 0], 1.1),
        "piston": Mass(3.0, [0, 0], 1.0),
    }
    a = crank_and_piston(r, rod)
    system = a.system(masses=masses, drives={"motor": Prescribed("O", start + w * NOW)})
    slant = -math.asin(r * math.sin(start) / rod)
    q = a.point(joints={"O": start, "A": slant - start, "B": -slant})
    state = system.state(q, a.velocity(q, joints={"O": w}))
    path = simulate(system, state, 3.0, 1e-3, every=1)  # more than two turns

    times, places = middles(path)
    # The equation holds in the middle of every step, however often the crank goes round.
    assert places[:, 2] == pytest.approx(start + w * times, abs=1e-9)
    angle = start + w * path.times
    exact = r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)
    assert a.joint_values(path.q[:, 0])["C"] == pytest.approx(exact, abs=2e-5)

    angle = sympy.Symbol("angle")
    slope = -sympy.asin(r * sympy.sin(angle) / rod)
    pin = sympy.Matrix([r * sympy.cos(angle), r * sympy.sin(angle)])
    middle = pin + rod / 2 * sympy.Matrix([sympy.cos(slope), sympy.sin(slope)])
    end = pin[0] + rod * sympy.cos(slope)
    inertia = 0.1 + 0.25 + 2 * (middle.diff(angle).dot(middle.diff(angle)))
    inertia += 1.1 * slope.diff(angle) ** 2 + 3 * end.diff(angle) ** 2
    torque = sympy.lambdify(angle, w**2 / 2 * inertia.diff(angle))
    energy = sympy.lambdify(angle, w**2 / 2 * inertia)
    force = [{n: f for _, n, f in touching}["motor"] for touching in path.touching[1:]]
    assert force == pytest.approx(torque(start + w * times), abs=0.06)  # of about 100
    gained = energy(start + w * path.times) - energy(start)
    assert path.work["drive"] == pytest.approx(gained, abs=2e-3)
    assert path.audit < 1e-5
    # Rows with a derivative by the time are as linear as others: a few Newton steps solve them.
    assert path.effort.newton_steps < 8 * path.effort.steps
    assert path.effort.parts == 0


def shaken(amplitude, w):
    """A block of one coordinate above a table whose height is ``amplitude sin(w t)``."""
    space = Polyhedron(M, {"contact": Y - X})
    drives = {"shaker": X - amplitude * sympy.sin(w * NOW)}
    kinetic = 5 * VX**2 + VY**2 / 2
    return System(space, kinetic, G * (10 * X + Y), rheonomic=drives)


@pytest.mark.parametrize("share", [0.9, 2.0])
def test_a_block_hops_on_a_table_that_is_shaken_harder_than_gravity(share):
    """It leaves where ``A w^2 sin(w t) = g``, flies freely, and lands where the two meet again."""
    w = 20.0
    amplitude = share * G / w**2
    system = shaken(amplitude, w)
    state = system.state([0, 0], [amplitude * w, amplitude * w])
    path = simulate(system, state, 0.3, 1e-4, every=1)
    times, places = middles(path)
    off = abs(places[:, 0] - amplitude * np.sin(w * times))
    assert (off > 1e-10).sum() <= (share > 1)  # a step with an impact is done in parts
    assert path.audit < 1e-5
    if share < 1:
        assert not path.of_kind(EventKind.LOST)
        assert path.q[:, 0, 1] == pytest.approx(path.q[:, 0, 0], abs=1e-9)
        return
    leaves = math.asin(1 / share) / w
    height, speed = (
        amplitude * math.sin(w * leaves),
        amplitude * w * math.cos(w * leaves),
    )

    def apart(t):
        flight = t - leaves
        return height + speed * flight - G * flight**2 / 2 - amplitude * math.sin(w * t)

    lands = brentq(apart, leaves + 0.05, leaves + 0.3)
    assert path.of_kind(EventKind.LOST)[0].time == pytest.approx(leaves, abs=2e-4)
    assert path.of_kind(EventKind.MADE)[-1].time == pytest.approx(lands, abs=2e-4)
    assert path.q[:, 0, 1].max() == pytest.approx(height + speed**2 / (2 * G), abs=1e-5)


def test_a_ball_bounces_off_a_moving_table_with_the_relative_velocity():
    """``v+ - u = -e (v- - u)`` at the instant of the impact, also where the table accelerates."""
    amplitude, w, e = 0.02, 7.0, 0.8
    table = amplitude * sympy.sin(w * NOW)
    system = System(
        Polyhedron(M, {"contact": Y - X}),
        (VX**2 + VY**2) / 2,
        G * (X + Y),
        restitution=e,
        rheonomic={"shaker": X - table},
    )
    path = simulate(system, system.state([0, 0.5], [amplitude * w, 0]), 0.5, 1e-4, every=1)
    hit = brentq(lambda t: 0.5 - G * t**2 / 2 - amplitude * math.sin(w * t), 0.2, 0.4)
    u = amplitude * w * math.cos(w * hit)
    speed = u + e * (G * hit + u)
    event = path.of_kind(EventKind.IMPACT)[0]
    assert event.time == pytest.approx(hit, abs=1e-8)
    after = np.searchsorted(path.times, event.time) + 1
    assert path.v[after, 0, 1] + G * (path.times[after] - hit) == pytest.approx(speed, abs=1e-6)
    # The impulse of unit masses; the drive takes all of it, and its work keeps the balance.
    assert event.impulse == pytest.approx(speed + G * hit, abs=1e-5)
    assert path.audit < 1e-6


def test_a_table_of_an_arrangement_shakes_its_block_by_a_coordinate_or_by_a_joint():
    amplitude, w = 2 * G / 20.0**2, 20.0
    a = Arrangement(
        {"T": capsule([-1, 0], [1, 0], 0.1), "B": disc(0.2)},
        joints={"rail": Slider("world", "T", axis=[0, 1])},
    )
    lost = []
    for of in ("rail", "yT"):
        shaker = Prescribed(of, amplitude * sympy.sin(w * NOW))
        system = a.system(gravity=[0, -G], drives={"shaker": shaker})
        q = a.point({"B": [0, 0.3]}, joints={"rail": 0.0})
        speed = amplitude * w
        state = system.state(q, a.velocity(q, {"B": [0, speed]}, joints={"rail": speed}))
        path = simulate(system, state, 0.1, 5e-4, every=1)
        lost.append(path.of_kind(EventKind.LOST)[0].time)
        assert {"work of drive" in line for line in [str(path)]} == {True}
    assert lost == pytest.approx([math.asin(0.5) / w] * 2, abs=1e-3)


def test_a_hinge_in_space_follows_over_several_turns():
    a = Arrangement(
        {"A": capsule([-1, 0, 0], [1, 0, 0], 0.1)},
        joints={"nail": Hinge("world", "A", on=[-1, 0, 0], axis=[0, 1, 1])},
    )
    motion = 0.3 + 15 * NOW**2
    system = a.system(gravity=[0, 0, -G], drives={"p": Prescribed("nail", motion)})
    path = simulate(system, system.state(a.point(joints={"nail": 0.3})), 1.0, 1e-3, every=1)
    times, places = middles(path)
    aim = 0.3 + 15 * times**2
    off = a.joint_values(places)["nail"] - aim
    assert np.remainder(off + math.pi, math.tau) - math.pi == pytest.approx(0, abs=1e-7)
    turned = Rotation.from_quat(path.q[-1, 0, [4, 5, 6, 3]])
    exact = Rotation.from_rotvec(15.3 * np.array([0, 1, 1]) / math.sqrt(2))
    assert (turned * exact.inv()).magnitude() < 1e-4


def test_states_that_do_not_follow_are_refused():
    system = shaken(0.1, 3.0)
    with pytest.raises(ValueError, match=r"q: expected equation 'shaker' to hold at the time 0;"):
        system.state([0.01, 0.1])
    with pytest.raises(ValueError, match=r"v: expected velocities that follow .* rate -0\.3"):
        system.state([0, 0])
    moved = [0.1 * math.sin(0.6), 1.0], [0.3 * math.cos(0.6), 0.0]
    state = system.state(*moved, time=0.2)
    assert state.time == 0.2
    with pytest.raises(ValueError, match="system: expected equations that do not"):
        accelerations(system, state)
    with pytest.raises(ValueError, match="rheonomic: expected names of their own; got 'contact'"):
        System(Polyhedron(M, {"contact": Y}), VX**2 + VY**2, rheonomic={"contact": X - NOW})
    with pytest.raises(ValueError, match="rheonomic: expected a formula in coordinates"):
        System(Polyhedron(M, {"contact": Y}), VX**2 + VY**2, rheonomic={"p": NOW})


@pytest.mark.parametrize("dt", [1e-3, 7e-3])
def test_a_table_that_rises_at_a_constant_rate_meets_a_block_in_few_iterations(dt):
    a = Arrangement(
        {"table": capsule([-1, 0], [1, 0], 0.1), "block": disc(0.2)},
        joints={"rail": Slider("world", "table", axis=[0, 1])},
    )
    system = a.system(drives={"lift": Prescribed("rail", NOW)})
    q = a.point({"block": [0, 0.4]})
    path = simulate(system, system.state(q, a.velocity(q, joints={"rail": 1.0})), 0.14, dt)
    (made,) = path.events
    assert (made.kind.name, made.time) == ("MADE", pytest.approx(0.1, abs=1e-8))
    assert path.effort.islands < 4 * path.effort.steps

"""Hinges whose limits are turns apart: turns are counted, and nothing else changes."""

import math

import numpy as np
import pytest

from polycorner import certify, minimise, simulate, stratum_at
from polycorner.bodies import (
    Arrangement,
    Gear,
    Hinge,
    Mass,
    Slider,
    Spring,
    capsule,
    disc,
    mass_of,
)

BAR, ROD = capsule([-1, 0], [1, 0], 0.1), capsule([-1, 0, 0], [1, 0, 0], 0.1)
THREE = 3 * math.tau


def wheel(d, **more):
    """A bar that turns about its middle; in space about a slanted axis."""
    if d == 2:
        return Arrangement({"A": BAR}, joints={"hub": Hinge("world", "A", **more)})
    return Arrangement({"A": ROD}, joints={"hub": Hinge("world", "A", axis=[0, 1, 1], **more)})


@pytest.mark.parametrize("d", [2, 3])
def test_a_wheel_turns_three_times_and_bounces_off_its_stop(d):
    a = wheel(d, limits=(-1.0, THREE))
    assert a.polyhedron.names == ("hub.min", "hub.max")
    assert "hub.turns" in a.polyhedron.equation_names
    e, rate, start = 0.6, 20.0, 0.3
    q = a.point(joints={"hub": start})
    system = a.system(restitution={"hub": e})
    v = a.velocity(q, joints={"hub": rate})
    kinetic, _ = system.energies(system.state(q, v))
    if d == 2:
        assert kinetic == pytest.approx(mass_of(BAR).inertia * rate**2 / 2)
    path = simulate(system, system.state(q, v), 1.5, 1e-3, every=1)
    hit = (THREE - start) / rate
    angle = a.joint_values(path.q[:, 0])["hub"]
    exact = np.where(
        path.times < hit, start + rate * path.times, THREE - e * rate * (path.times - hit)
    )
    # In the step of the impact the two straight lines meet elsewhere than at its ends.
    assert angle == pytest.approx(exact, abs=2e-3 if d == 3 else 1e-6)
    (bounce,) = [event for event in path.events if event.contact == "hub.max"]
    assert bounce.time == pytest.approx(hit, abs=1e-3 if d == 3 else 1e-8)
    assert path.kinetic[-1] == pytest.approx(e**2 * path.kinetic[0], rel=1e-4)


def test_a_counted_pendulum_swings_as_one_that_is_not():
    masses = {"A": Mass(2.0, [0.4, 0], 0.3)}
    found = []
    for limits in (None, (-THREE, THREE)):
        a = wheel(2, limits=limits)
        system = a.system(gravity=[0, -9.81], masses=masses)
        q = a.point(joints={"hub": 0.4})
        path = simulate(system, system.state(q), 1.5, 1e-3)
        found.append(path.q[:, 0, :3])
    np.testing.assert_allclose(*found, atol=1e-7)


def test_a_screw_of_three_turns_goes_as_far_as_its_lead():
    """A nut on a screw goes ``lead`` with each turn, by a gear, up to where three turns end."""
    lead = 0.25
    joints = {
        "turn": Hinge("world", "screw", limits=(0.0, THREE)),
        "way": Slider("world", "nut", axis=[1, 0], at=[0, 3]),
        "thread": Gear("turn", "way", lead / math.tau),
    }
    a = Arrangement({"screw": BAR, "nut": disc(0.2)}, joints=joints)
    q = a.point(joints={"turn": 1.0})
    best = minimise(a.polyhedron, -a.joint_function("way"), q)
    assert best.active == ("turn.max",)
    values = a.joint_values(best.point)
    assert values["turn"] == pytest.approx(THREE)
    assert values["way"] == pytest.approx(3 * lead)
    assert stratum_at(a.polyhedron, best.point).dimension == 0
    held = a.system(drives={"spring": Spring("turn", stiffness=2.0, length=4 * math.pi)})
    rest = minimise(a.polyhedron, held.potential, q)
    assert a.joint_values(rest.point)["turn"] == pytest.approx(4 * math.pi)  # two turns
    assert certify(a.polyhedron, held.potential, rest.point).verdict.name == "STRICT_MINIMUM"


def test_turns_are_told_apart_by_a_point():
    a = wheel(2, limits=(-THREE, math.inf))
    once, twice = (a.point(joints={"hub": 0.5 + k * math.tau}) for k in (1, 2))
    assert a.joint_values(once)["hub"] == pytest.approx(0.5 + math.tau)
    assert a.joint_values(twice)["hub"] == pytest.approx(0.5 + 2 * math.tau)
    assert not a.polyhedron.contains(a.point(joints={"hub": -THREE - 0.1}), tolerance=1e-9)
    one, two = (a.placed(q)["A"].parts[""].points for q in (once, twice))
    np.testing.assert_allclose(one, two, atol=1e-12)


@pytest.mark.parametrize("kinds", [False, True])
def test_turns_of_repeated_bodies_are_counted_by_their_angles(kinds):
    """Two bars turn about a pin at half the relative rate each, and bounce off three turns."""
    e, rate, first = 0.6, 20.0, 0.3
    pin = {"pin": Hinge("A 1" if not kinds else "A", "A 2" if not kinds else "B", turn=0.1,
                        limits=(-1.0, THREE))}  # fmt: skip
    bodies = {"A": BAR, "B": BAR} if kinds else {"A": BAR}
    count = {"A": 1, "B": 1} if kinds else 2
    a = Arrangement(bodies)
    system = a.system(count=count, joints=pin, restitution={"pin": e})
    q = np.array([[0, 0, -math.tau], [0, 0, first + 0.1 - math.tau]])
    v = np.array([[0, 0, -rate / 2], [0, 0, rate / 2]])
    start = [{"A": x[:1], "B": x[1:]} if kinds else x for x in (q, v)]
    path = simulate(system, system.state(*start), 1.5, 1e-3)
    angles = path.q.reshape(-1, 2, 3)[:, :, 2]
    hit = (THREE - first) / rate
    exact = np.where(
        path.times < hit, first + rate * path.times, THREE - e * rate * (path.times - hit)
    )
    assert angles[:, 1] - angles[:, 0] - 0.1 == pytest.approx(exact, abs=1e-6)
    assert angles.sum(axis=1) == pytest.approx(angles[0].sum(), abs=1e-9)
    (bounce,) = [event for event in path.events if event.contact == "pin.max"]
    assert bounce.time == pytest.approx(hit, abs=1e-8)
    q[1, 2] += THREE
    with pytest.raises(ValueError, match=r"q: expected limit 'pin.max' .* not to be passed"):
        system.state({"A": q[:1], "B": q[1:]} if kinds else q)


def test_springs_and_gears_of_repeated_bodies_act_on_the_counted_angle():
    """A rack goes by its pinion, that a spring turns back by two turns and a half."""
    lead, stiff, start = 0.1, 3.0, 5 * math.pi
    joints = {
        "hub": Hinge("world", "wheel", limits=(-THREE, THREE)),
        "way": Slider("world", "rack", axis=[1, 0], at=[0, 3]),
        "teeth": Gear("hub", "way", lead),
    }
    a = Arrangement({"wheel": BAR, "rack": disc(0.2)}, joints=joints)
    spring = {"spring": Spring("hub", stiffness=stiff)}
    q = a.point(joints={"hub": start})
    system = a.system(drives=spring, count={"wheel": 1, "rack": 1})
    wheel = np.append(q[a.placements[0].at], start)  # the angle of a joint with space is counted
    wheel[2] = start
    path = simulate(
        system, system.state({"wheel": [wheel], "rack": [q[a.placements[1].at]]}), 1, 1e-3
    )
    inertia = mass_of(BAR).inertia + mass_of(disc(0.2)).mass * lead**2
    swing = start * np.cos(math.sqrt(stiff / inertia) * path.times)
    np.testing.assert_allclose(path["wheel"].q[:, 0, 2], swing, atol=1e-3)
    np.testing.assert_allclose(path["wheel"].q[:, 0, 3], swing, atol=1e-3)
    np.testing.assert_allclose(path["rack"].q[:, 0, 0], lead * swing, atol=1e-4)

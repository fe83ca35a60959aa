"""Joints and drives of repeated bodies, against listed ones and closed forms."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Ball,
    Damper,
    Fixed,
    Gear,
    HalfSpace,
    Hinge,
    Motor,
    Prescribed,
    Rail,
    Slider,
    Spring,
    capsule,
    disc,
    sphere,
)
from polycorner.motion import EventKind, Solver, pair_coordinates, time_symbol
from polycorner.motion.simulation import start

G = 9.81
FLOOR = {"floor": HalfSpace([0, 1], [0, 0])}
BAR = capsule([-1, 0], [1, 0], 0.1)


def split(arrangement, q):
    """Return a point of listed bodies by kind."""
    return {p.name: q[None, p.at] for p in arrangement.placements}


def both(arrangement, q, seconds, dt, **laws):
    """Return the motions of listed bodies and of kinds with one body each."""
    listed = arrangement.system(**laws)
    kinds = arrangement.system(**laws, count=dict.fromkeys(arrangement.named, 1))
    starts = listed.state(q), kinds.state(split(arrangement, q))
    return [
        simulate(system, begin, seconds, dt, solver=Solver(tolerance=1e-9))
        for system, begin in zip((listed, kinds), starts, strict=True)
    ]


def forces_at(path, when):
    return {contact: force for _, contact, force in path.touching[when]}


def test_tied_bodies_of_two_kinds_move_as_listed_ones():
    """A joint with space is a body's own; limits, friction, springs and motors are ties."""
    joints = {
        "nail": Hinge("world", "A", at=[0, 3], on=[-1, 0]),
        "elbow": Hinge("A", "B", at=[1, 0], on=[-1, 0], limits=(-1.2, 2.5)),
    }
    arrangement = Arrangement({"A": BAR, "B": BAR}, FLOOR, joints=joints)
    drives = {
        "spring": Spring("A", "B", stiffness=3.0, length=1.0, damping=0.1),
        "motor": Motor("elbow", speed=-1.0, limit=3.0),
        "brake": Damper("nail", damping=0.3),
    }
    laws = {"friction": {"floor": 0.3, "elbow": 0.02, "nail": 0.1}, "restitution": {"elbow": 0.5}}
    q = arrangement.point(joints={"nail": -0.2, "elbow": -0.4})
    # Until the third impact with the limit: how often the elbow then bounces is decided by
    # rounding.
    listed, kinds = both(arrangement, q, 1.07, 1e-3, gravity=[0, -G], drives=drives, **laws)
    bounces = [len(path.of_kind(EventKind.IMPACT)) for path in (listed, kinds)]
    assert bounces[0] == bounces[1] > 0
    np.testing.assert_allclose(kinds.q, listed.q[:, 0], atol=1e-6)
    np.testing.assert_allclose(kinds.kinetic, listed.kinetic, atol=1e-5)
    np.testing.assert_allclose(kinds.potential, listed.potential, atol=1e-5)
    for cause, losses in listed.dissipated.items():
        assert kinds.dissipated[cause][-1] == pytest.approx(losses[-1], abs=1e-5)
    for work, done in listed.work.items():
        assert kinds.work[work][-1] == pytest.approx(done[-1], abs=1e-5)
    assert forces_at(kinds, -1) == pytest.approx(forces_at(listed, -1), rel=1e-3, abs=1e-3)


def test_bodies_with_different_coordinates_are_tied():
    """A disc that is only shifted and a bar that turns."""
    arrangement = Arrangement({"bar": BAR, "disc": disc(0.4)})
    spring = Spring("bar", "disc", at=[1, 0], stiffness=5.0, length=0.5, damping=0.2)
    q = np.array([0.0, 0.0, 0.3, 2.5, 0.4])
    drives = {"spring": spring}
    listed, kinds = both(arrangement, q, 1.0, 1e-3, drives=drives)
    assert np.ptp(listed.q[:, 0, 2]) > 0.1
    np.testing.assert_allclose(kinds.q, listed.q[:, 0], atol=1e-7)
    listed, kinds = (
        arrangement.system(drives=drives, **counts)
        for counts in ({}, {"count": {"bar": 1, "disc": 1}})
    )
    steps = (
        system.largest_step(system.state(at))[0]
        for system, at in ((listed, q), (kinds, split(arrangement, q)))
    )
    assert next(steps) == pytest.approx(next(steps), rel=1e-6)


def test_tied_bodies_in_space_move_as_listed_ones():
    link = capsule([0, 0, 0], [1, 0, 0], 0.1)
    joints = {
        "hook": Ball("world", "A"),
        "hinge": Hinge(
            "A", "B", at=[1, 0, 0], axis=[0, 0.6, 0.8], turn=Rotation.from_rotvec([0.3, 0, 0])
        ),
        "weld": Fixed("B", "C", at=[1, 0, 0]),
    }
    bodies = {"A": link, "B": link, "C": sphere(0.3)}
    arrangement = Arrangement(bodies, joints=joints, orientations="all")
    q = arrangement.point({"A": ([0, 0, 0], Rotation.from_rotvec([0, 0.3, 0.2]))})
    listed, kinds = both(arrangement, q, 0.5, 1e-3, gravity=[0, 0, -G])
    np.testing.assert_allclose(kinds.q, listed.q[:, 0], atol=1e-6)
    assert abs(kinds.audit) < 1e-5


def test_masses_on_geared_sliders_are_atwoods_machine():
    """``a = (m_1 - m_2) g / (m_1 + m_2)``; the gear is of two bodies, each on a slider."""
    arrangement = Arrangement(
        {"A": disc(1.0), "B": disc(0.5)},
        joints={
            "left": Slider("world", "A", at=[0, 0], axis=[0, 1]),
            "right": Slider("world", "B", at=[3, 0], axis=[0, 1]),
            "rope": Gear("left", "right", -1.0),
        },
    )
    system = arrangement.system(gravity=[0, -G], count={"A": 1, "B": 1})
    q = split(arrangement, arrangement.point(joints={"left": 0.0}))
    path = simulate(system, system.state(q), 0.5, 1e-3)
    a = -(4 - 1) / (4 + 1) * G
    np.testing.assert_allclose(path["A"].q[:, 0, 1], a * path.times**2 / 2, atol=1e-9)
    np.testing.assert_allclose(path["B"].q[:, 0, 1], -a * path.times**2 / 2, atol=1e-9)


def test_a_gear_of_three_joints_ties_two_bodies():
    """``y = -x + (y - x) / 2`` is ``y = -3 x``, and ``(m_1 + 9 m_2) x'' = (3 m_2 - m_1) g``."""
    arrangement = Arrangement(
        {"A": disc(1.0), "B": disc(0.5)},
        joints={
            "left": Slider("world", "A", axis=[0, 1]),
            "right": Slider("world", "B", at=[3, 0], axis=[0, 1]),
            "apart": Rail("A", "B", at=[3, 0], axis=[0, 1]),
            "rope": Gear("left", "right", -1.0, further={"apart": 0.5}),
        },
    )
    system = arrangement.system(gravity=[0, -G], count={"A": 1, "B": 1})
    q = split(arrangement, arrangement.point(joints={"left": 0.0}))
    path = simulate(system, system.state(q), 0.5, 1e-3)
    a = (3 * 1 - 4) / (4 + 9 * 1) * G
    np.testing.assert_allclose(path["A"].q[:, 0, 1], a * path.times**2 / 2, atol=1e-9)
    np.testing.assert_allclose(path["B"].q[:, 0, 1], -3 * a * path.times**2 / 2, atol=1e-9)


def hanging(n, pull, **laws):
    """Return a chain of bars between two nails, a polygon of forces, and the forces at its pins.

    Each bar has the weight ``w``, so that ``tan(theta_i) = (i - (n - 1) / 2) w / H`` where ``H`` is
    the horizontal pull: bar by bar, the moments of the forces at its ends are in balance.
    """
    arrangement = Arrangement({"link": BAR}, orientations="all")
    density = 1.0 / (4 * 0.1 + math.pi * 0.1**2) / G  # the weight of a bar is 1
    angles = np.arctan((np.arange(n) - (n - 1) / 2) / pull)
    along = np.column_stack([np.cos(angles), np.sin(angles)])
    ends = np.vstack([[0, 0], 2 * np.cumsum(along, axis=0)])
    joints = {"first": Hinge("world", "link 1", at=ends[0], on=[-1, 0])}
    joints |= {
        f"pin{i}": Hinge(f"link {i}", f"link {i + 1}", at=[1, 0], on=[-1, 0]) for i in range(1, n)
    }
    joints["last"] = Hinge("world", f"link {n}", at=ends[-1], on=[1, 0])
    system = arrangement.system(gravity=[0, -G], density=density, count=n, joints=joints, **laws)
    up = np.arange(n + 1) - n / 2  # vertical force at each pin
    return system, np.column_stack([ends[:-1] + along, angles]), up


def test_a_chain_of_a_hundred_links_hangs_in_its_polygon_of_forces():
    n, pull = 100, 30.0
    system, q, up = hanging(n, pull)
    path = simulate(system, system.state(q), 0.01, 2e-3, solver=Solver(tolerance=1e-9))
    np.testing.assert_allclose(path.q[-1], q, atol=1e-7)
    forces = forces_at(path, -1)
    for i, name in enumerate(["first", *(f"pin{k}" for k in range(1, n))]):
        # On the child, the bar to the right of the pin: the chain to the left pulls it.
        assert forces[f"{name}.x"] == pytest.approx(-pull, rel=1e-4)
        assert forces[f"{name}.y"] == pytest.approx(-up[i], abs=1e-3)
    assert len(system.bodies.ties.forms) == 3  # pins are alike


def test_a_long_chain_keeps_its_energy():
    n = 100
    system, q, _ = hanging(n, 30.0)
    ties = system.ties[:-1]  # let go at one end
    free = simulate(
        type(system)(
            system.polyhedron,
            system.kinetic,
            system.potential,
            count=n,
            between=system.between,
            ties=ties,
        ),
        system.state(q),
        0.3,
        1e-3,
    )
    assert np.ptp(free.kinetic) > 1
    assert np.ptp(free.kinetic + free.potential) < 1e-3 * np.ptp(free.potential)
    ends = free.q[:, 1:, :2] - free.q[:, :-1, :2]
    cosines, sines = np.cos(free.q[..., 2]), np.sin(free.q[..., 2])
    halves = np.stack([cosines[:, 1:] + cosines[:, :-1], sines[:, 1:] + sines[:, :-1]], axis=-1)
    np.testing.assert_allclose(ends, halves, atol=1e-5)


def rubbing_chain():
    """Return bars that hang on each other with friction at their pins, and balls above them."""
    arrangement = Arrangement({"link": BAR, "ball": disc(0.3)}, orientations="all")
    joints = {"nail": Hinge("world", "link 1", on=[-1, 0])}
    joints |= {
        f"pin{i}": Hinge(f"link {i}", f"link {i + 1}", at=[1, 0], on=[-1, 0]) for i in (1, 2)
    }
    system = arrangement.system(
        gravity=[0, -G],
        count={"link": 3, "ball": 1},
        joints=joints,
        friction=dict.fromkeys(joints, 25.0) | {("link", "ball"): 0.5},
    )
    flat = np.array(
        [[math.cos(0.2) * (1 + 2 * i), -math.sin(0.2) * (1 + 2 * i), -0.2] for i in range(3)]
    )
    return system, flat


def test_a_mechanism_at_rest_sleeps_and_a_blow_wakes_it():
    system, flat = rubbing_chain()
    high = system.state({"link": flat, "ball": [[0.3, 60.0, 0.0]]})
    engine = start(system, high, 2e-3)
    engine.advance(1500)  # the ball falls all the time
    assert engine.motion.asleep.tolist() == [1, 1, 1, 0]
    assert not engine.motion.v[:3].any()
    before, islands = engine.motion.q[:3].copy(), engine.effort.islands
    engine.advance(100)
    assert engine.effort.islands == islands  # nothing was solved
    np.testing.assert_array_equal(engine.motion.q[:3], before)
    forces = {name: force for _, name, force in engine.touching()}
    weight = 3 * G * (4 * 0.1 + math.pi * 0.1**2)
    assert forces["nail.y"] == pytest.approx(weight, rel=1e-3)
    parts = start(system, high, 2e-3)
    for _ in range(16):
        parts.advance(100)
    engine.advance(800)
    for _ in range(8):
        parts.advance(100)
    assert abs(engine.motion.q[:3] - before).max() > 1e-4
    assert engine.motion.asleep.tolist() == [1, 1, 1, 0]
    for name, values in engine.save().items():
        np.testing.assert_array_equal(values, parts.save()[name], err_msg=name)


def test_a_saved_sleeper_wakes_as_it_would_have():
    system, flat = rubbing_chain()
    begin = system.state({"link": flat, "ball": [[0.3, 60.0, 0.0]]})
    whole = start(system, begin, 2e-3)
    whole.advance(1600)
    other = start(system, begin, 2e-3)
    other.load({name: np.copy(values) for name, values in whole.save().items()})
    before = other.motion.q[:3].copy()
    for engine in (whole, other):
        engine.advance(160)
    assert not other.motion.asleep.any()
    assert abs(other.motion.q[:3] - before).max() > 1e-4
    np.testing.assert_array_equal(other.motion.q, whole.motion.q)
    np.testing.assert_array_equal(other.motion.v, whole.motion.v)


def test_a_joint_follows_a_function_of_the_time():
    """It never sleeps, however slowly it begins."""
    arrangement, pins = Arrangement({"A": BAR}), {"pin": Hinge("A 1", "A 2")}
    drives = {"spin": Prescribed("pin", time_symbol() ** 2, limit=100.0)}
    free, driven = (arrangement.system(count=2, joints=pins, drives=some) for some in ({}, drives))
    path = simulate(driven, driven.state(np.zeros((2, 3))), 1.0, 1e-3)
    turned = path.q[:, 1, 2] - path.q[:, 0, 2]
    np.testing.assert_allclose(turned, path.times**2, atol=1e-6)
    for system, asleep in ((free, [1, 1]), (driven, [0, 0])):
        engine = start(system, system.state(np.zeros((2, 3))), 1e-9)
        engine.advance(3)
        assert engine.motion.asleep.tolist() == asleep


@pytest.mark.parametrize("joint", ["nail", "elbow"])
def test_an_equation_with_the_time_is_followed_as_by_listed_bodies(joint):
    """In a joint with space, and between two bodies; with the same force, and the same work."""
    joints = {"nail": Hinge("world", "A", on=[-1, 0]), "elbow": Hinge("A", "B", at=[1, 0])}
    arrangement = Arrangement({"A": BAR, "B": BAR}, joints=joints)
    drives = {"p": Prescribed(joint, 0.3 + time_symbol() ** 2)}
    q = arrangement.point(joints={"nail": 0.3, "elbow": 0.3})
    listed, kinds = both(arrangement, q, 1.0, 1e-3, gravity=[0, -G], drives=drives)
    np.testing.assert_allclose(kinds.q, listed.q[:, 0], atol=1e-6)
    assert abs(listed.work["drive"][-1]) > 0.05
    np.testing.assert_allclose(kinds.work["drive"], listed.work["drive"], atol=1e-5)
    gained = (path.kinetic + path.potential for path in (listed, kinds))
    for path, energy in zip((listed, kinds), gained, strict=True):
        assert energy[-1] - energy[0] == pytest.approx(path.work["drive"][-1], rel=1e-3)
    forces = [force for _, name, force in listed.touching[-1] if name == "p"]
    tied = [force for _, name, force in kinds.touching[-1] if name.partition(".")[0] == "p"]
    assert tied == pytest.approx(forces, rel=1e-3)


def test_a_controller_is_a_formula_of_two_bodies():
    """A torque between two bars: the angle between them oscillates at ``sqrt(k (1/I + 1/I))``."""
    arrangement = Arrangement({"A": BAR})
    one, two = pair_coordinates(arrangement.manifold)
    k = 2.0
    drives = {"servo": Motor("pin", -k * (two[2] - one[2]))}
    system = arrangement.system(count=2, joints={"pin": Hinge("A 1", "A 2")}, drives=drives)
    path = simulate(system, system.state([[0, 0, 0], [0, 0, 0.1]]), 2.0, 1e-3)
    kinetic, _ = system.energies(system.state(np.zeros((2, 3)), [[0, 0, 1], [0, 0, 1]]))
    omega = math.sqrt(2 * k / kinetic)
    turned = path.q[:, 1, 2] - path.q[:, 0, 2]
    np.testing.assert_allclose(turned, 0.1 * np.cos(omega * path.times), atol=1e-5)


def test_names_are_checked():
    arrangement = Arrangement({"large": disc(1.0), "small": disc(0.5)}, orientations="all")
    shifted = Arrangement({"large": disc(1.0), "small": disc(0.5)})
    pin = Hinge("small 1", "small 2", at=[0.5, 0], on=[-0.5, 0])
    count = {"large": 1, "small": 3}
    for wrong, told in (
        ({"p": Hinge("small 1", "small 4")}, "small 4"),
        ({"p": Hinge("small", "large")}, "small"),
        ({"p": Hinge("large", "large 1")}, "large"),
        ({"small": pin}, "small"),
        ({"p": pin, "q": Hinge("small 2", "small 3"), "g": Gear("p", "q", 2.0)}, "'g'"),
    ):
        with pytest.raises(ValueError, match="joints.*" + told):
            arrangement.system(count=count, joints=wrong)
    with pytest.raises(ValueError, match="orientations='all'"):
        shifted.system(count=count, joints={"p": pin})
    with pytest.raises(ValueError, match="joints: expected those of the arrangement"):
        Arrangement({"large": disc(1.0)}).system(joints={"p": Hinge("world", "large")})
    with pytest.raises(ValueError, match=r"drives\['m'\]"):
        arrangement.system(count=count, drives={"m": Motor("p", 1.0)})
    wide = Hinge("S 1", "S 2", axis=[0, 0, 1], limits=(-4.0, 4.0))
    with pytest.raises(ValueError, match=r"limits: expected limits less than a turn apart .*'p'"):
        Arrangement({"S": sphere(1.0)}, orientations="all").system(count=2, joints={"p": wide})
    with pytest.raises(TypeError, match=r"drives\['m'\]"):
        arrangement.system(count=count, drives={"m": 3})
    with pytest.raises(ValueError, match=r"q: expected equation 'p.x' of bodies 'small 1' and 'sm"):
        arrangement.system(count=count, joints={"p": pin}).state(
            {"large": [[0, 0, 0]], "small": [[5, 0, 0], [7, 0, 0], [9, 0, 0]]}
        )


def test_joints_and_drives_of_every_body_of_a_kind():
    """Those of the arrangement with space are of each body; so are drives that name the kind."""
    arrangement = Arrangement(
        {"A": BAR, "B": disc(0.2)}, joints={"rail": Slider("world", "A", axis=[1, 0])}
    )
    system = arrangement.system(
        count={"A": 2, "B": 1},
        drives={"pull": Spring("rail", stiffness=3.0)},
        forces={"B": [1.0, 0]},
    )
    path = simulate(system, system.state({"A": [[3, 0, 0], [-3, 0, 0]], "B": [[0, 5]]}), 0.4, 1e-3)
    mass = 4 * 0.1 + math.pi * 0.1**2
    assert not system.ties
    swing = 3 * np.cos(math.sqrt(3 / mass) * path.times)
    np.testing.assert_allclose(path["A"].q[:, 0, 0], swing, atol=1e-4)
    np.testing.assert_allclose(path["A"].q[:, 1, 0], -swing, atol=1e-4)
    np.testing.assert_allclose(
        path["B"].q[:, 0, 0], path.times**2 / 2 / (math.pi * 0.04), atol=1e-9
    )


def test_ties_are_described():
    system, _ = rubbing_chain()
    assert [tie["name"] for tie in system.described()["ties"]] == ["nail", "pin1", "pin2"]
    assert {"nail.x", "nail.y", "pin2.y"} <= {*system.bodies.contact_names}

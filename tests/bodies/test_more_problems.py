"""Problems with closed answers: sharp bodies, mechanisms with drives, and several kinds."""

import math

import numpy as np
import pytest
import sympy
from posed import FLOOR, TABLE, G, Row, brick, check, cube, moved, stays
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from polycorner import minimise, simulate
from polycorner.bodies import (
    Arrangement,
    Gear,
    HalfSpace,
    Hinge,
    Mass,
    Motor,
    Prescribed,
    Slider,
    Spring,
    box,
    capsule,
    disc,
    mass_of,
    polygon,
)
from polycorner.motion import time_symbol

FAR = {"far": HalfSpace([0, 1], [0, -50])}


def bar(length):
    return capsule([-length / 2, 0], [length / 2, 0], 0.05)


def repeated(body, walls, q, seconds, v=None, **laws):
    """Return the motion of a repeated body."""
    several = Arrangement({"B": body}, walls, orientations="all")
    system = several.system(count=len(q), **laws)
    return simulate(system, system.state(q, v), seconds, 1e-3)


def a_sharp_brick_hangs_over():
    for share in (0.99, 1.01):
        q = np.array([[0, 0.2, 0], [share, 0.6, 0]])
        path = repeated(brick(1.0, 0.2, 0), FLOOR, q, 0.3, gravity=[0, -G], friction=0.5)
        yield Row(f"stays at {share}", bool(np.abs(path.q[-1] - q).max() < 1e-8), share < 1)


def sharp_squares_meet():
    v = np.array([[3, 0, 1], [-3, 0, 0.5]])
    for turn in (0.0, 0.3, math.pi / 4):
        q = np.array([[-2, 0, turn], [2, 0.1, -turn]])
        walls = box([-90, -90], [90, 90])
        path = repeated(brick(0.5, 0.5, 0), walls, q, 1.0, v, restitution=1.0)
        yield Row(f"energy, {turn:.1f}", path.kinetic[-1] / path.kinetic[0], 1.0, 1e-8)
        yield Row(f"momentum, {turn:.1f}", np.abs(path.v[-1, :, :2].sum(0)).max(), 0.0, 1e-9)


def an_arch_stands_if_it_is_thick():
    stones, inner = 9, 1.0
    half = math.pi / stones / 2
    for thick, stands in ((0.3, True), (0.06, False)):  # 0.11 of the mean radius are enough
        middle = inner + thick / 2
        ends = [(inner, 1), (inner, -1), (inner + thick, -1), (inner + thick, 1)]
        corners = [[-r * s * math.sin(half), r * math.cos(half) - middle] for r, s in ends]
        a = half * (2 * np.arange(stones) + 1) - math.pi / 2
        q = np.column_stack([-middle * np.sin(a), middle * np.cos(a), a])
        path = repeated(polygon(corners), FLOOR, q, 0.5, gravity=[0, -10], friction=0.8)
        yield Row(f"stands, {thick}", bool(np.abs(path.q[-1] - q).max() < 1e-4), stands)


def a_sharp_brick_on_a_ramp():
    slope = 0.3
    c, s = math.cos(slope), math.sin(slope)
    ramp = {"ramp": polygon([[0, 0], [4, 0], [4, 4 * math.tan(slope)]])}
    a = Arrangement({"B": brick(0.3, 0.2, 0)}, FAR, ramp, orientations="all")
    q = a.point({"B": ([2 * c - 0.2 * s, 2 * s + 0.2 * c], slope)})
    for share in (1.01, 0.99):
        held = stays(a, q, gravity=[0, -G], friction=share * math.tan(slope))
        yield Row(f"stays at {share}", held, share > 1)


def a_sharp_bar_falls_on_a_peg():
    aside, e, speed = 0.4, 0.7, 2.0
    rod, peg = brick(1.0, 0.1, 0), {"peg": polygon([[-0.05, -0.5], [0.05, -0.5], [0, 0]])}
    a, mass = Arrangement({"R": rod}, FAR, peg, orientations="all"), mass_of(rod)
    falls = {"R": [0, -speed]}
    path = moved(a, a.point({"R": [aside, 0.5]}), 0.3, moving=falls, restitution=e)
    J = (1 + e) * speed / (1 / mass.mass + aside**2 / float(mass.inertia))
    yield Row("speed", path.v[-1, 0, 1], J / mass.mass - speed, 1e-9)
    yield Row("turning", path.v[-1, 0, 2], -aside * J / float(mass.inertia), 1e-9)


def sharp_cubes_meet_edge_to_edge():
    turns = [Rotation.from_euler(axis, math.pi / 4).as_quat(scalar_first=True) for axis in "xy"]
    q = np.array([[0, 0, z, *turn] for z, turn in zip((-1.5, 1.5), turns, strict=True)])
    v = np.zeros((2, 7))
    v[:, 2] = 1, -1
    walls = {"far": HalfSpace([0, 0, 1], [0, 0, -50])}
    path = repeated(cube(0.5, 0), walls, q, 1.5, v, restitution=1.0)
    yield Row("back", np.abs(path.v[-1] + v).max(), 0.0, 1e-8)


def a_tower_of_sharp_cubes_stands():
    q = np.array([[0.05 * (k % 2), 0, 0.5 + k, 1, 0, 0, 0] for k in range(3)])
    path = repeated(cube(0.5, 0), TABLE, q, 0.2, gravity=[0, 0, -10], friction=0.5)
    yield Row("stands", np.abs(path.q[-1] - q).max(), 0.0, 1e-7)


def a_damped_spring():
    stiffness, mass, damping, seconds = 50.0, 2.0, 0.6, 3.0
    rail = {"r": Slider("world", "m", axis=[1, 0])}
    a, drives = (
        Arrangement({"m": brick(0.1, 0.1)}, joints=rail),
        {"s": Spring("r", stiffness=stiffness, damping=damping)},
    )
    masses = {"m": Mass(mass, [0, 0], 1.0)}
    path = moved(a, a.point({}, joints={"r": 0.3}), seconds, masses=masses, drives=drives)
    rate = damping / mass / 2
    w = math.sqrt(stiffness / mass - rate**2)
    wave = math.cos(w * seconds) + rate / w * math.sin(w * seconds)
    yield Row("place", path.q[-1, 0, 0], 0.3 * math.exp(-rate * seconds) * wave, 1e-5)


def a_spring_and_a_stop():
    stop, rail = {"stop": HalfSpace([1, 0], [-0.1, 0])}, {"r": Slider("world", "m", axis=[1, 0])}
    a = Arrangement({"m": disc(0.1)}, stop, joints=rail)
    laws = {"restitution": 1.0, "drives": {"s": Spring("r", stiffness=25.0)}}
    masses = {"m": Mass(1.0, [0, 0], 1.0)}
    # It comes back after half a period, as the stop is where the spring is relaxed.
    path = moved(a, a.point({}, joints={"r": 0.5}), math.pi / 5, masses=masses, **laws)
    yield Row("back", path.q[-1, 0, 0], 0.5, 1e-5)


def a_motor_with_a_limit():
    a = Arrangement({"a": bar(1.0)}, joints={"h": Hinge("world", "a")})
    laws = {
        "masses": {"a": Mass(1.0, [0, 0], 0.3)},
        "drives": {"m": Motor("h", speed=4, limit=0.6)},
    }
    path = moved(a, a.point({}, joints={"h": 0}), 3.0, **laws)  # 2 rad/s^2 for two seconds
    yield Row("angle", path.q[-1, 0, 2], 8.0, 1e-4)


def a_brake_holds_or_slips():
    a = Arrangement({"a": bar(1.0)}, joints={"h": Hinge("world", "a", on=[-0.5, 0])})
    torque = mass_of(bar(1.0)).mass * G / 2
    for share in (1.01, 0.99):
        brake = {"b": Motor("h", speed=0, limit=share * torque)}
        held = stays(a, a.point({}, joints={"h": 0}), gravity=[0, -G], drives=brake)
        yield Row(f"holds at {share}", held, share > 1)


def a_pendulum_on_a_shaken_cart():
    amplitude, w, seconds = 0.1, 4.0, 3.0
    joints = {
        "r": Slider("world", "cart", axis=[1, 0]),
        "h": Hinge("cart", "p", on=[-0.5, 0]),
    }
    a = Arrangement({"cart": brick(0.1, 0.1), "p": bar(1.0)}, joints=joints)
    shake = Prescribed("r", amplitude * (1 - sympy.cos(w * time_symbol())), limit=1e5)
    q = a.point({}, joints={"r": 0, "h": 0.3 - math.pi / 2})
    path = moved(a, q, seconds, gravity=[0, -G], drives={"d": shake})
    mass = mass_of(bar(1.0))
    arm, inertia = mass.mass / 2, float(mass.inertia) + mass.mass / 4

    def swing(t, y):
        pushed = amplitude * w**2 * math.cos(w * t)
        return [y[1], -arm * (G * math.sin(y[0]) + pushed * math.cos(y[0])) / inertia]

    expected = solve_ivp(swing, (0, seconds), [0.3, 0], rtol=1e-10, atol=1e-12).y[0, -1]
    yield Row("angle", a.joint_values(path.q[-1, 0])["h"] + math.pi / 2, expected, 1e-4)


def atwood():
    joints = {
        "s": Slider("world", "a", axis=[0, 1], at=[-0.5, 0]),
        "t": Slider("world", "b", axis=[0, 1], at=[0.5, 0]),
        "rope": Gear("s", "t", -1.0),
    }
    a = Arrangement({"a": brick(0.1, 0.1), "b": brick(0.1, 0.1)}, joints=joints)
    masses = {"a": Mass(3.0, [0, 0], 1.0), "b": Mass(2.0, [0, 0], 1.0)}
    q = a.point({}, joints={"s": 0, "t": 0})
    path = moved(a, q, 1.0, gravity=[0, -G], masses=masses)
    yield Row("falls", path.q[-1, 0, 1], -G / 10, 1e-8)
    force = {name: f for _, name, f in path.touching[-1]}
    yield Row("tension", abs(force["rope"]), 2 * 3 * 2 / 5 * G, 1e-6)


def a_gripper_holds_or_drops():
    bodies = {"L": brick(0.1, 0.3), "R": brick(0.1, 0.3), "part": disc(0.2)}
    joints = {
        "l": Slider("world", "L", axis=[1, 0], at=[-1, 0]),
        "r": Slider("world", "R", axis=[-1, 0], at=[1, 0]),
    }
    a = Arrangement(bodies, joints=joints, orientations="all")
    masses = dict.fromkeys(bodies, Mass(1.0, [0, 0], 0.02))
    q = a.point({"part": [0, 0]}, joints={"l": 0.68, "r": 0.68})
    least = G / 2 / 0.8
    for share in (1.01, 0.99):
        drives = {name: Motor(name, torque=share * least) for name in joints}
        held = stays(a, q, gravity=[0, -G], friction=0.8, masses=masses, drives=drives)
        yield Row(f"holds at {share}", held, share > 1)


def a_chain_hangs():
    joints = {"n0": Hinge("world", "b0", on=[-0.5, 0])}
    joints |= {f"j{k}": Hinge(f"b{k}", f"b{k + 1}", at=[0.5, 0], on=[-0.5, 0]) for k in range(3)}
    joints["n1"] = Hinge("world", "b3", at=[3, 0], on=[0.5, 0])
    a = Arrangement({f"b{k}": bar(1.0) for k in range(4)}, joints=joints)
    turns = [-0.9, -0.3, 0.3, 0.9]
    near = [[0.375 + 0.75 * k, -0.4, turn] for k, turn in enumerate(turns)]
    heights = sum(s for s in a.manifold.symbols if str(s).startswith("y"))
    lowest = minimise(a.polyhedron, heights, a.closed(np.ravel(near)))
    slopes = np.tan(lowest.point[2::3])  # as 3 : 1 : -1 : -3
    yield Row("slopes", np.abs(slopes / slopes[1] - [3, 1, -1, -3]).max(), 0.0, 1e-9)


def discs_of_two_kinds_collide():
    a = Arrangement({"a": disc(0.3), "b": disc(0.2)}, box([-50, -50], [50, 50]))
    system = a.system(restitution=1.0, count={"a": 1, "b": 1})
    start = system.state({"a": [[-2, 0]], "b": [[2, 0]]}, {"a": [[1, 0]], "b": [[-1, 0]]})
    path = simulate(system, start, 3.0, 1e-3)
    middle = (0.09 - 0.04) / 0.13
    yield Row("a", path["a"].v[-1, 0, 0], 2 * middle - 1, 1e-9)
    yield Row("b", path["b"].v[-1, 0, 0], 2 * middle + 1, 1e-9)


SHARP = [
    a_sharp_brick_hangs_over,
    sharp_squares_meet,
    an_arch_stands_if_it_is_thick,
    a_sharp_brick_on_a_ramp,
    a_sharp_bar_falls_on_a_peg,
    sharp_cubes_meet_edge_to_edge,
    a_tower_of_sharp_cubes_stands,
]
DRIVEN = [
    a_damped_spring,
    a_spring_and_a_stop,
    a_motor_with_a_limit,
    a_brake_holds_or_slips,
    a_pendulum_on_a_shaken_cart,
    atwood,
    a_gripper_holds_or_drops,
    a_chain_hangs,
]
PROBLEMS = [*SHARP, *DRIVEN, discs_of_two_kinds_collide]


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.__name__)
def test_a_problem_has_its_answer(problem, subtests):
    check(problem, subtests)

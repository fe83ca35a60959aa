"""Robots in joint coordinates, against placements, distances and dynamics from definitions."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from polycorner import simulate, velocities
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    Mass,
    Robot,
    RobotJoint,
    RobotLink,
    capsule,
    polytope,
    sphere,
)
from polycorner.bodies.motions import nearest_points
from polycorner.motion.formulation import moment

CUBE = [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
TETRAHEDRON = [[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]
FLOOR = {"floor": HalfSpace([0.3, -0.2, 1], [0, 0, -2])}
GRAVITY = np.array([0.3, -0.4, -9.81])


def inertia(rng):
    a = rng.normal(size=(4, 3))
    return np.trace(a.T @ a) * np.eye(3) - a.T @ a


def shape(rng, kind):
    shift, turn = rng.normal(size=3) / 5, Rotation.random(rng=rng)
    if kind == "hull":
        return polytope(np.array(TETRAHEDRON) / 5, 0.05).moved(shift, turn)
    return capsule(shift, shift + rng.normal(size=3) / 2, 0.1)


def tree(seed, count=4, kinds=("revolute", "continuous", "prismatic", "fixed"), shapes="capsule"):
    """Return a robot of random links on random earlier ones."""
    rng = np.random.default_rng(seed)
    links, joints = {"l0": RobotLink(shape(rng, shapes))}, {}
    for k in range(1, count + 1):
        mass = Mass(rng.uniform(0.5, 2), rng.normal(size=3) / 3, inertia(rng) / 5)
        links[f"l{k}"] = RobotLink(shape(rng, shapes), mass)
        kind = "revolute" if k == 1 else str(rng.choice(kinds))
        joints[f"j{k}"] = RobotJoint(
            f"l{rng.integers(max(0, k - 2), k)}",
            f"l{k}",
            kind,
            origin=rng.normal(size=3),
            turn=Rotation.random(rng=rng).as_matrix(),
            axis=rng.normal(size=3),
            lower=-math.inf if kind == "continuous" else -2.0,
            upper=math.inf if kind == "continuous" else 2.5,
            damping=float(rng.uniform(0, 0.3)),
        )
    return Robot(links, joints, walls=FLOOR)


def somewhere(robot, seed):
    """Return a point within the limits, and a velocity."""
    rng = np.random.default_rng(seed)
    placed = {n: rng.uniform(-1.5, 2) for n in robot.manifold.names if n in robot.joints}
    return robot.point(placed), rng.normal(size=robot.manifold.size)


def slow_poses(robot, q):
    """Return the place of every link by products of homogeneous matrices, and each joint's axis."""
    values = dict(zip(robot.manifold.names, q.tolist(), strict=True))
    found, axes = {robot.root: np.eye(4)}, {}
    while len(found) < len(robot.links):
        for name, joint in robot.joints.items():
            if joint.parent not in found or joint.child in found:
                continue
            rest, moved = np.eye(4), np.eye(4)
            rest[:3, :3], rest[:3, 3] = joint.turn, joint.origin
            unit = joint.axis / np.linalg.norm(joint.axis)
            other, rate, offset = joint.follows or (name, 1.0, 0.0)
            at = 0.0 if joint.kind == "fixed" else rate * values[other] + offset
            if joint.kind == "prismatic":
                moved[:3, 3] = at * unit
            elif joint.kind != "fixed":
                moved[:3, :3] = Rotation.from_rotvec(at * unit).as_matrix()
            before = found[joint.parent] @ rest
            found[joint.child] = before @ moved
            axes[name] = before[:3, :3] @ unit
    return found, axes


def newton_euler(robot, q, v, a, pull):
    """Return the forces of the joints that a motion needs, link by link, in axes of space.

    Outwards: accelerations of the links, one joint after the other; inwards: the force and torque
    that each joint has to carry ([Featherstone] ch. 5).
    """
    poses, axes = slow_poses(robot, q)
    rates = dict(zip(robot.manifold.names, zip(v, a, strict=True), strict=True))
    none = np.zeros(3)
    motion = {robot.root: (none, none, none)}  # angular velocity, its change, acceleration
    speed = {robot.root: none}
    order = []
    while len(motion) < len(robot.links):
        for name, joint in robot.joints.items():
            if joint.parent not in motion or joint.child in motion:
                continue
            order.append(name)
            (w, dw, da), way, axis = motion[joint.parent], None, axes[name]
            way = poses[joint.child][:3, 3] - poses[joint.parent][:3, 3]
            here = da + np.cross(dw, way) + np.cross(w, np.cross(w, way))
            u, du = (0.0, 0.0) if joint.kind == "fixed" else rates[name]
            if joint.kind == "prismatic":
                motion[joint.child] = w, dw, here + axis * du + 2 * np.cross(w, axis * u)
            else:
                motion[joint.child] = w + axis * u, dw + axis * du + np.cross(w, axis * u), here
            speed[joint.child] = none
    force = {link: np.zeros(3) for link in robot.links}
    torque = {link: np.zeros(3) for link in robot.links}  # about the origin of space
    for link, (w, dw, da) in motion.items():
        mass = robot.links[link].mass
        if mass is None:
            continue
        matrix, origin = poses[link][:3, :3], poses[link][:3, 3]
        arm, tensor = matrix @ mass.centre, matrix @ mass.inertia @ matrix.T
        change = da + np.cross(dw, arm) + np.cross(w, np.cross(w, arm))
        need = mass.mass * (change - pull)
        force[link] += need
        torque[link] += np.cross(origin + arm, need) + tensor @ dw + np.cross(w, tensor @ w)
    found = {}
    for name in reversed(order):
        joint = robot.joints[name]
        place = poses[joint.child][:3, 3]
        about = torque[joint.child] - np.cross(place, force[joint.child])
        found[name] = axes[name] @ (force[joint.child] if joint.kind == "prismatic" else about)
        force[joint.parent] += force[joint.child]
        torque[joint.parent] += torque[joint.child]
    return np.array([found[name] for name in robot.manifold.names])


@given(st.integers(0, 10**6))
def test_links_are_where_homogeneous_matrices_put_them(seed):
    robot = tree(seed)
    q, _ = somewhere(robot, seed)
    poses, _ = slow_poses(robot, q)
    for link, place in poses.items():
        matrix, origin = robot.pose(q, link)
        assert np.allclose(matrix, place[:3, :3])
        assert np.allclose(origin, place[:3, 3])
        points = robot.links[link].body.markers @ place[:3, :3].T + place[:3, 3]
        assert np.allclose(robot.placed(q)[link].markers, points)


@settings(max_examples=3)
@given(st.integers(0, 10**6))
def test_dynamics_are_those_of_newton_and_euler(seed):
    robot = tree(seed, 3)
    wide = {
        n: j if j.kind == "continuous" else replace(j, lower=-9, upper=9)
        for n, j in robot.joints.items()
    }
    robot = replace(robot, joints=wide)
    robot = replace(robot, walls={"floor": HalfSpace([0, 0, 1], [0, 0, -50])})
    robot = replace(robot, ignored=robot.overlapping(robot.home))
    system = robot.system(gravity=GRAVITY)
    q, v = somewhere(robot, seed)
    now = moment(system.formulation, system.parameters, q, v)
    still, n = np.zeros(len(q)), len(q)
    inertial = [newton_euler(robot, q, still, e, np.zeros(3)) for e in np.eye(n)]
    assert np.allclose(now.mass, np.array(inertial).T, rtol=1e-9, atol=1e-9)
    damping = [robot.joints[name].damping for name in robot.manifold.names]
    assert np.allclose(now.force, -newton_euler(robot, q, v, still, GRAVITY) - damping * v)


def distance(one, two):
    """Return the distance of two bodies of one part each, by least squares over their points."""
    (a,), (b,) = one.parts.values(), two.parts.values()
    k, m = len(a.points), len(b.points)

    def between(x):
        away = x[:k] @ a.points - x[k:] @ b.points
        return away @ away, 2 * np.concatenate([a.points @ away, -b.points @ away])

    sums = [{"type": "eq", "fun": lambda x: x[:k].sum() - 1}]
    sums.append({"type": "eq", "fun": lambda x: x[k:].sum() - 1})
    start = np.concatenate([np.full(k, 1 / k), np.full(m, 1 / m)])
    found = minimize(
        between,
        start,
        jac=True,
        bounds=[(0, 1)] * (k + m),
        constraints=sums,
        options={"ftol": 1e-14, "maxiter": 500},
    )
    return math.sqrt(max(found.fun, 0.0)) - a.radius - b.radius


def check_gaps(robot, seed):
    """Compare the least gap of each pair with the distance of the bodies in their places."""
    q, _ = somewhere(robot, seed)
    placed, functions = robot.placed(q), robot.polyhedron.functions
    # The base stays where it is and has no height to keep.
    moving = {joint.child for joint in robot.joints.values()}
    parts = [part for link in moving for part in robot.placed(robot.home)[link].parts.values()]
    heights = [
        ((part.points - wall.point) @ wall.normal).min() - part.radius
        for part in parts
        for wall in robot.walls.values()
    ]
    free = not robot.overlapping(robot.home) and min(heights) >= 0
    assert robot.polyhedron.contains(robot.home) == free
    for one, two in combinations(robot.links, 2):
        links = {one, two}
        between = [f for f in functions if {x.split(".")[0] for x in f.name.split("-")} == links]
        gaps = [f for f in between if not set(f.name) & set("<>f")]  # without planes that separate
        assert bool(gaps) != any({j.parent, j.child} == links for j in robot.joints.values())
        away = distance(placed[one], placed[two])
        if gaps and away > 0.01:  # apart
            assert min(f.value(q) for f in gaps) == pytest.approx(away, abs=1e-4)


@settings(max_examples=3)
@given(st.integers(0, 10**6))
def test_gaps_are_distances_of_links(seed):
    check_gaps(tree(seed, 3, kinds=("revolute", "prismatic")), seed)


def test_gaps_of_hulls_are_distances_too():
    robot = tree(1, 2, kinds=("revolute",), shapes="hull")
    check_gaps(robot, 0)


@settings(max_examples=3)
@given(st.integers(0, 10**6))
def test_gaps_at_walls_are_heights_of_points(seed):
    robot = tree(seed)
    q, _ = somewhere(robot, seed)
    placed, wall = robot.placed(q), FLOOR["floor"]
    for f in robot.polyhedron.functions:
        link, _, name = f.name.partition("-")
        if name == "floor":
            link, _, vertex = link.partition(".v")
            part = placed[link].parts[""]
            height = (part.points[int(vertex) - 1] - wall.point) @ wall.normal - part.radius
            assert f.value(q) == pytest.approx(height)


def test_derivatives_of_gaps_are_those_of_difference_quotients():
    robot = tree(3)
    q, _ = somewhere(robot, 3)
    for f in robot.polyhedron.functions:
        slopes = [(f.value(q + 1e-6 * e) - f.value(q - 1e-6 * e)) / 2e-6 for e in np.eye(len(q))]
        assert np.allclose(f.gradient(q), slopes, atol=1e-6)


def pendulum(**given):
    rod = RobotLink(capsule([0, 0, 0], [0, 0, -1], 0.1), Mass(2.0, [0, 0, -0.7], [0.3, 0.2, 0.1]))
    joint = RobotJoint("base", "rod", "continuous", axis=[1, 0, 0], **given)
    return Robot({"base": RobotLink(), "rod": rod}, {"pivot": joint}, walls=DEEP)


DEEP = {"floor": HalfSpace([0, 0, 1], [0, 0, -5])}


def test_a_pendulum_swings_with_its_period():
    system = pendulum().system(gravity=[0, 0, -9.81])
    state = system.state([0.01])
    about = 0.3 + 2 * 0.7**2
    period = 2 * math.pi * math.sqrt(about / (2 * 9.81 * 0.7))
    path = simulate(system, state, period, period / 2000)
    assert path.q[-1, 0] == pytest.approx(0.01, rel=1e-4)


def test_drives_reach_as_far_as_the_effort_and_friction_holds():
    robot = pendulum(effort=2.0, friction=0.5)
    free = robot.system(torques={"pivot": sympy.Integer(100)})
    about = 0.3 + 2 * 0.7**2
    path = simulate(free, free.state([0.0], [1.0]), 0.1, 1e-3)
    assert path.v[-1, 0] == pytest.approx(1 + 0.1 * (2 - 0.5) / about, rel=1e-6)
    weak = robot.system(torques={"pivot": sympy.Rational(2, 5)})
    held = simulate(weak, weak.state([0.0]), 0.1, 1e-3)
    assert held.q[-1, 0] == 0.0
    (rate,) = velocities(robot.manifold)
    braked = pendulum().system(torques={"pivot": -3 * rate})
    path = simulate(braked, braked.state([0.0], [1.0]), 0.1, 1e-4)
    assert path.v[-1, 0] == pytest.approx(math.exp(-0.3 / about), rel=1e-4)


def test_a_joint_that_follows_has_no_coordinate():
    finger = RobotLink(sphere(0.1), Mass(1.0, [0, 0, 0], [0.1, 0.1, 0.1]))
    joints = {
        "left": RobotJoint("palm", "one", "prismatic", axis=[1, 0, 0], upper=0.5),
        "right": RobotJoint(
            "palm",
            "two",
            "prismatic",
            axis=[-1, 0, 0],
            lower=-1,
            upper=0.4,
            follows=("left", 2.0, 0.1),
        ),
    }
    robot = Robot({"palm": RobotLink(), "one": finger, "two": finger}, joints)
    assert robot.manifold.names == ("left",)
    q = robot.point({"left": 0.2})
    assert robot.placed(q)["two"].markers[0].tolist() == pytest.approx([-0.5, 0, 0])
    values = {f.name: f.value(q) for f in robot.polyhedron.functions}
    assert values["one-two"] == pytest.approx(0.7 - 0.2)
    assert values["right upper"] == pytest.approx(0.4 - 0.5)
    system = robot.system()
    mass = moment(system.formulation, system.parameters, q * 0, q * 0).mass
    assert mass == pytest.approx(np.array([[1 + 4.0]]))


def test_a_floating_base_and_free_bodies_move_as_in_an_arrangement():
    body, ball = capsule([-1, 0, 0], [1, 0.3, 0], 0.3), sphere(0.5)
    mass = Mass(2.0, [0.1, 0.2, 0.3], np.diag([1.0, 2.0, 2.5]))
    robot = Robot({"A": RobotLink(body, mass)}, {}, base="floating", walls=DEEP, bodies={"B": ball})
    whole = Arrangement({"A": body, "B": ball}, walls=DEEP)
    assert robot.manifold.names == whole.manifold.names
    place = {"A": ([0, 0.2, 1], Rotation.from_rotvec([0.3, 0.4, 0.5])), "B": [2, 1, 0]}
    q = robot.point(place)
    assert q.tolist() == whole.point(place).tolist()
    expected = {f.name: f.value(q) for f in whole.polyhedron.functions}
    found = {f.name: f.value(q) for f in robot.polyhedron.functions}
    assert found == pytest.approx(expected)
    one = robot.system(gravity=GRAVITY)
    two = whole.system(gravity=GRAVITY, masses={"A": mass})
    v = whole.velocity(q, {"A": ([1, 2, 3], [0.3, -0.4, 0.5]), "B": [0, 0, 1]})
    paths = [simulate(s, s.state(q, v), 0.1, 1e-3) for s in (one, two)]
    assert np.allclose(paths[0].q[-1], paths[1].q[-1], atol=1e-6)
    assert one.energies(one.state(q, v)) == pytest.approx(two.energies(two.state(q, v)))


def test_a_number_is_the_mass_of_a_uniform_free_body():
    robot = Robot(
        {"A": RobotLink(sphere(0.2), Mass(1.0, [0, 0, 0], [1, 1, 1]))},
        {},
        base="floating",
        bodies={"B": sphere(0.5)},
    )
    system = robot.system(masses={"B": 3.0})
    q = robot.point({"A": ([0, 0, 0], Rotation.identity()), "B": [2, 0, 0]})
    v = np.zeros(len(q))
    v[-3:] = 1.0, 2.0, 2.0
    assert system.energies(system.state(q, v))[0] == pytest.approx(3.0 * 9.0 / 2)
    with pytest.raises(TypeError, match=r"masses\['B'\]: expected a number, or a Mass"):
        robot.system(masses={"B": "heavy"})


def test_friction_at_the_floor_slows_a_sliding_ball_as_in_an_arrangement():
    joints = {
        "x": RobotJoint("rail", "cart", "prismatic", axis=[1, 0, 0]),
        "z": RobotJoint("cart", "block", "prismatic", axis=[0, 0, 1]),
    }
    block = RobotLink(sphere(0.2), Mass(1.0, [0, 0, 0], [1, 1, 1]))
    robot = Robot(
        {"rail": RobotLink(), "cart": RobotLink(), "block": block},
        joints,
        walls={"floor": HalfSpace([0, 0, 1], [0, 0, 0])},
    )
    system = robot.system(gravity=[0, 0, -10], friction=0.3)
    path = simulate(system, system.state([0.0, 0.2], [1.0, 0.0]), 0.2, 1e-3)
    assert path.v[-1, 0] == pytest.approx([1 - 0.3 * 10 * 0.2, 0], abs=2e-3)


def test_a_cylinder_around_and_fixed_bodies_are_contacts():
    robot = replace(
        pendulum(),
        walls={"tube": Cylinder(3, [1, 0, 0])},
        fixed={"post": sphere(0.2, at=[0, 2, 0])},
    )
    q = robot.point({"pivot": 1.0})
    values = {f.name: f.value(q) for f in robot.polyhedron.functions}
    tip = np.array([0, math.sin(1), -math.cos(1)])
    assert values["post-rod"] == pytest.approx(np.linalg.norm(tip - [0, 2, 0]) - 0.3)
    radius = 3 - 0.1
    assert values["rod.v2-tube"] == pytest.approx((radius**2 - 1) / (2 * radius))


def test_sharp_links_have_unions_and_do_not_move():
    box = RobotLink(polytope(np.array(CUBE) / 4), Mass(1.0, [0, 0, 0], [1, 1, 1]))
    joints = {
        "one": RobotJoint("base", "a", "prismatic", axis=[1, 0, 0]),
        "two": RobotJoint("base", "b", "prismatic", axis=[0, 1, 0]),
    }
    robot = Robot({"base": RobotLink(), "a": box, "b": box}, joints)
    assert robot.polyhedron.contains(robot.point({"one": 0.6}))
    assert not robot.polyhedron.contains(robot.point({"one": 0.4, "two": -0.3}))
    assert robot.overlapping(robot.home) == [("a", "b")]
    # Walls that links are beyond are named, ones on which they stand are not.
    shelf, slab = (HalfSpace([0, 0, 1], [0, 0, height]) for height in (-0.25, -0.2))
    stands, sinks = (replace(robot, walls={"wall": wall}) for wall in (shelf, slab))
    apart = robot.point({"one": 0.6})
    assert stands.overlapping(apart) == []
    assert sinks.overlapping(apart) == [("a", "wall"), ("b", "wall")]
    with pytest.raises(NotImplementedError, match="sharp"):
        robot.system()


@settings(max_examples=3)
@given(st.integers(0, 10**6))
def test_slips_of_links_are_those_of_their_points(seed):
    """From difference quotients of where two links have the place at which they touch."""
    robot, h = tree(seed, 3, kinds=("revolute", "prismatic")), 1e-6
    q, v = somewhere(robot, seed)
    laws, names = robot.system(friction=0.5).friction, [f.name for f in robot.polyhedron.functions]
    poses = [slow_poses(robot, q + side * h * v)[0] for side in (0, 1, -1)]
    found = {law.load: [s.value(np.concatenate([q, v])) for s in law.slip] for law in laws}
    assert {*found} == {name for name in names if "-" in name}
    for contact, slip in found.items():
        one, two = (name.split(".")[0] for name in contact.split("-"))
        if two == "floor":
            continue
        a, b = (robot.placed(q)[name].parts[""] for name in (one, two))
        p, o = nearest_points(a.points, b.points)
        normal = (p - o) / np.linalg.norm(p - o)
        place, speeds = np.append(p - a.radius * normal, 1), []
        for link in (one, two):
            local = np.linalg.inv(poses[0][link]) @ place
            speeds.append((poses[1][link] - poses[2][link]) @ local / (2 * h))
        across = (speeds[0] - speeds[1])[:3]
        across -= normal * (normal @ across)
        assert np.linalg.norm(slip) == pytest.approx(np.linalg.norm(across), abs=1e-6)


def gripper(**given):
    """Two fingers that slide towards each other, and a ball between them."""
    finger = RobotLink(capsule([0, 0, -0.2], [0, 0, 0.2], 0.05), Mass(0.2, [0, 0, 0], np.eye(3)))
    joints = {
        name: RobotJoint("palm", f"{name}_finger", "prismatic", axis=[sign, 0, 0])
        for name, sign in (("left", 1), ("right", -1))
    }
    links = {"palm": RobotLink(), "left_finger": finger, "right_finger": finger}
    return Robot(links, joints).among(bodies={"ball": sphere(0.1)}, **given)


@pytest.mark.parametrize("mu", [0.45, 0.55])
def test_a_gripper_holds_a_ball_where_friction_reaches_its_weight(mu):
    """Two fingers press with 10 N each: friction carries up to ``2 mu 10`` N of 10 N."""
    robot = gripper(orientations="all")
    push = dict.fromkeys(("left", "right"), sympy.Integer(10))
    names = {("ball", "left_finger"): mu, "right_finger-ball": mu}
    # Only the ball has weight: the fingers cannot fall.
    system = robot.system(gravity=[0, 0, -10], masses={"ball": 1.0}, torques=push, friction=names)
    start = robot.point({"left": -0.15, "right": -0.15, "ball": [0, 0, 0]})
    path = simulate(system, system.state(start), 0.1, 1e-3)
    fallen = -path.q[-1, 0, robot.manifold.names.index("zball")]
    expected = 0.0 if mu > 0.5 else (10 - 2 * mu * 10) * 0.1**2 / 2
    assert fallen == pytest.approx(expected, abs=1e-4)

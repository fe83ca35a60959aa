"""Joints against their definition by poses, and mechanisms against closed forms.

The oracle of a joint is written in matrices: where it puts the child for a value of its coordinate.
"""

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
import sympy
from scipy.linalg import null_space
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from polycorner import minimise, prove, skeleton, stratum_at
from polycorner.bodies import (
    Arrangement,
    Ball,
    Fixed,
    Gear,
    HalfSpace,
    Hinge,
    Planar,
    Rail,
    Slider,
    box,
    capsule,
    disc,
    polygon,
    polytope,
    scaled,
    sphere,
    thinned,
)
from polycorner.proofs import stationary_points

BLOCK = polytope([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], 0.1)
PLATE = polygon([[0, 0], [1, 0], [0, 1]], 0.1)
X, Y = sympy.symbols("x y", real=True)


def turn(rng, d, angle=None):
    """A random rotation, as users write it and as a matrix."""
    if d == 3:
        rotation = Rotation.random(random_state=rng.integers(1 << 30))
        return rotation, rotation.as_matrix()
    angle = rng.uniform(-3, 3) if angle is None else angle
    c, s = math.cos(angle), math.sin(angle)
    return angle, np.array([[c, -s], [s, c]])


def about_axis(axis, angle, d):
    matrix = Rotation.from_rotvec(angle * (np.array([0, 0, 1.0]) if d == 2 else axis)).as_matrix()
    return matrix[:d, :d]


def unit(rng, d):
    v = rng.normal(size=d)
    return v / np.linalg.norm(v)


def made(rng, kind, d, **more):
    """A joint of random anchors; the child's place in the parent, a function of free numbers."""
    at, on, axis = rng.normal(size=d), rng.normal(size=d), unit(rng, d)
    fixed, reference = turn(rng, d)
    anchors = {"at": at, "on": on, **more}
    if kind is Hinge:
        joint = Hinge("P", "C", **anchors, axis=axis if d == 3 else None, turn=fixed)
        return joint, lambda x: (at, about_axis(axis, x[0], d) @ reference), 1
    if kind is Slider:
        joint = Slider("P", "C", **anchors, axis=axis, turn=fixed)
        return joint, lambda x: (at + x[0] * axis, reference), 1
    if kind is Fixed:
        return Fixed("P", "C", **anchors, turn=fixed), lambda _: (at, reference), 0
    if kind is Planar:
        joint = Planar("P", "C", **anchors, axis=axis, turn=fixed)
        e = null_space(axis[None]).T
        place = lambda x: (at + x[1:3] @ e, about_axis(axis, x[0], d) @ reference)  # noqa: E731
        return joint, place, 3
    free = 1 if d == 2 else 3

    def any_turn(x):
        return turn(rng, 2, x[0])[1] if d == 2 else Rotation.from_rotvec(x[:3]).as_matrix()

    if kind is Ball:
        return Ball("P", "C", **anchors), lambda x: (at, any_turn(x)), free
    place = lambda x: (at + x[-1] * axis, any_turn(x))  # noqa: E731
    return Rail("P", "C", **anchors, axis=axis), place, free + 1


KINDS = [(k, d) for d in (2, 3) for k in (Hinge, Slider, Ball, Fixed, Rail)] + [(Planar, 3)]


def posed(d, origin, matrix):
    if d == 3:
        return origin, Rotation.from_matrix(matrix)
    return origin, math.atan2(matrix[1, 0], matrix[0, 0])


@pytest.mark.parametrize(("kind", "d"), KINDS)
def test_a_joint_holds_exactly_the_placements_of_its_definition(kind, d):
    """Its equations vanish there, are independent, and leave as many motions as it has numbers."""
    rng = np.random.default_rng(1)
    body = BLOCK if d == 3 else PLATE
    joint, place, free = made(rng, kind, d)
    a = Arrangement({"P": body, "C": body}, joints={"J": joint})
    D, scales = a.polyhedron, a.manifold.scale_array
    rigid = 3 if d == 2 else 6
    assert len(D.stated) == rigid - free
    for _ in range(5):
        origin, matrix = rng.normal(size=d), turn(rng, d)[1]
        x = rng.uniform(-1.5, 1.5, 4)
        anchor, turned = place(x)
        child = matrix @ turned
        there = origin + matrix @ anchor - child @ np.asarray(joint.on)
        placed = {"P": posed(d, origin, matrix), "C": posed(d, there, child)}
        q = np.concatenate(
            [
                p.coordinates(*pose)
                for p, pose in zip(a.placements, [(origin, matrix), (there, child)], strict=True)
            ]
        )
        assert abs(D.equation_values(q)).max() < 1e-12
        assert a.point(placed) == pytest.approx(q, abs=1e-12)
        rows = D.bundle.evaluate(q, 1)[1][len(D.functions) :] * scales
        singular = np.linalg.svd(rows, compute_uv=False)
        assert singular[-1] > 1e-3
        assert a.manifold.size - len(rows) == rigid + free
        off = a.manifold.onto(q + 0.3 * scales * rng.normal(size=len(q)))
        assert abs(D.equation_values(off)).max() > 1e-3
        back = a.closed(off)
        assert abs(D.equation_values(back)).max() < 1e-9
        if kind in {Hinge, Slider, Rail}:
            value = x[-1] if kind is Rail else x[0]
            assert a.joint_values(q)["J"] == pytest.approx(value)
            assert a.joint_values(np.array([q, q]))["J"].shape == (2,)


@pytest.mark.parametrize(("kind", "d"), KINDS)
def test_bodies_are_placed_through_joints_both_ways(kind, d):
    rng = np.random.default_rng(2)
    body = BLOCK if d == 3 else PLATE
    joint, place, _ = made(rng, kind, d)
    a = Arrangement({"P": body, "C": body}, joints={"J": joint})
    origin, (told, matrix) = rng.normal(size=d), turn(rng, d)
    value = {} if kind in {Fixed, Planar} else {"J": 0.7}
    if kind is Ball:
        value = {"J": told}
    q = a.point({"P": (origin, told)}, joints=value)
    poses = [p.pose(q) for p in a.placements]
    assert poses[0][1] == pytest.approx(matrix)
    if kind in {Hinge, Slider, Fixed}:
        anchor, turned = place([0.7])
        assert poses[1][1] == pytest.approx(matrix @ turned)
        there = origin + matrix @ anchor - matrix @ turned @ np.asarray(joint.on)
        assert poses[1][0] == pytest.approx(there)
    again = a.point({"C": posed(d, *poses[1])}, joints=value)
    for p, (there, turned) in zip(a.placements, poses, strict=True):
        assert p.pose(again)[0] == pytest.approx(there, abs=1e-9)
        assert p.pose(again)[1] == pytest.approx(turned, abs=1e-9)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("kind", [Hinge, Slider, Rail])
def test_velocities_go_along_joints_at_given_rates(kind, d):
    """Against finite differences of the coordinates of joints, and of equations."""
    rng = np.random.default_rng(3)
    body = BLOCK if d == 3 else PLATE
    a = Arrangement({"P": body, "C": body}, joints={"J": made(rng, kind, d)[0]})
    q = a.point({"P": (rng.normal(size=d), turn(rng, d)[0])}, joints={"J": 0.4})
    v = a.velocity(q, {"P": rng.normal(size=d)}, joints={"J": 1.7})
    h = 1e-5
    ends = [a.manifold.onto(q + s * h * v) for s in (-1, 1)]
    before, after = (a.joint_values(end)["J"] for end in ends)
    assert (after - before) / (2 * h) == pytest.approx(1.7, abs=1e-5)
    assert abs(a.polyhedron.equation_values(ends[1])).max() < 1e-7


@pytest.mark.parametrize("limits", [(-0.3, 0.4), (0.0, math.pi), (-2.0, 2.9), (1.0, 7.2), (4, 5)])
@pytest.mark.parametrize("d", [2, 3])
def test_limits_of_a_hinge_are_an_arc_with_unit_slopes(limits, d):
    low, high = limits
    body, axis = (BLOCK, [0, 0, 1]) if d == 3 else (PLATE, None)
    a = Arrangement({"A": body}, joints={"J": Hinge("world", "A", axis=axis, limits=limits)})
    names = a.polyhedron.names
    assert names == ("J.min", "J.max")
    for angle in np.linspace(-math.pi, math.pi, 181):
        gaps = a.polyhedron.values(a.point({}, joints={"J": angle}))
        past = (angle - low) % math.tau
        if min(abs(past), abs(past - math.tau), abs(past - (high - low))) > 1e-6:
            assert (gaps.min() > 0) == (past < high - low), angle
    for end, sign, k in ((low, 1, 0), (high, -1, 1)):
        here, there = (
            a.polyhedron.values(a.point({}, joints={"J": end + h}))[k] for h in (0.0, 1e-6)
        )
        assert here == pytest.approx(0, abs=1e-12)
        assert (there - here) / 1e-6 == pytest.approx(sign, abs=1e-4)
        assert a.polyhedron.values(a.point({}, joints={"J": end}))[1 - k] > 0


def test_limits_of_a_slider_are_lengths():
    slide = Slider("world", "A", axis=[0, 2.0], limits=(-1.0, math.inf))
    a = Arrangement({"A": PLATE}, joints={"J": slide})
    assert a.polyhedron.names == ("J.min",)
    assert a.polyhedron.values(a.point({}, joints={"J": 0.5})) == pytest.approx([1.5])


@pytest.mark.parametrize("ratio", [2.0, -0.75, 1 / 3])
@pytest.mark.parametrize("kinds", ["hh", "hs", "sh", "ss"])
@pytest.mark.parametrize("d", [2, 3])
def test_gears_hold_a_ratio_and_a_phase(ratio, kinds, d):
    """Along the whole of a turn and beyond; elsewhere they do not vanish."""
    axis = np.eye(d)[-1]
    make = {
        "h": lambda n: Hinge("world", n, axis=axis if d == 3 else None),
        "s": lambda n: Slider("world", n, axis=axis),
    }
    body = BLOCK if d == 3 else PLATE
    one, two = (make[k](n) for k, n in zip(kinds, "AB", strict=True))
    joints = {"one": one, "two": two}
    free = Arrangement({"A": body, "B": body}, joints=joints)
    a = Arrangement({"A": body, "B": body}, joints={**joints, "G": Gear("one", "two", ratio, 0.3)})
    for first in np.linspace(-7, 7, 29):
        second = ratio * first + 0.3
        q = free.point({}, joints={"one": first, "two": second})
        assert abs(a.polyhedron.equation_values(q)).max() < 1e-12
        wrong = free.point({}, joints={"one": first, "two": second + 0.1})
        assert abs(a.polyhedron.equation_values(wrong)[-1 - len(a.polyhedron.hidden)]) > 0.05
        rates = a.velocity(q, {}, joints={"one": 1.0})
        back = rates @ a.polyhedron.bundle.evaluate(q, 1)[1].T
        assert abs(back[len(a.polyhedron.functions) :]).max() < 1e-9
        step = a.joint_values(a.manifold.onto(q + 1e-6 * rates))["two"] - a.joint_values(q)["two"]
        assert math.remainder(step, math.tau) / 1e-6 == pytest.approx(ratio, abs=1e-4)


RATIOS = [
    ("hhh", 2, -0.75),
    ("hhs", 0.5, -1.5),
    ("shh", 1.3, 0.4),
    ("sss", 0.7, 3),
    ("ssh", 2, 0.3),
]


@pytest.mark.parametrize(("kinds", "ratio", "more"), RATIOS)
@pytest.mark.parametrize("d", [2, 3])
def test_gears_of_three_joints_hold_a_sum(kinds, ratio, more, d):
    """Over several turns of each; the second joint follows where the others are given."""
    axis, body = np.eye(d)[-1], BLOCK if d == 3 else PLATE
    make = {
        "h": lambda n: Hinge("world", n, axis=axis if d == 3 else None),
        "s": lambda n: Slider("world", n, axis=axis),
    }
    joints = {n.lower(): make[k](n) for k, n in zip(kinds, "ABC", strict=True)}
    bodies = dict.fromkeys("ABC", body)
    a = Arrangement(bodies, joints={**joints, "G": Gear("a", "c", ratio, 0.3, further={"b": more})})
    free = Arrangement(bodies, joints=joints)
    row = -1 - len(a.polyhedron.hidden)
    for one, two in np.random.default_rng(0).uniform(-9, 9, (9, 2)):
        three = ratio * one + more * two + 0.3
        q = free.point({}, joints={"a": one, "b": two, "c": three})
        assert abs(a.polyhedron.equation_values(q)).max() < 1e-10
        followed = a.joint_values(a.point({}, joints={"a": one, "b": two}))["c"]
        off = followed - three
        assert (off if kinds[2] == "s" else math.remainder(off, math.tau)) == pytest.approx(
            0, abs=1e-9
        )
        back = a.joint_values(a.point({}, joints={"c": three, "b": two}))["a"] - one
        assert abs(math.sin(back / 2) if kinds[0] == "h" else back) < 1e-9 or kinds[2] == "h"
        wrong = free.point({}, joints={"a": one, "b": two, "c": three + 0.1})
        assert abs(a.polyhedron.equation_values(wrong)[row]) > 0.05
        rates = a.velocity(q, {}, joints={"a": 1.0, "b": -0.5})
        step = a.joint_values(a.manifold.onto(q + 1e-6 * rates))["c"] - a.joint_values(q)["c"]
        along = math.remainder(step, math.tau) / 1e-6
        assert along == pytest.approx(ratio - more / 2, abs=1e-4)


def test_what_gears_of_several_joints_refuse():
    hinges = {n.lower(): Hinge("world", n, at=[3 * k, 0]) for k, n in enumerate("ABC")}
    three = dict.fromkeys("ABC", disc(1.0))
    with pytest.raises(ValueError, match=r"further: .*other than the first .*got 'a'"):
        Gear("a", "b", 2.0, further={"a": 1.0})
    with pytest.raises(ValueError, match=r"further: .*not zero; got 0"):
        Gear("a", "b", 2.0, further={"c": 0})
    with pytest.raises(ValueError, match=r"further: expected names among a, b, c; got z"):
        Arrangement(three, joints={**hinges, "g": Gear("a", "b", 2.0, further={"z": 1.0})})
    gear = Gear("a", "b", 2.0, further={"c": 0.123456789})
    with pytest.raises(ValueError, match=r"further: expected a fraction .* at most 1000"):
        _ = Arrangement(three, joints={**hinges, "g": gear}).polyhedron
    joints = {**hinges, "g": Gear("a", "b", 2.0, further={"c": 1.0})}
    a = Arrangement(three, joints=joints)
    with pytest.raises(ValueError, match=r"expected 'b' at 2 times 'a', 1 times 'c'"):
        a.point(joints={"a": 0.1, "b": 0.5, "c": 0.1})
    with pytest.raises(ValueError, match=r"joints of one body or of two .*'g': repeated bodies"):
        a.system(count=dict.fromkeys("ABC", 1))


def test_a_bead_on_a_curve_of_a_moving_body():
    body = {"P": PLATE, "B": disc(0.2)}
    a = Arrangement(body, joints={"wire": Rail("P", "B", at=[0.5, 0], curve=Y - X**2)})
    q = a.closed(a.manifold.point([1.0, 2.0, 0.6, 3.0, 2.5]))
    c, s = math.cos(q[2]), math.sin(q[2])
    local = np.array([[c, s], [-s, c]]) @ (q[3:] - q[:2]) - [0.5, 0]
    assert local[1] == pytest.approx(local[0] ** 2)
    hold = Rail("world", "B", axis=[0, 0, 1], curve=X**2 + Y**2 - 4)
    ring = Arrangement({"B": sphere(0.2)}, joints={"ring": hold})
    assert ring.manifold.names == ("xB", "yB", "zB")
    q = ring.closed([1.0, 1.5, 0.3])
    assert (np.hypot(*q[:2]), q[2]) == pytest.approx((2, 0), abs=1e-9)


# ---------------------------------------------------------------------------------- mechanisms


def bars(**lengths):
    return {name: capsule([0, 0], [length, 0], 0.05) for name, length in lengths.items()}


def test_a_four_bar_linkage_closes_as_freudenstein_says():
    """Crank 1, coupler 3, rocker 2, ground 3: ``|A - B|`` is the coupler's length."""
    a = Arrangement(
        bars(crank=1, rod=3, rocker=2),
        joints={
            "O": Hinge("world", "crank"),
            "A": Hinge("crank", "rod", at=[1, 0]),
            "B": Hinge("rod", "rocker", at=[3, 0], on=[2, 0]),
            "C": Hinge("world", "rocker", at=[3, 0]),
        },
    )
    for angle in (0.4, 1.0, 2.0):
        pin = np.array([math.cos(angle), math.sin(angle)])

        def too_long(x, pin=pin):
            return np.linalg.norm(pin - [3 + 2 * math.cos(x), 2 * math.sin(x)]) - 3

        rocker = brentq(too_long, 0.3, 2.8)
        rod = math.atan2(*([3 + 2 * math.cos(rocker), 2 * math.sin(rocker)] - pin)[::-1])
        q = a.point({"crank": ([0, 0], angle)}, joints={"A": rod - angle, "C": rocker})
        assert a.joint_values(q)["C"] == pytest.approx(rocker)
        found = stratum_at(a.polyhedron, q)
        assert (found.dimension, found.active) == (1, ())
        v = a.velocity(q, {}, joints={"O": 1.0})
        h = 1e-6
        next_pin = np.array([math.cos(angle + h), math.sin(angle + h)])
        turned = (brentq(too_long, 0.3, 2.8, (next_pin,), 1e-14) - rocker) / h
        assert v[a.manifold.names.index("thetarocker")] == pytest.approx(turned, abs=1e-4)


def test_a_ladder_is_lowest_flat_on_the_floor():
    """Its ends on two rails: one motion; the limit of the foot is a corner of the energy."""
    joints = {
        "wall": Rail("world", "L", on=[-1, 0], axis=[0, 1]),
        "floor": Rail("world", "L", on=[1, 0], axis=[1, 0], limits=(0.0, 1.6)),
    }
    a = Arrangement({"L": capsule([-1, 0], [1, 0], 0.05)}, joints=joints)
    q = a.closed([0.6, 0.8, -0.9])
    assert stratum_at(a.polyhedron, q).dimension == 1
    c = minimise(a.polyhedron, a.manifold.symbols[1], q)
    assert c.active == ("floor.max",)
    assert c.point == pytest.approx([0.8, 0.6, -math.asin(0.6)])


def test_the_skeleton_of_a_ladder_is_an_edge_between_its_limits():
    joints = {
        "wall": Rail("world", "L", on=[-1, 0], axis=[0, 1], limits=(0.5, 2.0)),
        "floor": Rail("world", "L", on=[1, 0], axis=[1, 0], limits=(0.5, 2.0)),
    }
    a = Arrangement({"L": capsule([-1, 0], [1, 0], 0.05)}, joints=joints)
    found = skeleton(a.polyhedron, a.closed([0.6, 0.8, -0.9]))
    assert sorted(c.active for c in found.corners) == [("floor.min",), ("wall.min",)]
    assert len(found.edges) == 1


def test_all_equilibria_of_a_bar_on_a_nail_are_two():
    """Complete with proof: hanging, and standing on the nail."""
    a = Arrangement(
        {"A": capsule([-1, 0], [1, 0], 0.1)}, joints={"n": Hinge("world", "A", on=[-1, 0])}
    )
    height = a.manifold.symbols[1]
    found = stationary_points(a.polyhedron, height, box={"xA": (-2, 2), "yA": (-2, 2)})
    assert found.complete
    heights = sorted(float(p.point[1]) for p in found.points)
    assert heights == pytest.approx([-1, 1])


def test_arrangements_with_joints_are_values():
    joints = {"w": Rail("world", "A", curve=Y - X**2), "p": Hinge("A", "B", limits=(-1, 1))}
    a = Arrangement({"A": PLATE, "B": PLATE}, joints=joints)
    again = pickle.loads(pickle.dumps(a))
    q = a.point({"A": ([1, 1], 0.3)}, joints={"p": 0.4})
    assert again.polyhedron.equation_names == a.polyhedron.equation_names
    assert (again.polyhedron.equation_values(q) == a.polyhedron.equation_values(q)).all()


def test_scissors_have_one_motion_and_rise_as_they_close():
    """Two equal bars crossed at their middles: the upper ends are at ``2 l sin``."""
    joints = {
        "foot": Hinge("world", "A", on=[-1, 0]),
        "slide": Rail("world", "B", on=[-1, 0], axis=[1, 0]),
        "pin": Hinge("A", "B"),
    }
    a = Arrangement(dict.fromkeys("AB", capsule([-1, 0], [1, 0], 0.02)), joints=joints)
    for angle in (0.3, 0.9, 1.3):
        q = a.point({}, joints={"foot": angle, "pin": math.pi - 2 * angle})
        assert stratum_at(a.polyhedron, q).dimension == 1
        assert a.joint_values(q)["slide"] == pytest.approx(2 * math.cos(angle))
        assert q[1] == pytest.approx(math.sin(angle))


def test_a_hanging_chain_is_a_proved_minimum():
    """Four equal links: ``tan`` of the angles are in arithmetic progression, symmetric here."""
    link, n, span = capsule([-0.5, 0], [0.5, 0], 0.05), 4, 2.5
    joints = {"left": Hinge("world", "1", on=[-0.5, 0])}
    for i, j in pairwise(range(1, n + 1)):
        joints[f"j{i}"] = Hinge(str(i), str(j), at=[0.5, 0], on=[-0.5, 0])
    joints["right"] = Hinge("world", str(n), at=[span, 0], on=[0.5, 0])
    a = Arrangement([link] * n, joints=joints)
    q = a.point({}, joints={"left": -0.8, "j1": 0.4, "j2": 0.5, "j3": 0.4})
    assert stratum_at(a.polyhedron, q).dimension == 2
    height = sum(s for s in a.manifold.symbols if s.name.startswith("y"))
    found = minimise(a.polyhedron, height, q)
    assert "strict local minimum: proved" in str(prove(found))
    # The weight of the links below a joint is carried by it: tan(outer) = 3 tan(inner).
    inner = brentq(
        lambda x: 2 * (math.cos(x) + math.cos(math.atan(3 * math.tan(x)))) - span, 0, 1.2
    )
    angles = found.point[a.manifold.names.index("theta1") :: 3]
    outer = math.atan(3 * math.tan(inner))
    assert angles == pytest.approx([-outer, -inner, inner, outer])


def test_planar_loops_in_space_have_their_one_motion_despite_dependent_equations():
    """Twenty equations, of which three follow; with a rail as the last joint none does."""
    z = [0, 0, 1]
    lengths = {"crank": 1, "rod": 3, "rocker": 2}
    several = {n: capsule([0, 0, 0], [x, 0, 0], 0.05) for n, x in lengths.items()}
    joints = {
        "O": Hinge("world", "crank", axis=z),
        "A": Hinge("crank", "rod", at=[1, 0, 0], axis=z),
        "B": Hinge("rod", "rocker", at=[3, 0, 0], on=[2, 0, 0], axis=z),
        "C": Hinge("world", "rocker", at=[3, 0, 0], axis=z),
    }
    last = {"B": Rail("rod", "rocker", at=[3, 0, 0], on=[2, 0, 0], axis=z)}
    for closing, independent in (({}, False), (last, True)):
        a = Arrangement(several, joints={**joints, **closing})
        q = a.point({}, joints={"O": 1.0, "A": -0.5, "C": 1.4})
        found = stratum_at(a.polyhedron, q)
        assert found.dimension == 1
        assert ("DEGENERATE" in str(found)) != independent
        assert q[2::7] == pytest.approx(0, abs=1e-12)


def test_bodies_of_revolution_keep_their_coordinates_where_an_axis_is_enough():
    rod = capsule([-1, 0, 0], [1, 0, 0], 0.1)
    pins = {
        "one": Ball("world", "A", on=[-1, 0, 0]),
        "two": Ball("A", "B", at=[1, 0, 0], on=[-1, 0, 0]),
    }
    a = Arrangement({"A": rod, "B": rod}, joints=pins)
    assert a.manifold.names[3:6] == ("uxA", "uyA", "uzA")
    q = a.point({"A": [0, 0, 0], "B": [0.1, 2.0, 0]})
    assert stratum_at(a.polyhedron, q).dimension == 4
    off = Arrangement({"A": rod}, joints={"one": Ball("world", "A", on=[0, 0.1, 0])})
    assert off.manifold.names[3] == "awA"
    assert Arrangement({"A": disc(1)}, joints={"p": Ball("world", "A")}).manifold.size == 2
    assert Arrangement({"A": disc(1)}, joints={"p": Hinge("world", "A")}).manifold.size == 3


def test_joined_bodies_do_not_touch_unless_asked():
    two = {"A": disc(1.0), "B": disc(1.0), "C": disc(1.0)}
    for collide in (False, True):
        joints = {"p": Hinge("A", "B", at=[1, 0], on=[-1, 0], collide=collide)}
        a = Arrangement(two, joints=joints)
        assert ("A-B" in a.polyhedron.names) == collide
        assert {"A-C", "B-C"} <= set(a.polyhedron.names)
    fixed = Arrangement({"A": disc(1)}, fixed={"F": disc(2)}, joints={"h": Hinge("F", "A")})
    assert not fixed.polyhedron.functions


def test_symmetries_leave_joints_alone():
    """Exchanges of free bodies and motions of the whole remain, and keep equations."""
    joints = {"p": Hinge("A", "B", at=[1, 0], on=[-1, 0])}
    four = Arrangement(dict.fromkeys("ABCD", disc(1.0)), joints=joints)
    symmetry = four.symmetry
    assert len(symmetry.elements) == 1
    assert len(symmetry.fields) == 3
    q = four.point({"A": [0, 0], "C": [5, 0], "D": [0, 5]}, joints={"p": 0.4})
    D = four.polyhedron
    rows = D.bundle.evaluate(q, 1)[1][len(D.functions) :]
    for field in symmetry.fields:
        values = dict(zip(four.manifold.symbols, q, strict=True))
        v = [float(sympy.sympify(field.get(n, 0)).subs(values)) for n in four.manifold.names]
        assert rows @ v == pytest.approx(0, abs=1e-12)
    image = symmetry.elements[0].apply(q)
    assert D.equation_values(image) == pytest.approx(0, abs=1e-12)
    nailed = Arrangement({"A": disc(1.0)}, joints={"p": Hinge("world", "A", at=[1, 0])})
    assert not nailed.symmetry.fields


def test_thinned_bodies_keep_their_joints():
    """Two discs whose centres a slider guides in a box are as thick as the box and they allow."""
    rail = {f"rail{n}": Slider("world", n, at=[0, 1], axis=[1, 0], limits=(0.0, 3.0)) for n in "AB"}
    a = Arrangement(dict.fromkeys("AB", disc(1.0)), box([0, 0], [4, 2]), joints=rail)
    D = thinned(a)
    assert D.names[-6:-2] == ("railA.min", "railA.max", "railB.min", "railB.max")
    q = [0.9, 1.0, 0.0, 2.8, 1.0, 0.0, 0.5]
    assert len(D.equation_values(q)) == 4
    assert D.values(q)[D.names.index("railB.max")] == pytest.approx(0.2)


# -------------------------------------------------------------------------------------- errors

SHIFTS = {"A": disc(1.0), "B": disc(1.0)}
WRONG = [
    (lambda: Hinge("A", "A"), "child: .*another body"),
    (lambda: Hinge("A", "B", at=[1]), "at: .*2 or 3 finite numbers"),
    (lambda: Hinge("A", "B", limits=(1, 1)), "limits: .*larger"),
    (lambda: Hinge("A", "B", axis=[0, 0, 0]), "axis: .*not all zero"),
    (lambda: Rail("A", "B", curve=sympy.Symbol("z")), "curve: .*x and y"),
    (lambda: Rail("A", "B", curve=X, limits=(0, 1)), "limits: .*none on a curve"),
    (lambda: Gear("a", "b", 0.0), "ratio: .*not zero"),
    (lambda: Arrangement(SHIFTS, joints={"a": Hinge("world", "Z")}), r"joints\['a'\]: child: .*Z"),
    (lambda: Arrangement(SHIFTS, joints={"a": Hinge("Q", "A")}), r"joints\['a'\]: parent: .*Q"),
    (lambda: Arrangement(SHIFTS, joints={"a": 3}), "joint: expected a Hinge"),
    (lambda: Arrangement(SHIFTS, joints={"a-b": Hinge("A", "B")}), "names without"),
    (lambda: Arrangement(SHIFTS, joints={"a": Slider("A", "B")}), "axis: expected 2 numbers"),
    (lambda: Arrangement(SHIFTS, joints={"a": Hinge("A", "B", axis=[0, 0, 1])}), "axis: "),
    (lambda: Arrangement(SHIFTS, joints={"a": Hinge("A", "B", at=[0, 0, 1])}), "at: expected 2"),
    (lambda: Arrangement(SHIFTS, joints={"a": Gear("x", "y", 2)}), "first: "),
    (lambda: Arrangement(SHIFTS, joints={"a": Hinge("A", "B")}, period=[2, 2]), "period: "),
    (
        lambda: Arrangement(SHIFTS, joints={"a": Hinge("A", "B")}, orientations="none"),
        "orientations: ",
    ),
    (lambda: Arrangement({"world": disc(1)}, joints={"a": Hinge("world", "world")}), "child: "),
    (lambda: nail().joint_function("ball"), "name: .*one coordinate"),
    (lambda: nail().point({}, joints={"nail": "x"}), "nail.*number"),
    (lambda: nail().point({}, joints={"nagel": 1.0}), "joints: .*nagel"),
    (
        lambda: nail().point({"A": ([0, 0], 0.3), "B": [2, 0]}, joints={"nail": 0.3}),
        "joints: .*placed already; got 'nail'",
    ),
    (lambda: nail().velocity([0, 0, 0, 2, 0], {}, joints={"ball": 1.0}), "joints: "),
    (lambda: scaled(nail()), "arrangement: .*joints"),
]


def nail():
    joints = {"nail": Hinge("world", "A"), "ball": Ball("A", "B", at=[2, 0])}
    return Arrangement(SHIFTS, joints=joints)


@pytest.mark.parametrize(("call", "sentence"), WRONG)
def test_what_does_not_fit_is_refused_in_a_sentence(call, sentence):
    with pytest.raises((ValueError, TypeError), match=sentence):
        call()


def test_what_cannot_be_closed_is_refused_with_the_equation():
    far = {
        "l": Hinge("world", "A", on=[-1, 0]),
        "r": Hinge("world", "A", at=[5, 0], on=[1, 0]),
    }
    a = Arrangement({"A": capsule([-1, 0], [1, 0], 0.1)}, box([-9, -9], [9, 9]), joints=far)
    with pytest.raises(ValueError, match=r"placed: .*joints hold, also '[lr]\.x'"):
        a.point({"A": ([2, 0], 0.1)})


def test_a_value_is_kept_and_what_is_geared_to_it_follows():
    wheels = {"A": disc(1), "B": disc(2)}
    joints = {
        "a": Hinge("world", "A"),
        "b": Hinge("world", "B", at=[4, 0]),
        "gear": Gear("a", "b", -0.5),
    }
    arrangement = Arrangement(wheels, joints=joints, orientations="all")
    for given in ({"a": 0.2}, {"b": -0.1}, {"a": 0.2, "b": -0.1}):
        values = arrangement.joint_values(arrangement.point({}, joints=given))
        assert float(values["a"]) == pytest.approx(0.2, abs=1e-9)
        assert float(values["b"]) == pytest.approx(-0.1, abs=1e-9)
    with pytest.raises(ValueError, match=r"^joints: expected 'b' at -0\.5 times 'a'"):
        arrangement.point({}, joints={"a": 0.2, "b": 0.1})


def test_names_of_joints_are_their_own():
    with pytest.raises(ValueError, match=r"^joints: expected names of their own; got 'floor'"):
        Arrangement({"A": disc(1)}, box([0, 0], [9, 9]) | {"floor": box([0, 0], [9, 9])["bottom"]},
                    joints={"floor": Hinge("world", "A", at=[3, 3])})  # fmt: skip


def test_axes_that_turn_have_no_periods_across():
    floor = {"floor": HalfSpace([0, 1], [0, 0])}
    with pytest.raises(ValueError, match=r"^turning: expected 0, or about the only direction"):
        Arrangement({"D": disc(1.0)}, floor, period=[5, None], turning=1.0)


def test_gears_of_two_hinges_have_ratios_of_as_many_teeth_as_are_allowed():
    hinges = {"one": Hinge("world", "A"), "two": Hinge("world", "B", at=[3, 0])}

    def geared(**more):
        joints = {**hinges, "G": Gear("one", "two", 3 / 1501, **more)}
        return Arrangement(SHIFTS, joints=joints).polyhedron

    with pytest.raises(ValueError, match=r"ratio: .*denominator of at most 1000"):
        geared()
    assert "G" in geared(teeth=2000).equation_names
    with pytest.raises(ValueError, match="teeth: "):
        geared(teeth=0)

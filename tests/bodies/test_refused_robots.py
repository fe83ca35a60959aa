"""What no robot, link or joint has, and what a robot's system does not take, in one sentence."""

import math

import numpy as np
import pytest
import sympy

from polycorner.bodies import (
    Body,
    HalfSpace,
    Mass,
    Robot,
    RobotJoint,
    RobotLink,
    capsule,
    compound,
    disc,
    polytope,
    sphere,
)

CUBE = [[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)]
LINK = RobotLink(sphere(0.1), Mass(1.0, [0, 0, 0], [1, 1, 1]))
LINKS = {"a": LINK, "b": LINK, "c": LINK}
FIRST, SECOND = RobotJoint("a", "b"), RobotJoint("b", "c")
CHAIN = {"one": FIRST, "two": SECOND}
FLOOR = {"floor": HalfSpace([0, 0, 1], [0, 0, -2])}
BALL = {"d": sphere(1)}
MANY = RobotLink(compound({str(k): Body(polytope(CUBE).parts) for k in range(9)}))
CALLED = "joints: expected names that no body, wall, or coordinate of a body has; got"


def robot(**given):
    return Robot(**{"links": LINKS, "joints": CHAIN, "walls": FLOOR, **given})


def gripper(**given):
    rod = RobotLink(capsule([0, 0, 0], [0, 0, 1], 0.1), Mass(1.0, [0, 0, 0], [1, 1, 1]))
    return Robot({"a": RobotLink(), "b": rod}, {"one": FIRST}).among(bodies=BALL, **given)


REFUSED = [
    # Joints.
    (lambda: RobotJoint("a", "b", lower=1, upper=0), "upper: expected a limit above .* 1; got 0"),
    (lambda: RobotJoint("a", "b", axis=[0, 0, 0]), "axis: expected a direction, not zero"),
    (lambda: RobotJoint("a", "b", turn=np.diag([1, 1, -1])), "turn: expected the matrix of a rot"),
    (lambda: RobotJoint("a", "b", follows=("c", math.nan, 0.0)), "follows: expected a finite numb"),
    (lambda: RobotJoint("a", "b", follows=("c", 0.0, 0.0)), "follows: expected a rate that is not"),
    (lambda: RobotJoint("a", "b", "continuous", upper=1), "kind: expected 'revolute' for a joint"),
    (lambda: FIRST.driven_by(2), "name: expected text"),
    # Links.
    (lambda: RobotLink(disc(1.0)), "body: expected a body in space; got"),
    (lambda: RobotLink(None, Mass(1.0, [0, 0], 0.5)), r"mass: expected a mass in space, .* \(3,\)"),
    # Robots.
    (lambda: robot(joints={"one": FIRST}), r"joints: expected joints that .* got \['a', 'c'\]"),
    (lambda: robot(joints={**CHAIN, "e": RobotJoint("a", "c")}), "e: expected a child that no oth"),
    (lambda: robot(joints={**CHAIN, "e": RobotJoint("c", "a")}), "a ring of links"),
    (lambda: robot(joints={"one": FIRST, "two": RobotJoint("b", "x")}), "joints: two: child: exp"),
    (
        lambda: robot(joints={**CHAIN, "two": RobotJoint("b", "c", follows=("two", 1.0, 0.0))}),
        "joints: two: follows: expected a joint that moves by itself",
    ),
    (lambda: robot(bodies={"a": sphere(1)}), "bodies: expected names that no link has; got 'a'"),
    (lambda: robot(bodies={"one": sphere(1)}), f"{CALLED} 'one'"),
    (lambda: robot(walls={"one": FLOOR["floor"]}), f"{CALLED} 'one'"),
    (lambda: robot(joints={"yd": FIRST, "two": SECOND}, bodies=BALL), f"{CALLED} 'yd'"),
    (lambda: robot(joints={"axa": FIRST, "two": SECOND}, base="floating"), f"{CALLED} 'axa'"),
    (lambda: robot(ignored=[("a", "a")]), "ignored: expected pairs of two names"),
    (
        lambda: robot(links={**LINKS, "a": MANY, "c": MANY}).polyhedron,
        "at most 20000 gaps.*capsule",
    ),
    (
        lambda: (
            robot(
                joints={"one": RobotJoint("a", "b", "fixed"), "two": RobotJoint("b", "c", "fixed")}
            ).home
        ),
        r"joints: expected a joint that moves; got \['one', 'two'\]",
    ),
    (lambda: robot().point({"three": 1.0}), "placed: expected names among one, two"),
    # Their motion.
    (lambda: robot(links={**LINKS, "c": RobotLink()}).system(), "a mass of 'c', or beyond it"),
    (lambda: robot().system(density=1j), "density: expected"),
    (lambda: robot().system(masses={"a": 2.0}), "masses: expected names of free bodies, as links"),
    (
        lambda: robot(bodies=BALL).system(masses={"d": Mass(1.0, [0, 0], 0.5)}),
        r"masses\['d'\]: expected a centre of 3 numbers",
    ),
    (
        lambda: robot().system(torques={"one": sympy.Symbol("u")}),
        r"torques\['one'\]: expected a formula in coordinates, .*; got 'u'",
    ),
    (lambda: gripper().system(friction=0.3), "friction: expected coordinates of all rotations"),
    (
        lambda: gripper(orientations="all").system(friction={"bal": 0.3}),
        "friction: expected names among",
    ),
    (lambda: gripper(orientations="none"), "orientations: expected 'needed' or 'all'"),
]


@pytest.mark.parametrize(("wrong", "words"), REFUSED)
def test_what_means_nothing_is_refused(wrong, words):
    with pytest.raises((TypeError, ValueError), match=words):
        wrong()


def test_the_length_of_an_axis_is_of_no_account():
    for size in (1e-200, 1e200):
        assert RobotJoint("a", "b", axis=[size, 0, 0]).axis.tolist() == [1, 0, 0]

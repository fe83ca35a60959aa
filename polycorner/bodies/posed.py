"""Robots as bodies without joints, for pictures and films of arrangements."""

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.motions import Motion, Poses, poses_of
from polycorner.bodies.robots import Robot
from polycorner.checks import refuse
from polycorner.kinds import checked
from polycorner.motion.trajectory import Trajectory
from polycorner.spaces.manifold import Array


@checked
def posed(robot: Robot, points: Motion) -> tuple[Arrangement, Array]:
    """Return links and bodies as an arrangement without joints, and its points.

    Parameters
    ----------
    robot : Robot
    points : (..., N) array or Trajectory
        Of the robot, at least one, or a motion of it.

    Returns
    -------
    Arrangement
        Of the links that have bodies, with walls, fixed and free bodies.
    (k, M) array
        Its points, one for each of the robot.

    Examples
    --------
    >>> from polycorner.bodies import Robot, RobotJoint, RobotLink, sphere
    >>> ends = {"a": RobotLink(sphere(0.5)), "b": RobotLink(sphere(0.5, at=[2, 0, 0]))}
    >>> robot = Robot(ends, {"hinge": RobotJoint("a", "b")})
    >>> bodies, points = posed(robot, [[0.0], [3.0]])
    >>> [*bodies.named], points.shape
    (['a', 'b'], (2, 14))
    """
    places = _points(robot, points, "points")
    moving = {name: link.body for name, link in robot.links.items() if link.body is not None}
    moving |= robot.bodies
    if not moving:
        refuse("robot", "links with bodies", [*robot.links])
    around = robot.walls, robot.fixed
    bodies = Arrangement(moving, *around, orientations="all", unit=robot.unit)
    found = []
    for q in places:
        turned = {name: robot.pose(q, name) for name in moving}
        placed = {n: (at, Rotation.from_matrix(matrix)) for n, (matrix, at) in turned.items()}
        found.append(bodies.point(placed))
    return bodies, np.array(found)


def _points(robot: Robot, given: Any, argument: str) -> Array:
    """Return points ``(k, N)`` of a robot."""
    if isinstance(given, Trajectory):
        system: Any = given.system
        known, own = system.manifold.names, robot.manifold.names
        if known != own:
            refuse(argument, f"one of the coordinates {', '.join(own)}", ", ".join(known))
        given = given.q[:, 0]
    found = np.asarray(robot.manifold.points(given, argument), dtype=np.float64)
    if not found.size:
        refuse(argument, "at least one point", "none")
    return found.reshape(-1, robot.manifold.size)


def poses_in(model: Arrangement | Robot, motion: Any, argument: str = "motion") -> Poses:
    """Return where the bodies of an arrangement or a robot are, as :func:`poses_of` does."""
    if not isinstance(model, Robot):
        return poses_of(model, motion, argument)
    bodies, points = posed(model, _points(model, motion, argument))
    found = poses_of(bodies, points, argument)
    if not isinstance(motion, Trajectory):
        return found
    return replace(found, times=motion.times, touching=tuple(motion.touching), timed=True)

"""Robots as bodies without joints, for pictures and films of arrangements."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.robots import Robot
from polycorner.checks import refuse
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array


@checked
def posed(robot: Robot, points: ArrayLike) -> tuple[Arrangement, Array]:
    """Return links and bodies as an arrangement without joints, and its points.

    Parameters
    ----------
    robot : Robot
    points : (..., N) array
        Of the robot, such as the ``q`` of a trajectory.

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
    places = np.array(robot.manifold.points(points, "points"), dtype=np.float64)
    moving = {name: link.body for name, link in robot.links.items() if link.body is not None}
    moving |= robot.bodies
    if not moving:
        refuse("robot", "links with bodies", [*robot.links])
    around = robot.walls, robot.fixed
    bodies = Arrangement(moving, *around, orientations="all", unit=robot.unit)
    found = []
    for q in places.reshape(-1, robot.manifold.size):
        turned = {name: robot.pose(q, name) for name in moving}
        placed = {n: (at, Rotation.from_matrix(matrix)) for n, (matrix, at) in turned.items()}
        found.append(bodies.point(placed))
    return bodies, np.array(found)

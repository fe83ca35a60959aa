"""Discs that fall between two walls, collide, pile up, and leave over the right wall."""

import numpy as np
import sympy

from polycorner import Manifold, Polyhedron, velocities
from polycorner.motion import ContactFamily, System, pair_coordinates, pair_velocities

G = 9.81
M = Manifold.euclidean("x y")
X, Y = M.symbols
VX, VY = velocities(M)
ONE, TWO = pair_coordinates(M)
DISTANCE = sympy.sqrt((TWO[0] - ONE[0]) ** 2 + (TWO[1] - ONE[1]) ** 2)
BETWEEN = ContactFamily({"discs": DISTANCE - 2}, reach=2.0, restitution=0.3)
KINETIC = (VX**2 + VY**2) / 2
SLOPE = Polyhedron(M, {"floor": Y - 1 + X / 10, "left": X - 1})
DISCS = System(SLOPE, KINETIC, G * Y, count=4, between=BETWEEN, exits={"x": 6.0})
START = np.array([[1.2, 1.5], [3.5, 1.2], [2.4, 3.4], [5.7, 1.6]])

# with an angle, and friction
SPINNING = Manifold.euclidean("x y w")


def rubbing_discs(static, *, count=3, belt=0.0, **options):
    """Discs that turn, rub against each other, and lie on a belt between two walls."""
    from polycorner.motion import Friction, Interval, PairFriction

    x, y, _ = SPINNING.symbols
    vx, vy, vw = velocities(SPINNING)
    (x1, y1, _), (x2, y2, _) = pair_coordinates(SPINNING)
    (u1, v1, o1), (u2, v2, o2) = pair_velocities(SPINNING)
    distance = sympy.sqrt((x2 - x1) ** 2 + (y2 - y1) ** 2)
    nx, ny = (x2 - x1) / distance, (y2 - y1) / distance
    slip = nx * (v2 - v1) - ny * (u2 - u1) - o1 - o2
    rubs = PairFriction({"discs": slip}, static)
    between = ContactFamily(
        {"discs": distance - 2}, reach=2.0, position=("x", "y"), friction=[rubs]
    )
    return System(
        Polyhedron(SPINNING, {"floor": y - 1, "left": x - 1, "right": 4 - x}),
        (vx**2 + vy**2 + vw**2 / 2) / 2,
        G * y,
        friction=(Friction("floor", (vx + vw - belt,), Interval(0.4), "floor"),),
        count=count,
        between=between,
        substrate={"x": belt} if belt else {},
        **options,
    )

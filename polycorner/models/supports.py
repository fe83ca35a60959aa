"""Bodies on several supports, whose forces are not all determined.

Each function returns a :class:`~polycorner.motion.system.System`, in metres, kilograms and seconds,
as those of :mod:`polycorner.models.textbook` do.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from polycorner.models.textbook import GRAVITY, Point
from polycorner.motion.contacts import Friction, velocities
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.system import System
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Manifold

if TYPE_CHECKING:
    import sympy


def table(
    friction: ConvexSet,
    *,
    legs: Sequence[Point] = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)),
    height: float = 1.0,
    inertia: float = 1.0,
    angle: float = 0.0,
) -> System:
    """Return a table that stands on legs, for small tilts; ``x y z alpha beta gamma``.

    ``legs`` are places ``(x, y)`` of the feet below the centre of mass, which is at ``height``;
    ``alpha``, ``beta``, ``gamma`` turn about ``x``, ``y`` and ``z``, which is normal to the plane.
    Four legs and more have more contacts than the plane can tell apart: their forces are not
    determined, their sum and torque are.
    """
    M = Manifold.euclidean("x y z alpha beta gamma")
    (x, _, z, alpha, beta, _), (vx, vy, vz, va, vb, vc) = M.symbols, velocities(M)
    gaps, rough = {}, []
    for i, (a, b) in enumerate(legs, start=1):
        gaps[f"leg{i}"] = z + b * alpha - a * beta
        slip = (vx - height * vb - b * vc, vy + height * va + a * vc)
        rough.append(Friction(f"grip{i}", slip, friction, f"leg{i}"))
    return System(
        Polyhedron(M, gaps),
        (vx**2 + vy**2 + vz**2 + inertia * (va**2 + vb**2 + vc**2)) / 2,
        GRAVITY * (math.cos(angle) * z - math.sin(angle) * x),
        friction=tuple(rough),
    )


def stack(
    count: int,
    friction: ConvexSet,
    *,
    half_width: float = 1.0,
    half_height: float = 0.5,
    angle: float = 0.0,
) -> System:
    """Return boxes on top of each other, the lowest on a plane; ``x1 y1 t1 x2 ...``.

    Each stands with two corners, ``left<i>`` and ``right<i>``, on the top face of the one below.
    """
    import sympy

    M = Manifold.euclidean(" ".join(f"x{i + 1} y{i + 1} t{i + 1}" for i in range(count)))
    q, v = M.symbols, velocities(M)
    gaps, rough = {}, []
    for i in range(count):
        x, y, t = q[3 * i : 3 * i + 3]
        for side, along in (("left", -half_width), ("right", half_width)):
            name = f"{side}{i + 1}"
            foot_x = x + along * sympy.cos(t) + half_height * sympy.sin(t)
            foot_y = y + along * sympy.sin(t) - half_height * sympy.cos(t)
            if i:
                foot_x, foot_y = _seen_from(q[3 * i - 3 : 3 * i], foot_x, foot_y)
            gaps[name] = foot_y - (half_height if i else 0)
            slip = sum(sympy.diff(foot_x, a) * b for a, b in zip(q, v, strict=True))
            rough.append(Friction(f"grip {name}", (slip,), friction, name))
    masses = [1, 1, (half_width**2 + half_height**2) / 3] * count
    pull = (-GRAVITY * math.sin(angle), GRAVITY * math.cos(angle), 0)
    return System(
        Polyhedron(M, gaps),
        sum(m * w**2 for m, w in zip(masses, v, strict=True)) / 2,
        sum(force * a for force, a in zip(pull * count, q, strict=True)),
        friction=tuple(rough),
    )


def _seen_from(
    box: "Sequence[sympy.Symbol]", x: "sympy.Expr", y: "sympy.Expr"
) -> "tuple[sympy.Expr, sympy.Expr]":
    """Return a point in coordinates that move with a box; they change with the velocity seen."""
    import sympy

    x0, y0, t = box
    cos, sin = sympy.cos(t), sympy.sin(t)
    return cos * (x - x0) + sin * (y - y0), cos * (y - y0) - sin * (x - x0)


def groove(friction: ConvexSet, *, slope: float = math.pi / 4) -> System:
    """Return a disc in a groove whose walls ``left`` and ``right`` rise at ``slope``; ``x y a``.

    Two contacts with friction are four forces on three coordinates: the disc may be wedged.
    Without friction each wall carries ``g / (2 cos(slope))``.
    """
    M = Manifold.euclidean("x y a")
    (x, y, _), (vx, vy, va) = M.symbols, velocities(M)
    gaps, rough = {}, []
    for name, sign in (("left", 1), ("right", -1)):
        sin, cos = sign * math.sin(slope), math.cos(slope)
        gaps[name] = sin * x + cos * y - 1
        slip = cos * vx - sin * vy - va
        rough.append(Friction(f"grip {name}", (slip,), friction, name))
    return System(
        Polyhedron(M, gaps),
        (vx**2 + vy**2) / 2 + va**2 / 4,
        GRAVITY * y,
        friction=tuple(rough),
    )


def pile_of_discs() -> System:
    """Return two smooth discs side by side between walls and a third on top; ``x1 y1 x2 ...``.

    Seven contacts push on six coordinates.  The upper disc loads each lower one with
    ``g / sqrt(3)``, the floor carries ``3/2 g`` under each; what the lower two exert on each other
    is not determined, and the walls carry ``g / (2 sqrt(3))`` more than that.
    """
    import sympy

    M = Manifold.euclidean("x1 y1 x2 y2 x3 y3")
    (x1, y1, x2, y2, x3, y3), v = M.symbols, velocities(M)
    gaps = {"floor1": y1 - 1, "floor2": y2 - 1}
    gaps |= {"left": x1 - 1, "right": 3 - x2}
    for name, dx, dy in (
        ("12", x2 - x1, y2 - y1),
        ("13", x3 - x1, y3 - y1),
        ("23", x3 - x2, y3 - y2),
    ):
        gaps[name] = sympy.sqrt(dx**2 + dy**2) - 2
    return System(Polyhedron(M, gaps), sum(w**2 for w in v) / 2, GRAVITY * (y1 + y2 + y3))

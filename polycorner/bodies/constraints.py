"""What joints hold, as equations, and the coordinates that they leave.

With the parent at ``(P, A)`` and the child at ``(Q, B)`` (origin and rotation), the anchors ``a``
of the parent and ``b`` of the child, and the rotation ``T`` of the child in the parent where the
coordinate is zero, a joint is about

    w = Q + B b - (P + A a),        the way between the anchors,
    X = A^T B T^T,                  how far the child is turned, in the axes of the parent.

``X`` is a unit quaternion, in the plane that of half the angle between the bodies.  It turns about
an axis ``n`` where the components of its vector across ``n`` vanish: these are independent, smooth
and change their signs with that of a quaternion, and there is no second way to put the parts
together, as with the cosine of an angle.  Equations are scaled so that multipliers are forces and
torques on the child.
"""

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import singledispatch
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner import checks
from polycorner.bodies.holds import Angle, Coordinate, Holding, Position, across, hamilton, times
from polycorner.bodies.images import wrapped
from polycorner.bodies.joints import AnyJoint, Ball, Fixed, Gear, Hinge, Joint, Planar, Rail, Slider
from polycorner.bodies.shapes import Body, turning
from polycorner.checks import about, refuse
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

    from polycorner.bodies.holds import Expressions
    from polycorner.spaces.distances import Point


def check_fit(joint: Joint, d: int) -> None:
    """Raise ValueError for what does not fit in the plane, or in space."""
    for name in ("at", "on", "axis"):
        given = getattr(joint, name, None)
        if given is not None and len(given) != d:
            refuse(name, f"{d} numbers", given.tolist())
    _reference(joint, d)
    axis, limits = getattr(joint, "axis", None), getattr(joint, "limits", None)
    if isinstance(joint, Planar) and (d == 2 or limits is not None):
        refuse("joint", "bodies in space, and no limits, for a Planar joint", joint)
    if isinstance(joint, Hinge) or (isinstance(joint, Rail) and joint.curve is not None):
        if (axis is None) != (d == 2):
            refuse("axis", "no axis in the plane" if d == 2 else "3 numbers, not all zero", axis)
    elif axis is None and hasattr(joint, "axis"):
        refuse("axis", f"{d} numbers, the direction in the coordinates of the parent", None)


def counts_turns(joint: AnyJoint) -> bool:
    """Whether limits of a joint tell turns apart, so that a coordinate has to count them."""
    limits = joint.limits if isinstance(joint, Hinge) else None
    return limits is not None and not limits[1] - limits[0] < math.tau


def orients(joint: AnyJoint, name: str, body: Body) -> bool:
    """Whether a joint needs the whole orientation of a body.

    Else it does not hold the body, or by an anchor on the axis of a body of revolution alone.
    """
    if isinstance(joint, Gear) or name not in joint.bodies:
        return False
    is_point = isinstance(joint, Ball) or (isinstance(joint, Rail) and name == joint.child)
    if not is_point or body.axis is None:
        return True
    anchor = anchors(joint, body.dimension)[joint.bodies.index(name)]
    off = anchor - (anchor @ body.axis) * body.axis
    return bool(np.abs(off).max() > DEFAULT.alike * body.size)


def anchors(joint: Joint, d: int) -> tuple[Array, Array]:
    """Return those of parent and child."""
    at, on = (np.zeros(d) if a is None else np.asarray(a) for a in (joint.at, joint.on))
    return at, on


def _reference(joint: Joint, d: int) -> Array:
    """Return the matrix ``T``."""
    return turning(getattr(joint, "turn", None), d)


def _axis(joint: Joint) -> Array:
    return np.asarray(getattr(joint, "axis", None))


# ------------------------------------------------------------------------------------ equations


def away(joint: Joint, one: Holding, two: Holding) -> "Point":
    """Return the way ``w`` from the parent's anchor to the child's, in the axes of space."""
    return way(one, two, *anchors(joint, two.dimension))


def way(one: Holding, two: Holding, here: Array, there: Array) -> "Point":
    """Return the way from a point of a body to the nearest image of one of another, in space."""
    ends, periods = (one.point(here), two.point(there)), (*one.periods, *[math.inf] * 3)
    x, y, z = (
        wrapped(math.tau * (q - p) / period, period) if math.isfinite(period) else q - p
        for p, q, period in zip(*ends, periods, strict=False)
    )
    return x, y, z


def _turned(joint: Joint, one: Holding, two: Holding) -> "tuple[Any, ...]":
    """Return the quaternion ``X``."""
    w, x, y, z = one.quaternion
    u, *back = Rotation.from_matrix(_reference(joint, 3)).as_quat()[[3, 0, 1, 2]].tolist()
    turned = hamilton((w, -x, -y, -z), two.quaternion)
    return hamilton(turned, (u, *(-v for v in back)))


def _angle(joint: Joint, one: Holding, two: Holding) -> Angle:
    """Return the angle about the axis, in the plane counterclockwise."""
    import sympy

    if two.dimension == 3:
        w, *vector = _turned(joint, one, two)
        return Angle(w, _along(_axis(joint), vector))
    matrix = _reference(joint, 2)
    plain = sum(two.turns) - sum(one.turns) - math.atan2(matrix[1, 0], matrix[0, 0])
    return Angle(sympy.cos(plain / 2), sympy.sin(plain / 2), plain)


def _along(axis: Array, vector: "Sequence[sympy.Expr]") -> "sympy.Expr":
    return sum(n * v for n, v in zip(axis.tolist(), vector, strict=True))


def _meeting(joint: Joint, one: Holding, two: Holding) -> "Expressions":
    """Return the equations of anchors that come together."""
    return dict(zip("xyz"[: two.dimension], away(joint, one, two), strict=False))


def _unturned(joint: Joint, one: Holding, two: Holding, axes: Sequence[Array]) -> "Expressions":
    """Return the equations of no rotation about some axes; in the plane there is one."""
    if two.dimension == 2:
        return {"turn": 2 * _angle(joint, one, two).sine}
    _, *vector = _turned(joint, one, two)
    return {f"turn{k}": 2 * _along(axis, vector) for k, axis in enumerate(axes, 1)}


def _beside(joint: Joint, one: Holding, two: Holding, ways: Sequence[Array]) -> "Expressions":
    """Return the equations of no displacement along some directions of the parent."""
    displaced = away(joint, one, two)
    marks = [""] if len(ways) == 1 else map(str, range(1, len(ways) + 1))
    return {f"off{k}": one.along(displaced, way) for k, way in zip(marks, ways, strict=True)}


@singledispatch
def equations(joint: Joint, one: Holding, two: Holding) -> "Expressions":
    """Return the equations of a joint by the ends of their names; of a ball: anchors together."""
    return _meeting(joint, one, two)


@equations.register(Hinge)
def _(joint: Hinge, one: Holding, two: Holding) -> "Expressions":
    """Anchors together; in space no rotation about two directions across the axis."""
    found = _meeting(joint, one, two)
    return found if two.dimension == 2 else found | _across(joint, one, two)


@equations.register(Slider)
def _(joint: Slider, one: Holding, two: Holding) -> "Expressions":
    """No displacement across the axis, and no rotation."""
    held = _unturned(joint, one, two, [*np.eye(3)])
    return _beside(joint, one, two, across(_axis(joint))) | held


@equations.register(Planar)
def _(joint: Planar, one: Holding, two: Holding) -> "Expressions":
    """No displacement along the axis, and no rotation about two directions across it."""
    return _beside(joint, one, two, [_axis(joint)]) | _across(joint, one, two)


@equations.register(Fixed)
def _(joint: Fixed, one: Holding, two: Holding) -> "Expressions":
    """Anchors together, and no rotation."""
    return _meeting(joint, one, two) | _unturned(joint, one, two, [*np.eye(3)])


@equations.register(Rail)
def _(joint: Rail, one: Holding, two: Holding) -> "Expressions":
    """No displacement across the line; or the anchor on the curve, in its plane."""
    if joint.curve is None:
        return _beside(joint, one, two, across(_axis(joint)))
    ways = [*np.eye(2)] if joint.axis is None else across(_axis(joint))
    displaced = away(joint, one, two)
    local = dict(zip("xy", [one.along(displaced, way) for way in ways], strict=True))
    found = {"on": joint.curve.xreplace({s: local[s.name] for s in joint.curve.free_symbols})}
    if joint.axis is not None:
        found["off"] = one.along(displaced, _axis(joint))
    return found


def _across(joint: Joint, one: Holding, two: Holding) -> "Expressions":
    return _unturned(joint, one, two, across(_axis(joint)))


# ---------------------------------------------------------------------------------- coordinates


def has_coordinate(joint: AnyJoint) -> bool:
    """Whether a joint leaves an angle or a position, one number."""
    straight = isinstance(joint, Rail) and joint.curve is None
    return straight or isinstance(joint, Hinge | Slider)


def coordinate(joint: Joint, one: Holding, two: Holding) -> Coordinate:
    """Return the angle or the position that a joint leaves."""
    if isinstance(joint, Hinge):
        return _angle(joint, one, two)
    return Position(one.along(away(joint, one, two), _axis(joint)))


def geared(gear: Gear, joints: Mapping[str, Coordinate]) -> "sympy.Expr":
    """Return the equation of a gear, whose multiplier is the force or torque on the second child.

    Half a multiple of angles is the phase of a power of a complex number, so that the equation is
    smooth however often they go round.
    """
    coefficients = gear.coefficients
    wholes = _wholes(gear, [n for n in gear.joints if isinstance(joints[n], Angle)])
    if not wholes:
        return sum(c * joints[n].value() for n, c in coefficients.items()) - gear.phase
    last = [*wholes][-1]
    teeth = wholes[last] / coefficients[last]
    phase = math.cos(teeth * gear.phase / 2), -math.sin(teeth * gear.phase / 2)
    for name, c in coefficients.items():
        phase = times(joints[name].phase(float(wholes.get(name, teeth * c))), phase)
    return 2 / teeth * phase[1]


def _wholes(gear: Gear, hinges: Sequence[str]) -> dict[str, int]:
    """Return whole numbers in the ratios of the coefficients of hinges, without common divisor."""
    parts = {}
    for name in hinges:
        exact = gear.coefficients[name] / gear.coefficients[hinges[-1]]
        parts[name] = Fraction(exact).limit_denominator(gear.teeth)
        if abs(float(parts[name]) - exact) > DEFAULT.rounding * abs(exact):
            argument = "ratio" if name == gear.first else "further"
            refuse(argument, f"a fraction with a denominator of at most {gear.teeth}", abs(exact))
    common = math.lcm(*(part.denominator for part in parts.values()))
    found = {name: int(part * common) for name, part in parts.items()}
    divisor = math.gcd(*found.values())
    return {name: number // divisor for name, number in found.items()}


def inequalities(one: Coordinate, low: float, high: float) -> "Expressions":
    """Return the inequalities of limits, which vanish with the slopes 1 and -1.

    On a circle a function that changes its sign at a limit does so somewhere else as well: here
    beyond the other limit, by a third of what is between them on the far side.
    """
    if isinstance(one, Position):
        ends = {"min": (low, one.plain - low), "max": (high, high - one.plain)}
        return {end: e for end, (limit, e) in ends.items() if math.isfinite(limit)}
    beyond = (math.tau - (high - low)) / 3
    half = (high - low + beyond) / 2
    centres = {"min": (low + high + beyond) / 2, "max": (low + high - beyond) / 2}
    return {
        end: (one.wave(centre) - math.cos(half)) / math.sin(half) for end, centre in centres.items()
    }


def relative(joint: Joint, value: Any, d: int) -> tuple[Array, Array]:
    """Return origin and matrix of the child in the parent for a value of the coordinate."""
    at, on = anchors(joint, d)
    displaced, turned = np.zeros(d), np.eye(d)
    if isinstance(joint, Hinge):
        axis = np.array([0.0, 0.0, 1.0]) if d == 2 else _axis(joint)
        angle = checks.real("joints", value)
        turned = Rotation.from_rotvec(angle * axis).as_matrix()[:d, :d]
    elif has_coordinate(joint):
        displaced = checks.real("joints", value) * _axis(joint)
    elif isinstance(joint, Ball) and not (isinstance(value, int | float) and value == 0):
        with about("joints"):
            turned = turning(value, d)
    elif np.any(value):
        refuse("joints", f"no value of a {type(joint).__name__}", value)
    matrix = turned @ _reference(joint, d)
    return at + displaced - matrix @ on, matrix

"""Mechanisms: bodies with joints, as formulas, and their placements by angles and positions."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner import checks
from polycorner.bodies import constraints
from polycorner.bodies.constraints import (
    check_fit,
    counts_turns,
    geared,
    has_coordinate,
    inequalities,
    relative,
)
from polycorner.bodies.frames import Frame, symbols
from polycorner.bodies.holds import Angle, Coordinate, Holding, Position
from polycorner.bodies.joints import WORLD, AnyJoint, Gear, Hinge, Joint
from polycorner.bodies.poses import Placement, pose_of
from polycorner.bodies.shapes import Body
from polycorner.checks import about, refuse
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.motion.placements import onto_equations
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

if TYPE_CHECKING:
    from polycorner.bodies.holds import Expressions


def check_joints(
    joints: Mapping[str, Any], bodies: Mapping[str, Body], fixed: Mapping[str, Body]
) -> None:
    """Raise for joints that do not fit the bodies."""
    able = [name for name, joint in joints.items() if has_coordinate(joint)]
    for name, joint in joints.items():
        if not isinstance(name, str) or not name or set(".-") & set(name):
            refuse("joints", "names without '.' and '-'", name)
        with about(f"joints[{name!r}]"):
            if not isinstance(joint, Joint | Gear):
                expected = "a Hinge, Slider, Ball, Fixed, Rail, Planar or Gear"
                refuse("joint", expected, joint, TypeError)
            if isinstance(joint, Gear):
                checks.names("first", [joint.first], able)
                checks.names("second", [joint.second], able)
                checks.names("further", joint.further, able)
                continue
            checks.names("parent", [joint.parent], [WORLD, *bodies, *fixed])
            checks.names("child", [joint.child], bodies)
            check_fit(joint, bodies[joint.child].dimension)
    if joints and WORLD in bodies:
        refuse("bodies", f"names other than {WORLD!r} where there are joints", WORLD)


@dataclass(frozen=True, eq=False)
class Mechanism(Checked):
    """The joints of bodies with coordinates, as formulas.

    Attributes
    ----------
    joints : mapping from str to Joint or Gear
    placements : tuple of Placement
    unwound : bool, optional
        Whether angles of bodies in the plane count turns, as along a motion, so that no coordinate
        has to; default not: they are points of circles.
    periods : tuple of float, optional
        Of a box whose images are joined, ``inf`` in directions without.
    """

    joints: Mapping[str, AnyJoint]
    placements: tuple[Placement, ...]
    unwound: bool = False
    periods: tuple[float, ...] = ()

    def hold(self, name: str) -> Holding:
        """Return what joints take hold of by a name; that of no body that moves is space."""
        d = self.placements[0].body.dimension
        found = (p for p in self.placements if p.name == name)
        bodies = (Holding(name, p.frame, d, p.body.axis, self.periods) for p in found)
        return next(bodies, Holding(name, Frame.FIXED, d, None, self.periods))

    def sides(self, joint: Joint) -> tuple[Holding, Holding]:
        """Return what a joint takes hold of."""
        return self.hold(joint.parent), self.hold(joint.child)

    def coordinate(self, name: str, argument: str = "joints") -> Coordinate:
        """Return the coordinate of a joint, or raise ValueError for one that has none."""
        checks.names(argument, [name], self.joints)
        joint = self.joints[name]
        if not (isinstance(joint, Joint) and has_coordinate(joint)):
            able = "a hinge, a slider or a straight rail, which have one coordinate"
            refuse(argument, able, name)
        if name in self.counters:
            return Position(*symbols([self.counters[name]]))
        if counts_turns(joint):
            plain = self.angle(name).plain
            assert plain is not None, name
            return Position(plain)
        return constraints.coordinate(joint, *self.sides(joint))

    @property
    def counters(self) -> dict[str, str]:
        """The coordinates that count the turns of hinges, by the names of these."""
        counted = [
            n for n, joint in self.joints.items() if counts_turns(joint) and not self.unwound
        ]
        return {name: f"turned{k}" for k, name in enumerate(counted, 1)}

    def angle(self, name: str) -> Angle:
        """Return the angle of a hinge whose turns are counted, by the bodies alone."""
        joint = self.joints[name]
        assert isinstance(joint, Hinge), name
        found = constraints.coordinate(joint, *self.sides(joint))
        assert isinstance(found, Angle), name
        return found

    def counted(self, manifold: Manifold, q: Array, values: Mapping[str, Any]) -> Array:
        """Return the angles of counted hinges nearest to given values; else within half a turn."""
        names, found = manifold.names[: len(q)], []
        for name in self.counters:
            family = Family.of({name: self.angle(name).value()}, names)
            angle = float(family.evaluate(q)[0][0])
            turns = (checks.real("joints", values.get(name, angle)) - angle) / math.tau
            found.append(angle + math.tau * round(turns))
        return np.append(q, found)

    def counted_rates(self, manifold: Manifold, q: Array, v: Array) -> Array:
        """Return velocities of bodies, then the rates of counted hinges."""
        at, found = dict(zip(manifold.symbols, q.tolist(), strict=True)), []
        rates = dict(zip(manifold.names, v.tolist(), strict=False))
        for name in self.counters:
            slopes = self.angle(name).slopes(manifold.symbols)
            found.append(sum(float(s.subs(at)) * rates[x] for x, s in slopes.items()))
        return np.append(v, found)

    @property
    def equations(self) -> "Expressions":
        """All equations by name."""
        found: Expressions = {}
        for name, joint in self.joints.items():
            if isinstance(joint, Gear):
                with about(f"joints[{name!r}]"):
                    found[name] = geared(joint, {n: self.coordinate(n) for n in joint.joints})
                continue
            some = constraints.equations(joint, *self.sides(joint))
            found |= {f"{name}.{end}": e for end, e in some.items()}
            if name in self.counters:
                (turned,) = symbols([self.counters[name]])
                found[f"{name}.turns"] = self.angle(name).away(turned)
        return found

    @property
    def limits(self) -> "Expressions":
        """The inequalities of all limits by name."""
        found: Expressions = {}
        for name, joint in self.joints.items():
            limits = getattr(joint, "limits", None)
            if limits is None:
                continue
            some = inequalities(self.coordinate(name), *limits)
            found |= {f"{name}.{end}": e for end, e in some.items()}
        return found

    def values(self, manifold: Manifold, points: Array) -> dict[str, Array]:
        """Return the coordinates of all joints that have one, ``(...)`` at points ``(..., N)``."""
        found = {}
        for name in filter(lambda name: has_coordinate(self.joints[name]), self.joints):
            family = Family.of({name: self.coordinate(name).value()}, manifold.names)
            found[name] = family.evaluate(points)[0][..., 0]
        return found

    @property
    def apart(self) -> frozenset[frozenset[str]]:
        """The pairs of bodies that do not touch, for a joint connects them."""
        return frozenset(
            frozenset(joint.bodies)
            for joint in self.joints.values()
            if isinstance(joint, Joint) and not joint.collide
        )


def joined(mechanism: Mechanism, manifold: Manifold, parts: Iterable[Any]) -> Polyhedron:
    """Return placements in which joints hold, with given and/or trees of gaps."""
    limits = [SmoothFunction(*one, manifold) for one in mechanism.limits.items()]
    return Polyhedron(manifold, AllOf(*parts, *limits), mechanism.equations)


def completed(
    mechanism: Mechanism,
    placed: Any,
    values: Mapping[str, Any],
    fixed: Mapping[str, Body],
) -> dict[str, Any]:
    """Return placements with those of bodies that joints connect with bodies which have one.

    Joints with a value come first; others are where their coordinate is zero.
    """
    given, stated = dict(checks.mapping("placed", placed)), values
    joints = {name: j for name, j in mechanism.joints.items() if isinstance(j, Joint)}
    checks.names("joints", checks.mapping("joints", values), joints)
    if not joints:
        return given
    values = followed(mechanism, values)
    d = mechanism.placements[0].body.dimension
    poses = dict.fromkeys((WORLD, *fixed), (np.zeros(d), np.eye(d)))
    bodies = [p.name for p in mechanism.placements]
    poses |= {n: pose_of("placed", one, d) for n, one in given.items() if n in bodies}
    idle = set(stated)
    waiting = sorted(joints, key=lambda name: name not in values)
    while name := next((n for n in waiting if 0 < _known(joints[n], poses) < 2), None):
        joint = joints[name]
        idle.discard(name)
        with about(f"joints[{name!r}]"):
            away, turn = relative(joint, values.get(name, 0.0), d)
        if joint.parent in poses:
            origin, matrix = poses[joint.parent]
            poses[joint.child] = origin + matrix @ away, matrix @ turn
        else:
            origin, matrix = poses[joint.child]
            whole = matrix @ turn.T
            poses[joint.parent] = origin - whole @ away, whole
    if idle:
        expected = "values of joints that place a body, and not of bodies that are placed already"
        refuse("joints", expected, min(idle))
    for name in bodies:
        if name not in given and name in poses:
            origin, matrix = poses[name]
            angle = math.atan2(matrix[1, 0], matrix[0, 0])
            given[name] = origin, angle if d == 2 else Rotation.from_matrix(matrix)
    return given


def followed(mechanism: Mechanism, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values of joints with those that follow from them by gears.

    Of a gear of several joints those are zero that are not known, but for the second one, or else
    the last.
    """
    found = dict(values)
    gears = [joint for joint in mechanism.joints.values() if isinstance(joint, Gear)]
    for most in (1, math.inf):
        for gear in gears * len(gears):  # one may follow another
            missing = [name for name in gear.joints if name not in found]
            if 0 < len(missing) < len(gear.joints) and len(missing) <= most:
                found[missing[-1]] = -_off(gear, found) / gear.coefficients[missing[-1]]
    for gear in gears:
        off = _off(gear, found)
        if isinstance(mechanism.joints[gear.second], Hinge):
            off = math.remainder(off, math.tau)
        if not found.keys().isdisjoint(gear.joints) and abs(off) > DEFAULT.near:
            ratios = ", ".join(f"{-c:g} times {n!r}" for n, c in gear.coefficients.items())
            expected = f"{gear.second!r} at {ratios.rpartition(', ')[0]}, by their gear"
            refuse("joints", expected, found.get(gear.second, 0.0))
    return found


def _off(gear: Gear, values: Mapping[str, Any]) -> float:
    """Return by how much a gear does not hold; joints without a value are at zero."""
    parts = (c * values.get(name, 0.0) for name, c in gear.coefficients.items())
    return float(sum(parts) - gear.phase)


def _known(joint: Joint, poses: Mapping[str, Any]) -> int:
    return sum(side in poses for side in joint.bodies)


def closed(polyhedron: Polyhedron, q: Array) -> Array:
    """Return the nearest point at which equations hold, or raise ValueError."""
    with np.errstate(all="ignore"):
        found = onto_equations(polyhedron, q)
    off = polyhedron.equation_values(found)
    if not np.isfinite(off).all() or abs(off).max() > DEFAULT.same * (1 + abs(found).max()):
        worst = int(np.argmax(np.where(np.isfinite(off), abs(off), np.inf)))
        expected = "placements near ones in which all joints hold"
        refuse("placed", f"{expected}, also {polyhedron.equation_names[worst]!r}", q.tolist())
    return found


def moved_along(
    polyhedron: Polyhedron,
    mechanism: Mechanism,
    q: Array,
    v: Array,
    rates: Mapping[str, float],
) -> Array:
    """Return the velocities nearest to given ones along equations, with given rates of joints."""
    manifold = polyhedron.manifold
    families = {name: mechanism.coordinate(name).value() for name in rates}
    wanted = np.array([checks.real("joints", rate) for rate in rates.values()])
    rows = polyhedron.bundle.evaluate(q, 1)[1][len(polyhedron.functions) :]
    if families:
        own = Family.of(families, manifold.names).evaluate(q, order=1)[1]
        rows = np.vstack([rows, own])
    scaled = rows * manifold.scale_array
    target = np.concatenate([np.zeros(len(rows) - len(wanted)), wanted]) - rows @ v
    step, *_ = np.linalg.lstsq(scaled, target, rcond=DEFAULT.rank)
    missed = abs(scaled @ step - target).max(initial=0.0)
    if missed > DEFAULT.same * (1 + abs(target).max(initial=0.0)):
        refuse("joints", "rates that are possible together", dict(rates))
    return np.asarray(v + manifold.scale_array * step)

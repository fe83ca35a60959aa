"""Springs, dampers, motors, prescribed motions and forces: what drives bodies, as formulas."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks, signatures
from polycorner.bodies.constraints import way
from polycorner.bodies.frames import Frame
from polycorner.bodies.holds import Angle, Coordinate, Position, hamilton, slopes_of
from polycorner.bodies.laws import Coefficient, static_and_dynamic
from polycorner.bodies.masses import Mass
from polycorner.bodies.mechanisms import Mechanism
from polycorner.bodies.poses import Placement
from polycorner.checks import about, refuse
from polycorner.formulas.expressions import as_expression
from polycorner.kinds import check_fields
from polycorner.motion.contacts import Friction, time_symbol, velocities
from polycorner.motion.friction import Interval
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

    from polycorner.bodies.holds import Expressions

JOINTS, DRIVES = "joints", "drives"  # causes of dissipation


@dataclass(frozen=True, eq=False)
class Damper(Checked):
    """A force against the rate of a joint, or of the distance of two anchors.

    Parameters
    ----------
    parent : str
        Without ``child`` the name of a joint with an angle or a position; or a body, a fixed body
        or ``"world"``.
    child : str, optional
        A body.
    at, on : (d,) array, optional
        Anchors as of a :class:`Hinge`, in the coordinates of ``parent`` and ``child``; default the
        origins.
    damping : float
        Force or torque per rate, in N s/m or N m s where lengths are metres.
    """

    parent: str
    child: str | None = None
    at: ArrayLike | None = None
    on: ArrayLike | None = None
    _: KW_ONLY
    damping: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "damping", checks.real("damping", self.damping, least=0))
        if self.parent == self.child:
            refuse("child", f"another body than {self.parent!r}", self.child)
        for name in ("at", "on"):
            given = getattr(self, name)
            if given is None:
                continue
            if self.child is None:
                refuse(name, "none where one joint is named", given)
            vector = checks.numbers(name, given, "2 or 3 finite numbers")
            if vector.shape not in {(2,), (3,)} or not np.isfinite(vector).all():
                refuse(name, "2 or 3 finite numbers", given)
            object.__setattr__(self, name, vector.astype(np.float64))
        super().__post_init__()


@dataclass(frozen=True, eq=False)
class Spring(Damper):
    """A linear spring at a joint, or between two anchors, with a damper beside it.

    At a hinge the angle counts from the one where it is relaxed, up to half a turn.

    Parameters
    ----------
    parent, child, at, on, damping
        As for :class:`Damper`.
    stiffness : float
        Force or torque per length or angle, in N/m or N m where lengths are metres.
    length : float, optional
        The distance, position or angle at which it is relaxed; default 0.  Between anchors, one of
        the length 0 damps their velocity in all directions.
    """

    _: KW_ONLY
    stiffness: float = 0.0
    length: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "stiffness", checks.real("stiffness", self.stiffness, least=0))
        least = None if self.child is None else 0.0
        object.__setattr__(self, "length", checks.real("length", self.length, least=least))


@dataclass(frozen=True, eq=False)
class Motor(Checked):
    """A torque about a hinge or a force along a slider, on the child and back on the parent.

    Parameters
    ----------
    joint : str
        Name of a joint with an angle or a position.
    torque : sympy.Expr or float, optional
        A formula of coordinates, velocities and the time (:func:`~polycorner.motion.time_symbol`),
        such as a controller in :meth:`Arrangement.joint_function` and ``joint_rate``.
    speed : sympy.Expr or float, optional
        Instead of a torque the rate that it keeps, as long as less than ``limit`` is needed; it may
        depend on the time.
    limit : float, optional
        The largest force or torque, which a ``speed`` needs.
    """

    joint: str
    torque: "sympy.Expr | float | None" = None
    _: KW_ONLY
    speed: "sympy.Expr | float | None" = None
    limit: float | None = None

    def __post_init__(self) -> None:
        checks.instance("joint", self.joint, str)
        if (self.torque is None) == (self.speed is None):
            refuse("torque", "either a torque or a speed", (self.torque, self.speed))
        if (self.limit is None) != (self.speed is None):
            refuse("limit", "the largest torque of a motor with a speed, and only then", self.limit)
        for name in ("torque", "speed"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, as_expression(name, given))
        if self.limit is not None:
            object.__setattr__(self, "limit", checks.real("limit", self.limit, above=0))
        super().__post_init__()


@dataclass(frozen=True, eq=False)
class Prescribed(Checked):
    """A given motion of a joint, or of a coordinate of a body, as a function of the time.

    Without a ``limit`` it is an equation with the time, which holds at the midpoints of steps, by a
    force as large as it takes (``rheonomic`` of :class:`~polycorner.System`).  A state has to be on
    it and to move along.  Angles count modulo a turn.

    With a limit a drive keeps the rate of the motion as long as it needs less, so that the motion
    is followed to second order in the step from where it starts, which may be anywhere.  What needs
    more stops it, and it goes on from there.

    Parameters
    ----------
    of : str
        Name of a joint with an angle or a position, or of a coordinate.
    motion : sympy.Expr
        A function of :func:`~polycorner.motion.time_symbol`.  With a limit only its derivative
        counts.
    limit : float, optional
        The largest force or torque of the drive; default none.
    """

    of: str
    motion: "sympy.Expr"
    _: KW_ONLY
    limit: float | None = None

    def __post_init__(self) -> None:
        checks.instance("of", self.of, str)
        object.__setattr__(self, "motion", as_expression("motion", self.motion))
        if self.limit is not None:
            object.__setattr__(self, "limit", checks.real("limit", self.limit, above=0))
        super().__post_init__()


Drive = Damper | Motor | Prescribed
signatures.NAMES[Drive] = "Drive"


@dataclass(eq=False)
class Driven:
    """What drives bodies: forces, friction and equations, which are added one after another.

    Attributes
    ----------
    mechanism : Mechanism
    manifold : Manifold
    known : tuple of str
        Names of what springs may hold.
    forces : dict from str to sympy.Expr
    friction : list of Friction
    equations : dict from str to sympy.Expr
        Those with the time.
    """

    mechanism: Mechanism
    manifold: Manifold
    known: tuple[str, ...]
    forces: "Expressions"
    friction: list[Friction]
    equations: "Expressions"

    def add(self, forces: "Expressions", factor: Any = 1) -> None:
        """Add generalised forces by coordinate."""
        for name, force in forces.items():
            if force != 0:
                self.forces[name] = self.forces.get(name, 0) + factor * force

    def rate(self, slopes: "Expressions") -> "sympy.Expr":
        """Return the rate of a function with given derivatives."""
        return rate_of(self.manifold, slopes)

    def spring(self, drive: Damper) -> "sympy.Expr":
        """Add a damper, and return the energy of a spring."""
        import sympy

        stiffness, length = getattr(drive, "stiffness", 0.0), getattr(drive, "length", None)
        symbols = self.manifold.symbols
        if drive.child is None:
            one = self.mechanism.coordinate(drive.parent, "parent")
            slopes, stretched = one.slopes(symbols), one.value(length or 0.0) - (length or 0.0)
        else:
            way = self._between(drive)
            squared = sum(x**2 for x in way)
            if length == 0:
                for x in way:
                    slopes = slopes_of(x, symbols)
                    self.add(slopes, -drive.damping * self.rate(slopes))
                return stiffness * squared / 2
            distance = sympy.sqrt(squared)
            slopes, stretched = slopes_of(distance, symbols), distance - (length or 0.0)
        if drive.damping:
            self.add(slopes, -drive.damping * self.rate(slopes))
        return stiffness * stretched**2 / 2

    def _between(self, drive: Damper) -> "list[sympy.Expr]":
        """Return the way between the anchors."""
        placements = {p.name: p for p in self.mechanism.placements}
        d, ends, anchors = self.mechanism.placements[0].body.dimension, list[Any](), list[Any]()
        checks.names("parent", [drive.parent], self.known)
        checks.names("child", [drive.child or ""], placements)
        for argument, name, anchor in (
            ("at", drive.parent, drive.at),
            ("on", drive.child or "", drive.on),
        ):
            local = np.zeros(d) if anchor is None else np.asarray(anchor)
            if len(local) != d:
                refuse(argument, f"{d} numbers", local.tolist())
            hold, p = self.mechanism.hold(name), placements.get(name)
            if p is not None and _shows_axis(p) and _off(local, p.axis) > DEFAULT.alike:
                expected = f"an anchor on the axis of {name!r}, or orientations='all'"
                refuse(argument, expected, local.tolist())
            ends.append(hold)
            anchors.append(local)
        return [*way(*ends, *anchors)][:d]

    def motor(self, name: str, drive: Motor) -> None:
        """Add a motor: a torque, or friction on what moves at its speed."""
        slopes = self.mechanism.coordinate(drive.joint, "joint").slopes(self.manifold.symbols)
        now = time_symbol()
        if drive.torque is not None:
            known = {*self.manifold.symbols, *velocities(self.manifold), now}
            _check_symbols("torque", drive.torque, known)
            self.add(slopes, drive.torque)
            return
        _check_symbols("speed", drive.speed, {now})
        self._follow(name, slopes, drive.speed, drive.limit)

    def prescribed(self, name: str, drive: Prescribed) -> None:
        """Add an equation with the time, or with a limit a drive that keeps the rate."""
        import sympy

        symbols = {s.name: s for s in self.manifold.symbols}
        hidden = {n for f in self.manifold.factors for n in f.names}
        plain = [n for n in symbols if n not in hidden]
        checks.names("of", [drive.of], [*self.mechanism.joints, *plain])
        one: Coordinate
        if drive.of in self.mechanism.joints:
            one, turn = self.mechanism.coordinate(drive.of, "of"), 1.0
        else:
            x, period = symbols[drive.of], self.manifold.periods[[*symbols].index(drive.of)]
            turn = math.tau / period if math.isfinite(period) else 1.0
            round_ = Angle(sympy.cos(turn * x / 2), sympy.sin(turn * x / 2), x)
            one = round_ if math.isfinite(period) else Position(x)
        now = time_symbol()
        _check_symbols("motion", drive.motion, {now})
        if drive.limit is None:
            self.equations[name] = one.away(turn * drive.motion) / turn
            return
        slopes = one.slopes(self.manifold.symbols)
        self._follow(name, slopes, sympy.diff(drive.motion, now), drive.limit)

    def _follow(self, name: str, slopes: "Expressions", pace: Any, limit: Any) -> None:
        slip, held = self.rate(slopes) - pace, Interval(float(limit))
        self.friction.append(
            Friction(name, (slip,), held, load=(as_expression("load", 1.0),), kind=DRIVES)
        )

    def rub(self, name: str, bounds: Coefficient) -> None:
        """Add friction in a joint, a bound of its force or torque."""
        static, dynamic = static_and_dynamic("friction", bounds)
        if static == 0:
            return
        slopes = self.mechanism.coordinate(name, "friction").slopes(self.manifold.symbols)
        law = Friction(
            f"{name} slips",
            (self.rate(slopes),),
            Interval(static),
            load=(as_expression("load", 1.0),),
            dynamic=Interval(dynamic),
            kind=JOINTS,
        )
        self.friction.append(law)

    def push(self, name: str, given: Any) -> None:
        """Add a force at the origin of a body, and a torque."""
        p = next(p for p in self.mechanism.placements if p.name == name)
        d = p.body.dimension
        most = d + (1 if d == 2 else 3)
        expected = f"{d} components of a force, or {most} with a torque, for {name!r}"
        if isinstance(given, str | Mapping) or not isinstance(given, Iterable):
            refuse("forces", expected, given, TypeError)
        parts = [as_expression("forces", part) for part in given]
        if len(parts) not in {d, most}:
            refuse("forces", expected, parts)
        known = {*self.manifold.symbols, *velocities(self.manifold), time_symbol()}
        for part in parts:
            _check_symbols("forces", part, known)
        names, turns = p.manifold.names, p.manifold.symbols[d:]
        self.add(dict(zip(names[:d], parts[:d], strict=True)))
        torque = parts[d:]
        if not any(part != 0 for part in torque):
            return
        if p.frame is Frame.SHIFTED:
            refuse("forces", f"no torque on {name!r}, which is shifted only", parts)
        self.add(dict(zip(names[d:], _turning(p.frame, torque, turns), strict=True)))


def _turning(frame: Frame, torque: "list[Any]", turns: "Sequence[sympy.Symbol]") -> list[Any]:
    """Return the generalised forces of a torque in the axes of space.

    Of the rate ``w`` it has the power ``t w``; ``w`` is ``2 Im(a' a*)`` for a quaternion ``a``, and
    ``u x u'`` for the axis of a body that does not show its spin.
    """
    if frame is Frame.TURNED:
        return torque
    if frame is Frame.AXIAL:
        (x, y, z), (u, v, w) = torque, turns
        return [y * w - z * v, z * u - x * w, x * v - y * u]
    back = (turns[0], *(-x for x in turns[1:]))
    found = []
    for k in range(4):
        _, *rates = hamilton([int(i == k) for i in range(4)], back)
        found.append(2 * sum(t * r for t, r in zip(torque, rates, strict=True)))
    return found


def _shows_axis(p: Placement) -> bool:
    """Whether coordinates of a body tell where its axis is, and no more."""
    return p.frame is Frame.AXIAL or (p.frame is Frame.SHIFTED and p.is_round)


def _off(local: Array, axis: Array) -> float:
    return float(np.abs(local - (local @ axis) * axis).max())


def _check_symbols(argument: str, e: "sympy.Expr", known: "set[sympy.Symbol]") -> None:
    unknown = sorted(s.name for s in e.free_symbols - known)
    if unknown:
        what = ", ".join(sorted(s.name for s in known)[:8])
        refuse(argument, f"a formula in {what}{', ...' if len(known) > 8 else ''}", unknown[0])


def rate_of(manifold: Manifold, slopes: "Expressions") -> "sympy.Expr":
    """Return the rate of a function with given derivatives by coordinates."""
    rates = dict(zip(manifold.names, velocities(manifold), strict=True))
    return sum(slope * rates[name] for name, slope in slopes.items())


def counted_energy(
    mechanism: Mechanism, manifold: Manifold, masses: Mapping[str, Mass]
) -> "sympy.Expr":
    """Return what coordinates that count turns add to the kinetic energy: nothing where they do.

    A coordinate ``p`` that equals the angle ``a`` of a hinge gets a share ``e`` of inertia of the
    bodies, ``e (p'^2 - a'^2) / 2``.  Without it the mass matrix would be singular.  It remains
    positive definite for ``e < 1 / sum 1/I``, as ``a'^2 <= (sum 1/I) 2 T`` with the least moments
    of inertia ``I`` of the bodies about their centres of mass.
    """
    import sympy

    found, rates = sympy.S.Zero, dict(zip(manifold.names, velocities(manifold), strict=True))
    for name, counter in mechanism.counters.items():
        ends = [masses[body] for body in mechanism.joints[name].bodies if body in masses]
        least = [float(np.linalg.eigvalsh(np.atleast_2d(mass.inertia))[0]) for mass in ends]
        slopes = mechanism.angle(name).slopes(manifold.symbols)
        share = 0.5 / sum(1 / inertia for inertia in least)
        found += share * (rates[counter] ** 2 - rate_of(manifold, slopes) ** 2) / 2
    return found


def driven(
    mechanism: Mechanism,
    manifold: Manifold,
    known: Sequence[str],
    laws: "tuple[sympy.Expr, sympy.Expr, dict[str, sympy.Expr]]",
    drives: Any,
    pushes: Any,
    rubbing: Mapping[str, Coefficient],
) -> "tuple[tuple[sympy.Expr, sympy.Expr, Expressions], tuple[Friction, ...], Expressions]":
    """Return laws with those of drives and of forces on bodies, friction, and equations with time.

    The friction is that in joints and of drives with a limit.

    Parameters
    ----------
    mechanism, manifold
    known : sequence of str
        Names of bodies, fixed bodies and space.
    laws : kinetic and potential energy, and applied forces
    drives : mapping from str to Spring, Damper, Motor or Prescribed
    pushes : mapping from str to sequence
        Components of forces and torques by body.
    rubbing : mapping from str to float, or to (float, float)
        Bounds of the forces of friction in joints.
    """
    kinetic, potential, forces = laws
    drives = {} if drives is None else checks.mapping("drives", drives)
    pushes = {} if pushes is None else checks.mapping("forces", pushes)
    checks.names("forces", pushes, [p.name for p in mechanism.placements])
    found = Driven(mechanism, manifold, tuple(known), dict(forces), [], {})
    for name, bounds in rubbing.items():
        found.rub(name, bounds)
    for name, given in pushes.items():
        found.push(name, given)
    for name, drive in drives.items():
        checks.instance("drives", name, str)
        with about(f"drives[{name!r}]"):
            if isinstance(drive, Motor):
                found.motor(name, drive)
            elif isinstance(drive, Prescribed):
                found.prescribed(name, drive)
            elif isinstance(drive, Damper):
                potential = potential + found.spring(drive)
            else:
                refuse("drive", "a Spring, Damper, Motor or Prescribed", drive, TypeError)
    return (kinetic, potential, found.forces), tuple(found.friction), found.equations


def split(given: Any, names: Iterable[str]) -> tuple[Any, dict[str, Any]]:
    """Return coefficients by name without those of some names, and these."""
    if not isinstance(given, Mapping):
        return given, {}
    own = {name: given[name] for name in names if name in given}
    return {name: value for name, value in given.items() if name not in own}, own

"""Arrangements: rigid bodies, what stands between them, and their placements without overlap."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from itertools import chain
from operator import mul
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies.centres import chart_of
from polycorner.bodies.checking import angular, check_together, named
from polycorner.bodies.congruences import Congruences
from polycorner.bodies.constraints import orients
from polycorner.bodies.drives import Drive, rate_of
from polycorner.bodies.frames import Frame
from polycorner.bodies.joints import AnyJoint
from polycorner.bodies.kernels import together
from polycorner.bodies.lattices import Lattice, lattice
from polycorner.bodies.laws import Attractions, Coefficients, Restitution
from polycorner.bodies.mechanisms import (
    Mechanism,
    check_joints,
    closed,
    completed,
    followed,
    joined,
    moved_along,
)
from polycorner.bodies.neighbours import Pair, check_room, check_width, pairs
from polycorner.bodies.pairs import Tree, apart, both_sharp, members
from polycorner.bodies.poses import Placement, coordinates, frame_of, rates
from polycorner.bodies.shapes import Body
from polycorner.bodies.systems import Asked, ByName, system_of
from polycorner.bodies.walls import Wall, WallTouch, within
from polycorner.checks import refuse
from polycorner.motion.assembly import Assembly
from polycorner.motion.system import System
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Printed, Sheet, few, listed
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

ORIENTATIONS = ("needed", "all", "none")


@dataclass(frozen=True, eq=False)
class Arrangement(Checked, Printed):
    """Rigid bodies that must not overlap each other, fixed bodies, or walls.

    The coordinates of a body ``A`` are those of its origin, ``xA yA`` or ``xA yA zA``, and of its
    orientation: in the plane the angle ``thetaA``, counterclockwise; in space the direction ``uxA
    uyA uzA`` of the axis of a body of revolution, and else a unit quaternion ``awA axA ayA azA``.
    Discs and balls about their origin have none.

    A contact is called after what touches: ``A-B``, ``A.rod-B.2`` for parts of compounds,
    ``A.v1-B`` for a point of a part (the end of a capsule, a vertex), ``A.e1-B.v2`` for an edge and
    a vertex of polygons, ``A.f1-B.v2`` for a face and a vertex of polyhedra, ``A.e1>B.e2`` and
    ``A.e1<B.e2`` for two of their edges.

    Parameters
    ----------
    bodies : sequence of Body, or mapping from str to Body
        Those that move; the names of a sequence are ``"1"``, ``"2"``, ...  Names have letters,
        digits and ``_``.
    walls : mapping from str to HalfSpace or Cylinder, optional
        :func:`box` makes those of a box.
    fixed : mapping from str to Body, optional
        In the coordinates of space (:meth:`Body.moved`).
    orientations : {"needed", "all", "none"}, optional
        Which are coordinates: those of bodies that do not look the same when turned (default); all,
        as friction needs them; or none, so that bodies are shifted only.
    unit : str, optional
        Unit of length.
    period : sequence of float, optional
        The lengths of a periodic box, None or ``inf`` in directions in which it has no ends; see
        the notes.  Walls have to be parallel to the periodic directions.
    turning : float or (3,) array, optional
        Angular velocity in rad/s, about the origin, of the axes with all that stands in them, for
        motion.  Velocities and energies are those in the axes, with the potential of the
        centrifugal force; gravity keeps the directions of the axes at the time 0.  Default 0.
    joints : mapping from str to Hinge, Slider, Ball, Fixed, Rail, Planar or Gear, optional
        Equations ``<name>.x``, ... of the placements, and the inequalities ``<name>.min`` and
        ``<name>.max`` of limits.  Bodies that a joint connects do not touch each other, unless it
        says ``collide=True``.  They have all coordinates of an orientation, unless joints hold
        them on their axis alone.  In a periodic box they join nearest images.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Notes
    -----
    In a periodic box bodies have images, displaced by whole periods, and must not overlap any of
    another body or of their own.  There is a gap for every image that can touch: ``A-B`` for the
    nearest one, or ``A-B``, ``A-B[1,0]``, ... for several; ``A-A[1,0]`` for a body that is longer
    than a period.

    The distance to one of several images is no function of positions modulo the period ``L``:
    with a body that goes round the box, images change places.  So positions are circles of period
    ``m L``, with the least whole ``m`` such that two bodies ``m L / 2`` apart are clear of each
    other, and the gap of an image belongs to the nearest of its copies ``m L`` apart.  This is
    smooth wherever bodies can touch, and shifts by ``L`` are elements of the :attr:`symmetry`.  For
    bodies shorter than about ``L / 2``, ``m = 1``.

    Examples
    --------
    >>> from polycorner.bodies import Arrangement, box, disc, polygon
    >>> square = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    >>> a = Arrangement({"S": square, "D": disc(0.5)}, walls=box([-3, -3], [3, 3]))
    >>> a.manifold.names
    ('xS', 'yS', 'thetaS', 'xD', 'yD')
    >>> q = a.point({"S": ([-2, 0], 0.0), "D": [1.5, 0]})
    >>> a.polyhedron.contains(q), a.placed(q)["S"].parts[""].points[:, 0].tolist()
    (True, [-3.0, -1.0, -1.0, -3.0])
    """

    bodies: Mapping[str, Body] | Sequence[Body]
    walls: Mapping[str, Wall] = field(default_factory=dict)
    fixed: Mapping[str, Body] = field(default_factory=dict)
    orientations: Literal["needed", "all", "none"] = "needed"
    unit: str = ""
    period: Sequence[float | None] | None = None
    turning: ArrayLike = 0.0
    joints: Mapping[str, AnyJoint] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "bodies", named(self.bodies))
        for argument in ("walls", "fixed"):
            object.__setattr__(self, argument, dict(checks.mapping(argument, vars(self)[argument])))
        for argument, several in (("bodies", self.named), ("fixed", self.fixed)):
            for body in several.values():
                checks.instance(argument, body, Body, "disc(1.0)")
        checks.instance("unit", self.unit, str)
        checks.choice("orientations", self.orientations, ORIENTATIONS)
        object.__setattr__(self, "joints", dict(checks.mapping("joints", self.joints)))
        check_together(self.named, self.fixed, self.walls, self.joints)
        check_joints(self.joints, self.named, self.fixed)
        if self.joints and self.orientations == "none":
            refuse("orientations", "'needed' or 'all' where there are joints", "none")
        if self.joints:
            check_width(self.lattice, [*self.named.values()], [*self.fixed.values()])
        if self.period is not None:
            object.__setattr__(self, "period", tuple(self.lattice.lengths.tolist()))
        check_room(self.lattice, self.placements, self.walls)
        object.__setattr__(self, "turning", angular("turning", self.turning, self.dimension))
        repeated = np.eye(self.dimension)[list(self.lattice.axes)]
        if np.any(self.turning) and len(repeated):
            # Only what goes on along the axis is the same in every period.
            along = self.dimension == 3 and len(repeated) == 1
            if not along or np.cross(repeated[0], np.asarray(self.turning)).any():
                refuse("turning", "0, or about the only direction that is periodic", self.turning)
        super().__post_init__()

    def __repr__(self) -> str:
        """Return the names of the bodies and of what is around them."""
        around = {"walls": self.walls, "fixed": self.fixed}
        told = [f"bodies {few(self.named)}"]
        told += [f"{what} {few(some)}" for what, some in around.items() if some]
        told += [f"period {self.period}"] * (self.period is not None)
        return f"Arrangement({'; '.join(told)})"

    def _sheet(self) -> Sheet:
        moving = (
            (p.name, p.body.described, few(p.manifold.names), "moves") for p in self.placements
        )
        still = ((name, body.described, "", "fixed") for name, body in self.fixed.items())
        walls = ((name, wall.described, "", "wall") for name, wall in self.walls.items())
        count = len(self.named) + len(self.fixed) + len(self.walls)
        head = ("name", "shape", "coordinates", "")
        period = f"Periodic with lengths {self.period}." if self.period is not None else ""
        turns = f"Axes turn at {self.turning} rad/s." if np.any(self.turning) else ""
        title = f"Arrangement in {'the plane' if self.dimension == 2 else 'space'}"
        rows = chain(moving, still, walls)
        return Sheet(title, (listed("", head, rows, count), period, turns))

    @property
    def named(self) -> dict[str, Body]:
        """The bodies that move, by name."""
        return self.bodies  # type: ignore[return-value] # made a dict by __post_init__

    @property
    def dimension(self) -> int:
        """The dimension of the space of the bodies, 2 or 3."""
        return next(iter(self.named.values())).dimension

    @cached_property
    def lattice(self) -> Lattice:
        """The displacements of images."""
        return lattice(self.period, self.dimension)

    @cached_property
    def scale(self) -> float:
        """The displacement that counts as a unit: half the thickness of the thinnest part."""
        return min(part.thickness for body in self.named.values() for part in body.parts.values())

    @cached_property
    def frames(self) -> dict[str, Frame]:
        """The kind of coordinates of each body."""
        held = {
            name: any(orients(joint, name, body) for joint in self.joints.values())
            for name, body in self.named.items()
        }
        return {
            name: frame_of(body, "all" if held[name] else self.orientations)
            for name, body in self.named.items()
        }

    @cached_property
    def placements(self) -> tuple[Placement, ...]:
        """The coordinates of each body, and where they stand."""
        found, start = [], 0
        turns = self.lattice.turns([*self.named.values()], [*self.fixed.values()])
        periods = (self.lattice.lengths * turns).tolist()
        for name, body in self.named.items():
            frame = self.frames[name]
            turn = self.scale / max(body.size, self.scale)
            units = self.scale, turn, self.unit
            factor = frame.manifold(name, self.dimension, *units, periods)
            at = slice(start, start + factor.size)
            found.append(Placement(name, body, frame, factor, at))
            start = at.stop
        return tuple(found)

    @cached_property
    def manifold(self) -> Manifold:
        """The placements of all bodies; a unit displacement moves a body by :attr:`scale`."""
        every = [placement.manifold for placement in self.placements]
        for joint, name in self.mechanism.counters.items():
            ends = self.joints[joint].bodies
            turn = min(p.manifold.scales[-1] for p in self.placements if p.name in ends)
            every.append(Manifold((name,), scales=(turn,), units=("rad",)))
        return reduce(mul, every)

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """``D``, the placements without overlap in which joints hold."""
        return joined(self.mechanism, self.manifold, self.contacts(excluded=True))

    @cached_property
    def mechanism(self) -> Mechanism:
        """The formulas of joints."""
        return Mechanism(self.joints, self.placements, periods=tuple(self.lattice.lengths.tolist()))

    def contacts(self, *, excluded: bool, sharp: bool = True) -> list[Tree]:
        """Return the and/or trees of pairs of parts, of ``sharp`` ones too, and the gaps at walls.

        ``excluded`` says whether rounded parts that cross each other are excluded as well, by
        unions that are never active.
        """
        pairs = [pair for pair in self.pairs if sharp or not both_sharp(*pair)]
        found = [apart(self.manifold, *pair, excluded=excluded) for pair in pairs]
        found += [touch.gap for touch in self.at_walls]
        return together(found)

    @cached_property
    def pairs(self) -> list[Pair]:
        """Two parts each, of different bodies of which one moves, and of a body and its image."""
        found = pairs(self.lattice, self.placements, dict(self.fixed))
        joined = self.mechanism.apart
        return [pair for pair in found if frozenset(m.body for m in pair) not in joined]

    @cached_property
    def at_walls(self) -> list[WallTouch]:
        """The gaps at walls."""
        return [
            touch
            for name, wall in self.walls.items()
            for p in self.placements
            for member in members(p.name, p.body, p)
            for touch in within(self.manifold, name, wall, member)
        ]

    @shown
    def system(  # noqa: PLR0913 - all are options
        self,
        *,
        gravity: ArrayLike | Sequence[Any] | None = None,
        density: float = 1.0,
        masses: ByName = None,
        friction: Coefficients = 0.0,
        rolling: Coefficients = 0.0,
        restitution: Restitution = 0.0,
        attraction: Attractions = None,
        impact: str = "poisson",
        exits: Mapping[str, float] | None = None,
        count: int | Mapping[str, int] = 1,
        joints: ByName = None,
        drives: Mapping[str, Drive] | None = None,
        forces: ByName = None,
        rates: Mapping[str, float] | None = None,
        limits: ByName = None,
        nonholonomic: ByName = None,
    ) -> System | Assembly:
        """Return the mechanical system of the bodies.

        Several bodies are one dense system, with states ``(N,)``.  A single one may be repeated:
        ``count`` bodies like it, with states ``(count, N)``, touch each other as well, and near
        ones are found by their positions.  So may several, as kinds, each ``count[name]`` times:
        that is an :class:`~polycorner.motion.Assembly`.  In a periodic box they touch the nearest
        images of each other; it has to be more than twice as wide as they reach.

        Parameters
        ----------
        gravity : (d,) array, or sequence of sympy.Expr, optional
            Force per mass; default none.  It may depend on :func:`~polycorner.motion.time_symbol`:
            for walls that are shaken together, in their axes, it is ``g - a(t)``.
        density : float, optional
            Mass per area or volume of bodies without a mass of their own.
        masses : mapping from str to Mass or float, optional
            A number is the mass of a uniform body.
        friction : float, (float, float), or mapping from str or (str, str) to these, optional
            Coulomb's coefficient, or a static and a dynamic one; needs ``orientations="all"``.  It
            is for all contacts, or by name: of a contact, ``"A.v1-floor"``, of a pair of what
            touches, ``("A", "floor")`` or ``"A-floor"``, of a wall or fixed body, ``"floor"``, or
            of a body or kind, ``"A"``.  The first of these that is given holds.  Two bodies whose
            own values differ need one for the pair.  Contacts among repeated bodies are also called
            ``"between"``.
        rolling : the same, optional
            Coefficients of rolling resistance: the torque across the normal is at most
            ``mu r N`` for a part rounded by ``r`` at a wall or a fixed body of edges, ``mu N r s /
            (r + s)`` for two rounded parts; none at the sides of polygons and polyhedra.
        restitution : float or mapping from str or (str, str) to float, optional
            As in :class:`~polycorner.System`; names as for ``friction``.
        attraction : Attraction, or mapping from str or (str, str) to Attraction, optional
            At each contact (:class:`~polycorner.motion.Attraction`), or by name as ``friction``;
            default none.  Between repeated bodies its work is ``path.work["attraction"]``;
            elsewhere its energy is part of the ``potential``.
        impact : str, optional
            Law of impact, as in :class:`~polycorner.System`.
        exits : mapping from str to float, optional
            As in :class:`~polycorner.System`.
        count : int, or mapping from str to int, optional
            Default 1; of several kinds for each body.
        joints : mapping from str to Hinge, Slider, ..., optional
            Joints between repeated bodies, or of one with space: the names of bodies are those in
            messages, ``"small 3"``.  Those of the arrangement are here joints of each body of a
            kind with space and fixed bodies, or of bodies of kinds with ``count`` 1.
        drives : mapping from str to Spring, Damper, Motor or Prescribed, optional
            By names of their own.
        forces : mapping from str to sequence of sympy.Expr or float, optional
            For a body the components of a force at its origin, ``d`` of them, or with those of a
            torque 3 in the plane and 6 in space, in the axes of space: functions of coordinates,
            velocities and the time.
        rates : mapping from str to float, optional
            Largest rates of joints of the arrangement by name, in radians or lengths per second:
            limits called ``"joint.rate"``.
        limits, nonholonomic : mapping from str to sympy.Expr, optional
            Limits on velocities, and equations, as in :class:`~polycorner.System`, of the
            coordinates of the arrangement; :meth:`joint_rate` helps.  Not where ``count`` has
            names.

        Notes
        -----
        By the name of a joint ``friction`` is a bound of the force or torque with which it resists
        its motion (or a static and a dynamic one), and ``restitution`` that of its limits.

        Returns
        -------
        System
            Where ``count`` has names, an :class:`~polycorner.motion.Assembly`.

        Raises
        ------
        NotImplementedError
            For images of sharp bodies that are listed, for rolling that is not covered, and for
            attraction between sharp bodies.

        Examples
        --------
        A disc rolls down a slope without slipping, with 2/3 of the acceleration of a sliding one:

        >>> from polycorner import simulate
        >>> from polycorner.bodies import Arrangement, HalfSpace, disc
        >>> slope = {"slope": HalfSpace([0, 1], [0, 0])}
        >>> a = Arrangement({"A": disc(1.0)}, slope, orientations="all")
        >>> rolling = a.system(gravity=[3.0, -10.0], friction=0.5)
        >>> path = simulate(rolling, rolling.state(a.point({"A": [0, 1]})), 1.0, 1e-3)
        >>> path.v[-1].round(6).tolist()
        [[2.0, 0.0, -2.0]]
        """
        options = {name: value for name, value in locals().items() if name != "self"}
        found = system_of(self, Asked(**options))
        object.__setattr__(found, "chart", chart_of(self, options, found))
        return found

    @cached_property
    def symmetry(self) -> Symmetry:
        """Motions of the whole that walls and fixed bodies allow, exchanges of equal bodies.

        Also rotations of a body that carry it to itself, and its shifts by periods, but no mirror
        images and motions that carry one wall to another (:attr:`full_symmetry`).  More than ten
        thousand exchanges, rotations and shifts are left out, all of them.
        """
        return self.congruences.symmetry(self.polyhedron)

    @cached_property
    def full_symmetry(self) -> Symmetry:
        """:attr:`symmetry` and the isometries that carry walls and fixed bodies to each other.

        Among them are mirror images, where every body is equal to its own, and the symmetries of a
        box, walls or periods, whose sides are parallel to the axes.  The same limit holds.
        :func:`~polycorner.prove` needs the motions alone, which both groups have.
        """
        return self.congruences.symmetry(self.polyhedron, full=True)

    @cached_property
    def congruences(self) -> Congruences:
        """What :attr:`symmetry` and :attr:`full_symmetry` are made of."""
        around = tuple(self.walls.values()), tuple(self.fixed.values()), self.lattice
        joined = frozenset(name for joint in self.joints.values() for name in joint.bodies)
        return Congruences(self.placements, *around, joined)

    def point(
        self, placed: Mapping[str, Any] | None = None, joints: Mapping[str, Any] | None = None
    ) -> Array:
        """Return the point of given placements, ``(N,)``.

        Parameters
        ----------
        placed : mapping from str to placement, optional
            For every body its origin ``(d,)``, or a pair of this and an angle in radians (in the
            plane) or a :class:`scipy.spatial.transform.Rotation` (in space).  Bodies that joints
            connect with these, with fixed bodies or with space may be left out.
        joints : mapping from str to float, optional
            Angles and positions of joints by which bodies are placed that were left out; of a
            :class:`Ball` its rotation.  Default 0.

        Notes
        -----
        Where joints do not hold, as in closed loops, the nearest point follows at which they do
        (:meth:`closed`).
        """
        given, values = ({} if known is None else known for known in (placed, joints))
        known = completed(self.mechanism, given, values, self.fixed)
        q = coordinates(known, self.placements)
        if self.mechanism.counters:
            q = self.mechanism.counted(self.manifold, q, followed(self.mechanism, values))
        return self.closed(q) if self.joints else q

    def closed(self, q: ArrayLike) -> Array:
        """Return the nearest point ``(N,)`` at which joints hold, in units of the manifold.

        Limits and contacts do not count.

        Raises
        ------
        ValueError
            Naming the equation that fails most where Newton's method finds no such point.
        """
        return closed(self.polyhedron, self.manifold.point(q))

    def joint_function(self, name: str) -> "sympy.Expr":
        """Return the angle of a joint, in radians up to half a turn, or its position: a formula."""
        return self.mechanism.coordinate(checks.instance("name", name, str), "name").value()

    def joint_rate(self, name: str) -> "sympy.Expr":
        """Return the rate of a joint's angle or position as a formula, in the velocities too."""
        one = self.mechanism.coordinate(checks.instance("name", name, str), "name")
        return rate_of(self.manifold, one.slopes(self.manifold.symbols))

    def joint_values(self, q: ArrayLike) -> dict[str, Array]:
        """Return the angles and positions of all joints that have one, ``(...)`` at ``(..., N)``.

        Angles are within half a turn; ``numpy.unwrap`` follows them along a path.
        """
        return self.mechanism.values(self.manifold, self.manifold.points(q))

    @shown
    def velocity(
        self,
        q: ArrayLike,
        moving: Mapping[str, Any] | None = None,
        joints: Mapping[str, float] | None = None,
    ) -> Array:
        """Return the velocities of the coordinates ``(N,)`` of bodies that move at a point.

        Parameters
        ----------
        q : (N,) array
        moving : mapping from str to velocity, optional
            For bodies that do not rest the velocity of the origin ``(d,)``, or a pair of this and
            the angular velocity in rad/s: counterclockwise, or ``(3,)`` in the axes of space.
        joints : mapping from str to float, optional
            Rates of angles and positions of joints.  Where there are joints, the velocities are the
            nearest ones along all equations, with these rates.
        """
        point = self.manifold.point(q)
        found = rates(point, {} if moving is None else moving, self.placements)
        found = self.mechanism.counted_rates(self.manifold, point, found)
        asked = checks.mapping("joints", {} if joints is None else joints)
        checks.names("joints", asked, self.joints)
        if not self.joints:
            return found
        return moved_along(self.polyhedron, self.mechanism, point, found, asked)

    def placed(self, q: ArrayLike) -> dict[str, Body]:
        """Return the bodies where they are at a point ``(N,)``, fixed ones last.

        Bodies without all coordinates of an orientation are turned by any of those that fit.
        """
        point = self.manifold.point(q)
        moved = {p.name: p.moved(point) for p in self.placements}
        return {**moved, **self.fixed}

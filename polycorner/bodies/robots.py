"""Robots: links that joints hold together in open chains, in the coordinates of the joints."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import mul
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies import link_laws
from polycorner.bodies.chains import Moving, Pose, dot, moved, still
from polycorner.bodies.checking import check_together
from polycorner.bodies.frames import Frame
from polycorner.bodies.laws import Coefficients, Restitution
from polycorner.bodies.link_contacts import CarriedPart, LinkContacts, carried_parts
from polycorner.bodies.link_trees import WORLD, LinkTree
from polycorner.bodies.links import RobotJoint, RobotLink
from polycorner.bodies.masses import Mass, stated_mass
from polycorner.bodies.poses import Placement, coordinates, frame_of
from polycorner.bodies.rigid_motions import number
from polycorner.bodies.shapes import Body, Part
from polycorner.bodies.walls import Wall
from polycorner.checks import refuse
from polycorner.kinds import checked
from polycorner.motion.contacts import velocities
from polycorner.motion.limits import rate_limits
from polycorner.motion.system import System
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

BASES = ("fixed", "floating")
ORIENTATIONS = ("needed", "all")


@dataclass(frozen=True, eq=False)
class Robot(Checked):
    """Links held together by joints in an open chain or tree, and what stands around them.

    Coordinates are the joints, an angle or a length each, by the name of the joint; a joint that
    follows another has none.  Before them are those of the base, if it floats, and after them those
    of bodies that move freely, as in :class:`~polycorner.bodies.Arrangement`.  Contacts are called
    as there; ``elbow lower`` and ``elbow upper`` are limits.  Links that share a joint, or are held
    together by fixed ones, do not touch each other.

    Parameters
    ----------
    links : mapping from str to RobotLink
    joints : mapping from str to RobotJoint
        Each link but one, the base, is the child of one joint.
    base : {"fixed", "floating"}, optional
        Whether the base stands at the origin (default) or moves freely.
    walls : mapping from str to HalfSpace or Cylinder, optional
        The base of a fixed robot does not touch them.
    fixed, bodies : mapping from str to Body, optional
        What stands in space, and what moves freely.
    ignored : sequence of (str, str), optional
        Pairs of links, or of a link and something else, that do not touch each other.
    unit : str, optional
        Unit of length.
    orientations : {"needed", "all"}, optional
        Whether free balls, which look the same when turned, have coordinates of their rotation.

    Examples
    --------
    >>> import numpy as np
    >>> from polycorner.bodies import HalfSpace, Mass, Robot, RobotJoint, RobotLink, capsule
    >>> rod = RobotLink(
    ...     capsule([0, 0, 0], [1, 0, 0], 0.1), Mass(1.0, [0.5, 0, 0], [1e-3, 0.1, 0.1])
    ... )
    >>> arm = Robot(
    ...     {"base": RobotLink(), "upper": rod, "lower": rod},
    ...     {
    ...         "shoulder": RobotJoint("base", "upper", axis=[0, 1, 0], lower=-2, upper=2),
    ...         "elbow": RobotJoint("upper", "lower", origin=[1, 0, 0], axis=[0, 1, 0], upper=2.5),
    ...     },
    ...     walls={"floor": HalfSpace([0, 0, 1], [0, 0, -0.5])},
    ... )
    >>> arm.manifold.names, arm.polyhedron.names
    (('shoulder', 'elbow'),
     ('upper.v1-floor', 'upper.v2-floor', 'lower.v1-floor', 'lower.v2-floor',
      'shoulder lower', 'shoulder upper', 'elbow upper'))
    >>> arm.placed(arm.point({"shoulder": np.pi / 2}))["lower"].markers.round(9)[:, 2].tolist()
    [-1.0, -2.0]
    """

    links: Mapping[str, RobotLink]
    joints: Mapping[str, RobotJoint]
    base: Literal["fixed", "floating"] = "fixed"
    walls: Mapping[str, Wall] = field(default_factory=dict)
    fixed: Mapping[str, Body] = field(default_factory=dict)
    bodies: Mapping[str, Body] = field(default_factory=dict)
    ignored: Sequence[tuple[str, str]] = ()
    unit: str = ""
    orientations: Literal["needed", "all"] = "needed"

    def __post_init__(self) -> None:
        for argument in ("links", "joints", "walls", "fixed", "bodies"):
            object.__setattr__(self, argument, dict(checks.mapping(argument, vars(self)[argument])))
        super().__post_init__()
        checks.choice("base", self.base, BASES)
        checks.choice("orientations", self.orientations, ORIENTATIONS)
        if not self.links:
            refuse("links", "at least one link", self.links)
        named = {"links": RobotLink, "joints": RobotJoint, "fixed": Body, "bodies": Body}
        for argument, kind in named.items():
            for name, value in vars(self)[argument].items():
                checks.instance(f"{argument}: {name}", value, kind)
                if not re.fullmatch(r"[A-Za-z_]\w*", name, re.ASCII):
                    refuse(argument, "names of letters, digits and _", name)
        known = {
            n: link.body or Body({"": Part(np.zeros((1, 3)), 1.0)})
            for n, link in self.links.items()
        }
        check_together({**known, **self.bodies}, dict(self.fixed), dict(self.walls))
        if twice := set(self.links) & set(self.bodies):
            refuse("bodies", "names that no link has", min(twice))
        self._tree.check()
        self._check_names()
        names = {*known, *self.bodies, *self.fixed, *self.walls}
        for pair in self.ignored:
            if len(set(pair)) != 2:
                refuse("ignored", "pairs of two names", pair)
            checks.names("ignored", pair, names)
        object.__setattr__(self, "ignored", tuple(map(tuple, self.ignored)))

    def _check_names(self) -> None:
        """Raise for joints called like something else that has coordinates or coefficients."""
        kinds = {**self._tree.loose, **({self.root: Frame.ROTATED} if self._tree.floats else {})}
        own = {x for name, kind in kinds.items() for x in kind.variables(name, 3)}
        if twice := {*self.joints} & {*self.bodies, *self.fixed, *self.walls, *own}:
            expected = "names that no body, wall, or coordinate of a body has"
            refuse("joints", expected, min(twice))

    @checked
    def among(
        self,
        *,
        walls: Mapping[str, Wall] | None = None,
        fixed: Mapping[str, Body] | None = None,
        bodies: Mapping[str, Body] | None = None,
        ignored: Sequence[tuple[str, str]] = (),
        orientations: Literal["needed", "all"] | None = None,
    ) -> "Robot":
        """Return the robot with more around it, and more pairs that do not touch.

        Free bodies are in one polyhedron and one system with it.  What has a name that is taken
        replaces the other; ``orientations`` replaces those of the robot, if it is given.
        """
        return replace(
            self,
            walls={**self.walls, **checks.mapping("walls", {} if walls is None else walls)},
            fixed={**self.fixed, **checks.mapping("fixed", {} if fixed is None else fixed)},
            bodies={**self.bodies, **checks.mapping("bodies", {} if bodies is None else bodies)},
            ignored=(*self.ignored, *ignored),
            orientations=self.orientations if orientations is None else orientations,
        )

    @cached_property
    def _tree(self) -> LinkTree:
        loose = {name: self._frame(body) for name, body in self.bodies.items()}
        return LinkTree(tuple(self.links), self.joints, self.base == "floating", loose)

    @property
    def root(self) -> str:
        """The base link."""
        return self._tree.root

    @cached_property
    def _carried(self) -> list[CarriedPart]:
        """All parts in the axes of their carriers."""
        found: list[CarriedPart] = []
        for name, link in self.links.items():
            carrier, matrix, origin = self._tree.rests[name]
            if link.body is not None:
                found += carried_parts(
                    name, link.body.carried(origin, matrix), carrier, is_linked=True
                )
        for name, body in self.fixed.items():
            found += carried_parts(name, body, WORLD, is_linked=False)
        for name, body in self.bodies.items():
            found += carried_parts(name, body, name, is_linked=False)
        return found

    def _frame(self, body: Body) -> Frame:
        """Return the coordinates of a free body; a ball about its origin need not turn."""
        kind = frame_of(body, self.orientations)
        return Frame.ROTATED if kind is Frame.AXIAL else kind

    def __repr__(self) -> str:
        """Return how many links there are, and the joints that are coordinates."""
        return f"Robot({len(self.links)} links, joints {', '.join(self._tree.free)})"

    @property
    def dimension(self) -> int:
        """The dimension of space, 3."""
        return 3

    @cached_property
    def scale(self) -> float:
        """The displacement that counts as a unit: half the thickness of the thinnest part."""
        return min((part.part.thickness for part in self._carried), default=1.0)

    @cached_property
    def _placements(self) -> tuple[Placement, ...]:
        """The coordinates of the base, if it floats, and of free bodies."""
        found: list[Placement] = []
        start = 0
        whole = {self.root: None} if self.base == "floating" else {}
        for name, body in [*whole.items(), *self.bodies.items()]:
            kind = Frame.ROTATED if body is None else self._frame(body)
            sized = Body({"": Part(np.zeros((1, 3)), 1.0)}) if body is None else body
            turn = self.scale / max(sized.size, self.scale)
            factor = kind.manifold(name, 3, self.scale, turn, self.unit)
            start += len(self._tree.free) if body is not None and len(found) == len(whole) else 0
            found.append(Placement(name, sized, kind, factor, slice(start, start + factor.size)))
            start += factor.size
        return tuple(found)

    @cached_property
    def manifold(self) -> Manifold:
        """The placements of all links and bodies."""
        joints = []
        for name in self._tree.free:
            joint = self.joints[name]
            if joint.kind == "prismatic":
                joints.append(Manifold((name,), (math.inf,), (self.scale,), (self.unit,)))
            else:
                period = math.tau if joint.kind == "continuous" else math.inf
                turn = self.scale / max(self._reach(joint.child), self.scale)
                joints.append(Manifold((name,), (period,), (turn,), ("rad",)))
        own = [p.manifold for p in self._placements]
        floats = int(self.base == "floating")
        factors = [*own[:floats], *joints, *own[floats:]]
        if not factors:
            refuse("joints", "a joint that moves", [*self.joints])
        return reduce(mul, factors)

    def _reach(self, link: str) -> float:
        """Return how far the parts beyond a joint reach from it, at most."""
        own = self.links[link].body
        below = [
            float(np.linalg.norm(joint.origin)) + self._reach(joint.child)
            for joint in self.joints.values()
            if joint.parent == link
        ]
        return max([0.0 if own is None else own.size, *below])

    @cached_property
    def home(self) -> Array:
        """All joints at zero, or at the limit next to it, and free bodies at the origin."""
        return self.point({})

    def _joined(self, placed: Mapping[str, Any], angles: Mapping[str, float]) -> Array:
        """Return a point of placements of free bodies and values of joints."""
        values: dict[str, float] = {}
        for p in self._placements:
            own = coordinates({p.name: placed.get(p.name, np.zeros(3))}, [p])
            values |= dict(zip(p.manifold.names, own.tolist(), strict=True))
        for name in self._tree.free:
            joint = self.joints[name]
            values[name] = angles.get(name, min(max(0.0, joint.lower), joint.upper))
        return np.array([values[name] for name in self.manifold.names])

    @checked
    def point(self, placed: Mapping[str, Any]) -> Array:
        """Return the point of given angles, lengths and placements, ``(N,)``.

        Parameters
        ----------
        placed : mapping from str to float or placement
            Values of joints; the others are zero, or at the limit next to it.  Of free bodies, and
            the base if it floats, as for :meth:`Arrangement.point`; by default at the origin.
        """
        free = [p.name for p in self._placements]
        checks.names("placed", placed, [*self._tree.free, *free])
        angles = {n: checks.real("placed", x) for n, x in placed.items() if n not in free}
        return self._joined({n: x for n, x in placed.items() if n in free}, angles)

    def _poses(self, q: ArrayLike) -> dict[str, Pose]:
        """Return where the carriers are."""
        point = self.manifold.point(q).tolist()
        return self._tree.poses(dict(zip(self.manifold.names, point, strict=True)))

    def pose(self, q: ArrayLike, link: str) -> Pose:
        """Return matrix ``(3, 3)`` and origin ``(3,)`` of a link or free body at a point."""
        checks.names("link", [link], {**self.links, **self.bodies})
        carrier, matrix, origin = self._tree.rests.get(link, (link, np.eye(3), np.zeros(3)))
        turned, at = self._poses(q)[carrier]
        return turned @ matrix, at + turned @ origin

    def placed(self, q: ArrayLike) -> dict[str, Body]:
        """Return the links that have bodies, free and fixed bodies where they are at a point."""
        found = {name: link.body for name, link in self.links.items() if link.body is not None}
        found |= self.bodies
        moved = {name: body.carried(*self.pose(q, name)[::-1]) for name, body in found.items()}
        return {**moved, **self.fixed}

    # ---------------------------------------------------------------------------------- contacts

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """``D``, the placements without overlap and within the limits."""
        return Polyhedron(self.manifold, AllOf(*self._contacts.gaps(excluded=True)))

    @cached_property
    def _contacts(self) -> LinkContacts:
        parts, ignored = tuple(self._carried), frozenset(map(frozenset, self.ignored))
        return LinkContacts(self.manifold, self._tree, parts, self.walls, ignored)

    @checked
    def overlapping(self, q: ArrayLike) -> list[tuple[str, str]]:
        """Return the pairs of links, free and fixed bodies that overlap or touch at a point.

        After these the links and free bodies that are beyond walls, with them: what stands on a
        wall is where it is meant to be.
        """
        return self._contacts.overlapping(self.manifold.point(q), self._poses(q))

    # ------------------------------------------------------------------------------------ motion

    def system(  # noqa: PLR0913 - all are options
        self,
        *,
        gravity: ArrayLike | None = None,
        density: float = 1.0,
        masses: Mapping[str, Any] | None = None,
        torques: "Mapping[str, sympy.Expr] | None" = None,
        motions: "Mapping[str, sympy.Expr] | None" = None,
        friction: Coefficients = 0.0,
        rolling: Coefficients = 0.0,
        restitution: Restitution = 0.0,
        impact: str = "poisson",
        rates: Mapping[str, float] | None = None,
        limits: "Mapping[str, sympy.Expr] | None" = None,
        nonholonomic: "Mapping[str, sympy.Expr] | None" = None,
    ) -> System:
        """Return the mechanical system of links and bodies.

        Joints have the damping and friction of their own.

        Parameters
        ----------
        gravity : (3,) array, optional
            Force per mass; default none.
        density : float, optional
            Of free bodies without a mass of their own.
        masses : mapping from str to Mass or float, optional
            Of free bodies; a number is the mass of a uniform body.
        torques : mapping from str to sympy.Expr, optional
            Torque or force of drives by joint, functions of coordinates, velocities and the time
            (:func:`~polycorner.motion.time_symbol`).  Beyond the effort of the joint it is cut off.
        motions : mapping from str to sympy.Expr, optional
            Angles or lengths of joints that are followed exactly, by a force of any size: functions
            of the time, as :class:`Prescribed` without a limit.  Angles of continuous joints count
            modulo a turn.  A state has to be on them and to move along.
        friction, rolling, restitution : optional
            Coefficients at all contacts, or by name, as in :meth:`Arrangement.system`: of a
            contact, ``"finger.v1-floor"``, of two things that touch, ``("finger", "ball")`` or
            ``"finger-ball"``, of a wall or fixed body, or of a link or body.  Friction of balls
            needs ``orientations="all"``.  By the name of a joint ``restitution`` is that of its
            limits; the friction of joints is their own.
        impact : str, optional
            As in :class:`~polycorner.System`.
        rates : mapping from str to float, optional
            Largest rates of joints by name, in radians or lengths per second: limits called
            ``"joint.rate"``.
        limits, nonholonomic : mapping from str to sympy.Expr, optional
            Limits on velocities, and equations, as in :class:`~polycorner.System`.

        Raises
        ------
        ValueError
            Also for a joint that moves nothing that has mass.
        NotImplementedError
            For two sharp polyhedra that can touch.
        """
        import sympy

        pull = checks.reals("gravity", [0, 0, 0] if gravity is None else gravity)
        if pull.shape != (3,) or not np.isfinite(pull).all():
            refuse("gravity", "3 finite numbers", gravity)
        checks.real("density", density, above=0)
        given = checks.mapping("masses", {} if masses is None else masses)
        if own := sorted(set(given) & set(self.links)):
            refuse("masses", "names of free bodies, as links have masses of their own", own[0])
        checks.names("masses", given, self.bodies)
        kinetic = potential = sympy.S.Zero
        inertias = self._inertias(given, density)
        for carrier, (_, step) in self._tree.steps.items():
            motion, mass = self._motions[carrier], inertias[carrier]
            if mass is not None:
                kinetic += link_laws.kinetic(motion, mass)
                weights = [number(-mass.mass * g) for g in pull.tolist()]
                potential += dot(weights, motion.point(mass.centre))
            if step.kind == "free":
                beyond = [m for c, m in inertias.items() if m and carrier in self._tree.path(c)]
                kinetic += link_laws.along_norm(step, beyond, self._rates)
        polyhedron = Polyhedron(self.manifold, AllOf(*self._contacts.gaps(excluded=False)))
        if polyhedron.is_union:
            msg = (
                "links: expected rounded links (radius > 0) for motion; two sharp polygons or "
                "polyhedra are apart in one of several ways, of which a robot chooses none"
            )
            raise NotImplementedError(msg)
        given = checks.mapping("torques", {} if torques is None else torques)
        checks.names("torques", given, self._tree.free)
        driven = link_laws.forces(self.joints, self.manifold.symbols, self._rates, given)
        rubbing, bounces = self._contacts.laws(friction, rolling, restitution)
        laws = (*link_laws.joint_friction(self.joints, self._rates), *rubbing)
        bounds = checks.mapping("rates", {} if rates is None else rates)
        moving = {name: self._rates[name] for name in self._tree.free}
        further = checks.mapping("limits", {} if limits is None else limits)
        return System(
            polyhedron,
            kinetic,
            potential,
            driven,
            laws,
            restitution=bounces,
            impact=impact,
            rheonomic=link_laws.followed(self.joints, self._tree.free, motions),
            limits={**rate_limits(moving, bounds), **further},
            nonholonomic={} if nonholonomic is None else nonholonomic,
        )

    @cached_property
    def _rates(self) -> "dict[str, sympy.Symbol]":
        return dict(zip(self.manifold.names, velocities(self.manifold), strict=True))

    @cached_property
    def _motions(self) -> dict[str, Moving]:
        """The motion of each carrier, as formulas."""
        found = {WORLD: still()}
        for carrier, (before, step) in self._tree.steps.items():
            found[carrier] = moved(found[before], step, self._rates)
        return found

    def _inertias(self, given: Mapping[str, Mass], density: float) -> dict[str, Mass | None]:
        """Return the mass that each carrier carries, in its axes."""
        several: dict[str, list[Mass]] = {carrier: [] for carrier in (WORLD, *self._tree.steps)}
        for name, link in self.links.items():
            carrier, matrix, origin = self._tree.rests[name]
            if link.mass is not None:
                inertia = matrix @ link.mass.inertia @ matrix.T
                centre = origin + matrix @ link.mass.centre
                several[carrier].append(Mass(link.mass.mass, centre, inertia))
        for name, body in self.bodies.items():
            several[name].append(stated_mass(name, body, given, density))
        for carrier in self._tree.steps:
            if not any(several[c] for c in several if carrier in self._tree.path(c)):
                refuse("links", f"a mass of {carrier!r}, or beyond it", "none")
        return {c: link_laws.joined(masses) if masses else None for c, masses in several.items()}

"""Mechanical systems written in SymPy: energies, contacts, joints, friction, several bodies."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.checks import choice, names, real, reals, refuse, whole
from polycorner.formulas.bundles import Call
from polycorner.formulas.expressions import as_expression, as_expressions, written
from polycorner.formulas.families import Family
from polycorner.kinds import check_fields, checked
from polycorner.motion.bodies import (
    IMPACT_LAWS,
    BodyLimits,
    FrictionContact,
    IdenticalBodies,
    MovingBody,
)
from polycorner.motion.contacts import (
    ContactFamily,
    Friction,
    periods_of,
    position_of,
    slip_text,
    time_symbol,
)
from polycorner.motion.convex_sets import in_words
from polycorner.motion.formulation import (
    TIME,
    Formulation,
    Laws,
    energies,
    highest_damping,
    highest_square,
)
from polycorner.motion.hulls.contacts import HullContacts, beside
from polycorner.motion.limits import check_limited, compiled_limits, described_limits
from polycorner.motion.mechanics import MechanicalSystem, State
from polycorner.motion.noise import OPTIONS
from polycorner.motion.placements import (
    bends,
    check_contacts,
    check_equations,
    check_followed,
    check_ties,
    check_velocities,
    gap_unit,
)
from polycorner.motion.scenes import Scene, overlapping
from polycorner.motion.stiffness import PlacedKind, tied_square
from polycorner.motion.tie_forms import Ties
from polycorner.motion.ties import Tie, compiled_ties, described_tie, followers
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.printing import Printed, Sheet, brief, facts, few, listed, number
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import cached_property

if TYPE_CHECKING:
    import sympy

MOST_TERMS = 50  # of an energy that is written out


@dataclass(frozen=True, eq=False)
class System(MechanicalSystem, Printed):
    """One body, or several identical ones, with unilateral contacts and friction.

    Parameters
    ----------
    polyhedron : Polyhedron
        The placements of a body without overlap: an intersection of ``f_i(q) >= 0``, the gaps of
        its contacts with the surroundings, and of ``h_j(q) = 0``, its joints and rails.  Forces
        of equations have either sign; that of ``h`` acts along its gradient.
    kinetic : sympy.Expr
        ``T(q, v)`` of a body, quadratic in the :func:`velocities` (:func:`rotational_energy`).
    potential : sympy.Expr, optional
        ``V(q)``; default 0.
    forces : mapping from str to sympy.Expr, optional
        Further generalised forces by coordinate, functions of coordinates, velocities and the
        time (:func:`time_symbol`).
    friction : sequence of Friction, optional
        Friction with the surroundings.
    restitution : float or mapping from str to float, optional
        Coefficient ``0 <= e <= 1``, for all contacts or by name; default 0, plastic.
    impact : str, optional
        What it is the ratio of.  ``"poisson"`` (default): of the impulses of expansion and
        compression; several contacts go through both phases together ([GlockerPfeiffer]).
        ``"newton"``: of normal velocities, ``J_i v+ >= -e_i J_i v-`` with an impulse only where
        equality holds ([Moreau]).  With either nothing gains energy: the expansion stops short of
        that.  ``"stronge"``: its square is that of the work of the normal force, for one contact in
        the plane ([Stronge]); other impacts are Poisson's.  ``"newton unlimited"``: as published,
        with the energy that friction can make it gain.  Without friction these differ only where
        contacts of different coefficients are struck at once.
    count : int, optional
        Number of bodies; default 1.
    between : ContactFamily, optional
        Contacts between any two of the bodies; default none: they pass through each other.
    substrate : mapping from str to float, optional
        The coordinate along which the substrate moves, and its velocity; default at rest.  Bodies
        at rest on it move with it.  The slip of :class:`Friction` has to be relative to it.
    exits : mapping from str to float, optional
        A coordinate and its limit: a body that passes it leaves the system for good.
    scene : Scene, optional
        Names of the bodies in space, and where they touch; of systems of an arrangement.
    hulls : sequence of HullContacts, optional
        Contacts of sharp hulls, of a body with its surroundings or of two that the system is of.
    rheonomic : mapping from str to sympy.Expr, optional
        Further equations ``h(q, t) = 0``, functions of coordinates and of the time
        (:func:`time_symbol`), as of a prescribed motion.  Their forces have no limit, and are along
        the gradient by the coordinates; their work is ``Trajectory.work["drive"]``.
    ties : sequence of Tie, optional
        Joints, limits, springs and drives between two of the bodies, or of one and the world.
    limits : mapping from str to sympy.Expr, optional
        Limits on velocities ``f(q, v, t) >= 0`` of each body, functions of coordinates,
        :func:`velocities` and the time that are affine or concave in the velocities.  The force is
        ``p df/dv`` with ``p >= 0``, and acts where ``f = 0``; a velocity beyond a limit, as where
        this falls by a step, jumps onto it by a plastic impact.  Their work is
        ``Trajectory.work`` by their names.
    nonholonomic : mapping from str to sympy.Expr, optional
        Equations ``f(q, v, t) = 0``, affine in the velocities, such as that of a skate; the force
        ``p df/dv`` has either sign.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron, velocities
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> vx, vy = velocities(M)
    >>> ball = System(Polyhedron(M, {"floor": y}), (vx**2 + vy**2) / 2, 9.81 * y, restitution=0.5)
    >>> ball.state([0.0, 1.0], [1.0, 0.0]).v.tolist()
    [1.0, 0.0]

    A bead on a wire, an equation; the force is that of the wire, along its gradient:

    >>> import sympy
    >>> from polycorner.motion import simulate
    >>> wire = Polyhedron(M, {"wall": 1 - x}, equations={"wire": y - x**2})
    >>> bead = System(wire, (vx**2 + vy**2) / 2, 9.81 * y)
    >>> path = simulate(bead, bead.state([0.0, 0.0], [2.0, 0.0]), 0.001, 0.001)
    >>> [(name, round(force, 1)) for _, name, force in path.touching[-1]]  # m (g + v^2 y'')
    [('wire', 17.8)]
    """

    polyhedron: Polyhedron
    kinetic: "sympy.Expr"
    potential: "sympy.Expr | float" = 0
    forces: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    friction: tuple[Friction, ...] = ()
    restitution: float | Mapping[str, float] = 0.0
    count: int = 1
    between: ContactFamily | HullContacts | None = None
    substrate: Mapping[str, float] = field(default_factory=dict)
    exits: Mapping[str, float] = field(default_factory=dict)
    scene: Scene | None = None
    hulls: tuple[HullContacts, ...] = ()
    rheonomic: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    ties: tuple[Tie, ...] = ()
    impact: str = IMPACT_LAWS[0]
    limits: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    nonholonomic: "Mapping[str, sympy.Expr]" = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return the bodies, and the numbers of coordinates, contacts and laws of friction."""
        called = "" if self.scene is None else f" {few(self.scene.names)}"
        several = (
            (max(self.count, len(self.bodies.names)), "body", "bodies", called),
            (self.manifold.size, "coordinate", "coordinates", " each" * (self.count > 1)),
            (len(self._normals), "contact", "contacts", ""),
            (len(self.bodies.rubbing), "law of friction", "laws of friction", ""),
        )
        told = (f"{n} {one if n == 1 else many}{more}" for n, one, many, more in several)
        return f"System({'; '.join(told)})"

    def _sheet(self) -> Sheet:
        names = self.bodies.names
        about = [
            ("bodies", f"{max(self.count, len(names))}{': ' * bool(names)}{few(names)}"),
            ("coordinates", f"{few(self.manifold.names)}{' each' * (self.count > 1)}"),
            ("kinetic energy", _short(self.kinetic)),
            ("potential energy", _short(self.potential)),
            ("forces on", few(self.forces)),
            ("substrate", few(f"{name} at {x:g}" for name, x in self.substrate.items())),
            ("exits", few(f"{name} > {x:g}" for name, x in self.exits.items())),
            ("law of impact", self.impact if self.bodies.bounces else ""),
            ("limits on velocities", few(self.limits)),
            ("nonholonomic equations", few(self.nonholonomic)),
        ]
        pairs = self.bodies.contacts if self.count > 1 else None
        contacts = listed(
            "Contacts",
            ("contact", "friction", "restitution"),
            chain(self._contact_rows(), () if pairs is None else pairs.rows()),
            len(self._normals) + (0 if pairs is None else len(pairs.gaps.names)),
        )
        return Sheet("System", (facts((what, told) for what, told in about if told), contacts))

    def _contact_rows(self) -> Iterator[tuple[str, str, str]]:
        laws: dict[str, list[Friction]] = {}
        for f in self.friction:
            laws.setdefault(str(f.load), []).append(f)
        bounces = [number(e, 6) for e in self.restitutions.tolist()]
        bounces += ["an equation"] * (len(self._normals) - len(self.contacts))
        for name, e in zip(self._normals, bounces, strict=True):
            own = [(f.kind, f.static, f.moving) for f in laws.get(name, ())]
            yield name, in_words(own), e

    def __post_init__(self) -> None:
        object.__setattr__(self, "kinetic", as_expression("kinetic", self.kinetic))
        object.__setattr__(self, "potential", as_expression("potential", self.potential))
        for argument in ("forces", "rheonomic", "limits", "nonholonomic"):
            given = as_expressions(argument, getattr(self, argument))
            object.__setattr__(self, argument, given)
        check_fields(self)
        if self.polyhedron.is_union:
            expected = "an intersection of inequalities and equations, such as a convex piece"
            refuse("polyhedron", expected, self.polyhedron)
        object.__setattr__(self, "friction", tuple(self.friction))
        for friction in self.friction:
            if isinstance(friction.load, str) and friction.load not in self._normals:
                known = f"one of the contacts {', '.join(self._normals)} or an expression"
                refuse("load", f"{known} for friction {friction.name!r}", friction.load)
        for name, e in self.rheonomic.items():
            if name in (*self.contacts, *self.polyhedron.equation_names):
                refuse("rheonomic", "names of their own", name)
            if e.free_symbols - {*self.manifold.symbols, time_symbol()} or not e.free_symbols & {
                *self.manifold.symbols
            }:
                refuse("rheonomic", f"a formula in coordinates and the time for {name!r}", e)
        whole("count", self.count, least=1)
        choice("impact", self.impact, IMPACT_LAWS)
        if self.between is not None:
            names("position", self.between.position, self.manifold.names)
            if len(self.between.position) > 3:
                refuse("position", "up to three coordinates", self.between.position)
        self._check_single("substrate")
        self._check_single("exits")
        self._check_ties()
        _ = self.restitutions, self.formulation, self.velocity_limits, self.bodies
        super().__post_init__()

    def _check_ties(self) -> None:
        object.__setattr__(self, "ties", tuple(self.ties))
        if self.ties and self.exits:
            refuse("exits", "none in a system whose bodies have ties", dict(self.exits))

    def _check_single(self, argument: str) -> None:
        given = getattr(self, argument)
        names(argument, given, self.manifold.names)
        if len(given) > 1:
            refuse(argument, "one coordinate", sorted(given))
        object.__setattr__(self, argument, {n: real(argument, x) for n, x in given.items()})

    @property
    def manifold(self) -> Manifold:
        """The configuration manifold of a body."""
        return self.polyhedron.manifold

    @property
    def hidden(self) -> frozenset[str]:
        """Names of the equations of unit vectors and quaternions."""
        return self.polyhedron.hidden

    @cached_property
    def contacts(self) -> tuple[str, ...]:
        """Names of the unilateral contacts of a body with its surroundings."""
        further = (name for hulls in self.hulls for name in hulls.names)
        return (*(f.name for f in self.polyhedron.functions), *further)

    @property
    def _normals(self) -> tuple[str, ...]:
        """Names of all normal forces: of contacts, then of equations."""
        return (*self.contacts, *self.polyhedron.equation_names, *self.rheonomic)

    @property
    def _pressing(self) -> set[str]:
        """Names of the contacts and equations whose force is the load of friction."""
        return {f.load for f in self.friction if isinstance(f.load, str)}

    @cached_property
    def followed(self) -> Family:
        """The equations with the time, functions of the coordinates and of it."""
        return Family.of(self.rheonomic, (*self.manifold.names, TIME))

    @cached_property
    def velocity_limits(self) -> BodyLimits | None:
        """The compiled limits on velocities, then the nonholonomic equations; None without any."""
        called = (*self._normals, *(f.name for f in self.friction))
        return compiled_limits(self.manifold, self.limits, self.nonholonomic, called)

    @cached_property
    def restitutions(self) -> Array:
        """Coefficient of restitution of each contact, ``(m,)``."""
        given = self.restitution
        by_name = given if isinstance(given, Mapping) else dict.fromkeys(self.contacts, given)
        names("restitution", by_name, self.contacts)
        every = [by_name.get(name, 0.0) for name in self.contacts]
        return np.array([real("restitution", e, least=0, most=1) for e in every], dtype=np.float64)

    @cached_property
    def _loads(self) -> "tuple[sympy.Expr, ...]":
        """The different known loads."""
        every = [e for f in self.friction if not isinstance(f.load, str) for e in f.load]
        return tuple(dict.fromkeys(every))

    @cached_property
    def load_sources(self) -> tuple[tuple[int, ...], ...]:
        """For each friction contact the known loads that press on it, by number."""
        return tuple(
            () if isinstance(f.load, str) else tuple(self._loads.index(e) for e in f.load)
            for f in self.friction
        )

    @cached_property
    def owners(self) -> tuple[int, ...]:
        """For each friction contact the contact, or else equation, that presses on it, or -1."""
        return tuple(
            self._normals.index(f.load) if isinstance(f.load, str) else -1 for f in self.friction
        )

    @cached_property
    def formulation(self) -> Formulation:
        """The compiled equations of motion of a body."""
        slips = tuple(e for f in self.friction for e in f.slip)
        laws = Laws(self.kinetic, self.potential, self.forces, slips, self._loads)
        return Formulation.of(self.manifold.names, (), laws, timed=bool(self.rheonomic))

    @cached_property
    def parameters(self) -> Array:
        """Values of the parameters of the laws: a place for the time, if they depend on it."""
        return np.zeros(len(self.formulation.parameters))

    @cached_property
    def bodies(self) -> IdenticalBodies:
        """The bodies and their contacts, for the engine."""
        if self.rheonomic and not self.exits and self.rheonomic.keys().isdisjoint(self._pressing):
            # Ties are solved in fewer steps; they press on no friction of a body, and none leaves.
            every = *self.ties, *followers(self.rheonomic, range(self.count))
            return replace(self, rheonomic={}, ties=every).bodies
        friction = tuple(
            FrictionContact(f.name, len(f.slip), f.static, f.moving, gap, loads, f.kind)
            for f, gap, loads in zip(self.friction, self.owners, self.load_sources, strict=True)
        )
        scales, coordinates = self.manifold.scale_array, self.manifold.names
        gaps, rubbing, slips = self._of_hulls
        equations = len(self._normals) - len(self.contacts)
        if timed := len(self.rheonomic):
            reads, last = range(len(coordinates) + 1), range(len(self._normals))[-timed:]
            call = Call(self.followed, (*reads,), np.empty(0), (*last,), (*range(timed),))
            gaps = [*gaps, call]
        formulation = replace(self.formulation, further=slips) if slips else self.formulation
        body = MovingBody(
            formulation,
            self.parameters,
            friction + rubbing,
            gaps,
            self._normals,
            np.append(self.restitutions, np.zeros(equations)),
            1 / scales,
            gap_unit(self.manifold),
            equations,
            np.empty(0) if self.scene is None else self.scene.lever,
            limits=self.velocity_limits,
        )
        between = self.between if self.count > 1 else None
        given = () if self.between is None else self.between.position
        position = position_of(self.manifold, given, self.substrate, several=between is not None)
        contacts = None if between is None else between.compiled(self.manifold)
        speed = sum(v / scales[coordinates.index(x)] for x, v in self.substrate.items())
        leaving = [(coordinates.index(x), limit) for x, limit in self.exits.items()]
        exit_at, limit = leaving[0] if leaving else (-1, 0.0)
        told = contacts, position, periods_of(self.manifold, position), float(speed)
        names = () if self.scene is None else self.scene.names
        ties = compiled_ties(self.ties, [(self.manifold, self.count)], names)
        return IdenticalBodies(
            body, self.count, *told, exit_at, float(limit), names, ties, self.impact
        )

    @cached_property
    def _of_hulls(self) -> tuple[list[Call], tuple[FrictionContact, ...], list[Call]]:
        """All gaps, those of hulls before equations; friction of hulls, and its slips."""
        first, names = len(self.polyhedron.functions), self.manifold.names
        more, row = len(self.contacts) - first, sum(len(f.slip) for f in self.friction)
        gaps = [
            replace(call, rows=tuple(r + more if r >= first else r for r in call.rows))
            for call in self.polyhedron.bundle.calls
        ]
        further, rubbing, slips = beside(self.hulls, names, first, row)
        return gaps + further, rubbing, slips

    # -------------------------------------------------------------------------------------- states

    @shown
    def state(
        self, q: ArrayLike | Mapping[str, float], v: ArrayLike | None = None, time: float = 0.0
    ) -> State:
        """Return a state, after checking that nothing overlaps and that equations hold.

        A friction contact sticks where its slip is exactly zero.

        Parameters
        ----------
        q : (n,) or (count, n) array, or mapping from str to float
            Placement of the body, or of all bodies.
        v : array of the same shape, optional
            Velocities, along all equations, and with those that have the time; default those of the
            substrate.
        time : float, optional
        """
        if self.count == 1 and (isinstance(q, Mapping) or reals("q", q).ndim < 2):
            places = self.manifold.point(q).copy()
        else:
            # `points` refuses a mapping, which only one body may have.
            places = self.manifold.placed(self.manifold.points(q).copy())  # type: ignore[arg-type]
        speeds = np.zeros(places.shape)
        for name, speed in self.substrate.items():
            speeds[..., self.manifold.names.index(name)] = speed
        if v is not None:
            speeds = self.manifold.points(v, "v").copy()
        for argument, array in (("q", places), ("v", speeds)):
            shape = places.shape if self.count == 1 else (self.count, self.manifold.size)
            if array.shape != shape or array.size != self.count * self.manifold.size:
                refuse(argument, f"shape ({self.count}, {self.manifold.size})", array.shape)
        self.check_placement(places)
        check_velocities(self.polyhedron, places, speeds, self.bodies.called)
        time, shape = real("time", time, unit="s"), (self.count, self.manifold.size)
        if self.rheonomic:
            scales = self.manifold.scale_array
            check_followed(self.followed, scales, places, speeds, time, self.bodies.called)
        known = self.velocity_limits, self.manifold.scale_array
        check_limited(*known, places, speeds, time, self.bodies.called)
        check_ties(self.bodies, places.reshape(shape), speeds.reshape(shape), time)
        return State(time, places, speeds, self.sticks(places, speeds, time))

    @checked
    def check_placement(self, q: Array) -> None:
        """Raise ValueError if a contact overlaps or an equation fails, naming the worst."""
        check_contacts(self.polyhedron, q, self._who)
        check_equations(self.polyhedron, q, self.bodies.called)
        self._check_hulls(q)
        self.bodies.check_apart(q.reshape(self.count, -1))
        self.bodies.check_crossed(q.reshape(self.count, -1), self.scene)

    def _who(self, contact: str, i: int) -> str:
        """Return what overlaps at a contact with the surroundings, for a message."""
        called = self.bodies.called(i) if self.count > 1 else ""
        return overlapping(self.scene, called, contact, i)

    def _check_hulls(self, q: Array) -> None:
        deep = -OPTIONS.overlap * gap_unit(self.manifold)
        for hulls in self.hulls:
            gaps = hulls.values(self.manifold.names, q.reshape(-1, self.manifold.size))
            i, g = np.unravel_index(int(gaps.argmin()), gaps.shape)
            if (least := gaps[i, g]) < deep:
                name = hulls.names[g]
                who = self._who(name, int(i))
                at = "" if repr(name) in who else f" at contact {name!r}"
                msg = f"q: expected a placement without overlap; {who} by {-least:.6g}{at}"
                raise ValueError(msg)

    def sticks(self, q: Array, v: Array, time: float = 0.0) -> NDArray[np.bool_]:
        """Return for each friction contact whether its slip is zero, ``(..., F)``.

        At contacts of hulls, whether nothing moves.
        """
        further = len(self._of_hulls[1])
        shape, n = q.shape[:-1], q.shape[-1]
        still = np.asarray(~np.any(v, axis=-1))[..., None]
        found = [np.broadcast_to(still, (*shape, further))]
        if self.friction:
            at = np.concatenate([q, v], axis=-1).reshape(-1, 2 * n)
            parameters = self.formulation.at(self.parameters, time)
            slips, _ = self.formulation.slip_velocities(parameters, at)
            starts = np.cumsum([0, *(len(f.slip) for f in self.friction)]).tolist()
            rests = np.stack([~slips[:, a:b].any(axis=1) for a, b in pairwise(starts)], axis=-1)
            found.insert(0, rests.reshape(*shape, len(self.friction)))
        return np.concatenate(found, axis=-1)

    @checked
    def energies(self, state: State) -> tuple[float, float]:
        """Return kinetic and potential energy of all bodies and ties."""
        n = self.manifold.size
        each = [
            energies(self.formulation, self.parameters, q, v)
            for q, v in zip(state.q.reshape(-1, n), state.v.reshape(-1, n), strict=True)
        ]
        kinetic, potential = np.sum(each, axis=0)
        tied = self.bodies.ties.energy(state.q.reshape(-1, n))
        return float(kinetic), float(potential) + tied

    @checked
    def largest_step(self, state: State) -> tuple[float, str]:
        """Return ``2 / omega`` with the highest frequency of small motions: the leapfrog limit.

        Where forces damp motions at the rate ``c``, at most ``1.5 / c``, which the iterations for
        the velocity in the middle of a step resolve.
        """
        n = self.manifold.size
        placed = self, state.q.reshape(-1, n), state.v.reshape(-1, n)
        return leapfrog_limit([placed], self.bodies.ties, state.time)

    def described(self) -> dict[str, Any]:
        """Return everything that a motion depends on, by name, as plain values."""
        manifold, between = self.manifold, self.between
        told: dict[str, Any] = {
            "coordinates": [*manifold.names],
            "periods": [str(period) for period in manifold.periods],
            "scales": [*manifold.scales],
            "kinetic": written(self.kinetic),
            "potential": written(self.potential),
            "count": self.count,
            "restitution": dict(zip(self.contacts, self.restitutions.tolist(), strict=True)),
            "impact": self.impact,
            "substrate": dict(self.substrate),
            "exits": dict(self.exits),
            "formulas": self.bodies.formula_keys,
        }
        told |= {f"force {name}": written(force) for name, force in self.forces.items()}
        told |= {f"gap {f.name}": written(f.expression) for f in self.polyhedron.functions}
        told |= {f"equation {h.name}": written(h.expression) for h in self.polyhedron.equations}
        told |= {f"equation {name}": written(h) for name, h in self.rheonomic.items()}
        told |= {
            f"friction {f.name}": {
                "slip": [*map(slip_text, f.slip)],
                "load": str(f.load),
                **f.told(),
            }
            for f in self.friction
        }
        told |= dict(described_limits(self.limits, self.nonholonomic, written))
        if between is not None:
            told |= between.described()
        if self.hulls:
            told["hulls"] = [hulls.described() for hulls in self.hulls]
        if self.ties:
            told["ties"] = [described_tie(tie) for tie in self.ties]
        return told


def leapfrog_limit(
    placed: Sequence[tuple[System, Array, Array]], ties: Ties, time: float
) -> tuple[float, str]:
    """Return the largest step in s of bodies of several kinds, and what limits it.

    ``placed`` has one body of each kind, and places and velocities ``(N, n)``.
    """
    squared, damping = 0.0, 0.0
    kinds = []
    for system, places, speeds in placed:
        scales, law, known = system.manifold.scale_array, system.formulation, system.parameters
        for q, v in zip(places, speeds, strict=True):
            held = _equations_at(system, q, time)
            if not ties.bodies:
                squared = max(squared, highest_square(law, known, scales, q, v, held))
            if system.forces:
                rows = None if held is None else held[0]
                damping = max(damping, highest_damping(law, known, scales, q, v, rows))
        if ties.bodies:
            own = bends(system.polyhedron, places)
            kinds.append(PlacedKind(law, known, scales, places, speeds, own))
    if ties.bodies:
        squared = tied_square(kinds, ties, time)
    longest = 2 / math.sqrt(squared) if squared > 1e-12 else math.inf
    if damping * longest > 1.5:
        return 1.5 / damping, "beyond which the damping is not resolved"
    return longest, "beyond which the motion is unstable"


def _short(energy: "sympy.Expr | float") -> str:
    """Return a formula, or what it is where writing it would take long."""
    terms = len(getattr(energy, "args", ()))
    return f"a sum of {terms} terms" if terms > MOST_TERMS else brief(energy)


def _equations_at(system: "System", q: Array, time: float) -> tuple[Array, Array] | None:
    """Return gradients ``(k, n)`` and Hessians ``(k, n, n)`` of all equations, if any."""
    held = bends(system.polyhedron, q)
    if not system.rheonomic:
        return held
    _, *found = system.followed.evaluate(np.append(q, time), order=2)
    rows, curved = found[0][:, :-1], found[1][:, :-1, :-1]
    if held is None:
        return rows, curved
    return np.concatenate([held[0], rows]), np.concatenate([held[1], curved])

"""A mechanical system on a polyhedron: energies, contacts, friction, and its state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.motion.bodies import Body, FrictionContact, IdenticalBodies
from polycorner.motion.formulation import Formulation, Laws, dotted, energies
from polycorner.motion.friction import ConvexSet
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array, Manifold

if TYPE_CHECKING:
    import sympy

OVERLAP = 1e-4  # scaled depth up to which a start counts as touching: what a step may leave


def velocities(manifold: Manifold) -> "tuple[sympy.Symbol, ...]":
    """Return the velocities as real SymPy symbols: ``x_dot`` for the coordinate ``x``."""
    import sympy

    return tuple(sympy.Symbol(dotted(name), real=True) for name in manifold.names)


@dataclass(frozen=True)
class Friction:
    """Dry friction: a force in a convex set that grows with a normal load.

    The force per unit load ``p`` lies in ``C``, and where it slips it does so against the force
    that dissipates most: ``-s`` is normal to ``C`` at ``p`` ([Moreau]).  ``C`` is ``static`` while
    the contact sticks (its slip was exactly zero) and ``dynamic`` while it slips.

    Parameters
    ----------
    name : str
        What the contact is called.
    slip : sequence of sympy.Expr
        One or two components of the slip velocity, affine in the velocities ``x_dot``.  A
        substrate that moves is a term without velocities.
    static : ConvexSet
        Forces per unit load that may hold it, of as many dimensions as ``slip``.
    load : str, sympy.Expr or sequence of sympy.Expr
        The unilateral contact whose force presses, by name; or the known normal force as a
        function of the coordinates (several: their sum).
    dynamic : ConvexSet, optional
        Forces per unit load while it slips, inside ``static``; default ``static``.
    kind : str, optional
        Under which cause its dissipation is booked: ``"sliding"`` (default), ``"rolling"``, ...

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    name: str
    slip: "tuple[sympy.Expr, ...]"
    static: ConvexSet
    load: "str | tuple[sympy.Expr, ...]"
    dynamic: ConvexSet | None = None
    kind: str = "sliding"

    def __post_init__(self) -> None:
        slip = tuple(self.slip) if isinstance(self.slip, Sequence) else (self.slip,)
        object.__setattr__(self, "slip", slip)
        if not isinstance(self.load, str):
            several = isinstance(self.load, Sequence)
            object.__setattr__(self, "load", tuple(self.load) if several else (self.load,))
        if not isinstance(self.static, ConvexSet):
            msg = f"static: expected a convex set such as Disc(0.3); got {self.static!r}"
            raise TypeError(msg)
        if self.dynamic is None:
            object.__setattr__(self, "dynamic", self.static)
        check_sets(self.name, self.static, self.dynamic)
        if len(slip) != self.static.dimension:
            msg = (
                f"slip: expected {self.static.dimension} components for friction {self.name!r}, "
                f"as its set has; got {len(slip)}"
            )
            raise ValueError(msg)

    @property
    def moving(self) -> ConvexSet:
        """The set while the contact slips."""
        return self.static if self.dynamic is None else self.dynamic


def check_sets(name: str, static: ConvexSet, dynamic: ConvexSet | None) -> None:
    """Refuse a dynamic set that is not inside the static one."""
    if dynamic is None:
        return
    if not isinstance(dynamic, ConvexSet) or dynamic.dimension != static.dimension:
        msg = f"dynamic: expected a convex set like {static} for {name!r}; got {dynamic!r}"
        raise ValueError(msg)
    if not dynamic.within(static):
        msg = f"dynamic: expected a set inside {static} for friction {name!r}; got {dynamic}"
        raise ValueError(msg)


@dataclass(frozen=True, eq=False)
class State:
    """Where a system is, how it moves, and which friction contacts stick.

    Attributes
    ----------
    time : float
    q, v : (n,) array
        Coordinates (not wrapped, so that turns are counted) and velocities.
    sticking : (F,) array of bool
        For each friction contact, whether its slip was exactly zero: its static set holds.
    """

    time: float
    q: Array
    v: Array
    sticking: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class System:
    """A system with unilateral contacts and friction.

    Parameters
    ----------
    polyhedron : Polyhedron
        The placements without overlap: an intersection of ``f_i(q) >= 0``.  Each ``f_i`` is the
        gap of one contact.
    kinetic : sympy.Expr
        ``T(q, v)``, a quadratic form in the velocities (:func:`velocities`).
    potential : sympy.Expr, optional
        ``V(q)``; default 0.
    forces : mapping from str to sympy.Expr, optional
        Further generalised forces by coordinate, functions of coordinates and velocities.
    friction : sequence of Friction, optional
    restitution : float or mapping from str to float, optional
        Newton's coefficient ``0 <= e <= 1``, for all contacts or by name; default 0, plastic.
        Several contacts at once obey the law together, as in [Moreau]: after the impact
        ``J_i v+ >= -e_i J_i v-`` with an impulse only where equality holds.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> vx, vy = velocities(M)
    >>> ball = System(Polyhedron(M, {"floor": y}), (vx**2 + vy**2) / 2, 9.81 * y, restitution=0.5)
    >>> ball.state([0.0, 1.0], [1.0, 0.0]).v.tolist()
    [1.0, 0.0]
    """

    polyhedron: Polyhedron
    kinetic: "sympy.Expr"
    potential: "sympy.Expr | float" = 0
    forces: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    friction: tuple[Friction, ...] = ()
    restitution: float | Mapping[str, float] = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.polyhedron, Polyhedron):
            msg = f"polyhedron: expected a Polyhedron; got {type(self.polyhedron).__name__}"
            raise TypeError(msg)
        if self.polyhedron.equations or self.polyhedron.is_union:
            msg = (
                "polyhedron: expected an intersection of inequalities; got one with equations or "
                "unions: choose coordinates without equations, or a convex piece"
            )
            raise ValueError(msg)
        object.__setattr__(self, "friction", tuple(self.friction))
        for friction in self.friction:
            if not isinstance(friction, Friction):
                msg = f"friction: expected Friction values; got {friction!r}"
                raise TypeError(msg)
            if isinstance(friction.load, str) and friction.load not in self.contacts:
                msg = (
                    f"load: expected one of the contacts {', '.join(self.contacts)} or an "
                    f"expression for friction {friction.name!r}; got {friction.load!r}"
                )
                raise ValueError(msg)
        _ = self.restitutions, self.formulation

    @property
    def manifold(self) -> Manifold:
        """The configuration manifold."""
        return self.polyhedron.manifold

    @cached_property
    def contacts(self) -> tuple[str, ...]:
        """Names of the unilateral contacts."""
        return tuple(f.name for f in self.polyhedron.functions)

    @cached_property
    def restitutions(self) -> Array:
        """Coefficient of restitution of each contact, ``(m,)``."""
        given = self.restitution
        by_name = given if isinstance(given, Mapping) else dict.fromkeys(self.contacts, given)
        unknown = sorted(set(by_name) - set(self.contacts))
        if unknown:
            msg = f"restitution: expected contacts among {', '.join(self.contacts)}; got {unknown}"
            raise ValueError(msg)
        values = [coefficient(by_name.get(name, 0.0)) for name in self.contacts]
        return np.array(values, dtype=np.float64)

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
        """For each friction contact the unilateral contact that presses on it, or -1."""
        return tuple(
            self.contacts.index(f.load) if isinstance(f.load, str) else -1 for f in self.friction
        )

    @cached_property
    def formulation(self) -> Formulation:
        """The compiled equations of motion."""
        slips = tuple(e for f in self.friction for e in f.slip)
        laws = Laws(self.kinetic, self.potential, dict(self.forces), slips, self._loads)
        return Formulation.of(self.manifold.names, (), laws)

    @cached_property
    def parameters(self) -> Array:
        """Values of the parameters of the laws; here none."""
        return np.empty(0)

    def state(
        self, q: ArrayLike | Mapping[str, float], v: ArrayLike | None = None, time: float = 0.0
    ) -> State:
        """Return a state, checking that nothing overlaps.

        A friction contact sticks where its slip is exactly zero.
        """
        point = self.manifold.point(q).copy()
        speed = np.zeros(point.size) if v is None else self.manifold.point(v, "v").copy()
        self.check_placement(point)
        return State(float(time), point, speed, self.sticks(point, speed))

    def check_placement(self, q: Array) -> None:
        """Refuse a placement where a contact overlaps, naming the worst."""
        gaps = self.polyhedron.values(q)
        deep = -OVERLAP * min(self.manifold.scales)
        if gaps.size and (worst := int(np.argmin(gaps))) is not None and gaps[worst] < deep:
            msg = (
                f"q: expected a placement without overlap; contact {self.contacts[worst]!r} "
                f"overlaps by {-gaps[worst]:.6g}"
            )
            raise ValueError(msg)

    def sticks(self, q: Array, v: Array) -> NDArray[np.bool_]:
        """Return for each friction contact whether its slip is zero."""
        numbers = np.array([*self.parameters, 0.0])
        if not self.friction:
            return np.empty(0, dtype=np.bool_)
        at = np.concatenate([q, v])
        (slips,) = self.formulation.slip.kernel.at(at, numbers.ctypes.data, 0)
        starts = np.cumsum([0, *(len(f.slip) for f in self.friction)])
        ends = pairwise(starts.tolist())
        return np.array([not slips[a:b].any() for a, b in ends], dtype=np.bool_)

    def energies(self, state: State) -> tuple[float, float]:
        """Return kinetic and potential energy."""
        return energies(self.formulation, self.parameters, state.q, state.v)


def coefficient(value: Any) -> float:
    """Check a coefficient of restitution."""
    number = float(value)
    if not 0 <= number <= 1:
        msg = f"restitution: expected a number from 0 to 1; got {number:g}"
        raise ValueError(msg)
    return number


def bodies_of(system: System | IdenticalBodies) -> IdenticalBodies:
    """Return a system as the engine's description: one body that is not repeated."""
    if isinstance(system, IdenticalBodies):
        return system
    friction = tuple(
        FrictionContact(f.name, len(f.slip), f.static, f.moving, gap, loads, f.kind)
        for f, gap, loads in zip(system.friction, system.owners, system.load_sources, strict=True)
    )
    scales = system.manifold.scale_array
    return IdenticalBodies(
        Body(
            system.formulation,
            system.parameters,
            friction,
            system.polyhedron.bundle.calls,
            system.contacts,
            system.restitutions,
            1 / scales,
            float(scales.min()),
        )
    )

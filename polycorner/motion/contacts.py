"""Friction contacts of a body and families of contacts between identical bodies, in SymPy."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from polycorner.checks import instance, mapping, names, real, refuse
from polycorner.formulas.expressions import as_expression, as_expressions, written
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction, with_numbers
from polycorner.formulas.fusion import written_out
from polycorner.motion.attraction import Attraction
from polycorner.motion.bodies import RUBBING, PairContacts, PairLaw
from polycorner.motion.convex_sets import ConvexSet
from polycorner.motion.formulation import TIME, dotted
from polycorner.motion.friction import Interval
from polycorner.spaces.manifold import Manifold
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy

    Symbols = tuple[sympy.Symbol, ...]

PAIR = (1, 2)  # numbers of the two bodies of a pair in names of coordinates


def velocities(manifold: Manifold) -> "Symbols":
    """Return the velocities as real SymPy symbols: ``x_dot`` for the coordinate ``x``."""
    return _symbols(dotted(name) for name in instance("manifold", manifold, Manifold).names)


def motions(manifold: Manifold) -> Manifold:
    """Return coordinates and then velocities as one space, on which slips are functions."""
    known = instance("manifold", manifold, Manifold).names
    return Manifold.euclidean([*known, *map(dotted, known)])


def time_symbol() -> "sympy.Symbol":
    """Return the symbol of the time, in s, of which forces and slips may be functions."""
    return _symbols([TIME])[0]


def pair_coordinates(
    manifold: Manifold, other: Manifold | None = None
) -> "tuple[Symbols, Symbols]":
    """Return the coordinates of two bodies: of the coordinate ``x`` the symbols ``x1``, ``x2``.

    Those of a second body of another kind are on the manifold ``other``.
    """
    one, two = _pair(manifold, other)
    return _symbols(one), _symbols(two)


def pair_velocities(manifold: Manifold, other: Manifold | None = None) -> "tuple[Symbols, Symbols]":
    """Return the velocities of two bodies: for the coordinate ``x`` ``x1_dot`` and ``x2_dot``.

    Those of a second body of another kind are on the manifold ``other``.
    """
    one, two = _pair(manifold, other)
    return _symbols(map(dotted, one)), _symbols(map(dotted, two))


def _pair(manifold: Manifold, other: Manifold | None) -> tuple[list[str], list[str]]:
    one = instance("manifold", manifold, Manifold).names
    two = one if other is None else instance("other", other, Manifold).names
    return [f"{name}{PAIR[0]}" for name in one], [f"{name}{PAIR[1]}" for name in two]


def _symbols(written: Any) -> "Symbols":
    import sympy

    return tuple(sympy.Symbol(name, real=True) for name in written)


def _component(given: Any) -> "sympy.Expr | SmoothFunction":
    """Return a component of a slip, or raise TypeError."""
    return given if isinstance(given, SmoothFunction) else as_expression("slip", given)


class FrictionLaw(Checked):
    """Base of laws with a set of forces that hold and one of forces that resist slip."""

    static: ConvexSet
    dynamic: ConvexSet | None
    kind: str

    def _complete(self, name: str) -> None:
        """Check the sets, of which the second is the first unless it is given."""
        check_set("static", self.static)
        check_sets(name, self.static, self.dynamic)
        object.__setattr__(self, "dynamic", self.moving)

    def told(self) -> dict[str, str]:
        """Return the sets and the kind as text."""
        return {"static": str(self.static), "dynamic": str(self.moving), "kind": self.kind}

    @property
    def moving(self) -> ConvexSet:
        """The set while the contact slips."""
        return self.static if self.dynamic is None else self.dynamic


@dataclass(frozen=True)
class Friction(FrictionLaw):
    """Dry friction: a force in a convex set that grows with a normal load.

    The force per unit load ``p`` lies in ``C``, and where it slips it does so against the force
    that dissipates most: ``-s`` is normal to ``C`` at ``p`` ([Moreau]).  ``C`` is ``static`` while
    the contact sticks (its slip was exactly zero) and ``dynamic`` while it slips.

    Parameters
    ----------
    name : str
        Name of the contact.
    slip : sequence of sympy.Expr or SmoothFunction
        One or two components of the slip velocity, affine in the velocities ``x_dot``.  A
        substrate that moves is a term without velocities, which may depend on the time
        (:func:`time_symbol`).  Functions on :func:`motions` share
        their formulas with those of other contacts.
    static : ConvexSet
        Forces per unit load that may hold it, of as many dimensions as ``slip``.
    load : str, sympy.Expr or sequence of sympy.Expr
        The contact whose force presses, by name, or the equation, whose force presses with its
        magnitude; or the known normal force as a function of the coordinates (several: their sum).
    dynamic : ConvexSet, optional
        Forces per unit load while it slips, inside ``static``; default ``static``.
    kind : str, optional
        Cause under which its dissipation is booked: ``"sliding"`` (default), ``"rolling"``, ...

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    name: str
    slip: "tuple[sympy.Expr | SmoothFunction, ...]"
    static: ConvexSet
    load: "str | tuple[sympy.Expr, ...]"
    dynamic: ConvexSet | None = None
    kind: str = "sliding"

    def __post_init__(self) -> None:
        object.__setattr__(self, "slip", tuple(map(_component, _several(self.slip))))
        if not isinstance(self.load, str):
            loads = tuple(as_expression("load", load) for load in _several(self.load))
            object.__setattr__(self, "load", loads)
        self._complete(self.name)
        if len(self.slip) != self.static.dimension:
            components = f"{self.static.dimension} components for friction {self.name!r}"
            refuse("slip", f"{components}, as its set has", len(self.slip))
        super().__post_init__()

    @property
    def formulas(self) -> "tuple[sympy.Expr, ...]":
        """The components of the slip as formulas, whether or not they are functions."""
        return tuple(with_numbers(s) if isinstance(s, SmoothFunction) else s for s in self.slip)


def slip_text(component: Any) -> str:
    """Return a component of a slip as text; of a function that is shared, its name."""
    return component.name if isinstance(component, SmoothFunction) else written(component)


def check_set(argument: str, shape: object) -> ConvexSet:
    """Return a convex set, or raise TypeError."""
    if not isinstance(shape, ConvexSet):
        refuse(argument, "a convex set such as Disc(0.3)", shape, TypeError)
    return shape


def check_sets(name: str, static: ConvexSet, dynamic: ConvexSet | None) -> None:
    """Raise unless the dynamic set is inside the static one."""
    if dynamic is None:
        return
    if not isinstance(dynamic, ConvexSet) or dynamic.dimension != static.dimension:
        refuse("dynamic", f"a convex set like {static} for {name!r}", dynamic)
    if not dynamic.within(static):
        refuse("dynamic", f"a set inside {static} for friction {name!r}", dynamic)


def _several(values: Any) -> tuple[Any, ...]:
    several = isinstance(values, Sequence) and not isinstance(values, str)
    return tuple(values) if several else (values,)


@dataclass(frozen=True)
class PairFriction(FrictionLaw):
    """Dry friction at every gap of two bodies, as :class:`~polycorner.Friction` of one.

    Parameters
    ----------
    slip : mapping from str to sequence of sympy.Expr or SmoothFunction
        One or two components of the slip velocity at each gap, affine in the velocities of both
        bodies (:func:`pair_velocities`).
    static, dynamic : ConvexSet
        Force per unit normal force while a contact sticks and while it slips, of as many
        dimensions as ``slip``; of one dimension an ``Interval(mu)``.  Default of ``dynamic`` is
        ``static``.
    kind : str, optional
        Cause under which its dissipation is booked: ``"rubbing"`` (default), ``"rolling"``, ...

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    slip: "Mapping[str, tuple[sympy.Expr | SmoothFunction, ...]]"
    static: ConvexSet
    dynamic: ConvexSet | None = None
    kind: str = RUBBING

    def __post_init__(self) -> None:
        given = mapping("slip", self.slip).items()
        slip = {name: tuple(map(_component, _several(rows))) for name, rows in given}
        object.__setattr__(self, "slip", slip)
        self._complete("between bodies")
        for name, rows in slip.items():
            if len(rows) != self.static.dimension:
                components = f"{self.static.dimension} components at {name!r}, as static has"
                refuse("slip", components, len(rows))
        for argument, shape in (("static", self.static), ("dynamic", self.moving)):
            if isinstance(shape, Interval) and shape.lower != -shape.upper:
                refuse(
                    argument, "an interval that is symmetric, for the bodies are identical", shape
                )
        super().__post_init__()


@dataclass(frozen=True)
class ContactFamily(Checked):
    """The contacts between any two of several identical bodies, or of bodies of two kinds.

    Expressions are written for a pair, in the coordinates of both: of the coordinate ``x`` they
    are ``x1`` and ``x2`` (:func:`pair_coordinates`), its velocities ``x1_dot`` and ``x2_dot``
    (:func:`pair_velocities`).  Of two kinds the first has the coordinates with 1.

    Parameters
    ----------
    gaps : mapping from str to sympy.Expr
        The gaps of a pair by name, positive while the two do not touch there.
    reach : float
        Distance of positions, in scaled coordinates, beyond which two bodies cannot touch.
    position : sequence of str, optional
        Up to three coordinates that are the position of a body, by which near pairs are found;
        default the first two.  Of two kinds, those of both.
    friction : sequence of PairFriction, optional
        The laws of friction at the gaps, each with a convex set of its own; default none.
    restitution : float, optional
        Coefficient ``0 <= e <= 1``, for the law of impact of the system; default 0, plastic.
    definitions : mapping from str to sympy.Expr, optional
        Intermediate quantities that the gaps use by name, each also in later ones.
    attraction : Attraction, optional
        At each gap; default none.  Its work is ``Trajectory.work["attraction"]``.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    gaps: "Mapping[str, sympy.Expr]"
    reach: float
    position: tuple[str, ...] = ()
    friction: tuple[PairFriction, ...] = ()
    restitution: float = 0.0
    definitions: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    attraction: Attraction | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", _several(self.position))
        object.__setattr__(self, "definitions", as_expressions("definitions", self.definitions))
        object.__setattr__(self, "gaps", as_expressions("gaps", self.gaps))
        if not self.gaps:
            refuse("gaps", "at least one gap of a pair", self.gaps)
        object.__setattr__(self, "reach", real("reach", self.reach, above=0))
        object.__setattr__(self, "friction", _several(self.friction))
        object.__setattr__(
            self, "restitution", real("restitution", self.restitution, least=0, most=1)
        )
        self._check_friction()
        if self.attraction is not None:
            instance("attraction", self.attraction, Attraction)
        super().__post_init__()

    def _check_friction(self) -> None:
        for law in self.friction:
            if not isinstance(law, PairFriction):
                refuse("friction", "PairFriction values", law, TypeError)
            names("slip", law.slip, self.gaps)
            if missing := [name for name in self.gaps if name not in law.slip]:
                every = f"the slip velocity at every gap, {missing[0]!r} included"
                refuse("slip", every, [*law.slip])

    def described(self) -> dict[str, Any]:
        """Return everything that a motion depends on, by name, as plain values."""
        told: dict[str, Any] = {f"gap {name}": written(gap) for name, gap in self.gaps.items()}
        told |= {f"definition {name}": written(e) for name, e in self.definitions.items()}
        told["friction between bodies"] = [
            {**{name: [*map(slip_text, rows)] for name, rows in law.slip.items()}, **law.told()}
            for law in self.friction
        ]
        if self.attraction is not None:
            told["attraction"] = [self.attraction.force, self.attraction.range]
        return told | {"restitution between bodies": self.restitution, "reach": self.reach}

    def compiled(self, manifold: Manifold, other: Manifold | None = None) -> PairContacts:
        """Return the compiled contacts of bodies with coordinates on a manifold, or on two."""
        coordinates = tuple(s.name for one in pair_coordinates(manifold, other) for s in one)
        rates = tuple(s.name for one in pair_velocities(manifold, other) for s in one)
        slips = tuple(
            (self._slips(name, (*coordinates, *rates)), False, ())
            for name in self.gaps
            if self.friction
        )
        sizes = manifold.size, (other or manifold).size
        return PairContacts(
            Family.of(self.gaps, coordinates, definitions=self.definitions),
            (),
            tuple((body, c) for body, n in enumerate(sizes) for c in range(n)),
            slips,
            tuple(
                PairLaw(law.static.dimension, law.static, law.moving, law.kind)
                for law in self.friction
            ),
            self.restitution,
            self.reach,
            self.attraction,
        )

    def _slips(self, gap: str, variables: tuple[str, ...]) -> Family:
        """Return the slip velocities at a gap, law after law."""
        rows = {f"s{i}": s for i, s in enumerate(s for law in self.friction for s in law.slip[gap])}
        shared = {name: s for name, s in rows.items() if isinstance(s, SmoothFunction)}
        definitions, expressions = written_out(shared)
        held = variables[: len(variables) // 2]
        return Family.of(rows | expressions, variables, definitions=definitions, stationary=held)


def position_of(
    manifold: Manifold,
    given: Sequence[str],
    substrate: Mapping[str, float],
    *,
    several: bool,
) -> tuple[int, ...]:
    """Return the two or three coordinates of a position; the first is that of the substrate."""
    known, n = manifold.names, manifold.size
    chosen = [known.index(name) for name in given] or list(range(min(2, n)))
    moving = [known.index(name) for name in substrate]
    if moving and moving[0] not in chosen:
        if several:
            expected = f"a coordinate of the position, {', '.join(known[c] for c in chosen)}"
            refuse("substrate", expected, next(iter(substrate)))
        chosen = [moving[0]]
    chosen.sort(key=lambda c: c not in moving)
    return tuple(chosen) if len(chosen) > 1 else (chosen[0], chosen[0])


def periods_of(manifold: Manifold, position: tuple[int, ...]) -> tuple[float, ...]:
    """Return the lengths after which components of a position repeat; one alone is the second."""
    lengths = [float(manifold.periods[c] / manifold.scales[c]) for c in position]
    return (math.inf, lengths[1]) if position[0] == position[1] else tuple(lengths)

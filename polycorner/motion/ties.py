"""Ties between two bodies, or of a body to the world: joints, limits, springs, drives."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from polycorner.checks import mapping, names, real, refuse, whole
from polycorner.formulas.adjoints import Reverse
from polycorner.formulas.expressions import as_expression, as_expressions, written
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.programs import Program
from polycorner.formulas.translate import compile_expressions
from polycorner.kinds import check_fields
from polycorner.motion.contacts import PAIR, Friction, pair_coordinates, pair_velocities
from polycorner.motion.formulation import TIME, degree
from polycorner.motion.tie_forms import NO_TIES, WORLD, TieForm, TieFriction, Ties
from polycorner.spaces.manifold import Manifold
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy


@dataclass(frozen=True)
class Tie(Checked):
    """What ties two bodies of a repeated system, or one body to the world.

    Formulas are written in the coordinates of both: of the coordinate ``x`` they are ``x1`` and
    ``x2`` (:func:`pair_coordinates`), its velocities ``x1_dot`` and ``x2_dot``
    (:func:`pair_velocities`), where the bodies are of two kinds those of each.  Those of a tie to
    the world are written in ``x1`` alone.  Ties with the same formulas are compiled once; what
    differs from one to the other are ``parameters``.

    ===============  ==============================================================================
    ``equations``    ``h = 0``; the force acts along the gradient of ``h`` and has either sign
    ``limits``       ``f >= 0``; the force acts along the gradient of ``f`` and is not negative
    ``potential``    ``V``; the force is ``-dV/dq``, and the energy counts as potential
    ``forces``       other forces on both bodies; their work is booked as ``applied``
    ===============  ==============================================================================

    Parameters
    ----------
    bodies : int, str, or sequence of these
        Numbers or names, such as ``"small 3"``, of the two bodies, or of the one that is tied to
        the world.
    name : str
        Its equations and limits are called ``name.equation``; several ties may have one name.
    equations : mapping from str to sympy.Expr, optional
        Where they depend on the time (:func:`time_symbol`), they prescribe a motion; the work of
        what drives it is booked as ``drive``.  Of equations that follow from others, as in some
        closed loops, the later ones carry no force.
    limits : mapping from str to sympy.Expr, optional
        Functions of the coordinates.
    friction : sequence of Friction, optional
        Friction between the bodies, of slips in the velocities of both.  Its load is the force of
        one of the limits or equations, by name, or known.
    potential : sympy.Expr, optional
        ``V`` as a function of the coordinates; default 0.
    forces : mapping from str to sympy.Expr, optional
        Generalised forces by coordinate, such as ``{"x1": f, "x2": -f}``, functions of
        coordinates, velocities and the time.
    restitution : float or mapping from str to float, optional
        Coefficient of limits, ``0 <= e <= 1``, for the law of impact of the system; default 0.
    parameters : mapping from str to float, optional
        Values of further symbols in the formulas.
    collide : bool, optional
        Whether the two bodies can touch each other; default not.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    Two beads on strings of length 1, the second hanging from the first:

    >>> from polycorner import Manifold, Polyhedron, System, velocities
    >>> from polycorner.motion import pair_coordinates, simulate
    >>> M = Manifold.euclidean("x y")
    >>> (x, y), (vx, vy) = M.symbols, velocities(M)
    >>> (x1, y1), (x2, y2) = pair_coordinates(M)
    >>> ties = [
    ...     Tie(0, "upper", {"length": (x1**2 + y1**2 - 1) / 2}),
    ...     Tie((0, 1), "lower", {"length": ((x2 - x1) ** 2 + (y2 - y1) ** 2 - 1) / 2}),
    ... ]
    >>> beads = System(
    ...     Polyhedron(M, {"floor": y + 9}), (vx**2 + vy**2) / 2, 9.81 * y, count=2, ties=ties
    ... )
    >>> path = simulate(beads, beads.state([[0, -1], [0, -2]]), 0.1, 1e-3)
    >>> [(bodies, name, round(force, 2)) for bodies, name, force in path.touching[-1]]
    [((0,), 'upper.length', -19.62), ((0, 1), 'lower.length', -9.81)]
    """

    bodies: tuple[int | str, ...]
    name: str
    equations: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    limits: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    friction: tuple[Friction, ...] = ()
    potential: "sympy.Expr | float" = 0
    forces: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    restitution: float | Mapping[str, float] = 0.0
    parameters: Mapping[str, float] = field(default_factory=dict)
    collide: bool = False

    def __post_init__(self) -> None:
        # One number stands for a body that is tied to the world.
        several = isinstance(self.bodies, Sequence) and not isinstance(self.bodies, str)
        given = tuple(self.bodies) if several else (self.bodies,)
        bodies = (i if isinstance(i, str) else whole("bodies", i, least=0) for i in given)
        object.__setattr__(self, "bodies", tuple(bodies))
        if len(given) not in (1, 2) or len({*given}) < len(given):
            refuse("bodies", "one body, or two different ones", self.bodies)
        for argument in ("equations", "limits", "forces"):
            found = as_expressions(argument, getattr(self, argument))
            object.__setattr__(self, argument, found)
        object.__setattr__(self, "potential", as_expression("potential", self.potential))
        if not isinstance(self.friction, Sequence):
            refuse("friction", "a sequence of laws of friction", self.friction, TypeError)
        object.__setattr__(self, "friction", tuple(self.friction))
        values = mapping("parameters", self.parameters).items()
        object.__setattr__(self, "parameters", {n: real("parameters", x) for n, x in values})
        check_fields(self)
        if twice := self.equations.keys() & self.limits.keys():
            refuse("limits", "names other than those of equations", min(twice))
        _ = self.restitutions
        for friction in self.friction:
            if isinstance(friction.load, str) and friction.load not in self.rows:
                known = ", ".join(self.rows) or "none"
                expected = f"one of the limits and equations ({known}) or an expression"
                refuse("load", f"{expected} for friction {friction.name!r}", friction.load)
            if any(isinstance(s, SmoothFunction) for s in friction.slip):
                refuse("slip", f"formulas for friction {friction.name!r} of a tie", "a function")
        super().__post_init__()

    @property
    def rows(self) -> "dict[str, sympy.Expr]":
        """Limits, then equations, by name."""
        return {**self.limits, **self.equations}

    @property
    def restitutions(self) -> tuple[float, ...]:
        """Coefficient of restitution of each limit and, zero, of each equation."""
        given = self.restitution
        by_name = given if isinstance(given, Mapping) else dict.fromkeys(self.limits, given)
        names("restitution", by_name, self.limits)
        return tuple(
            real("restitution", by_name.get(name, 0.0), least=0, most=1) for name in self.rows
        )

    @property
    def formulas(self) -> tuple[Any, ...]:
        """What ties that are compiled together have in common."""
        friction = tuple((f.slip, f.load, f.static, f.moving, f.kind) for f in self.friction)
        forces = tuple(sorted(self.forces.items()))
        written = tuple(self.limits.items()), tuple(self.equations.items())
        return *written, friction, self.potential, forces, tuple(self.parameters)


def described_tie(tie: Tie, text: Callable[[Any], str] = written) -> dict[str, Any]:
    """Return everything that a motion depends on, by name, as plain values, formulas as text."""
    told: dict[str, Any] = {
        "bodies": [*tie.bodies],
        "name": tie.name,
        "potential": text(tie.potential),
        "restitution": [*tie.restitutions],
        "parameters": dict(tie.parameters),
        "collide": tie.collide,
    }
    for argument in ("equations", "limits", "forces"):
        told[argument] = {name: text(e) for name, e in getattr(tie, argument).items()}
    told["friction"] = [
        {
            "slip": [*map(text, f.slip)],
            "load": f.load if isinstance(f.load, str) else [*map(text, f.load)],
            **f.told(),
        }
        for f in tie.friction
    ]
    return told


def followers(equations: "Mapping[str, sympy.Expr]", bodies: Iterable[int]) -> list[Tie]:
    """Return equations with the time of each of some bodies as ties to the world.

    These have no name, so that rows have those of the equations.
    """
    import sympy

    free = {s for e in equations.values() for s in e.free_symbols if s.name != TIME}
    places = {s: sympy.Symbol(f"{s.name}{PAIR[0]}", real=True) for s in free}
    rows = {name: e.xreplace(places) for name, e in equations.items()}
    return [Tie((i,), "", rows) for i in bodies] if rows else []


def ends_of(tie: Tie, total: int, numbers: Mapping[str, int]) -> tuple[int, int]:
    """Return the numbers of the bodies of a tie, -1 for the world; ``numbers`` are by name."""
    found = []
    for one in tie.bodies:
        if isinstance(one, str):
            names("bodies", [one], numbers)
        elif one >= total:
            expected = f"numbers of {total} {'body' if total == 1 else 'bodies'}, from 0 on"
            refuse("bodies", f"{expected}, for {tie.name!r}", one)
        found.append(numbers[one] if isinstance(one, str) else one)
    if len({*found}) < len(found):
        refuse("bodies", "two different bodies", tie.bodies)
    return found[0], (*found, WORLD)[1]


def check_tie(tie: Tie, sides: Sequence[Manifold]) -> None:
    """Raise ValueError for symbols that the bodies of a tie, or the one, do not have."""
    places = {s.name for side in pair_coordinates(*sides)[: len(sides)] for s in side}
    speeds = [s for side in pair_velocities(*sides)[: len(sides)] for s in side]
    known, moving = places | {*tie.parameters}, {s.name for s in speeds}
    slips: list[Any] = [s for f in tie.friction for s in f.slip]
    loads = [e for f in tie.friction if not isinstance(f.load, str) for e in f.load]
    for argument, formulas, allowed in (
        ("equations", tie.equations.values(), known | {TIME}),
        ("limits", tie.limits.values(), known),
        ("potential", [as_expression("potential", tie.potential)], known),
        ("load", loads, known),
        ("forces", tie.forces.values(), known | moving | {TIME}),
        ("slip", slips, known | moving | {TIME}),
    ):
        for formula in formulas:
            if unknown := {s.name for s in formula.free_symbols} - allowed:
                shown = ", ".join(sorted(allowed))
                refuse(argument, f"a formula in {shown} for {tie.name!r}", min(unknown))
    names("forces", tie.forces, sorted(places))
    for slip in slips:
        if degree(slip, speeds) > 1:
            refuse("slip", f"an affine function of the velocities for {tie.name!r}", slip)


class TieForces(Family):
    """All forces of a tie on both bodies, of these the applied ones, and its known loads.

    Variables are the coordinates of both bodies, their velocities and the time; formulas are the
    potential, the applied forces by coordinate and the loads, in this order.
    """

    def program(self) -> Program:
        """Return the straight-line program of the values, the potential differentiated."""
        size = len(self.variables) // 2
        _, formulas = self.formulas()
        symbols = self.variables, self.parameters
        given = compile_expressions([*formulas.values()], *symbols, {}, [*formulas])
        g, (potential, *rest) = given.graph.copy(), given.outputs
        rise, zero = Reverse(g).row(potential), g.const(0)
        forces = [g.sub(rest[c], rise.get(c, zero)) for c in range(size)]
        return Program(g, (*forces, *rest), len(self.variables), len(self.parameters))


def compiled_ties(
    ties: Sequence[Tie],
    kinds: Sequence[tuple[Manifold, int]],
    called: Sequence[str] = (),
) -> Ties:
    """Return the compiled ties of bodies, after checking them.

    Parameters
    ----------
    ties : sequence of Tie
    kinds : sequence of (Manifold, int)
        The coordinates of a body of each kind, and how many there are.
    called : sequence of str, optional
        Names of all bodies.
    """
    if not ties:
        return NO_TIES
    spaces = [space for space, count in kinds for _ in range(count)]
    width = max(space.size for space, _ in kinds)
    numbers = {name: i for i, name in enumerate(called)}
    forms: dict[tuple[Any, ...], TieForm] = {}
    form, every = [], []
    for tie in ties:
        ends = ends_of(tie, len(spaces), numbers)
        sides = [spaces[i] for i in ends if i >= 0]
        check_tie(tie, sides)
        key = tie.formulas, *(side.names for side in sides)
        if key not in forms:
            forms[key] = _form(tie, sides, width)
        form.append([*forms].index(key))
        every.append(ends)
    apart = [ends for tie, ends in zip(ties, every, strict=True) if not tie.collide]
    return Ties(
        tuple(forms.values()),
        tuple(form),
        tuple(every),
        tuple(tuple(tie.parameters.values()) for tie in ties),
        tuple(f"{tie.name}.{row}" if tie.name else row for tie in ties for row in tie.rows),
        tuple(e for tie in ties for e in tie.restitutions),
        tuple(dict.fromkeys(ends for ends in apart if ends[1] != WORLD)),
    )


def _filled(sides: "Sequence[Sequence[sympy.Symbol]]", width: int, mark: str) -> tuple[str, ...]:
    """Return the names of what two bodies have, with further ones up to a width for each.

    The engine gives these zeros: bodies of other kinds have more coordinates, the world has none.
    """
    own = [[s.name for s in side] for side in sides]
    return tuple(
        name
        for number, some in enumerate((*own, ())[:2])
        for name in (*some, *(f"_{mark}{number}_{c}" for c in range(len(some), width)))
    )


def _form(tie: Tie, sides: Sequence[Manifold], width: int) -> TieForm:
    """Return the compiled formulas of a tie, for so many coordinates of each body."""
    import sympy

    both = len(sides)
    places = _filled(pair_coordinates(*sides)[:both], width, "q")
    speeds = _filled(pair_velocities(*sides)[:both], width, "v")
    still, moving, known = (*places, TIME), (*places, *speeds, TIME), tuple(tie.parameters)
    slips = {f"s{i}": s for i, s in enumerate(s for f in tie.friction for s in f.slip)}
    rows = [*tie.rows]
    friction = tuple(
        TieFriction(
            len(f.slip),
            f.static,
            f.moving,
            rows.index(f.load) if isinstance(f.load, str) else -1,
            f.kind,
        )
        for f in tie.friction
    )
    loads = [sympy.S.Zero if isinstance(f.load, str) else sum(f.load) for f in tie.friction]
    applied = [tie.forces.get(name, sympy.S.Zero) for name in places]
    acts = tie.potential != 0 or tie.forces or any(load != 0 for load in loads)
    outputs = [f"{letter}{i}" for letter in "FQ" for i in range(len(places))]
    given = dict(zip(["V", *outputs[len(places) :]], [tie.potential, *applied], strict=True))
    given |= {f"N{i}": load for i, load in enumerate(loads)}
    names_of_forces = (*outputs, *(f"N{i}" for i in range(len(loads))))
    time, rates = sympy.Symbol(TIME, real=True), [sympy.Symbol(s, real=True) for s in speeds]
    return TieForm(
        Family.of(tie.rows, still, known),
        len(tie.limits),
        Family.of(slips, moving, known, stationary=places) if slips else None,
        friction,
        TieForces(names_of_forces, moving, known, lambda: ({}, given)) if acts else None,
        Family.of({"V": tie.potential}, still, known) if tie.potential != 0 else None,
        any(degree(h, [time]) for h in tie.equations.values()),
        any(degree(f, rates) for f in tie.forces.values()),
        any(e.has(time) for e in (*tie.equations.values(), *tie.forces.values(), *slips.values())),
    )

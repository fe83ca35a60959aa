"""Equations of motion from energies in SymPy, compiled; see :mod:`polycorner.motion.lagrange`."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.formulas.bundles import Bundle, Call
from polycorner.formulas.cache import source_key
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.motion import lagrange
from polycorner.motion.lagrange import EquationsOfMotion
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import cached_property

if TYPE_CHECKING:
    import sympy

TIME = "time"  # name of the symbol of the time in applied forces and slips
STEP = "time step"  # and of the step, by half of which slips look ahead of the middle of steps


def degree(
    expression: "sympy.Basic", symbols: "Collection[sympy.Symbol]", *, least: bool = False
) -> float:
    """Return an upper bound of the degree of a formula as a polynomial in some symbols.

    It is zero only for a formula without them, and infinite where a function other than sums,
    products, whole powers and branches contains them.  Where it is finite, the degree of the
    ``least`` term, also asked for, is a lower bound of those of all terms.  Every subexpression is
    visited once, so that formulas which repeat subexpressions take no longer than they are large
    in memory.

    Examples
    --------
    >>> from sympy.abc import x, y
    >>> degree(x * y + y**2, [y]), degree(x * y + y**2, [x]), degree(1 / x, [x])
    (2, 1, inf)
    >>> degree(x * y + y**2, [x, y], least=True), degree(x + y**2, [x, y], least=True)
    (2, 1)
    """
    chosen = min if least else max
    known: dict[sympy.Basic, float] = dict.fromkeys(symbols, 1)
    waiting = [expression]
    while waiting:
        e = waiting[-1]
        unknown = [] if e in known else [part for part in e.args if part not in known]
        if unknown:
            waiting += unknown
            continue
        waiting.pop()
        if e not in known:
            known[e] = _joined(e, [known[part] for part in e.args], chosen)
    return known[expression]


def _joined(
    e: "sympy.Basic", degrees: list[float], chosen: Callable[[Iterable[float]], float]
) -> float:
    """Return the degree of an expression from those of its arguments."""
    if not any(degrees):
        return 0
    kind = type(e).__name__
    if kind == "Add":
        return chosen(degrees)
    if kind == "Mul":
        return sum(degrees)
    if kind == "Pow" and e.args[1].is_Integer and int(e.args[1]) > 0:
        return degrees[0] * int(e.args[1])
    if kind in {"Piecewise", "ExprCondPair"}:
        values = degrees if kind == "Piecewise" else degrees[:1]
        return math.inf if any(degrees[len(values) :]) else chosen(values)
    return math.inf


def dotted(name: str) -> str:
    """Return the name of a coordinate's velocity: ``x`` moves with ``x_dot``."""
    return f"{name}_dot"


@dataclass(frozen=True)
class Laws:
    """The laws of a motion, in SymPy.

    Attributes
    ----------
    kinetic, potential : sympy.Expr
        ``T(q, v)``, quadratic in the velocities, and ``V(q)``.
    forces : mapping from str to sympy.Expr
        Applied generalised forces, by coordinate; they may depend on the time.
    slips : tuple of sympy.Expr or SmoothFunction
        Slip velocities ``s(q, v)``, affine in the velocities; they may depend on the time.
    loads : tuple of sympy.Expr
        Known normal forces ``N(q)``.
    """

    kinetic: "sympy.Expr"
    potential: "sympy.Expr"
    forces: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    slips: "tuple[sympy.Expr | SmoothFunction, ...]" = ()
    loads: "tuple[sympy.Expr, ...]" = ()


@dataclass(frozen=True, eq=False)
class Formulation:
    """Compiled equations of motion of ``k`` coordinates.

    Attributes
    ----------
    coordinates, parameters : tuple of str
        Names of the symbols the laws are written in.
    laws : callable
        Returns the :class:`Laws`; with a ``key`` it is called only if nothing is compiled yet.
    slips, loads : int
        Numbers of slip velocities and of known loads.
    key : str
        Identifies the laws across processes.
    shared : mapping from int to SmoothFunction
        Slips, by number, that share formulas with those of other contacts.
    further : sequence of Call
        Kernels of further slips that are no formulas; their rows follow.
    """

    coordinates: tuple[str, ...]
    parameters: tuple[str, ...]
    laws: Callable[[], Laws]
    slips: int
    loads: int
    key: str = ""
    shared: Mapping[int, SmoothFunction] = field(default_factory=dict)
    further: Sequence[Call] = ()

    @classmethod
    def of(
        cls,
        coordinates: Sequence[str],
        parameters: Sequence[str],
        laws: Laws,
        *,
        timed: bool = False,
    ) -> "Formulation":
        """Return the formulation of given laws, checking each symbol and the kinetic energy.

        Where a force or a slip depends on the time, or equations do (``timed``), it is a further
        parameter.  Forces are those in
        the middle of a step, slips those of the velocities at its end.
        """
        import sympy

        time, step = (sympy.Symbol(name, real=True) for name in (TIME, STEP))
        own = [s for s in laws.slips if not isinstance(s, SmoothFunction)]
        paced = time in set().union(*(s.free_symbols for s in own))
        driven = time in set().union(*(force.free_symbols for force in laws.forces.values()))
        if paced:
            ahead = {time: time + step / 2}
            slips = tuple(
                s if isinstance(s, SmoothFunction) else s.xreplace(ahead) for s in laws.slips
            )
            laws = replace(laws, slips=slips)
        further = [TIME] * (driven or paced or timed) + [STEP] * paced
        known = (*parameters, *further)
        shared = {i: s for i, s in enumerate(laws.slips) if isinstance(s, SmoothFunction)}
        sizes = len(laws.slips), len(laws.loads)
        found = cls(tuple(coordinates), known, lambda: laws, *sizes, shared=shared)
        found.check()
        digests = [f.program().digest() for f in (found.forces, found.slip, found.energies)]
        digests += [f"{s.family.key} {s.reads} {s.parameters}" for s in shared.values()]
        return replace(found, key=repr(digests))

    @property
    def time_parameter(self) -> int:
        """Position of the time among the parameters; -1 if the laws do not depend on it."""
        return self.parameters.index(TIME) if TIME in self.parameters else -1

    @property
    def is_paced(self) -> bool:
        """Whether slips depend on the time."""
        return STEP in self.parameters

    def at(self, parameters: Array, time: float = 0.0, step: float = 0.0) -> Array:
        """Return the parameters with a time and the length of a step."""
        told, found = {TIME: time, STEP: step}, np.array(parameters, dtype=np.float64)
        for k, name in enumerate(self.parameters):
            found[k] = told.get(name, found[k])
        return found

    @property
    def variables(self) -> tuple[str, ...]:
        """Coordinates, then velocities."""
        return (*self.coordinates, *(dotted(name) for name in self.coordinates))

    @cached_property
    def forces(self) -> Family:
        """Upper triangle of ``M`` row by row, ``F`` (k), applied forces (k), known loads."""
        k = len(self.coordinates)
        mass = [f"M{i}_{j}" for i in range(k) for j in range(i, k)]
        rest = [f"{letter}{i}" for letter in "FQ" for i in range(k)]
        names = (*mass, *rest, *(f"N{i}" for i in range(self.loads)))

        def formulas() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
            from sympy import S

            laws = self.laws()
            applied = [laws.forces.get(name, S.Zero) for name in self.coordinates]
            given = [laws.kinetic, laws.potential, *applied, *laws.loads]
            written = zip(("T", "V", *names[-k - self.loads :]), given, strict=True)
            return {}, dict(written)

        key = repr((source_key(lagrange.__name__), self.key)) if self.key else ""
        return EquationsOfMotion(names, self.variables, self.parameters, formulas, key)

    @cached_property
    def slip(self) -> Family:
        """The slip velocities but for shared ones; only the derivatives by velocities are found."""
        own = [i for i in range(self.slips) if i not in self.shared]
        names = tuple(f"s{i}" for i in own)
        return self._family(
            names, lambda: [self.laws().slips[i] for i in own], held=self.coordinates
        )

    @property
    def slip_calls(self) -> list[Call]:
        """Kernels of all slip velocities; that of :attr:`slip` reads the own parameters."""
        return [*self._slips_of_laws, *self.further]

    @cached_property
    def _slips_of_laws(self) -> list[Call]:
        own = tuple(i for i in range(self.slips) if i not in self.shared)
        calls = []
        if own:
            everything = tuple(range(len(self.variables)))
            calls.append(Call(self.slip, everything, np.empty(0), own, tuple(range(len(own)))))
        if self.shared:
            rows, functions = [*self.shared], [*self.shared.values()]
            shared = Bundle(functions[0].manifold, functions).calls
            calls += [replace(c, rows=tuple(rows[i] for i in c.rows)) for c in shared]
        return calls

    def slip_velocities(self, parameters: Array, at: Array) -> tuple[Array, Array]:
        """Return slips ``(N, slips)`` and derivatives ``(N, slips, 2k)`` at ``(q, v)`` ``(N, 2k)``.

        Those by coordinates may be left zero.
        """
        numbers = np.array([*parameters, 0.0])
        slips = np.zeros((len(at), self.slips))
        slopes = np.zeros((*slips.shape, len(self.variables)))
        for call in self._slips_of_laws:
            given = numbers if call.family is self.slip else call.parameters
            inputs = np.ascontiguousarray(at[:, call.reads])
            values, gradients = call.family.kernel.over(inputs, given.ctypes.data, 1)
            slips[:, call.rows] = values[:, call.columns]
            rows, reads = np.array(call.rows)[:, None], np.array(call.reads)
            slopes[:, rows, reads] = gradients[:, call.columns]
        return slips, slopes

    @cached_property
    def energies(self) -> Family:
        """Kinetic and potential energy."""
        return self._family(("T", "V"), lambda: [self.laws().kinetic, self.laws().potential])

    def _family(
        self,
        names: tuple[str, ...],
        expressions: Callable[[], list[Any]],
        held: tuple[str, ...] = (),
    ) -> Family:
        def formulas() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
            return {}, dict(zip(names, expressions(), strict=True))

        key = repr((self.key, names, held)) if self.key else ""
        return Family(names, self.variables, self.parameters, formulas, key, stationary=held)

    def check(self) -> None:
        """Raise ValueError for laws that are not of the stated form, naming the first."""
        import sympy

        laws = self.laws()
        v = [sympy.Symbol(dotted(name), real=True) for name in self.coordinates]
        if not _is_quadratic(laws.kinetic, v):
            names = ", ".join(map(str, v))
            msg = f"kinetic: expected a quadratic form in {names}; got {laws.kinetic}"
            raise ValueError(msg)
        time = sympy.Symbol(TIME, real=True)
        own_slips = [s for i, s in enumerate(laws.slips) if i not in self.shared]
        steady = {
            "kinetic": [laws.kinetic],
            "potential": [laws.potential],
            "load": laws.loads,
        }
        for name, several in steady.items():
            for given in several:
                if name in {"potential", "load"} and degree(given, v):
                    moving = min(map(str, given.free_symbols & set(v)))
                    msg = f"{name}: expected no velocity in it; got {moving}"
                    raise ValueError(msg)
                if degree(given, [time]):
                    others = "only forces and slips may have it"
                    msg = f"{name}: expected no time in it, {others}; got {given}"
                    raise ValueError(msg)
        for slip in own_slips:
            if degree(slip, v) <= 1:
                continue
            if sympy.simplify(sympy.hessian(slip, v)) != sympy.zeros(len(v), len(v)):
                msg = f"slip: expected an affine function of the velocities; got {slip}"
                raise ValueError(msg)
        self._check_shared()
        unknown = sorted(set(laws.forces) - set(self.coordinates))
        if unknown:
            msg = f"forces: expected the coordinates {', '.join(self.coordinates)}; got {unknown}"
            raise ValueError(msg)

    def _check_shared(self) -> None:
        """Raise ValueError for functions of other coordinates, or not affine in the velocities."""
        for function in self.shared.values():
            if function.manifold.names != self.variables:
                names = ", ".join(function.manifold.names)
                msg = f"slip: expected functions of {', '.join(self.variables)}; got one of {names}"
                raise ValueError(msg)
        functions, k = [*self.shared.values()], len(self.coordinates)
        if not functions:
            return
        draws = np.random.default_rng(0).normal(size=(3, 2 * k))
        draws[:, :k] = draws[0, :k]
        slopes = Bundle(functions[0].manifold, functions).evaluate(draws, 1)[1][:, :, k:]
        sizes, changes = (np.abs(a).max(axis=(0, 2)) for a in (slopes, np.diff(slopes, axis=0)))
        for function, size, change in zip(functions, sizes, changes, strict=True):
            if change > DEFAULT.alike * size:
                msg = f"slip: expected an affine function of the velocities; got {function.name!r}"
                raise ValueError(msg)


def _is_quadratic(kinetic: "sympy.Expr", v: "list[sympy.Symbol]") -> bool:
    """Whether a formula is a quadratic form in some symbols, first by how it is written."""
    import sympy

    if degree(kinetic, v) <= 2 <= degree(kinetic, v, least=True):
        return True
    still = dict.fromkeys(v, 0)
    lower = [kinetic.subs(still), *(sympy.diff(kinetic, x).subs(still) for x in v)]
    curved = sympy.hessian(kinetic, v).free_symbols & set(v)
    return not curved and all(sympy.simplify(term) == 0 for term in lower)


@dataclass(frozen=True)
class Moment:
    """The equations of motion at one ``(q, v)``, in NumPy.

    Attributes
    ----------
    mass : (k, k) array
    force, applied : (k,) array
        All forces, and of these the applied ones.
    loads : (loads,) array
    slip_matrix, drift : (slips, k) and (slips,) array
        ``s = B v + d``.
    """

    mass: Array
    force: Array
    applied: Array
    loads: Array
    slip_matrix: Array
    drift: Array


def moment(formulation: Formulation, parameters: Array, q: Array, v: Array) -> Moment:
    """Evaluate the equations of motion at one point."""
    k = len(formulation.coordinates)
    mass, rest = mass_and_forces(formulation, parameters, q, v)
    at = np.concatenate([q, v])
    (slips,), (slopes,) = formulation.slip_velocities(parameters, at[None])
    matrix = slopes[:, k:]
    return Moment(mass, rest[:k], rest[k : 2 * k], rest[2 * k :], matrix, slips - matrix @ v)


def mass_and_forces(
    formulation: Formulation, parameters: Array, q: Array, v: Array
) -> tuple[Array, Array]:
    """Return the mass matrix, and all forces, applied forces and loads in one vector."""
    k = len(formulation.coordinates)
    numbers = np.array([*parameters, 0.0])
    (values,) = formulation.forces.kernel.at(np.concatenate([q, v]), numbers.ctypes.data, 0)
    mass = np.zeros((k, k))
    upper = np.triu_indices(k)
    mass[upper] = values[: len(upper[0])]
    return mass + np.triu(mass, 1).T, values[len(upper[0]) :]


def energies(
    formulation: Formulation, parameters: Array, q: Array, v: Array
) -> tuple[float, float]:
    """Return kinetic and potential energy."""
    numbers = np.array([*parameters, 0.0])
    (values,) = formulation.energies.kernel.at(np.concatenate([q, v]), numbers.ctypes.data, 0)
    return float(values[0]), float(values[1])


def force_slopes(
    formulation: Formulation, parameters: Array, scales: Array, q: Array, v: Array
) -> Array:
    """Return the derivatives ``(k, k)`` of all forces by the coordinates, from differences."""
    k, numbers = len(scales), np.array([*parameters, 0.0])
    changes = np.diag(1e-5 * scales)
    places = np.concatenate([q + changes, q - changes])
    at = np.column_stack([places, np.tile(v, (2 * k, 1))])
    (values,) = formulation.forces.kernel.over(at, numbers.ctypes.data, 0)
    first = k * (k + 1) // 2
    forth, back = values[:k, first : first + k], values[k:, first : first + k]
    return np.asarray((forth - back).T / (2 * np.diag(changes)))


def highest_square(
    formulation: Formulation,
    parameters: Array,
    scales: Array,
    q: Array,
    v: Array,
    equations: tuple[Array, Array] | None = None,
) -> float:
    """Return the square of the highest frequency of small motions about a placement.

    With equations they are those in the tangent space, of the stiffness ``K - sum_j lam_j H_j``,
    where the forces ``lam_j`` balance the others across the equations; ``equations`` has gradients
    ``(j, k)`` and Hessians ``(j, k, k)``.
    """
    mass, forces = mass_and_forces(formulation, parameters, q, v)
    force = forces[: len(scales)]
    if not np.isfinite(force).all():
        return 0.0  # the first step says what is wrong
    stiffness = -force_slopes(formulation, parameters, scales, q, v)
    if not np.isfinite(stiffness).all():
        return 0.0  # at the edge of where the force is defined
    if equations is not None:
        rows, bends = equations
        answer = np.linalg.solve(mass, np.column_stack([rows.T, force]))
        balance = np.linalg.lstsq(rows @ answer[:, :-1], -rows @ answer[:, -1], rcond=None)[0]
        tangent = _tangent(rows, scales)
        mass = tangent.T @ mass @ tangent
        stiffness = tangent.T @ (stiffness - np.tensordot(balance, bends, 1)) @ tangent
    squares = np.abs(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))
    return float(squares.max(initial=0.0))


def highest_damping(
    formulation: Formulation,
    parameters: Array,
    scales: Array,
    q: Array,
    v: Array,
    rows: Array | None = None,
) -> float:
    """Return the highest rate at which applied forces damp small motions about a state.

    Equations with the gradients ``rows`` ``(j, k)`` leave their tangent space.
    """
    now = moment(formulation, parameters, q, v)
    mass, slope = now.mass, np.empty_like(now.mass)
    if not np.isfinite(now.force).all():
        return 0.0  # the first step says what is wrong
    for i, scale in enumerate(scales):
        change = np.zeros(len(scales))
        change[i] = 1e-5 * (scale + abs(v[i]))
        forth = moment(formulation, parameters, q, v + change).applied
        back = moment(formulation, parameters, q, v - change).applied
        with np.errstate(invalid="ignore"):
            slope[:, i] = (forth - back) / (2 * change[i])
    if not np.isfinite(slope).all():
        return 0.0
    tangent = np.diag(scales) if rows is None else _tangent(rows, scales)
    answer = np.linalg.solve(tangent.T @ mass @ tangent, tangent.T @ slope @ tangent)
    return float(-np.linalg.eigvals(answer).real.min(initial=0.0))


def _tangent(rows: Array, scales: Array) -> Array:
    """Return a basis of the directions along equations, as columns."""
    _, sizes, directions = np.linalg.svd(rows * scales)
    rank = int((sizes > 1e-10 * sizes.max(initial=0)).sum())
    return np.asarray(scales[:, None] * directions[rank:].T)

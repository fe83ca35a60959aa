"""First-order motion: wished velocities, projected onto what contacts and limits admit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import names, real, reals, refuse, whole
from polycorner.formulas.expressions import as_expression, as_expressions, written
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import check_fields, checked
from polycorner.motion.bodies import IdenticalBodies, MovingBody
from polycorner.motion.contacts import (
    ContactFamily,
    periods_of,
    position_of,
    time_symbol,
    velocities,
)
from polycorner.motion.formulation import TIME, Formulation, Laws, degree
from polycorner.motion.hulls.contacts import HullContacts
from polycorner.motion.mechanics import MechanicalSystem, State
from polycorner.motion.noise import OPTIONS, MotionOptions, Solver
from polycorner.motion.placements import check_contacts, check_equations, gap_unit
from polycorner.motion.scenes import Scene, overlapping
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.printing import Printed, Sheet, brief, facts, few
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import cached_property

if TYPE_CHECKING:
    import sympy

CROWD = Solver(1e-5, 20_000, options=MotionOptions(zero_gap=1e-7, touching=1e-6, parting=1e-4))


@dataclass(frozen=True, eq=False)
class Drift(MechanicalSystem, Printed):
    """First-order motion in a polyhedron, of one body or of several identical ones.

    Without noise it is Moreau's sweeping process ([Moreau77]): with the tangent cone ``T(q)`` of
    ``D``, the mobility ``B`` and its inverse ``G``,

    .. code-block:: text

        q' = v,    v = argmin over w in T(q), with l(q, w, t) >= 0, of |w - u(q, t)|_G
        u(q, t) = velocity(q, t) - B(q) grad potential(q)

    so that ``u - v = -B J' lam`` with forces ``lam >= 0`` on gaps that touch and do not open, of
    either sign on equations.  Without limits ``|u|^2 = |v|^2 + |u - v|^2`` in the norm of ``G``.
    With noise it is the reflected diffusion ``dq = u dt + sqrt(2 noise B) dW - B J' dlam`` in the
    sense of Ito, with ``noise div B`` added to ``u``: without ``velocity`` its stationary density
    in ``D`` is ``exp(-potential / noise)``.

    Parameters
    ----------
    polyhedron : Polyhedron
        Placements of a body without overlap; unions as well.
    velocity : mapping from str to sympy.Expr, optional
        The wished velocity by coordinate, a function of coordinates and of the time
        (:func:`~polycorner.motion.time_symbol`); zero where it is left out.
    potential : sympy.Expr or SmoothFunction, optional
        An energy, down which a body moves as well: alone, it is a gradient flow in ``D``.
    mobility : mapping from str to sympy.Expr, or (n, n) array, optional
        ``B``, symmetric and positive definite: numbers or functions of the coordinates, by
        coordinate where it is diagonal; default the identity.
    noise : float, optional
        Half the variance of a coordinate over the time and its mobility, in units of the potential:
        ``k_B T``.  Default 0: none.  Seeds are those of ``simulate(noise=Noise(seed=...))``.
    limits : mapping from str to sympy.Expr, optional
        Functions ``l(q, v, t) >= 0`` of coordinates, :func:`~polycorner.velocities` and the time
        that are affine in the velocities.  Noise is not limited.
    count : int, optional
        Number of bodies; default 1.  Without ``between`` they do not meet: an ensemble.
    between : ContactFamily, optional
        Contacts between any two of the bodies, as of :class:`~polycorner.System`; friction and
        restitution do not act.
    exits : mapping from str to float, optional
        A coordinate and its limit: a body that passes it leaves for good.
    scene : Scene, optional
        Names of the bodies in space, and where they touch; of systems of an arrangement.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    A point that wants to go to the right, down a slope at 45 degrees, and stops at a wall:

    >>> from polycorner import Manifold, Polyhedron, simulate
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"slope": y - x, "wall": 1 - x})
    >>> walk = Drift(D, {"x": 1.0})
    >>> path = simulate(walk, walk.state([0.0, 0.0]), 3.0, 0.01)
    >>> path.v[0, 0].round(9).tolist(), path.q[-1, 0].round(9).tolist()
    ([0.5, 0.5], [1.0, 1.0])
    """

    polyhedron: Polyhedron
    velocity: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    potential: Any = 0
    mobility: Any = None
    noise: float = 0.0
    limits: "Mapping[str, sympy.Expr]" = field(default_factory=dict)
    count: int = 1
    between: ContactFamily | HullContacts | None = None
    exits: Mapping[str, float] = field(default_factory=dict)
    scene: Scene | None = None

    def __post_init__(self) -> None:
        for argument in ("velocity", "limits"):
            given = as_expressions(argument, getattr(self, argument))
            object.__setattr__(self, argument, given)
        check_fields(self)
        names("velocity by coordinates of the polyhedron", self.velocity, self.manifold.names)
        self._check_symbols("velocity", {*self.manifold.symbols, time_symbol()})
        own, rates = {*self.manifold.symbols}, velocities(self.manifold)
        self._check_symbols("limits", {*own, *rates, time_symbol()})
        for name, e in self.limits.items():
            if degree(e, rates) != 1:
                refuse("limits", f"a formula that is affine in velocities for {name!r}", e)
            if name in (*self.polyhedron.names, *self.polyhedron.equation_names):
                refuse("limits", "names of their own", name)
        object.__setattr__(self, "noise", real("noise", self.noise, least=0))
        whole("count", self.count, least=1)
        names("exits", self.exits, self.manifold.names)
        if len(self.exits) > 1:
            refuse("exits", "one coordinate", sorted(self.exits))
        if self.between is not None:
            names("position", self.between.position, self.manifold.names)
            if isinstance(self.between, ContactFamily) and self.between.attraction is not None:
                refuse("between", "contacts without attraction", self.between.attraction)
        _ = self.mobility_formulas, self.flow, self.bodies, self.energy
        super().__post_init__()

    def _check_symbols(self, argument: str, known: "set[sympy.Symbol]") -> None:
        for name, e in getattr(self, argument).items():
            if strange := e.free_symbols - known:
                what = ", ".join(sorted(map(str, known)))
                refuse(argument, f"a formula in {what} for {name!r}", sorted(map(str, strange))[0])

    def __repr__(self) -> str:
        """Return how many bodies, coordinates and contacts there are."""
        n, k = self.count, self.manifold.size
        many = f"{n} {'body' if n == 1 else 'bodies'}; {k} coordinate{'s' if k > 1 else ''}"
        gaps = len(self.polyhedron.functions)
        return f"Drift({many}{' each' * (n > 1)}; {gaps} contact{'s' if gaps != 1 else ''})"

    def _sheet(self) -> Sheet:
        energy = "" if self.energy is None else brief(self.energy.expression)
        about = [
            ("bodies", str(self.count)),
            ("coordinates", few(self.manifold.names)),
            ("velocity", few(f"{name}: {brief(e)}" for name, e in self.velocity.items())),
            ("potential", energy),
            ("noise", f"{self.noise:g}" if self.noise else ""),
            ("limits", few(self.limits)),
            ("contacts", few(self.polyhedron.names)),
            ("exits", few(f"{name} > {x:g}" for name, x in self.exits.items())),
        ]
        return Sheet("Drift", (facts((what, told) for what, told in about if told),))

    @property
    def manifold(self) -> Manifold:
        """The configuration manifold of a body."""
        return self.polyhedron.manifold

    @property
    def contacts(self) -> tuple[str, ...]:
        """Names of the unilateral contacts of a body with its surroundings."""
        return self.polyhedron.names

    @property
    def hidden(self) -> frozenset[str]:
        """Names of the equations of unit vectors and quaternions."""
        return self.polyhedron.hidden

    @property
    def solver(self) -> Solver:
        """How exactly steps are solved unless something else is asked for.

        Where bodies touch each other, gaps hold to 1e-7 of the unit of length instead of 1e-9.
        """
        return CROWD if self.bodies.families else Solver()

    # ------------------------------------------------------------------------------- compiled laws

    @cached_property
    def mobility_formulas(self) -> "sympy.Matrix":
        """``B`` as a matrix of formulas."""
        import sympy

        n, given = self.manifold.size, self.mobility
        if given is None:
            return sympy.eye(n)
        if isinstance(given, Mapping):
            names("mobility", given, self.manifold.names)
            own = as_expressions("mobility", given)
            found = sympy.diag(*[own.get(name, sympy.S.One) for name in self.manifold.names])
        else:
            expected = f"a mapping by coordinate, or {n} rows of {n} numbers or formulas"
            rows = given.tolist() if hasattr(given, "tolist") else given
            fits = isinstance(rows, Sequence) and len(rows) == n
            if not fits or any(not isinstance(r, Sequence) or len(r) != n for r in rows):
                refuse("mobility", expected, given)
            found = sympy.Matrix([[as_expression("mobility", e) for e in row] for row in rows])
            if not found.is_symmetric():
                refuse("mobility", "a symmetric matrix", given)
        if strange := found.free_symbols - {*self.manifold.symbols}:
            refuse("mobility", "formulas in the coordinates", sorted(map(str, strange))[0])
        if not found.free_symbols:
            numbers = np.array(found.tolist(), dtype=np.float64)
            if not np.linalg.eigvalsh(numbers)[0] > 0:
                refuse("mobility", "a positive definite matrix", numbers.tolist())
        return found

    @property
    def mobility_varies(self) -> bool:
        """Whether the mobility depends on the coordinates."""
        return bool(self.mobility_formulas.free_symbols)

    @checked
    def mobility_at(self, q: ArrayLike) -> Array:
        """Return ``B(q)``, ``(n, n)``."""
        n, at = self.manifold.size, self.manifold.points(q).ravel()
        if not self.mobility_varies:
            return np.array(self.mobility_formulas.tolist(), dtype=np.float64)
        (values,) = self.mobilities.evaluate(at, order=0)
        found = np.zeros((n, n))
        found[np.tril_indices(n)] = values
        return np.asarray(found + np.tril(found, -1).T)

    @cached_property
    def mobilities(self) -> Family:
        """The lower triangle of the mobility, row by row."""
        n = self.manifold.size
        every = {f"B{i}_{j}": self.mobility_formulas[i, j] for i in range(n) for j in range(i + 1)}
        return Family.of(every, self.manifold.names)

    @cached_property
    def flow(self) -> Family | None:
        """The wished velocity without the potential, over coordinates and time; None if zero."""
        import sympy

        coordinates, found = self.manifold.symbols, {}
        for i, name in enumerate(self.manifold.names):
            e = self.velocity.get(name, sympy.S.Zero)
            if self.noise:
                for j, q in enumerate(coordinates):
                    e += self.noise * sympy.diff(self.mobility_formulas[i, j], q)
            found[f"u_{name}"] = e
        if all(e == 0 for e in found.values()):
            return None
        return Family.of(found, (*self.manifold.names, TIME))

    @cached_property
    def energy(self) -> SmoothFunction | None:
        """The potential as a function; None if there is none."""
        if isinstance(self.potential, SmoothFunction):
            if self.potential.manifold != self.manifold:
                refuse("potential", "a function on the polyhedron's manifold", self.potential)
            return self.potential
        e = as_expression("potential", self.potential)
        return None if e.is_number else SmoothFunction("potential", e, self.manifold)

    @cached_property
    def limit_family(self) -> Family | None:
        """The limits over coordinates, velocities and time."""
        if not self.limits:
            return None
        rates = (v.name for v in velocities(self.manifold))
        return Family.of(self.limits, (*self.manifold.names, *rates, TIME))

    @cached_property
    def bodies(self) -> IdenticalBodies:
        """The bodies and their contacts."""
        scales, coordinates = self.manifold.scale_array, self.manifold.names
        kinetic = sum(v**2 for v in velocities(self.manifold)) / 2
        body = MovingBody(
            Formulation.of(coordinates, (), Laws(kinetic, as_expression("potential", 0))),
            np.empty(0),
            (),
            self.polyhedron.bundle.calls,
            (*self.polyhedron.names, *self.polyhedron.equation_names),
            np.zeros(len(self.polyhedron.functions) + len(self.polyhedron.equations)),
            1 / scales,
            gap_unit(self.manifold),
            len(self.polyhedron.equations),
        )
        between = self.between if self.count > 1 else None
        given = () if self.between is None else self.between.position
        position = position_of(self.manifold, given, {}, several=between is not None)
        contacts = None if between is None else between.compiled(self.manifold)
        leaving = [(coordinates.index(x), float(limit)) for x, limit in self.exits.items()]
        exits = leaving[0] if leaving else (-1, 0.0)
        told = contacts, position, periods_of(self.manifold, position), 0.0
        called = () if self.scene is None else self.scene.names
        return IdenticalBodies(body, self.count, *told, *exits, called)

    # -------------------------------------------------------------------------------------- states

    @shown
    def state(
        self, q: ArrayLike | Mapping[str, float], v: ArrayLike | None = None, time: float = 0.0
    ) -> State:
        """Return a state, after checking that nothing overlaps and that equations hold.

        Parameters
        ----------
        q : (n,) or (count, n) array, or mapping from str to float
            Placement of the body, or of all bodies.
        v : None
            Velocities follow from placements: those of a trajectory are admitted ones.
        time : float, optional
        """
        if v is not None:
            refuse("v", "none, for velocities follow from placements", v)
        if self.count == 1 and (isinstance(q, Mapping) or reals("q", q).ndim < 2):
            places = self.manifold.point(q).copy()
        else:
            # `points` refuses a mapping, which only one body may have.
            places = self.manifold.placed(self.manifold.points(q).copy())  # type: ignore[arg-type]
        if places.size != self.count * self.manifold.size:
            refuse("q", f"shape ({self.count}, {self.manifold.size})", places.shape)
        self.check_placement(places)
        time = real("time", time, unit="s")
        sticking = np.zeros((*places.shape[:-1], 0), dtype=np.bool_)
        return State(time, places, np.zeros(places.shape), sticking)

    @checked
    def check_placement(self, q: Array) -> None:
        """Raise ValueError if a contact overlaps or an equation fails, naming the worst."""
        if self.polyhedron.is_union:
            inside = np.atleast_1d(self.polyhedron.implicit(q))
            i = int(np.argmin(inside))
            if inside[i] < -OPTIONS.overlap * self.bodies.gap_unit:
                who = self.bodies.called(i) if self.count > 1 else "it"
                msg = f"q: expected a point of the polyhedron; {who} is outside by {-inside[i]:.6g}"
                raise ValueError(msg)
        else:
            check_contacts(self.polyhedron, q, self._who)
        check_equations(self.polyhedron, q, self.bodies.called)
        self.bodies.check_apart(q.reshape(self.count, -1))

    def _who(self, contact: str, i: int) -> str:
        """Return what overlaps at a contact with the surroundings, for a message."""
        called = self.bodies.called(i) if self.count > 1 else ""
        return overlapping(self.scene, called, contact, i)

    @checked
    def wished(self, q: ArrayLike, time: float = 0.0) -> Array:
        """Return the wished velocity ``u``, of the shape of ``q``."""
        places = self.manifold.points(q)
        flat = places.reshape(-1, self.manifold.size)
        found = np.zeros(flat.shape)
        if self.flow is not None:
            at = np.column_stack([flat, np.full(len(flat), real("time", time))])
            found += self.flow.evaluate(at, order=0)[0]
        if self.energy is not None:
            found -= [self.mobility_at(at) @ self.energy.gradient(at) for at in flat]
        return np.asarray(found.reshape(places.shape))

    @checked
    def largest_step(self, state: State) -> tuple[float, str]:
        """Return ``2 / c`` with the highest rate ``c`` at which wishes decay: where steps diverge.

        With noise and contacts between bodies, at most the step in which the noise of a coordinate
        is as long as two bodies reach.
        """
        fastest = 0.0
        for q in state.q.reshape(-1, self.manifold.size):
            slopes = np.zeros((self.manifold.size,) * 2)
            if self.flow is not None:
                slopes += self.flow.evaluate(np.append(q, state.time), order=1)[1][:, :-1]
            if self.energy is not None:
                slopes -= self.mobility_at(q) @ self.energy.hessian(q)
            if np.isfinite(slopes).all():
                fastest = max(fastest, float(-np.linalg.eigvals(slopes).real.min()))
        longest = 2 / fastest if fastest > 0 else np.inf
        why = "beyond which the motion is unstable"
        if self.noise and self.bodies.contacts is not None:
            q = state.q.reshape(-1, self.manifold.size)[0]
            units = self.bodies.body.units
            widest = max(self.mobility_at(q)[c, c] * units[c] ** 2 for c in self.bodies.position)
            jump = self.bodies.contacts.reach**2 / (2 * self.noise * widest)
            if jump < longest:
                return jump, "beyond which bodies jump over each other"
        return longest, why

    def described(self) -> dict[str, Any]:
        """Return everything that a motion depends on, by name, as plain values."""
        manifold, B = self.manifold, self.mobility_formulas
        energy = "0" if self.energy is None else written(self.energy.expression)
        told: dict[str, Any] = {
            "coordinates": [*manifold.names],
            "periods": [str(period) for period in manifold.periods],
            "scales": [*manifold.scales],
            "potential": energy,
            "mobility": [[written(e) for e in row] for row in B.tolist()],
            "noise": self.noise,
            "count": self.count,
            "exits": dict(self.exits),
            "formulas": self.bodies.formula_keys,
            "tree": str(self.polyhedron.unions) if self.polyhedron.is_union else "",
        }
        told |= {f"velocity {name}": written(u) for name, u in self.velocity.items()}
        told |= {f"limit {name}": written(e) for name, e in self.limits.items()}
        told |= {f"gap {f.name}": written(f.expression) for f in self.polyhedron.functions}
        told |= {f"equation {h.name}": written(h.expression) for h in self.polyhedron.equations}
        return told | ({} if self.between is None else self.between.described())

"""Assemblies: many bodies of several kinds, each repeated."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.checks import instance, mapping, names, real, reals, refuse, whole
from polycorner.kinds import checked
from polycorner.motion.bodies import IdenticalBodies, PairContacts, SeveralKinds
from polycorner.motion.contacts import ContactFamily, periods_of, position_of
from polycorner.motion.formulation import energies
from polycorner.motion.hulls.contacts import HullContacts
from polycorner.motion.limits import check_limited
from polycorner.motion.mechanics import MechanicalSystem, State
from polycorner.motion.placements import (
    check_contacts,
    check_equations,
    check_ties,
    check_velocities,
)
from polycorner.motion.scenes import Scene, overlapping
from polycorner.motion.system import System, leapfrog_limit
from polycorner.motion.ties import Tie, compiled_ties, described_tie, followers
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False, repr=False)
class Assembly(MechanicalSystem):
    """Many bodies of several kinds with unilateral contacts and friction.

    Bodies are numbered kind after kind, from 0; in messages they are called ``large 1``,
    ``large 2``, ..., ``small 1``, ...

    Parameters
    ----------
    kinds : mapping from str to System
        One body of each kind, with its contacts with the surroundings.  The substrate, if it moves,
        moves under all of them, and the law of impact is that of all.
    count : mapping from str to int
        How many of each there are.
    between : mapping from (str, str) to ContactFamily, optional
        Contacts of any two bodies of one kind, or of two: the first of the pair has the coordinates
        with 1.  Bodies of pairs that are left out pass through each other.
    scene : Scene, optional
        Names of the bodies in space, and where they touch.
    ties : sequence of Tie, optional
        Joints, limits, springs and drives between two of the bodies, or of one and the world.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    Points on a line, of which the heavy ones keep a distance of 2 and the others one of 1:

    >>> from polycorner import Manifold, Polyhedron, System, simulate, velocities
    >>> from polycorner.motion import Assembly, ContactFamily, pair_coordinates
    >>> M = Manifold.euclidean("x")
    >>> (x,), (v,) = M.symbols, velocities(M)
    >>> (one,), (two,) = pair_coordinates(M)
    >>> line = Polyhedron(M, {"left": x, "right": 10 - x})
    >>> def apart(distance):
    ...     return ContactFamily({"apart": ((two - one) ** 2 - distance**2) / 2}, distance, ["x"])
    >>> points = Assembly(
    ...     {"heavy": System(line, 5 * v**2), "light": System(line, v**2 / 2)},
    ...     {"heavy": 2, "light": 2},
    ...     {
    ...         ("heavy", "heavy"): apart(2),
    ...         ("heavy", "light"): apart(1),
    ...         ("light", "light"): apart(1),
    ...     },
    ... )
    >>> start = points.state({"heavy": [[0], [3]], "light": [[5], [8]]}, [1, 0, 0, 0])
    >>> path = simulate(points, start, 2.0, 0.01)
    >>> path["heavy"].q[-1].round(2).tolist(), path.bodies
    ([[1.5], [3.5]], ('heavy 1', 'heavy 2', 'light 1', 'light 2'))
    """

    kinds: Mapping[str, System]
    count: Mapping[str, int]
    between: Mapping[Pair, ContactFamily | HullContacts] = field(default_factory=dict)
    scene: Scene | None = None
    ties: tuple[Tie, ...] = ()

    def __post_init__(self) -> None:
        kinds, count = mapping("kinds", self.kinds), mapping("count", self.count)
        if not kinds:
            refuse("kinds", "at least one kind of body", kinds)
        for name, one in kinds.items():
            instance("kinds: name", name, str)
            instance("kinds", one, System)
        if not isinstance(self.ties, Sequence) or isinstance(self.ties, str):
            refuse("ties", "a sequence of ties", self.ties, TypeError)
        object.__setattr__(self, "ties", tuple([instance("ties", tie, Tie) for tie in self.ties]))
        names("count", count, kinds)
        if missing := [name for name in kinds if name not in count]:
            refuse("count", f"a number for every kind, {missing[0]!r} included", count)
        if self.scene is not None:
            instance("scene", self.scene, Scene)  # type: ignore[type-abstract]
        for name, one in kinds.items():
            whole(f"count of {name!r}", count[name], least=1)
            if one.count != 1 or one.between is not None:
                refuse("kinds", f"one body as {name!r}, counts and contacts apart", one.count)
            if one.impact != next(iter(kinds.values())).impact:
                refuse("kinds", f"the same law of impact for {name!r} as for others", one.impact)
            if {*one.substrate.values()} != {*next(iter(kinds.values())).substrate.values()}:
                refuse("kinds", f"the same substrate for {name!r} as for others", one.substrate)
            if one.exits and (self.ties or any(kind.rheonomic for kind in kinds.values())):
                expected = "none in a system whose bodies have ties or equations with the time"
                refuse("exits", expected, dict(one.exits))
        object.__setattr__(self, "kinds", dict(kinds))
        object.__setattr__(self, "count", {name: int(count[name]) for name in kinds})
        self._order_pairs()
        _ = self.bodies
        super().__post_init__()

    def _order_pairs(self) -> None:
        order, found = list(self.kinds), dict[Pair, ContactFamily | HullContacts]()
        for pair, family in mapping("between", self.between).items():
            if not (isinstance(pair, tuple) and len(pair) == 2):
                refuse("between", "pairs of kinds", pair)
            names("between", pair, self.kinds)
            if not isinstance(family, HullContacts):
                instance("between", family, ContactFamily)
            if order.index(pair[0]) > order.index(pair[1]):
                refuse("between", f"pairs in the order of the kinds, {', '.join(order)}", pair)
            either = {n for name in pair for n in self.kinds[name].manifold.names}
            names("position", family.position, either)
            found[pair] = family
        object.__setattr__(self, "between", found)

    def __repr__(self) -> str:
        """Return how many bodies of which kinds there are."""
        return f"Assembly({', '.join(f'{n} {name}' for name, n in self.count.items())})"

    @cached_property
    def bodies(self) -> SeveralKinds:
        """The bodies and their contacts, for the engine."""
        order = list(self.kinds)
        own = {name: self._kind(name) for name in order}
        between: dict[tuple[int, int], PairContacts] = {}
        for (one, two), family in self.between.items():
            if one != two:
                spaces = self.kinds[one].manifold, self.kinds[two].manifold
                between[order.index(one), order.index(two)] = family.compiled(*spaces)
        lengths = {kind.period for kind in own.values()}
        if len(lengths) > 1:
            refuse("kinds", "positions that repeat after the same lengths", sorted(lengths))
        first = next(iter(own.values()))
        counted = [(self.kinds[name].manifold, n) for name, n in self.count.items()]
        every = SeveralKinds(own, between, first.period, first.substrate_speed, impact=first.impact)
        ties = [*self.ties]
        for kind, *at in zip(self.kinds.values(), every.starts, every.starts[1:], strict=False):
            ties += followers(kind.rheonomic, range(*at))
        return replace(every, ties=compiled_ties(ties, counted, every.names))

    def _kind(self, name: str) -> IdenticalBodies:
        """Return the bodies of one kind, whose position is that of all pairs that it is in."""
        kind, family = self.kinds[name], self.between.get((name, name))
        given = [n for pair, f in self.between.items() if name in pair for n in f.position]
        chosen = [n for n in dict.fromkeys(given) if n in kind.manifold.names]
        if len(chosen) > 3:
            refuse("position", f"up to three coordinates of {name!r}", chosen)
        position = position_of(kind.manifold, chosen, kind.substrate, several=bool(chosen))
        return replace(
            (replace(kind, rheonomic={}) if kind.rheonomic else kind).bodies,
            count=self.count[name],
            contacts=None if family is None else family.compiled(kind.manifold),
            position=position,
            period=periods_of(kind.manifold, position),
        )

    @property
    def hidden(self) -> frozenset[str]:
        """Names of the equations of unit vectors and quaternions."""
        return frozenset().union(*(kind.hidden for kind in self.kinds.values()))

    def split(self, values: ArrayLike) -> dict[str, Array]:
        """Return coordinates or velocities ``(..., D)`` of all bodies by kind, ``(..., n, k)``."""
        every = reals("values", values)
        if every.shape[-1:] != self.bodies.shape:
            refuse("values", f"an array (..., {self.bodies.shape[0]})", every.shape)
        return dict(zip(self.kinds, self.bodies.split(every), strict=True))

    def _joined(self, argument: str, given: Any) -> Array:
        """Return coordinates or velocities ``(D,)``, given so or by kind."""
        if not isinstance(given, Mapping):
            flat = reals(argument, given)
            if flat.shape != self.bodies.shape:
                refuse(argument, f"a mapping by kind, or shape {self.bodies.shape}", flat.shape)
            return flat.copy()
        names(argument, given, self.kinds)
        parts = []
        for name, n in self.count.items():
            shape = n, self.kinds[name].manifold.size
            if name not in given and argument == "q":
                refuse(argument, f"placements of every kind, {name!r} included", [*given])
            part = reals(f"{argument} of {name!r}", given.get(name, np.zeros(shape)))
            if part.shape != shape:
                refuse(f"{argument} of {name!r}", f"shape {shape}", part.shape)
            parts.append(part.ravel())
        return np.concatenate(parts)

    def state(
        self,
        q: ArrayLike | Mapping[str, ArrayLike],
        v: ArrayLike | Mapping[str, ArrayLike] | None = None,
        time: float = 0.0,
    ) -> State:
        """Return a state, after checking that nothing overlaps and that equations hold.

        Parameters
        ----------
        q : mapping from str to (n, k) array, or (D,) array
            Placements by kind, or all coordinates, body after body.
        v : the same, optional
            Velocities; default those of the substrate, of kinds that are left out zero.
        time : float, optional
        """
        places = self._joined("q", q)
        speeds = np.zeros(places.shape) if v is None else self._joined("v", v)
        moved = self.split(speeds)
        if v is None:
            for name, kind in self.kinds.items():
                for coordinate, speed in kind.substrate.items():
                    moved[name][:, kind.manifold.names.index(coordinate)] = speed
        each = self.split(places)
        for name, kind in self.kinds.items():
            each[name][:] = kind.manifold.placed(each[name].copy())
        self.check_placement(places)
        sticks = [np.empty(0, dtype=np.bool_)]
        for name, kind in self.kinds.items():
            check_velocities(kind.polyhedron, each[name], moved[name], self._called(name))
            sticks.append(kind.sticks(each[name], moved[name]).ravel())
        time = real("time", time, unit="s")
        for name, kind in self.kinds.items():
            known = kind.velocity_limits, kind.manifold.scale_array
            check_limited(*known, each[name], moved[name], time, self._called(name))
        check_ties(self.bodies, self.bodies.padded(places), self.bodies.padded(speeds), time)
        return State(time, places, speeds, np.concatenate(sticks))

    @checked
    def check_placement(self, q: Array) -> None:
        """Raise ValueError if a contact overlaps or an equation fails, naming the worst."""
        for name, places in self.split(q).items():
            kind, called = self.kinds[name], self._called(name)
            check_contacts(kind.polyhedron, places, partial(self._who, name))
            check_equations(kind.polyhedron, places, called)
        self.bodies.check_apart(self.bodies.padded(q))
        self.bodies.check_crossed(self.bodies.padded(q), self.scene)

    def _called(self, name: str) -> Callable[[int], str]:
        """Return what gives the bodies of a kind their names in messages."""
        start = self.bodies.starts[list(self.kinds).index(name)]
        return lambda i: self.bodies.called(start + i)

    def _who(self, name: str, contact: str, i: int) -> str:
        """Return what overlaps at a contact of a body of a kind, for a message."""
        i += self.bodies.starts[list(self.kinds).index(name)]
        return overlapping(self.scene, self.bodies.called(i), contact, i)

    @checked
    def energies(self, state: State) -> tuple[float, float]:
        """Return kinetic and potential energy of all bodies and ties."""
        kinetic, potential = 0.0, self.bodies.ties.energy(self.bodies.padded(state.q))
        q, v = self.split(state.q), self.split(state.v)
        for name in self.kinds:
            kind = self.kinds[name]
            for at in zip(q[name], v[name], strict=True):
                some = energies(kind.formulation, kind.parameters, *at)
                kinetic, potential = kinetic + some[0], potential + some[1]
        return kinetic, potential

    @checked
    def largest_step(self, state: State) -> tuple[float, str]:
        """Return ``2 / omega`` with the highest frequency of small motions of any body."""
        q, v = self.split(state.q), self.split(state.v)
        return leapfrog_limit(
            [(kind, q[name], v[name]) for name, kind in self.kinds.items()],
            self.bodies.ties,
            state.time,
        )

    def described(self) -> dict[str, Any]:
        """Return everything that a motion depends on, by name, as plain values."""
        told: dict[str, Any] = {"formulas": self.bodies.formula_keys, "count": dict(self.count)}
        for name, kind in self.kinds.items():
            known = {key: value for key, value in kind.described().items() if key != "formulas"}
            told |= {f"{name}: {key}": value for key, value in known.items()}
        for (one, two), family in self.between.items():
            told |= {f"{one}-{two}: {key}": value for key, value in family.described().items()}
        if self.ties:
            told["ties"] = [described_tie(tie) for tie in self.ties]
        return told

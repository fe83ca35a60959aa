"""Descriptions of bodies and of their contacts: what the engine needs to know of a system."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.bundles import Call
from polycorner.formulas.families import Family
from polycorner.motion.attraction import Attraction
from polycorner.motion.convex_sets import ConvexSet, in_words
from polycorner.motion.formulation import Formulation
from polycorner.motion.noise import OPTIONS
from polycorner.motion.scenes import Rubbing, Scene
from polycorner.motion.tie_forms import NO_TIES, Ties
from polycorner.printing import number
from polycorner.spaces.manifold import Array
from polycorner.values import Value, cached_property

# Causes of dissipation.
IMPACT = "impact"
RUBBING = "rubbing"
IMPACT_LAWS = ("poisson", "newton", "stronge", "newton unlimited")


@dataclass(frozen=True)
class FrictionContact(Value):
    """One friction contact of a body.

    Attributes
    ----------
    name : str
    rows : int
        Components of its slip velocity, 1 or 2.
    static, dynamic : ConvexSet
        Admissible forces per unit load while it sticks and while it slips.
    gap : int
        Number of the contact or equation whose force is the load, or -1: the load is known.
    loads : tuple of int
        Numbers of the known loads whose sum is the load; empty if a contact presses.
    cause : str
        Cause under which its dissipation is booked.
    """

    name: str
    rows: int
    static: ConvexSet
    dynamic: ConvexSet
    gap: int
    loads: tuple[int, ...]
    cause: str


@dataclass(frozen=True, eq=False)
class BodyLimits(Value):
    """Limits on the velocities of a body, compiled.

    Attributes
    ----------
    rows : Family
        ``f(q, v, t)``: limits ``f >= 0``, then nonholonomic equations ``f = 0``; variables are the
        coordinates, the velocities and the time.
    equations : int
        Number of the equations.
    timed, curved : bool
        Whether any depends on the time, and whether any is not affine in the velocities.
    """

    rows: Family
    equations: int
    timed: bool
    curved: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The names of limits and equations."""
        return self.rows.names


@dataclass(frozen=True, eq=False)
class MovingBody(Value):
    """One body, or a whole system that is not repeated.

    Attributes
    ----------
    formulation, parameters
        Its equations of motion and the values of their parameters.
    friction : tuple of FrictionContact
    gaps : sequence of Call
        Kernels of the gaps between the body and its surroundings.
    contacts : tuple of str
        Names of these gaps, of the equations last.
    restitution : (m,) array
        Coefficient of restitution of each of them.
    units : (k,) array
        Length that a unit of each coordinate stands for; it turns velocities into speeds that can
        be compared.
    gap_unit : float
        Length by which gaps are scaled.
    equations : int
        How many of the gaps are equations: they remain zero, by forces of either sign.
    lever : (k,) array
        How far a unit of each coordinate turns points of the hulls, rounded or not, that the gaps
        are distances of, beside what moves all of them alike; empty where gaps are others.
    signals : Family, optional
        Functions of the time, computed once a step for all bodies.  Their values are the parameters
        of the formulation that follow the time.
    signal_parameters : array
        Values of the parameters of the signals.
    slow_signals : bool
        Whether they change as slowly as the substrate carries bodies, so that a body at rest need
        not be examined in every step.
    limits : BodyLimits, optional
        Limits on its velocities.
    """

    formulation: Formulation
    parameters: Array
    friction: tuple[FrictionContact, ...]
    gaps: Sequence[Call]
    contacts: tuple[str, ...]
    restitution: Array
    units: Array
    gap_unit: float
    equations: int = 0
    lever: Array = field(default_factory=lambda: np.empty(0))
    signals: Family | None = None
    signal_parameters: Array = field(default_factory=lambda: np.empty(0))
    slow_signals: bool = False
    limits: BodyLimits | None = None

    @property
    def limit_names(self) -> tuple[str, ...]:
        """Names of the limits on its velocities, and of the nonholonomic equations."""
        return () if self.limits is None else self.limits.names

    @property
    def timed(self) -> bool:
        """Whether equations have the time, which their kernels read after all coordinates."""
        return any(map(self.reads_time, self.gaps))

    def reads_time(self, call: Call) -> bool:
        """Whether a kernel of gaps does."""
        return max(call.reads, default=-1) >= len(self.formulation.coordinates)


@dataclass(frozen=True)
class PairLaw(Value):
    """One law of friction between bodies, which holds at each of their gaps.

    Attributes
    ----------
    rows : int
        Components of its slip velocity, 1 or 2.
    static, dynamic : ConvexSet
        Admissible forces per unit normal force while it sticks and while it slips.
    cause : str
        Cause under which its dissipation is booked.
    """

    rows: int
    static: ConvexSet
    dynamic: ConvexSet
    cause: str = RUBBING


@dataclass(frozen=True, eq=False)
class PairContacts(Value):
    """The contacts between any two of several identical bodies, or of two kinds.

    Attributes
    ----------
    gaps : Family
        Gaps of a pair.
    parameters : sequence of float
    reads : tuple of (int, int)
        For each variable of the gaps the body, 0 or 1 (of the second kind), and its coordinate.
    slips : tuple of (Family, bool, sequence of float)
        For each gap the slip velocities at its contact (the rows of all laws; variables: the
        coordinates that the gaps read, then all velocities of both bodies), whether the bodies
        are exchanged in them, and their parameters; empty without friction.
    laws : tuple of PairLaw
    restitution : float
    reach : float
        Distance of body positions beyond which two bodies cannot touch.
    attraction : Attraction, optional
        At each of the gaps.
    """

    gaps: Family
    parameters: tuple[float, ...]
    reads: tuple[tuple[int, int], ...]
    slips: "tuple[tuple[Family, bool, tuple[float, ...]], ...]"
    laws: tuple[PairLaw, ...]
    restitution: float
    reach: float
    attraction: Attraction | None = None

    @property
    def range(self) -> float:
        """The gap at which the attraction vanishes; 0 without any."""
        return 0.0 if self.attraction is None else self.attraction.range

    def rows(self) -> Iterator[tuple[str, str, str]]:
        """Yield of each gap its name, friction and restitution in words."""
        friction = in_words((law.cause, law.static, law.dynamic) for law in self.laws)
        for name in self.gaps.names:
            yield name, friction, number(self.restitution, 6)


class MovingBodies(Value):
    """Bodies that may touch each other, numbered kind after kind; base of what the engine moves.

    Attributes
    ----------
    kinds : tuple of IdenticalBodies
    families : mapping from (int, int) to PairContacts
        Contacts of any two bodies, by their kinds, the lower number first.
    period : tuple of float
        After which each component of a position repeats, as a length; infinite if it does not.
    substrate_speed : float
        Speed of the substrate along the first of them, as a length per time.
    ties : Ties
        Ties of two bodies, or of one and the world.
    impact : str
        The law of impacts, one of ``IMPACT_LAWS``.
    """

    period: tuple[float, ...]
    substrate_speed: float
    ties: Ties
    impact: str

    @property
    def kinds(self) -> "tuple[IdenticalBodies, ...]":
        """The kinds of bodies."""
        raise NotImplementedError

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bodies, for messages; of a dense system of those that it consists of."""
        return tuple(
            f"{label} {k}"
            for label, kind in zip(self.labels, self.kinds, strict=True)
            for k in range(1, kind.count + 1)
        )

    def called(self, i: int) -> str:
        """Return what a body is called in messages: its name, or else its number."""
        if len(self.names) != self.total:
            return f"body {i}"
        return f"body {self.names[i]!r}"

    @cached_property
    def rubbing(self) -> tuple[Rubbing, ...]:
        """The laws of friction: of each kind with its surroundings, then of pairs, gap by gap."""
        own = [
            Rubbing(kind.body.contacts[f.gap] if f.gap >= 0 else f.name, f.cause, f.rows)
            for kind in self.kinds
            for f in kind.body.friction
        ]
        pair = [
            Rubbing(g, law.cause, law.rows)
            for family in self.families.values()
            for g in family.gaps.names
            for law in family.laws
        ]
        return (*own, *pair)

    @property
    def families(self) -> Mapping[tuple[int, int], PairContacts]:
        """The contacts of any two bodies."""
        raise NotImplementedError

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the kinds; empty if bodies have numbers only."""
        return ()

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """The number of the first body of each kind, and of all bodies."""
        return (0, *np.cumsum([kind.count for kind in self.kinds]).tolist())

    @cached_property
    def slices(self) -> "tuple[tuple[IdenticalBodies, slice], ...]":
        """Each kind, and where its bodies are among all."""
        return tuple(
            (kind, slice(*at)) for kind, at in zip(self.kinds, pairwise(self.starts), strict=True)
        )

    @cached_property
    def total(self) -> int:
        """The number of bodies."""
        return self.starts[-1]

    @cached_property
    def kind_of(self) -> NDArray[np.int64]:
        """The kind of each body, ``(N,)``."""
        return np.repeat(np.arange(len(self.kinds)), [kind.count for kind in self.kinds])

    @property
    def width(self) -> int:
        """Number of coordinates of the kind that has most of them, ``k``; others end with zeros."""
        return max(kind.dimension for kind in self.kinds)

    @cached_property
    def units(self) -> Array:
        """Length that a unit of each coordinate stands for, ``(N, k)``; 1 where there is none."""
        found = np.ones((self.total, self.width))
        for kind, at in self.slices:
            found[at, : kind.dimension] = kind.body.units
        return found

    @property
    def frictions(self) -> int:
        """Number of the friction contacts of all bodies with their surroundings."""
        return sum(kind.count * len(kind.body.friction) for kind in self.kinds)

    @property
    def bounces(self) -> bool:
        """Whether a contact has a coefficient of restitution that is not zero."""
        own = [kind.body.restitution.any() for kind in self.kinds]
        pairs = [family.restitution for family in self.families.values()]
        return any((*own, *pairs, *self.ties.restitution))

    @property
    def attracts(self) -> bool:
        """Whether any two bodies attract each other."""
        return any(family.attraction is not None for family in self.families.values())

    @property
    def gap_unit(self) -> float:
        """Length by which gaps are scaled."""
        return min(kind.body.gap_unit for kind in self.kinds)

    @cached_property
    def causes(self) -> tuple[str, ...]:
        """Causes of dissipation."""
        causes = [c.cause for kind in self.kinds for c in kind.body.friction]
        causes += [law.cause for family in self.families.values() for law in family.laws]
        causes += [friction.cause for friction in self.ties.friction]
        return tuple(dict.fromkeys([IMPACT, *causes]))

    @cached_property
    def contact_names(self) -> tuple[str, ...]:
        """Names of all contacts: of bodies with their surroundings, of pairs, ties, then limits."""
        own = [name for kind in self.kinds for name in kind.body.contacts]
        pairs = [name for family in self.families.values() for name in family.gaps.names]
        return tuple(dict.fromkeys((*own, *pairs, *self.ties.names, *self.limit_names)))

    @cached_property
    def limit_names(self) -> tuple[str, ...]:
        """Names of all limits on velocities, each once: causes under which work is booked."""
        return tuple(dict.fromkeys(n for kind in self.kinds for n in kind.body.limit_names))

    @property
    def formula_keys(self) -> list[str]:
        """Keys of all compiled formulas: they identify expressions to the last digit."""
        found = []
        for kind in self.kinds:
            body = kind.body
            found.append(body.formulation.key)
            if body.signals is not None:
                found.append(f"{body.signals.key} {body.signal_parameters.tolist()}")
            found += [f"{call.family.key} {call.parameters.tolist()}" for call in body.gaps]
            found += [] if body.limits is None else [body.limits.rows.identity]
        for contacts in self.families.values():
            found += [contacts.gaps.key, *(family.key for family, _, _ in contacts.slips)]
        for form in self.ties.forms:
            found += [f.identity for f in (form.rows, form.slips, form.forces) if f]
        return found

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of a record of all coordinates: ``(N, k)``, of kinds with names ``(D,)``."""
        if not self.labels:
            return self.total, self.width
        return (sum(kind.count * kind.dimension for kind in self.kinds),)

    def split(self, values: Array) -> list[Array]:
        """Return records ``(..., *shape)`` by kind, ``(..., n, k)``."""
        ahead = values.shape[: values.ndim - len(self.shape)]
        ends = np.cumsum([kind.count * kind.dimension for kind in self.kinds])[:-1]
        parts = np.split(values.reshape(*ahead, -1), ends, axis=-1)
        return [
            part.reshape(*ahead, kind.count, kind.dimension)
            for part, kind in zip(parts, self.kinds, strict=True)
        ]

    def padded(self, q: Array) -> Array:
        """Return the coordinates of all bodies, kind after kind, as ``(N, k)`` with zeros."""
        found = np.zeros((self.total, self.width))
        for (kind, at), part in zip(self.slices, self.split(q.reshape(self.shape)), strict=True):
            found[at, : kind.dimension] = part
        return found

    def unpadded(self, q: Array) -> Array:
        """Return coordinates ``(..., N, k)``, of several kinds as ``(..., D)`` without zeros."""
        if not self.labels:
            return q.copy()
        parts = [q[..., at, : kind.dimension] for kind, at in self.slices]
        return np.concatenate([part.reshape(*q.shape[:-2], -1) for part in parts], axis=-1)

    def check_places(self, q: Array, v: Array, dt: float) -> None:
        """Raise ValueError where a body, now or a step later, is farther than numbers resolve gaps.

        That is where the next number is farther than the unit of gaps, or nowhere.
        """
        for kind, at in self.slices:
            k, unit = kind.dimension, kind.body.gap_unit
            with np.errstate(all="ignore"):
                far = (abs(q[at, :k]) + dt * abs(v[at, :k])) * kind.body.units
                lost = np.argwhere(~(np.spacing(far) < unit))
            if len(lost):
                i, c = lost[0].tolist()
                name, i = kind.body.formulation.coordinates[c], i + at.start
                msg = (
                    f"state: expected coordinates that numbers resolve to {unit:g}, the "
                    f"unit of gaps, also a step later; got {name} = {q[i, c]:.6g} of "
                    f"{self.called(i)} with the velocity {v[i, c]:.6g}"
                )
                raise ValueError(msg)

    def positions(self, q: Array) -> Array:
        """Return the positions of all bodies as lengths, ``(N, 3)``, zero where they have none."""
        found = np.zeros((self.total, 3))
        for kind, at in self.slices:
            for component, c in enumerate(kind.axes):
                if c >= 0:
                    found[at, component] = q[at, c] * kind.body.units[c]
        return found

    def check_apart(self, q: Array) -> None:
        """Raise ValueError if two bodies overlap, naming those that do most; ``q`` as below."""
        gap, (i, j), name = self.least_pair_gap(q)
        if gap < -OPTIONS.overlap * self.gap_unit:
            one, two = (self.called(k).removeprefix("body ") for k in (i, j))
            who = f"bodies {one} and {two}"
            msg = (
                f"q: expected a placement without overlap; {who} overlap by "
                f"{-gap:.6g} at contact {name!r}"
            )
            raise ValueError(msg)

    def check_crossed(self, q: Array, scene: Scene | None) -> None:
        """Raise ValueError if two bodies cross each other, or one and a fixed body.

        ``q`` as below.  Only a scene knows of this.
        """
        if scene is None or not scene.can_cross:
            return
        some = [(i,) for i in range(self.total)]
        for bodies in (*some, *(pair for pair, _, _ in self.near_pairs(q))):
            if names := scene.crossed(bodies, q):
                one, two = sorted(names)
                msg = (
                    f"q: expected a placement without overlap; bodies {one!r} and {two!r} cross "
                    f"each other"
                )
                raise ValueError(msg)

    def least_pair_gap(self, q: Array) -> tuple[float, tuple[int, int], str]:
        """Return the least gap between two bodies, the bodies, and the contact.

        Parameters
        ----------
        q : (N, k) array
            Placements of all bodies.

        Returns
        -------
        gap : float
            ``inf`` if no two bodies are near enough to touch.
        bodies : (int, int)
        contact : str
        """
        least = (np.inf, (0, 0), "")
        for (i, j), names, values in self.near_pairs(q):
            worst = int(np.argmin(values))
            least = min(least, (float(values[worst]), (i, j), names[worst]))
        return least

    def near_pairs(
        self, q: Array, beyond: float = 0.0
    ) -> Iterator[tuple[tuple[int, int], tuple[str, ...], Array]]:
        """Yield pairs of bodies within their reach, or not far beyond, and names and gaps.

        ``beyond`` is a length, as the reach.
        """
        positions, starts = self.positions(q), self.starts
        tied = {(min(pair), max(pair)) for pair in self.ties.apart}
        for (a, b), contacts in self.families.items():
            numbers = np.array([*contacts.parameters, 0.0])
            for i in range(starts[a], starts[a + 1]):
                first = max(i + 1, starts[b])
                away = positions[first : starts[b + 1]] - positions[i]
                for component, period in enumerate(self.period):
                    if np.isfinite(period):
                        x = away[:, component]
                        x -= period * np.floor(x / period + 0.5)
                near = np.flatnonzero(np.linalg.norm(away, axis=1) < contacts.reach + beyond)
                for j in (first + near).tolist():
                    if (i, j) in tied:
                        continue
                    at = np.array([q[(i, j)[body], c] for body, c in contacts.reads])
                    (values,) = contacts.gaps.kernel.at(at, numbers.ctypes.data, 0)
                    yield (i, j), contacts.gaps.names, values

    def touching(self, q: Array, limit: float) -> list[tuple[tuple[int, ...], str]]:
        """Return the bodies and names of the contacts whose gaps are within a scaled limit."""
        found: list[tuple[tuple[int, ...], str]] = []
        length = limit * self.gap_unit
        for kind, at in self.slices:
            body, places = kind.body, np.ascontiguousarray(q[at, : kind.dimension])
            gaps = np.full((kind.count, len(body.contacts)), np.inf)
            for call in body.gaps:
                if body.reads_time(call):
                    continue
                (values,) = call.family.kernel.over(
                    places[:, list(call.reads)], call.parameters.ctypes.data, 0
                )
                gaps[:, list(call.rows)] = values[:, list(call.columns)]
            unilateral = len(body.contacts) - body.equations
            found += [
                ((at.start + int(i),), body.contacts[g])
                for i, g in np.argwhere(gaps[:, :unilateral] <= length)
            ]
        for bodies, names, values in self.near_pairs(q, 2 * limit):
            found += [(bodies, names[g]) for g in np.flatnonzero(values <= length)]
        return found


@dataclass(frozen=True, eq=False)
class IdenticalBodies(MovingBodies):
    """``count`` identical bodies that may touch each other.

    Attributes
    ----------
    body : MovingBody
    count : int
    contacts : PairContacts, optional
        Contacts between the bodies; none by default.
    position : tuple of int
        The two or three coordinates that are a body's position; one twice if there is only one.
    period : tuple of float
        After which each of these repeats, as a length; infinite if it does not.
    substrate_speed : float
        Speed of the substrate along the first of them, as a length per time.
    exit_coordinate, exit_limit : int, float
        A body leaves when this coordinate exceeds the limit; -1: never.
    names : tuple of str
        Of the bodies; of a dense system of those that it consists of.
    ties : Ties
        As of :class:`MovingBodies`; none by default.
    impact : str
        The same.
    """

    body: MovingBody
    count: int = 1
    contacts: PairContacts | None = None
    position: tuple[int, ...] = (0, 0)
    period: tuple[float, ...] = (np.inf, np.inf)
    substrate_speed: float = 0.0
    exit_coordinate: int = -1
    exit_limit: float = 0.0
    names: tuple[str, ...] = ()
    ties: Ties = NO_TIES
    impact: str = IMPACT_LAWS[0]

    @property
    def kinds(self) -> "tuple[IdenticalBodies, ...]":
        """The only kind."""
        return (self,)

    @property
    def families(self) -> Mapping[tuple[int, int], PairContacts]:
        """The contacts between two bodies, if there are any."""
        return {} if self.contacts is None or self.count < 2 else {(0, 0): self.contacts}

    @property
    def dimension(self) -> int:
        """Number of coordinates of one body."""
        return len(self.body.formulation.coordinates)

    @property
    def axes(self) -> tuple[int, int, int]:
        """The coordinates that are the components of the position, -1 where there is none.

        A single coordinate is the second component.
        """
        one, two, three = (*self.position, -1)[:3]
        return (-1, two, three) if one == two else (one, two, three)


@dataclass(frozen=True, eq=False)
class SeveralKinds(MovingBodies):
    """Bodies of several kinds that may touch each other.

    Attributes
    ----------
    named : mapping from str to IdenticalBodies
        The kinds by name; the contacts among bodies of one kind are its own.
    between : mapping from (int, int) to PairContacts
        Contacts of bodies of different kinds, by their numbers, the lower first.
    period : tuple of float
        As of :class:`IdenticalBodies`; those of the kinds are not used.
    ties : Ties
        The same.
    impact : str
        The same.
    """

    named: Mapping[str, IdenticalBodies]
    between: Mapping[tuple[int, int], PairContacts]
    period: tuple[float, ...] = (np.inf, np.inf)
    substrate_speed: float = 0.0
    ties: Ties = NO_TIES
    impact: str = IMPACT_LAWS[0]

    @property
    def kinds(self) -> tuple[IdenticalBodies, ...]:
        """The kinds in their order."""
        return tuple(self.named.values())

    @property
    def labels(self) -> tuple[str, ...]:
        """The names of the kinds."""
        return tuple(self.named)

    @cached_property
    def families(self) -> Mapping[tuple[int, int], PairContacts]:
        """The contacts of any two bodies, by their kinds."""
        own = {(a, a): kind.families[0, 0] for a, kind in enumerate(self.kinds) if kind.families}
        return dict(sorted({**own, **self.between}.items()))

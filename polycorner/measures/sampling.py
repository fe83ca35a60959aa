"""Points of strata by constrained Monte Carlo that moves between them ([HC20], [ZHG]).

The chain is :mod:`polycorner.measures.chain.moves`.  A point on which more contacts vanish than are
held is never proposed: corners with more contacts than dimensions are left out, and with them
strata on which gradients are dependent.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner import checks
from polycorner.formulas.bundles import Bundle
from polycorner.kinds import checked
from polycorner.measures.chain.intermediate import SHIPPED
from polycorner.measures.chain.records import BITS, CHAIN, SYSTEM
from polycorner.measures.estimates import Estimate, ratio_of_means, series_mean
from polycorner.measures.weighting import PLAIN, Weighting, factors, posed
from polycorner.polyhedra.faces import project
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient
from polycorner.printing import Printed, Sheet, Table, listed, names, number
from polycorner.progress import Progress, silent
from polycorner.searches import Task, work_through
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property
from polycorner.workers import Shared, opened_if_any

Codes = NDArray[np.int64]


@dataclass(frozen=True)
class SampleOptions(Checked):
    """The moves of a chain, and what is recorded of it.

    Lengths are in the scale units of the manifold.

    Attributes
    ----------
    step : float
        Standard deviation of a step within a stratum.
    sideways : float
        That of the step along the lower stratum with which a contact is gained or lost.
    reach : float
        Distance over which contacts are gained and lost.
    gain, lose : float
        Probabilities with which these moves are tried; what is left is for steps within a stratum.
    every : int
        Steps from one point that is recorded to the next.
    discarded : int
        Points that are left out at the beginning of every chain.
    block : int
        Steps between two reports of progress, and two looks for Ctrl-C.

    Raises
    ------
    TypeError, ValueError
        Unless all are positive and probabilities leave something for steps within a stratum.
    """

    step: float = 0.3
    sideways: float = 0.1
    reach: float = 0.3
    gain: float = 0.25
    lose: float = 0.25
    every: int = 1
    discarded: int = 1000
    block: int = 200_000

    def __post_init__(self) -> None:
        for name in ("step", "sideways", "reach", "gain", "lose"):
            checks.real(name, getattr(self, name), above=0)
        checks.real("gain + lose", self.gain + self.lose, below=1)
        for name, least in (("every", 1), ("discarded", 0), ("block", 1)):
            checks.whole(name, getattr(self, name), least=least, most=checks.MOST)
        super().__post_init__()


STEPS = SampleOptions()


@dataclass(frozen=True, eq=False)
class ChainState(Checked):
    """Where a chain is.

    ``held`` is 1 for contacts that are held, ``stream`` the state of its random numbers.
    """

    point: Array
    held: Codes
    stream: int


@dataclass(frozen=True, eq=False)
class StratifiedSampler(Checked):
    """A polyhedron, how its strata are weighed, and which of them are sampled.

    Attributes
    ----------
    polyhedron : Polyhedron
        All of its inequalities hold together.
    weighting : Weighting
    contacts : (int, int)
        How many contacts are held at least and at most.
    keep : tuple of str
        Contacts that are always held.
    options : SampleOptions
    """

    polyhedron: Polyhedron
    weighting: Weighting = PLAIN
    contacts: tuple[int, int] = (0, 0)
    keep: tuple[str, ...] = ()
    options: SampleOptions = STEPS

    @cached_property
    def _laid(self) -> tuple[bytes, Any]:
        """The system as a table for the compiled chain, and what the addresses in it belong to."""
        d, energy, o = self.polyhedron, posed(self.weighting, self.polyhedron), self.options
        charged = energy is not None
        functions = (*d.functions, *d.equations, *((energy,) if energy is not None else ()))
        bundle = Bundle(d.manifold, functions)
        values = {
            **bundle.tabulated(1),
            "scales": d.manifold.scale_array,
            "inequalities": len(d.functions),
            "rows": len(functions),
            "charged": int(charged),
            "temperature": self.weighting.temperature,
            "sticky": int(self.weighting.gradients),
            "weights": np.log(factors(self.weighting, d.names)),
            "fixed": np.isin(d.names, self.keep),
            "least": self.contacts[0],
            "most": self.contacts[1],
            **{name: getattr(o, name) for name in ("step", "sideways", "reach", "gain", "lose")},
            "zero": DEFAULT.zero,
            "settled": DEFAULT.held,
            "same": DEFAULT.same,
            "singular": DEFAULT.rank,
        }
        table, arrays = SYSTEM.table(values[name] for name in SYSTEM.declared)
        return table, (arrays, bundle)

    def run(self, state: ChainState, count: int) -> tuple[ChainState, Array, Codes, Codes]:
        """Record ``count`` points; return where the chain ended, points, codes and moves."""
        d = self.polyhedron
        u, held = state.point / d.manifold.scale_array, state.held.copy()
        stream = np.array([state.stream], dtype=np.int64)
        points = np.empty((count, len(u)))
        codes = np.zeros((count, max(1, -(-len(held) // BITS))), dtype=np.int64)
        counts = np.zeros(6, dtype=np.int64)
        values = (u, held, stream, self.options.every, points, codes, counts)
        table, _arrays = CHAIN.table(values)
        if not SHIPPED.functions[0](self._laid[0], table)[0]:
            msg = "starts: expected contacts with independent gradients at every start"
            raise ValueError(msg)
        last = ChainState(u * d.manifold.scale_array, held, int(stream[0]))
        return last, points, codes, counts

    def begin(self, argument: str, q: Array, stream: int) -> ChainState:
        """Return a chain that begins at a point of D, held where contacts vanish."""
        d = self.polyhedron
        quotient = Quotient(
            d, equations=tuple(range(len(d.functions), len(d.functions) + len(d.equations)))
        )
        away = quotient.at(q).distances[: len(d.functions)]
        held = away <= DEFAULT.same
        if (away < -DEFAULT.same).any():
            checks.refuse(argument, "points of the polyhedron", q)
        low, high = self.contacts
        if not low <= held.sum() <= high or not held[np.isin(d.names, self.keep)].all():
            kept = f", among them {', '.join(self.keep)}" if self.keep else ""
            expected = f"points at which {low} to {high} contacts vanish{kept}"
            checks.refuse(argument, expected, quotient.written(np.flatnonzero(held)) or "none")
        found = project(quotient, q, np.flatnonzero(held).tolist())
        if not found.settled:
            checks.refuse(argument, "points from which the contacts can be reached", q)
        return ChainState(found.point.q, held.astype(np.int64), stream)


def _run(shared: Shared, state: ChainState, count: int) -> tuple[ChainState, Array, Codes, Codes]:
    sampler: StratifiedSampler = shared.value
    return sampler.run(state, count)


@dataclass(frozen=True, eq=False)
class StrataSample(Checked, Printed):
    """Points of strata, in chains of one length.

    Attributes
    ----------
    sampler : StratifiedSampler
        What was sampled, and how.
    points : (c, k, n) array
        Coordinates, not wrapped.
    strata : tuple of tuple of str
        The strata that were visited: the contacts that are held.
    positions : (c, k) array of int
        The stratum of every point, by its position in ``strata``.
    moves : (2, 3) array of int
        Moves tried and accepted: within a stratum, gaining, and losing a contact.
    states : tuple of ChainState
        Where the chains ended.
    """

    sampler: StratifiedSampler
    points: Array
    strata: tuple[tuple[str, ...], ...]
    positions: NDArray[np.int64]
    moves: NDArray[np.int64]
    states: tuple[ChainState, ...]

    def __repr__(self) -> str:
        """Return the numbers of chains, points and strata."""
        chains, count, _ = self.points.shape
        return f"StrataSample({chains} chains of {count} points on {len(self.strata)} strata)"

    @property
    def contacts(self) -> NDArray[np.int64]:
        """The number of contacts at every point, ``(c, k)``."""
        counts = [*map(len, self.strata), 0]
        return np.array(counts, dtype=np.int64)[self.positions]

    @property
    def accepted(self) -> Array:
        """The parts of the moves that were accepted, ``(3,)``."""
        return np.asarray(self.moves[1] / np.maximum(self.moves[0], 1))

    def mean(self, of: Callable[[Array], ArrayLike] | ArrayLike) -> Estimate:
        """Return the mean of a quantity, with its error.

        Parameters
        ----------
        of : callable or array
            From points ``(k, n)`` to numbers ``(k,)``, or the numbers ``(c, k)``.
        """
        shape = self.positions.shape
        given: Any = of(self.points.reshape(-1, self.points.shape[-1])) if callable(of) else of
        values = checks.reals("of", given)
        if values.size != self.positions.size:
            checks.refuse("of", f"{self.positions.size} numbers, one for each point", values.shape)
        return series_mean(values.reshape(shape))

    @checked
    def fraction(
        self, *, stratum: Sequence[str] | None = None, contacts: int | None = None
    ) -> Estimate:
        """Return the share of a stratum, or of all strata with a number of contacts."""
        if (stratum is None) == (contacts is None):
            checks.refuse("stratum, contacts", "one of them", (stratum, contacts), TypeError)
        if contacts is not None:
            return series_mean(self.contacts == contacts)
        wanted = frozenset(stratum or ())
        checks.names("stratum", wanted, self.sampler.polyhedron.names)
        known = [frozenset(some) == wanted for some in self.strata]
        return series_mean(np.array([*known, False])[self.positions])

    @checked
    def ratio(self, contacts: int, to: int) -> Estimate:
        """Return how much more strata with a number of contacts weigh than those with another.

        Without stickiness, which must be the same for all contacts.
        """
        stickiness = self.sampler.weighting.stickiness
        if isinstance(stickiness, Mapping):
            checks.refuse("stickiness", "one for all contacts", stickiness)
        if not (self.contacts == to).any():
            checks.refuse("to", "a number of contacts that was met", to)
        found = ratio_of_means(self.contacts == contacts, self.contacts == to)
        factor = stickiness ** (to - contacts)
        return Estimate(found.value * factor, found.error * factor, found.effective)

    @checked
    def more(
        self, points: int, *, executor: Any = None, progress: Progress = silent
    ) -> "StrataSample":
        """Return a sample that goes on: the bits are those of one that was longer at once."""
        checks.whole("points", points, least=1, most=checks.MOST)
        return _sampled(self.sampler, self, points, executor, progress)

    def _sheet(self) -> Sheet:
        order = np.argsort(-np.bincount(self.positions.ravel(), minlength=len(self.strata)))
        found = [(self.strata[i], series_mean(self.positions == i)) for i in order[:20].tolist()]
        rows = (
            (names(some) or "-", number(e.value, 6), f"{e.error:.1g}", f"{e.effective:.0f}")
            for some, e in found
        )
        table = listed(
            "Strata", ("contacts", "share", "error", "effective"), rows, len(self.strata), (1, 2, 3)
        )
        head = ("move", "tried", "accepted")
        kinds = ("within", "gain", "lose")
        moves = Table(
            head,
            tuple(
                (kind, str(t), str(a))
                for kind, t, a in zip(kinds, *self.moves.tolist(), strict=True)
            ),
            (1, 2),
        )
        return Sheet(repr(self), (table, moves))


@checked
def sample(
    polyhedron: Polyhedron,
    starts: ArrayLike,
    points: int,
    *,
    weighting: Weighting = PLAIN,
    contacts: tuple[int, int] | None = None,
    keep: Sequence[str] = (),
    rng: np.random.Generator | int | None = None,
    options: SampleOptions = STEPS,
    executor: Any = None,
    progress: Progress = silent,
) -> StrataSample:
    """Sample strata of a polyhedron: the points, their strata, and how often each is met.

    Parameters
    ----------
    polyhedron : Polyhedron
        All of whose inequalities hold together.
    starts : (c, n) array
        Points of it, one for each chain; contacts that vanish there are held at the beginning.
    points : int
        Points that are recorded of every chain.
    weighting : Weighting, optional
        How strata are weighed; its stickiness is finite.
    contacts : (int, int), optional
        How many contacts are held at least and at most: ``(d, d)`` for the strata of codimension
        ``d``, by default all numbers.
    keep : sequence of str, optional
        Contacts that are always held: the bonds of a chain of spheres.
    rng : Generator or int, optional
        Random numbers, or a seed.
    options : SampleOptions, optional
    executor : optional
        Where chains run ({doc}`as for a sweep <sweeps>`); the points do not depend on it.
    progress : callable, optional

    Returns
    -------
    StrataSample
        After Ctrl-C the points that are there.

    Raises
    ------
    TypeError, ValueError
        For a union, an infinite stickiness, starts outside, and starts with other contacts.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"parabola": y - x**2, "lid": 2 - y})
    >>> found = sample(D, [[0.0, 1.0]], 1000, weighting=Weighting(gradients=False), rng=1)
    >>> found.points.shape, sorted(len(some) for some in found.strata)
    ((1, 1000, 2), [0, 1, 1, 2])
    """
    checks.whole("points", points, least=1, most=checks.MOST)
    if polyhedron.is_union:
        expected = "inequalities that hold together, as each part of a union does"
        checks.refuse("polyhedron", expected, polyhedron)
    if weighting.is_limit:
        checks.refuse("weighting", "a finite stickiness", weighting)
    checks.names("keep", keep, polyhedron.names)
    low, high = (0, len(polyhedron.functions)) if contacts is None else contacts
    checks.whole("contacts[0]", low, least=0)
    checks.whole("contacts[1]", high, least=low)
    begun = checks.reals("starts", starts)
    begun = polyhedron.manifold.points(np.atleast_2d(begun), "starts")
    checks.fits("points", 16.0 * points * begun.size, f"{points} points of {len(begun)} chains")
    sampler = StratifiedSampler(polyhedron, weighting, (low, high), tuple(keep), options)
    streams = checks.generator("rng", rng).integers(-(2**63), 2**63, len(begun)).tolist()
    states = tuple(
        sampler.begin(f"starts[{i}]", q, stream)
        for i, (q, stream) in enumerate(zip(begun, streams, strict=True))
    )
    size = polyhedron.manifold.size
    nothing = StrataSample(
        sampler, np.empty((len(begun), 0, size)), (), np.empty((len(begun), 0), np.int64),
        np.zeros((2, 3), np.int64), states,
    )  # fmt: skip
    if options.discarded:
        settled = _sampled(sampler, nothing, options.discarded, executor, silent)
        nothing = replace(nothing, states=settled.states)
    return _sampled(sampler, nothing, points, executor, progress)


def _sampled(
    sampler: StratifiedSampler, before: StrataSample, points: int, executor: Any, progress: Progress
) -> StrataSample:
    """Return a sample with so many points more of every chain."""
    states, blocks, done = list(before.states), [], 0
    size = max(1, sampler.options.block // sampler.options.every)
    shared = Shared(sampler)
    with opened_if_any(executor) as workers:

        def advance(count: int) -> None:
            nonlocal done
            if workers is None:
                found = [sampler.run(state, count) for state in states]
            else:
                calls = [workers.executor.submit(_run, shared, state, count) for state in states]
                found = [call.result() for call in calls]
            states[:] = [one[0] for one in found]
            blocks.append(found)
            done += count

        def tasks() -> Iterator[Task]:
            while done < points:
                yield True, lambda: advance(min(size, points - done))

        work_through(tasks(), lambda: (done, points, "points"), progress)
    return _joined(before, blocks, tuple(states))


def _joined(
    before: StrataSample, blocks: list[Any], states: tuple[ChainState, ...]
) -> StrataSample:
    """Return a sample with further blocks of every chain."""
    names = before.sampler.polyhedron.names
    if not blocks:
        return before
    points = [np.stack([one[1] for one in block]) for block in blocks]
    codes = np.concatenate([np.stack([one[2] for one in block]) for block in blocks], axis=1)
    counts = sum(one[3] for block in blocks for one in block)
    words = codes.shape[-1]
    if words == 1:
        kinds, at = np.unique(codes[..., 0], return_inverse=True)
        kinds = kinds[:, None]
    else:
        kinds, at = np.unique(codes.reshape(-1, words), axis=0, return_inverse=True)
    found = [
        tuple(name for i, name in enumerate(names) if kind[i // BITS] >> (i % BITS) & 1)
        for kind in kinds.tolist()
    ]
    strata = list(dict.fromkeys([*before.strata, *found]))
    where = {some: i for i, some in enumerate(strata)}
    places = np.array([where[some] for some in found])[at.reshape(codes.shape[:2])]
    return StrataSample(
        before.sampler,
        np.concatenate([before.points, *points], axis=1),
        tuple(strata),
        np.concatenate([before.positions, places], axis=1),
        before.moves + np.reshape(counts, (2, 3)),
        states,
    )

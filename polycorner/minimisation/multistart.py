"""Multi-start search for all local minima, each reported once up to a symmetry, and its outcome."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.checks import reals
from polycorner.minimisation.abundance import Richness, richness
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.loci import Loci, Locus, Paths, check_symmetry
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Printed, Sheet, listed, names, number, titled
from polycorner.progress import Progress, silent
from polycorner.signatures import shown
from polycorner.spaces.manifold import Array
from polycorner.tolerances import RANK_TOLERANCE, TOLERANCE, Tolerances
from polycorner.values import Checked, cached_property
from polycorner.workers import Shared, in_order, opened_if_any

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy


# Bounds for each coordinate; None for a whole circle or sphere.
Box = Sequence[tuple[float, float] | None]
Begin = Callable[[Problem, Array], Array]
TRIES = 10_000  # samples a start before they are moved into the polyhedron instead
RESTORED = 20  # samples a start that are moved before a box is reported to miss the polyhedron
CHECKED = 3  # starts at which a symmetry is checked
TOGETHER = 20  # descents that a worker is given at a time


@dataclass(frozen=True, eq=False, repr=False)
class Minima(Checked, Printed, Sequence[Certificate]):
    """The minima that a search found, as a sequence of certificates, the lowest first.

    Attributes
    ----------
    certificates : tuple of Certificate
        One for each minimum, or for each locus of minima.
    counts : tuple of int
        How many starts ended in each.
    points : tuple of (k, n) arrays
        Where each was found: one point, or for a locus a net of points, up to the symmetry.
    elsewhere : mapping from Verdict to int
        How many starts ended in no minimum, by the verdict on where they ended.
    others : tuple of Certificate
        The points among those, each once; failed descents are not listed.
    descents, starts : int
        Number of descents done, and number of starts.
    interrupted : bool
        Whether the search was interrupted: starts may be left, and loci not yet merged.
    modulo : bool
        Whether minima are counted up to a symmetry that was given.
    """

    certificates: tuple[Certificate, ...]
    counts: tuple[int, ...]
    points: tuple[Array, ...]
    elsewhere: Mapping[Verdict, int]
    others: tuple[Certificate, ...]
    descents: int
    starts: int
    interrupted: bool = False
    modulo: bool = False

    @overload
    def __getitem__(self, index: int) -> Certificate: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Certificate, ...]: ...
    def __getitem__(self, index: int | slice) -> Certificate | tuple[Certificate, ...]:
        """Return one certificate, or several."""
        return self.certificates[index]

    def __len__(self) -> int:
        """Return the number of minima found."""
        return len(self.certificates)

    @cached_property
    def richness(self) -> Richness:
        """Estimate of the number of all minima, from how often each was found."""
        return richness(self.counts)

    @property
    def completeness(self) -> str:
        """Estimates for minima that were not found, and the assumptions behind them."""
        return " ".join(_statement(self))

    def __repr__(self) -> str:
        """Return the number of minima and the lowest energies in one line."""
        energies = ", ".join(f"{c.energy:.6g}" for c in self[:5])
        dots = ", ..." if len(self) > 5 else ""
        return f"Minima({len(self)} from {self.descents} starts; energies {energies}{dots})"

    def _sheet(self) -> Sheet:
        """Return a table, the lowest minimum first, with points of up to three coordinates."""
        head = ["energy", "starts", "(p, q, r)", "verdict", "active"]
        shown = bool(self) and len(self[0].point) <= 3
        if shown:
            manifold = self[0].problem.polyhedron.manifold
            head += map(titled, manifold.names, manifold.periods)
        rows = (
            (
                number(c.energy),
                str(count),
                "({}, {}, {})".format(*c.signature),
                c.verdict.name,
                names(c.active) or "-",
                *(number(x, 6) for x in c.point.tolist() if shown),
            )
            for c, count in zip(self, self.counts, strict=True)
        )
        columns = (0, 1, *range(5, len(head)))
        return Sheet("Minima", (listed("", head, rows, len(self), columns), self.completeness))


def _statement(found: Minima) -> Iterator[str]:
    cut = f" (interrupted, {found.starts - found.descents} left)" if found.interrupted else ""
    lost = sum(found.elsewhere.values())
    where = f"; {lost} ended in no minimum" if lost else ""
    minima = "1 minimum" if len(found) == 1 else f"{len(found)} minima"
    modulo = ", up to the symmetry," if found.modulo else ""
    starts = "1 start" if found.descents == 1 else f"{found.descents} starts"
    yield f"{minima}{modulo} from {starts}{cut}{where}."
    if not found:
        return
    r = found.richness
    low, high = r.interval
    yield (
        f"Estimated coverage {r.coverage:.2%} (Good-Turing); estimated number of minima "
        f"{r.estimate:.3g}, at 95 % between {low:.3g} and {high:.3g} (Chao, a lower bound)."
    )
    yield (
        "This assumes that the starts are independent draws from one distribution; a minimum "
        f"whose basin has a share of less than {r.overlooked:.2g} is missed with a probability of "
        "more than 5 %, and the estimates do not cover it."
    )


def start_points(
    problem: Problem, starts: Any, box: Box | None, rng: np.random.Generator | int | None
) -> Array:
    """Return the start points ``(k, n)``, given or sampled, after checking them."""
    manifold = problem.polyhedron.manifold
    if isinstance(starts, Real):
        count = checks.whole("starts", starts, least=1, most=checks.MOST)
        return _sampled(problem, count, *_bounds(problem, box), checks.generator("rng", rng))
    if box is not None:
        checks.refuse("box", "None with starts given as points", box)
    points = manifold.points(np.atleast_2d(reals("starts", starts)), "starts")
    points = manifold.placed(points, "starts")
    if points.ndim != 2 or not len(points):
        checks.refuse("starts", f"points of shape (k, {problem.dimension})", points.shape)
    finite = np.isfinite(problem.energy.value(points))
    if not finite.all():
        k = int((~finite).argmax())
        msg = f"starts: expected points with a finite energy; it is not finite at starts[{k}]"
        raise ValueError(msg)
    return points


def _sampled(
    problem: Problem, count: int, low: Array, high: Array, rng: np.random.Generator
) -> Array:
    """Return uniform samples with satisfied inequalities and a finite energy.

    Where none satisfies them, as in a set without interior, samples are moved into branches.
    """
    d = problem.polyhedron
    found = np.empty((0, problem.dimension))
    tries = 0
    while len(found) < count:
        q = rng.uniform(low, high, (4 * count, problem.dimension))
        q = d.manifold.factors.scattered(q, rng) if d.manifold.factors else q
        inside = (d.implicit(q) >= 0) & np.isfinite(problem.energy.value(q))
        found = np.concatenate([found, q[inside]])
        tries += len(q)
        if tries > TRIES * (len(found) + 1):
            return _moved(problem, count, tries, (low, high), rng)
    return found[:count]


def _moved(
    problem: Problem, count: int, tries: int, box: tuple[Array, Array], rng: np.random.Generator
) -> Array:
    """Return points of the set in a box, restored from uniform samples, a random branch each."""
    d, (low, high) = problem.polyhedron, box
    pieces = d.signs_to_pieces([0] * len(d.functions))
    found: list[Array] = []
    moved = 0
    while len(found) < count and moved < RESTORED * (len(found) + 1):
        moved += 1
        q = rng.uniform(low, high)
        q = d.manifold.factors.scattered(q, rng) if d.manifold.factors else q
        reached, point = problem.restore(pieces[rng.integers(len(pieces))], q)
        aside = d.manifold.difference(point, np.clip(point, low, high))
        if reached and not aside.any() and np.isfinite(problem.energy.value(point)):
            found.append(point)
    if len(found) == count:
        return np.array(found)
    msg = f"box: expected one that meets the polyhedron; {len(found)} of {tries} points do"
    raise ValueError(msg)


def _bounds(problem: Problem, box: Any) -> tuple[Array, Array]:
    """Return the lower and the upper bounds of a box."""
    manifold = problem.polyhedron.manifold
    given = [None] * problem.dimension if box is None else box
    if not isinstance(given, Sequence | np.ndarray) or _length(given) != problem.dimension:
        checks.refuse("box", f"bounds (low, high) for each of {', '.join(manifold.names)}", box)
    bounds, curved = [], {name for f in manifold.factors for name in f.names}
    for name, period, pair in zip(manifold.names, manifold.periods, given, strict=True):
        circle = pair is None and np.isfinite(period)
        if name in curved and pair is not None:
            checks.refuse("box", f"None for {name}, sampled from the whole sphere", pair)
        bound = (-period / 2, period / 2) if circle else (0, 1) if name in curved else pair
        if not _is_interval(bound):
            checks.refuse("box", f"low < high for {name}, to sample points", pair)
        bounds.append(bound)
    low, high = np.array(bounds, dtype=np.float64).T
    return low, high


def _length(several: Any) -> int:
    return 0 if isinstance(several, np.ndarray) and not several.ndim else len(several)


def _is_interval(pair: Any) -> bool:
    if not isinstance(pair, Sequence | np.ndarray) or _length(pair) != 2:
        return False
    if not all(isinstance(x, Real) and np.isfinite(float(x)) for x in pair):
        return False
    return float(pair[0]) < float(pair[1])


@shown
def minima(  # noqa: PLR0913 - all but two are options
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    starts: ArrayLike | int = 1000,
    box: Box | None = None,
    rng: np.random.Generator | int | None = None,
    symmetry: Symmetry | None = None,
    executor: Any = None,
    progress: Progress = silent,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Minima:
    """Find the local minima of an energy on a polyhedron by descent from many starts.

    Every start descends by :func:`~polycorner.minimisation.methods.minimise`; the basin of a
    minimum is the set of starts from which this descent reaches it, which need not be the basin of
    a motion.  :mod:`~polycorner.minimisation.loci` identifies minima up to the symmetry: a
    connected locus of minima at one energy is one entry.  One representative of each is certified,
    of a locus one with the fewest active functions.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    starts : (k, n) array or int, optional
        Start points, such as a model's ``starts(rng, k)``; those outside ``D`` are first projected
        onto it.  Or a number of points to sample independently and uniformly from the part of
        ``box`` in which the inequalities hold.
    box : sequence of (low, high), optional
        Bounds for each coordinate of sampled points; None stands for a whole circle, sphere or
        all rotations, and is the default for these.
    rng : Generator or int, optional
        Source of sampled points; default a generator with seed 0.
    symmetry : Symmetry, optional
        Symmetry of the polyhedron *and of the energy* up to which minima are identified.
    executor : optional
        Where descents are computed, as for :func:`~polycorner.sweeps.sweep`; the result does not
        depend on it.  Default this process.
    progress : callable, optional
        Called after every start with the number of starts done, their total, and the number of
        minima in words; see :class:`~polycorner.progress.Progress`.
    tolerance, rank_tolerance : float, optional
        See :class:`~polycorner.minimisation.certificate.Certificate`.  Two points are one up to the
        distance ``1e-6 (tolerance / 1e-8)^(3/4)``, in scale units.

    Returns
    -------
    Minima
        After an interruption (Ctrl-C), with what was found so far.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind or shape, a symmetry that changes the energy, a box that
        misses the polyhedron, or starts where the energy is not finite.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"wall": x + 2, "floor": y})
    >>> found = minima(D, (x**2 - 1) ** 2 + x / 4 + y, starts=100, box=[(-2, 2), (0, 1)])
    >>> [c.point.round(3).tolist() for c in found], sum(found.counts)
    ([[-1.03, 0.0], [0.967, 0.0]], 100)
    """
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    problem = pose(polyhedron, energy)
    points = start_points(problem, starts, box, rng)
    loci = modulo(problem, symmetry, points, tolerances)
    ends = descend_from(points, loci, executor, progress)
    kept, others = by_level(filter(_is_minimum, loci.loci)), ends.others
    return Minima(
        certificates=tuple(locus.certificate for locus in kept),
        counts=tuple(len(locus.starts) for locus in kept),
        points=tuple(np.array(locus.points) for locus in kept),
        elsewhere=ends.elsewhere,
        others=tuple(locus.certificate for locus in others),
        descents=ends.done,
        starts=len(points),
        interrupted=ends.interrupted,
        modulo=symmetry is not None,
    )


def modulo(
    problem: Problem, symmetry: Symmetry | None, points: Array, tolerances: Tolerances
) -> Loci:
    """Return no loci yet, up to a symmetry that is checked at some of the points."""
    if symmetry is not None:
        checks.instance("symmetry", symmetry, Symmetry)
    quotient = Paths(problem.polyhedron, symmetry or Symmetry(), tolerances, problem=problem)
    check_symmetry(quotient, points[:CHECKED])
    return Loci(quotient)


@dataclass(eq=False)
class Ends:
    """Where the descents from some starts ended: in loci, or nowhere, each with its verdict."""

    loci: Loci
    lost: list[Verdict] = field(default_factory=list)
    interrupted: bool = False

    @property
    def done(self) -> int:
        """Number of descents."""
        return len(self.lost) + sum(len(locus.starts) for locus in self.loci.loci)

    @property
    def others(self) -> list[Locus]:
        """The loci that are no minima."""
        return by_level(locus for locus in self.loci.loci if not _is_minimum(locus))

    @property
    def elsewhere(self) -> dict[Verdict, int]:
        """How many ended in no minimum, by verdict."""
        ended = Counter(self.lost)
        for locus in self.others:
            ended[locus.certificate.verdict] += len(locus.starts)
        return dict(ended.most_common())


def descend_from(
    points: Array, loci: Loci, executor: Any, progress: Progress, begin: Begin | None = None
) -> Ends:
    """Descend from every point and add to the loci where that ends, until done or Ctrl-C.

    ``begin`` may go part of the way.
    """
    if not callable(progress):
        checks.refuse("progress", "a function (done, total, note)", progress, TypeError)
    ends, number, problem = Ends(loci), 0, loci.quotient.problem
    size = 1 if executor is None else TOGETHER
    parts = [points[k : k + size] for k in range(0, len(points), size)]
    shared = Shared((problem, loci.quotient.tolerances, begin))
    try:
        with opened_if_any(executor) as workers:
            for part in in_order(workers, _descended, shared, parts):
                for found in part:
                    if found.search is not None and found.verdict is found.search:
                        ends.lost.append(found.search)
                    else:
                        # What is compiled for the problem of this process serves all of them.
                        own = found if workers is None else replace(found, problem=problem)
                        loci.add(own).starts.append(number)
                    number += 1
                    count = sum(map(_is_minimum, loci.loci))
                    progress(number, len(points), f"{count} minima")
        loci.merge()
    except KeyboardInterrupt:
        ends.interrupted = True
    return ends


def _descended(shared: Shared, points: Array) -> list[Certificate]:
    """Return the ends of descents; called in a worker."""
    problem, tolerances, begin = shared.value
    where = problem.polyhedron, problem.energy
    limits = {"tolerance": tolerances.zero, "rank_tolerance": tolerances.rank}
    return [minimise(*where, begin(problem, q) if begin else q, **limits) for q in points]


def _is_minimum(locus: Locus) -> bool:
    return locus.certificate.is_minimum


def by_level(several: Iterable[Locus]) -> list[Locus]:
    """Return loci by energy, those of equal energy in the order in which they were found.

    Rounding errors of equal energies, as of mirror images, thus do not decide the order.
    """
    loci = list(several)
    levels: dict[int, int] = {}
    level, last = 0, -np.inf
    for k in sorted(range(len(loci)), key=lambda k: loci[k].energy):
        level += loci[k].energy - last > loci[k].slack
        levels[k], last = level, loci[k].energy
    return [loci[k] for k in sorted(levels, key=lambda k: (levels[k], k))]

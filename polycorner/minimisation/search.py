"""Every minimum that many falls find, each once, and how many there may be beside them."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike

from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.loci import Quotient, Rest, Rests, check_symmetry
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.problem import Problem, pose
from polycorner.minimisation.richness import Richness, richness
from polycorner.minimisation.verdicts import Verdict
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import TOLERANCE, check_tolerance
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.printing import Printed, Sheet
from polycorner.spaces.manifold import Array, reals

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy

# Bounds for each coordinate; None for a whole circle.
Box = Sequence[tuple[float, float] | None]
# What is told after every fall: how many are done, how many there are, how many minima so far.
Progress = Callable[[int, int, int], None]

TRIES = 10_000  # points drawn in vain for each start before a box is said to miss the polyhedron
CHECKED = 3  # starts at which a symmetry is checked


@dataclass(frozen=True, eq=False, repr=False)
class Minima(Printed, Sequence[Certificate]):
    """The minima that a search found, as a sequence of certificates, the lowest first.

    Attributes
    ----------
    certificates : tuple of Certificate
        One for each minimum, or for each locus of minima.
    counts : tuple of int
        How many starts ended in each.
    points : tuple of (k, n) arrays
        Where each was met: one point, or for a locus a net of points, up to the symmetry.
    elsewhere : mapping from Verdict to int
        How many starts ended in no minimum, by the verdict on where they ended.
    others : tuple of Certificate
        The rests among those, each once; what never came to rest is not here.
    fallen, starts : int
        How many starts were let fall, of how many.
    interrupted : bool
        Whether the search was interrupted: then starts may be left, and loci not yet joined.
    """

    certificates: tuple[Certificate, ...]
    counts: tuple[int, ...]
    points: tuple[Array, ...]
    elsewhere: Mapping[Verdict, int]
    others: tuple[Certificate, ...]
    fallen: int
    starts: int
    interrupted: bool = False

    @overload
    def __getitem__(self, index: int) -> Certificate: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Certificate, ...]: ...
    def __getitem__(self, index: int | slice) -> Certificate | tuple[Certificate, ...]:
        """Return one certificate, or several."""
        return self.certificates[index]

    def __len__(self) -> int:
        """Return how many minima were found."""
        return len(self.certificates)

    @cached_property
    def richness(self) -> Richness:
        """How many minima there are in all, judged by how often each was met."""
        return richness(self.counts)

    @property
    def completeness(self) -> str:
        """What the search says of minima that it did not find, and under which assumptions."""
        return " ".join(_statement(self))

    def __repr__(self) -> str:
        """Return how many minima there are, and the energies of the lowest."""
        energies = ", ".join(f"{c.energy:.6g}" for c in self[:5])
        dots = ", ..." if len(self) > 5 else ""
        return f"Minima({len(self)} from {self.fallen} starts; energies {energies}{dots})"

    def _sheet(self) -> Sheet:
        from polycorner.minimisation.report import minima_sheet

        return minima_sheet(self)


def minima(
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    starts: ArrayLike | int = 1000,
    box: Box | None = None,
    rng: np.random.Generator | int | None = None,
    symmetry: Symmetry | None = None,
    progress: Progress | None = None,
    tolerance: float = TOLERANCE,
) -> Minima:
    """Find the local minima of an energy on a polyhedron by letting many starts fall.

    Every start descends by :func:`~polycorner.minimisation.methods.minimise`; a basin is here the
    set of starts that this descent leads to a minimum, whatever a motion would do.  Which rests are
    one, up to the symmetry, is decided by :mod:`~polycorner.minimisation.loci`: a locus of minima
    that is connected, at one energy, is one entry however long it is.  One representative of each
    is certified, of a locus one with the fewest active functions.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    starts : (k, n) array or int, optional
        Where to start, such as a model's ``starts(rng, k)``; a start outside ``D`` is first moved
        there.  Or how many points to draw, independently and uniformly from the part of ``box``
        in which the inequalities hold.
    box : sequence of (low, high), optional
        Bounds for each coordinate, where points are to be drawn; None stands for a whole circle.
        Default: circles only.
    rng : Generator or int, optional
        Source of the points that are drawn; default a generator with seed 0.
    symmetry : Symmetry, optional
        What is quotiented out: a symmetry of the polyhedron *and of the energy*.
    progress : callable, optional
        Called as ``progress(done, starts, found)`` after every start.
    tolerance : float, optional
        See :class:`~polycorner.minimisation.certificate.Certificate`.

    Returns
    -------
    Minima
        Also after an interruption (Ctrl-C): then with what was found so far.

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
    check_tolerance("tolerance", tolerance)
    problem = pose(polyhedron, energy)
    if symmetry is not None and not isinstance(symmetry, Symmetry):
        msg = f"symmetry: expected a Symmetry; got {type(symmetry).__name__}"
        raise TypeError(msg)
    if progress is not None and not callable(progress):
        msg = f"progress: expected a function of three numbers; got {progress!r}"
        raise TypeError(msg)
    points = _points(problem, starts, box, rng)
    quotient = Quotient(problem, symmetry or Symmetry())
    check_symmetry(problem, quotient.symmetry, points[:CHECKED])
    rests, failures = Rests(quotient), Counter[Verdict]()
    interrupted = False
    try:
        for done, q in enumerate(points, 1):
            found = minimise(polyhedron, problem.energy, q, tolerance=tolerance)
            if found.search is not None and found.verdict is found.search:
                failures[found.search] += 1
            else:
                rests.add(found)
            if progress is not None:
                progress(done, len(points), sum(map(_is_minimum, rests.rests)))
        rests.join()
    except KeyboardInterrupt:
        interrupted = True
    return _result(rests.rests, failures, len(points), interrupted=interrupted)


def _is_minimum(rest: Rest) -> bool:
    return rest.certificate.is_minimum


def _result(
    rests: list[Rest], failures: Counter[Verdict], starts: int, *, interrupted: bool
) -> Minima:
    ordered = sorted(rests, key=lambda rest: rest.energy)
    kept = [rest for rest in ordered if _is_minimum(rest)]
    others = [rest for rest in ordered if not _is_minimum(rest)]
    for rest in others:
        failures[rest.certificate.verdict] += rest.count
    return Minima(
        certificates=tuple(rest.certificate for rest in kept),
        counts=tuple(rest.count for rest in kept),
        points=tuple(np.array(rest.points) for rest in kept),
        elsewhere=dict(failures.most_common()),
        others=tuple(rest.certificate for rest in others),
        fallen=sum(rest.count for rest in kept) + failures.total(),
        starts=starts,
        interrupted=interrupted,
    )


def _statement(found: Minima) -> Iterator[str]:
    cut = f" (interrupted, {found.starts - found.fallen} left)" if found.interrupted else ""
    lost = sum(found.elsewhere.values())
    where = f"; {lost} ended in no minimum" if lost else ""
    yield f"{len(found)} minima, up to the symmetry, from {found.fallen} starts{cut}{where}."
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
        f"whose basin has less than {r.overlooked:.2g} of it is missed with a probability of more "
        "than 5 %, and of those nothing is said."
    )


def _points(
    problem: Problem, starts: Any, box: Box | None, rng: np.random.Generator | int | None
) -> Array:
    """Return the starts, given or drawn, after checking them."""
    manifold = problem.polyhedron.manifold
    if isinstance(starts, Integral):
        if isinstance(starts, bool) or starts < 1:
            msg = f"starts: expected a positive whole number, or points; got {starts!r}"
            raise ValueError(msg)
        return _drawn(problem, int(starts), *_bounds(problem, box), _generator(rng))
    if box is not None:
        msg = "box: expected none where starts are given as points"
        raise ValueError(msg)
    points = manifold.points(np.atleast_2d(reals(starts, "starts")), "starts")
    if points.ndim != 2 or not len(points):
        msg = f"starts: expected points of shape (k, {problem.dimension}); got {points.shape}"
        raise ValueError(msg)
    finite = np.isfinite(problem.energy.value(points))
    if not finite.all():
        k = int((~finite).argmax())
        msg = f"starts: expected points where the energy is finite; it is not at starts[{k}]"
        raise ValueError(msg)
    return points


def _generator(rng: Any) -> np.random.Generator:
    seed = isinstance(rng, Integral) and not isinstance(rng, bool) and int(rng) >= 0
    if rng is not None and not seed and not isinstance(rng, np.random.Generator):
        msg = f"rng: expected a Generator or a whole number not below 0; got {rng!r}"
        raise TypeError(msg)
    return np.random.default_rng(0 if rng is None else rng)


def _drawn(
    problem: Problem, count: int, low: Array, high: Array, rng: np.random.Generator
) -> Array:
    """Return points drawn uniformly from where the inequalities hold and the energy is finite."""
    d = problem.polyhedron
    found = np.empty((0, problem.dimension))
    tries = 0
    while len(found) < count:
        q = rng.uniform(low, high, (4 * count, problem.dimension))
        inside = (d.implicit(q) >= 0) & np.isfinite(problem.energy.value(q))
        found = np.concatenate([found, q[inside]])
        tries += len(q)
        if tries > TRIES * (len(found) + 1):
            msg = f"box: expected one that meets the polyhedron; {len(found)} of {tries} points do"
            raise ValueError(msg)
    return found[:count]


def _bounds(problem: Problem, box: Any) -> tuple[Array, Array]:
    """Return the lower and the upper bounds of a box."""
    manifold = problem.polyhedron.manifold
    given = [None] * problem.dimension if box is None else box
    if not isinstance(given, Sequence | np.ndarray) or len(given) != problem.dimension:
        msg = (
            f"box: expected bounds (low, high) for each of {', '.join(manifold.names)}; got {box!r}"
        )
        raise ValueError(msg)
    bounds = []
    for name, period, pair in zip(manifold.names, manifold.periods, given, strict=True):
        circle = pair is None and np.isfinite(period)
        bound = (-period / 2, period / 2) if circle else pair
        if not _is_interval(bound):
            msg = f"box: expected low < high for {name}, where points are drawn; got {pair!r}"
            raise ValueError(msg)
        bounds.append(bound)
    low, high = np.array(bounds, dtype=np.float64).T
    return low, high


def _is_interval(pair: Any) -> bool:
    if not isinstance(pair, Sequence | np.ndarray) or len(pair) != 2:
        return False
    if not all(isinstance(x, Real) and np.isfinite(float(x)) for x in pair):
        return False
    return float(pair[0]) < float(pair[1])

"""Passes that a search finds, and landscapes of them, without proof.

Walks uphill (:mod:`~polycorner.landscapes.walks`) start near minima, between two of them and at
random, on the faces of contacts that are left closed, and end at stationary points of index 1, a
few of index 2.  Whether components join at such a point is decided in doubles: by signs of
multipliers and curvatures; with multipliers that are zero by the copositivity of a Schur
complement; in a union by the pieces that meet, at minima on the intersections of two branches.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from polycorner import checks
from polycorner.kinds import checked
from polycorner.landscapes.barriers import Landscape, Minimum, Pass, Side
from polycorner.landscapes.crossings import Junction, crossing_at, orbits_of, sides_of, starts_of
from polycorner.landscapes.routes import Route
from polycorner.landscapes.walks import STRIDE, Mask, Numbers, Walks
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.loci import Loci, Locus, Paths, check_symmetry
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.multistart import CHECKED, Box, start_points
from polycorner.minimisation.problem import MOST_NUMBERS, Problem, pose
from polycorner.polyhedra.cones import rank
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import distances, local_pieces
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, RANK_TOLERANCE, TOLERANCE, Tolerances

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy

PART = 100  # walks that are done together, at most
SIZES = (1.0, 1.0, 0.2, 0.05)  # of surroundings of a minimum that are walked in
SECOND = 7  # every so many walks ends at a point of index 2, where weak contacts may make a pass
NEAREST = 4  # points from which a pair of branches is tried, at least


# ---------------------------------------------------------------------------------------- search


def search_passes(  # noqa: PLR0913 - all but two are options
    problem: Problem,
    minima: Sequence[Certificate],
    *,
    starts: int,
    rng: np.random.Generator,
    tolerances: Tolerances = DEFAULT,
    symmetry: Symmetry | None = None,
    cap: float = inf,
    points: Sequence[Array] = (),
    progress: Progress = silent,
) -> tuple[Certificate, ...]:
    """Search for passes by walks uphill from given minima.

    ``starts`` walks are done from the minima and between them, and others from ``points``.
    Progress is called with walks done, their number, and the number of stationary points in words.

    Returns
    -------
    tuple of Certificate
        The lowest first, up to the symmetry and the energy ``cap``: saddles of index 1 with
        positive multipliers; in a union, minima on two branches at once; with multipliers that are
        zero, what the second order makes a pass.  After an interruption (Ctrl-C), those that were
        found so far.
    """
    quotient = Paths(problem.polyhedron, symmetry or Symmetry(), tolerances, problem=problem)
    walks, loci = Walks(problem, orbits_of(problem, symmetry), tolerances), Loci(quotient)
    both = tolerances.zero, tolerances.rank

    def record(q: Array) -> None:
        if problem.energy.value(q) <= cap and _is_inside(problem, q, tolerances.zero):
            loci.add(Certificate(problem, q, *both, method="face"))

    try:
        done = 0
        for part in _parts(problem, [c.point for c in minima], points, starts, rng):
            closed = part.closed & part.allowed
            ends, _, found = walks.climb(
                part.q, part.allowed, closed, part.way, part.rising, part.longest
            )
            for q in ends[found]:
                record(q)
            done += len(ends)
            progress(done, starts + len(points), f"{len(loci.loci)} stationary points")
        for q in _tips(walks, [*(c.point for c in minima), *points], starts, rng):
            record(q)
    except KeyboardInterrupt:
        pass
    seen = sorted(loci.loci, key=lambda locus: locus.energy)
    return tuple(c for c in (locus.certificate for locus in seen) if sides_of(problem, c))


def _is_inside(problem: Problem, q: Array, zero: float) -> bool:
    values, gradients = problem.evaluate(q, 1)
    return bool(local_pieces(problem.polyhedron, distances(values[:-1], gradients[:-1]), zero))


def _together(problem: Problem) -> int:
    """Return how many walks are done together, with all second derivatives in memory."""
    return max(1, min(PART, MOST_NUMBERS // (problem.rows * problem.dimension**2)))


@dataclass(frozen=True, eq=False)
class Batch:
    """Walks that are done together; see :meth:`.Walks.climb`."""

    q: Array
    allowed: Mask
    closed: Mask
    way: Array
    rising: Numbers
    longest: Array


def _parts(
    problem: Problem,
    lows: Sequence[Array],
    points: Sequence[Array],
    starts: int,
    rng: np.random.Generator,
) -> Iterator[Batch]:
    """Yield walks from given points, and others near minima and between two of them in turn."""
    scales, manifold = problem.scales, problem.polyhedron.manifold
    count = starts + len(points) if len(lows) else len(points)
    together = _together(problem)
    for first in range(0, count, together):
        q, allowed, closed, longest = [], [], [], list[float]()
        for k in range(first, min(first + together, count)):
            held = np.zeros(problem.inequalities, dtype=np.bool_)
            longest.append(STRIDE)
            if k < len(points):
                q.append(points[k])
                allowed.append(_some_branch(problem, points[k], rng))
            else:
                a, b = (lows[i] for i in rng.integers(len(lows), size=2))
                # Around a shallow minimum all is small.
                size = rng.choice(SIZES) if k % 2 == 0 else 1.0
                longest[-1] *= size
                part = rng.uniform() if k % 2 else 0.0
                aside = rng.normal(size=len(scales)) * rng.uniform() * size / np.sqrt(len(scales))
                between = manifold.difference(b, a)
                q.append(manifold.moved(a, part * between + aside * scales))
                allowed.append(_some_branch(problem, q[-1] if k % 2 else a, rng))
                values, gradients = problem.evaluate(a, 1)
                near = abs(distances(values[:-1], gradients[:-1])) <= DEFAULT.near
                held = near[: problem.inequalities] & (rng.uniform(size=len(held)) < rng.uniform())
            closed.append(held)
        places = np.array(q)
        yield Batch(
            places,
            np.array(allowed),
            np.array(closed).reshape(len(places), problem.inequalities),
            rng.normal(size=places.shape),
            np.where(np.arange(first, first + len(places)) % SECOND, 1, min(2, len(scales))),
            np.array(longest),
        )


def _some_branch(problem: Problem, q: Array, rng: np.random.Generator) -> Mask:
    """Return the functions of a branch that holds at a point, or nearly does, at random."""
    d = problem.polyhedron
    if not d.is_union:
        return problem.mask(frozenset(range(problem.inequalities)))
    found = d.selections(d.values(q).tolist(), DEFAULT.near)
    return problem.mask(found[rng.integers(len(found))])


def _tips(
    walks: Walks, points: Sequence[Array], starts: int, rng: np.random.Generator
) -> Iterator[Array]:
    """Yield minima on intersections of two parts of a union, from points near both edges.

    Walks begin where a function of each part vanishes.
    """
    problem = walks.problem
    always, unions = problem.polyhedron.unions
    pairs = [(a, b) for u in unions for a, b in combinations(u, 2) if a - b and b - a]
    if not pairs or not len(points):
        return
    values = problem.polyhedron.values(np.array(points))
    count = max(NEAREST, starts // len(pairs))
    for a, b in pairs:
        away = [abs(values[:, sorted(piece)].min(axis=1)) for piece in (a, b)]
        q = np.array([points[k] for k in np.maximum(*away).argsort()[:count]])
        closed = np.zeros((len(q), problem.inequalities), dtype=np.bool_)
        for row in closed:
            row[[rng.choice(sorted(a - b)), rng.choice(sorted(b - a))]] = True
        allowed = np.array([_some_branch(problem, place, rng) for place in q])
        allowed |= problem.mask(always | a | b)
        reached, q = walks.placed(q, allowed, closed)
        paths, _, found = walks.fall(q[reached], allowed[reached], closed[reached])
        yield from (path[-1] for path, settled in zip(paths, found, strict=True) if settled)


# ------------------------------------------------------------------------------------- landscape


@dataclass(frozen=True, eq=False)
class FoundMinimum:
    """A minimum of the landscape: an image of a locus under the finite group."""

    locus: Locus
    orbit: int
    point: Array
    place: Array


@dataclass(frozen=True, eq=False)
class Lows:
    """The minima that walks downhill have reached."""

    walks: Walks
    loci: Loci

    @property
    def minima(self) -> list[Locus]:
        """The minima among the points reached, the lowest first."""
        found = [locus for locus in self.loci.loci if locus.certificate.is_minimum]
        return sorted(found, key=lambda locus: locus.energy)

    def ends(self, q: Array, allowed: Mask, closed: Mask) -> list[tuple[Locus | None, Array]]:
        """Return the minima that walks down end in, and their points."""
        size, found = _together(self.walks.problem), list[tuple[Locus | None, Array]]()
        for first in range(0, len(q), size):
            part = slice(first, first + size)
            paths, _, settled = self.walks.fall(q[part], allowed[part], closed[part])
            found += [self._end(path, bool(s)) for path, s in zip(paths, settled, strict=True)]
        return found

    def _end(self, path: Array, settled: bool) -> tuple[Locus | None, Array]:
        problem, tolerances = self.walks.problem, self.walks.tolerances
        both = tolerances.zero, tolerances.rank
        if settled and _is_inside(problem, path[-1], tolerances.zero):
            locus = self.loci.add(Certificate(problem, path[-1], *both, method="face"))
            if locus.certificate.is_minimum:
                return locus, path
        found = minimise(
            problem.polyhedron, problem.energy, path[-1], tolerance=both[0], rank_tolerance=both[1]
        )
        path = np.vstack([path, found.point])
        return self.loci.add(found) if found.is_minimum else None, path

    def landscape(self, passes: Sequence[Certificate], cap: float) -> Landscape:
        """Return the landscape of given passes and the minima below them."""
        ways = [self._crossed(c) for c in passes]
        nodes = [node for k, locus in enumerate(self.minima) for node in self._images(k, locus)]
        nodes = [node for node in nodes if node.locus.energy <= cap]
        listed = [p for k, way in enumerate(ways) for p in self._passes(k, *way, nodes)]
        return Landscape(
            self.walks.problem,
            tuple(map(_minimum, nodes)),
            tuple(listed),
            proved=False,
            cap=cap,
        )

    def _crossed(
        self, found: Certificate
    ) -> tuple[Certificate, Junction, list[tuple[Locus | None, Array]]]:
        """Return a pass with the ways down from it, which begin there."""
        quotient, problem = self.loci.quotient, self.walks.problem
        free = rank(quotient.orbit(found.point), quotient.tolerances.rank)
        crossing = crossing_at(problem, found.point, quotient.tolerances, free)
        if crossing is None:
            msg = "passes: expected points that are seen to be passes"
            raise ValueError(msg)
        starts = starts_of(self.walks, found.point, crossing)
        q, allowed, closed = (np.array(part) for part in zip(*starts, strict=True))
        ends = self.ends(q, allowed, closed)
        return found, crossing, [(end, np.vstack([found.point, path])) for end, path in ends]

    def _images(self, orbit: int, locus: Locus) -> Iterator[FoundMinimum]:
        """Yield the images of a minimum; a locus that is more than an orbit is listed once."""
        count = 1 if locus.wide else len(self.loci.quotient.symmetry.group)
        for _, point, place in self._distinct(locus.points[0], count):
            yield FoundMinimum(locus, orbit, point, place)

    def _distinct(self, q: Array, count: int) -> Iterator[tuple[int, Array, Array]]:
        """Yield the first images of a point that differ, with the numbers of the elements."""
        quotient, seen = self.loci.quotient, list[Array]()
        for k, image in enumerate(quotient.images(q)[:count]):
            place = quotient.place(image)
            if all(abs(place - other).max() > quotient.tolerances.same for other in seen):
                seen.append(place)
                yield k, image, place

    def _passes(
        self,
        orbit: int,
        found: Certificate,
        crossing: Junction,
        ends: list[tuple[Locus | None, Array]],
        nodes: Sequence[FoundMinimum],
    ) -> Iterator[Pass]:
        """Yield the images of a pass."""
        group = self.loci.quotient.symmetry.group
        for k, point, _ in self._distinct(found.point, len(group)):
            carried = [(e, np.array([group[k].apply(q) for q in path])) for e, path in ends]
            yield Pass(
                point=point,
                energy=(found.energy, found.energy),
                active=tuple(group[k].names.get(name, name) for name in found.stratum.active),
                index=crossing.index,
                kind=crossing.kind,
                sides=tuple(self._side(end, path, nodes) for end, path in carried),
                orbit=orbit,
            )

    def _side(self, end: Locus | None, path: Array, nodes: Sequence[FoundMinimum]) -> Side:
        """Return a side with its minimum, and its route if that leads to the minimum listed."""
        quotient, place = self.loci.quotient, self.loci.quotient.place(path[-1])
        apart = [
            (float(np.linalg.norm(node.place - place)), k)
            for k, node in enumerate(nodes)
            if node.locus is end
        ]
        if not apart:
            return Side(None)
        k = min(apart)[1]
        away = abs(quotient.manifold.chord(path[-1], nodes[k].point) / quotient.scales).max()
        if away > quotient.tolerances.near:
            return Side(k)
        energies = self.walks.problem.energy.value(path)
        return Side(k, Route(path, energies, float(energies.max()), verified=False))


def _minimum(node: FoundMinimum) -> Minimum:
    found = node.locus.certificate
    kind: Literal["isolated", "locus"] = "locus" if node.locus.wide else "isolated"
    return Minimum(node.point, (found.energy, found.energy), found.active, kind, node.orbit)


@checked
def search_landscape(  # noqa: PLR0913 - all but two are options
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    box: Box | None = None,
    starts: Any = 200,
    rng: np.random.Generator | int | None = None,
    symmetry: Symmetry | None = None,
    cap: float = inf,
    progress: Progress = silent,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Landscape:
    """Return the landscape of the minima and passes that searches find, which proves nothing.

    Minima are those that descents from the starts reach, and those that lie below a pass.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``.
    energy : SmoothFunction or sympy.Expr
        The energy ``E``, on the same manifold.
    box, starts, rng
        Points from which descents and walks uphill start, as of
        :func:`~polycorner.minimisation.multistart.minima`.  As many walks again start near minima.
    symmetry : Symmetry, optional
        Of the polyhedron and the energy.  Points are listed once up to motions and to groups that
        are too large to list; images under ``elements`` are listed, as one orbit.
    cap : float, optional
        The highest energy.
    progress : callable, optional
        See :class:`~polycorner.progress.Progress`.
    tolerance, rank_tolerance : float, optional
        See :class:`~polycorner.minimisation.certificate.Certificate`.

    Returns
    -------
    Landscape
        Not proved.  A side without a minimum is one from which a descent did not end in any; a
        side without a route leads to an image of its minimum under the symmetry.

    Raises
    ------
    TypeError, ValueError
        As of :func:`~polycorner.minimisation.multistart.minima`.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"disc": 4 - x**2 - y**2})
    >>> found = search_landscape(D, (x**2 - 1) ** 2 + x / 4 + y**2, starts=50, box=[(-2, 2)] * 2)
    >>> len(found.minima), [p.point.round(3).tolist() for p in found.passes]
    (2, [[0.063, 0.0]])
    """
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    problem = pose(polyhedron, energy)
    checks.real("cap", cap, infinite=True)
    problem.check_size()
    if problem.is_sparse:
        checks.refuse("polyhedron", "one of few coordinates", problem.dimension)
    generator = checks.generator("rng", rng)
    points = start_points(problem, starts, box, generator)
    quotient = Paths(polyhedron, symmetry or Symmetry(), tolerances, problem=problem)
    check_symmetry(quotient, points[:CHECKED])
    walks = Walks(problem, orbits_of(problem, symmetry), tolerances)
    lows = Lows(walks, Loci(quotient))
    allowed = np.array([_some_branch(problem, q, generator) for q in points])
    lows.ends(points, allowed, np.zeros_like(allowed))
    passes = search_passes(
        problem,
        [locus.certificate for locus in lows.minima],
        starts=len(points),
        rng=generator,
        tolerances=tolerances,
        symmetry=symmetry,
        cap=cap,
        points=list(points),
        progress=progress,
    )
    return lows.landscape(passes, cap)

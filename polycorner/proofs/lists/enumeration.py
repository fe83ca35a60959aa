"""The search for all stationary points, its symmetries, and what is made of the regions found."""

import threading
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from polycorner import checks
from polycorner.formulas.ranges import LARGEST
from polycorner.interrupts import first_interrupt
from polycorner.kinds import checked
from polycorner.minimisation.problem import Problem, pose
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.proofs.arguments import check_parameters
from polycorner.proofs.lists.boxes import Boxes
from polycorner.proofs.lists.domains import Domain, domain
from polycorner.proofs.lists.images import Motion, closed, motion, permutation
from polycorner.proofs.lists.loci import Locus
from polycorner.proofs.lists.members import OPEN, Listed, Member, full, images, moved, settled
from polycorner.proofs.lists.multiples import without_multiples
from polycorner.proofs.lists.parameters import with_parameters
from polycorner.proofs.lists.quotients import unreached
from polycorner.proofs.lists.records import record
from polycorner.proofs.lists.search import Search
from polycorner.proofs.lists.stationary import StationaryList, StationaryPoint, locus_of
from polycorner.proofs.lists.stores import Store
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import os

    from polycorner.minimisation.problem import Energy
    from polycorner.proofs.parameter_boxes import Interval

S = TypeVar("S", bound=Search)
RESOLUTION = 1e-6
MOST_BOXES = 10_000_000


@checked
def stationary_points(
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    box: Any,
    symmetry: Symmetry | None = None,
    parameters: "Mapping[str, Interval] | None" = None,
    minima_only: bool = False,
    resolution: float = RESOLUTION,
    max_boxes: int = MOST_BOXES,
    max_seconds: float = np.inf,
    workers: int = 1,
    store: "str | os.PathLike[str] | None" = None,
    progress: Progress = silent,
) -> StationaryList:
    """Find all stationary points of an energy on a polyhedron in a box, with proof.

    A point ``q`` of the set ``D`` is stationary if no direction into ``D`` decreases the energy:
    ``dE v >= 0`` for all ``v`` in the tangent cone.  At a corner with independent gradients these
    are the KKT points.  Branch and bound over the box discards what cannot contain one and
    isolates the others ([Neumaier] ch. 5); what it cannot decide is returned as boxes.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``; and/or trees and equations are allowed.  Of inequalities that are positive
        multiples of each other the first stands for all of them.
    energy : SmoothFunction or SymPy expression
        The energy ``E``.
    box : sequence or mapping
        A side for each coordinate, in their order or by name: two numbers; one number for a
        coordinate that is fixed; None for a whole circle.  A coordinate may only be fixed where a
        continuous symmetry of ``D`` and ``E`` moves it: one of ``symmetry.fields``, or a
        translation, which need not be declared.  The list is then one modulo this symmetry.
    symmetry : Symmetry, optional
        Its ``elements`` (signed permutations of the coordinates with shifts by half periods) have
        to preserve ``D``, ``E`` and the box, which is checked with the formulas; only a
        part of the box that contains a point of each orbit is then searched.
    parameters : mapping from str to (float, float), optional
        Intervals of parameters of the functions, by name.  What is proved then holds for each of
        their values: one stationary point in each listed box, and no others.  Wide intervals leave
        boxes undecided; divide them.
    minima_only : bool, optional
        Whether to list local minima only.  Boxes near saddles are then closed by negative
        curvature (:mod:`~polycorner.proofs.lists.curvature`), which takes fewer of them.
    resolution : float, optional
        Largest side, in the manifold's scales, of boxes that are left undecided.
    max_boxes, max_seconds : optional
        Where the search ends at the latest; boxes that wait then are undecided.  Boxes of earlier
        calls with the same store count, seconds do not.
    workers : int, optional
        Threads that examine boxes at a time.  The result is the same for every number.
    store : path, optional
        A folder in which the search is saved every five seconds, at the end of a round, and at its
        end.  The same call goes on where it stood, with the result of a search that was never
        interrupted.
    progress : callable, optional
        Called with the number of boxes treated, None, and what waits in words.

    Returns
    -------
    StationaryList
        After an interruption (Ctrl-C), with what was found so far and all waiting boxes undecided.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind, sides that are no intervals, coordinates that are fixed
        without a symmetry, elements that are not shown to be symmetries, and a store of another
        search.
    OSError
        If the store cannot be written, which is tried at the start.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"disc": 36 - x**2 - y**2})
    >>> found = stationary_points(
    ...     D, (x**2 + y - 11) ** 2 + (x + y**2 - 7) ** 2, box=[(-6, 6), (-6, 6)]
    ... )
    >>> found.complete, len(found.minima)
    (True, 4)
    """
    search = prepared(
        polyhedron, energy, box, symmetry, resolution, parameters, minima_only=minima_only
    )
    checks.whole("max_boxes", max_boxes, least=1)
    checks.whole("workers", workers, least=1)
    checks.real("max_seconds", max_seconds, above=0, infinite=True)
    if not callable(progress):
        checks.refuse("progress", "a function (done, total, note)", progress, TypeError)

    kept = None if store is None else Store(store, search)

    def report(s: Search) -> None:
        if kept:
            kept.save_by_the_clock()
        note = f"{len(s.waiting)} boxes wait, {len(s.regions)} points"
        progress(float(s.tally.boxes), None, note)

    stop = threading.Event()
    try:
        with first_interrupt(stop.set):
            search.run(max_boxes, max_seconds, report, workers=workers, stopped=stop.is_set)
        if kept:
            kept.save()
    finally:
        if kept:
            kept.close()
    return listed(search, pose(polyhedron, energy))


def prepared(
    polyhedron: Polyhedron,
    energy: "Energy",
    box: Any,
    symmetry: Symmetry | None,
    resolution: float,
    parameters: "Mapping[str, Interval] | None" = None,
    *,
    minima_only: bool = False,
) -> Search:
    """Return a search that has not begun, after checking its arguments."""
    arguments = polyhedron, energy, box, symmetry, resolution, parameters
    return begun(Search, *arguments, minima_only=minima_only)


def begun(
    kind: type[S],
    polyhedron: Polyhedron,
    energy: "Energy",
    box: Any,
    symmetry: Symmetry | None,
    resolution: float,
    parameters: "Mapping[str, Interval] | None" = None,
    *,
    minima_only: bool = False,
) -> S:
    """Return a search of some kind, after checking its arguments."""
    problem = pose(polyhedron, energy)
    found = domain(polyhedron.manifold, box)
    checks.real("resolution", resolution, above=0)
    value = float(problem.energy.value((found.lower + found.upper) / 2))
    if abs(value) > 2.0**LARGEST:
        checks.refuse("energy", f"values up to 2^{LARGEST:g}, which are enclosed", value)
    if symmetry is not None:
        checks.instance("symmetry", symmetry, Symmetry)
    sides = check_parameters(problem, parameters)[0]
    if sides:
        problem, found, symmetry = with_parameters(problem, found, symmetry, sides)
    reduced = without_multiples(problem.polyhedron)  # for all values of the parameters
    if reduced is not problem.polyhedron:
        problem = pose(reduced, problem.energy)
    motions, maps = _motions(problem, found, symmetry)
    checks.instance("minima_only", minima_only, bool)
    search = kind(problem, found, resolution, motions=motions, maps=maps, minima_only=minima_only)
    _check_fixed(search, symmetry)
    return search


def _motions(
    problem: Problem, found: Domain, symmetry: Symmetry | None
) -> tuple[tuple[Motion, ...], tuple[tuple[int, ...], ...]]:
    """Return the group of declared elements, and where they take inequalities."""
    elements: Sequence[Any] = symmetry.elements if symmetry else ()
    manifold = found.manifold
    generating: dict[Motion, tuple[int, ...]] = {}
    for element in elements:
        g = motion(manifold, element.apply, "symmetry")
        p = permutation(problem, g)
        if p is None:
            checks.refuse("symmetry", "elements that expanded formulas show to be symmetries", g)
        image = g.signs * np.array([found.lower, found.upper])[:, list(g.order)]
        ends = np.sort(image, axis=0) + g.shifts(manifold)
        whole = found.upper - found.lower >= manifold.periods
        if not (whole | (ends == [found.lower, found.upper]).all(axis=0)).all():
            checks.refuse("box", "one that the symmetry carries to itself", found.sides())
        generating[g] = p
    group = closed(generating, manifold.dimension, problem.inequalities)
    return tuple(group), tuple(group.values())


def _check_fixed(search: Search, symmetry: Symmetry | None) -> None:
    """Raise ValueError unless continuous symmetries carry every point to the fixed values."""
    fields = symmetry.fields if symmetry else ()
    left = unreached(search.faces.formulas, search.domain, fields)
    if left:
        names = ", ".join(search.domain.manifold.names[i] for i in left)
        checks.refuse(
            "box", f"an interval for {names}, or a continuous symmetry that moves it", "one value"
        )


def listed(search: Search, problem: Problem) -> StationaryList:
    """Return what a search found for a problem, in whose coordinates parameters are left out."""
    points: list[StationaryPoint] = []
    open_points: list[StationaryPoint] = []
    known, orbits, (members, ways) = Listed(search), 0, settled(search)
    for _, member in members:
        before = known.has(member)
        if before:
            continue  # an image of one before
        known.add(member)
        if member.place == OPEN or before is None:
            open_points.append(_point(search, member, orbits))
            continue
        points.append(_point(search, member, orbits))
        for image in images(search, member):
            alike = known.has(image)
            if not alike:
                known.add(image)
                (points if alike is False else open_points).append(_point(search, image, orbits))
        orbits += 1
    loci = tuple(locus_of(search, place) for place in _loci(search))
    if search.minima_only:
        loci = tuple(place for place in loci if place.is_minimum)
    n, names = problem.dimension, search.domain.manifold.names
    return StationaryList(
        problem,
        Domain(problem.polyhedron.manifold, search.domain.lower[:n], search.domain.upper[:n]),
        {names[i]: side for i, side in search.domain.held.items()},
        tuple(points),
        loci,
        undecided(search)[:, :, :n],
        tuple(open_points),
        search.tally,
        record(search, members, ways),
        search.minima_only,
    )


def undecided(search: Search) -> Array:
    """Return the boxes that are left or wait, ``(k, 2, n)``."""
    parts: list[Boxes] = [*search.undecided, search.waiting]
    lower = np.concatenate([p.lower for p in parts])
    upper = np.concatenate([p.upper for p in parts])
    return np.stack([lower, upper], axis=1)


def _loci(search: Search) -> list[Locus]:
    """Return the loci that were found and their images, each once."""
    domain, z = search.domain, search.reads
    found: list[Locus] = []
    for place in search.loci:
        for g in (None, *search.motions):
            image = place if g is None else _locus_image(search, place, g)
            sharp = image.sharp_lower, image.sharp_upper
            if not domain.misses(*sharp, z) and not any(
                domain.within(*sharp, other.lower, other.upper, z) for other in found
            ):
                found.append(image)
    return found


def _locus_image(search: Search, place: Locus, g: Motion) -> Locus:
    z, ends = list(place.z), []
    for lower, upper in ((place.lower, place.upper), (place.sharp_lower, place.sharp_upper)):
        sides = search.domain.lower.copy(), search.domain.upper.copy()
        sides[0][z], sides[1][z] = lower, upper
        ends += [side[z] for side in moved(g, *sides, search.domain.manifold)]
    sample = None if place.sample is None else g(place.sample, search.domain.manifold)
    return Locus(place.z, ends[0], ends[1], ends[2], ends[3], place.index, sample)


def _point(search: Search, member: Member, orbit: int) -> StationaryPoint:
    region = member.region
    lower, upper = full(search, region)
    n, d = len(search.domain.free), search.problem.polyhedron
    more = tuple(d.names[i] for i in sorted(member.zeros.difference(region.active)))
    active = tuple(d.names[i] for i in region.active)
    ends = zip(region.sharp_lower[n:].tolist(), region.sharp_upper[n:].tolist(), strict=True)
    multipliers = dict(zip((*active, *d.equation_names), ends, strict=True))
    some = slice(0, len(lower) - len(search.domain.parameters))
    index = region.index if region.index == 0 or not more else None
    return StationaryPoint(lower[some], upper[some], active, multipliers, index, orbit, more)

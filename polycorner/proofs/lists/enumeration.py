"""The search for all stationary points: its arguments, its symmetries, its run."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
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
from polycorner.proofs.lists.domains import Domain, domain
from polycorner.proofs.lists.images import Motion, closed, motion, permutation
from polycorner.proofs.lists.listing import listed
from polycorner.proofs.lists.multiples import pieces, without_multiples
from polycorner.proofs.lists.parameters import with_parameters
from polycorner.proofs.lists.quotients import unreached
from polycorner.proofs.lists.search import Search
from polycorner.proofs.lists.stationary import StationaryList
from polycorner.proofs.lists.stores import Store
from polycorner.proofs.lists.unions import united

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
        multiples of each other the first stands for all of them, and ``f >= 0`` with ``-f >= 0``
        in one branch is the equation ``f = 0``.
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
        part of the box that contains a point of each orbit is then searched.  Not taken where
        branches have equations of their own.
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
        calls with the same store count, seconds do not.  Branches with equations of their own are
        searched one after another, each to this limit.
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
    checks.instance("minima_only", minima_only, bool)
    question = _asked(polyhedron, energy, box, symmetry, resolution, parameters)
    branches = pieces(question.problem.polyhedron)
    several = len(branches.parts) > 1
    if several and symmetry is not None:
        expected = "None, as branches of the polyhedron have equations of their own"
        checks.refuse("symmetry", expected, symmetry)
    checks.whole("max_boxes", max_boxes, least=1)
    checks.whole("workers", workers, least=1)
    checks.real("max_seconds", max_seconds, above=0, infinite=True)
    if not callable(progress):
        checks.refuse("progress", "a function (done, total, note)", progress, TypeError)

    searches, stop = [], threading.Event()
    with first_interrupt(stop.set):
        for k, part in enumerate(branches.parts):
            search = question.begun(Search, part, minima_only=minima_only)
            searches.append(search)
            folder = store if store is None or not several else Path(store) / f"piece_{k}"
            kept = None if folder is None else Store(folder, search)
            try:
                _run(search, kept, max_boxes, max_seconds, workers, stop, progress)
            finally:
                if kept:
                    kept.close()
    posed = pose(polyhedron, energy)
    return united(posed, searches, branches.alike) if several else listed(searches[0], posed)


def _run(
    search: Search,
    kept: Store | None,
    max_boxes: int,
    max_seconds: float,
    workers: int,
    stop: threading.Event,
    progress: Progress,
) -> None:
    """Run a search to its end, saving it by the clock."""

    def report(s: Search) -> None:
        if kept:
            kept.save_by_the_clock()
        note = f"{len(s.waiting)} boxes wait, {len(s.regions)} points"
        progress(float(s.tally.boxes), None, note)

    search.run(max_boxes, max_seconds, report, workers=workers, stopped=stop.is_set)
    if kept:
        kept.save()


@dataclass(frozen=True)
class _Question:
    """What is asked, after its arguments were checked, parameters among the coordinates."""

    problem: Problem
    domain: Domain
    resolution: float
    symmetry: Symmetry | None

    def begun(self, kind: type[S], polyhedron: Polyhedron, *, minima_only: bool = False) -> S:
        """Return a search in a polyhedron that has not begun."""
        same = polyhedron is self.problem.polyhedron
        problem = self.problem if same else pose(polyhedron, self.problem.energy)
        motions, maps = _motions(problem, self.domain, self.symmetry)
        about = problem, self.domain, self.resolution
        search = kind(*about, motions=motions, maps=maps, minima_only=minima_only)
        _check_fixed(search, self.symmetry)
        return search


def _asked(
    polyhedron: Polyhedron,
    energy: "Energy",
    box: Any,
    symmetry: Symmetry | None,
    resolution: float,
    parameters: "Mapping[str, Interval] | None" = None,
) -> _Question:
    """Return what is asked, after checking it."""
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
    return _Question(problem, found, resolution, symmetry)


def begun(
    kind: type[S],
    polyhedron: Polyhedron,
    energy: "Energy",
    box: Any,
    symmetry: Symmetry | None,
    resolution: float,
) -> S:
    """Return a search in the whole of a set that has not begun, after checking its arguments."""
    question = _asked(polyhedron, energy, box, symmetry, resolution)
    return question.begun(kind, without_multiples(question.problem.polyhedron))


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

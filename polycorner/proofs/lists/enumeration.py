"""The search for all stationary points: its arguments, its symmetries, its run.

Coordinates that may be fixed because continuous symmetries carry every point to their values.

Let the fields ``xi`` be symmetries whose components have bounded derivatives on the whole manifold,
so that their flows exist for all times.  After the coordinates ``F``, a coordinate ``j`` may be
fixed if a combination of the fields with constant coefficients has, wherever ``q_F`` has its
values, components 0 along ``F`` and a constant other than 0 along ``j``: its flow keeps ``q_F`` and
carries ``q_j`` to any value.

At a point of the section the fields leave it, and the energy and all functions are constant along
them: the point is stationary in the section if and only if it is in the whole space.

Parameters of formulas as coordinates of a search that nothing moves along.

The functions become functions of the coordinates and the chosen parameters.  Directions, faces and
loci are those of the coordinates, at each value of the parameters.
"""

import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from polycorner import checks
from polycorner.formulas.ranges import LARGEST
from polycorner.interrupts import first_interrupt
from polycorner.intervals.balls import ball, precision
from polycorner.intervals.enclosures import Formulas, SmoothForms
from polycorner.intervals.tapes import Box
from polycorner.kinds import checked
from polycorner.minimisation.parametric import lifted_problem
from polycorner.minimisation.problem import Problem, pose
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.progress import Progress, silent
from polycorner.proofs.invariance import Generator, annihilated, generators, translations
from polycorner.proofs.lists.domains import Domain, domain
from polycorner.proofs.lists.faces import BITS
from polycorner.proofs.lists.images import Motion, closed, motion, permutation
from polycorner.proofs.lists.listing import listed, united
from polycorner.proofs.lists.relations import pieces, without_multiples
from polycorner.proofs.lists.search import BoxSearch, StationarySearch
from polycorner.proofs.lists.stationary import StationaryList
from polycorner.proofs.lists.stores import SearchStore
from polycorner.proofs.parameter_boxes import check_parameters
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH

if TYPE_CHECKING:
    import os

    from polycorner.minimisation.problem import Energy

Interval = tuple[float, float]
S = TypeVar("S", bound=BoxSearch)


def with_parameters(
    problem: Problem,
    found: Domain,
    symmetry: Symmetry | None,
    sides: Mapping[str, Interval],
) -> tuple[Problem, Domain, Symmetry | None]:
    """Return problem, domain and symmetry with some parameters as additional coordinates.

    Raises
    ------
    ValueError
        If a parameter has the name of a coordinate.
    """
    d, names = problem.polyhedron, tuple(sides)
    everything = lifted_problem(problem, names)
    extended = everything.polyhedron.manifold
    n, ends = d.manifold.size, np.array(list(sides.values()))
    lower, upper = (np.r_[side, ends[:, k]] for k, side in enumerate((found.lower, found.upper)))
    places = tuple(range(n, n + len(names)))
    return everything, Domain(extended, lower, upper, places), _extended(symmetry, n, len(names))


def _extended(symmetry: Symmetry | None, n: int, count: int) -> Symmetry | None:
    if symmetry is None:
        return None

    def carried(apply: Any) -> Any:
        def moved(q: Array) -> Array:
            return np.concatenate([np.asarray(apply(q[..., :n])), q[..., n:]], axis=-1)

        return moved

    elements = tuple(Element(carried(e.apply), e.names) for e in symmetry.elements)
    fields = [f if isinstance(f, Mapping) else [*f, *[0] * count] for f in symmetry.fields]
    return Symmetry(fields=fields, elements=elements)


def unreached(formulas: Formulas, domain: Domain, fields: Sequence[object]) -> list[int]:
    """Return the fixed coordinates whose values not every orbit is shown to reach.

    ``formulas`` are all functions of the problem, ``fields`` the declared symmetries; translations
    are found without being declared.
    """
    left = list(domain.fixed)
    if not left:
        return left
    everything = SmoothForms(formulas.graph, formulas.outputs, formulas.dimension, formulas.inputs)
    with precision(BITS):
        known = [f for f in generators(domain.manifold, fields) if all(annihilated(everything, f))]
        known += generators(domain.manifold, translations(everything))
        complete = [f for f in known if _is_complete(f)]
        done: list[int] = []
        while left:
            rows = [_constants(f, domain, done) for f in complete]
            new = next((j for j in left if _moves(rows, done, j)), None)
            if new is None:
                break
            done.append(new)
            left.remove(new)
    return left


def _constants(field: Generator, domain: Domain, done: Sequence[int]) -> Array:
    """Return the components that are constant where some coordinates are fixed, NaN for others."""
    hull = [ball(0, math.inf)] * domain.manifold.dimension
    for i in done:
        hull[i] = ball(float(domain.lower[i]))
    found = field.bounds(hull)
    return np.array([float(x) if x.is_finite() and x.rad() == 0 else math.nan for x in found])


def _moves(rows: Sequence[Array], done: Sequence[int], new: int) -> bool:
    """Whether a combination of rows is 0 along ``done`` and not along ``new``."""
    usable = [row[[*done, new]] for row in rows if np.isfinite(row[[*done, new]]).all()]
    if not usable:
        return False
    matrix = np.array(usable)
    return _rank(matrix) > _rank(matrix[:, :-1])


def _rank(matrix: Array) -> int:
    return int(np.linalg.matrix_rank(matrix, rtol=DEFAULT.alike)) if matrix.size else 0


def _is_complete(field: Generator) -> bool:
    """Whether the derivatives of the components are bounded, without branches."""
    formulas = field.formulas
    nodes = formulas.graph.needed(formulas.outputs)
    if any(formulas.graph.nodes[a][0] == "select" for a in nodes):
        return False
    forms = SmoothForms(formulas.graph, formulas.outputs, formulas.dimension, formulas.inputs)
    _, slopes = forms.evaluate(Box([ball(0, math.inf)] * formulas.dimension), 1)
    return all(x.is_finite() for row in slopes for x in row)


@checked
def stationary_points(
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    box: Any,
    symmetry: Symmetry | None = None,
    parameters: "Mapping[str, Interval] | None" = None,
    minima_only: bool = False,
    resolution: float = SEARCH.resolution,
    max_boxes: int = SEARCH.max_boxes,
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
    question = _asked(polyhedron, energy, box, symmetry, resolution, parameters)
    branches = pieces(question.problem.polyhedron)
    several = len(branches.parts) > 1
    if several and symmetry is not None:
        msg = "symmetry: expected None, as branches have equations of their own; got a Symmetry"
        raise ValueError(msg)
    limits = Limits(max_boxes, max_seconds, workers, progress)

    searches = []
    with first_interrupt(limits.stop.set):
        for k, part in enumerate(branches.parts):
            search = question.begun(StationarySearch, part, minima_only=minima_only)
            searches.append(search)
            # Each piece is a search of its own, with a store of its own.
            folder = store if store is None or not several else Path(store) / f"piece_{k}"
            kept = None if folder is None else SearchStore(folder, search)
            try:
                limits.run(search, kept)
            finally:
                if kept:
                    kept.close()
    posed = pose(polyhedron, energy)
    return united(posed, searches, branches.alike) if several else listed(searches[0], posed)


@dataclass(frozen=True)
class Limits:
    """Where a search ends at the latest, and how it is run."""

    max_boxes: int
    max_seconds: float
    workers: int
    progress: Progress
    stop: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        checks.whole("max_boxes", self.max_boxes, least=1)
        checks.whole("workers", self.workers, least=1)
        checks.real("max_seconds", self.max_seconds, above=0, infinite=True)

    def run(self, search: BoxSearch, kept: SearchStore | None = None) -> None:
        """Run a search to its end, saving it by the clock."""

        def report() -> None:
            if kept:
                kept.save_by_the_clock()
            note = f"{len(search.waiting)} boxes wait, {len(search.regions)} points"
            self.progress(float(search.tally.boxes), None, note)

        limits = self.max_boxes, self.max_seconds
        search.run(*limits, report, workers=self.workers, stopped=self.stop.is_set)
        if kept:
            kept.save()


@dataclass(frozen=True)
class _Question:
    """What is asked, after its arguments were checked, parameters among the coordinates."""

    problem: Problem
    domain: Domain
    resolution: float
    symmetry: Symmetry | None

    def begun(self, kind: type[S], polyhedron: Polyhedron, **options: Any) -> S:
        """Return a search in a polyhedron that has not begun."""
        same = polyhedron is self.problem.polyhedron
        problem = self.problem if same else pose(polyhedron, self.problem.energy)
        motions, maps = _motions(problem, self.domain, self.symmetry)
        about = problem, self.domain, self.resolution
        search = kind(*about, motions=motions, maps=maps, **options)
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
    **options: Any,
) -> S:
    """Return a search in the whole of a set that has not begun, after checking its arguments."""
    question = _asked(polyhedron, energy, box, symmetry, resolution)
    return question.begun(kind, without_multiples(question.problem.polyhedron), **options)


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


def _check_fixed(search: BoxSearch, symmetry: Symmetry | None) -> None:
    """Raise ValueError unless continuous symmetries carry every point to the fixed values."""
    fields = symmetry.fields if symmetry else ()
    left = unreached(search.faces.formulas, search.domain, fields)
    if left:
        names = ", ".join(search.domain.manifold.names[i] for i in left)
        checks.refuse(
            "box", f"an interval for {names}, or a continuous symmetry that moves it", "one value"
        )

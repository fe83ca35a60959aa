"""Search for the skeleton of a polyhedron, from the start or resumed."""

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.checks import reals
from polycorner.kinds import checked
from polycorner.polyhedra.faces import projected
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient, WalkOptions
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.searches import Clock
from polycorner.signatures import shown
from polycorner.skeletons.assembly import assembled
from polycorner.skeletons.elements import Skeleton
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.incidences import Flag
from polycorner.skeletons.insides import add_inner_corners
from polycorner.skeletons.parts import Completeness, Edge
from polycorner.skeletons.states import Budget, SearchState
from polycorner.spaces.manifold import Array
from polycorner.tolerances import RANK_TOLERANCE, TOLERANCE, Tolerances
from polycorner.workers import opened_if_any

Keep: TypeAlias = Callable[[Skeleton], object]
UNFINISHED = (Completeness.BUDGET, Completeness.INTERRUPTED)
EXTENT = 1000.0
BUDGET = 100_000


@shown
def skeleton(
    polyhedron: Polyhedron,
    starts: ArrayLike,
    *,
    symmetry: Symmetry | None = None,
    budget: int | Budget = BUDGET,
    executor: Any = None,
    progress: Progress | None = None,
    keep: Keep | None = None,
    rng: np.random.Generator | int | None = None,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
    extent: float = EXTENT,
    options: WalkOptions | None = None,
) -> Skeleton:
    """Find the corners, edges and faces of a polyhedron.

    From each start the search descends in random straight directions to a face, within the face
    to an edge, and along the edge to a corner.  It traces every edge out of every corner to the
    next corner until nothing new is found.  Then it crosses every two-dimensional face from the
    middle of every edge, which joins the boundary curves of a face and finds parts that are
    connected through faces alone.  At last it looks for islands: boundary that random chords
    through the polyhedron end on, or that minimising a function that was never met leads to.
    Neither proves that there are no others.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set.
    starts : sequence of (n,) arrays
        Points of the set; one outside is moved in by the least displacement that is found.
    symmetry : Symmetry, optional
        Symmetry to divide by.  With relabellings corners, edges and faces are counted up to
        them.
    budget : int or Budget, optional
        Most edges to trace; as many starts may be descended from, and as many faces crossed.
        A :class:`Budget` bounds the time as well.
    executor : optional
        Who walks along the edges, as in :func:`~polycorner.sweeps.execution.sweep`: None (default)
        this process; a number starts that many processes, which are replaced when they die;
        otherwise a ``concurrent.futures.Executor`` or a ``distributed.Client``, which stays open.
        The skeleton is the same, in content and order, for all of them.
    progress : callable, optional
        Called as ``progress(edges, edges + pending, note)`` after every edge, descent and crossing;
        ``pending`` counts the ends of edges to trace; see :class:`~polycorner.progress.Progress`.
    keep : callable, optional
        Called every few seconds with what was found so far, a Skeleton to be saved: what it does
        takes a twentieth of the time at most.
    rng : Generator or int, optional
        Random directions of the descents; default a generator with seed 0.
    tolerance : float, optional
        Distance, in scale units, up to which a function counts as zero.  Edges shorter than ten
        times that are not found.
    rank_tolerance : float, optional
        Singular values of the unit gradients below this fraction of the largest count as zero.
    extent : float, optional
        Length, in scale units, after which an edge counts as running to infinity.
    options : WalkOptions, optional
        Steps of walks, and distances at which corners are looked at.  Default ``WalkOptions()``;
        ``WalkOptions.careful()`` where curves run closely beside each other.

    Returns
    -------
    Skeleton
        After an interruption (Ctrl-C), or when budget or time is used up, what was found so far;
        :func:`resume` continues the search.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind or shape.  A start outside the polyhedron is no error:
        ``Skeleton.notes`` tell what it violates and where it was moved.
    WorkersError
        If the workers do not answer, or die again and again.

    Examples
    --------
    >>> from polycorner.spaces.manifold import Manifold
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> found = skeleton(Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y}), [[0.0, 1.0]])
    >>> len(found.corners), len(found.edges), len(found.faces), found.euler_characteristic
    (2, 2, 1, 1)
    """
    checks.instance("polyhedron", polyhedron, Polyhedron)
    if symmetry is not None:
        checks.instance("symmetry", symmetry, Symmetry)
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    checks.real("extent", extent, above=0, infinite=True, unit="scale units")
    points, names = np.atleast_2d(reals("starts", starts)), polyhedron.manifold.names
    if points.shape[-1] != len(names):
        expected = f"shape (..., {len(names)}) for the coordinates of the polyhedron"
        checks.refuse("starts", f"{expected}, {', '.join(names)}", points.shape)
    points = polyhedron.manifold.points(points, "starts")
    if points.ndim != 2:
        expected = f"a list of points, shape (k, {points.shape[-1]})"
        checks.refuse("starts", expected, points.shape)
    points = polyhedron.manifold.placed(points, "starts")
    options = WalkOptions() if options is None else options
    checks.instance("options", options, WalkOptions)
    quotient = Quotient(
        polyhedron, symmetry or Symmetry(), tolerances, float(extent), options=options
    )
    explorer = Explorer(quotient.near(points), points, checks.generator("rng", rng))
    return _run(explorer, budget, executor, progress, keep)


@checked
def resume(
    skeleton: Skeleton,
    *,
    budget: int | Budget = BUDGET,
    executor: Any = None,
    progress: Progress | None = None,
    keep: Keep | None = None,
) -> Skeleton:
    """Resume a search that was interrupted or ran out of budget or time, with the same options.

    Parameters
    ----------
    skeleton : Skeleton
        What was found so far, also from a pickle; it stays as it is.
    budget, executor, progress, keep
        As for :func:`skeleton`.

    Returns
    -------
    Skeleton
        The same corners, edges and faces, and more.
    """
    state = checks.instance("skeleton", skeleton, Skeleton, "polycorner.skeleton").state
    checks.instance("skeleton", state, SearchState, "polycorner.skeleton")
    return _run(Explorer.resumed(state), budget, executor, progress, keep)


@checked
def examine_faces(
    skeleton: Skeleton,
    *,
    budget: int | Budget = BUDGET,
    executor: Any = None,
    progress: Progress | None = None,
) -> Skeleton:
    """Look for corners inside the two-dimensional faces of a finished skeleton.

    Where another function touches zero inside a face, no edge need lead to the corner: see
    :mod:`polycorner.skeletons.insides`.  One straight walk crosses every face from one of its
    corners, and Newton's method looks for minima that are zero beside it; faces along which
    gradients are dependent are left out.  From corners that are found the search goes on.  It does
    not prove that there are no others.

    Parameters
    ----------
    skeleton : Skeleton
        The result of a search that is finished; it stays as it is.
    budget : int or Budget, optional
        As for :func:`skeleton`, for the search from the corners that are found.
    executor, progress
        As for :func:`skeleton`.

    Returns
    -------
    Skeleton
        The same corners, edges and faces, and more.

    Raises
    ------
    ValueError
        If the search is not finished.
    """
    state = checks.instance("skeleton", skeleton, Skeleton, "polycorner.skeleton").state
    checks.instance("skeleton", state, SearchState, "polycorner.skeleton")
    if skeleton.complete in UNFINISHED:
        checks.refuse("skeleton", "the result of a finished search", skeleton.complete.value)
    explorer, limits = Explorer.resumed(state), _limits(budget, progress=progress)
    complete, examined = skeleton.complete, set[Flag]()
    with opened_if_any(executor) as workers:
        try:
            while add_inner_corners(explorer, examined, progress or silent, workers):
                complete = explorer.run(limits, progress or silent, workers)
                if complete in UNFINISHED:
                    break
        except KeyboardInterrupt:
            complete = Completeness.INTERRUPTED
    if complete not in UNFINISHED and explorer.registry.lost:
        complete = Completeness.GAPS
    return assembled(explorer, complete)


def _limits(budget: int | Budget, **called: Any) -> Budget:
    for name, function in called.items():
        if function is not None and not callable(function):
            checks.refuse(name, "a callable or None", function, TypeError)
    return budget if isinstance(budget, Budget) else Budget(budget)


def _run(
    explorer: Explorer,
    budget: int | Budget,
    executor: Any,
    progress: Progress | None,
    keep: Keep | None,
) -> Skeleton:
    def save() -> None:
        explorer.expand()
        if keep is not None:
            keep(assembled(explorer, Completeness.BUDGET))

    limits = _limits(budget, progress=progress, keep=keep)
    clock = None if keep is None else Clock(save)
    with opened_if_any(executor) as workers:
        complete = explorer.run(limits, progress or silent, workers, clock)
    try:
        return assembled(explorer, complete)
    except KeyboardInterrupt:
        return assembled(explorer, Completeness.INTERRUPTED)


@checked
def traced(skeleton: Skeleton, edge: Edge, *, pieces: int = 8) -> Array:
    """Return points of an edge ``(k, n)``: its polyline with every chord cut into pieces.

    Newton's method projects the new points to the edge, so that they lie on it as exactly as
    those of the polyline; coordinates are not wrapped.

    Parameters
    ----------
    skeleton : Skeleton
        What :func:`~polycorner.skeletons.search.skeleton` returned.
    edge : Edge
        One of its edges.
    pieces : int, optional
        Number of pieces of a chord.

    Raises
    ------
    TypeError, ValueError
        Naming the argument, what was expected and what came.
    """
    state = checks.instance("skeleton", skeleton, Skeleton).state
    checks.instance("skeleton", state, SearchState, "polycorner.skeleton")
    checks.instance("edge", edge, Edge)
    checks.whole("pieces", pieces, least=1)
    quotient, scales = state.quotient, skeleton.polyhedron.manifold.scale_array
    rows = [skeleton.polyhedron.names.index(name) for name in edge.active]
    kept = quotient.at(edge.polyline[len(edge.polyline) // 2]).basis(rows)
    points = [edge.polyline[0]]
    for start, end in zip(edge.polyline, edge.polyline[1:], strict=False):
        chord = float(np.linalg.norm((end - start) / scales))
        for s in np.arange(1, pieces) / pieces:
            point = projected(quotient, start + s * (end - start), kept, chord)
            if point is not None:
                points.append(point.q)
        points.append(end)
    return np.array(points)

"""Finding the atlas of a polyhedron: the entrance, and the order of the work."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import TOLERANCE, check_tolerance
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.skeletons.assembly import assembled
from polycorner.skeletons.elements import Completeness, Skeleton
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.points import Quotient
from polycorner.spaces.manifold import reals

EXTENT = 1000.0
BUDGET = 100_000

# What is told while walking: corners, edges, and ends of edges still to walk.
Progress = Callable[[int, int, int], None]


def skeleton(
    polyhedron: Polyhedron,
    starts: ArrayLike,
    *,
    symmetry: Symmetry | None = None,
    budget: int = BUDGET,
    progress: Progress | None = None,
    rng: np.random.Generator | int | None = None,
    tolerance: float = TOLERANCE,
    extent: float = EXTENT,
) -> Skeleton:
    """Find corners, edges and faces of a polyhedron by walking.

    From every start it falls along random straight directions, onto a face, along the face onto
    an edge, along the edge into a corner.  It walks every edge out of every corner to the next
    corner, until nothing new appears; then it shoots across every two-dimensional face from the
    middle of every edge, which joins the boundary curves of a face and finds what hangs
    together through faces alone.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set.
    starts : sequence of (n,) arrays
        Points of the set to fall from.
    symmetry : Symmetry, optional
        What is quotiented out.  With relabellings corners, edges and faces are counted up to
        them.
    budget : int, optional
        How many edges may be walked.
    progress : callable, optional
        Called as ``progress(corners, edges, pending)`` after every edge.
    rng : Generator or int, optional
        Random directions of the falls; default a generator with seed 0.
    tolerance : float, optional
        Distance, in scale units, up to which a function counts as zero.
    extent : float, optional
        Length, in scale units, after which an edge counts as running to infinity.

    Returns
    -------
    Skeleton
        Also after an interruption (Ctrl-C): then with what was found so far; :func:`resume`
        goes on from there.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind or shape.  A start outside the polyhedron is no error: it
        is reported in ``Skeleton.notes``.

    Examples
    --------
    >>> from polycorner.spaces.manifold import Manifold
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> a = skeleton(Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y}), [[0.0, 1.0]])
    >>> len(a.corners), len(a.edges), len(a.faces), a.euler_characteristic
    (2, 2, 1, 1)
    """
    if not isinstance(polyhedron, Polyhedron):
        msg = f"polyhedron: expected a Polyhedron; got {type(polyhedron).__name__}"
        raise TypeError(msg)
    if symmetry is not None and not isinstance(symmetry, Symmetry):
        msg = f"symmetry: expected a Symmetry; got {type(symmetry).__name__}"
        raise TypeError(msg)
    check_tolerance("tolerance", tolerance)
    _check_budget(budget)
    if isinstance(extent, bool) or not isinstance(extent, int | float) or not extent > 0:
        msg = f"extent: expected a positive length in scale units; got {extent!r}"
        raise ValueError(msg)
    _check_progress(progress)
    points = polyhedron.manifold.points(np.atleast_2d(reals(starts, "starts")), "starts")
    if points.ndim != 2:
        msg = (
            f"starts: expected a list of points, shape (k, {points.shape[-1]}); got {points.shape}"
        )
        raise ValueError(msg)
    quotient = Quotient(polyhedron, symmetry or Symmetry(), tolerance, extent)
    return _run(Explorer(quotient, points, _generator(rng)), budget, progress)


def resume(atlas: Skeleton, *, budget: int = BUDGET, progress: Progress | None = None) -> Skeleton:
    """Go on with an atlas that was interrupted or ran out of budget.

    Parameters
    ----------
    atlas : Skeleton
        What was found so far; its corners, edges and faces stay as they are.
    budget, progress
        As for :func:`skeleton`.
    """
    if not isinstance(atlas, Skeleton) or not isinstance(atlas.state, Explorer):
        msg = f"atlas: expected a Skeleton that skeleton() returned; got {type(atlas).__name__}"
        raise TypeError(msg)
    _check_budget(budget)
    _check_progress(progress)
    return _run(atlas.state, budget, progress)


def _run(explorer: Explorer, budget: int, progress: Progress | None) -> Skeleton:
    complete = explorer.run(budget, progress)
    try:
        return assembled(explorer, complete)
    except KeyboardInterrupt:
        return assembled(explorer, Completeness.INTERRUPTED)


def _generator(rng: np.random.Generator | int | None) -> np.random.Generator:
    expected = "rng: expected a Generator or a whole number not below 0"
    whole = isinstance(rng, int) and not isinstance(rng, bool)
    if rng is not None and not whole and not isinstance(rng, np.random.Generator):
        msg = f"{expected}; got {rng!r}"
        raise TypeError(msg)
    if isinstance(rng, int) and rng < 0:
        msg = f"{expected}; got {rng}"
        raise ValueError(msg)
    return np.random.default_rng(0 if rng is None else rng)


def _check_progress(progress: Progress | None) -> None:
    if progress is not None and not callable(progress):
        msg = f"progress: expected a callable or None; got {progress!r}"
        raise TypeError(msg)


def _check_budget(budget: int) -> None:
    if isinstance(budget, bool) or not isinstance(budget, int) or budget < 1:
        msg = f"budget: expected a positive whole number of edges; got {budget!r}"
        raise ValueError(msg)

"""The search for all corners of a polyhedron in a box, with proof."""

import threading
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.interrupts import first_interrupt
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.progress import Progress, silent
from polycorner.proofs.lists.corner_lists import CornerList, CornerPoint
from polycorner.proofs.lists.corner_points import Candidate, candidates, with_images
from polycorner.proofs.lists.corner_records import corner_record
from polycorner.proofs.lists.corner_search import CornerSearch
from polycorner.proofs.lists.enumeration import MOST_BOXES, RESOLUTION, begun
from polycorner.proofs.lists.listing import undecided
from polycorner.proofs.lists.members import full
from polycorner.proofs.lists.search import Search
from polycorner.proofs.lists.tips import TipRegion


def corners(
    polyhedron: Polyhedron,
    *,
    box: Any,
    symmetry: Symmetry | None = None,
    resolution: float = RESOLUTION,
    max_boxes: int = MOST_BOXES,
    max_seconds: float = np.inf,
    workers: int = 1,
    progress: Progress = silent,
) -> CornerList:
    """Find all corners of a polyhedron in a box, with proof.

    Near a point ``q`` the set ``D`` is a union of pieces, each of them the points where some
    functions that vanish at ``q`` are not negative; ``A(q)`` are the functions of those pieces that
    do not have all functions of another piece.  A *corner* is a point of ``D`` that is isolated
    among the common zeros of ``A(q)`` and the equations.  It is regular if the gradients of these
    have rank ``N``, the number of coordinates that are free (there may be more of them), and
    singular otherwise: a cusp, a contact of two curves, an apex.

    Branch and bound over the box shows that there are no corners elsewhere
    (:mod:`~polycorner.proofs.lists.levels`).  Singular corners are isolated by second order where
    they have rational coordinates (:mod:`~polycorner.proofs.lists.tips`); what is not decided
    is returned as boxes, and as points of which it is not known whether they are corners.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set ``D``; and/or trees and equations are allowed.  Of inequalities that are positive
        multiples of each other the first stands for all of them, and ``f >= 0`` with ``-f >= 0``
        in every branch is the equation ``f = 0``.
    box, symmetry, resolution, max_boxes, max_seconds, workers, progress
        As for :func:`stationary_points`.  With coordinates fixed, corners are points isolated
        modulo the continuous symmetry.

    Returns
    -------
    CornerList
        After an interruption (Ctrl-C), with what was found so far and all waiting boxes undecided.

    Raises
    ------
    TypeError, ValueError
        As :func:`stationary_points`.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y})
    >>> found = corners(D, box=[(-3, 3), (-3, 3)])
    >>> found.complete, len(found), len(found.skeleton().edges)
    (True, 2, 2)
    """
    import sympy

    checks.instance("polyhedron", polyhedron, Polyhedron)
    nothing = sympy.Integer(0)
    search = begun(CornerSearch, polyhedron, nothing, box, symmetry, resolution)
    checks.whole("max_boxes", max_boxes, least=1)
    checks.whole("workers", workers, least=1)
    checks.real("max_seconds", max_seconds, above=0, infinite=True)
    if not callable(progress):
        checks.refuse("progress", "a function (done, total, note)", progress, TypeError)

    def report(s: Search) -> None:
        note = f"{len(s.waiting)} boxes wait, {len(s.regions)} points"
        progress(float(s.tally.boxes), None, note)

    stop = threading.Event()
    with first_interrupt(stop.set):
        search.run(max_boxes, max_seconds, report, workers=workers, stopped=stop.is_set)
    return listed(search)


def listed(search: CornerSearch) -> CornerList:
    """Return what a search found."""
    found = candidates(search)
    points = [(one, _point(search, one, orbit)) for one, orbit in with_images(search, found)]
    unknown = [one for one in found if one.active is None]
    return CornerList(
        search.problem.polyhedron,
        search.domain,
        tuple(point for one, point in points if one.active is not None),
        undecided(search),
        (
            *(_point(search, one, -1) for one in unknown),
            *(point for one, point in points if one.active is None),
        ),
        search.tally,
        corner_record(search, found),
    )


def _point(search: CornerSearch, one: Candidate, orbit: int) -> CornerPoint:
    lower, upper = full(search, one.region)
    names = search.problem.polyhedron.names
    rows = sorted(one.zeros) if one.active is None else one.active
    singular = isinstance(search.regions[one.number], TipRegion)
    return CornerPoint(lower, upper, tuple(names[i] for i in rows), singular, orbit)

"""Branches of an and/or tree in a box: which inequalities have to hold together there."""

import numpy as np
from numpy.typing import NDArray

from polycorner import checks
from polycorner.polyhedra.polyhedron import Polyhedron

Mask = NDArray[np.bool_]
MOST_BRANCHES = 4096
MANY = 16  # branches from which on boxes are treated one by one


def conjunctions(polyhedron: Polyhedron) -> Mask:
    """Return the set as a union of intersections, ``(branches, m)``.

    Raises
    ------
    ValueError
        If there are too many.
    """
    m = len(polyhedron.functions)
    pieces = polyhedron.signs_to_pieces([0] * m)
    if len(pieces) > MOST_BRANCHES:
        checks.refuse("polyhedron", f"a tree of at most {MOST_BRANCHES} branches", len(pieces))
    masks = np.zeros((len(pieces), m), dtype=np.bool_)
    for mask, piece in zip(masks, pieces, strict=True):
        mask[list(piece)] = True
    return masks


def items(conj: Mask, below: Mask, above: Mask) -> tuple[NDArray[np.intp], Mask]:
    """Return the branches that points of the set in each box may lie in.

    A function is ``below`` where it is negative on the whole box, ``above`` where it is positive.
    A branch whose open functions include those of another one is contained in it, in this box.

    Parameters
    ----------
    conj : (c, m) array
        The union of intersections.
    below, above : (B, m) arrays
        Signs of the functions on boxes.

    Returns
    -------
    boxes : (I,) array
        A box for each item; boxes without any are outside the set.
    masks : (I, m) array
        The functions that are open there and have to hold in the branch.
    """
    # An intersection needs no comparison of branches, and is the common case.
    if len(conj) == 1:
        inside: NDArray[np.intp] = np.flatnonzero(~(below & conj[0]).any(axis=1))
        return inside, ~above[inside] & conj[0]
    alive: Mask = ~np.any(below[:, None, :] & conj, axis=2)  # (B, c)
    open_: Mask = conj & ~above[:, None, :]  # (B, c, m)
    # A branch inside another would be closed twice, and may fail where the larger one succeeds.
    kept = (_least_of_many if len(conj) > MANY else _least)(alive, open_)
    boxes, branches = np.nonzero(kept)
    return boxes, open_[boxes, branches]


def merged(boxes: NDArray[np.intp], masks: Mask) -> tuple[NDArray[np.intp], Mask]:
    """Return one item for each box, with the functions of all its items."""
    if not len(boxes):
        return boxes, masks
    first = np.flatnonzero(np.diff(boxes, prepend=-1))
    return boxes[first], np.logical_or.reduceat(masks, first, axis=0)


def _least(alive: Mask, open_: Mask) -> Mask:
    """Return which branches contain no other one, the first of equal ones, ``(B, c)``."""
    count = alive.shape[1]
    kept: Mask = alive.copy()
    for i in range(count):
        for j in range(count):
            if i != j:  # branch i is dropped if j is within it, the later one if they are equal
                within: Mask = ~np.any(open_[:, j] & ~open_[:, i], axis=1)
                equal: Mask = within & ~np.any(open_[:, i] & ~open_[:, j], axis=1)
                kept[:, i] &= ~(alive[:, j] & within & ((j < i) | ~equal))
    return kept


def _least_of_many(alive: Mask, open_: Mask) -> Mask:
    """Return the same, from sets of functions as the bits of whole numbers."""
    kept: Mask = np.zeros_like(alive)
    # Bits of whole numbers: quadratic in branches, but without arrays for each pair.
    packed = np.packbits(open_, axis=2)
    for box, branches in enumerate(alive):
        first: dict[int, int] = {}
        for c in np.flatnonzero(branches).tolist():
            first.setdefault(int.from_bytes(packed[box, c].tobytes(), "big"), c)
        for bits, c in first.items():
            kept[box, c] = not any(other & ~bits == 0 for other in first if other != bits)
    return kept

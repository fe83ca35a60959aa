"""The compiled tests of boxes, as functions of arrays.

Calls are made without the interpreter's lock.

``python -m polycorner.proofs.lists.intermediate`` writes their intermediate code; ``make
intermediate`` does this after any of them was changed.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.formulas.shipped import Shipped
from polycorner.formulas.tables import Layout
from polycorner.proofs.lists.entries import BENT, CARRIED, COVERED, DIRECTIONS
from polycorner.spaces.manifold import Array

Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]


def _make() -> str:
    from polycorner.proofs.lists.entry_points import made

    return made()


SHIPPED = Shipped(
    package="polycorner.proofs.lists",
    file="boxes.ll.xz",
    make=_make,
    names=("directions", "covered", "carried", "bent"),
    arguments=1,
    results=0,
    what="tests of boxes",
    seconds=10,
    sources=("curvature.py", "directions.py", "entries.py", "entry_points.py"),
)


def _call(number: int, layout: Layout, values: Iterable[Any]) -> None:
    table, _arrays = layout.table(values)  # kept until the function returns
    SHIPPED.functions[number](table)


def directions(
    enclosures: tuple[Array, Array],
    boxes: Indices,
    masks: Mask,
    equations: int,
    scales: Array,
    energy_sign: float,
) -> tuple[Mask, Array, Array]:
    """Find a direction for each item: a box, and the inequalities of a branch.

    Parameters
    ----------
    enclosures : two (B, m + k + 1, n) arrays
        Of the gradients: inequalities, equations, energy.
    boxes : (I,) array of int
    masks : (I, m) array of bool
        Inequalities that may vanish in the box and have to hold in the branch.
    equations : int
        ``k``.
    scales : (n,) array
        Units of the coordinates; 0 for coordinates that are fixed.
    energy_sign : float
        -1 for directions of descent, 0 for directions into the set alone.

    Returns
    -------
    found : (I,) array of bool
    v : (I, n) array
        The directions.
    weights : (I, m + 1) array
        Weights of the gradients with which they nearly cancel, by row, the energy last.
    """
    items, m = masks.shape
    found, v = np.zeros(items, dtype=np.bool_), np.zeros((items, scales.size))
    weights = np.zeros((items, m + 1))
    given = (*enclosures, boxes, masks, equations, scales, energy_sign)
    _call(0, DIRECTIONS, (*given, found, v, weights))
    return found, v, weights


def covered(
    boxes: tuple[Array, Array],
    where: Indices,
    masks: Mask,
    sides: tuple[Array, Array],
    active: Mask,
) -> Mask:
    """Whether each item lies inside one of some regions and asks for none but its functions.

    Strictly inside, so that a neighbourhood of each of its points does.

    Regions have ``sides``, two arrays ``(R, n)``, and the functions ``active`` ``(R, m)``; items
    are those of ``directions``.
    """
    found = np.zeros(len(where), dtype=np.bool_)
    _call(1, COVERED, (*boxes, where, masks, *sides, active, found))
    return found


def carried(
    boxes: tuple[Array, Array],
    motions: tuple[Indices, Array, Array, Array],
    weights: Array,
    domain: tuple[Array, Array, Array],
    margin: float,
) -> Mask:
    """Whether a motion carries each box into a domain and increases ``w . q`` on all of it.

    Parameters
    ----------
    boxes : two (B, n) arrays
    motions : four (G, n) arrays
        Orders, signs and shifts of the motions ``q -> signs * q[order] + shifts``, and gradients of
        the change of ``w . q``.
    weights : (n,) array
        ``w``.
    domain : three (n,) arrays
        Periods of the coordinates, infinite for lines; the sides of the domain.
    margin : float
        By how much ``w . q`` has to increase.
    """
    gone = np.zeros(len(boxes[0]), dtype=np.bool_)
    _call(2, CARRIED, (*boxes, *motions, weights, *domain, margin, gone))
    return gone


def bent(bounds: tuple[Array, ...], left: Array, start: Array) -> Mask:
    """Whether negative curvature shows that there is no local minimum, for each box.

    ``bounds`` are the first four arguments of
    :func:`~polycorner.proofs.lists.curvature.bent_down`, stacked, like the others.
    """
    found = np.zeros(len(left), dtype=np.bool_)
    _call(3, BENT, (*bounds, left, start, found))
    return found


if __name__ == "__main__":
    SHIPPED.write()

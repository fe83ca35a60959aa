"""Boxes in which no point is a corner but the known ones, by the sets that may vanish there.

Let ``U`` be the inequalities that may vanish in a box ``X`` and matter for the set there, ``h`` the
``k`` equations and ``N`` the number of coordinates.  A corner ``q`` in ``X`` is isolated among the
common zeros of ``h`` and a subset ``A(q)`` of ``U``.  Suppose that each set ``T`` in ``U`` with at
most ``N - k`` elements

1. has no common zero with ``h`` in ``X``; or
2. has only one, which is known; or
3. has fewer than ``N - k`` elements, and the gradients of ``T`` and ``h`` are independent on ``X``,
   except at a known point; or
4. contains a set with one of the first two properties; or
5. contains a function that is a linear combination of others of ``T`` and of ``h``.

Then all corners in ``X`` are known.  ``A(q)`` contains no set as in 1, since it vanishes at ``q``,
and if it contains one as in 2, ``q`` is the known point.  Otherwise leave out functions that are
combinations of others until there is none: the common zeros are the same.  All subsets of what is
left, of at most ``N - k`` elements, are as in 3, so that it has fewer than ``N - k`` elements, and
its common zeros are a manifold of positive dimension near ``q``, unless ``q`` is the known point.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.dependence import Enclosures, Places, Truths

MOST_SETS = 2000  # of one size that are looked at in a batch of boxes

Rows = tuple[int, ...]
Known = Callable[[Rows, Places], Truths]


@dataclass(frozen=True, eq=False)
class Levels:
    """What is shown of a batch of boxes.

    Attributes
    ----------
    left : (B,) array of bool
        Boxes in which there may be other corners.
    largest : list of (tuple of int, array of int)
        Sets of ``N - k`` functions that may vanish together, and the boxes.
    """

    left: Truths
    largest: list[tuple[Rows, Places]]


def levels(
    found: Enclosures,
    masks: Mask,
    equations: int,
    known: Known,
    except_at_known: Known,
    related: Sequence[frozenset[int]] = (),
) -> Levels:
    """Return the boxes in which there may be corners that are not known.

    Parameters
    ----------
    found : Enclosures
        Of inequalities, then equations.
    masks : (B, m) array
        ``U`` for each box.
    equations : int
        ``k``.
    known, except_at_known : callable
        Whether the common zero of a set, or the point where its gradients are dependent, is known.
    related : sequence of frozenset of int
        Sets of functions in which one is a combination of others.
    """
    count, m = masks.shape
    top = found.reach.shape[1] - equations
    left = np.zeros(count, dtype=np.bool_)
    alive: dict[Rows, Truths] = {(): np.ones(count, dtype=np.bool_)}
    largest: list[tuple[Rows, Places]] = []
    for size in range(top + 1):
        survivors: dict[Rows, Truths] = {}
        for rows, where in alive.items():
            at = np.flatnonzero(where & ~left)
            if any(some.issubset(rows) for some in related):
                continue
            every = (*rows, *range(m, m + equations))
            if not at.size:
                continue
            if every:
                at = at[~(known(rows, at) | found.incompatible(at, every))]
            if size == top:
                left[at] = True
                largest.append((rows, at))
                continue
            if every:
                left[at] = ~(found.independent(at, every) | except_at_known(rows, at))
            survivors[rows] = np.zeros(count, dtype=np.bool_)
            survivors[rows][at] = True
        alive = dict(_larger(survivors, masks & ~left[:, None]))
        if len(alive) > MOST_SETS:
            for where in alive.values():
                left |= where
            return Levels(left, largest)
    if top < 0:
        left[:] = True
    return Levels(left, largest)


def _larger(alive: dict[Rows, Truths], masks: Mask) -> Iterator[tuple[Rows, Truths]]:
    """Yield the sets with one more element all of whose subsets are alive, and their boxes."""
    present = np.flatnonzero(masks.any(axis=0)).tolist()
    for rows, where in alive.items():
        for j in present:
            if rows and j <= rows[-1]:
                continue
            new = (*rows, j)
            parts = [alive.get((*new[:i], *new[i + 1 :])) for i in range(len(rows))]
            boxes = where & masks[:, j]
            for part in parts:
                boxes = boxes & part if part is not None else np.zeros_like(boxes)
            if boxes.any():
                yield new, boxes

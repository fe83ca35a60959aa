"""Persistent homology of a cell complex that grows, with coefficients modulo 2 ([ELZ]).

Cells are numbered in the order in which they appear, each after its faces.  Columns of boundaries
are whole numbers whose bits are faces; adding two columns modulo 2 is their exclusive or.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from polycorner.values import Checked


@dataclass(frozen=True)
class Bar(Checked):
    """A class of homology: its dimension, and the heights from which to which it lives.

    Attributes
    ----------
    dimension : int
        0 for components, 1 for loops, and so on.
    birth, death : float
        It lives in the set above every height ``s`` with ``birth >= s > death``; ``death`` is
        ``-inf`` for what never ends.
    """

    dimension: int
    birth: float
    death: float


def bars(
    cells: Mapping[int, Sequence[Sequence[int]]], heights: Mapping[int, Sequence[float]]
) -> list[Bar]:
    """Return the classes of homology of a complex above decreasing heights, the highest first.

    Parameters
    ----------
    cells : mapping from int to sequence of sequence of int
        For every dimension its cells, in the order in which they appear, as the positions of their
        faces among the cells of one dimension less.
    heights : mapping from int to sequence of float
        At which each cell appears: decreasing, and at most those of its faces.
    """
    found: list[Bar] = []
    killing: dict[int, int] = {}  # the cells that end a class of one dimension less, by what began
    for dimension in sorted(cells, reverse=True):
        ended, killing = killing, _paired(cells[dimension], set(killing))
        killers = set(killing.values())
        for k, birth in enumerate(heights[dimension]):
            if k not in killers:
                death = heights[dimension + 1][ended[k]] if k in ended else float("-inf")
                if death < birth:
                    found.append(Bar(dimension, birth, death))
    return sorted(found, key=lambda bar: (-bar.birth, bar.dimension, -bar.death))


def _paired(cells: Sequence[Sequence[int]], creators: set[int]) -> dict[int, int]:
    """Return which cell ends the class that began with a cell of one dimension less.

    Columns of ``creators``, whose own classes end, would be reduced to zero (clearing, [CK]).
    """
    pivots: dict[int, int] = {}
    killing: dict[int, int] = {}
    for k, faces in enumerate(cells):
        column = 0 if k in creators else sum(1 << face for face in faces)
        while column:
            last = column.bit_length() - 1
            if last not in pivots:
                pivots[last], killing[last] = column, k
                break
            column ^= pivots[last]
    return killing

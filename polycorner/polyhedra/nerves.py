"""Nerves of unions of flat pieces: their homotopy type, and the heights at which it changes.

A polyhedron of affine functions is an intersection of unions ``A_1, ..., A_m`` of convex pieces.
To sets ``s_k`` of pieces, one of each union, belongs a cell, the product of the simplices with
these vertices, if the pieces have a point in common.  The cells make a complex with the homotopy
type of the polyhedron: the pairs of a point and of a place in the cell of all pieces around it
project to both, with contractible fibres (the nerve theorem, [Hatcher] sec. 4.G).  So does the part
of the polyhedron above a height; a cell appears at the largest height on the common part of its
pieces, which is a linear programme.

Persistent homology of a cell complex that grows, with coefficients modulo 2 ([ELZ]).

Cells are numbered in the order in which they appear, each after its faces.  Columns of boundaries
are whole numbers whose bits are faces; adding two columns modulo 2 is their exclusive or.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import instance, refuse
from polycorner.errors import SolverError
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.polyhedra.polyhedron import Piece, Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    import sympy

Cell = tuple[frozenset[int], ...]  # of every union, which of its pieces


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


@dataclass(frozen=True, eq=False)
class Nerve(Checked):
    """The cells of a union of flat pieces, and its homology above every height.

    Attributes
    ----------
    dimensions : (k,) array of int
        Of the cells.
    heights : (k,) array
        The largest height on the common part of the pieces of each cell, decreasing; ``inf`` where
        there is none, and without a height.
    bars : tuple of Bar
        Classes of homology modulo 2, with the heights at which they begin and end.
    """

    dimensions: Array
    heights: Array
    bars: tuple[Bar, ...] = field(repr=False)

    @cached_property
    def critical(self) -> tuple[float, ...]:
        """The heights at which homology changes, the largest first.

        Between two heights of cells the homotopy type does not change.
        """
        ends = {h for bar in self.bars for h in (bar.birth, bar.death)}
        return tuple(sorted((h for h in ends if np.isfinite(h)), reverse=True))

    @checked
    def betti(self, height: float = float("-inf")) -> tuple[int, ...]:
        """Return the Betti numbers modulo 2 of the part above a height, that of components first.

        Without a height, those of the whole.
        """
        alive = Counter(bar.dimension for bar in self.bars if bar.death < height <= bar.birth)
        if height == float("-inf"):
            alive = Counter(bar.dimension for bar in self.bars if bar.death == height)
        return tuple(alive[d] for d in range(max(alive, default=-1) + 1))

    @checked
    def euler_characteristic(self, height: float = float("-inf")) -> int:
        """Return the number of cells above a height, those of odd dimension counted negative."""
        signs = 1 - 2 * (self.dimensions % 2)
        return int(signs[self.heights >= height].sum())


class Programmes:
    """The largest height where given functions are not negative, by linear programmes.

    Sets of functions that a symmetry carries to each other have the same, which is kept.
    """

    def __init__(self, polyhedron: Polyhedron, height: Any, symmetry: Symmetry | None) -> None:
        instance("polyhedron", polyhedron, Polyhedron)
        if symmetry is not None:
            instance("symmetry", symmetry, Symmetry)
        if np.isfinite(polyhedron.manifold.periods).any() or polyhedron.manifold.factors:
            refuse("polyhedron", "a manifold of lines", polyhedron.manifold)
        n = polyhedron.manifold.size
        self.always, self.unions = polyhedron.unions
        self._rows = _affine("polyhedron", polyhedron.functions, n)
        self._equations = _affine("polyhedron", polyhedron.stated, n)
        self._height = (
            None if height is None else _affine("height", [_on(polyhedron, height)], n)[0]
        )
        self._images = self._relabellings(polyhedron.names, symmetry)
        self._known: dict[Piece, float] = {}

    def meet(self, functions: Piece) -> bool:
        """Whether there is a point."""
        return self.highest(functions) > -np.inf

    def highest(self, functions: Piece) -> float:
        """Return the largest height; ``-inf`` if there is no point."""
        if functions not in self._known:
            found = self._solved(functions | self.always)
            for image in self._images:
                self._known[frozenset(image[i] for i in functions)] = found
        return self._known[functions]

    def _solved(self, functions: Piece) -> float:
        from scipy.optimize import linprog

        rows, n = self._rows[sorted(functions)], self._rows.shape[1] - 1
        aim = np.zeros(n + 1) if self._height is None else self._height
        equal = self._equations
        result: Any = linprog(
            -aim[:n], A_ub=-rows[:, :n], b_ub=rows[:, n], bounds=(None, None), method="highs",
            A_eq=equal[:, :n] if len(equal) else None, b_eq=-equal[:, n] if len(equal) else None,
        )  # fmt: skip
        if result.status == 2:
            return -np.inf
        if result.status == 3 or (result.status == 0 and self._height is None):
            return np.inf
        if result.status != 0:
            msg = f"nerve: expected an optimum of a linear programme; got {result.message}"
            raise SolverError(msg)
        return float(aim[n] - result.fun)

    def _relabellings(
        self, names: tuple[str, ...], symmetry: Symmetry | None
    ) -> list[tuple[int, ...]]:
        """Return where functions are carried, after a check that this is by an affine map."""
        identity = tuple(range(len(names)))
        if symmetry is None:
            return [identity]
        if symmetry.relabel is not None:
            refuse("symmetry", "a group that is listed in elements", symmetry)
        position = {name: i for i, name in enumerate(names)}
        found = {
            tuple(position.get(g.names.get(name, name), -1) for name in names)
            for g in symmetry.elements
        }
        for image in found:
            if sorted(image) != list(identity) or not self._carries(image):
                refuse("symmetry", "symmetries of polyhedron and height", symmetry)
        return [identity, *sorted(found - {identity})]

    def _carries(self, image: tuple[int, ...]) -> bool:
        """Whether an affine map carries each function to its image, and keeps all else."""
        kept = [self._equations, np.eye(self._rows.shape[1])[-1:]]
        kept += [] if self._height is None else [self._height[None]]
        before, after = (np.vstack([rows, *kept]) for rows in (self._rows, self._rows[[*image]]))
        affine = np.linalg.lstsq(after, before)[0]
        off = abs(after @ affine - before).max()
        same = frozenset(image[i] for i in self.always) == self.always
        return bool(off <= DEFAULT.alike * abs(before).max()) and same


def _on(polyhedron: Polyhedron, height: Any) -> SmoothFunction:
    if isinstance(height, SmoothFunction):
        return height
    return SmoothFunction("height on the polyhedron", height, polyhedron.manifold)


def _affine(argument: str, functions: Iterable[SmoothFunction], n: int) -> Array:
    """Return gradients and values at zero of affine functions, ``(k, n + 1)``, or raise."""
    import sympy

    rows = []
    for f in functions:
        symbols, values = f.manifold.symbols, f.parameter_values
        numbers = {sympy.Symbol(name, real=True): value for name, value in values.items()}
        slopes = [f.expression.diff(q) for q in symbols]
        if any(slope.free_symbols & set(symbols) for slope in slopes):
            refuse(argument, "affine functions", f.expression)
        constant = f.expression.xreplace(dict.fromkeys(symbols, sympy.S.Zero))
        rows.append([float(e.xreplace(numbers)) for e in (*slopes, constant)])
    return np.array(rows).reshape(-1, n + 1)


@checked
def nerve(
    polyhedron: Polyhedron,
    height: "SmoothFunction | sympy.Expr | None" = None,
    *,
    symmetry: Symmetry | None = None,
) -> Nerve:
    """Return the nerve of a union of flat pieces, with the heights at which its cells appear.

    There are as many cells as common parts of pieces, which all are found: this is a proof, up to
    the tolerance of the linear programmes (``1e-7``), and suits some hundred thousand of them.

    Parameters
    ----------
    polyhedron : Polyhedron
        Of affine functions on lines.
    height : SmoothFunction or SymPy expression, optional
        An affine function; the part above ``s`` is where it is at least ``s``.
    symmetry : Symmetry, optional
        Of polyhedron and height, by which programmes are saved; its ``elements`` count.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    A passage around a pillar is 2 high, and 1 high on one side:

    >>> from polycorner import AllOf, AnyOf, Manifold, Polyhedron
    >>> M = Manifold.euclidean("x y z")
    >>> x, y, z = M.symbols
    >>> around = AnyOf(x - 1, y - 1, -1 - x, -1 - y)
    >>> low = AnyOf(1 - z, -x, y)
    >>> D = Polyhedron(M, AllOf(around, low, 2 - x, 2 + x, 2 - y, 2 + y, z, 2 - z))
    >>> found = nerve(D, z)
    >>> found.critical, found.betti(1.5), found.betti(1.0)
    ((2.0, 1.0), (1,), (1, 1))
    """
    programmes = Programmes(polyhedron, height, symmetry)
    cells = dict(_cells(programmes, frozenset()))
    decreasing = sorted(cells, key=cells.__getitem__, reverse=True)
    heights = _merged([cells[cell] for cell in decreasing])
    by_dimension: dict[int, dict[Cell, float]] = {}
    for cell, h in zip(decreasing, heights, strict=True):
        by_dimension.setdefault(_dimension(cell), {})[cell] = h
    return Nerve(
        np.array([_dimension(cell) for cell in decreasing], dtype=np.intp),
        np.array(heights),
        tuple(bars(_boundaries(by_dimension), _heights(by_dimension))),
    )


def _boundaries(by_dimension: dict[int, dict[Cell, float]]) -> dict[int, list[list[int]]]:
    """Return the faces of every cell, as positions among the cells of one dimension less."""
    at = {d: {cell: k for k, cell in enumerate(some)} for d, some in by_dimension.items()}
    return {d: [[at[d - 1][f] for f in _faces(cell)] for cell in some] for d, some in at.items()}


def _heights(by_dimension: dict[int, dict[Cell, float]]) -> dict[int, list[float]]:
    return {d: list(some.values()) for d, some in by_dimension.items()}


def _cells(programmes: Programmes, functions: Piece, k: int = 0) -> Iterator[tuple[Cell, float]]:
    """Yield the cells of all unions from the k-th on whose pieces meet where functions hold."""
    if k == len(programmes.unions):
        yield (), programmes.highest(functions)
        return
    for face, both in _meeting(programmes, programmes.unions[k], functions):
        for rest, height in _cells(programmes, both, k + 1):
            yield (face, *rest), height


def _meeting(
    programmes: Programmes, pieces: list[Piece], functions: Piece
) -> Iterator[tuple[frozenset[int], Piece]]:
    """Yield sets of pieces that have a point in common with each other and with functions."""
    fresh = [
        (frozenset([i]), functions | piece)
        for i, piece in enumerate(pieces)
        if programmes.meet(functions | piece)
    ]
    while fresh:
        yield from fresh
        fresh = [
            (face | {i}, both | pieces[i])
            for face, both in fresh
            for i in range(max(face) + 1, len(pieces))
            if programmes.meet(both | pieces[i])
        ]


def _dimension(cell: Cell) -> int:
    return sum(len(face) - 1 for face in cell)


def _faces(cell: Cell) -> Iterator[Cell]:
    for k, face in enumerate(cell):
        if len(face) > 1:
            for i in face:
                yield (*cell[:k], face - {i}, *cell[k + 1 :])


def _merged(decreasing: list[float]) -> list[float]:
    """Return decreasing heights with those that are equal up to rounding made equal."""
    found: list[float] = []
    size = max((abs(h) for h in decreasing if np.isfinite(h)), default=0.0)
    # Cells of heights as near, the accuracy of the programmes, come in any order.
    merged = DEFAULT.same / 10 * size
    for h in decreasing:
        near = bool(found) and found[-1] - h <= merged
        found.append(found[-1] if near else h)
    return found

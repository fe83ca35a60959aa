"""And/or trees of smooth inequalities and the closed sets that they define on a manifold.

Equations of the spheres and rotations of a manifold: their vectors have the length one.

With them a point of ``S^k`` is one of ``R^(k+1)`` with an equation, which polyhedra, conditions,
walks and proofs treat as they treat any other.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import islice
from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.formulas.bundles import Bundle
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.polyhedra.groups import AllOf, AnyOf, Part, collect
from polycorner.printing import MOST_ROWS, WIDTH, Printed, Sheet, Table, few
from polycorner.spaces.arguments import scalar
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value, cached_property

LONGEST_LINE = 400  # characters of names that are shown in one line
LONGEST_TREE = 1000  # characters of the tree in words
LONGEST = 72  # characters of a formula beyond which only its coordinates are listed
# A model's remark on a point.
Annotation = Callable[[Array], str | None]
# A piece of the set: the positions of the functions that must all be at least zero.
Piece = frozenset[int]
MAX_SELECTIONS = 256
Tree = Union[int, "_Node"]


def normalisations(manifold: Manifold) -> tuple[SmoothFunction, ...]:
    """Return ``(|u|^2 - 1) / 2`` for the vector ``u`` of every sphere and rotation."""
    return tuple(
        SmoothFunction.member(
            _family(len(f.names)), "norm", manifold, reads=f.names, label=f"|{f.name}|"
        )
        for f in manifold.factors
    )


@cache
def _family(k: int) -> Family:
    import sympy

    u = sympy.symbols([f"u{i}" for i in range(k)], real=True)
    return Family.of({"norm": (sum(x**2 for x in u) - 1) / 2}, [x.name for x in u])


def description(
    manifold: Manifold,
    functions: Sequence[SmoothFunction],
    equations: Sequence[SmoothFunction],
    joined: str,
) -> Sheet:
    """Return the sheet of a polyhedron.

    Parameters
    ----------
    manifold : Manifold
        The space of its points.
    functions, equations : sequence of SmoothFunction
        The inequalities ``f >= 0`` and the equations ``h = 0``.
    joined : str
        The and/or tree in words; empty where all inequalities hold together.
    """
    return Sheet(
        f"Polyhedron in {few(_coordinates(manifold), WIDTH)}",
        (
            _table(("inequality", "f >= 0"), functions),
            _table(("equation", "h = 0"), equations),
            f"Joined as {checks.shortened(joined, LONGEST_TREE)}." if joined else "",
        ),
    )


def _coordinates(manifold: Manifold) -> Iterator[str]:
    """Yield the names of the coordinates, those of a sphere or rotation together."""
    for name in manifold.names:
        factor = next((f for f in manifold.factors if name in f.names), None)
        if factor is None:
            yield name
        elif name == factor.names[0]:
            yield f"the unit {factor.kind} ({', '.join(factor.names)})"


def _table(head: tuple[str, str], functions: Sequence[SmoothFunction]) -> Table:
    rows = tuple((f.name, _formula(f)) for f in functions[:MOST_ROWS])
    hidden = len(functions) - len(rows)
    return Table(head, rows, caption=f"The first {MOST_ROWS} of {len(functions)}" if hidden else "")


def _formula(f: SmoothFunction) -> str:
    """Return a formula with the values of its parameters, or what it depends on if it is long."""
    definitions, expressions = f.family.formulas()
    reads = few(f.manifold.names[i] for i in f.reads)
    if definitions or len(str(expressions[f.member_name])) > LONGEST:
        return f"a function of {reads}"
    values = zip(f.family.parameters, f.parameters, strict=True)
    given = ", ".join(f"{name} = {value:g}" for name, value in values)
    return f"{f.expression}{given and f' with {given}'}"


class Polyhedron(Printed, Value):
    """A curvilinear polyhedron ``D = {q : f_i(q) >= 0 joined by and/or, h_j(q) = 0}``.

    Parameters
    ----------
    manifold : Manifold
        The space of its points.
    parts : AllOf, AnyOf, SmoothFunction, SymPy expression, sequence or mapping, optional
        The inequalities ``f >= 0``; without any it is the whole manifold.  A sequence means all of
        them; a mapping gives names.  Expressions without a name are called ``f1``, ``f2``, ...,
        or after the group's name.
        ``Min`` and ``Max`` (and ``c - Abs(u)``) that stand outermost in an expression are groups.
    equations : the same kinds, optional
        Functions ``h = 0`` (sections), called ``h1``, ``h2``, ... without a name.
    annotations : mapping from str to callable, optional
        A model's remarks on a point, such as its chirality; kept in strata.

    Raises
    ------
    TypeError, ValueError
        For parts that are no functions, repeated names, functions on another manifold, symbols
        that are no coordinates or not periodic on a circle, or nothing at all.

    Warns
    -----
    NonsmoothWarning
        For an expression with ``Abs``, ``Min``, ``Max`` or ``Piecewise`` inside.

    Examples
    --------
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> D = Polyhedron(M, {"bowl": y - x**2, "lid": 2 - y})
    >>> D.values([1.0, 1.5]).tolist(), D.contains([1.0, 1.5]), D.contains([0.0, 3.0])
    ([0.5, 0.5], True, False)
    """

    def __init__(
        self,
        manifold: Manifold,
        parts: Part | Sequence[Any] | Mapping[str, Any] = (),
        equations: Part | Sequence[Any] | Mapping[str, Any] = (),
        *,
        annotations: Mapping[str, Annotation] | None = None,
    ) -> None:
        checks.instance("manifold", manifold, Manifold)
        self.manifold = manifold
        annotations = {} if annotations is None else annotations
        self.annotations = dict(checks.mapping("annotations", annotations))
        tree, functions = collect(manifold, "parts", parts, "f")
        flat, sections = collect(manifold, "equations", equations, "h")
        if any(isinstance(node, AnyOf) for node in _groups(flat)):
            msg = "equations: expected functions that all vanish; got an AnyOf"
            raise ValueError(msg)
        own = normalisations(manifold)
        self.normalised = len(own)
        self.functions, self.equations = tuple(functions), (*sections, *own)
        self.names = tuple(f.name for f in self.functions)
        self.equation_names = tuple(h.name for h in self.equations)
        _check_distinct(self.names + self.equation_names)
        self.tree = _indexed(tree, {id(f): i for i, f in enumerate(self.functions)})
        self._bundle = Bundle(manifold, self.functions)
        self._sections = Bundle(manifold, self.equations)

    def __repr__(self) -> str:
        """Return the coordinates and the names of the functions, or their numbers."""
        names = [h.name for h in self.stated]
        equations = f", equations {names}" if names else ""
        told = f"{list(self.manifold.names)}: {list(self.names)} >= 0{equations}"
        if len(told) > LONGEST_LINE:
            several = f"; {len(names)} equations" if names else ""
            coordinates = f"{self.manifold.size} coordinates: {few(self.manifold.names)}"
            told = f"{coordinates}; {len(self.names)} functions: {few(self.names)}{several}"
        return f"Polyhedron({told})"

    def _sheet(self) -> Sheet:
        joined = _words(self.tree, self.names)[1:-1] if self.is_union else ""
        return description(self.manifold, self.functions, self.stated, joined)

    @property
    def dimension(self) -> int:
        """The dimension of the manifold around it."""
        return self.manifold.dimension

    @property
    def stated(self) -> tuple[SmoothFunction, ...]:
        """The equations without those that normalise vectors and quaternions, the last ones."""
        return self.equations[: len(self.equations) - self.normalised]

    @property
    def hidden(self) -> frozenset[str]:
        """The names of the equations that normalise vectors and quaternions."""
        return frozenset(self.equation_names[len(self.equations) - self.normalised :])

    @cached_property
    def is_union(self) -> bool:
        """Whether the tree contains an ``AnyOf`` with more than one part."""
        return _branches(self.tree)

    @cached_property
    def bundle(self) -> Bundle:
        """Inequalities first, equations after them, evaluated together."""
        if not self.equations:
            return self._bundle
        return Bundle(self.manifold, self.functions + self.equations)

    def values(self, q: ArrayLike) -> Array:
        """Return ``f_i(q)``, shape ``(..., m)``."""
        return self._bundle.evaluate(self.manifold.points(q), 0)[0]

    def gradients(self, q: ArrayLike) -> Array:
        """Return the partial derivatives of every ``f_i``, shape ``(..., m, n)``."""
        return self._bundle.evaluate(self.manifold.points(q), 1)[1]

    def hessians(self, q: ArrayLike) -> Array:
        """Return the second partial derivatives of every ``f_i``, shape ``(..., m, n, n)``."""
        return self._bundle.evaluate(self.manifold.points(q), 2)[2]

    def evaluate(self, q: ArrayLike, order: int = 1) -> tuple[Array, ...]:
        """Return values, gradients and Hessians of every ``f_i`` up to ``order`` in one call."""
        checks.whole("order", order, least=0, most=2)
        return self._bundle.evaluate(self.manifold.points(q), order)

    def equation_values(self, q: ArrayLike) -> Array:
        """Return ``h_j(q)``, shape ``(..., k)``, those that normalise vectors last."""
        points = self.manifold.points(q)
        if not self.equations:
            return np.empty((*points.shape[:-1], 0))
        return self._sections.evaluate(points, 0)[0]

    def implicit(self, q: ArrayLike) -> Any:
        """Return the implicit value: the minimum over ``AllOf``, the maximum over ``AnyOf``."""
        return scalar(self.implicit_of(self.values(q)))

    def implicit_of(self, values: Array) -> Array:
        """Return the implicit value of given values ``(..., m)``; see :meth:`implicit`."""
        return _implicit(self.tree, values)

    def contains(self, q: ArrayLike, *, tolerance: float = 0.0) -> Any:
        """Whether ``q`` lies in ``D``, functions allowed to miss by ``tolerance``."""
        points = self.manifold.placed(self.manifold.points(q))
        checks.real("tolerance", tolerance, infinite=True)
        inside = self.implicit_of(self.values(points)) >= -tolerance
        off = abs(self.equation_values(points)[..., : len(self.stated)])
        return scalar(inside & (off <= tolerance).all(axis=-1))

    def signs_to_pieces(self, signs: Sequence[int]) -> list[Piece]:
        """Return ``D`` near a point as a union of pieces, from the sign of every function there.

        Functions that are positive hold nearby and negative ones fail nearby; only those that
        vanish (sign 0) can matter.  Each piece is a set of vanishing functions that must all be
        at least zero; a piece inside another is dropped.  No piece: the point is outside ``D``;
        the empty piece alone: it is inside.
        """
        if not self.is_union:
            outside = any(sign < 0 for sign in signs)
            return [] if outside else [frozenset(i for i, s in enumerate(signs) if s == 0)]
        pieces = _pieces(self.tree, signs)
        return sorted(
            (p for p in pieces if not any(other < p for other in pieces)),
            key=lambda piece: (len(piece), sorted(piece)),
        )

    @property
    def unions(self) -> tuple[Piece, list[list[Piece]]]:
        """``D`` as an intersection: functions that always hold, and unions of pieces."""
        always: set[int] = set()
        unions = []
        for part in _intersected(self.tree):
            pieces = sorted(_pieces(part, [0] * len(self.functions)), key=sorted)
            if len(pieces) == 1:
                always |= pieces[0]
            else:
                unions.append(pieces)
        return frozenset(always), unions

    def intersected(
        self,
        parts: Sequence[Any] | Mapping[str, Any] = (),
        equations: Sequence[Any] | Mapping[str, Any] = (),
        *,
        without: Sequence[str] = (),
    ) -> "Polyhedron":
        """Return the intersection with further inequalities and equations.

        Parameters
        ----------
        parts, equations : sequence or mapping, optional
            As for a polyhedron.
        without : sequence of str, optional
            Names of inequalities that are left out.
        """
        checks.names("without", without, self.names)
        left = frozenset(self.names.index(name) for name in without)
        tree = _grouped(self.tree, self.functions, left)
        with checks.about("parts"):
            more = collect(self.manifold, "parts", parts, "g")[0].parts
        with checks.about("equations"):
            every = collect(self.manifold, "equations", equations, "k")[0].parts
        whole = [part for part in (tree, *more) if part is not None]
        return Polyhedron(
            self.manifold, whole, [*self.stated, *every], annotations=self.annotations
        )

    def selections(self, values: Sequence[float], tolerance: float = 0.0) -> list[Piece]:
        """Return whole branches of the tree that hold at a point, the roomiest first.

        A selection takes all parts of every ``AllOf`` and one part of every ``AnyOf``; where no
        part holds, all of them, the one that fails least first.
        """
        limited = islice(_select(self.tree, values, tolerance), MAX_SELECTIONS)
        return list(dict.fromkeys(limited))


class _Node:
    """An indexed group: leaves are positions of functions."""

    def __init__(self, *, union: bool, children: tuple[Tree, ...]) -> None:
        self.union, self.children = union, children


def _intersected(tree: Tree) -> Iterator[Tree]:
    """Yield the functions and unions that a tree is the intersection of."""
    if isinstance(tree, int) or tree.union:
        yield tree
    else:
        for child in tree.children:
            yield from _intersected(child)


def _words(tree: Tree, names: Sequence[str]) -> str:
    """Return an and/or tree in words."""
    if isinstance(tree, int):
        return names[tree]
    parts = [_words(child, names) for child in tree.children]
    word = " or " if tree.union else " and "
    return parts[0] if len(parts) == 1 else f"({word.join(parts)})"


def _branches(tree: Tree) -> bool:
    if isinstance(tree, int):
        return False
    return (tree.union and len(tree.children) > 1) or any(map(_branches, tree.children))


def _implicit(tree: Tree, values: Array) -> Array:
    if isinstance(tree, int):
        return values[..., tree]
    parts = [_implicit(child, values) for child in tree.children]
    if not parts:
        return np.full(values.shape[:-1], -np.inf if tree.union else np.inf)
    combine = np.maximum if tree.union else np.minimum
    return np.asarray(combine.reduce(parts))


def _pieces(tree: Tree, signs: Sequence[int]) -> set[Piece]:
    if isinstance(tree, int):
        return (
            {frozenset()} if signs[tree] > 0 else {frozenset([tree])} if signs[tree] == 0 else set()
        )
    parts = [_pieces(child, signs) for child in tree.children]
    if tree.union:
        return set().union(*parts)
    product: set[Piece] = {frozenset()}
    for part in parts:
        product = {p | q for p in product for q in part}
    return product


def _select(tree: Tree, values: Sequence[float], tolerance: float) -> Iterator[Piece]:
    if isinstance(tree, int):
        yield frozenset([tree])
        return
    if tree.union:
        room = np.asarray(values, dtype=np.float64)
        ranked = sorted(tree.children, key=lambda child: -float(_implicit(child, room)))
        holding = [c for c in ranked if float(_implicit(c, room)) >= -tolerance]
        for child in holding or ranked:
            yield from _select(child, values, tolerance)
        return
    if not tree.children:
        yield frozenset()
        return
    head, *rest = tree.children
    for first in _select(head, values, tolerance):
        for others in _select(_Node(union=False, children=tuple(rest)), values, tolerance):
            yield first | others


def _indexed(part: Any, position: dict[int, int]) -> Tree:
    if isinstance(part, SmoothFunction):
        return position[id(part)]
    children = tuple(_indexed(child, position) for child in part.parts)
    return _Node(union=isinstance(part, AnyOf), children=children)


def _grouped(tree: Tree, functions: Sequence[SmoothFunction], without: frozenset[int]) -> Any:
    """Return an indexed tree as a group, or None if nothing is left of it."""
    if isinstance(tree, int):
        return None if tree in without else functions[tree]
    found = [_grouped(child, functions, without) for child in tree.children]
    parts = [part for part in found if part is not None]
    if not parts:
        return None
    return AnyOf(*parts) if tree.union else AllOf(*parts)


def _groups(part: Any) -> Iterator[Any]:
    yield part
    for child in getattr(part, "parts", ()):
        yield from _groups(child)


def _check_distinct(names: Sequence[str]) -> None:
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        msg = f"parts: expected distinct names; got {', '.join(repeated)} more than once"
        raise ValueError(msg)

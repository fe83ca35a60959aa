"""Names and formulas with indices, such as ``gap[i,j] for i in 1..3 for j in i+1..3``, written out.

Texts are Python's notation with two additions: ``a..b`` are the whole numbers from ``a`` to ``b``,
both included, and ``sum(f for i in a..b)`` is a sum.  Nothing is evaluated but whole numbers.
"""

import ast
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import NoReturn

from polycorner.checks import shortened
from polycorner.files.formulas import LARGEST

Indices = Mapping[str, int]
RANGE = "|"  # what stands for `..` in the syntax tree: it binds less than arithmetic
SHOWN = 60  # characters of a text in an error


class Indexed:
    """What the texts of one file have in common.

    Parameters
    ----------
    numbers : mapping from str to int
        Whole numbers that may stand in indices and ranges.
    constants : mapping from str to str
        Formulas that are written out where their names occur.
    """

    def __init__(self, numbers: Indices, constants: Mapping[str, str]) -> None:
        self.numbers = dict(numbers)
        self.constants = {name: syntax(text) for name, text in constants.items()}
        self.left = LARGEST  # parts of formulas that may still be written out

    def members(self, text: str) -> Iterator[tuple[ast.expr, Indices]]:
        """Yield what stands before ``for``, with every value of the indices; once without any."""
        tree = syntax(text)
        if not isinstance(tree, ast.GeneratorExp):
            yield tree, {}
            return
        for indices in self._indices(tree.generators, {}):
            yield tree.elt, indices

    def written(self, tree: ast.expr, indices: Indices) -> str:
        """Return a formula with indices and constants written out."""
        return ast.unparse(self._written(tree, indices))

    def name(self, node: ast.expr, indices: Indices, *, coordinate: bool = False) -> str:
        """Return a name with its indices: ``x3`` of a coordinate ``x[3]``, else ``gap[1,2]``."""
        match node:
            case ast.Name(id=name):
                return name
            case ast.Subscript(value=ast.Name(id=name), slice=places):
                parts = places.elts if isinstance(places, ast.Tuple) else [places]
                numbers = [str(self.whole(part, indices)) for part in parts]
                if coordinate and any(number.startswith("-") for number in numbers):
                    _refuse("indices of coordinates from 0", node)
                return name + ("_".join(numbers) if coordinate else f"[{','.join(numbers)}]")
        return _refuse("a name, such as x or x[i]", node)

    def whole(self, node: ast.expr, indices: Indices) -> int:
        """Return the whole number that an index or the end of a range is."""
        self._count()
        found: int | None = None
        match node:
            case ast.Constant(value=int(number)) if not isinstance(number, bool):
                found = number
            case ast.Name(id=name) if name in indices or name in self.numbers:
                found = indices[name] if name in indices else self.numbers[name]
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                found = -self.whole(operand, indices)
            case ast.BinOp(left=left, op=op, right=right):
                a, b = self.whole(left, indices), self.whole(right, indices)
                match op:
                    case ast.Add():
                        found = a + b
                    case ast.Sub():
                        found = a - b
                    case ast.Mult():
                        found = a * b
                    case ast.Mod() if b:
                        found = a % b
        if found is None or abs(found) > LARGEST:
            _refuse(f"a whole number up to {LARGEST}", node)
        return found

    def _indices(self, generators: list[ast.comprehension], above: Indices) -> Iterator[Indices]:
        if not generators:
            yield above
            return
        first, *rest = generators
        match first:
            case ast.comprehension(
                target=ast.Name(id=name),
                iter=ast.BinOp(left=low, op=ast.BitOr(), right=high),
                ifs=[],
            ):
                if name in above or name in self.numbers or name in self.constants:
                    _refuse("an index with a name of its own", first.target)
                for i in range(self.whole(low, above), self.whole(high, above) + 1):
                    self._count()
                    yield from self._indices(rest, {**above, name: i})
                return
        _refuse("for i in a..b", first)

    def _written(self, node: ast.expr, indices: Indices) -> ast.expr:
        self._count()
        match node:
            case ast.Name(id=name) if name in indices or name in self.numbers:
                number = indices[name] if name in indices else self.numbers[name]
                return ast.parse(str(number), mode="eval").body
            case ast.Name(id=name) if name in self.constants:
                return self._written(self.constants[name], {})
            case ast.Subscript():
                return ast.Name(self.name(node, indices, coordinate=True))
            case ast.Call(func=ast.Name(id="sum"), args=[ast.GeneratorExp() as terms], keywords=[]):
                every = self._indices(terms.generators, indices)
                parts = [self._written(terms.elt, inner) for inner in every]
                return ast.Call(ast.Name("Add"), parts, []) if parts else ast.Constant(0)
        for field, value in ast.iter_fields(node):
            if isinstance(value, ast.expr):
                node = _with(node, field, self._written(value, indices))
            elif isinstance(value, list):
                parts = [self._written(p, indices) if isinstance(p, ast.expr) else p for p in value]
                node = _with(node, field, parts)
        return node

    def _count(self) -> None:
        self.left -= 1
        if self.left < 0:
            msg = f"expected formulas of at most {LARGEST} parts, sums and indices written out"
            raise ValueError(msg)


def _with(node: ast.expr, field: str, value: object) -> ast.expr:
    fields = dict(ast.iter_fields(node)) | {field: value}
    return type(node)(**fields)


RELATIONS: dict[type, str] = {ast.LtE: "<=", ast.GtE: ">=", ast.Eq: "=="}


def comparisons(tree: ast.expr, allowed: tuple[type, ...]) -> list[ast.expr]:
    """Return the sides' differences of ``a <= b <= c``, which are at least zero, or a formula."""
    if not isinstance(tree, ast.Compare):
        return [tree]
    found: list[ast.expr] = []
    for op, (a, b) in zip(tree.ops, pairwise([tree.left, *tree.comparators]), strict=True):
        if not isinstance(op, allowed):
            _refuse(" or ".join(RELATIONS[kind] for kind in allowed), tree)
        high, low = (a, b) if isinstance(op, ast.GtE) else (b, a)
        zero = isinstance(low, ast.Constant) and low.value == 0
        found.append(high if zero else ast.BinOp(high, ast.Sub(), low))
    return found


def is_family(header: str) -> bool:
    """Whether a name is that of a family, with indices."""
    return " for " in header and " in " in header


def syntax(text: str) -> ast.expr:
    """Return the syntax tree of a text, of which nothing is accepted yet."""
    if len(text) > LARGEST:
        msg = f"expected text of at most {LARGEST} characters; got {len(text)}"
        raise ValueError(msg)
    try:
        return ast.parse(f"({text.replace('..', RANGE)}\n)", mode="eval").body
    except (SyntaxError, RecursionError, MemoryError, ValueError) as error:
        shown = shortened(" ".join(text.split()), SHOWN)
        msg = f"expected Python's notation; got {shown} ({type(error).__name__})"
        raise ValueError(msg) from None


def _refuse(expected: str, node: ast.AST) -> NoReturn:
    text = shortened(ast.unparse(node).replace(RANGE, ".."), SHOWN)
    msg = f"expected {expected}; got {text}"
    raise ValueError(msg)

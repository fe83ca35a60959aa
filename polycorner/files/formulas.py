"""Formulas as text: written from SymPy expressions and read back without evaluating code.

The text is Python's notation of formulas, such as ``2 - x**2 - sqrt(y)``.  It is parsed into a
syntax tree, of which only arithmetic, comparisons, declared symbols and the functions that have a
compiled form are accepted.
"""

import ast
import keyword
import math
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from polycorner.checks import refuse, shortened
from polycorner.formulas.expressions import KINKED, as_expression
from polycorner.formulas.operations import OPERATIONS
from polycorner.polyhedra.groups import MOST_BRANCHES

if TYPE_CHECKING:
    import sympy

    Symbols = Mapping[str, sympy.Symbol]

FUNCTIONS = frozenset(OPERATIONS) | {"Add", "Mul", "atan2", "Abs", "Min", "Max", "Piecewise"}
CONSTANTS = ("pi", "E")
SYMBOL = "Symbol"  # the notation of symbols whose names are no identifiers, or taken
LONG = 50  # terms beyond which a sum is written as Add(...), since parsers limit nesting
# What is read at all; what SymPy and the compiler need for a formula is bounded by these.
BITS = 14_000  # of a number; Python reads no longer ones
LARGEST = 1_000_000  # characters
DEEPEST = 100  # operations that contain each other
ARGUMENTS = dict.fromkeys(OPERATIONS, 1) | {"Abs": 1, "atan2": 2}


def symbols(names: Iterable[str]) -> "dict[str, sympy.Symbol]":
    """Return real symbols by name."""
    import sympy

    return {name: sympy.Symbol(name, real=True) for name in names}


def formula_text(expression: "sympy.Expr") -> str:
    """Return the text of an expression; doubles in it keep every bit."""
    text: str = _printer().doprint(expression)
    return text


def read_formula(text: str, known: "Symbols", name: str = "formula") -> "sympy.Expr":
    """Return the SymPy expression of a text.

    Parameters
    ----------
    text : str
        As :func:`formula_text` writes it.
    known : mapping from str to sympy.Symbol
        The symbols that may occur.
    name : str, optional
        What the error calls it.

    Raises
    ------
    ValueError
        If the text is no formula, or one beyond what is read, naming the part that is not accepted.

    Examples
    --------
    >>> read_formula("2 - x**2/3", symbols(["x"]))
    2 - x**2/3
    >>> read_formula("open('file')", {})
    Traceback (most recent call last):
    ValueError: formula: expected arithmetic of known symbols and functions; got open('file')
    """
    if not isinstance(text, str) or len(text) > LARGEST:
        refuse(name, f"text of at most {LARGEST} characters", _short(str(text)))
    try:
        found = _read(ast.parse(text, mode="eval").body, known)
    except _Unaccepted as error:
        msg = f"{name}: expected arithmetic of known symbols and functions; got {error}"
        raise ValueError(msg) from None
    except (SyntaxError, RecursionError, MemoryError, ValueError) as error:
        msg = f"{name}: expected Python's notation; got {_short(text)} ({type(error).__name__})"
        raise ValueError(msg) from error
    if (depth := _depth(found)) > DEEPEST:
        refuse(name, f"at most {DEEPEST} operations in each other", depth)
    if (branches := _branches(found, {})) > MOST_BRANCHES:
        refuse(name, f"at most {MOST_BRANCHES} branches of Min, Max and Piecewise", branches)
    return found


class _Unaccepted(Exception):  # noqa: N818 - not an error by itself
    """A part of a text that is not accepted."""


@cache
def _printer() -> Any:
    from sympy.printing.str import StrPrinter

    def flat(name: str) -> Any:
        usual = getattr(StrPrinter, f"_print_{name}")

        def write(self: Any, e: "sympy.Expr", **options: Any) -> str:
            if len(e.args) <= LONG:
                return str(usual(self, e, **options))
            return f"{name}({', '.join(map(self.doprint, e.args))})"

        return write

    methods = {
        "_print_Float": lambda _, number: repr(float(number)),  # compiled code reads no more of it
        "_print_Symbol": lambda _, symbol: _symbol(str(symbol.name)),
        "_print_Dummy": lambda _, dummy: f"_{dummy.name}",  # its name in compiled code
        "_print_Add": flat("Add"),
        "_print_Mul": flat("Mul"),
    }
    return type("Printer", (StrPrinter,), methods)({"order": "none"})


def _symbol(name: str) -> str:
    taken = name in FUNCTIONS or name in CONSTANTS or name == SYMBOL or keyword.iskeyword(name)
    return name if name.isidentifier() and name.isascii() and not taken else f"{SYMBOL}({name!r})"


def _read(node: ast.expr, known: "Symbols") -> "sympy.Expr":
    """Return the expression of a part, with arithmetic carried out and functions as they stand.

    What SymPy would look for in functions of functions and of many arguments takes it minutes, and
    has been done before a formula is written.
    """
    import sympy

    def read(*nodes: ast.expr) -> "list[sympy.Expr]":
        return [_read(part, known) for part in nodes]

    match node:
        case ast.BinOp():
            return _combined(node, *read(node.left, node.right))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_read(operand, known)
        case ast.Constant(value=int() | float() as x) if not isinstance(x, bool):
            if isinstance(x, int) or math.isfinite(x):
                return _short_number(as_expression("formula", x), node)
        case ast.Name(id=name) if name in known or name in CONSTANTS:
            return getattr(sympy, name) if name in CONSTANTS else known[name]
        case ast.Call(func=ast.Name(id="Symbol"), args=[ast.Constant(value=str(name))]) if (
            name in known
        ):
            return known[name]
        case ast.Call(func=ast.Name(id="Piecewise"), args=[_, *_] as cases, keywords=[]):
            return sympy.Piecewise(*[_case(part, known) for part in cases], evaluate=False)
        case ast.Call(func=ast.Name(id="Add" | "Mul" as name), args=parts, keywords=[]):
            return _short_number(getattr(sympy, name)(*read(*parts)), node)
        case ast.Call(func=ast.Name(id=name), args=[_, *_] as parts, keywords=[]) if (
            name in FUNCTIONS and len(parts) == ARGUMENTS.get(name, len(parts))
        ):
            return getattr(sympy, name)(*read(*parts), evaluate=False)
    raise _unaccepted(node)


def _case(node: ast.expr, known: "Symbols") -> Any:
    """Return a case of a Piecewise, a value and its condition."""
    match node:
        case ast.Tuple(elts=[value, condition]):
            return _read(value, known), _condition(condition, known)
    raise _unaccepted(node)


def _condition(node: ast.expr, known: "Symbols") -> Any:
    import sympy

    match node:
        case ast.Constant(value=bool(truth)):
            return sympy.true if truth else sympy.false
        case ast.BinOp(left=left, op=ast.BitAnd() | ast.BitOr() as op, right=right):
            joined = sympy.And if isinstance(op, ast.BitAnd) else sympy.Or
            return joined(_condition(left, known), _condition(right, known))
        case ast.UnaryOp(op=ast.Invert(), operand=operand):
            return sympy.Not(_condition(operand, known))
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _RELATIONS:
            sides = [_read(left, known), _read(right, known)]
            if not any(side.has(sympy.Piecewise) for side in sides):  # which SymPy would multiply
                return getattr(sympy, _RELATIONS[type(op)])(*sides, evaluate=False)
    raise _unaccepted(node)


_RELATIONS: dict[type, str] = {ast.Lt: "Lt", ast.LtE: "Le", ast.Gt: "Gt", ast.GtE: "Ge"}


def _combined(node: ast.BinOp, a: "sympy.Expr", b: "sympy.Expr") -> "sympy.Expr":
    match node.op:
        case ast.Add():
            return _short_number(a + b, node)
        case ast.Sub():
            return _short_number(a - b, node)
        case ast.Mult():
            return _short_number(a * b, node)
        case ast.Div() if b != 0:
            return _short_number(a * _power(b, -1), node)
        case ast.Pow() if not _is_huge(a, b):
            return _short_number(_power(a, b), node)
    raise _unaccepted(node)


def _power(base: "sympy.Expr", exponent: Any) -> "sympy.Expr":
    """Return a power; one with a whole exponent is carried out in products, powers and numbers."""
    import sympy

    whole = sympy.Integer(exponent) if isinstance(exponent, int) else exponent
    simple = whole.is_Integer and (base.is_Mul or base.is_Pow or base.is_Number)
    return sympy.Pow(base, whole, evaluate=bool(simple or (base.is_Float and whole.is_Number)))


def _is_huge(base: "sympy.Expr", exponent: "sympy.Expr") -> bool:
    """Whether a power of numbers, of coefficients as well, would take long to work out."""
    if not exponent.is_Number:
        return False
    coefficient = base.as_coeff_Mul()[0] if base.is_Mul else base
    size = _bits(coefficient)
    size = 0 if size == 1 and abs(coefficient) == 1 else size
    return bool(abs(exponent) > sys.float_info.max or size * abs(exponent) > BITS)


def _bits(number: "sympy.Basic") -> int:
    """Return the length of a rational number; 0 for any other expression."""
    if not getattr(number, "is_Rational", False):
        return 0
    p, q = number.as_numer_denom()
    return max(abs(int(p)).bit_length(), int(q).bit_length())


def _short_number(found: "sympy.Expr", node: ast.expr) -> "sympy.Expr":
    """Return an expression, unless a number in it is longer than any that is read."""
    for part in (found, *found.args[:1]):  # a coefficient is the first argument
        infinite = getattr(part, "is_Float", False) and not math.isfinite(float(part))
        if infinite or _bits(part) > BITS:
            raise _unaccepted(node)
    return found


def _depth(expression: "sympy.Basic") -> int:
    """Return how many operations contain each other."""
    deepest, level = 0, [expression]
    while level:
        deepest += 1
        level = list({part for e in level for part in e.args})
    return deepest


def _branches(expression: "sympy.Basic", known: "dict[sympy.Basic, int]") -> int:
    """Return how many branches follow one another in compiled code, which takes their square."""
    if expression not in known:
        own = len(expression.args) if type(expression).__name__ in KINKED else 0
        inner = max((_branches(part, known) for part in expression.args), default=0)
        known[expression] = own + inner
    return known[expression]


def _unaccepted(node: ast.expr) -> _Unaccepted:
    return _Unaccepted(_short(ast.unparse(node)))


def _short(text: str) -> str:
    return shortened(" ".join(text.split()), 60)

"""Formulas as text: written from SymPy expressions and read back without evaluating code.

The text is Python's notation of formulas, such as ``2 - x**2 - sqrt(y)``.  It is parsed into a
syntax tree, of which only arithmetic, comparisons, declared symbols and the functions that have a
compiled form are accepted.
"""

import ast
import keyword
from collections.abc import Iterable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from polycorner.formulas.translate import UNARY

if TYPE_CHECKING:
    import sympy

    Symbols = Mapping[str, sympy.Symbol]

FUNCTIONS = frozenset(UNARY) | {"Add", "Mul", "atan2", "Abs", "Min", "Max", "Piecewise"}
CONSTANTS = ("pi", "E")
SYMBOL = "Symbol"  # the notation of symbols whose names are no identifiers, or taken
LONG = 50  # terms beyond which a sum is written as Add(...), since parsers limit nesting
BITS = 100_000  # of the largest power of numbers that is worked out


def symbols(names: Iterable[str]) -> "dict[str, sympy.Symbol]":
    """Return real symbols by name."""
    import sympy

    return {name: sympy.Symbol(name, real=True) for name in names}


def formula_text(expression: "sympy.Expr") -> str:
    """Return the text of an expression; doubles in it keep every bit."""
    text: str = _printer().doprint(expression)
    return text


def read_formula(text: str, known: "Symbols") -> Any:
    """Return the SymPy expression of a text.

    Parameters
    ----------
    text : str
        As :func:`formula_text` writes it.
    known : mapping from str to sympy.Symbol
        The symbols that may occur.

    Raises
    ------
    ValueError
        If the text is no formula, naming the part that is not accepted.

    Examples
    --------
    >>> read_formula("2 - x**2/3", symbols(["x"]))
    2 - x**2/3
    >>> read_formula("open('file')", {})
    Traceback (most recent call last):
    ValueError: formula: expected arithmetic of known symbols and functions; got open('file')
    """
    try:
        return _read(ast.parse(text, mode="eval").body, known)
    except (SyntaxError, RecursionError, MemoryError) as error:
        msg = f"formula: expected Python's notation; got {_short(text)} ({type(error).__name__})"
        raise ValueError(msg) from error


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


def _read(node: ast.expr, known: "Symbols") -> Any:
    import sympy

    match node:
        case ast.BinOp():
            return _combined(node, _read(node.left, known), _read(node.right, known))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_read(operand, known)
        case ast.UnaryOp(op=ast.Invert(), operand=operand):
            return sympy.Not(_read(operand, known))
        case ast.Constant(value=bool() | int() | float()):
            return sympy.sympify(node.value)
        case ast.Name(id=name) if name in known or name in CONSTANTS:
            return getattr(sympy, name) if name in CONSTANTS else known[name]
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            return getattr(sympy, name)(*[_read(argument, known) for argument in arguments])
        case ast.Call(func=ast.Name(id="Symbol"), args=[ast.Constant(value=str(name))]) if (
            name in known
        ):
            return known[name]
        case ast.Compare(left=left, ops=[operator], comparators=[right]):
            relation = _RELATIONS.get(type(operator))
            if relation is not None:
                return getattr(sympy, relation)(_read(left, known), _read(right, known))
        case ast.Tuple(elts=parts):  # a case of a Piecewise
            return tuple([_read(part, known) for part in parts])
    raise _unaccepted(node)


_RELATIONS = {ast.Lt: "Lt", ast.LtE: "Le", ast.Gt: "Gt", ast.GtE: "Ge"}


def _combined(node: ast.BinOp, a: Any, b: Any) -> Any:
    match node.op:
        case ast.Add():
            return a + b
        case ast.Sub():
            return a - b
        case ast.Mult():
            return a * b
        case ast.Div():
            return a / b
        case ast.Pow() if not _is_huge(a, b):
            return a**b
        case ast.BitAnd():
            return a & b
        case ast.BitOr():
            return a | b
    raise _unaccepted(node)


def _is_huge(base: Any, exponent: Any) -> bool:
    """Whether a power of numbers would take long to work out."""
    if not (base.is_Rational and exponent.is_Rational):
        return False
    size = max(abs(int(base.p)).bit_length(), int(base.q).bit_length())
    return bool(size * abs(exponent) > BITS)


def _unaccepted(node: ast.expr) -> ValueError:
    got = _short(ast.unparse(node))
    msg = f"formula: expected arithmetic of known symbols and functions; got {got}"
    return ValueError(msg)


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:57]}..."

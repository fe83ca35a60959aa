"""Operations of a program on balls, with their first and second derivatives."""

from collections.abc import Callable
from itertools import product
from typing import Any

from flint import arb

from .balls import NAN, ZERO, square


def ordered(x: arb, y: arb) -> bool | None:
    """Compare strictly: what is decided on a closed box is decided around each of its points."""
    return True if x < y else False if x > y else None


def opposite(x: bool | None) -> bool | None:
    return None if x is None else not x


def both(x: bool | None, y: bool | None) -> bool | None:
    return False if x is False or y is False else None if None in {x, y} else True


def chosen(first: bool | None, x: arb, y: arb) -> arb:
    return x.union(y) if first is None else x if first else y


def off_cut(y: arb, x: arb, value: arb, otherwise: arb) -> arb:
    return value if x > 0 or y != 0 else otherwise


def power(x: arb, y: arb) -> arb:
    return x**y if x > 0 or (y.is_exact() and y.is_integer()) else NAN


def bell(x: Any) -> Any:
    return 2 * (-square(x)).exp() / arb.pi().sqrt()


def angle(y: arb, x: arb, r: arb) -> tuple[arb, ...]:
    bend, twist = 2 * x * y / r**2, (square(y) - square(x)) / r**2
    return x / r, -y / r, -bend, twist, bend


ALIKE = ("neg", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "erf")  # fmt: skip  # noqa: E501
LOGICAL = ("lt", "le", "not", "and", "or")  # operations whose values are truths


def arity(op: str) -> list[bool]:
    """Return for each argument of an operation whether it is a truth."""
    if op == "select":
        return [True, False, False]
    single = op in {*ALIKE, "square", "abs", "not", "var"}
    return [op in {"not", "and", "or"}] * (1 if single else 2)


# fmt: off
VALUES: dict[str, Callable[..., Any]] = {
    **{name: getattr(arb, name) for name in ALIKE}, "square": square, "abs": abs,
    "add": arb.__add__, "sub": arb.__sub__, "mul": arb.__mul__, "div": arb.__truediv__,
    "pow": arb.__pow__, "atan2": lambda y, x: off_cut(y, x, arb.atan2(y, x), arb(0, 3.2)),
    "min": arb.min, "max": arb.max, "lt": ordered, "le": ordered, "not": opposite, "and": both,
    "or": lambda x, y: opposite(both(opposite(x), opposite(y))), "select": chosen,
}
SLOPES: dict[str, Callable[..., Any]] = {  # f', f'' or f_x, f_y, f_xx, f_xy, f_yy of the arguments
    "neg": lambda _: (-1, 0), "square": lambda x: (2 * x, 2), "log": lambda x: (1 / x, -1 / x**2),
    "abs": lambda x: (-1, 0) if x < 0 else (1, 0) if x > 0 else (arb(0, 1), NAN),
    "sqrt": lambda x: (0.5 / x.sqrt(), -0.25 / x.sqrt() ** 3), "exp": lambda x: (x.exp(), x.exp()),
    "sin": lambda x: (x.cos(), -x.sin()), "cos": lambda x: (-x.sin(), -x.cos()),
    "tan": lambda x: (1 + square(x.tan()), 2 * x.tan() * (1 + square(x.tan()))),
    "asin": lambda x: (1 / (1 - square(x)).sqrt(), x / (1 - square(x)).sqrt() ** 3),
    "acos": lambda x: (-1 / (1 - square(x)).sqrt(), -x / (1 - square(x)).sqrt() ** 3),
    "atan": lambda x: (1 / (1 + square(x)), -2 * x / (1 + square(x)) ** 2),
    "sinh": lambda x: (x.cosh(), x.sinh()), "cosh": lambda x: (x.sinh(), x.cosh()),
    "tanh": lambda x: (1 - square(x.tanh()), -2 * x.tanh() * (1 - square(x.tanh()))),
    "erf": lambda x: (bell(x), -2 * x * bell(x)),
    "add": lambda *_: (1, 1, 0, 0, 0), "sub": lambda *_: (1, -1, 0, 0, 0),
    "mul": lambda x, y: (y, x, 0, 1, 0),
    "div": lambda x, y: (1 / y, -x / y**2, 0, -1 / y**2, 2 * x / y**3),
    "pow": lambda x, y: (
        y * power(x, y - 1), x**y * x.log(), y * (y - 1) * power(x, y - 2),
        x ** (y - 1) * (1 + y * x.log()), x**y * x.log() ** 2),
    "atan2": lambda y, x: angle(y, x, off_cut(y, x, square(x) + square(y), NAN)),
}
# fmt: on


def unite(x: dict[int, arb], y: dict[int, arb]) -> dict[int, arb]:
    return {i: x.get(i, ZERO).union(y.get(i, ZERO)) for i in x | y}


def chain(slopes: tuple[Any, ...], parts: list[Any], order: int) -> tuple[Any, Any]:
    """Return gradient and Hessian of an operation from those of its arguments, as dictionaries."""
    g, h = dict[int, Any](), dict[tuple[int, int], Any]()
    for p, (gradient, hessian) in zip(slopes, parts, strict=False):
        for i, x in gradient.items():
            g[i] = g.get(i, ZERO) + p * x
        for ij, x in hessian.items():
            h[ij] = h.get(ij, ZERO) + p * x
    places = [(0, 0)] if len(parts) == 1 else [(0, 0), (0, 1), (1, 1)]
    for p, (a, b) in zip(slopes[len(parts) :], places, strict=True) if order > 1 else ():
        for (i, x), (j, y) in product(parts[a][0].items(), parts[b][0].items()):
            for ij in {(a, b): (i, j), (b, a): (j, i)}.values():
                h[ij] = h.get(ij, ZERO) + p * (square(x) if x is y else x * y)
    return g, h

"""The tilted cylinder in space, built from its axis and its radius alone, and a dumbbell on it.

Nothing here is taken from the paper: a point is given by its position along the axis and its
azimuth, which is 0 where the cylinder is lowest.  Printed formulas are strings, which
:func:`formula` parses in the same symbols.
"""

import re
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import sympy

# An argument that needs no brackets, as SymPy writes it.
SINGLE = re.compile(r"\{\\left\((\\?\w+) \\right\)\}")
# Sample values at which differing formulas are shown to differ.
SAMPLE = {
    "phi": 0.6,
    "eta": 40.0,
    "theta": 0.3,
    "alpha": 0.12,
    "R": 125.0,
    "rho": 122.0,
    "l": 16.0,
}


@cache
def symbols() -> "dict[str, sympy.Symbol]":
    """Return the symbols by name: coordinates and time are real, sizes and the tilt positive."""
    import sympy

    real = sympy.symbols("phi eta theta omega t a b c x y z", real=True)
    positive = sympy.symbols("R rho l alpha", positive=True)
    return {symbol.name: symbol for symbol in (*real, *positive)}


def formula(text: str) -> "sympy.Expr":
    """Return a formula written in the symbols."""
    import sympy

    return sympy.parse_expr(text, local_dict=dict(symbols()))


def vanishes(expression: "sympy.Expr") -> bool:
    """Return whether an expression is identically zero; a nonzero sample value decides quickly."""
    import sympy

    known = {symbols()[name] for name in SAMPLE}
    if expression.free_symbols <= known and abs(at_sample(expression)) > 1e-9:
        return False
    return bool(sympy.simplify(expression) == 0)


def at_sample(expression: "sympy.Expr", **others: float) -> float:
    """Return the value of an expression at sample coordinates, angles in radians."""
    values = {**SAMPLE, **others}
    return float(expression.subs({symbols()[name]: value for name, value in values.items()}))


def typeset(expression: Any) -> str:
    """Return an expression as TeX between dollars."""
    import sympy

    names = {symbols()["phi"]: r"\varphi", symbols()["l"]: r"\ell"}
    written = sympy.latex(expression, symbol_names=names, inv_trig_style="full")
    return "$" + SINGLE.sub(r" \1", written) + "$"


@cache
def frame() -> "tuple[sympy.Matrix, sympy.Matrix, sympy.Matrix]":
    """Return the axis, the horizontal direction across it, and the direction down across both."""
    import sympy

    alpha = symbols()["alpha"]
    axis = sympy.Matrix([0, sympy.cos(alpha), sympy.sin(alpha)])
    level = sympy.Matrix([1, 0, 0])
    return axis, level, axis.cross(level)


@cache
def surface(radius: str = "R") -> "sympy.Matrix":
    """Return the point at azimuth ``phi`` and axial position ``eta``, in laboratory coordinates."""
    import sympy

    axis, level, down = frame()
    s = symbols()
    return s["eta"] * axis + s[radius] * (sympy.sin(s["phi"]) * level + sympy.cos(s["phi"]) * down)


@cache
def tangents(radius: str = "R") -> "tuple[sympy.Matrix, sympy.Matrix]":
    """Return the derivatives of the point by ``phi`` and ``eta``."""
    point = surface(radius)
    return point.diff(symbols()["phi"]), point.diff(symbols()["eta"])


@cache
def unit_frame() -> "tuple[sympy.Matrix, sympy.Matrix, sympy.Matrix]":
    """Return unit vectors along growing ``phi``, along growing ``eta``, and outwards."""
    east, north = (v / v.norm().simplify() for v in tangents())
    return east, north, (-east.cross(north)).applyfunc(lambda e: e.simplify())


@cache
def fall() -> "sympy.Matrix":
    """Return the tangential part of the unit vector that points vertically down."""
    import sympy

    down = sympy.Matrix([0, 0, -1])
    outwards = unit_frame()[2]
    return (down - down.dot(outwards) * outwards).applyfunc(sympy.simplify)


@cache
def ball_centres() -> "tuple[sympy.Matrix, sympy.Matrix]":
    """Return the two ball centres of a dumbbell.

    They lie on the cylinder of radius ``rho``, at equal azimuths on either side of ``phi``, a
    length ``l`` apart, and their chord makes the angle ``theta`` with the meridian.
    """
    import sympy

    s = symbols()
    aside = sympy.asin(s["l"] * sympy.sin(s["theta"]) / (2 * s["rho"]))
    along = s["l"] * sympy.cos(s["theta"]) / 2
    point = surface("rho")
    ends = [{s["phi"]: s["phi"] + k * aside, s["eta"]: s["eta"] + k * along} for k in (-1, 1)]
    first, second = (
        point.subs(end, simultaneous=True).applyfunc(sympy.expand_trig) for end in ends
    )
    return first, second

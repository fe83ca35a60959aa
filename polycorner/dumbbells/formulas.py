"""The formulas of a dumbbell pair, in a drum and in the developed plane.

Dumbbell A has the coordinates number 1, dumbbell B number 2.  Ball 1 of a dumbbell is the end at
``-l/2`` along its axis, ball 2 the end at ``+l/2``; the axis has heading ``theta`` from the
meridian towards growing azimuth.  In the drum the centres lie on a cylinder of radius
``rho = R - r`` and the rod is the chord between them ([GMBN] sec. 5).
"""

from collections.abc import Callable
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

from polycorner.formulas import Family
from polycorner.toolkit import SOURCES, Feature, placed_gaps, placed_stationary, source_key

if TYPE_CHECKING:
    import sympy

    Expressions = dict[str, sympy.Expr]
    Formulas = tuple[Expressions, Expressions]

DRUM = ("phi", "eta", "theta")
PLANE = ("x", "y", "theta")
A, B = ("A1", "A2"), ("B1", "B2")
# Ball and ball, ball and rod, rod and rod: the gaps of points and segments of space.
GAPS: dict[str, tuple[Feature, Feature]] = {
    **{f"{ball}{other}": (ball, other) for ball, other in product(A, B)},
    **{f"{ball}b": (ball, B) for ball in A},
    **{f"a{ball}": (ball, A) for ball in B},
    "ab": (A, B),
}
CONTACTS = tuple(GAPS)
BALLS = (("A1", 1, -1), ("A2", 1, 1), ("B1", 2, -1), ("B2", 2, 1))


def variables(names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the coordinates of both dumbbells."""
    return tuple(f"{name}{k}" for k in (1, 2) for name in names)


@lru_cache(maxsize=1)
def drum_gaps() -> Family:
    """Return the nine gaps in the drum; parameters ``l r t rho``."""
    symbols = DRUM, ("l", "r", "t", "rho")
    return _family(CONTACTS, *symbols, lambda: _gaps(_drum_centres()), held=placed_stationary(GAPS))


@lru_cache(maxsize=1)
def plane_gaps() -> Family:
    """Return the nine gaps in the developed plane; parameters ``l r t``."""
    symbols = PLANE, ("l", "r", "t")
    return _family(
        CONTACTS, *symbols, lambda: _gaps(_plane_centres()), held=placed_stationary(GAPS)
    )


@lru_cache(maxsize=1)
def drum_energy() -> Family:
    """Return the weighted height of centres above the floor, in mm; parameters ``l R rho w``.

    Each ball counts once and each rod ``w`` times, at the middle of its chord.
    """
    return _family(("height",), DRUM, ("l", "R", "rho", "w"), _drum_heights)


@lru_cache(maxsize=1)
def plane_energy() -> Family:
    """Return half the weighted sum of squared lateral positions, in mm^2; parameters ``l w``.

    It is the limit, as the drum grows, of ``rho`` times the height above the lowest one.
    """
    return _family(("trough",), PLANE, ("l", "w"), _plane_heights, "mm^2")


@lru_cache(maxsize=1)
def mean_heading() -> Family:
    """Return ``sin((theta1 + theta2)/2 - h)``; parameter ``h``, in radians."""
    key = repr((source_key(__name__), "heading"))
    return Family(("heading",), ("theta1", "theta2"), ("h",), _mean_heading, key, "1")


def _mean_heading() -> "Formulas":
    import sympy

    first, second, h = _symbols("theta1 theta2 h")
    return {}, {"heading": sympy.sin((first + second) / 2 - h)}


def _family(
    names: tuple[str, ...],
    coordinates: tuple[str, ...],
    parameters: tuple[str, ...],
    formulas: "Callable[[], Formulas]",
    unit: str = "mm",
    held: tuple[str, ...] = (),
) -> Family:
    sources = source_key(*SOURCES, __name__)
    key = repr((sources, names, coordinates, parameters))
    symbols = variables(coordinates), parameters
    return Family(names, *symbols, formulas, key, unit, stationary=held)


def _symbols(names: str) -> "list[sympy.Symbol]":
    import sympy

    found = sympy.symbols(names, real=True)
    return list(found) if isinstance(found, tuple) else [found]


def _drum_centres() -> "Expressions":
    import sympy

    length, rho, per_diameter = _symbols("l rho per_diameter")
    definitions: Expressions = {"per_diameter": 1 / (2 * rho)}
    for k in (1, 2):
        phi, eta, theta, s, c = _symbols(f"phi{k} eta{k} theta{k} s{k} c{k}")
        definitions[f"s{k}"] = length * per_diameter * sympy.sin(theta)
        definitions[f"c{k}"] = sympy.sqrt(1 - s**2)
        for ball, owner, sign in BALLS:
            if owner == k:
                sine = sympy.sin(phi) * c + sign * sympy.cos(phi) * s
                cosine = sympy.cos(phi) * c - sign * sympy.sin(phi) * s
                definitions[f"{ball}x"] = rho * sine
                definitions[f"{ball}y"] = eta + sign * length * sympy.cos(theta) / 2
                definitions[f"{ball}z"] = -rho * cosine
    return definitions


def _plane_centres() -> "Expressions":
    import sympy

    (length,) = _symbols("l")
    definitions: Expressions = {}
    for ball, k, sign in BALLS:
        x, y, theta = _symbols(f"x{k} y{k} theta{k}")
        definitions[f"{ball}x"] = x + sign * length * sympy.sin(theta) / 2
        definitions[f"{ball}y"] = y + sign * length * sympy.cos(theta) / 2
        definitions[f"{ball}z"] = sympy.S.Zero
    return definitions


def _gaps(centres: "Expressions") -> "Formulas":
    """Return the gaps of balls and rods whose centres and ends are given."""
    r, t = _symbols("r t")
    rods = {name: sum(isinstance(part, tuple) for part in pair) for name, pair in GAPS.items()}
    radii = {name: (2 * r, r + t, 2 * t)[count] for name, count in rods.items()}
    definitions, expressions = placed_gaps(GAPS, radii)
    return {**centres, **definitions}, expressions


def _drum_heights() -> "Formulas":
    import sympy

    length, radius, rho, weight = _symbols("l R rho w")
    heights = []
    for k in (1, 2):
        phi, theta = _symbols(f"phi{k} theta{k}")
        chord = sympy.sqrt(1 - (length * sympy.sin(theta) / (2 * rho)) ** 2)
        middle = radius - rho * sympy.cos(phi) * chord
        heights.append((2 + weight) * middle)
    return {}, {"height": sum(heights[1:], heights[0])}


def _plane_heights() -> "Formulas":
    import sympy

    length, weight = _symbols("l w")
    total = sympy.S.Zero
    for k in (1, 2):
        x, theta = _symbols(f"x{k} theta{k}")
        total += (2 + weight) * (x**2 + (length * sympy.sin(theta) / 2) ** 2) / 2
    return {}, {"trough": total}


def plane_heading_formula() -> "sympy.Expr":
    """Return ``theta_s(r, t, l)`` of the three-contact corner in the plane, derived symbolically.

    The two dumbbells are parallel, their axes ``p = r + t`` apart and shifted by
    ``D = l - sqrt(4 r^2 - p^2)``, so that each inner ball touches the other rod and both touch.
    The trough energy of the four balls, balanced about the lowest line, has a derivative of the
    form ``A sin 2 theta - B cos 2 theta``; its coefficients are read off and checked.
    """
    import sympy

    length, r, t, theta = sympy.symbols("l r t theta", positive=True)
    p = r + t
    along = length - sympy.sqrt(4 * r**2 - p**2)
    offset = along * sympy.sin(theta) - p * sympy.cos(theta)
    signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
    lateral = [(a * offset + b * length * sympy.sin(theta)) / 2 for a, b in signs]
    slope = sympy.diff(sum(x**2 for x in lateral) / 2, theta)
    a, b = slope.subs(theta, sympy.pi / 4), -slope.subs(theta, 0)
    form = a * sympy.sin(2 * theta) - b * sympy.cos(2 * theta)
    if sympy.simplify(slope - form) != 0:
        msg = "the slope of the trough energy is not of the form that the derivation needs"
        raise AssertionError(msg)
    return sympy.atan(sympy.simplify(b / a)) / 2

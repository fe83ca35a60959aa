"""Gaps and slips of images: of the nearest one of another body, and of a body's own image.

The images of a body are displaced by whole numbers of periods.  Gaps and slips depend on the
displacement ``w`` of two bodies alone, so that a family becomes one of images when ``w`` is
replaced:

- for two bodies by its representative in ``(-T/2, T/2]``, ``T`` a multiple of the period: the
  formula is ``T / 2 pi`` times the angle of ``w``, smooth except where it jumps by ``T``;
- for a body and its own image by a constant, so that orientations are left as variables.
"""

from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from polycorner.bodies.frames import Frame, symbols
from polycorner.bodies.gaps import FIRST, SECOND, numbers
from polycorner.formulas import cache
from polycorner.formulas.families import Family, substituted
from polycorner.spaces.manifold import Array
from polycorner.values import Value, cached_property

if TYPE_CHECKING:
    import sympy

    from polycorner.bodies.gaps import Formulas


MIDDLES = ("first", "second")


@dataclass(frozen=True, eq=False)
class Image(Value):
    """Where an image is.

    Attributes
    ----------
    shift : (d,) array
        Its displacement from the body.
    periods : (d,) array
        By which images are the same; ``inf`` where there are none.
    """

    shift: Array
    periods: Array

    @cached_property
    def axes(self) -> tuple[int, ...]:
        """The directions in which there are images."""
        return tuple(np.flatnonzero(np.isfinite(self.periods)).tolist())


def _numbered(name: str, d: int) -> list[str]:
    return [f"{name}{k}" for k in range(d)]


@lru_cache(maxsize=256)
def nearest_image(
    family: Family,
    one: Frame,
    two: Frame,
    d: int,
    axes: tuple[int, ...],
    eccentric: tuple[bool, bool],
) -> Family:
    """Return the functions of a family for the nearest image.

    Further parameters: the middles ``first`` and ``second`` of bodies that are ``eccentric``, by
    whose displacement the nearest image is meant, in coordinates of the body; ``shift`` of the
    first against the second; ``period`` along ``axes``.
    """
    middles = [
        numbers(name, frame, d)
        for name, frame, is_off in zip(MIDDLES, (one, two), eccentric, strict=True)
        if is_off
    ]
    further = [*chain(*middles), *_numbered("shift", d), *(f"period{k}" for k in axes)]
    formulas = partial(_nearest, family, one, two, d, axes, eccentric)
    key = repr((cache.source_key(__name__), family.key, "nearest", axes, eccentric))
    parameters = (*family.parameters, *further)
    return Family(
        family.names, family.variables, parameters, formulas, key, stationary=family.stationary
    )


def _nearest(
    family: Family,
    one: Frame,
    two: Frame,
    d: int,
    axes: tuple[int, ...],
    eccentric: tuple[bool, bool],
) -> "Formulas":
    import sympy

    definitions: dict[str, sympy.Expr] = {}

    def define(name: str, expression: "sympy.Expr") -> "sympy.Symbol":
        definitions[name] = expression
        return symbols([name])[0]

    origins, middles = [], []
    for role, name, frame, is_off in zip(
        (FIRST, SECOND), MIDDLES, (one, two), eccentric, strict=True
    ):
        local = symbols(numbers(name, frame, d))
        middle = frame.vector(role, local, d)[:d] if is_off else (sympy.S.Zero,) * d
        middles.append([define(f"{name}_{k}", x) for k, x in enumerate(middle)])
        origins.append(symbols(frame.variables(role, d)[:d]) or [sympy.S.Zero] * d)
    places: dict[sympy.Symbol, sympy.Expr] = {}
    for k, shift in enumerate(symbols(_numbered("shift", d))):
        (first, second), (p, q) = ((some[0][k], some[1][k]) for some in (origins, middles))
        away = first + p - second - q + shift
        if k in axes:
            period = symbols([f"period{k}"])[0]
            turn = define(f"turn{k}", away * 2 * sympy.pi / period)
            away = wrapped(turn, period)
        near = define(f"near{k}", away)
        # The middle of the second is at zero if it moves, that of the first ``near`` from it.
        if one is Frame.FIXED:
            places[second] = p - near - q
        elif two is Frame.FIXED:
            places[first] = q + near - p
        else:
            places |= {first: near - p, second: -q}
    known, expressions = substituted(family.formulas(), places)
    return definitions | known, expressions


def wrapped(turn: "sympy.Expr", period: "sympy.Expr | float") -> "sympy.Expr":
    """Return the representative in ``(-T/2, T/2]`` of a displacement by an angle ``2 pi w / T``."""
    import sympy

    return period / (2 * sympy.pi) * sympy.atan2(sympy.sin(turn), sympy.cos(turn))


@lru_cache(maxsize=256)
def own(family: Family, frame: Frame, d: int) -> Family:
    """Return the functions of a family for a body and an image of itself.

    Further parameters: ``shift`` of the first against the second.
    """
    parameters = (*family.parameters, *_numbered("shift", d))
    placed = frame.variables(FIRST, d)[:d]
    variables = tuple(n for n in family.variables if FIRST in n and n not in placed)
    held = tuple(n for n in family.stationary if n in variables or n not in family.variables)
    key = repr((cache.source_key(__name__), family.key, "own"))
    return Family(
        family.names, variables, parameters, partial(_own, family, placed), key, stationary=held
    )


def _own(family: Family, placed: tuple[str, ...]) -> "Formulas":
    """Let both bodies be the same one: the origin of the first is at the shift, the second at 0."""
    import sympy

    both = [name for name in family.variables if SECOND in name]
    places: dict[sympy.Symbol, sympy.Expr] = dict(
        zip(symbols(both), symbols([n.replace(SECOND, FIRST) for n in both]), strict=True)
    )
    shifts = symbols(_numbered("shift", len(placed)))
    places |= dict(zip(symbols(placed), shifts, strict=True))
    places |= dict.fromkeys(symbols([n.replace(FIRST, SECOND) for n in placed]), sympy.S.Zero)
    return substituted(family.formulas(), places)

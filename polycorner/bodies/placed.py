"""Gaps of features that a model places by formulas of its own.

A feature is a point of space, given by its name, or a segment, by the names of its ends.  The
model defines the coordinates of a point ``A1`` as ``A1x``, ``A1y`` and ``A1z``.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from polycorner.bodies import frames, gaps
from polycorner.bodies.frames import Frame, symbols
from polycorner.formulas import families
from polycorner.formulas.families import Family, Term, composition, stationary
from polycorner.spaces import distances

if TYPE_CHECKING:
    import sympy

    from polycorner.formulas.families import Formulas

Feature = str | tuple[str, str]
# What the formulas are made by: part of the key of a family that contains them.
SOURCES = (distances.__name__, frames.__name__, gaps.__name__, families.__name__, __name__)
FREE = Frame.FIXED, Frame.FIXED  # put anywhere


def placed_gaps(
    pairs: Mapping[str, tuple[Feature, Feature]], radii: "Mapping[str, sympy.Expr]"
) -> "Formulas":
    """Return definitions and expressions of gaps: distances of features minus sums of radii.

    Parameters
    ----------
    pairs : mapping from str to (feature, feature)
        By the name of the gap; a point stands before a segment.
    radii : mapping from str to sympy.Expr
        The sum of the radii around the two features.
    """
    terms = {}
    for name, pair in pairs.items():
        family, letters = _kind(pair)
        places = dict(zip(symbols(["s"]), [radii[name]], strict=True))
        points = [point for feature in pair for point in _points(feature)]
        for letter, point in zip(letters, points, strict=True):
            local = symbols(gaps.numbers(letter, Frame.FIXED, 3))
            places |= dict(zip(local, symbols([f"{point}{x}" for x in "xyz"]), strict=True))
        terms[name] = Term(family, "gap", places)
    return composition(terms)


def placed_stationary(pairs: Mapping[str, tuple[Feature, Feature]]) -> tuple[str, ...]:
    """Return the definitions of :func:`placed_gaps` on which no gap depends to the first order."""
    return stationary(_kind(pair)[0] for pair in pairs.values())


def _points(feature: Feature) -> tuple[str, ...]:
    return (feature,) if isinstance(feature, str) else feature


def _kind(pair: tuple[Feature, Feature]) -> tuple[Family, str]:
    """Return the family of a gap, and the letters that it has for the points in their order."""
    match [len(_points(feature)) for feature in pair]:
        case [1, 1]:
            return gaps.points(*FREE, 3), "pq"
        case [1, 2]:
            return gaps.segment(*FREE, 3), "pab"
        case _:
            return gaps.segments(*FREE), "abgh"

"""Parts of links and of what is around them: which can touch, and how many gaps they have."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from polycorner.bodies.shapes import Body, Part, hull_distance
from polycorner.formulas.families import Family
from polycorner.tolerances import DEFAULT


class CarriedPart(NamedTuple):
    """A part in the axes of its carrier, and the link that may touch what is not next to it."""

    link: str
    name: str
    part: Part
    carrier: str
    is_linked: bool


def carried_parts(
    link: str, body: Body, carrier: str, *, is_linked: bool = False
) -> Iterator[CarriedPart]:
    """Yield the parts of a body."""
    for name, part in body.parts.items():
        yield CarriedPart(link, f"{link}.{name}" if name else link, part, carrier, is_linked)


def gaps_of(one: Part, two: Part) -> int:
    """Return how many gaps two parts have, about."""
    (p, f, e), (q, g, d) = (
        (len(x.points), *((len(x.facets.faces), len(x.facets.edges)) if x.facets else (0, 1)))
        for x in (one, two)
    )
    if p == 1 or q == 1 or f + g == 0:
        return 1
    return p * max(g, 1) + q * max(f, 1) + 12 * e * d


def affine() -> Family:
    """Return the distance of a joint from its limit."""
    import sympy

    rate, q, offset = sympy.symbols("rate q offset", real=True)
    return Family.of({"gap": rate * q + offset}, ["q"], ["rate", "offset"])


def touch(one: Part, two: Part) -> bool:
    """Whether two parts overlap or touch."""
    size = max(float(np.ptp(np.concatenate([one.points, two.points]), axis=0).max()), one.radius)
    radius = one.radius + two.radius
    return hull_distance(one.points, two.points) <= radius + DEFAULT.same * (size + two.radius)

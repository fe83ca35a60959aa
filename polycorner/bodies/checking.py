"""Checks of the bodies of an arrangement and of what is around them."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.bodies.shapes import Body
from polycorner.bodies.walls import Wall
from polycorner.checks import refuse
from polycorner.spaces.manifold import Array


def named(given: Any) -> dict[str, Body]:
    """Return bodies by name, numbered from 1 if they have none."""
    if not isinstance(given, Mapping):
        if isinstance(given, Body) or not isinstance(given, Sequence):
            refuse("bodies", "several bodies, in a sequence or by name", given, TypeError)
        given = {str(k): body for k, body in enumerate(given, 1)}
    if not given:
        refuse("bodies", "at least one body", given)
    for name in given:
        if not isinstance(name, str) or not f"x{name}".isidentifier():
            refuse("bodies", "names of letters, digits and _, as coordinates have", name)
    return dict(given)


def check_together(
    bodies: Mapping[str, Body],
    fixed: Mapping[str, Body],
    walls: Mapping[str, Wall],
    joints: Iterable[str] = (),
) -> None:
    """Raise ValueError for a name of two things, or things in the plane and in space.

    TypeError for walls that are none.
    """
    for wall in walls.values():
        if not isinstance(wall, Wall):
            refuse("walls", "half-spaces and cylinders", wall, TypeError)
    known = [*bodies, *fixed, *walls, *joints]
    twice = sorted({name for name in known if known.count(name) > 1})
    if twice:
        last = "joints" if twice[0] in joints else "walls" if twice[0] in walls else "fixed"
        refuse(last, "names of their own", twice[0])
    first, body = next(iter(bodies.items()))
    space = "the plane" if body.dimension == 2 else "space"
    for argument, several in (("bodies", bodies), ("fixed", fixed), ("walls", walls)):
        for name, one in several.items():
            if one.dimension != body.dimension:
                refuse(argument, f"all in {space}, like {first!r}", name)


def angular(argument: str, given: Any, d: int) -> float | Array:
    """Return an angular velocity: one number in the plane, three in space, where 0 is none."""
    expected = "an angular velocity, a finite number" if d == 2 else "3 finite numbers, or 0"
    found = checks.numbers(argument, given, expected)
    if d == 3 and found.ndim == 0 and found == 0:
        return np.zeros(3)
    if found.shape != (() if d == 2 else (3,)) or not np.isfinite(found).all():
        refuse(argument, expected, given)
    return float(found) if d == 2 else found.astype(np.float64)

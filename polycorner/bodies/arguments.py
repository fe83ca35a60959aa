"""Arguments of arrangements: bodies by name, placements."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.bodies.shapes import Body, Turn, turning
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


def placement(given: Any, d: int) -> tuple[Array, Array]:
    """Return origin and matrix of what a user gives for a placement."""
    turn: Turn | None = None
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1:
        given, turn = given
    origin = checks.numbers("placed", given, f"{d} numbers, or a pair of them and a rotation")
    if origin.shape != (d,):
        refuse("placed", f"{d} numbers, or a pair of them and a rotation", given)
    return origin, turning(turn, d)

"""Arguments of arrangements: bodies by name, placements, motions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.bodies.frames import Frame
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Body, Turn, turning
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
    bodies: Mapping[str, Body], fixed: Mapping[str, Body], walls: Mapping[str, Wall]
) -> None:
    """Raise ValueError for a name of two things, or things in the plane and in space."""
    known = [*bodies, *fixed, *walls]
    twice = sorted({name for name in known if known.count(name) > 1})
    if twice:
        refuse("fixed" if twice[0] in fixed else "walls", "names of their own", twice[0])
    first, body = next(iter(bodies.items()))
    space = "the plane" if body.dimension == 2 else "space"
    for argument, several in (("bodies", bodies), ("fixed", fixed), ("walls", walls)):
        for name, one in several.items():
            if one.dimension != body.dimension:
                refuse(argument, f"all in {space}, like {first!r}", name)


def coordinates(placed: Any, placements: Sequence[Placement]) -> Array:
    """Return the coordinates of all bodies where a user places them."""
    names = [p.name for p in placements]
    checks.names("placed", checks.mapping("placed", placed), names)
    missing = [name for name in names if name not in placed]
    if missing:
        refuse("placed", f"a placement of {missing[0]!r} as well", [*placed])
    found = []
    for p in placements:
        origin, matrix = _placement(placed[p.name], p.body.dimension)
        fixed = p.frame is Frame.SHIFTED and not p.is_round
        if fixed and (matrix != np.eye(len(origin))).any():
            expected = f"no rotation of {p.name!r}, which is shifted only"
            refuse("placed", expected, placed[p.name])
        found.append(p.coordinates(origin, matrix))
    return np.concatenate(found)


def _placement(given: Any, d: int) -> tuple[Array, Array]:
    """Return origin and matrix of what a user gives for a placement."""
    turn: Turn | None = None
    expected = f"{d} numbers, or a pair of them and a rotation"
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1:
        given, turn = given
    origin = checks.numbers("placed", given, expected)
    if origin.shape != (d,):
        refuse("placed", expected, given)
    return origin, turning(turn, d)


def rates(point: Array, moving: Any, placements: Sequence[Placement]) -> Array:
    """Return the velocities of the coordinates of all bodies, which a user sets in motion."""
    checks.names("moving", checks.mapping("moving", moving), [p.name for p in placements])
    found = [p.rates(point, *_motion(moving.get(p.name), p)) for p in placements]
    return np.concatenate(found)


def _motion(given: Any, p: Placement) -> tuple[Array, Array]:
    """Return velocity ``(d,)`` and angular velocity ``(3,)`` of what a user gives for a motion."""
    d = p.body.dimension
    spins = "a number" if d == 2 else "3 numbers"
    expected = f"{d} finite numbers for {p.name!r}, or a pair of them and {spins}"
    if given is None:
        return np.zeros(d), np.zeros(3)
    turn: Any = np.zeros(3)
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1:
        given, turn = given
        turn = checks.numbers("moving", turn, expected)
        turn = np.array([0.0, 0.0, turn]) if d == 2 and turn.ndim == 0 else turn
    velocity = checks.numbers("moving", given, expected)
    fits = velocity.shape == (d,) and turn.shape == (3,)
    if not fits or not np.isfinite([*velocity, *turn]).all():
        refuse("moving", expected, given)
    if turn.any() and p.frame is Frame.SHIFTED:
        refuse("moving", f"no angular velocity of {p.name!r}, which is shifted only", turn)
    return velocity, turn


def angular(argument: str, given: Any, d: int) -> float | Array:
    """Return an angular velocity: one number in the plane, three in space, where 0 is none."""
    expected = "an angular velocity, a finite number" if d == 2 else "3 finite numbers, or 0"
    found = checks.numbers(argument, given, expected)
    if d == 3 and found.ndim == 0 and found == 0:
        return np.zeros(3)
    if found.shape != (() if d == 2 else (3,)) or not np.isfinite(found).all():
        refuse(argument, expected, given)
    return float(found) if d == 2 else found.astype(np.float64)

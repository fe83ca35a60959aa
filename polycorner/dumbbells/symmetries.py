"""Symmetries of a pair of dumbbells: motions of the pair as a whole, and relabellings.

In the developed plane both dumbbells may be translated and rotated together; in the drum they may
be rolled and shifted together, and a half-turn about a vertical axis maps the drum to itself.
Bodies and balls may be relabelled: the two dumbbells, and the two balls of either.
"""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from polycorner.dumbbells.formulas import CONTACTS
from polycorner.polyhedra import Element
from polycorner.toolkit import Array


def plane_tangents(q: Array) -> Array:
    """Return the velocities of translations across and along, and of a rotation, ``(3, 6)``."""
    x1, y1, _, x2, y2, _ = q
    return np.array([[1, 0, 0, 1, 0, 0], [0, 1, 0, 0, 1, 0], [y1, -x1, 1, y2, -x2, 1]])


def drum_tangents(q: Array) -> Array:
    """Return the velocities of rolling and of shifting the pair, ``(2, 6)``."""
    del q  # the same everywhere
    return np.array([[1.0, 0, 0, 1, 0, 0], [0, 1.0, 0, 0, 1, 0]])


def plane_invariants(q: Array, half_length: float, unit: float) -> Array:
    """Return the position of B across and along the axis of A, and the angle between the axes.

    Lengths are in ``unit``, the angle as cosine and sine times ``half_length / unit``.
    """
    across, along = q[3] - q[0], q[4] - q[1]
    s, c, turn = np.sin(q[2]), np.cos(q[2]), q[5] - q[2]
    place = (across * c - along * s, across * s + along * c)
    arm = (half_length * np.cos(turn), half_length * np.sin(turn))
    return np.array([*place, *arm]) / unit


def drum_invariants(q: Array, half_length: float, unit: float, centre_radius: float) -> Array:
    """Return the differences of azimuth and axial position, and both headings; see above."""
    apart, along = q[3] - q[0], q[4] - q[1]
    arms = [half_length * f(theta) for theta in (q[2], q[5]) for f in (np.cos, np.sin)]
    around = (centre_radius * np.cos(apart), centre_radius * np.sin(apart))
    return np.array([*around, along, *arms]) / unit


def relabellings() -> tuple[Element, ...]:
    """Return the relabellings of dumbbells and balls, a group of order 8, without the identity."""
    swap = _element(_swap, {"A1": "B1", "A2": "B2", "B1": "A1", "B2": "A2"})
    turn = _element(_turn_first, {"A1": "A2", "A2": "A1", "B1": "B1", "B2": "B2"})
    found = {tuple(sorted(g.names.items())): g for g in (swap, turn)}
    while True:
        products = [_product(g, h) for g in found.values() for h in (swap, turn)]
        fresh = {tuple(sorted(g.names.items())): g for g in products}
        if fresh.keys() <= found.keys():
            return tuple(g for g in found.values() if any(a != b for a, b in g.names.items()))
        found = {**fresh, **found}


def ball_relabellings() -> tuple[Element, ...]:
    """Return the relabellings of balls alone, A and B staying distinct, without the identity."""
    return tuple(g for g in relabellings() if g.names["A1b"].startswith("A"))


def half_turn_in_place() -> Element:
    """Return the half-turn of the pair about the vertical axis through the lowest point.

    It maps the drum to itself and preserves all labels.
    """
    return Element(_half_turn, {})


def _half_turn(q: Array) -> Array:
    return np.asarray(q * np.array([-1, -1, 1] * 2) + np.array([0, 0, math.pi] * 2))


def _swap(q: Array) -> Array:
    return q[[3, 4, 5, 0, 1, 2]]


def _turn_first(q: Array) -> Array:
    return np.asarray(q + np.array([0, 0, math.pi, 0, 0, 0]))


def _both(g: Element, h: Element, q: Array) -> Array:
    return h.apply(g.apply(q))


def _product(g: Element, h: Element) -> Element:
    return Element(partial(_both, g, h), {name: h.names[image] for name, image in g.names.items()})


def _element(apply: Callable[[Array], Array], balls: dict[str, str]) -> Element:
    """Return the element with a given action on the balls."""
    rods = {a[0].lower(): b[0].lower() for a, b in balls.items()}
    parts = balls | rods
    canonical = {frozenset(_split(name)): name for name in CONTACTS}
    names = {name: canonical[frozenset(parts[part] for part in _split(name))] for name in CONTACTS}
    return Element(apply, names)


def _split(contact: str) -> tuple[str, str]:
    """Return the two parts of a contact's name: ``A1b`` is ball ``A1`` and rod ``b``."""
    first = 2 if contact[1].isdigit() else 1
    return contact[:first], contact[first:]

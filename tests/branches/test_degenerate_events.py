"""Equilibria that are not isolated end an arc, with a note; contacts are exchanged at once."""

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.branches import branches

t = sympy.Symbol("t")
PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols
WALLS = {"west": x, "south": y}
# K = [[1, 0], [0, 0]], the force (5, -1) + t (2, -1): at t = -1 nothing acts along y.
TROUGH = x**2 / 2 - (5 + 2 * t) * x + (1 + t) * y
LINES = {
    "a half-line": (WALLS, TROUGH, 0.0, [1, 1]),
    "from a half-line": (WALLS, TROUGH, -1.0, [1, 1]),
    "from its end": (WALLS, TROUGH, -1.0, [1, 0]),
    "a segment": (WALLS | {"east": 10 - x, "north": 10 - y}, TROUGH, 0.0, [1, 1]),
    "an oblique one": ({"west": x + y / 3, "south": y - x / 5}, TROUGH, 0.0, [1, 1]),
    "a line for all values": ({"west": x + 5}, (x - t) ** 2, 0.0, [1, 1]),
    "a circle": ({"south": y + 3}, (x**2 + y**2 - 1) ** 2 + t * x, 0.5, [1, 0.2]),
    "a circle for all values": ({"south": y + 3}, (x**2 + y**2 - 2 - t) ** 2, 0.0, [1, 0.2]),
}


@pytest.mark.parametrize("case", LINES)
def test_equilibria_that_are_not_isolated_are_named(case):
    walls, energy, value, start = LINES[case]
    function = SmoothFunction("energy", energy, PLANE, parameters={"t": value})
    d = branches(minimise(Polyhedron(PLANE, walls), function, start), "t", (-1.5, 1.5))
    assert not d.closed
    assert len(d.arcs) <= 2
    (note,) = {event.note for event in d.events} - {""}
    assert "equilibria are not isolated there" in note


def test_two_corners_exchange_a_contact_at_once():
    """In each plane a line rises through a corner of two others, in both at the same time."""
    M = Manifold.euclidean("x y u v")
    names, (x, y, u, v) = "fg", M.symbols
    walls = {}
    for name, (along, up) in zip(names, ((x, y), (u, v)), strict=True):
        walls |= {f"{name}1": up - along, f"{name}2": up + along, f"{name}3": up - t}
    functions = [
        SmoothFunction(name, wall, M, parameters={"t": -1.0} if wall.has(t) else {})
        for name, wall in walls.items()
    ]
    energy = SmoothFunction("energy", y + x / 5 + v + u / 3, M)
    d = branches(minimise(Polyhedron(M, functions), energy, [0, 1, 0, 1]), "t", (-1.0, 1.0))
    assert d.closed
    assert [(e.kind.name, e.functions) for e in d.events if e.kind.name != "END"] == [
        ("EXCHANGE", ("f1", "f3", "g1", "g3"))
    ]
    before, after = d.arcs
    assert (before.active, after.active) == (("f1", "f2", "g1", "g2"), ("f2", "f3", "g2", "g3"))
    np.testing.assert_allclose(before.at(-0.4), 0, atol=1e-9)
    np.testing.assert_allclose(after.at(0.4), [-0.4, 0.4, -0.4, 0.4], atol=1e-9)


def test_the_index_changes_only_where_the_parameter_turns_back():
    """In this box a fold lies within a step after an event."""
    a, b, c = np.random.default_rng(29).normal(size=(3, 3))
    energy = sum(a[k] * sympy.cos(3 * x + 4 * b[k] * y + c[k]) for k in range(3)) - 3 * t * (x + y)
    box = {"west": x + 1, "east": 1 - x, "south": y + 1, "north": 1 - y}
    function = SmoothFunction("energy", energy, PLANE, parameters={"t": -2.0})
    d = branches(minimise(Polyhedron(PLANE, box), function, [-1, -1]), "t", (-2.0, 2.0))
    assert d.closed
    for event in d.events:
        indices = [d.arcs[k].index for k in event.arcs]
        turns = event.kind.name in {"FOLD", "CORNER_LIMIT"}
        assert np.ptp(indices) == (1 if turns else 0)

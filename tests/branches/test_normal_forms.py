"""Events whose kinds are known by construction."""

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.branches import branches

M = Manifold.euclidean("x y")
x, y = M.symbols
t = sympy.Symbol("t")
FAR = {"far": x + 10}


def function(name, expression, value):
    known = {"t": value} if sympy.sympify(expression).has(t) else {}
    return SmoothFunction(name, expression, M, parameters=known)


def diagram(functions, energy, start, value):
    d = Polyhedron(M, [function(name, f, value) for name, f in functions.items()])
    found = minimise(d, function("energy", energy, value), start)
    return branches(found, "t", (-1.0, 1.0))


# Functions, energy, start, its parameter; the event, its parameter, the indices of the arcs there
# and on which side of it they are.
CASES = {
    "opens": ({"wall": x}, (x - t) ** 2 + y**2, (1, 0), 0.5, "OPENS", 0.0, {(0, -1), (0, 1)}),
    "closes": ({"wall": x}, (x + t) ** 2 + y**2, (1, 0), 0.5, "CLOSES", 0.0, {(0, -1), (0, 1)}),
    "corner limit": (
        {"wall": x}, -(x**2) / 2 + t * x + y**2, (0, 0), 0.5, "CORNER_LIMIT", 0.0,
        {(0, 1), (1, 1)},
    ),
    "fold": (FAR, x**3 / 3 - t * x + y**2, (0.7, 0), 0.5, "FOLD", 0.0, {(0, 1), (1, 1)}),
    "pitchfork": (
        FAR, x**4 / 4 + t * x**2 / 2 + y**2, (0, 0), 0.5, "BRANCH", 0.0,
        {(0, 1), (1, -1), (0, -1)},
    ),
    "transcritical": (
        FAR, x**3 / 3 + t * x**2 / 2 + y**2, (0, 0), 0.5, "BRANCH", 0.0,
        {(0, 1), (1, 1), (0, -1), (1, -1)},
    ),
    "exchange": (
        {"a": y - x, "b": y + x, "c": y - t}, y + x / 10, (0, 0), -0.5, "EXCHANGE", 0.0,
        {(0, -1), (0, 1)},
    ),
    "a triangle vanishes": (
        {"a": y - x, "b": y + x, "c": t - y}, y + x / 10, (0, 0), 0.5, "VANISHES", 0.0, {(0, 1)},
    ),
    "a lens vanishes": (
        {"a": 1 + t - (x - 1) ** 2 - y**2, "b": 1 - (x + 1) ** 2 - y**2}, y, (0, -0.2), 0.5,
        "VANISHES", 0.0, {(0, 1)},
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_kinds(case):
    functions, energy, start, value, kind, where, sides = CASES[case]
    d = diagram(functions, energy, start, value)
    (event,) = [e for e in d.events if e.kind.name not in {"END", "OPENS", "CLOSES"} - {kind}]
    assert d.closed
    assert event.kind.name == kind
    assert event.parameter == pytest.approx(where, abs=1e-9)
    found = set()
    for arc in (d.arcs[k] for k in event.arcs):
        side = 1 if abs(arc.parameters[0] - where) < abs(arc.parameters[-1] - where) else -1
        found.add((arc.index, side))
    assert found == sides


def test_arcs_of_a_pitchfork():
    """The minima are at x = +-sqrt(-t), their energy is -t^2/4."""
    functions, energy, start, value, *_ = CASES["pitchfork"]
    d = diagram(functions, energy, start, value)
    for arc in d.arcs:
        s, (places, across) = arc.parameters, arc.points.T
        side = np.sign(places[len(places) // 2])
        np.testing.assert_allclose(places, side * np.sqrt(np.maximum(-s, 0)), atol=1e-7)
        np.testing.assert_allclose(across, 0, atol=1e-12)
        np.testing.assert_allclose(arc.energies, -abs(side) * s**2 / 4, atol=1e-12)
    assert [len(d.at(s)) for s in (-0.5, 0.5)] == [3, 1]
    assert sorted(c.verdict.name for c in d.at(-0.5)) == ["SADDLE", *["STRICT_MINIMUM"] * 2]


def test_arcs_are_interpolated_up_to_their_folds():
    """Where ``x = +-sqrt(t)``, so that neither branch is taken for the other."""
    functions, energy, start, value, *_ = CASES["fold"]
    d = diagram(functions, energy, start, value)
    for s in (1e-6, 1e-4, 0.01, 0.3):
        places = sorted(float(arc.at(s)[0]) for arc in d.arcs)
        np.testing.assert_allclose(places, [-np.sqrt(s), np.sqrt(s)], rtol=2e-3, atol=5e-4)
        assert sorted(c.verdict.name for c in d.at(s)) == ["SADDLE", "STRICT_MINIMUM"]

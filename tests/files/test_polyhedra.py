"""Polyhedra as entries of a file: formulas, tree and units come back."""

import json
import math

import numpy as np
import pytest
import sympy

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction
from polycorner.dumbbells import DumbbellPair
from polycorner.files.polyhedra import mismatch, polyhedron_entry, read_polyhedron
from polycorner.models import Pinball, SphereCluster, TorusDisks, Tutorial

M = Manifold(("x", "turn"), (math.inf, math.tau), (2.0, 0.1), ("m", "rad"))
X, T = M.symbols
BALL = SmoothFunction("ball", X**2 + sympy.sin(T), M, unit="m^2")
OWN = Polyhedron(
    M,
    AllOf(AnyOf(BALL, AllOf(X - 0.1, 2 - X)), BALL, sympy.cos(T) / 3),
    {"flat": X * sympy.cos(2 * T)},
    annotations={},
)
PAIR = DumbbellPair(16, 3, 1.5, 125)
POLYHEDRA = [
    OWN,
    PAIR.polyhedron,
    PAIR.section(0.3),
    DumbbellPair(16, 3, 1.5).polyhedron,
    Pinball().polyhedron,
    SphereCluster(4).polyhedron,
    TorusDisks(2, "hexagonal").polyhedron,
    Tutorial().polyhedron,
]


@pytest.mark.parametrize("polyhedron", POLYHEDRA, ids=repr)
def test_a_polyhedron_is_made_again(polyhedron):
    entry = json.loads(json.dumps(polyhedron_entry(polyhedron), allow_nan=False))
    read, energy = read_polyhedron(entry)
    assert energy is None
    assert (read.names, read.equation_names) == (polyhedron.names, polyhedron.equation_names)
    assert read.manifold == polyhedron.manifold
    assert read.manifold.units == polyhedron.manifold.units
    assert [f.unit for f in read.functions] == [f.unit for f in polyhedron.functions]
    assert mismatch(entry, polyhedron) == mismatch(entry, read) == ""
    assert polyhedron_entry(read) == entry | {"annotations": []}
    for one, other in zip(polyhedron.functions, read.functions, strict=True):
        assert one.family.program().digest() == other.family.program().digest()


def test_its_values_and_its_tree_are_the_same():
    read, energy = read_polyhedron(polyhedron_entry(OWN, BALL))
    points = np.random.default_rng(0).normal(size=(50, 2))
    np.testing.assert_array_equal(read.values(points), OWN.values(points))
    np.testing.assert_array_equal(read.implicit(points), OWN.implicit(points))
    np.testing.assert_array_equal(read.equation_values(points), OWN.equation_values(points))
    np.testing.assert_array_equal(energy.hessian(points), BALL.hessian(points))


@pytest.mark.parametrize(
    ("manifold", "parts", "told"),
    [
        (("x", "s"), {"f": 0}, "names of the coordinates: written x, y, found x, s"),
        (("x", "y"), {"g": 0}, "functions: written f, found g"),
    ],
)
def test_the_first_mismatch_is_named(manifold, parts, told):
    plane = Manifold.euclidean("x y")
    entry = polyhedron_entry(Polyhedron(plane, {"f": plane.symbols[0]}))
    other = Manifold(manifold)
    polyhedron = Polyhedron(other, {name: other.symbols[k] for name, k in parts.items()})
    assert mismatch(entry, polyhedron) == told

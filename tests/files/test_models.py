"""Models as entries of a file, and the units of what they speak of."""

import json
import math

import pytest

from polycorner import Manifold, Polyhedron
from polycorner.dumbbells import DumbbellPair
from polycorner.files.models import coordinate_units, described, rebuilt, units_of
from polycorner.models import Pinball, SphereCluster, TorusDisks, Tutorial

PAIR = DumbbellPair(16, 3, 1.5, 125, rod_weight=0.3)
PLANE = DumbbellPair(16, 3, 1.5)
MODELS = [PAIR, PLANE, Pinball(), Pinball(pins=(), cups=()), SphereCluster(5), Tutorial(3.0)]
MODELS += [TorusDisks(2), TorusDisks(3, "hexagonal")]


@pytest.mark.parametrize("model", MODELS, ids=repr)
def test_a_model_is_its_class_and_its_parameters(model):
    written = json.dumps(described(model), allow_nan=False)
    assert rebuilt(json.loads(written)) == model


def test_a_class_of_the_same_name_is_not_the_same():
    class Tutorial:
        size = 1.0

    with pytest.raises(TypeError, match=r"^model: expected one of"):
        described(Tutorial())


@pytest.mark.parametrize(
    ("model", "coordinates", "function", "energy"),
    [
        (PAIR, {"phi1": "rad", "eta1": "mm", "theta2": "rad"}, "mm", "mm"),
        (PLANE, {"x1": "mm", "y2": "mm", "theta1": "rad"}, "mm", "mm^2"),
        (Pinball(), {"x": "1", "y": "1"}, "1", "1"),
        (SphereCluster(3), {"z3": "diameter"}, "diameter^2", None),
        (TorusDisks(2), {"x1": "lattice vector", "r": "lattice vector"}, *["lattice vector"] * 2),
    ],
)
def test_models_have_units(model, coordinates, function, energy):
    found = units_of(model.polyhedron, getattr(model, "energy", None))
    assert set(found.coordinates) == set(model.manifold.names)
    assert coordinates.items() <= found.coordinates.items()
    assert set(found.functions.values()) == {function}
    assert found.energy == energy


def test_a_heading_is_a_number():
    assert units_of(PAIR.section(0.1)).functions["heading"] == "1"


def test_what_is_not_stated_is_not_known_but_angles():
    space = Manifold(("x", "turn", "ring"), (math.inf, math.tau, 1.0))
    assert coordinate_units(space) == {"x": None, "turn": "rad", "ring": None}
    assert coordinate_units(space, {"x": "m"})["x"] == "m"
    x = space.symbols[0]
    found = units_of(Polyhedron(space, {"f": x}), None, {"f": "m", "turn": "half-turns"})
    assert found.coordinates == {"x": None, "turn": "half-turns", "ring": None}
    assert (found.functions, found.energy) == ({"f": "m"}, None)

"""Models as values: sent to a spawned process, equal to their copies."""

import copy
import pickle

import numpy as np
import pytest
from elsewhere import called

from polycorner.models import Pinball, SphereCluster, TorusDisks, Tutorial
from polycorner.models.wells.wells import Well

MODELS = (Pinball(), SphereCluster(4), TorusDisks(2), Tutorial(), Well(0.0, 1.0))


@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_a_model_survives_pickling_after_it_was_used(model):
    points = np.random.default_rng(0).normal(size=(3, model.polyhedron.dimension))
    values = model.polyhedron.values(points)
    for again in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model)):
        assert again == model
        np.testing.assert_array_equal(again.polyhedron.values(points), values)


def test_a_spawned_process_computes_the_same():
    model = TorusDisks(3, "hexagonal")
    q = model.starts(np.random.default_rng(0), 4)
    np.testing.assert_array_equal(called(model.radius, q), model.radius(q))

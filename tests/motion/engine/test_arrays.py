"""Declarations of the engine's arrays: shapes, allocation, growth."""

from typing import get_type_hints

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.motion.contacts import velocities
from polycorner.motion.engine.allocation import allocate, filled, restored
from polycorner.motion.engine.arrays import (
    EngineState,
    Log,
    Model,
    Work,
    declarations,
    real,
    whole,
)
from polycorner.motion.engine.layout import model_of
from polycorner.motion.engine.sizes import Sizes
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.system import System

THREE = DumbbellDrum(count=3, floor=True).bodies
SIZES = Sizes.of(THREE, 16)


def test_shapes_are_sums_and_products_of_sizes():
    assert real("N k").extents(SIZES) == (3, 4)
    assert whole("N+1 2*k *").extents(SIZES) == (4, 8, -1)
    assert real().extents(SIZES) == ()


def test_sizes_count_what_bodies_have():
    assert SIZES[:16] == (3, 1, 4, 4, 9, 15, 2, 6, 2, 1, 9, 1, 2, 9, 4, 16)
    assert (SIZES.P, SIZES.B) == (3, 3 * 5 + 2 * 16)


PARTS = tuple(get_type_hints(Work).values())


@pytest.mark.parametrize("record", [EngineState, *PARTS, Log])
def test_arrays_are_allocated_as_declared(record):
    arrays = allocate(record, SIZES)
    for name, declared in declarations(record).items():
        array = getattr(arrays, name)
        assert array.dtype == declared.kind
        assert array.shape == declared.extents(SIZES)
        assert (array == declared.initial).all()


def test_every_array_is_declared_once():
    for record in (Model, EngineState, *PARTS, Log):
        assert tuple(declarations(record)) == record._fields


def test_saved_arrays_may_get_more_room():
    before, larger = allocate(EngineState, SIZES), Sizes.of(THREE, 40)
    rng = np.random.default_rng(0)
    for array in before:
        array[...] = rng.integers(1, 9, array.shape)
    after = restored(EngineState, larger, before._asdict())
    for name, declared in declarations(EngineState).items():
        old, new = getattr(before, name), getattr(after, name)
        assert new.shape == declared.extents(larger)
        np.testing.assert_array_equal(new[: len(old)], old)
        assert (new[len(old) :] == declared.initial).all()


def test_saved_arrays_of_other_bodies_are_refused():
    two = Sizes.of(DumbbellDrum(count=2).bodies, 16)
    with pytest.raises(ValueError, match="broadcast"):
        restored(EngineState, two, allocate(EngineState, SIZES)._asdict())


def test_constants_are_brought_to_their_type_and_shape():
    values = {
        name: np.zeros([1 if n < 0 else n for n in declared.extents(SIZES)])
        for name, declared in declarations(Model).items()
    }
    model = filled(Model, SIZES, {**values, "bodies": True, "kicks": [1, 2, 3, 4]})
    assert model.bodies == 1
    assert type(model.bodies) is int
    assert model.kicks.dtype == np.float64
    with pytest.raises(ValueError, match="reshape"):
        filled(Model, SIZES, {**values, "kicks": [1, 2, 3]})


def test_slips_of_a_kernel_belong_to_the_contacts_of_their_rows():
    model = model_of(THREE, SIZES, Noise(), Solver(), 0.0, 1e-3)
    places, contacts = model.slip_places[:-1], model.slip_contacts[:-1]
    used = places >= 0
    starts = model.slip_start[: model.first_friction[1] + 1]
    assert sorted(places[used]) == [*range(starts[-1])]
    assert (starts[contacts[used]] <= places[used]).all()
    assert (places[used] < starts[contacts[used] + 1]).all()


def test_a_body_without_friction_has_arrays():
    M = Manifold.euclidean("x")
    bodies = System(Polyhedron(M, {"floor": M.symbols[0]}), velocities(M)[0] ** 2 / 2).bodies
    model = model_of(bodies, Sizes.of(bodies, 1), Noise(), Solver(), 0.0, 1e-3)
    assert model.load_sources.shape == (0, 1)
    assert model.slip_start.tolist() == [0]
    assert model.gap_calls.shape == (1, 6)

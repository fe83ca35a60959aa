"""Statics of a pair as values: they travel, and their arrays are read-only."""

import copy
import math
import pickle
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from elsewhere import called

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.critical import branches, critical_corner
from polycorner.dumbbells.statics.error_bars import heading_error_bar
from polycorner.dumbbells.statics.keel import Keel
from polycorner.dumbbells.statics.minima import dyad_minima
from polycorner.dumbbells.statics.skeleton import PairAtlas, pair_atlas
from polycorner.dumbbells.statics.skeleton_map import PairMap, signature_of
from polycorner.dumbbells.statics.wells import Agitation, dyad_holds

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
KEEL = Keel(math.radians(7), 0.1, 0.3, 0.05, 0.2)
HEADINGS = np.radians([5.0, 10.0, 15.0])


def pair_map_of_one(atlas):
    """Return the map of a grid of one point."""
    none = np.empty(0)
    table = np.zeros((1, 1), dtype=int)
    return PairMap(
        np.array([16 / 3]),
        np.array([0.5]),
        table,
        (signature_of(atlas),),
        none,
        np.empty((0, 2)),
        np.empty((0, 2), dtype=int),
        np.zeros(1, dtype=int),
    )


@pytest.fixture(scope="module")
def values():
    """Return one value of every kind, after use."""
    atlas = pair_atlas(DumbbellPair(16, 3, 1.5))
    _ = atlas.ordered, KEEL.onset
    return {
        "critical": critical_corner(PAIR),
        "branch": branches(PAIR, [1.5, 2.5])[0],
        "minimum": dyad_minima(PAIR)[0],
        "atlas": atlas,
        "map": pair_map_of_one(atlas),
        "bar": heading_error_bar(PAIR, {"length": 0.1}),
        "region": KEEL.onset,
        "keel": KEEL,
        "turning": KEEL.turning(HEADINGS),
        "hold": dyad_holds(PAIR)[0],
        "shaking": Agitation(1e-3, 5.0),
    }


def content(value):
    """Return the fields of a value, and of values in its fields, as numbers, words and lists."""
    if isinstance(value, PairAtlas):
        return str(signature_of(value))
    if is_dataclass(value):
        return [content(getattr(value, field.name)) for field in fields(value) if field.compare]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return str(value)


def contents(values):
    """Return the content of every value."""
    return {name: content(value) for name, value in values.items()}


def test_values_are_sent_to_a_spawned_process_after_use(values):
    expected = contents(values)
    assert called(contents, values) == expected
    assert contents(copy.deepcopy(values)) == expected


def test_arrays_are_read_only_also_after_unpickling(values):
    for some in (values, pickle.loads(pickle.dumps(values))):
        arrays = [
            array
            for name in ("branch", "map", "turning")
            for array in vars(some[name]).values()
            if isinstance(array, np.ndarray)
        ]
        assert len(arrays) == 6 + 7 + 5
        for array in arrays:
            with pytest.raises(ValueError, match="read-only"):
                array[...] = 0

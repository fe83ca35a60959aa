"""Arguments of the statics of a pair: the error names the argument."""

import math
from dataclasses import replace

import pytest

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.critical import critical_corner, plane_critical_formula
from polycorner.dumbbells.statics.error_bars import heading_error_bar
from polycorner.dumbbells.statics.keel import Keel, RestRegion, rests
from polycorner.dumbbells.statics.minima import pair_minima
from polycorner.dumbbells.statics.minima_map import minima_map
from polycorner.dumbbells.statics.skeleton_map import pair_map
from polycorner.dumbbells.statics.wells import dyad_holds

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
PLANE = replace(PAIR, drum_radius=math.inf)
THICK = replace(PAIR, rod_radius=2.95)
REGION = RestRegion(0.1, 0.1, 0.3)
GRID = {"curvatures": [0.5], "rods": [0.2, 0.3], "lengths": [4.0, 5.0]}

CALLS = [
    (critical_corner, (PAIR, "t"), {}, ValueError, "parameter"),
    (plane_critical_formula, ("r",), {}, ValueError, "unknown"),
    (RestRegion, (2.0, 0.1, 0.3), {}, ValueError, "tilt"),
    (RestRegion, (0.1, 0.4, 0.3), {}, ValueError, "rolling"),
    (RestRegion, (0.1, 0.0, 0.3), {}, ValueError, "rolling"),
    (RestRegion, (0.1, math.nan, 0.3), {}, ValueError, "rolling"),
    (RestRegion, (0.1, 0.1, "large"), {}, TypeError, "sliding"),
    (Keel, (0.1, 0.1, 0.3, 0.2, 0.3), {}, ValueError, "rolling_dynamic, sliding_dynamic"),
    (rests, (0.0, 0.0, REGION, 1.0), {}, ValueError, "slenderness"),
    (heading_error_bar, (PAIR, {"width": 0.1}), {}, ValueError, "tolerances"),
    (heading_error_bar, (PAIR, {"length": -0.1}), {}, ValueError, "tolerances: length"),
    (heading_error_bar, (PAIR, {"length": math.inf}), {}, ValueError, "tolerances: length"),
    (heading_error_bar, (THICK, {"length": 0.1}), {}, ValueError, "pair"),
    (heading_error_bar, (PLANE, {"drum_radius": 0.1}), {}, ValueError, "tolerances"),
    (dyad_holds, (PLANE,), {}, ValueError, "pair"),
    (dyad_holds, (THICK,), {}, ValueError, "pair"),
    (dyad_holds, (PAIR, "X"), {}, ValueError, "chirality"),
    (minima_map, (), GRID | {"curvatures": [-0.1]}, ValueError, "curvatures"),
    (minima_map, (), GRID | {"rods": [0.5, 0.2]}, ValueError, "rods"),
    (minima_map, (), GRID | {"rods": [math.nan, 0.5]}, ValueError, "rods"),
    (minima_map, (), GRID | {"rods": [0.1, 0.2, 0.5]}, ValueError, "rods"),
    (minima_map, (), GRID | {"lengths": [1.5, 3.0]}, ValueError, "lengths"),
    (minima_map, (), GRID | {"lengths": []}, ValueError, "lengths"),
    (minima_map, (), GRID | {"starts": 0}, ValueError, "starts"),
    (pair_minima, (PAIR,), {"starts": 0}, ValueError, "starts"),
    (pair_minima, (PAIR,), {"starts": True}, TypeError, "starts"),
    (pair_minima, (PAIR,), {"starts": 2.5}, TypeError, "starts"),
    (pair_minima, (PAIR,), {"starts": "many"}, TypeError, "starts"),
    (pair_map, ([3, 2], [0.5]), {}, ValueError, "lengths"),
    (pair_map, ([1.9, 3], [0.5]), {}, ValueError, "lengths"),
    (pair_map, ([], [0.5]), {}, ValueError, "lengths"),
    (pair_map, ([[2, 3]], [0.5]), {}, ValueError, "lengths"),
    (pair_map, ([2, math.nan], [0.5]), {}, ValueError, "lengths"),
    (pair_map, ([2, 3], [0.0, 0.5]), {}, ValueError, "rods"),
    (pair_map, ([2, 3], [0.5, 1.0]), {}, ValueError, "rods"),
    (pair_map, ([2, 3], [0.5]), {"tolerance": 0.0}, ValueError, "tolerance"),
    (pair_map, ([2, 3], [0.5]), {"tolerance": True}, TypeError, "tolerance"),
]


@pytest.mark.parametrize(
    ("function", "given", "options", "kind", "argument"),
    CALLS,
    ids=[f"{call[0].__name__}-{call[4]}" for call in CALLS],
)
def test_the_error_names_the_argument(function, given, options, kind, argument):
    with pytest.raises(kind, match=f"^{argument}: expected "):
        function(*given, **options)

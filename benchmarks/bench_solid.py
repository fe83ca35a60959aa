"""Meshes of the forbidden solid, rounded and sharp: time, faces and deviations.

The rounded one is marching cubes on the least gap; the sharp one has mesh edges along the curves
of two contacts.  ``cut`` is the largest gap in the middle of a face, ``volume`` and ``curved`` the
relative errors of the volume against the curved volume on a grid twice as fine as the finest.

Run: ``python benchmarks/bench_solid.py [CELLS ...]``; the output is JSON.
"""

import json
import math
import sys
import time
from collections.abc import Callable

import numpy as np

from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.pictures.placements import forbidden_solid, relative_gap
from polycorner.pictures import Isosurface, isosurface

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5)
TURN = math.pi


def rounded(cells: int) -> Isosurface:
    reach = 1.02 * (PAIR.length + 2 * PAIR.ball_radius)
    bounds = ((-reach, reach), (-reach, reach), (-TURN / 2, TURN / 2))
    return isosurface(relative_gap(PAIR), bounds, (cells, cells, cells // 2), (False, False, True))


def sharp(cells: int) -> Isosurface:
    return forbidden_solid(PAIR, cells, period=TURN)


def measured(make: Callable[[int], Isosurface], cells: int, exact: float) -> dict[str, float]:
    start = time.perf_counter()
    surface = make(cells)
    seconds = time.perf_counter() - start
    middles = np.asarray(surface.mesh.triangles_center)[~surface.caps]
    found = {
        "cells": cells,
        "seconds": round(seconds, 3),
        "faces": len(surface.mesh.faces),
        "cut": float(abs(relative_gap(PAIR)(middles)).max()),
        "volume": surface.volume / exact - 1,
    }
    curved = getattr(surface, "curved_volume", None)
    return found if curved is None else found | {"curved": curved / exact - 1}


def main(cells: list[int]) -> None:
    sharp(16)  # load compiled code
    exact = forbidden_solid(PAIR, 2 * max(cells), period=TURN).curved_volume
    rows = {make.__name__: [measured(make, n, exact) for n in cells] for make in (rounded, sharp)}
    print(json.dumps({"exact": exact, **rows}, indent=2))


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]] or [24, 48, 96])

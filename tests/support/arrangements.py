"""Random placements of arrangements."""

import numpy as np
from scipy.spatial.transform import Rotation


def anywhere(a, rng):
    """Return a point at which bodies stand and are turned at random."""
    d = a.dimension
    turns = [
        None
        if a.orientations == "none"
        else rng.uniform(-3, 3)
        if d == 2
        else Rotation.random(random_state=np.random.RandomState(rng.integers(2**31)))
        for _ in a.named
    ]
    places = 2 * rng.standard_normal((len(turns), d))
    return a.point(dict(zip(a.named, zip(places, turns, strict=True), strict=True)))

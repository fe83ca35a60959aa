"""Random placements of arrangements, and what symmetries and invariants are at one."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation


def anywhere(a, rng, reach=None):
    """Return a point at which bodies stand and are turned at random.

    Positions are uniform up to ``reach``, a number or one for each axis; normal without.
    """
    d, placed = a.dimension, {}
    for name in a.named:
        if a.orientations == "none":
            turn = None
        elif d == 2:
            turn = rng.uniform(-7, 7)
        else:
            turn = Rotation.random(random_state=np.random.RandomState(rng.integers(2**31)))
        normal = reach is None
        placed[name] = (
            2 * rng.standard_normal(d) if normal else reach * rng.uniform(-1, 1, d),
            turn,
        )
    return a.point(placed)


def assert_renamed(a, elements, q):
    """Assert that each of a dozen elements carries the value of every gap to its image."""
    names, before = a.polyhedron.names, a.polyhedron.values(q)
    places = {name: k for k, name in enumerate(names)}
    for element in elements[:: max(1, len(elements) // 12)]:
        images = [places[element.names.get(name, name)] for name in names]
        assert sorted(images) == sorted(places.values())
        after = a.polyhedron.values(element.apply(q))
        assert after[images] == pytest.approx(before, abs=1e-9)


def rank_of_invariants(a, q):
    """Return in how many directions the invariants of the symmetry change."""
    h, invariants = 1e-6, a.symmetry.invariants
    ways = a.manifold.frame(q).T
    slopes = [(invariants(q + h * way) - invariants(q - h * way)) / (2 * h) for way in ways]
    return np.linalg.matrix_rank(np.array(slopes), tol=1e-4)

"""Generated landscapes whose minima, and the heights at which they are joined, are known.

Every problem comes with its answer (:class:`.known_trees.Truth`), which is computed when it is
asked for, and a map from points of the problem to coordinates of the answer.
"""

import numpy as np

from benchmarks.trials import curved_landscapes, edge_landscapes, planar_landscapes
from benchmarks.trials.known_trees import DegenerateError
from benchmarks.trials.posed_landscapes import Posed

DRAWS = (
    *planar_landscapes.DRAWS,
    *curved_landscapes.DRAWS,
    *planar_landscapes.REGIONS,
    *edge_landscapes.DRAWS,
)
TRIES = 100


def problem(seed: int, number_: int) -> Posed:
    """Return a problem by its number; the kinds come one after the other."""
    draw = DRAWS[number_ % len(DRAWS)]
    rng = np.random.default_rng([seed, number_])
    for _ in range(TRIES):
        try:
            posed = draw(rng)
            posed.truth  # noqa: B018 - it may have none
        except DegenerateError:
            continue
        return posed
    msg = f"{draw.__name__} gave no problem"
    raise RuntimeError(msg)

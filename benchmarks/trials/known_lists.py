"""Generated problems whose stationary points are known exactly, by construction.

>>> import numpy as np
>>> posed = [problem(0, number) for number in range(len(DRAWS))]
>>> len({p.kind for p in posed}) > 20, sum(len(p.points) + len(p.loci) for p in posed) > 100
(True, True)
"""

from collections.abc import Callable

import numpy as np

from benchmarks.trials import known_grids, known_loci, known_planes, known_symmetries
from benchmarks.trials.known import Posed

Draw = Callable[[np.random.Generator], Posed]
DRAWS: tuple[Draw, ...] = (
    *known_grids.DRAWS,
    *known_planes.DRAWS,
    *known_loci.DRAWS,
    *known_symmetries.DRAWS,
)
TRIES = 100


def drawn(draw: Draw, rng: np.random.Generator) -> Posed:
    """Draw until the problem can be posed with an answer."""
    for _ in range(TRIES):
        try:
            return draw(rng)
        except (ValueError, ZeroDivisionError):  # constant along a curve, curves that coincide
            continue
    msg = f"{draw.__name__} gave no problem"
    raise RuntimeError(msg)


def problem(seed: int, number: int) -> Posed:
    """Return a problem by its number; the kinds come one after the other."""
    return drawn(DRAWS[number % len(DRAWS)], np.random.default_rng([seed, number]))

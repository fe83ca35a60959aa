"""All minima of the pair in the drum from a thousand starts, and of a pinball board.

A search consists of descents, the identification of equal ends, and the certificates.  Each stage
is timed by leaving out the later ones.  SciPy's SLSQP gets a part of the same starts, without
identification and certificates; its descent counts as right if it ends in a minimum that the
search found, up to the symmetry.
"""

import statistics
from functools import partial

import numpy as np
import solvers
from side_by_side import interleave, print_table, write

from polycorner import minimise
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.minima import (
    energy_symmetry,
    pair_minima,
    scattered,
)
from polycorner.minimisation import Minima, minima
from polycorner.models import Pinball

STARTS, PART, ROUNDS = 1000, 100, 5
SAME = 1e-4  # largest scaled distance at which a point counts as the minimum
PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)


def falls(starts: np.ndarray) -> list[np.ndarray]:
    return [minimise(PAIR.polyhedron, PAIR.energy, q).point for q in starts]


def hits(ends: list[np.ndarray], found: Minima) -> int:
    """Return the number of points that are minima; G is a continuum, recognised by its energy."""
    symmetry = energy_symmetry(PAIR)
    lowest, *corners = found
    places = [symmetry.invariants(g.apply(c.point)) for c in corners for g in symmetry.group]
    right = 0
    for q in ends:
        apart = min(abs(symmetry.invariants(q) - place).max() for place in places)
        inside = PAIR.polyhedron.contains(q, tolerance=SAME)
        level = float(PAIR.energy.value(q)) - lowest.energy < SAME**2
        right += bool(apart < SAME or (inside and level))
    return right


def main() -> None:
    starts = scattered(PAIR, np.random.default_rng(1), STARTS)
    symmetry = energy_symmetry(PAIR)
    found = pair_minima(PAIR, starts=STARTS, rng=1)
    slsqp = solvers.scipy_slsqp(PAIR, found[-1].point)
    board = Pinball()
    places = board.starts(np.random.default_rng(0), STARTS)
    search = partial(minima, PAIR.polyhedron, PAIR.energy, starts=starts)
    tasks = {
        "pair, falls alone": partial(falls, starts),
        "pair, search": partial(search, symmetry=symmetry),
        "pair, search, labelled": search,
        f"pair, SLSQP, {PART} starts": lambda: [slsqp(q) for q in starts[:PART]],
        "pinball, search": partial(minima, board.polyhedron, board.energy, starts=places),
    }
    seconds = {name: statistics.median(t) for name, t in interleave(tasks, ROUNDS).items()}
    print_table("Seconds", ["", "s"], [(name, f"{s:.3f}") for name, s in seconds.items()])
    right = {
        "polycorner": hits(falls(starts[:PART]), found),
        "SciPy SLSQP": hits([slsqp(q) for q in starts[:PART]], found),
    }
    print_table(f"Descents that end in a minimum, of {PART}", ["", ""], list(right.items()))
    print(f"\n{found}")
    board_minima = minima(board.polyhedron, board.energy, starts=places)
    print(f"\nPinball: {board_minima.completeness}")
    write(
        "search",
        {
            "starts": STARTS,
            "seconds": seconds,
            f"right of {PART}": right,
            "minima": {"pair": len(found), "pinball": len(board_minima)},
        },
    )


if __name__ == "__main__":
    main()

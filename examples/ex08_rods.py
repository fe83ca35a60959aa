"""
The least length of rods
========================

The least length of rods at which a ball of one dumbbell reaches the rod of the other.

Between two lengths the corners and motions of the pair in the plane change.  Bisection on the
atlas, without a formula for the change, finds the length at which a ball touches both balls of the
other dumbbell and its rod at once, ``2 sqrt(4 r^2 - (r + t)^2)``.  Above it the atlas of the pair
has the four corners ``Delta_R``, ``Delta_L``, ``E_R``, ``E_L``; below it rods are never touched.

Run it to draw the map over length and rod radius, the atlas and its motions:
``python examples/ex08_rods.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from polycorner.dumbbells import (
    DumbbellPair,
    PairAtlas,
    PairMap,
    long_rod_length,
    pair_atlas,
    pair_map,
)

PAIR = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5)
LENGTHS, RODS = np.linspace(2, 5, 4), np.linspace(0.1, 0.9, 3)


@dataclass(frozen=True)
class Result:
    """Changes of the atlas with the length, for the rods of one pair, and the pair's atlas."""

    around: PairMap
    atlas: PairAtlas

    @property
    def bracket(self) -> tuple[float, float]:
        """Two lengths in mm between which the atlas changes."""
        low, high = PAIR.ball_radius * self.around.change_brackets[0]
        return float(low), float(high)

    @property
    def closed_form(self) -> float:
        """The length in mm predicted by the closed form."""
        return long_rod_length(PAIR.ball_radius, PAIR.rod_radius)


def main() -> Result:
    rod = PAIR.rod_radius / PAIR.ball_radius
    return Result(pair_map([2.2, 3.2], [rod], tolerance=1e-3), pair_atlas(PAIR))


def draw(result: Result, whole: PairMap, folder: Path) -> list[Path]:
    """Draw the map, the atlas and its motions into a folder."""
    from polycorner.dumbbells.pictures import draw_atlas, draw_motions, draw_pair_map
    from polycorner.pictures import save

    return [
        save(draw_atlas(result.atlas), folder / "ex08_atlas.png"),
        save(draw_motions(result.atlas), folder / "ex08_motions.png"),
        save(draw_pair_map(whole), folder / "ex08_map.png"),
    ]


if __name__ == "__main__":
    result = main()
    low, high = result.bracket
    print(f"the atlas changes between {low:.4f} and {high:.4f} mm")
    print(f"closed form                {result.closed_form:.4f} mm")
    below, above = (result.around.signatures[k] for k in result.around.change_kinds[0])
    for word, signature in (("below", below), ("above", above)):
        kinds = ", ".join(kind for kind, _ in signature.pattern.corners)
        print(f"{word}: {kinds}; corners, edges and faces {signature.pattern.counts}")
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    for path in draw(result, pair_map(LENGTHS, RODS, tolerance=0.1), folder):
        print(f"wrote {path}")

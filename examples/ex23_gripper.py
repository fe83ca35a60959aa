"""
What a gripper holds
====================

A part between the jaws of a gripper, and which theorem says that it cannot move.

A part is *immobile to first order* if no velocity agrees with all contacts (form closure): in the
plane this takes four contacts at least.  Fewer can do with the help of curvature: three fingers
against the sides of a triangle leave a rotation to first order, and hold it *to second order*,
because the triangle would have to be larger to turn.  Fingers that push off centre, like a
pinwheel, hold nothing: the part turns with the push.

The jaws are polygons with sharp edges, so the contacts of the last two grips are unions: the part
is beyond an edge of the jaw, or the jaw beyond an edge of the part.  Between flat jaws it slides.

Run it to draw the grips: ``python examples/ex23_gripper.py [FOLDER]``.
"""

import math
import sys
from pathlib import Path

import numpy as np

from polycorner.bodies import Arrangement, Body, compound, disc, polygon
from polycorner.minimisation import Immobility, immobility

R = 0.2  # radius of a finger
SQUARE = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])
TRIANGLE = polygon([[2, 0], [-1, math.sqrt(3)], [-1, -math.sqrt(3)]])


def main() -> dict[str, tuple[Arrangement, Immobility]]:
    """Return grips by name, each with what holds the part in its place."""
    around = [(-(1 + R) * math.cos(a), (1 + R) * math.sin(a)) for a in np.arange(3) * math.tau / 3]
    grips = {
        "five fingers": fingers(
            SQUARE, (-0.5, -1 - R), (0.5, -1 - R), (0, 1 + R), (-1 - R, 0.2), (1 + R, 0.2)
        ),
        "three fingers": fingers(TRIANGLE, *around),
        "pinwheel": fingers(SQUARE, (1 + R, 0.3), (-1 - R, -0.3), (0.3, -1 - R), (-0.3, 1 + R)),
        "notched jaws": Arrangement({"part": SQUARE}, fixed=notched_jaws()),
        "flat jaws": Arrangement({"part": SQUARE}, fixed=flat_jaws()),
    }
    return {name: (grip, immobility(grip.polyhedron, [0, 0, 0])) for name, grip in grips.items()}


def fingers(part: Body, *places: tuple[float, float]) -> Arrangement:
    """Return a part among round fingers."""
    return Arrangement(
        {"part": part}, fixed={f"finger{k}": disc(R, at=p) for k, p in enumerate(places, 1)}
    )


def notched_jaws() -> dict[str, Body]:
    """Return two jaws with a notch each, for opposite corners of the square."""
    long, thick = 0.8, 0.4
    below = polygon([[-1, -1], [-1 + long, -1], [-1 + long, -1 - thick], [-1, -1 - thick]])
    beside = polygon([[-1, -1], [-1, -1 + long], [-1 - thick, -1 + long], [-1 - thick, -1]])
    jaw = compound({"below": below, "beside": beside})
    return {"left": jaw, "right": jaw.moved(turn=math.pi)}


def flat_jaws() -> dict[str, Body]:
    """Return two flat jaws, between which the square slides."""
    jaw = polygon([[-0.8, -1], [0.8, -1], [0.8, -1.4], [-0.8, -1.4]])
    return {"below": jaw, "above": jaw.moved(turn=math.pi)}


def draw(grips: dict[str, tuple[Arrangement, Immobility]], folder: Path) -> list[Path]:
    from polycorner.pictures import draw_arrangement, save

    return [
        save(
            draw_arrangement(grip, [0.0, 0.0, 0.0], titles=[held.mobility.value.split(":")[0]]),
            folder / f"ex23_{name.replace(' ', '_')}.png",
        )
        for name, (grip, held) in grips.items()
    ]


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    grips = main()
    for name, (_, held) in grips.items():
        print(f"{name}: {held.mobility.value}")
    for path in draw(grips, folder):
        print(f"wrote {path}")

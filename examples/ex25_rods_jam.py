"""
Where rods jam
==============

A few rods in a square box and in a periodic one grow thicker until they jam.

Rods of given length and common radius lie in a square of side 1, with walls or with opposite sides
identified.  The radius is one more coordinate, and rods that are jammed are local maxima of it: the
best of several starts is certified.  Discs, rods of length zero, jam at radii that are known:
``1 / (2 + sqrt(2))`` for two in a box ([Specht]), ``sqrt(2) / 4`` in the periodic square ([DGKX]).
Closed forms of three other cases are derived below.

Run it to draw where they jam: ``python examples/ex25_rods_jam.py [FOLDER]``.
"""

import sys
from dataclasses import dataclass
from math import cos, radians, sqrt
from pathlib import Path

import numpy as np

from polycorner import Certificate, Polyhedron, certify, minimise
from polycorner.bodies import Arrangement, box, capsule, disc, thinned

# What jams: in a box or a periodic square, number of rods, their length, and a bound of the radius.
CASES = {
    "two discs": ("box", 2, 0.0, 0.4),
    "three discs": ("box", 3, 0.0, 0.4),
    "a rod": ("box", 1, 0.8, 0.4),
    "four rods": ("box", 4, 0.5, 0.2),
    "two periodic discs": ("periodic", 2, 0.0, 0.45),
    "three periodic discs": ("periodic", 3, 0.0, 0.4),
    "a periodic rod": ("periodic", 1, 1.6, 0.4),
    "two periodic rods": ("periodic", 2, 0.3, 0.3),
    "three periodic rods": ("periodic", 3, 0.5, 0.22),
}

# Known radii.  A rod in a box lies on the diagonal, with its ends at (r, r) and (1 - r, 1 - r).  A
# rod of length 1.6 in a periodic square lies along (2, 1): the images of its line are sqrt(1/5)
# apart, and it ends before it meets itself.  Two rods along the two diagonals end against the
# middle of each other's sides, so that sqrt(1/2) = l/2 + 2 r.
KNOWN = {
    "two discs": 1 / (2 + sqrt(2)),
    "three discs": 2 / (4 + sqrt(2) + sqrt(6)),
    "a rod": (1 - 0.8 / sqrt(2)) / 2,
    "two periodic discs": sqrt(2) / 4,
    "three periodic discs": cos(radians(75)),
    "a periodic rod": sqrt(1 / 5) / 2,
    "two periodic rods": (sqrt(2) - 0.3) / 4,
}


@dataclass(frozen=True)
class Jam:
    """Rods that jam: themselves, where they are, and the certificate of their radius."""

    rods: Arrangement
    point: np.ndarray
    radius: float
    certificate: Certificate


def main(tries: int = 12) -> dict[str, Jam]:
    """Return the thickest rods of every case, from several starts."""
    return {name: jammed(*case, tries) for name, case in CASES.items()}


def rods(kind: str, count: int, length: float, radius: float) -> Arrangement:
    """Return rods in a square."""
    rod = capsule([-length / 2, 0], [length / 2, 0], radius) if length else disc(radius)
    if kind == "box":
        return Arrangement([rod] * count, box([0, 0], [1, 1]))
    return Arrangement([rod] * count, period=[1, 1])


def jammed(kind: str, count: int, length: float, most: float, tries: int) -> Jam:
    """Return the thickest of rods that grow from thin ones in random places."""
    thick = rods(kind, count, length, most)
    whole, faster = thinned(thick), thinned(thick, excluded=False)
    rng = np.random.default_rng(0)
    t = whole.manifold.symbols[-1]
    found = [minimise(faster, t, start(thick, whole, most, rng)).point for _ in range(tries)]
    best = min((q for q in found if whole.contains(q, tolerance=1e-9)), key=lambda q: q[-1])
    radius = most - float(best[-1])
    return Jam(rods(kind, count, length, radius), best[:-1], radius, certify(whole, t, best))


def start(
    thick: Arrangement, whole: Polyhedron, most: float, rng: np.random.Generator
) -> np.ndarray:
    """Return thin rods in random places that do not cross."""
    while True:
        places = {name: (rng.random(2), rng.uniform(0, 2 * np.pi)) for name in thick.named}
        q = np.append(thick.point(places), most - 0.01)
        if whole.contains(q):
            return q


def draw(found: dict[str, Jam], folder: Path) -> list[Path]:
    from polycorner.pictures import draw_arrangement, save

    return [
        save(draw_arrangement(jam.rods, jam.point), folder / f"ex25_{name.replace(' ', '_')}.png")
        for name, jam in found.items()
    ]


if __name__ == "__main__":
    found = main()
    for name, jam in found.items():
        known = f", known {KNOWN[name]:.9f}" if name in KNOWN else ""
        print(f"{name}: radius {jam.radius:.9f}{known}, {jam.certificate.verdict.name}")
    for path in draw(found, Path(sys.argv[1] if len(sys.argv) > 1 else "out")):
        print(f"wrote {path}")

"""
A jammed packing
================

Discs of two sizes in a periodic box, inflated until they jam.

The positions of the discs and their common inflation ``s`` are a point; that no two discs overlap
makes a polyhedron with a function for every pair of neighbours.  A jammed packing is a corner at
which ``s`` cannot grow, and its contact forces are the multipliers of ``-s``.  There are exactly as
many contacts as coordinates, so the forces are unique: one state of self-stress.

Run it to draw the network of forces: ``python examples/ex18_packing.py [FOLDER]``.
"""

import sys
from pathlib import Path

from polycorner.models import JammedPacking, PeriodicPacking


def main(count: int = 256) -> JammedPacking:
    """Return a jammed packing of discs whose radii have the ratio 1.4."""
    return PeriodicPacking.bidisperse(count).jam(1)


def draw(packing: JammedPacking, path: Path) -> Path:
    """Draw the discs and the forces between them."""
    from polycorner.pictures import draw_packing, save

    return save(draw_packing(packing), path)


if __name__ == "__main__":
    jammed = main()
    print(jammed)
    print(f"{len(jammed.pairs)} contacts, {jammed.isostatic_number} make it isostatic")
    print(f"smallest force {jammed.forces.min() / jammed.forces.mean():.2e} of the mean")
    print(f"largest residual {jammed.residuals.worst:.1e}")
    print(jammed.certificate.explain())
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    print(f"wrote {draw(jammed, folder / 'ex18_packing.png')}")

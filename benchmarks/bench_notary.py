"""Best known packings, from their tables to proofs and checked files.

For every table: what is proved, to first or second order, how wide the energy's bounds are, how
many circles rattle, and the processor time of the proof, of saving it, and of the checker.
``python benchmarks/bench_notary.py`` takes all; ``square:20 sum:26 torus:14`` some.
"""

import argparse
import tempfile
from fractions import Fraction
from pathlib import Path
from time import process_time
from typing import Any

from side_by_side import print_table, write

from polycorner import certify, prove
from polycorner.models import CirclesIn, read_coordinates
from polycorner.proofs.checker.verdict import check

DATA = Path(__file__).parent.parent / "examples" / "data"
COLUMNS = ("table", "statement", "width", "rattle", "prove", "save", "check", "as")


def tables() -> dict[str, tuple[CirclesIn, Any]]:
    """Return models and points by name."""
    found = {}
    for name, kind, region in (
        ("circles_in_square.csv", "square", "square"),
        ("seven_circles_on_torus.csv", "torus", "torus"),
    ):
        rows = read_coordinates(DATA / name, index=False).floats
        for k in sorted(set(rows[:, 0].tolist())):
            centres = rows[rows[:, 0] == k][:, 2:]
            model = CirclesIn(region, len(centres))
            found[f"{kind}:{int(k)}"] = model, model.point(centres)
    table = read_coordinates(DATA / "26_circles.csv").floats
    model = CirclesIn("square", len(table), equal=False)
    return found | {f"sum:{len(table)}": (model, model.point(table[:, :2]))}


def measured(model: CirclesIn, point: Any) -> dict[str, Any]:
    """Prove one table, save the proof and check the file."""
    certificate = certify(model.polyhedron, model.energy, point)
    times, begun = [], process_time()
    proof = prove(certificate, symmetry=model.symmetry)
    times.append(process_time() - begun)
    said = "not proved"
    if proof.proved:
        low, high = map(Fraction, proof.enclosures["energy"])
        with tempfile.TemporaryDirectory() as folder:
            begun = process_time()
            file = proof.save(Path(folder) / "proof.zip")
            times.append(process_time() - begun)
            begun = process_time()
            said = check(str(file), None, 1)
            times.append(process_time() - begun)
    return {
        "statement": proof.statement.split(",")[0] if proof.proved else "none",
        "width": float(high - low) if proof.proved else None,
        "rattle": len(proof.room) // 2,
        "seconds": times,
        "checker": said,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="tables, such as square:20")
    every = tables()
    chosen = parser.parse_args().names or list(every)
    figures = {name: measured(*every[name]) for name in chosen}
    rows = []
    for name, f in figures.items():
        times = [f"{x:.2f}" for x in f["seconds"]]
        short = {True: "strict", False: "between"}[f["statement"].startswith("strict")]
        seen = "strict" if "strict local minimum" in f["checker"] else "between"
        rows.append([name, short, f"{f['width']:.0e}", str(f["rattle"]), *times, seen])
    print_table("Best known packings: seconds of processor time", COLUMNS, rows)
    write("notary", {"tables": figures})


if __name__ == "__main__":
    main()

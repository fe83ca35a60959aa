"""``polycorner prove``: a place of rest of the pair, proved in interval arithmetic."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import (
    deliver,
    fail,
    output_options,
    patience,
    prepare,
    write_answer,
    writing,
)
from polycorner.dumbbells.cli.options import chosen_pair, pair_settings, parameters

if TYPE_CHECKING:
    from polycorner.proofs.proof import Proof

EPILOG = """\b
Examples:
  polycorner prove
  polycorner prove --drum inf --digits 100 --json
  polycorner prove --box t=1.2:1.8 --box l=14:18 --out out
"""
WORDS = "proving (a box of parameters can take minutes)"
# Parameters that formulas contain as they are; the others enter through R - r.
BOXES = {"l": "l", "length": "l", "t": "t", "rod": "t"}
UNITS = {"l": "length l (mm)", "t": "rod radius t (mm)"}


@click.command(epilog=EPILOG)
@pair_settings
@click.option("--digits", type=int, default=30, help="Significant digits, 1 to 10000. [30]")
@click.option(
    "--box",
    "boxes",
    multiple=True,
    metavar="NAME=LOW:HIGH",
    help="Prove it for all t or l in an interval; may be given for both.",
)
@click.option(
    "--minimum",
    type=click.Choice(["delta_R", "delta_L", "G"]),
    default="delta_R",
    help="Which place of rest. [delta_R]",
)
@output_options
def prove(
    digits: int, boxes: tuple[str, ...], minimum: str, as_json: bool, out: Path | None,
    **options: float | None,
) -> None:  # fmt: skip
    """Prove that a place of rest is a local minimum, and enclose it."""
    pair = chosen_pair(None, options)
    region = _region(boxes)
    prepare(out)
    with patience(WORDS):
        from polycorner.dumbbells import dyad_minima
        from polycorner.proofs.proof import prove as established

        (entry,) = [found for found in dyad_minima(pair) if found.name == minimum]
        try:
            proof = established(entry.certificate, digits=digits, parameters=region or None)
        except ValueError as error:
            fail(f"--{error}" if str(error).startswith("digits") else f"--box: {error}")
        answer = {
            "minimum": minimum,
            "parameters": parameters(pair),
            "box": {name: list(sides) for name, sides in region.items()},
            **_answer(proof),
        }

    def write() -> list[Path]:
        return [] if out is None else _write(proof, answer, out)

    deliver(answer, lambda: _print(answer, proof), write, as_json=as_json)


def _print(answer: dict[str, Any], proof: "Proof") -> None:
    click.echo(f"{answer['minimum']}\n{proof}")
    for angle in ("theta1", "theta2"):
        if f"{angle}_deg" in answer["enclosures"]:
            lower, upper = answer["enclosures"][f"{angle}_deg"]
            click.echo(f"{angle} in degrees: [{lower}, {upper}]")


def _region(boxes: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    region: dict[str, tuple[float, float]] = {}
    for written in boxes:
        name, _, sides = written.partition("=")
        low, _, high = sides.partition(":")
        if name not in BOXES:
            fail(f"--box: expected t or l, as in t=1.4:1.6; got {written!r}")
        try:
            region[BOXES[name]] = (float(low), float(high))
        except ValueError:
            fail(f"--box: expected two numbers, as in t=1.4:1.6; got {written!r}")
    return region


def _answer(proof: "Proof") -> dict[str, Any]:
    import sympy

    enclosures = {name: list(sides) for name, sides in proof.enclosures.items()}
    symbols = {s.name: s for s in proof.certificate.problem.polyhedron.manifold.symbols}
    for angle in ("theta1", "theta2") if enclosures else ():
        enclosures[f"{angle}_deg"] = list(proof.enclose(symbols[angle] * 180 / sympy.pi))
    return {
        "proved": proof.proved,
        "proved_fraction": proof.proved_fraction,
        "conditions": {name: str(status) for name, status in proof.conditions.items()},
        "reasons": dict(proof.reasons),
        "active": list(proof.active),
        "modulo": list(proof.symmetry),
        "digits": proof.digits,
        "enclosures": enclosures,
        "cells": len(proof.cells),
        "undecided": [
            {name: list(sides) for name, sides in cell.parameters.items()}
            for cell in proof.undecided
        ],
    }


def _write(proof: "Proof", answer: dict[str, Any], out: Path) -> list[Path]:
    written = [write_answer(answer, out, "proof.json")]
    if proof.cells:
        from polycorner.pictures import parameter_boxes as cells
        from polycorner.pictures import style as plots

        with writing(out):
            written.append(plots.save(cells.draw_cells(proof, UNITS), out / "cells.png"))
    return written

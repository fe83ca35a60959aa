"""``polycorner prove``: a minimum of the pair, proved in interval arithmetic."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli import (
    command,
    deliver,
    digits_option,
    examples,
    fail,
    option,
    output_options,
    prepare,
    read_interval,
    shown,
    working,
    write_answer,
    writing,
)
from polycorner.dumbbells.cli.options import chosen_pair, pair_options, parameters

if TYPE_CHECKING:
    from polycorner.proofs import Proof
    from polycorner.toolkit import Sheet

EPILOG = examples(
    "prove", "prove --drum inf --digits 100 --json", "prove --box t=1.49:1.51 --box l=15.9:16.1"
)
# Parameters that stand in the formulas; the others enter through R - r.
BOXES = {"l": "l", "length": "l", "t": "t", "rod": "t"}
UNITS = {"l": "length l (mm)", "t": "rod radius t (mm)"}


@command(epilog=EPILOG)
@pair_options
@digits_option
@option(
    "--box",
    "boxes",
    multiple=True,
    metavar="NAME=LOW:HIGH",
    group="Proof",
    help="Prove it for all rod radii t or lengths l in an interval, mm; repeat for both.",
)
@option(
    "--minimum",
    type=click.Choice(["delta_R", "delta_L", "G"]),
    default="delta_R",
    group="Proof",
    help="The minimum to prove.",
)
@output_options
def prove(
    digits: int, boxes: tuple[str, ...], minimum: str, as_json: bool, out: Path | None,
    **options: float,
) -> None:  # fmt: skip
    """Prove that a point is a local minimum, and enclose it.

    A box of parameters can take minutes.
    """
    pair = chosen_pair(options)
    region = _region(boxes)
    prepare(out)
    with working("proving"):
        from polycorner.dumbbells import dyad_minima
        from polycorner.proofs import prove as proved

        (entry,) = [found for found in dyad_minima(pair) if found.name == minimum]
        try:
            proof = proved(entry.certificate, digits=digits, parameters=region or None)
        except ValueError as error:
            fail(f"--{error}" if str(error).startswith("digits") else f"--box: {error}")
        answer = {
            "minimum": minimum,
            "parameters": parameters(pair),
            "box": {name: list(sides) for name, sides in region.items()},
            **_answer(proof),
        }
    deliver(
        answer,
        lambda: shown(_sheet(answer, proof)),
        lambda folder: _write(proof, answer, folder),
        as_json=as_json,
        out=out,
    )


def _sheet(answer: dict[str, Any], proof: "Proof") -> "Sheet":
    from polycorner.toolkit import Sheet, Table

    degrees = Table(
        ("angle in degrees", "lower bound", "upper bound"),
        tuple(
            (angle, *answer["enclosures"][f"{angle}_deg"])
            for angle in ("theta1", "theta2")
            if f"{angle}_deg" in answer["enclosures"]
        ),
        (1, 2),
    )
    return Sheet(answer["minimum"], (*proof.sheet.parts, degrees))


def _region(boxes: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    region: dict[str, tuple[float, float]] = {}
    for written in boxes:
        name, low, high = read_interval("--box", written, "t=1.4:1.6")
        if name not in BOXES:
            fail(f"--box: expected t or l, as in t=1.4:1.6; got {written!r}")
        if BOXES[name] in region:
            fail(f"--box: expected one for {name}; got another one, {written!r}")
        region[BOXES[name]] = low, high
    return region


def _answer(proof: "Proof") -> dict[str, Any]:
    import sympy

    enclosures = {name: list(sides) for name, sides in proof.enclosures.items()}
    symbols = {s.name: s for s in proof.certificate.problem.polyhedron.manifold.symbols}
    for angle in ("theta1", "theta2") if enclosures else ():
        enclosures[f"{angle}_deg"] = list(proof.enclose(symbols[angle] * 180 / sympy.pi))
    return {
        "proved": proof.proved,
        "statement": proof.statement,
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
        from polycorner.pictures import draw_cells, save

        with writing(out):
            written.append(save(draw_cells(proof, UNITS), out / "cells.png"))
    return written

"""``polycorner minima``: local minima found from many starts, and an estimate of those missed."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.lazy import group
from polycorner.cli.options import Command, added, examples, option, output_options, seed_option
from polycorner.cli.output import deliver, prepare, shown, working, write_answer

if TYPE_CHECKING:
    from polycorner.minimisation import Certificate, Minima
    from polycorner.printing import Sheet

WORDS = "minimising"


@group("minima", "minima dyad --starts 300", "minima pinball --starts 200")
def minima() -> None:
    """List the local minima of a model, found from many starts."""


def start_options(function: Command) -> Command:
    """Add ``--starts``, ``--seed`` and the options of every answer."""
    starts = option(
        "--starts", type=click.IntRange(min=1), default=1000, group="Search",
        help="Number of starts.",
    )  # fmt: skip
    return added(function, starts, seed_option("the starts"), output_options)


@minima.command(epilog=examples("minima pinball --starts 200 --seed 1"))
@start_options
def pinball(starts: int, seed: int, as_json: bool, out: Path | None) -> None:
    """Find the equilibria of balls on a board with pins, wedges and cups."""
    prepare(out)
    with working(WORDS, "starts") as progress:
        import numpy as np

        from polycorner.minimisation import minima as search
        from polycorner.models import Pinball

        board = Pinball()
        points = board.starts(np.random.default_rng(seed), starts)
        found = search(board.polyhedron, board.energy, starts=points, progress=progress)

    def described(certificate: "Certificate") -> dict[str, Any]:
        return {"name": " ".join(certificate.active)}

    report_minima("pinball", {}, found, described, "", as_json=as_json, out=out)


def report_minima(
    model: str,
    chosen: dict[str, Any],
    found: "Minima",
    described: "Callable[[Certificate], dict[str, Any]]",
    unit: str,
    *,
    as_json: bool,
    out: Path | None,
) -> None:
    """Print minima and write their file.

    ``described`` returns the entries that only this model's minima have, their ``name`` among them;
    ``unit`` is that of the energy and may be empty.
    """
    richness = found.richness
    rows = [
        {
            **described(certificate),
            "energy": certificate.energy,
            "count": count,
            "active": list(certificate.active),
            "signature": list(certificate.signature),
            "verdict": certificate.verdict.value,
            "point": certificate.point.tolist(),
        }
        for certificate, count in zip(found, found.counts, strict=True)
    ]
    answer = {
        "model": model,
        "parameters": chosen,
        "starts": found.starts,
        "energy_unit": unit,
        # Minima of equal energy differ in their last digits, which is no order.
        "minima": sorted(rows, key=lambda row: (float(f"{row['energy']:.9g}"), row["name"])),
        "elsewhere": {verdict.value: count for verdict, count in found.elsewhere.items()},
        "estimate": richness.estimate,
        "interval": list(richness.interval),
        "coverage": richness.coverage,
        "completeness": found.completeness,
        "interrupted": found.interrupted,
    }
    deliver(
        answer,
        lambda: shown(_sheet(answer)),
        lambda folder: [write_answer(answer, folder, "minima.json")],
        as_json=as_json,
        out=out,
    )
    if found.interrupted:
        raise click.exceptions.Exit(130)


def _sheet(answer: dict[str, Any]) -> "Sheet":
    from polycorner.printing import Sheet, Table

    headings = any("heading_deg" in row for row in answer["minima"])
    energy = f"energy ({answer['energy_unit']})" if answer["energy_unit"] else "energy"
    head = ("minimum", *["heading (deg)"] * headings, energy, "starts", "active", "(p, q, r)")
    rows = tuple(
        (
            row["name"],
            *[", ".join(f"{x:.3f}" for x in row.get("heading_deg", ()))] * headings,
            f"{row['energy']:.9f}",
            str(row["count"]),
            " ".join(row["active"]) or "none",
            "({}, {}, {})".format(*row["signature"]),
        )
        for row in answer["minima"]
    )
    numbers = (1 + headings, 2 + headings)
    others = (
        f"{count} starts did not end in a minimum: {verdict}"
        for verdict, count in answer["elsewhere"].items()
    )
    return Sheet("", (Table(head, rows, numbers), *others, answer["completeness"]))

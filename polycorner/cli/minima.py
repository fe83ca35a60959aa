"""``polycorner minima``: every place of rest that many falls find, and how many may be unseen."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import (
    Command,
    chosen_pair,
    deliver,
    fail,
    output_options,
    pair_options,
    parameters,
    patience,
    write_answer,
)

if TYPE_CHECKING:
    from polycorner.minima.certificate import Certificate
    from polycorner.minima.search import Minima

EPILOG = """\b
Examples:
  polycorner minima dyad
  polycorner minima dyad --rod 0.3 --starts 5000 --json
  polycorner minima pinball
"""
WORDS = "falling (the first run on a machine compiles for about 20 seconds)"


@click.group(epilog=EPILOG, no_args_is_help=True)
def minima() -> None:
    """Let many starts fall and list the places where they come to rest."""


def fall_options(command: Command) -> Command:
    """Add ``--starts`` and ``--seed``, and what every answer is written with."""
    command = click.option("--seed", type=int, default=0, help="Seed of the starts. [0]")(command)
    command = click.option("--starts", type=int, default=1000, help="How many fall. [1000]")(
        command
    )
    return output_options(command)


@minima.command()
@pair_options
@fall_options
def dyad(
    config: Path | None, starts: int, seed: int, as_json: bool, out: Path | None,
    **options: float | None,
) -> None:  # fmt: skip
    """Find where two dumbbells rest, up to shifts and relabelling."""
    pair = chosen_pair(config, options)
    _check(starts, seed)
    with patience(WORDS):
        from polycorner.studies.pair_minima import kind_of, pair_minima

        found = pair_minima(pair, starts=starts, rng=seed)
    _report("dyad", parameters(pair), found, kind_of, as_json=as_json, out=out)


@minima.command()
@fall_options
def pinball(starts: int, seed: int, as_json: bool, out: Path | None) -> None:
    """Find where balls rest on a board with pins, wedges and cups."""
    _check(starts, seed)
    with patience(WORDS):
        import numpy as np

        from polycorner.minima.search import minima as search
        from polycorner.models import Pinball

        board = Pinball()
        points = board.starts(np.random.default_rng(seed), starts)
        found = search(board.polyhedron, board.energy, starts=points)
    _report("pinball", {}, found, lambda c: " ".join(c.active), as_json=as_json, out=out)


def _check(starts: int, seed: int) -> None:
    if starts < 1:
        fail(f"--starts: expected a positive whole number; got {starts}")
    if seed < 0:
        fail(f"--seed: expected a whole number not below 0; got {seed}")


def _report(
    model: str, chosen: dict[str, Any], found: "Minima", name: "Callable[[Certificate], str]",
    *, as_json: bool, out: Path | None,
) -> None:  # fmt: skip
    richness = found.richness
    answer = {
        "model": model,
        "parameters": chosen,
        "starts": found.starts,
        "minima": [
            {
                "name": name(certificate),
                "energy": certificate.energy,
                "count": count,
                "active": list(certificate.active),
                "signature": list(certificate.signature()),
                "verdict": certificate.verdict.value,
                "point": certificate.point.tolist(),
            }
            for certificate, count in zip(found, found.counts, strict=True)
        ],
        "elsewhere": {verdict.value: count for verdict, count in found.elsewhere.items()},
        "estimate": richness.estimate,
        "interval": list(richness.interval),
        "coverage": richness.coverage,
        "completeness": found.completeness,
        "interrupted": found.interrupted,
    }
    written = [write_answer(answer, out, "minima.json")] if out is not None else []
    deliver(answer, lambda: _print(answer), written, as_json=as_json)
    if found.interrupted:
        raise click.exceptions.Exit(130)


def _print(answer: dict[str, Any]) -> None:
    import sys

    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(width=None if sys.stdout.isatty() else 120, highlight=False)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("minimum", "energy", "starts", "active", "(p, q, r)"):
        table.add_column(title)
    for row in answer["minima"]:
        signature = "({}, {}, {})".format(*row["signature"])
        active = " ".join(row["active"]) or "none"
        table.add_row(row["name"], f"{row['energy']:.9f}", str(row["count"]), active, signature)
    console.print(table)
    for verdict, count in answer["elsewhere"].items():
        console.print(f"{count} starts ended elsewhere: {verdict}")
    console.print(answer["completeness"])

"""``polycorner minima``: every place of rest that many falls find, and how many may be unseen."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import (
    deliver,
    fail,
    output_options,
    patience,
    prepare,
    seed_option,
    settings_option,
    write_answer,
)
from polycorner.cli.manner import Command, console
from polycorner.dumbbells.cli.options import chosen_pair, pair_settings, parameters

if TYPE_CHECKING:
    from polycorner.minimisation import Certificate, Minima

EPILOG = """\b
Examples:
  polycorner minima dyad
  polycorner minima pinball
"""
DYAD = """\b
Examples:
  polycorner minima dyad --starts 300
  polycorner minima dyad --rod 0.3 --starts 5000 --json
"""
PINBALL = """\b
Examples:
  polycorner minima pinball
  polycorner minima pinball --starts 200 --seed 1 --json
"""
WORDS = "falling (the first run on a machine compiles for about 20 seconds)"


@click.group(epilog=EPILOG, no_args_is_help=True)
def minima() -> None:
    """Let many starts fall and list the places where they come to rest."""


def fall_options(command: Command) -> Command:
    """Add ``--starts`` and ``--seed``, and what every answer is written with."""
    starts = click.option("--starts", type=int, default=1000, help="How many fall. [1000]")
    return starts(seed_option("the starts")(output_options(command)))


@minima.command(epilog=DYAD)
@pair_settings
@fall_options
def dyad(starts: int, seed: int, as_json: bool, out: Path | None, **options: float | None) -> None:
    """Find where two dumbbells rest, up to shifts and relabelling."""
    pair = chosen_pair(None, options)
    _check(starts, out)
    with patience(WORDS):
        from polycorner.dumbbells.statics.minima_map import kind_of, pair_minima

        found = pair_minima(pair, starts=starts, rng=seed)
    _report("dyad", parameters(pair), found, kind_of, as_json=as_json, out=out)


@minima.command(epilog=PINBALL)
@settings_option
@fall_options
def pinball(starts: int, seed: int, as_json: bool, out: Path | None) -> None:
    """Find where balls rest on a board with pins, wedges and cups."""
    _check(starts, out)
    with patience(WORDS):
        import numpy as np

        from polycorner.minimisation import minima as search
        from polycorner.models import Pinball

        board = Pinball()
        points = board.starts(np.random.default_rng(seed), starts)
        found = search(board.polyhedron, board.energy, starts=points)
    _report("pinball", {}, found, lambda c: " ".join(c.active), as_json=as_json, out=out)


def _check(starts: int, out: Path | None) -> None:
    if starts < 1:
        fail(f"--starts: expected a positive whole number; got {starts}")
    prepare(out)


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
                "signature": list(certificate.signature),
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

    def write() -> list[Path]:
        return [] if out is None else [write_answer(answer, out, "minima.json")]

    deliver(answer, lambda: _print(answer), write, as_json=as_json)
    if found.interrupted:
        raise click.exceptions.Exit(130)


def _print(answer: dict[str, Any]) -> None:
    from rich import box
    from rich.table import Table

    terminal = console()
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("minimum", "energy", "starts", "active", "(p, q, r)"):
        table.add_column(title)
    for row in answer["minima"]:
        signature = "({}, {}, {})".format(*row["signature"])
        active = " ".join(row["active"]) or "none"
        table.add_row(row["name"], f"{row['energy']:.9f}", str(row["count"]), active, signature)
    terminal.print(table)
    for verdict, count in answer["elsewhere"].items():
        terminal.print(f"{count} starts ended elsewhere: {verdict}")
    terminal.print(answer["completeness"])

"""``polycorner verify``: saved proofs, lists and diagrams, checked by a program of its own."""

from pathlib import Path

import click

from polycorner.cli.options import command, config_option, examples, option
from polycorner.cli.output import deliver, working


@command(epilog=examples("verify proof.zip", "verify list.zip --sample 1000 --jobs 2"))
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=click.Path(path_type=Path)
)
@option(
    "--sample",
    type=click.IntRange(min=1),
    group="Check",
    help="Check so many leaves of a list or a box, drawn at random. [all]",
)
@option("--jobs", type=click.IntRange(min=1), default=1, group="Check", help="Number of processes.")
@option("--json", "as_json", is_flag=True, group="Output", help="Print JSON, not tables.")
@config_option
def verify(files: tuple[Path, ...], sample: int | None, jobs: int, as_json: bool) -> None:
    """Check proofs, complete lists and bifurcation diagrams that were saved as FILE.

    The checker shares no code with what proves.  The exit code is 1 if a file is not verified.
    """
    from polycorner.proofs.checker.verdict import judged

    rows = []
    for file in files:
        with working(f"checking {file.name}"):
            verified, words = judged(str(file), sample, jobs)
        rows.append({"file": str(file), "verified": verified, "verdict": words})
    named = len(rows) > 1
    deliver(
        rows,
        lambda: "\n".join(f"{row['file']}: " * named + str(row["verdict"]) for row in rows),
        as_json=as_json,
    )
    if not all(row["verified"] for row in rows):
        raise click.exceptions.Exit(1)

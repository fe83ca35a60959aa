"""An atlas as a table in the terminal."""

from typing import TYPE_CHECKING, Any

from polycorner.cli.manner import console

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


COUNTS = {
    "components": "components of the strata",
    "components_ordered": "for ordered pairs of dumbbells whose balls are alike",
    "components_unordered": "for unordered pairs",
}


def keys(counts: dict[int, int]) -> dict[str, int]:
    """Return counts by dimension as JSON has them."""
    return {str(dimension): count for dimension, count in sorted(counts.items())}


def print_answer(answer: dict[str, Any]) -> None:
    """Print an answer as a table for people."""
    if "critical" in answer:
        console().print(_critical(answer))
    else:
        _print_atlas(console(), answer)


def _critical(answer: dict[str, Any]) -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in answer["critical"][0]:
        table.add_column(title, justify="right")
    for row in answer["critical"]:
        table.add_row(f"{row['radius']:.9f}", *(str(row[k]) for k in list(row)[1:]))
    return table


def _print_atlas(terminal: "Console", answer: dict[str, Any]) -> None:
    for key, words in COUNTS.items():
        if key in answer:
            counts = ", ".join(f"{n} of dimension {d}" for d, n in answer[key].items())
            terminal.print(f"{words}: {counts}")
    if "singular_count" in answer:
        terminal.print(
            f"{answer['corners_count']} rigid clusters ({answer['singular_count']} singular), "
            f"{answer['edges_count']} one-dimensional motions"
        )
    if answer["corners"]:
        terminal.print(_corners(answer))
    terminal.print(f"Euler characteristic: {answer['euler_characteristic']}")
    terminal.print(f"complete: {answer['complete']}")
    for note in answer["notes"]:
        terminal.print(f"note: {note}")


def _corners(answer: dict[str, Any]) -> "Table":
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for title in ("corner", "active", "rank", "type", "edges to"):
        table.add_column(title)
    edges = answer["edges"]
    for k, corner in enumerate(answer["corners"]):
        ends = [e["ends"] for e in edges if k in e["ends"]]
        others = [b if a == k else a for a, b in ends]
        reached = ", ".join("-" if other is None else str(other) for other in others)
        active = " ".join(corner["active"])
        shown = active if len(active) < 60 else f"{len(corner['active'])} contacts"
        kind = corner["local_type"] + (", singular" if corner["singular"] else "")
        table.add_row(f"{k} {corner['name']}", shown, str(corner["rank"]), kind, reached)
    return table

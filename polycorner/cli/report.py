"""Tables of atlases for the terminal."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from polycorner.printing import Sheet, Table

COUNTS = {
    "components": "components of the strata",
    "components_ordered": "for ordered pairs of dumbbells whose balls are alike",
    "components_unordered": "for unordered pairs",
}
MOST = 60  # characters of the active functions of a corner; above it only their number is shown


def keys(counts: dict[int, int]) -> dict[str, int]:
    """Return counts by dimension with the keys of JSON."""
    return {str(dimension): count for dimension, count in sorted(counts.items())}


def label(corner: int | None) -> str:
    """Return the name of a corner by its position, ``-`` where an edge has no corner at an end."""
    return "-" if corner is None else f"C{corner}"


def atlas_sheet(answer: dict[str, Any]) -> "Sheet":
    """Return an atlas as a sheet."""
    from polycorner.printing import Sheet

    parts: list[Table | str] = [f"{words}: {_counts(answer[key])}" for key, words in _told(answer)]
    if "singular_count" in answer:
        parts.append(
            f"{answer['corners_count']} rigid clusters ({answer['singular_count']} singular), "
            f"{answer['edges_count']} one-dimensional motions"
        )
    characteristic = answer["euler_characteristic"]
    if characteristic is None:
        characteristic = (
            "not determined (it takes a finished search and closed faces bounded by finite edges)"
        )
    return Sheet(
        "",
        (
            *parts,
            _corners(answer),
            f"Euler characteristic: {characteristic}",
            f"complete: {answer['complete']}",
            *(f"note: {note}" for note in answer["notes"]),
        ),
    )


def critical_sheet(answer: dict[str, Any]) -> "Sheet":
    """Return the critical configurations of disks as a sheet."""
    from polycorner.printing import Sheet, Table

    head = ("radius", "index", "nullity", "contacts", "hits")
    rows = (
        (f"{row['radius']:.9f}", *(str(row[key]) for key in head[1:])) for row in answer["critical"]
    )
    caption = "Critical radii, in units of the torus's side"
    table = Table(head, tuple(rows), tuple(range(len(head))), caption)
    return Sheet("", (table, f"complete: {answer['complete']}"))


def _told(answer: dict[str, Any]) -> list[tuple[str, str]]:
    return [(key, words) for key, words in COUNTS.items() if key in answer]


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{n} of dimension {d}" for d, n in counts.items())


def _corners(answer: dict[str, Any]) -> "Table":
    from polycorner.printing import Table

    kinds = any("kind" in corner for corner in answer["corners"])
    head = ("corner", *["kind"] * kinds, "active", "rank", "type", "edges to")
    return Table(
        head,
        tuple(
            (
                corner["name"],
                *[corner.get("kind", "")] * kinds,
                _active(corner["active"]),
                str(corner["rank"]),
                corner["local_type"] + (", singular" if corner["singular"] else ""),
                ", ".join(map(label, _reached(k, answer["edges"]))),
            )
            for k, corner in enumerate(answer["corners"])
        ),
    )


def _active(names: list[str]) -> str:
    shown = " ".join(names)
    return shown if len(shown) < MOST else f"{len(names)} contacts"


def _reached(corner: int, edges: list[dict[str, Any]]) -> list[int | None]:
    """Return the other ends of the edges at a corner."""
    ends = [edge["ends"] for edge in edges if corner in edge["ends"]]
    return [b if a == corner else a for a, b in ends]

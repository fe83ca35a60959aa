"""``polycorner landscape``: minima, the passes between them, and how high these are."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import wraps
from itertools import combinations, permutations
from math import inf, isfinite, nextafter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.lazy import group
from polycorner.cli.options import added, examples, option, output_options
from polycorner.cli.output import (
    deliver,
    naming,
    prepare,
    shown,
    timed,
    working,
    write_answer,
    writing,
)

if TYPE_CHECKING:
    from polycorner.landscapes import Barrier, Landscape, Minimum, Pass
    from polycorner.pictures.landscapes import Draw
    from polycorner.polyhedra.polyhedron import Polyhedron
    from polycorner.printing import Sheet

    Ways = Mapping[tuple[int, int], Barrier]

FLAGS = {"cap": "--cap", "max_boxes": "--max-boxes", "max_seconds": "--seconds"}
WORDS = "searching"
OUTSIDE = "outside"
LEAN = 50  # across the board for a height of one
MARGIN = 0.1  # of a board's box beyond its walls
MOST, MOST_BARRIERS = 4, 12  # numbers of passes in a row, and barriers in a table


@group(
    "landscape", "landscape dyad", "landscape dyad --rod 1 --json", "landscape pinball --out out"
)
def landscape() -> None:
    """Tell over which passes the minima of a model are left, and how high these are."""


def landscape_options(function: Callable[..., None]) -> Callable[..., None]:
    """Add ``--cap``, ``--max-boxes``, ``--seconds`` and the options of every answer.

    The command gets the first three as ``limits``: those that were given, as arguments of
    :func:`polycorner.landscapes.landscape`.
    """

    @wraps(function)
    def command(
        cap: float | None, max_boxes: int | None, seconds: float | None, **own: Any
    ) -> None:
        given = {"cap": cap, "max_boxes": max_boxes, "max_seconds": seconds}
        limits = {name: value for name, value in given.items() if value is not None}
        function(limits=limits, **own)

    return added(
        command,
        option(
            "--cap", type=float, metavar="E", group="Search",
            help="Height up to which passes are sought. [all]",
        ),
        option(
            "--max-boxes", type=click.IntRange(min=1), group="Search",
            help="Most boxes of a list. [that of the library]",
        ),
        option(
            "--seconds", type=click.FloatRange(min=0, min_open=True), group="Search",
            metavar="S", help="Most seconds of a list; what it leaves undecided is said.",
        ),
        output_options,
    )  # fmt: skip


@landscape.command(epilog=examples("landscape pinball --cap 3 --out out"))
@landscape_options
def pinball(limits: dict[str, Any], as_json: bool, out: Path | None) -> None:
    """Say over which edges balls on a board roll from one pocket into another.

    The board leans to the left by a fiftieth, so that its floor has a lowest point.
    """
    prepare(out)
    with working(WORDS, "boxes") as progress:
        from polycorner.models import Pinball

        board = Pinball()
        x, y = board.manifold.symbols
        box = [(-MARGIN, size + MARGIN) for size in (board.width, board.height)]
        energy = y + x / LEAN
        found = searched(board.polyhedron, energy, box=box, progress=progress, **limits)
    report_landscape("pinball", {}, found, Telling(), as_json=as_json, out=out)


def searched(polyhedron: "Polyhedron", energy: Any, **options: Any) -> "Landscape":
    """Return the landscape, or end the command with what is wrong.

    Proved in a ``box``, or found from ``starts``.
    """
    from polycorner.landscapes import landscape as proved
    from polycorner.landscapes import search_landscape

    with naming(FLAGS):
        search = search_landscape if "starts" in options else proved
        return search(polyhedron, energy, **options)


@dataclass(frozen=True)
class Telling:
    """How a landscape is told.

    Attributes
    ----------
    unit : str
        Of heights.
    height : callable
        The height of an energy, to within the last bit; it increases.
    names : callable
        The name of a minimum by its number.
    pictures : callable or None
        What draws a configuration, as for :func:`~polycorner.pictures.draw_landscape`.
    """

    unit: str = ""
    height: Callable[[float], float] | None = None
    names: "Callable[[Landscape], list[str]] | None" = None
    pictures: "Draw | None" = None

    def bounds(self, low: float, high: float) -> list[float]:
        """Return bounds of a height from those of an energy."""
        if self.height is None:
            return [low, high]
        return [
            nextafter(self.height(low), -inf) if isfinite(low) else low,
            nextafter(self.height(high), inf) if isfinite(high) else high,
        ]

    def rise(self, start: "Minimum", rise: tuple[float, float]) -> list[float]:
        """Return bounds of the rise of the height from those of the energy."""
        if self.height is None:
            return list(rise)
        least, most = nextafter(start.energy[1] + rise[0], -inf), start.energy[0] + rise[1]
        low, high = self.bounds(least, nextafter(most, inf))
        below, above = self.bounds(*start.energy)
        return [max(nextafter(low - above, -inf), 0.0), nextafter(high - below, inf)]


def report_landscape(
    model: str,
    chosen: Mapping[str, Any],
    found: "Landscape",
    telling: Telling,
    *,
    as_json: bool,
    out: Path | None,
) -> None:
    """Print a landscape and write its files: the answer, the landscape itself and figures."""
    names = telling.names(found) if telling.names else [str(k) for k in range(len(found.minima))]
    ways = {(a, b): found.barrier(a, b) for a, b in permutations(range(len(names)), 2)}
    answer = {
        "model": model,
        "parameters": dict(chosen),
        "energy_unit": telling.unit,
        "complete": found.complete,
        "statement": found.statement,
        "minima": [
            {
                "name": name,
                **_place(telling, found.minima[some[0]], some),
                "depth": telling.rise(found.minima[some[0]], found.depth(some[0])),
            }
            for name, some in _alike(names)
        ],
        "passes": [
            _pass(telling, found, some, names)
            for _, some in _alike((p.kind, p.orbit) for p in found.passes)
        ],
        "barriers": list(_barriers(telling, found, ways, names)),
        "notes": list(found.notes),
    }
    deliver(
        answer,
        lambda: shown(_sheet(answer)),
        lambda folder: _write(found, answer, names, telling, folder),
        as_json=as_json,
        out=out,
    )


def _alike(keys: Iterable[Any]) -> list[tuple[Any, list[int]]]:
    """Return the numbers of things that have the same key: images of each other."""
    numbers: dict[Any, list[int]] = {}
    for k, key in enumerate(keys):
        numbers.setdefault(key, []).append(k)
    return [*numbers.items()]


def _place(telling: Telling, one: "Minimum | Pass", some: list[int]) -> dict[str, Any]:
    bounds = telling.bounds(*one.energy)
    return {
        "numbers": some,
        "energy": (bounds[0] + bounds[1]) / 2,
        "bounds": bounds,
        "kind": one.kind,
        "active": list(one.active),
        "point": one.point.tolist(),
    }


def _pass(
    telling: Telling, found: "Landscape", some: list[int], names: list[str]
) -> dict[str, Any]:
    p = found.passes[some[0]]
    sides = [None if s.minimum is None else _named(s.minimum, names) for s in p.sides]
    return {
        **_place(telling, p, some),
        "index": p.index,
        "loop": all(k in found.loops for k in some),
        "sides": sides,
        "verified": bool(p.sides) and all(side.verified for side in p.sides),
    }


def _named(minimum: int, names: list[str]) -> str:
    return OUTSIDE if minimum < 0 else names[minimum]


def _barriers(
    telling: Telling, found: "Landscape", ways: "Ways", names: list[str]
) -> Iterator[dict[str, Any]]:
    """Yield the lowest barrier between minima of each two names, and out of a region."""
    numbers = _alike(names)
    for (start, some), (end, others) in combinations(numbers, 2):
        # From the higher one to the lower one, whose numbers are smaller.
        between = [ways[b, a] for a in some for b in others]
        yield _barrier(telling, found, (end, start), between)
    for start, some in numbers if found.region else ():
        yield _barrier(telling, found, (start, OUTSIDE), [found.escape(k) for k in some])


def _barrier(
    telling: Telling, found: "Landscape", ends: tuple[str, str], ways: "list[Barrier]"
) -> dict[str, Any]:
    best = min(ways, key=lambda way: way.upper)
    low, high = telling.bounds(min(way.lower for way in ways), best.upper)
    rises = [telling.rise(found.minima[way.start], way.rise) for way in ways]
    return {
        "from": ends[0],
        "to": ends[1],
        "lower": low,
        "upper": high,
        "rise": [min(sides) for sides in zip(*rises, strict=True)],
        "proved": best.proved,
        "verified": best.route is not None and best.route.verified,
        "passes": list(best.passes),
    }


def _write(
    found: "Landscape", answer: dict[str, Any], names: list[str], telling: Telling, out: Path
) -> list[Path]:
    from polycorner.files import save_landscape
    from polycorner.pictures import draw_landscape, save

    unit = f" ({telling.unit})" if telling.unit else ""
    label = f"{'energy' if telling.height is None else 'height'}{unit}"
    with writing(out), timed("drawing"):
        figure = draw_landscape(
            found, pictures=telling.pictures, names=names, height=telling.height, label=label
        )
        return [
            write_answer(answer, out, "landscape.json"),
            save_landscape(found, out / "saved_landscape.json"),
            save(figure, out / "landscape.png"),
        ]


def _sheet(answer: dict[str, Any]) -> "Sheet":
    from polycorner.printing import Sheet, Table

    energy = f"energy ({answer['energy_unit']})" if answer["energy_unit"] else "energy"
    minima = [
        (
            *(row["name"], str(len(row["numbers"])), f"{row['energy']:.9f}"),
            *(_between(row["depth"]), row["kind"], " ".join(row["active"]) or "none"),
        )
        for row in answer["minima"]
    ]
    passes = [
        (
            *(_some(row["numbers"]), f"{row['energy']:.9f}", row["kind"] + " (loop)" * row["loop"]),
            "?" if row["index"] is None else str(row["index"]),
            ", ".join(side or "?" for side in row["sides"]) or "?",
            " ".join(row["active"]) or "none",
        )
        for row in answer["passes"]
        if row["kind"] != "undecided"
    ]
    barriers = [
        (row["from"], row["to"], _between([row["lower"], row["upper"]]), _between(row["rise"]))
        for row in answer["barriers"]
    ]
    if len(barriers) > MOST_BARRIERS:
        barriers = []  # the tree says the same in fewer lines
    tables = [
        Table(("minimum", "images", energy, "depth", "kind", "active"), tuple(minima), (1, 2, 3)),
        Table(("pass", energy, "kind", "index", "sides", "active"), tuple(passes), (1, 3)),
        Table(("from", "to", energy.replace("energy", "over"), "rise"), tuple(barriers), (2, 3)),
    ]
    return Sheet(
        "",
        (
            *(t for t in tables if t.rows),
            *_undecided(answer),
            *answer["notes"],
            answer["statement"],
        ),
    )


def _undecided(answer: dict[str, Any]) -> Iterator[str]:
    some = [row["bounds"] for row in answer["passes"] if row["kind"] == "undecided"]
    if some:
        low, high = min(low for low, _ in some), max(high for _, high in some)
        yield f"{len(some)} boxes are not decided, of energies from {low:.9f} to {high:.9f}."


def _some(numbers: list[int]) -> str:
    shown = " ".join(map(str, numbers[:MOST]))
    return shown if len(numbers) <= MOST else f"{shown} ..."


def _between(bounds: list[float]) -> str:
    """Return bounds as one number where they agree to nine decimals."""
    return " to ".join(dict.fromkeys(f"{x:.9f}" for x in bounds))

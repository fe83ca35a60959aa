"""``polycorner branches``: equilibria over a parameter, and the events at which they change."""

from collections.abc import Callable, Mapping
from functools import partial, wraps
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from polycorner.cli.lazy import group
from polycorner.cli.options import added, option, output_options, read_interval
from polycorner.cli.output import (
    deliver,
    fail,
    naming,
    save_proof,
    shown,
    timed,
    working,
    write_answer,
    writing,
)

if TYPE_CHECKING:
    from polycorner.branches import BranchProof, Diagram, Hysteresis
    from polycorner.minimisation import Certificate
    from polycorner.pictures.branches import Height
    from polycorner.polyhedra.symmetry import Symmetry

WORDS = "following equilibria"
FLAGS = {
    "interval": "--vary",
    "parameters": "--vary",
    "certificate": "start",
    "max_arcs": "--max-arcs",
    "max_seconds": "--seconds",
}


class Vary(NamedTuple):
    """A parameter and the interval in which it varies."""

    name: str
    low: float
    high: float


class Asked(NamedTuple):
    """What is asked for beside the diagram: the loop, and proofs."""

    loop: bool
    prove: bool


@group(
    "branches",
    "branches dyad --vary rod=2:2.95",
    "branches dyad --vary length=14:18 --loop --json",
)
def branches() -> None:
    """Follow equilibria of a model over a parameter, through all events."""


def branch_options(function: Callable[..., None]) -> Callable[..., None]:
    """Add ``--vary``, ``--loop``, ``--prove``, ``--max-arcs``, ``--seconds`` and those of answers.

    The command gets ``--vary`` as a :class:`Vary`, the next two as ``asked``, and the last two as
    ``limits``: those that were given, as arguments of :func:`polycorner.branches.branches`.
    """

    @wraps(function)
    def command(
        vary: str, loop: bool, prove: bool, max_arcs: int | None, seconds: float | None, **own: Any
    ) -> None:
        given = {"max_arcs": max_arcs, "max_seconds": seconds}
        limits = {name: value for name, value in given.items() if value is not None}
        function(vary=read_vary(vary), asked=Asked(loop, prove), limits=limits, **own)

    return added(
        command,
        option(
            "--vary", required=True, metavar="NAME=LOW:HIGH", group="Parameter",
            help="The parameter, and the interval that is covered.",
        ),
        option(
            "--loop", is_flag=True, group="Parameter",
            help="Follow a quasi-static system from LOW to HIGH and back, too.",
        ),
        option(
            "--prove", is_flag=True, group="Parameter",
            help="Prove arcs and events, and that there are no others in a box of the file.",
        ),
        option(
            "--max-arcs", type=click.IntRange(min=1), group="Search",
            help="Most arcs. [that of the library]",
        ),
        option(
            "--seconds", type=click.FloatRange(min=0, min_open=True), group="Search",
            metavar="S", help="Most seconds; what they leave open is said.",
        ),
        output_options,
    )  # fmt: skip


def read_vary(written: str) -> Vary:
    """Return the parameter and the interval of ``--vary``, or end the command."""
    name, low, high = read_interval("--vary", written, "rod=2:2.95")
    if not (name and isfinite(low) and isfinite(high) and low < high):
        fail(f"--vary: expected NAME=LOW:HIGH with LOW less than HIGH; got {written!r}")
    return Vary(name, low, high)


def followed(certificates: "list[Certificate]", parameter: Any, *args: Any, **options: Any) -> Any:
    """Return the diagram of equilibria, or end the command with what is wrong."""
    from polycorner.branches import branches as follow

    with naming(FLAGS):
        return follow(certificates, parameter, *args, **options)


def report_branches(  # noqa: PLR0913 - what is told, and how
    model: str,
    chosen: Mapping[str, Any],
    found: "Diagram",
    *,
    asked: Asked,
    as_json: bool,
    out: Path | None,
    symmetry: "Symmetry | None" = None,
    box: Any = None,
    height: "Height" = "",
    label: str = "",
) -> None:
    """Print a diagram and write its files: the answer, the diagram itself, proof and figure.

    ``height`` and ``label`` are those of :func:`~polycorner.pictures.draw_branches`, and ``box``
    is that of :func:`~polycorner.branches.prove_branches`.
    """
    from polycorner.branches import hysteresis, prove_branches

    proof = way = None
    if asked.prove:
        with working("proving arcs and events", "arcs") as progress:
            try:
                proof = prove_branches(found, box=box, symmetry=symmetry, progress=progress)
            except ValueError as error:
                fail(f"--prove: {str(error).removeprefix('diagram: ')}")
    if asked.loop:
        with working("following the loop", "legs") as progress:
            try:
                way = hysteresis(found, symmetry=symmetry, progress=progress)
            except ValueError as error:
                fail(f"--loop: {str(error).removeprefix('path: ')}")
    answer = {
        "model": model,
        "parameters": dict(chosen),
        "vary": {"name": found.parameter, "from": found.interval[0], "to": found.interval[1]},
        "energy_unit": found.problem.energy.unit,
        "closed": found.closed,
        "arcs": [
            {
                found.parameter: arc.parameters.tolist(),
                "active": list(arc.active),
                "index": arc.index,
                "stable": arc.stable,
                "events": list(arc.events),
                "energies": arc.energies.tolist(),
                "multipliers": {name: lam.tolist() for name, lam in arc.multipliers.items()},
                "points": arc.points.tolist(),
            }
            for arc in found.arcs
        ],
        "events": [
            {
                found.parameter: event.parameter,
                "kind": event.kind.name.lower(),
                "functions": list(event.functions),
                "before": list(event.before),
                "after": list(event.after),
                "index": [found.arcs[k].index for k in event.arcs],
                "arcs": list(event.arcs),
                "point": event.point.tolist(),
                "note": event.note,
            }
            for event in found.events
        ],
    }
    if way is not None:
        answer["loop"] = _loop(way)

    archives: list[Path] = []
    if proof is not None:
        answer["proof"] = told = _proof(proof)
        if out is not None:
            with working("checking the proof", "boxes") as progress:
                archive = out / "branches.proof.zip"
                archives = save_proof(proof, archive, told, progress=progress)

    def write(folder: Path) -> list[Path]:
        from polycorner.files import save_diagram
        from polycorner.pictures import draw_branches, save

        with writing(folder), timed("drawing"):
            figure = draw_branches(found, height, label=label, loop=way)
            return [
                write_answer(answer, folder, "branches.json"),
                save_diagram(found, folder / "saved_branches.json"),
                *archives,
                save(figure, folder / "branches.png"),
            ]

    sheets = [found.sheet, *(part.sheet for part in (proof, way) if part is not None)]
    text = partial("\n\n".join, map(shown, sheets))
    deliver(answer, text, write, as_json=as_json, out=out)


def _proof(proof: "BranchProof") -> dict[str, Any]:
    return {
        "word": proof.word,
        "arcs": list(proof.arcs),
        "events": list(proof.events),
        proof.diagram.parameter: [list(sides) for sides in proof.parameters],
        "searched": proof.searched,
        "open": len(proof.open_boxes),
    }


def _loop(way: "Hysteresis") -> dict[str, Any]:
    return {
        "closed": way.closed,
        "work": way.work,
        "released": way.released,
        "jumps": [
            {
                way.diagrams[0].parameter: jump.parameter,
                "kind": jump.kind.name.lower(),
                "before": list(jump.before),
                "after": list(jump.after),
                "start": jump.start.tolist(),
                "end": jump.end.tolist(),
                "released": jump.released,
            }
            for jump in way.jumps
        ],
        "note": way.note,
    }

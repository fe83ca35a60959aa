"""Searches that are saved as they go, resumed, and reported as tables."""

import hashlib
from collections.abc import Callable, Iterator, Mapping
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.options import added, option, output_options, seed_option
from polycorner.cli.output import (
    deliver,
    fail,
    prepare,
    remark,
    shown,
    timed,
    unfinished,
    working,
    write_answer,
    writing,
)

if TYPE_CHECKING:
    from polycorner.container import FileKind
    from polycorner.models import CriticalConfiguration, CriticalSearch, TorusDisks
    from polycorner.polyhedra.polyhedron import Polyhedron
    from polycorner.polyhedra.symmetry import Symmetry
    from polycorner.printing import Sheet, Table
    from polycorner.skeletons.elements import Skeleton

COUNTS = {
    "components": "components of the strata",
    "components_ordered": "for ordered pairs of dumbbells whose balls are alike",
    "components_unordered": "for unordered pairs",
}
MOST = 60  # characters of the active functions of a corner; above it only their number is shown
SEARCH = ("out", "seed", "budget", "workers", "resume", "as_json")
RESUMING = """
A search is saved every few seconds.  Ctrl-C ends it and reports what was found (exit code 130);
the same command with --resume continues it, also after the process was killed.
"""
Begin = Callable[[str, dict[str, Any]], "SkeletonSearch"]
resume_option = option(
    "--resume",
    is_flag=True,
    group="Search",
    help="Continue a search that was stopped, killed or out of budget.",
)


def search_options(function: Callable[..., None]) -> Callable[..., None]:
    """Add ``--seed``, ``--budget``, ``--workers``, ``--resume`` and the options of every answer.

    The command gets them as ``begin``, which returns the search of a model and its parameters.
    """

    @wraps(function)
    def command(**given: Any) -> None:
        own = {name: value for name, value in given.items() if name not in SEARCH}
        options = {name: given[name] for name in SEARCH}
        function(begin=partial(SkeletonSearch, **options), **own)

    return added(
        command,
        seed_option("the random directions"),
        option(
            "--budget", type=click.IntRange(min=1), default=100_000, group="Search",
            help="Most edges to trace.",
        ),
        option(
            "--workers", type=click.IntRange(min=1), group="Search",
            help="Processes that walk along edges. [this one]",
        ),
        resume_option,
        output_options,
    )  # fmt: skip


class Kept:
    """A search with the file of its state and its report.

    An unfinished search is kept in the folder of the answer, or in the cache where there is none.

    Attributes
    ----------
    finished, interrupted, drawn : bool
        Whether nothing is left to do, whether Ctrl-C ended the search, and whether its result is
        fit for pictures.
    """

    def __init__(
        self,
        model: str,
        chosen: dict[str, Any],
        *,
        out: Path | None,
        seed: int,
        resume: bool,
        as_json: bool,
    ) -> None:
        self.model, self.parameters, self.out, self.seed = model, chosen, out, seed
        self.resume, self.as_json = resume, as_json
        prepare(out)
        self.finished, self.interrupted, self.drawn = True, False, True
        self._unsaved: OSError | None = None

    @property
    def label(self) -> str:
        """The name of the search in its file."""
        return repr((self.model, sorted(self.parameters.items()), self.seed))

    @property
    def state(self) -> Path:
        """The file that keeps an unfinished search."""
        if self.out is not None:
            return self.out / "atlas-state.json"
        from polycorner.formulas.cache import cache_folder

        return cache_folder() / f"atlas-{hashlib.sha256(self.label.encode()).hexdigest()[:16]}.json"

    def has_kept(self) -> bool:
        """Whether there is something to resume, as asked; else say that the search begins."""
        if self.resume and not self.state.exists():
            remark(f"nothing to resume in {self.state}; the search starts from the beginning")
        return self.resume and self.state.exists()

    def keep(self, save: Callable[[], object]) -> None:
        """Save the state; a failure is reported after the answer, which it must not cost."""
        try:
            save()
        except OSError as error:
            self._unsaved = error
        else:
            self._unsaved = None

    def end(self, *, finished: bool, interrupted: bool) -> None:
        """Note how the search ended; the state of a finished one is removed."""
        self.finished = self.drawn = finished
        self.interrupted = interrupted
        if finished:
            self.state.unlink(missing_ok=True)

    def finish(
        self,
        answer: dict[str, Any],
        draw: Callable[[Path], list[Path]],
        sheet: "Callable[[dict[str, Any]], Sheet] | None" = None,
        name: str = "atlas.json",
    ) -> None:
        """Print the answer, write the files, and end the process if it was interrupted."""

        def write(folder: Path) -> Iterator[Path]:
            yield write_answer(answer, folder, name)
            if self.drawn:
                with writing(folder), timed("drawing"):
                    yield from draw(folder)

        def text() -> str:
            return shown((sheet or atlas_sheet)(answer))

        deliver(answer, text, write, as_json=self.as_json, out=self.out)
        if not self.finished:
            with writing(self.state):
                if self._unsaved is not None:
                    raise self._unsaved
            unfinished(self.state)
        if self.interrupted:
            raise click.exceptions.Exit(130)


class SkeletonSearch(Kept):
    """A search for corners, edges and faces."""

    def __init__(
        self,
        model: str,
        chosen: dict[str, Any],
        *,
        budget: int,
        workers: int | None,
        **options: Any,
    ) -> None:
        super().__init__(model, chosen, **options)
        self.budget, self.workers = budget, workers

    def run(
        self,
        polyhedron: "Polyhedron",
        starts: Callable[[Any], Any],
        symmetry: "Symmetry | None",
    ) -> "Skeleton":
        """Search, or resume; return also what an interruption left."""
        import numpy as np

        from polycorner import skeletons
        from polycorner.skeletons.parts import Completeness

        resume = self.has_kept()
        with working(f"searching {self.model}", "edges") as progress:
            options: dict[str, Any] = {
                "budget": self.budget,
                "executor": self.workers,
                "progress": progress,
                "keep": self._save,
            }
            if resume:
                found = skeletons.resume(self._load(polyhedron, symmetry), **options)
            else:
                rng = np.random.default_rng(self.seed)
                found = skeletons.skeleton(
                    polyhedron, starts(rng), symmetry=symmetry, rng=rng, **options
                )
        interrupted = found.complete is Completeness.INTERRUPTED
        unfinished = interrupted or found.complete is Completeness.BUDGET
        if unfinished:
            self._save(found)
        self.end(finished=not unfinished, interrupted=interrupted)
        return found

    def _save(self, found: "Skeleton") -> None:
        from polycorner.files import save_skeleton

        self.keep(lambda: save_skeleton(found, self.state, label=self.label))

    def _load(self, polyhedron: "Polyhedron", symmetry: "Symmetry | None") -> "Skeleton":
        from polycorner.files import load_skeleton

        try:
            return load_skeleton(self.state, polyhedron, symmetry=symmetry, label=self.label)
        except ValueError as error:
            fail(f"--resume: {error}")

    def answer(
        self, found: "Skeleton", extra: dict[str, Any], kinds: list[str] | None = None
    ) -> dict[str, Any]:
        """Return the atlas as JSON."""
        corners = [
            {
                "name": label(k),
                **({} if kinds is None else {"kind": kinds[k]}),
                "active": list(corner.active),
                "rank": corner.rank,
                "dimension": corner.stratum.dimension,
                "local_type": corner.local_type.name.lower(),
                "chirality": corner.chirality,
                "singular": corner.singular,
                "point": corner.point.tolist(),
            }
            for k, corner in enumerate(found.corners)
        ]
        edges = [
            {
                "ends": list(edge.ends),
                "active": list(edge.active),
                "length": edge.length,
                "kinds": [kind.name.lower() for kind in edge.kinds],
            }
            for edge in found.edges
        ]
        faces = [
            {
                "active": list(face.active),
                "boundary": [list(curve) for curve in face.boundary],
                "closed": face.closed,
            }
            for face in found.faces
        ]
        return {
            "model": self.model,
            "parameters": self.parameters,
            "components": counts_by_dimension(found.components),
            **extra,
            "corners": corners,
            "edges": edges,
            "faces": faces,
            "euler_characteristic": found.euler_characteristic,
            "complete": found.complete.name.lower(),
            "notes": list(found.notes),
        }


class DiskSearch(Kept):
    """A search for the critical radii of disks, saved after every round."""

    def run(self, model: "TorusDisks") -> "tuple[CriticalConfiguration, ...]":
        """Search, or resume; an interruption loses the round under way only."""
        from polycorner.container import JSON, FileKind

        kind = FileKind("search of disks", "polycorner atlas disks", JSON)
        resume = self.has_kept()
        with working(f"searching {self.model}", "rounds") as progress:
            search = self._load(model, kind) if resume else model.critical_search(self.seed)
            try:
                while not search.complete:
                    search = search.advanced()
                    entries = {"label": self.label, "search": search.record}
                    self.keep(partial(kind.save_json, self.state, entries))
                    progress(search.rounds, None, f"{len(search.configurations)} found")
            except KeyboardInterrupt:
                if not search.rounds:
                    raise
        self.end(finished=search.complete, interrupted=not search.complete)
        return search.configurations

    def _load(self, model: "TorusDisks", kind: "FileKind") -> "CriticalSearch":
        from polycorner.models import CriticalSearch

        try:
            content = kind.load_json(self.state)
            if content["label"] != self.label:
                fail(f"--resume: expected a search with the same options in {self.state}")
            return CriticalSearch.restored(model, content["search"])
        except (ValueError, LookupError, TypeError) as error:
            fail(f"--resume: {error}")


# ------------------------------------------------------------------------------------------ tables


def counts_by_dimension(counts: Mapping[int, int]) -> dict[str, int]:
    """Return counts by dimension with the keys of JSON."""
    return {str(dimension): count for dimension, count in sorted(counts.items())}


def label(corner: int | None) -> str:
    """Return the name of a corner by its position, ``-`` where an edge has no corner at an end."""
    return "-" if corner is None else f"C{corner}"


def atlas_sheet(answer: dict[str, Any]) -> "Sheet":
    """Return an atlas as a sheet."""
    from polycorner.printing import Sheet, Table

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

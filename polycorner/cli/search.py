"""Searches that are saved as they go, resumed, and reported."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

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
from polycorner.cli.report import atlas_sheet, keys, label

if TYPE_CHECKING:
    from polycorner.container import FileKind
    from polycorner.models import CriticalConfiguration, CriticalSearch, TorusDisks
    from polycorner.polyhedra.polyhedron import Polyhedron
    from polycorner.polyhedra.symmetry import Symmetry
    from polycorner.printing import Sheet
    from polycorner.skeletons.elements import Skeleton
    from polycorner.workers import Workers

SAVED_EVERY = 10.0  # seconds between two savings of a long search
SEARCHING = 10.0  # seconds of search, at least, for each second that savings take


class Kept:
    """A search with the file of its state and its report.

    Parameters
    ----------
    model : str
        Name of the model.
    chosen : dict
        Its parameters.
    out : path, optional
        Folder of the answer, where an unfinished search is kept too; else it is kept in the cache.
    seed : int
        Seed of whatever is random.

    Attributes
    ----------
    finished, interrupted, drawn : bool
        Whether nothing is left to do, whether Ctrl-C ended the search, and whether its result is
        fit for pictures.
    """

    def __init__(self, model: str, chosen: dict[str, Any], out: Path | None, seed: int) -> None:
        self.model, self.parameters, self.out, self.seed = model, chosen, out, seed
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

    def has_kept(self, *, resume: bool) -> bool:
        """Whether there is something to resume, as asked; else say that the search begins."""
        if resume and not self.state.exists():
            remark(f"nothing to resume in {self.state}; the search starts from the beginning")
        return resume and self.state.exists()

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
        *,
        as_json: bool,
        draw: Callable[[Path], list[Path]],
        sheet: "Callable[[dict[str, Any]], Sheet]" = atlas_sheet,
    ) -> None:
        """Print the answer, write the files, and end the process if it was interrupted."""

        def write() -> Iterator[Path]:
            if self.out is not None:
                yield write_answer(answer, self.out, "atlas.json")
                if self.drawn:
                    with writing(self.out), timed("drawing"):
                        yield from draw(self.out)

        deliver(answer, lambda: shown(sheet(answer)), write, as_json=as_json)
        if not self.finished:
            with writing(self.state):
                if self._unsaved is not None:
                    raise self._unsaved
            unfinished(self.state)
        if self.interrupted:
            raise click.exceptions.Exit(130)


class SkeletonSearch(Kept):
    """A search for corners, edges and faces.

    Parameters
    ----------
    budget : int
        The most edges to trace.
    workers : int, optional
        Processes that walk along edges; default this one.
    """

    def __init__(
        self, model: str, chosen: dict[str, Any], out: Path | None, seed: int, budget: int,
        workers: int | None = None,
    ) -> None:  # fmt: skip
        super().__init__(model, chosen, out, seed)
        self.budget, self.workers = budget, workers
        self._seconds = SAVED_EVERY

    def run(
        self,
        polyhedron: "Polyhedron",
        starts: Callable[[Any], Any],
        symmetry: "Symmetry | None",
        *,
        resume: bool,
    ) -> "Skeleton":
        """Search, or resume, saving by the clock; return also what an interruption left."""
        import numpy as np

        from polycorner.skeletons import Budget, skeleton
        from polycorner.skeletons import resume as resumed
        from polycorner.skeletons.parts import Completeness

        known, resume = 0, self.has_kept(resume=resume)
        with (
            self._opened() as executor,
            working(f"searching {self.model}", "edges") as progress,
        ):
            begun = monotonic()
            if resume:
                found = self._load(polyhedron, symmetry)
                known = len(found.edges)
            else:
                rng = np.random.default_rng(self.seed)
                found = skeleton(
                    polyhedron,
                    starts(rng),
                    symmetry=symmetry,
                    budget=Budget(self.budget, self._seconds),
                    executor=executor,
                    progress=progress,
                    rng=rng,
                )
            while resume or found.complete is Completeness.BUDGET:
                resume = False
                self._save(found)
                self._seconds = max(SAVED_EVERY, self._longer(monotonic() - begun))
                left = self.budget - (len(found.edges) - known)
                if left < 1:
                    break
                limits, begun = Budget(left, self._seconds), monotonic()
                found = resumed(found, budget=limits, executor=executor, progress=progress)
        interrupted = found.complete is Completeness.INTERRUPTED
        unfinished = interrupted or found.complete is Completeness.BUDGET
        if unfinished:
            self._save(found)
        self.end(finished=not unfinished, interrupted=interrupted)
        return found

    def _opened(self) -> "AbstractContextManager[Workers | None]":
        from polycorner.workers import opened

        return nullcontext() if self.workers is None else opened(self.workers)

    def _longer(self, taken: float) -> float:
        """Return the time to search for after a search, its assembly and saving took some time."""
        return SEARCHING * max(0.0, taken - self._seconds)

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
            "components": keys(dict(found.components)),
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

    def run(self, model: "TorusDisks", *, resume: bool) -> "tuple[CriticalConfiguration, ...]":
        """Search, or resume; an interruption loses the round under way only."""
        from polycorner.container import JSON, FileKind

        kind = FileKind("search of disks", "polycorner atlas disks", JSON)
        resume = self.has_kept(resume=resume)
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

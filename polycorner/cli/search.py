"""One search for an atlas: progress, saving, going on, and the answer."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import (
    deliver,
    fail,
    prepare,
    progress_bar,
    unfinished,
    write_answer,
    writing,
)
from polycorner.cli.manner import timed
from polycorner.cli.report import keys, print_answer

if TYPE_CHECKING:
    from polycorner.polyhedra.polyhedron import Polyhedron
    from polycorner.polyhedra.symmetry import Symmetry
    from polycorner.progress import Progress
    from polycorner.skeletons.elements import Skeleton


# Seconds between two savings of a long search.
SAVED_EVERY = 10.0


class Search:
    """One search with its progress bar, its savings and its report."""

    def __init__(
        self, model: str, chosen: dict[str, Any], out: Path | None, seed: int, budget: int
    ) -> None:
        if budget < 1:
            fail(f"--budget: expected a positive number of edges; got {budget}")
        self.model, self.parameters, self.out = model, chosen, out
        self.seed, self.budget = seed, budget
        prepare(out)
        self.finished, self.interrupted, self.drawn = True, False, True

    @property
    def label(self) -> str:
        """What the search is called in a file."""
        return repr((self.model, sorted(self.parameters.items()), self.seed))

    @property
    def state(self) -> Path:
        """Where an unfinished search is kept."""
        if self.out is not None:
            return self.out / "atlas-state.json"
        from polycorner.formulas.cache import cache_folder

        return cache_folder() / f"atlas-{hashlib.sha256(self.label.encode()).hexdigest()[:16]}.json"

    def run(
        self,
        polyhedron: "Polyhedron",
        starts: Callable[[Any], Any],
        symmetry: "Symmetry | None",
        *,
        resume: bool,
    ) -> "Skeleton":
        """Search, or resume, saving by the clock; also what an interrupted search found."""
        import numpy as np

        from polycorner.files import save_skeleton
        from polycorner.skeletons import Budget, skeleton
        from polycorner.skeletons import resume as resumed
        from polycorner.skeletons.elements import Completeness

        known = 0
        with self.patience() as progress:
            if resume:
                found = self._load(polyhedron, symmetry)
                known = len(found.edges)
            else:
                rng = np.random.default_rng(self.seed)
                found = skeleton(
                    polyhedron,
                    starts(rng),
                    symmetry=symmetry,
                    budget=Budget(self.budget, SAVED_EVERY),
                    progress=progress,
                    rng=rng,
                )
            while resume or found.complete is Completeness.BUDGET:
                resume = False
                save_skeleton(found, self.state, label=self.label)
                left = self.budget - (len(found.edges) - known)
                if left < 1:
                    break
                found = resumed(found, budget=Budget(left, SAVED_EVERY), progress=progress)
        self.finished = found.complete not in (Completeness.BUDGET, Completeness.INTERRUPTED)
        if self.finished:
            self.state.unlink(missing_ok=True)
        else:
            save_skeleton(found, self.state, label=self.label)
        self.drawn = self.finished
        self.interrupted = found.complete is Completeness.INTERRUPTED
        return found

    def _load(self, polyhedron: "Polyhedron", symmetry: "Symmetry | None") -> "Skeleton":
        from polycorner.files import load_skeleton

        if not self.state.exists():
            fail("--resume: expected an unfinished search with the same options; got none")
        try:
            return load_skeleton(self.state, polyhedron, symmetry=symmetry, label=self.label)
        except ValueError as error:
            fail(f"--resume: {error}")

    @contextmanager
    def patience(self) -> "Iterator[Progress | None]":
        """Show a bar with rate and estimate on a terminal, nothing in a pipe."""
        begun = perf_counter()
        with timed(f"searching {self.model}"), progress_bar(self.model) as change:
            if change is None:
                yield None
                return

            def progress(done: float, total: float | None, note: str, /) -> None:
                pace = done / (perf_counter() - begun)
                left = f", {(total - done) / pace:.0f} s left" if total and done else ""
                change(
                    completed=done,
                    total=total,
                    description=f"{self.model}: {note}",
                    note=f"{pace:.0f}/s{left}",
                )

            yield progress

    def answer(
        self, found: "Skeleton", extra: dict[str, Any], names: list[str] | None = None
    ) -> dict[str, Any]:
        """Return what is printed as JSON."""
        labels = names or [f"C{k}" for k in range(len(found.corners))]
        return {
            "model": self.model,
            "parameters": self.parameters,
            "components": keys(dict(found.components)),
            **extra,
            "corners": [
                {
                    "name": label,
                    "active": list(corner.active),
                    "rank": corner.rank,
                    "dimension": corner.stratum.dimension,
                    "local_type": corner.local_type.name.lower(),
                    "chirality": corner.chirality,
                    "singular": corner.singular,
                    "point": corner.point.tolist(),
                }
                for label, corner in zip(labels, found.corners, strict=True)
            ],
            "edges": [
                {
                    "ends": list(edge.ends),
                    "active": list(edge.active),
                    "length": edge.length,
                    "kinds": [kind.name.lower() for kind in edge.kinds],
                }
                for edge in found.edges
            ],
            "faces": [
                {
                    "active": list(face.active),
                    "boundary": [list(curve) for curve in face.boundary],
                    "closed": face.closed,
                }
                for face in found.faces
            ],
            "euler_characteristic": found.euler_characteristic,
            "complete": found.complete.name.lower(),
            "notes": list(found.notes),
        }

    def finish(
        self,
        answer: dict[str, Any],
        *,
        as_json: bool,
        draw: Callable[[Path], list[Path]] | None = None,
    ) -> None:
        """Print the answer, write the files, and end the process if it was interrupted."""

        def write() -> Iterator[Path]:
            if self.out is not None:
                yield write_answer(answer, self.out, "atlas.json")
                with writing(self.out), timed("drawing"):
                    yield from draw(self.out) if draw is not None and self.drawn else []

        deliver(answer, lambda: print_answer(answer), write, as_json=as_json)
        if not self.finished:
            unfinished(self.state)
        if self.interrupted:
            raise click.exceptions.Exit(130)

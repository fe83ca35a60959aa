"""A search for an atlas that is saved as it goes, resumed, and reported."""

import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.output import (
    deliver,
    fail,
    prepare,
    shown,
    timed,
    unfinished,
    working,
    write_answer,
    writing,
)
from polycorner.cli.report import atlas_sheet, keys, label

if TYPE_CHECKING:
    from polycorner.polyhedra.polyhedron import Polyhedron
    from polycorner.polyhedra.symmetry import Symmetry
    from polycorner.printing import Sheet
    from polycorner.skeletons.elements import Skeleton

SAVED_EVERY = 10.0  # seconds between two savings of a long search


class Search:
    """A search with its progress bar, its saved state and its report.

    Parameters
    ----------
    model : str
        Name of the model.
    chosen : dict
        Its parameters.
    out : path, optional
        Folder of the answer, where an unfinished search is kept too; else it is kept in the cache.
    seed, budget : int
        Seed of the random directions; how many edges may be traced.
    """

    def __init__(
        self, model: str, chosen: dict[str, Any], out: Path | None, seed: int, budget: int = 1
    ) -> None:
        self.model, self.parameters, self.out = model, chosen, out
        self.seed, self.budget = seed, budget
        prepare(out)
        self.finished, self.interrupted, self.drawn = True, False, True

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
        from polycorner.skeletons.elements import Completeness

        known = 0
        with working(f"searching {self.model}", "edges") as progress:
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
                self._save(found)
                left = self.budget - (len(found.edges) - known)
                if left < 1:
                    break
                found = resumed(found, budget=Budget(left, SAVED_EVERY), progress=progress)
        self.finished = found.complete not in (Completeness.BUDGET, Completeness.INTERRUPTED)
        if self.finished:
            self.state.unlink(missing_ok=True)
        else:
            self._save(found)
        self.drawn = self.finished
        self.interrupted = found.complete is Completeness.INTERRUPTED
        return found

    def _save(self, found: "Skeleton") -> None:
        from polycorner.files import save_skeleton

        with writing(self.state):
            save_skeleton(found, self.state, label=self.label)

    def _load(self, polyhedron: "Polyhedron", symmetry: "Symmetry | None") -> "Skeleton":
        from polycorner.files import load_skeleton

        if not self.state.exists():
            fail("--resume: expected an unfinished search with the same options; got none")
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
            unfinished(self.state)
        if self.interrupted:
            raise click.exceptions.Exit(130)

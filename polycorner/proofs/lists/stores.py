"""Stores: searches on disk, which go on where they stood after an interruption of any kind.

A store is a folder with

``search.json``
    the problem, what is known (regions, loci, what was tried in vain) and the names and digests of
    the other files; it is replaced as a whole, and files that it does not name do not count;
``tree-K.npz``
    what was added to the subdivision between two times of saving;
``boxes-K.npz``
    the boxes that wait and those that are undecided, at the last time.

Without ``search.json`` nothing was saved to its end, and the search begins anew.

Between two rounds this is all that the search depends on, so that one that goes on from a store
finds what it would have found without the interruption.
"""

import io
import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, fields
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner import __version__, checks, forms, searches
from polycorner.atomic import is_part, is_store, lock_store, write_atomically
from polycorner.checks import choice, refuse, whole
from polycorner.container import one_sentence, read_arrays
from polycorner.formulas.cache import sources_digest
from polycorner.proofs.lists.records import (
    locus_data,
    locus_from,
    posed,
    region_data,
    region_from,
)
from polycorner.proofs.lists.search import BoxSearch, Tally
from polycorner.proofs.lists.tree import DIRECTED, SPLIT, Boxes, Tree

FORMAT = ["polycorner-search-of-stationary-points", 1]
ROOT = "search.json"
BOXES = ("lower", "upper", "nodes", "since")
PIECES = re.compile(r"(tree|boxes)-\d+\.npz")
# What has to be the same, in words.
DIFFERENCES = {
    "format": "of this format",
    "library": "by this version of the library",
    "functions": "for these functions",
    "problem": "for this problem",
    "domain": "in this box",
    "symmetries": "with these symmetries",
    "resolution": "of this resolution",
}


def check_progress(root: Mapping[str, Any], search: BoxSearch) -> None:
    """Check what is known, before it is made again.

    Raises
    ------
    TypeError, ValueError
        Naming the entry.
    """
    n, inequalities = search.problem.dimension, search.problem.inequalities
    active = forms.many(forms.position(inequalities))
    index, point = forms.optional(forms.position(n + 1)), forms.many(_hexadecimal, exactly=n)
    sides = {name: forms.many(_hexadecimal) for name in ("sharp_lower", "sharp_upper")}
    pinned = {name: forms.many(_hexadecimal) for name in ("into", "steps", "weights")}
    region = {"active": active, "index": index, "lower": point, "upper": point, **sides}
    locus = {"z": forms.many(forms.position(n)), "index": index, "sample": forms.optional(point)}
    locus |= dict.fromkeys(("lower", "upper"), forms.many(_hexadecimal)) | sides
    tried = forms.row(active, forms.many(forms.many(forms.number(infinite=True), exactly=n + 1)))
    each: dict[str, forms.Form] = {
        "tally": forms.entries({field.name: forms.count for field in fields(Tally)}),
        "files": forms.mapped(_file, forms.text),
        "regions": forms.many(forms.entries(region, pinned | {"corner": active})),
        "loci": forms.many(forms.entries(locus)),
        "missed": forms.many(forms.entries(locus)),
        "failed": forms.many(tried),
    }
    forms.entries(each)("", root)
    equations, free = search.equations, search.domain.free
    for k, entry in enumerate(root["regions"]):
        size = len(free) + len(entry["active"]) + equations
        if "corner" not in entry:
            _same_sizes(f"regions[{k}]", entry, sides, size)
    for name in ("loci", "missed"):
        for k, entry in enumerate(root[name]):
            _same_sizes(f"{name}[{k}]", entry, ("lower", "upper", *sides), len(entry["z"]))


def _same_sizes(place: str, entry: Mapping[str, Any], names: Any, size: int) -> None:
    for name in names:
        forms.many(forms.anything, exactly=size)(f"{place}.{name}", entry[name])


def _hexadecimal(place: str, value: Any) -> None:
    if not np.isfinite(float.fromhex(forms.text(place, value))):
        refuse(place, "a finite number", value)


def _file(place: str, value: Any) -> None:
    """Check the name of a file of a store, which is in its folder."""
    kind, _, rest = forms.text(place, value).partition("-")
    choice(place, kind, ("tree", "boxes"))
    number = rest.removesuffix(".npz")
    # Names come from a file that others may have written: no path leads out of the folder.
    if not (number.isascii() and number.isdigit() and len(number) < 10):
        refuse(place, "the name of a file with a number", value)


def check_tree(records: Mapping[str, Any], before: Tree, n: int) -> None:
    """Check what is added to a tree of boxes of ``n`` coordinates."""
    split = records.get(SPLIT[0], np.zeros(0))
    count = before.count + 2 * len(split)
    forms.array("count", records["count"], "i", (), least=count, most=count)
    position = partial(forms.array, kinds="i", least=0, most=count - 1)
    if SPLIT[0] in records:
        nodes, axes, positions, first = (records[name] for name in SPLIT)
        position("nodes", nodes, shape=(-1,))
        forms.array("axes", axes, "i", nodes.shape, least=0, most=n - 1)
        forms.array("positions", positions, "f", nodes.shape)
        # The numbering of `Tree.split`: a forged one could make a box its own half.
        expected = before.count + 2 * np.arange(len(nodes))
        if first.shape != expected.shape or (first != expected).any():
            refuse("first", "two boxes for each that is split", "others")
    if "closed" in records:
        owners, vectors = (records[name] for name in DIRECTED)
        position("closed", records["closed"], shape=(-1,))
        position("owners", owners, shape=(-1,))
        forms.array("vectors", vectors, "f", (len(owners), n))


def check_boxes(name: str, boxes: Boxes, search: BoxSearch) -> None:
    """Check boxes that wait or are undecided."""
    n, domain = search.problem.dimension, search.domain
    shape = (len(boxes.nodes), n)
    lower = forms.array(f"{name}_lower", boxes.lower, "f", shape)
    upper = forms.array(f"{name}_upper", boxes.upper, "f", shape)
    if not ((domain.lower <= lower) & (lower <= upper) & (upper <= domain.upper)).all():
        refuse(name, "boxes in the domain", "others")
    forms.array(f"{name}_nodes", boxes.nodes, "i", (-1,), least=0, most=search.tree.count - 1)
    forms.array(f"{name}_since", boxes.since, "i", shape[:1], least=0)


def check_leaves(tree: Tree, boxes: Sequence[Boxes]) -> None:
    """Check that every box of a tree is split, closed, or among some boxes, and but once."""
    done = tree.records()
    parts = [done.get(name, np.zeros(0, dtype=np.int64)) for name in (SPLIT[0], "closed")]
    every = np.concatenate([*parts, *(part.nodes for part in boxes)])
    # A box that is missing would count as searched: the list would be complete by mistake.
    if len(every) != tree.count or len(np.unique(every)) != len(every):
        whole("boxes", len(np.unique(every)), least=tree.count)
        refuse("boxes", "each of them once", "some twice")


class SearchStore:
    """A search on disk.

    Parameters
    ----------
    path : path
        The folder; it is created if it does not exist.
    search : BoxSearch
        One that has not begun; what the store holds is put into it.

    Raises
    ------
    TypeError, ValueError
        If the folder holds something else, another search or a damaged store, or is in use.
    OSError
        If it cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], search: BoxSearch) -> None:
        if not isinstance(path, str | os.PathLike):
            checks.refuse("store", "the path of a folder", path, TypeError)
        self.path, self.search = Path(path), search
        self._files: dict[str, str] = {}  # digests by name
        self._marks, self._count = (0, 0), 0
        self._clock = searches.Clock(self._save)
        # As it comes back from a file: tuples are lists there.
        self._stated = json.loads(json.dumps(_stated(search)))
        found = self._found()
        with _writing(self.path):
            self.path.mkdir(parents=True, exist_ok=True)
            self._lock = lock_store(self.path)
        try:
            found = self._found()
            if found is not None:
                self._restore(found)
            with _writing(self.path):
                for file in self.path.iterdir():  # of a process that was killed as it saved
                    if _is_own(file) and file.name not in self._files:
                        file.unlink()
            self.save()
        except BaseException:
            self._lock.release()
            raise

    def save_by_the_clock(self) -> None:
        """Save the search if the last time is long enough ago."""
        self._clock.tick()

    def save(self) -> None:
        """Save the search now."""
        self._clock.save()

    def _save(self) -> None:
        """Save the search as it is between two rounds."""
        search, before = self.search, set(self._files)
        waiting = _arrays(search.waiting, "waiting") | _arrays(
            Boxes.joined([search.waiting.part(slice(0)), *search.undecided]), "undecided"
        )
        pieces = [name for name in self._files if name.startswith("tree")]
        files = {name: self._files[name] for name in pieces}
        with _writing(self.path):
            if search.tree.marks != self._marks or not pieces:
                records = search.tree.records(self._marks)
                files |= self._written(f"tree-{self._count}.npz", records)
            files |= self._written(f"boxes-{self._count}.npz", waiting)
            # The root is written last: until then the files of the time before count.
            content = self._stated | _progress(search) | {"files": files}
            text = json.dumps(content)
            root = json.dumps({"sha256": _digest(text.encode()), "search": text})
            write_atomically(self.path / ROOT, root)
            # Only now: an interruption before leaves the search of the time before whole.
            for name in before - set(files):
                (self.path / name).unlink(missing_ok=True)
        self._files, self._marks, self._count = files, search.tree.marks, self._count + 1

    def close(self) -> None:
        """Release the store."""
        self._lock.release()

    def _written(self, name: str, arrays: Mapping[str, NDArray[Any]]) -> dict[str, str]:
        memory = io.BytesIO()
        np.savez(memory, **arrays)  # type: ignore[arg-type] # its option comes first by name
        write_atomically(self.path / name, memory.getvalue())
        return {name: _digest(memory.getvalue())}

    def _found(self) -> dict[str, Any] | None:
        """Return what the folder holds of this search, or None for nothing."""
        if not is_store(self.path, ROOT, "the store of a search", _is_own):
            return None
        root = self._parsed((self.path / ROOT).read_bytes())
        for name, words in DIFFERENCES.items():
            if root.get(name) != self._stated[name]:
                msg = f"store: expected a search {words}; {self.path} holds another one"
                raise ValueError(msg)
        return root

    def _parsed(self, content: bytes) -> dict[str, Any]:
        with self._reading(ROOT):
            outer = json.loads(content)
            if outer["sha256"] == _digest(outer["search"].encode()):
                return dict(json.loads(outer["search"]))
        raise self._damaged(ROOT)

    def _damaged(self, name: str) -> ValueError:
        msg = f"store: expected files as they were written; {self.path / name} was changed"
        return ValueError(msg)

    def _restore(self, root: dict[str, Any]) -> None:
        """Put what was saved into the search, after a check of every number."""
        search, n = self.search, self.search.problem.dimension
        with self._reading(ROOT):
            check_progress(root, search)
        for name, digest in root["files"].items():
            try:
                content = (self.path / name).read_bytes()
            except FileNotFoundError:
                content = b""
            if _digest(content) != digest:
                raise self._damaged(name)
            with self._reading(name):
                arrays = read_arrays(content)
                if name.startswith("tree"):
                    check_tree(arrays, search.tree, n)
                    # Pieces of a tree are put together in the order in which they were written.
                    search.tree.extend(arrays)
                    continue
                search.waiting = _boxes(arrays, "waiting")
                search.undecided = [_boxes(arrays, "undecided")]
        with self._reading(ROOT):
            check_boxes("waiting", search.waiting, search)
            for boxes in search.undecided:
                check_boxes("undecided", boxes, search)
            check_leaves(search.tree, [search.waiting, *search.undecided])
            search.tally = Tally(**root["tally"])
            for data in root["regions"]:
                search.known.add(region_from(data))
            search.known.loci += map(locus_from, root["loci"])
            search.known.missed += map(locus_from, root["missed"])
            for active, tried in root["failed"]:
                for *q, widest in tried:
                    search.attempts.failed.add(tuple(active), np.array(q), widest)
        self._files, self._marks = dict(root["files"]), search.tree.marks
        self._count = 1 + max(int(name.split("-")[1].split(".")[0]) for name in self._files)

    def _reading(self, name: str) -> AbstractContextManager[None]:
        said = f"store: expected files as they were written; {self.path / name}"
        return one_sentence(lambda why: ValueError(f"{said} ({why})"))


def _stated(search: BoxSearch) -> dict[str, Any]:
    """Return what a search is about."""
    problem = posed(search)
    parts = ("functions", "domain", "symmetries")
    return {
        "format": FORMAT,
        "library": [__version__, sources_digest(__package__)],
        **{name: problem.pop(name) for name in parts},
        "problem": problem,
        "resolution": search.resolution,
    }


def _progress(search: BoxSearch) -> dict[str, Any]:
    """Return what is known; numbers are written with all their digits."""
    return {
        "tally": asdict(search.tally),
        "regions": [region_data(region) for region in search.regions],
        "loci": [locus_data(place) for place in search.loci],
        "missed": [locus_data(place) for place in search.known.missed],
        "failed": search.attempts.failed.items(),
    }


def _arrays(boxes: Boxes, prefix: str) -> dict[str, NDArray[Any]]:
    return {f"{prefix}_{name}": getattr(boxes, name) for name in BOXES}


def _boxes(arrays: Mapping[str, NDArray[Any]], prefix: str) -> Boxes:
    lower, upper, nodes, since = (arrays[f"{prefix}_{name}"] for name in BOXES)
    return Boxes(lower, upper, nodes, since)


def _is_own(file: Path) -> bool:
    """Whether a file beside the root is one that a store writes."""
    return is_part(file) or PIECES.fullmatch(file.name) is not None


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        msg = f"store: expected a folder that can be written; {path}: {error.strerror or error}"
        raise OSError(error.errno, msg) from error

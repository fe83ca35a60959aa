"""What a store of a search may hold: boxes of the subdivision, each of which is one thing."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np

from polycorner import forms
from polycorner.checks import choice, refuse, whole
from polycorner.proofs.lists.boxes import Boxes
from polycorner.proofs.lists.search import Search, Tally
from polycorner.proofs.lists.tree import DIRECTED, SPLIT, Tree


def check_progress(root: Mapping[str, Any], search: Search) -> None:
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
        expected = before.count + 2 * np.arange(len(nodes))
        if first.shape != expected.shape or (first != expected).any():
            refuse("first", "two boxes for each that is split", "others")
    if "closed" in records:
        owners, vectors = (records[name] for name in DIRECTED)
        position("closed", records["closed"], shape=(-1,))
        position("owners", owners, shape=(-1,))
        forms.array("vectors", vectors, "f", (len(owners), n))


def check_boxes(name: str, boxes: Boxes, search: Search) -> None:
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
    if len(every) != tree.count or len(np.unique(every)) != len(every):
        whole("boxes", len(np.unique(every)), least=tree.count)
        refuse("boxes", "each of them once", "some twice")

"""Saved lists that are verified, and falsified copies of them that have to be refused."""

import contextlib
import io
import json
import zipfile
from array import array
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import flint
import numpy as np

from benchmarks.trials.known import Posed
from polycorner.proofs.checker.balls import NotShownError
from polycorner.proofs.checker.verdict import check
from polycorner.proofs.lists.stationary import StationaryList
from polycorner.proofs.lists.tree import CLOSED, OPEN

Parts = dict[str, Any]


def point_dropped(_: Posed, parts: Parts) -> bool:
    """Take a point from the list; return whether there was one."""
    return bool(parts["problem.json"]["points"] and parts["problem.json"]["points"].pop())


def index_changed(_: Posed, parts: Parts) -> bool:
    for point in parts["problem.json"]["points"][:1]:
        point["index"] = (point["index"] or 0) + 1
        parts["problem.json"]["regions"][point["region"]]["index"] = point["index"]
        return True
    return False


def box_shifted(_: Posed, parts: Parts) -> bool:
    for point in parts["problem.json"]["points"][:1]:
        region = parts["problem.json"]["regions"][point["region"]]
        low, high = (float.fromhex(region[end][0]) for end in ("sharp_lower", "sharp_upper"))
        step = 1e-7 + 2 * (high - low)
        region["sharp_lower"][0], region["sharp_upper"][0] = (low + step).hex(), (high + step).hex()
        return True
    return False


def region_without_a_function(_: Posed, parts: Parts) -> bool:
    """Take an active function, and its multiplier, from a region."""
    data = parts["problem.json"]
    for region in data["regions"]:
        if region["active"]:
            place = len(data["coordinates"]) - len(data["fixed"]) + len(region["active"]) - 1
            region["active"].pop()
            for end in ("sharp_lower", "sharp_upper"):
                region[end].pop(place)
            return True
    return False


def degenerate_point_lost(posed: Posed, parts: Parts) -> bool:
    """Call open boxes with a stationary point closed; return whether there were any."""
    data, codes = parts["problem.json"], list(array("b", parts["tree.bin"]))
    places, counts = iter(array("d", parts["positions.bin"])), list(array("H", parts["counts.bin"]))
    ends = [[float.fromhex(x) for x in data["domain"][end]] for end in ("lower", "upper")]
    lost = [k.point for k in posed.points if k.index is None] + list(posed.samples)
    waiting, closed = [(np.array(ends[0]), np.array(ends[1]))], 0
    for number, code in enumerate(codes):
        lower, upper = waiting.pop()
        if code >= 0:
            middle = next(places)
            first, second = upper.copy(), lower.copy()
            first[code] = second[code] = middle
            waiting += [(second, upper), (lower, first)]
        elif code == OPEN and any(posed.holds(lower, upper, q) for q in lost):
            codes[number] = CLOSED
            counts.insert(closed, 0)
            data["open"] -= 1
        closed += codes[number] == CLOSED
    changed = CLOSED in codes and array("b", codes).tobytes() != parts["tree.bin"]
    parts["tree.bin"], parts["counts.bin"] = (
        array("b", codes).tobytes(),
        array("H", counts).tobytes(),
    )
    return changed


CHANGES: tuple[Callable[[Posed, Parts], bool], ...] = (
    point_dropped, index_changed, box_shifted, region_without_a_function, degenerate_point_lost,
)  # fmt: skip


def verified(path: Path) -> str:
    """Return what is wrong with a file, or nothing."""
    before = flint.ctx.prec
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            check(str(path), None, 1)
    except (NotShownError, ArithmeticError, LookupError, TypeError, ValueError) as error:
        return str(error)[:200] or repr(error)
    finally:
        flint.ctx.prec = before
    return ""


def tried(posed: Posed, found: StationaryList) -> Iterator[tuple[str, str]]:
    """Yield each copy and what became of it: "verified", or why it was refused."""
    with TemporaryDirectory() as folder:
        path = found.save(Path(folder) / "list.zip")
        yield "as saved", verified(path) or "verified"
        with zipfile.ZipFile(path) as archive:
            whole = {name: archive.read(name) for name in archive.namelist()}
        for change in CHANGES:
            parts: Parts = {**whole, "problem.json": json.loads(whole["problem.json"])}
            if not change(posed, parts):
                continue
            parts["problem.json"] = json.dumps(parts["problem.json"])
            with zipfile.ZipFile(path, "w") as archive:
                for name, content in parts.items():
                    archive.writestr(name, content)
            yield change.__name__, verified(path) or "verified"

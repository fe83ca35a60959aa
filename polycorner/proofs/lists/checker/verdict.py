"""Verdict on a file: its parts, its leaves and the list that it claims."""

import json
import math
import random
import sys
import time
import zipfile
from array import array
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from typing import Any

from .balls import moved, need
from .corners import CornerProof
from .problem import CORNERS, Problem
from .proof import Proof

CHUNK = 500  # leaves that a worker checks at a time


def contents(path: str) -> tuple[dict[str, Any], list[Any]]:
    kinds, parts = {"tree": "b", "positions": "d", "counts": "H", "directions": "f"}, []
    with zipfile.ZipFile(path) as archive:
        for name, kind in kinds.items():
            parts.append(array(kind, archive.read(f"{name}.bin")))
            if sys.byteorder == "big":
                parts[-1].byteswap()
        return json.loads(archive.read("problem.json")), parts


def leaves(p: Problem, codes: Any, positions: Any, counts: Any, directions: Any) -> Iterator[Any]:
    """Yield number, sides and directions of the closed boxes."""
    waiting, places, rows, closed = [(p.lower, p.upper)], iter(positions), 0, 0
    for code in codes:
        need(waiting, "the tree has too many nodes")
        lo, hi = waiting.pop()
        if code >= 0:
            x = next(places, math.nan)
            need(code < p.n and lo[code] < x < hi[code], f"a box is split at {x}")
            waiting += [(moved(lo, code, x), hi), (lo, moved(hi, code, x))]
        elif code == -1:
            need(closed < len(counts), "there are more closed boxes than counts")
            end = rows + counts[closed]
            yield closed, lo, hi, [directions[r * p.n : (r + 1) * p.n] for r in range(rows, end)]
            rows, closed = end, closed + 1
        else:
            need(code == -2, f"a node is {code}")
    need(not waiting and next(places, None) is None, "the tree is incomplete")
    need(closed == len(counts) and rows * p.n == len(directions), "the number of directions")


WORKER: list[Proof] = []


def begin(path: str) -> None:
    data = contents(path)[0]
    WORKER[:] = [(CornerProof if data["format"] == CORNERS else Proof)(data)]


def failing(chunk: list[Any]) -> Any:
    return next((leaf for leaf in chunk if not WORKER[0].closed(*leaf[1:])), None)


def check(path: str, sample: int | None, jobs: int) -> str:
    """Check a file; return the verdict."""
    (data, parts), started, done = contents(path), time.monotonic(), 0
    begin(path)
    proof, (total, opened) = WORKER[0], (parts[0].count(code) for code in (-1, -2))
    proof.check_list(data)
    need(opened == data["open"], f"{opened} boxes are open, not {data['open']}")
    count = total if sample is None else min(sample, total)
    wanted = range(total) if count == total else set(random.Random(0).sample(range(total), count))
    stream = (leaf for leaf in leaves(proof.p, *parts) if leaf[0] in wanted)
    chunks = iter(lambda: list(islice(stream, CHUNK)), [])
    with ProcessPoolExecutor(jobs, initializer=begin, initargs=(path,)) as pool:
        while wave := list(islice(chunks, 4 * jobs)):
            found = (map if jobs == 1 else pool.map)(failing, wave)
            bad = next(filter(None, found), None)
            need(not bad, f"leaf {bad and (bad[0], [*zip(*bad[1:3], strict=True)])}")
            done += sum(map(len, wave))
            line = f"{done} of {count} leaves, {time.monotonic() - started:.0f} s"
            print(line, file=sys.stderr)
    said = [f"{len(data['points'])} {proof.kind}"]
    related = len(data.get("relations", ()))
    said += [f"{related} linear relations (tested, not proved)"] if related else []
    said += [f"{len(data['open_points'])} that may be"] if data["open_points"] else []
    said += [f"{proof.tested} zeros at points (tested, not proved)"] if proof.tested else []
    for met, what in ((True, "loci"), (False, "loci that may be empty")):
        some = [f for f in proof.loci if f.met == met]
        said += [f"{sum(not f.outside for f in some)} {what}"] if some else []
    said += [f"{total} leaves" if count == total else f"ONLY A SAMPLE of {count} of {total} leaves"]
    said += [f"complete outside {opened} open boxes" if opened else "no open box"]
    said += (
        [f"up to {len(proof.symmetries)} symmetries (tested, not proved)"]
        if proof.symmetries
        else []
    )
    return f"verified: {', '.join(said)}"

"""Verdict on a file: its parts, its leaves and the list or the diagram that it claims."""

import json
import math
import os
import random
import sys
import time
import zipfile
from array import array
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import reduce
from itertools import islice
from multiprocessing import parent_process
from pathlib import Path
from threading import Thread
from typing import Any

from flint import arb

from .balls import NotShownError, moved, need
from .corners import StoredCorners
from .diagrams import StoredDiagram
from .problem import CORNERS, DIAGRAM, StoredProblem
from .proof import StoredProof
from .statement import PROOF
from .statements import stated

DIGITS, MOST_TOLD = 10, 8  # of energies; energies that are told one by one
CHUNK = 500  # leaves that a worker checks at a time
MOST_UNPACKED = 200  # bytes for each of a file; deflate packs a thousand zeros into one
MOST_TEXT = 2**24  # bytes of a description, which take twenty times the memory when they are read
MOST_SAID = 1000  # letters of a refusal, which quotes the file
PIECE = 2**16  # bytes that are unpacked at a time


def unpacked(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """Return a part of a file, read bit by bit: what the archive says of sizes may be untrue."""
    found = [part for part in archive.filelist if part.filename == name]
    need(len(found) == 1, f"{len(found)} parts are called {name}")
    (part,) = found
    plain = part.compress_type in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}
    need(plain and not part.flag_bits & 1, f"{name} is encrypted, or packed in an unusual way")
    content = bytearray()
    with archive.open(part) as file:
        while piece := file.read(PIECE):
            content += piece
            need(len(content) <= most, f"{name} is far too large")
    return bytes(content)


def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a record, whose entries may not be stated twice."""
    found = dict(pairs)
    need(len(found) == len(pairs), f"{[name for name, _ in pairs]}: an entry is stated twice")
    return found


def contents(path: str) -> tuple[dict[str, Any], list[Any]]:
    kinds, parts = {"tree": "b", "positions": "d", "counts": "H", "directions": "f"}, []
    need(not Path(path).exists() or Path(path).is_file(), f"{path} is no file")
    with zipfile.ZipFile(path) as archive:
        room = MOST_UNPACKED * Path(path).stat().st_size
        need(sum(part.file_size for part in archive.filelist) <= room, "a part is far too large")
        text = unpacked(archive, "problem.json", min(room, MOST_TEXT))
        data = json.loads(text, object_pairs_hook=once)
        if data["format"] == PROOF or (data["format"] == DIAGRAM and data["domain"] is None):
            return data, []
        for name, kind in kinds.items():
            parts.append(array(kind, unpacked(archive, f"{name}.bin", room)))
            if sys.byteorder == "big":
                parts[-1].byteswap()
    return data, parts


def leaves(
    p: StoredProblem, codes: Any, positions: Any, counts: Any, directions: Any
) -> Iterator[Any]:
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


WORKER: list[StoredProof] = []


def follow() -> None:
    """End this process when the one that started it ends, in whatever way."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def begin(data: dict[str, Any]) -> None:
    Thread(target=follow, daemon=True).start()
    kinds: dict[Any, type[StoredProof]] = {CORNERS[0]: StoredCorners, DIAGRAM[0]: StoredDiagram}
    WORKER[:] = [kinds.get(data["format"][0], StoredProof)(data)]


def failing(chunk: list[Any]) -> Any:
    return next((leaf for leaf in chunk if not WORKER[0].closed(*leaf[1:])), None)


def check(path: str, sample: int | None, jobs: int) -> str:
    """Check a file; return the verdict."""
    (data, parts), started, done = contents(path), time.monotonic(), 0
    if data["format"] == PROOF:
        return f"verified: {stated(data)}"
    begin(data)
    proof = WORKER[0]
    proof.check_list(data)
    if not parts:
        return f"verified: {', '.join(said(proof))}"
    total, opened = (parts[0].count(code) for code in (-1, -2))
    need(
        type(data["open"]) is int and opened == data["open"],
        f"{opened} boxes are open, not {data['open']}",
    )
    count = total if sample is None else min(sample, total)
    wanted = range(total) if count == total else set(random.Random(0).sample(range(total), count))
    stream = (leaf for leaf in leaves(proof.p, *parts) if leaf[0] in wanted)
    chunks = iter(lambda: list(islice(stream, CHUNK)), [])
    with ProcessPoolExecutor(jobs, initializer=begin, initargs=(data,)) as pool:
        while wave := list(islice(chunks, 4 * jobs)):
            found = (map if jobs == 1 else pool.map)(failing, wave)
            bad = next(filter(None, found), None)
            need(not bad, f"leaf {bad and (bad[0], [*zip(*bad[1:3], strict=True)])}")
            done += sum(map(len, wave))
            line = f"{done} of {count} leaves, {time.monotonic() - started:.0f} s"
            print(line, file=sys.stderr)
    leaves_ = f"{total} leaves" if count == total else f"ONLY A SAMPLE of {count} of {total} leaves"
    boxes = f"complete outside {opened} open boxes" if opened else "no open box"
    return f"verified: {', '.join([*said(proof), leaves_, boxes, proof.p.where()])}"


def said(proof: StoredProof) -> Iterator[str]:
    """Yield what a proof shows of points and loci, once its list is checked."""
    if isinstance(proof, StoredDiagram):
        yield from proof.said()
        return
    tested = sum(not g.proved for g in proof.symmetries)
    images = f" and their images under {len(proof.symmetries)} symmetries"
    images += f" ({tested} of them tested, not proved)" if tested else ""
    yield f"{len(proof.points)} {proof.kind}{images if proof.symmetries else ''}"
    yield from proof.indices() if proof.kind == "stationary points" else ()
    if energies := proof.energies():
        few = [x.str(DIGITS) for x in energies]
        ends = reduce(arb.min, energies), reduce(arb.max, energies)
        told = ", ".join(few) if len(few) <= MOST_TOLD else " to ".join(x.str(DIGITS) for x in ends)
        yield f"energies of the minima {told}"
    if proof.periodic:
        yield f"periods of {' and '.join(proof.periodic)} (tested, not proved)"
    loci = proof.distinct()
    on_sides = sum(not place.inside for place in [*proof.points, *loci])
    for number, what in (
        (proof.unproved, "linear relations (tested, not proved)"),
        (proof.open, "that may be"),
        (proof.tested, "zeros at points (tested, not proved)"),
        (sum(place.met for place in loci), "loci"),
        (sum(not place.met for place in loci), "loci that may be empty"),
        (on_sides, "of them on a side of the box or beside it by rounding"),
    ):
        if number:
            yield f"{number} {what}"


def judged(path: str, sample: int | None, jobs: int) -> tuple[bool, str]:
    """Return whether a file is verified, and the line that says so, whatever is in it."""
    try:
        return True, check(path, sample, jobs)
    except NotShownError as error:
        why = str(error)
    except OSError as error:
        why = f"the file cannot be read: {error}"
    except Exception as error:  # whatever goes wrong, nothing is verified
        why = f"the file is malformed: {error!r}"
    line = " ".join(why.split())
    return False, f"NOT VERIFIED: {line[:MOST_SAID]}{'...' if len(line) > MOST_SAID else ''}"

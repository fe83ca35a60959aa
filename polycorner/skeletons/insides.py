"""Corners inside the two-dimensional faces of a finished search: no edge need lead to them."""

from collections.abc import Iterator, Sequence

import numpy as np

from polycorner.lookahead import Lookahead
from polycorner.progress import Progress
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.incidences import Flag, flags_of, groups_of, joins_of
from polycorner.skeletons.masks import mask_of
from polycorner.skeletons.partitions import Partition
from polycorner.skeletons.sectors import Sector
from polycorner.skeletons.singularities import singular_point
from polycorner.skeletons.touching import BATCH, Start, touched
from polycorner.spaces.manifold import Array
from polycorner.workers import Shared, Workers

# Least length of the sum of the directions of two edges that points between them.
BETWEEN = 1e-2


def add_inner_corners(
    explorer: Explorer, examined: set[Flag], progress: Progress, workers: Workers | None
) -> bool:
    """Add the corners inside faces that were not examined yet; return whether there are any.

    Parameters
    ----------
    explorer : Explorer
        A finished search.
    examined : set of Flag
        Flags of faces that were examined; those that are now are added.
    progress : callable
        Called as ``progress(walks, all walks, note)``.
    workers : Workers, optional
        Who walks across the faces.
    """
    known = len(explorer.records)
    starts = list(_starts(explorer, examined))
    chunks = [starts[i : i + BATCH] for i in range(0, len(starts), BATCH)]
    for done, (chunk, found) in enumerate(_walked(explorer, chunks, workers)):
        for walk, row, q in found:
            _add(explorer, q, frozenset(chunk[walk].held) | {row})
        progress(min((done + 1) * BATCH, len(starts)), len(starts), "faces examined")
    return len(explorer.records) > known


def _walked(
    explorer: Explorer, chunks: Sequence[Sequence[Start]], workers: Workers | None
) -> Iterator[tuple[Sequence[Start], list[tuple[int, int, Array]]]]:
    """Yield the starts of walks, some at a time, and what was found."""
    shared = Shared(explorer.quotient)
    if workers is None:
        yield from ((chunk, touched(shared, chunk)) for chunk in chunks)
        return
    ahead = Lookahead(workers)
    try:
        for i, chunk in enumerate(chunks):
            for k in range(i, len(chunks)):
                if k not in ahead:
                    if k > i and not ahead.has_room:
                        break
                    ahead.start(k, touched, shared, chunks[k])
            yield chunk, ahead.result(i)
    finally:
        ahead.close()


def _starts(explorer: Explorer, examined: set[Flag]) -> Iterator[Start]:
    """Yield the start of a walk across every face that was not examined: from its first corner."""
    flags = dict.fromkeys(flags_of(explorer))
    boundary = Partition(flags)
    for one, other in joins_of(explorer):
        if one in flags and other in flags:
            boundary.join(one, other)
    for group in groups_of(boundary, flags):
        if examined.isdisjoint(group):
            starts = (start for flag in group for start in _starts_at(explorer, flag))
            yield from (start for start in [next(starts, None)] if start is not None)
        examined.update(group[:1])


def _starts_at(explorer: Explorer, flag: Flag) -> Iterator[Start]:
    """Yield starts at a corner, with independent gradients that leave two dimensions."""
    if flag[0] != "half":
        return
    (k, i), held = flag[1:]
    record = explorer.records[k]
    for sector in record.figure.sectors:
        if i in sector.rays and mask_of(sector.held) == held:
            way = _between(explorer, k, sector)
            if way is not None and len(sector.held) == record.figure.full - 2:
                yield Start(record.point.q, way, sector.held)


def _between(explorer: Explorer, k: int, sector: Sector) -> Array | None:
    """Return a direction between the edges that bound a sector; None where they are opposite."""
    total = sum(explorer.records[k].figure.rays[i].direction for i in sector.rays)
    size = float(np.linalg.norm(total))
    return np.asarray(total / size) if size > BETWEEN else None


def _add(explorer: Explorer, q: Array, active: frozenset[int]) -> None:
    """Add the corner at a point where some functions vanish and touch, if it is new."""
    if _is_known(explorer, q, len(active)):
        return
    found = singular_point(explorer.quotient, q, sorted(active), explorer.quotient.tolerances.near)
    if found is None or found.active() is None:
        explorer.registry.note(
            f"{explorer.registry.written(active)} vanish at a point inside a face, or nearly: "
            f"whether that is a corner is not decided",
            lost=True,
        )
    else:
        explorer.corner(found)


def _is_known(explorer: Explorer, q: Array, count: int) -> bool:
    """Whether a corner with as many functions has the invariants of a point."""
    key = explorer.symmetry.key
    if key is None:
        return False
    here, same = np.asarray(key(q)), explorer.quotient.tolerances.corner
    return any(
        abs(record.key - here).max() < same
        for record in explorer.records
        if len(record.active) >= count
    )

"""Corners inside the two-dimensional faces of a finished search: no edge need lead to them.

Points inside two-dimensional faces where another function touches zero.

Where the gradients of ``N - 1`` functions have one relation, in a quotient of dimension ``N``, and
the weighted sum of their Hessians is definite on the plane that they leave, the other ones, but for
one with a weight of the sign of the form, vanish on a two-dimensional face, on which this one has a
strict minimum zero.  If all of them have weights, no edge leads to such a corner: it is a puncture
of the faces around it.

Faces are sampled along straight walks.  With the slopes ``a`` and Hessian ``B`` of a function on
the face, corrected for the curvature of the face by multipliers, its minimum is about
``f - a' B^-1 a / 2``.  Where that is about zero Newton's method looks for the minimum.  Walks that
miss the basin of a minimum miss the corner: nothing here proves that there are none.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner.polyhedra.cones import unit_rows
from polycorner.polyhedra.quotients import Quotient
from polycorner.progress import Progress
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.incidences import (
    Flag,
    Partition,
    flags_of,
    groups_of,
    joins_of,
    mask_of,
)
from polycorner.skeletons.singularities import singular_point
from polycorner.skeletons.vertex_figures import Sector
from polycorner.spaces.manifold import Array
from polycorner.workers import Shared, Workers, in_order

Positions = NDArray[np.intp]
Mask = NDArray[np.bool_]
# Length in scale units of the steps of a walk, and their number.
STEP, STEPS = 0.2, 60
# Walks at a time.
BATCH = 128
# Distances of a function from zero, and of its minimum, up to which that is looked for.
CLOSE, WITHIN = 0.35, 0.5
# Least minimum, and its growth with the square and cube of its distance, that may be zero.
ZERO, SQUARE, CUBE = 0.02, 0.15, 0.5
# Newton steps, and their largest length.
NEWTON, LONGEST = 20, 0.15
# Distance below zero at which a function ends a walk: its points are placed to first order.
OUTSIDE = 0.02
# Least length of the sum of the directions of two edges that points between them.
BETWEEN = 1e-2


@dataclass(frozen=True, eq=False)
class Start:
    """Where a walk across a face starts: a point, a scaled direction and what is held."""

    q: Array
    direction: Array
    held: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of faces, the first axis of every array.

    ``moved`` are the points put back to their faces to first order, ``frame`` the planes tangent to
    these ``(b, n, 2)``, ``gaps``, ``slopes`` and ``forms`` the distances of all functions from zero
    and their derivatives on the face, ``fits`` where the held gradients are independent.
    """

    moved: Array
    frame: Array
    gaps: Array
    slopes: Array
    forms: Array
    fits: Mask

    def minima(self, which: tuple[Positions, Positions], least: float) -> tuple[Array, Array, Mask]:
        """Return the ways to minima on the face, their values, and where Hessians are definite.

        Their determinants are larger than ``least`` there.
        """
        b, k = which
        form, slope = self.forms[b, k], self.slopes[b, k]
        determinant = form[:, 0, 0] * form[:, 1, 1] - form[:, 0, 1] * form[:, 1, 0]
        definite = (determinant > least) & (form[:, 0, 0] + form[:, 1, 1] > 0)
        form = np.where(definite[:, None, None], form, np.eye(2))
        steps: Array = -np.asarray(np.linalg.solve(form, slope[..., None])[..., 0], np.float64)
        return steps, self.gaps[b, k] + (slope * steps).sum(axis=1) / 2, definite


def touching_points(
    quotient: Quotient, starts: Sequence[Start]
) -> Iterator[tuple[int, int, Array]]:
    """Yield walks by position, functions that touch zero beside them, and the points.

    Only where no other function is negative.  Functions that are held by one start are as many as
    by another one.
    """
    for first in range(0, len(starts), BATCH):
        found = list(_candidates(quotient, starts[first : first + BATCH]))
        if found:
            yield from ((first + b, k, q) for b, k, q in _polished(quotient, starts[first:], found))


def touched(quotient: Shared, starts: Sequence[Start]) -> list[tuple[int, int, Array]]:
    """Return what :func:`touching_points` yields; called in a worker."""
    return list(touching_points(quotient.value, starts))


def _candidates(quotient: Quotient, starts: Sequence[Start]) -> Iterator[tuple[int, int, Array]]:
    """Yield walks, functions that may have a minimum zero, once each, and points near it."""
    q, t = (np.array([getattr(s, name) for s in starts]) for name in ("q", "direction"))
    held = np.array([s.held for s in starts], dtype=np.intp)  # which may be none
    walking, on = np.arange(len(starts)), _is_held(held, quotient.count)
    seen = on.copy()
    scales, limit = quotient.scales, quotient.tolerances.rank
    for _ in range(STEPS):
        here = _located(quotient, q[walking] + STEP * scales * t[walking], held[walking])
        away = np.linalg.norm((here.moved - q[walking]) / scales, axis=1)
        going = here.fits & (away < 2 * STEP)
        b, k = np.nonzero(going[:, None] & ~seen[walking] & (abs(here.gaps) < CLOSE))
        steps, least, definite = here.minima((b, k), limit)
        far = np.linalg.norm(steps, axis=1)
        near = definite & (far < WITHIN) & (abs(least) < ZERO + SQUARE * far**2 + CUBE * far**3)
        for i in np.flatnonzero(near).tolist():
            seen[walking[b[i]], k[i]] = True
            yield int(walking[b[i]]), int(k[i]), here.moved[b[i]]
        going &= np.where(on[walking], np.inf, here.gaps).min(axis=1) > -OUTSIDE
        along = np.einsum("bni,bmi,bm->bn", here.frame, here.frame, t[walking])
        t[walking] = unit_rows(along)
        q[walking] = here.moved
        walking = walking[going]
        if not len(walking):
            return


def _is_held(held: Positions, count: int) -> Mask:
    """Return which of all functions are held, ``(b, count)``."""
    mask = np.zeros((len(held), count), dtype=bool)
    np.put_along_axis(mask, held, True, axis=1)
    return mask


def _polished(
    quotient: Quotient, starts: Sequence[Start], found: list[tuple[int, int, Array]]
) -> Iterator[tuple[int, int, Array]]:
    """Yield those of the candidates at which Newton's method finds a minimum zero."""
    walks, rows = (np.array([f[i] for f in found]) for i in (0, 1))
    q = np.array([f[2] for f in found])
    held = np.array([starts[b].held for b in walks], dtype=np.intp)
    on = _is_held(held, quotient.count)
    scales, tolerances = quotient.scales, quotient.tolerances
    last, touches = tolerances.settled / 10, tolerances.same
    going = np.arange(len(found))
    for _ in range(NEWTON):
        here = _located(quotient, q[going], held[going])
        which = (np.arange(len(going)), rows[going])
        steps, _, definite = here.minima(which, tolerances.rank)
        size = np.linalg.norm(steps, axis=1)
        part = np.minimum(1.0, LONGEST / np.maximum(size, 1e-300))
        fits = here.fits & definite
        still = np.linalg.norm((here.moved - q[going]) / scales, axis=1) < last
        for i in np.flatnonzero(fits & still & (size < last)).tolist():
            least = np.where(on[going[i]], 0.0, here.gaps[i]).min()
            if abs(here.gaps[i, rows[going[i]]]) < touches and least > -touches:
                yield int(walks[going[i]]), int(rows[going[i]]), here.moved[i]
        turned = np.einsum("bni,bi->bn", here.frame, steps * part[:, None])
        q[going] = here.moved + scales * turned
        going = going[fits & ~(still & (size < last))]
        if not len(going):
            return


def _located(quotient: Quotient, q: Array, held: Positions) -> _Points:
    """Return points of faces with the derivatives there."""
    scales, count = quotient.scales, quotient.count
    rows = np.concatenate(
        [held, np.tile(np.array(quotient.equations, held.dtype), (len(q), 1))], axis=1
    )
    values, slopes = quotient.evaluated(q)
    sizes = np.maximum(np.linalg.norm(slopes, axis=2), 1e-300)
    units, away = slopes / sizes[..., None], values / sizes
    normals = np.take_along_axis(units, rows[..., None], 1)
    span, factor, frame, fits = _split(quotient, q, normals)
    fits &= np.isfinite(values).all(axis=1)
    target = np.zeros((len(q), factor.shape[1], 1))
    target[:, : rows.shape[1], 0] = -np.take_along_axis(away, rows, 1)
    step = (span @ np.linalg.solve(factor.transpose(0, 2, 1), target))[..., 0]
    weights = np.linalg.solve(factor, (units @ span).transpose(0, 2, 1))[:, : rows.shape[1]]
    h = quotient.tolerances.difference
    nearby = (q + h * scales * frame[:, :, i] for i in range(2))
    turned = [(quotient.evaluated(p)[1] - slopes) @ frame for p in nearby]
    bends = np.stack(turned, axis=3) / (h * sizes[..., None, None])
    of_held = np.take_along_axis(bends, rows[..., None, None], 1)
    flat = (len(q), rows.shape[1], 4)
    forms = bends - (weights.transpose(0, 2, 1) @ of_held.reshape(flat)).reshape(bends.shape)
    gaps = away + (units @ step[..., None])[..., 0]
    return _Points(
        q + scales * step,
        frame,
        gaps[:, :count],
        (units @ frame)[:, :count],
        forms[:, :count],
        fits,
    )


def _split(quotient: Quotient, q: Array, normals: Array) -> tuple[Array, Array, Array, Mask]:
    """Return the span of normals and orbits, its triangular factor, what is left, and where.

    The factor is replaced where the normals are dependent.
    """
    orbits = np.array([unit_rows(quotient.orbit(p)) for p in q])
    every = np.concatenate([normals, orbits], axis=1)
    r = every.shape[1]
    full, factor = np.linalg.qr(every.transpose(0, 2, 1), mode="complete")
    factor = factor[:, :r]
    least = 100 * quotient.tolerances.rank  # where Newton's method can divide by it
    fits = abs(np.diagonal(factor, axis1=1, axis2=2)).min(axis=1, initial=1.0) > least
    factor = np.where(fits[:, None, None], factor, np.eye(r))
    return full[:, :, :r], factor, full[:, :, r:], fits


def add_inner_corners(
    explorer: Explorer, examined: set[Flag], progress: Progress, workers: Workers | None
) -> bool:
    """Add the corners inside faces that were not examined yet; return whether there are any.

    Flags of the faces that are examined now are added to ``examined``.
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
    yield from zip(chunks, in_order(workers, touched, shared, chunks), strict=True)


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

"""Functions on regular grids in a box, some of whose sides may be identified."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polycorner.checks import about, refuse
from polycorner.spaces.manifold import Array

Function = Callable[[Array], Array]
Bounds = Sequence[tuple[float, float]]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]

AXES = 3
FALSE_POSITIONS = 12
SLAB = 200_000
FEWEST_CELLS = 4


def grid(
    bounds: Bounds, resolution: int | Sequence[int], periodic: Sequence[bool]
) -> tuple[Array, Indices, Mask]:
    """Return the box ``(3, 2)``, the cells along each axis, and a mask of the periodic axes.

    Raises
    ------
    TypeError, ValueError
        For arguments of another form.
    """
    box = np.asarray(bounds, dtype=np.float64)
    if box.shape != (AXES, 2) or not (np.isfinite(box).all() and (box[:, 0] < box[:, 1]).all()):
        refuse("bounds", "three pairs of increasing numbers", bounds)
    cells = np.asarray(resolution)
    if cells.dtype.kind != "i":
        refuse("resolution", "one or three whole numbers", resolution, TypeError)
    if cells.shape not in {(), (AXES,)} or (cells < FEWEST_CELLS).any():
        refuse("resolution", f"one or three whole numbers >= {FEWEST_CELLS}", resolution)
    if len(periodic) != AXES:
        refuse("periodic", "three truth values", periodic)
    return box, np.broadcast_to(cells, AXES).astype(np.int64), np.array(periodic, dtype=bool)


def evaluate(function: Function, box: Array, cells: Indices) -> Array:
    """Return ``f`` at the nodes, ``(n1 + 1, n2 + 1, n3 + 1)``, a few layers at a time.

    Raises
    ------
    ValueError
        If ``{f < 0}`` is empty or all of the box, or ``f`` gives anything but finite numbers.
    """
    ends = zip(box.tolist(), cells.tolist(), strict=True)
    first, second, third = (np.linspace(low, high, n + 1) for (low, high), n in ends)
    plane = np.stack(np.broadcast_arrays(0.0, second[:, None], third[None, :]), axis=-1)
    values = np.empty((len(first), len(second), len(third)))
    step = max(1, SLAB // (len(second) * len(third)))
    for k in range(0, len(first), step):
        slab = np.repeat(plane[None], len(first[k : k + step]), axis=0)
        slab[..., 0] = first[k : k + step, None, None]
        values[k : k + step] = _at(function, slab.reshape(-1, AXES)).reshape(slab.shape[:-1])
    if not (values < 0).any():
        msg = f"function: expected negative values in the box; got {values.min():g} or more"
        raise ValueError(msg)
    if not (values >= 0).any():
        msg = f"function: expected values not below 0 in the box; got {values.max():g} or less"
        raise ValueError(msg)
    return values


def _at(function: Function, points: Array) -> Array:
    with about("function"):
        found = np.asarray(function(points), dtype=np.float64)
    if found.shape != (len(points),) or not np.isfinite(found).all():
        what = "numbers that are not finite" if found.shape == (len(points),) else found.shape
        msg = f"function: expected a finite number for each of {len(points)} points; got {what}"
        raise ValueError(msg)
    return found


def layer(values: Any, axis: int, index: int) -> Any:
    """Return one layer of a grid of values, a view."""
    return np.moveaxis(values, axis, 0)[index]


def check_ends(values: Array, box: Array, wraps: Mask) -> None:
    """Raise for values that differ at the ends of a periodic axis or are negative at other ends.

    Raises
    ------
    ValueError
        Naming the axis.
    """
    for axis in range(AXES):
        ends = layer(values, axis, 0), layer(values, axis, -1)
        if wraps[axis]:
            apart = float(abs(ends[1] - ends[0]).max())
            if apart > 1e-8 * abs(values).max():
                msg = (
                    f"periodic: expected the same values at both ends of axis {axis}; "
                    f"got some that differ by {apart:g}"
                )
                raise ValueError(msg)
            continue
        for end, word, place in zip(ends, ("lower", "upper"), box[axis], strict=True):
            if (end < 0).any():
                msg = (
                    f"bounds: expected a region inside the box; "
                    f"it reaches the {word} end {place:g} of axis {axis}"
                )
                raise ValueError(msg)


def crossings(
    function: Function, values: Array, start: Indices, end: Indices, low: Array, spacing: Array
) -> Array:
    """Return the zeros of ``f`` on edges of the grid, as fractions of the edges.

    False position with the Illinois rule: an end retained twice in a row has its value halved, so
    that the other end moves, too.
    """
    cells = np.array(values.shape) - 1
    # Edges in the last layer of a periodic axis are evaluated in the first, so that seams match.
    base, step = low + (start % cells) * spacing, (end - start) * spacing
    first, second = values[tuple(start.T)].copy(), values[tuple(end.T)].copy()
    left, right = np.zeros(len(start)), np.ones(len(start))
    between, before = left, np.zeros(len(start), dtype=np.int64)
    for _ in range(FALSE_POSITIONS):
        between = (left * second - right * first) / (second - first)
        found = _at(function, base + between[:, None] * step)
        moved = np.where((found < 0) == (first < 0), 1, -1)
        kept = np.where(moved == before, 0.5, 1.0)
        first = np.where(moved == 1, found, first * kept)
        second = np.where(moved == 1, second * kept, found)
        left = np.where(moved == 1, between, left)
        right = np.where(moved == 1, right, between)
        before = moved
    clearance = 1e-3  # from the ends of the grid edge, as a fraction of it: avoids slivers
    return np.clip(between, clearance, 1 - clearance)

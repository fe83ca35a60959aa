"""Arguments of figures: points, polylines with labels, and points along these."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from polycorner.checks import reals, refuse
from polycorner.polyhedra.faces import project
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.arguments import finite
from polycorner.spaces.manifold import Array


def points(argument: str, given: Any, size: int = 3) -> Array:
    """Return points ``(k, size)``; nothing is none, and a single one may be ``(size,)``.

    Examples
    --------
    >>> points("points", ()).shape, points("points", [1, 2, 3]).shape
    ((0, 3), (1, 3))
    """
    array = reals(argument, given)
    array = np.atleast_2d(array) if array.size else array.reshape(0, size)
    if array.ndim != 2 or array.shape[1] != size:
        refuse(argument, f"points of shape (k, {size})", array.shape)
    return array


def factors(argument: str, given: Any) -> Array:
    """Return three factors of the coordinates."""
    array = finite(reals(argument, given), argument)
    if array.shape != (3,):
        refuse(argument, "three numbers", given)
    return array


def labelled(argument: str, given: Any) -> list[tuple[str, Array]]:
    """Return pairs of a label and finite numbers.

    Examples
    --------
    >>> labelled("minima", [("A", [1, 2])])
    [('A', array([1., 2.]))]
    """
    return [pair(argument, entry) for entry in several(argument, given)]


def pair(argument: str, entry: Any) -> tuple[str, Array]:
    """Return a label and finite numbers."""
    if not isinstance(entry, tuple) or len(entry) != 2 or not isinstance(entry[0], str):
        refuse(argument, "pairs of a label and numbers", entry, TypeError)
    return entry[0], finite(reals(argument, entry[1]), argument)


def several(argument: str, given: Any) -> Iterable[Any]:
    """Return what can be looked through, entry by entry."""
    if isinstance(given, str | bytes | Mapping) or not isinstance(given, Iterable):
        refuse(argument, "a sequence", given, TypeError)
    return given


def sampled(
    polyhedron: Polyhedron, line: Array, rows: Sequence[int], count: int
) -> tuple[Array, Array]:
    """Return points of a polyline ``(k, n)`` at equal steps of arc length, and the arc lengths.

    Lengths are in units of the scales.  A point of a chord is off an edge by the sagitta; Newton
    steps close the functions of the rows again.
    """
    scales = polyhedron.manifold.scale_array
    steps = np.linalg.norm(np.diff(line, axis=0) / scales, axis=1)
    lengths = np.concatenate([[0.0], np.cumsum(steps)])
    moments = np.linspace(0, lengths[-1], count)
    places = np.stack([np.interp(moments, lengths, column) for column in line.T], axis=-1)
    places = np.asarray(polyhedron.manifold.onto(places))
    quotient = Quotient(polyhedron)
    for k in range(1, count - 1):
        places[k] = project(quotient, places[k], rows).point.q
    return places, moments

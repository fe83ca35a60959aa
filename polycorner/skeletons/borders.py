"""Boundaries of two-dimensional faces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polycorner.skeletons.points import Quotient
from polycorner.spaces.manifold import Array
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class Border(Value):
    """The boundary of a two-dimensional face.

    Attributes
    ----------
    quotient : Quotient
        The polyhedron modulo its symmetry.
    active : frozenset of int
        Functions that vanish on the face.
    seeds : (k, n) array
        Points of the face or of its boundary.
    edges : tuple of (frozenset of int, (k, n) array, bool)
        Active functions and points of every edge around it, and whether it closes by itself.
    corners : tuple of pairs of (frozenset of int, (2, n) array)
        For every corner of the face and both of its edges there, the active functions, and a point
        of the edge with the direction away from the corner.
    curves : int
        Number of boundary curves.
    """

    quotient: Quotient
    active: frozenset[int]
    seeds: Array
    edges: tuple[tuple[frozenset[int], Array, bool], ...]
    corners: tuple[tuple[tuple[frozenset[int], Array], tuple[frozenset[int], Array]], ...]
    curves: int


def seeds_of(edges: Sequence[Array]) -> Array:
    """Return points of edges that a net starts from."""
    return np.concatenate([points[1:-1][:: max(1, len(points) // 40)] for points in edges])

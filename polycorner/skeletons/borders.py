"""Boundaries of two-dimensional faces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.manifold import Array
from polycorner.values import Value


@dataclass(frozen=True, eq=False)
class Tip(Value):
    """A corner of a face whose tangents there do not tell the face.

    Attributes
    ----------
    point : (n,) array
        The corner.
    near : (n,) array
        A point of the face, or of an edge around it, at a small distance.
    ways : tuple of (n,) arrays
        Scaled directions of the edges of the face there; none where it goes around.
    sampled : bool
        Whether ``near`` lies inside the face, so that it can be followed around the corner.
    pointed : bool
        Whether the gradients of the functions that vanish on the face are dependent there.
    """

    point: Array
    near: Array
    ways: tuple[Array, ...]
    sampled: bool
    pointed: bool


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
        Number of boundary curves, without those that are one point.
    tips : tuple of Tip
        Corners that are not told by tangents.
    """

    quotient: Quotient
    active: frozenset[int]
    seeds: Array
    edges: tuple[tuple[frozenset[int], Array, bool], ...]
    corners: tuple[tuple[tuple[frozenset[int], Array], tuple[frozenset[int], Array]], ...]
    curves: int
    tips: tuple[Tip, ...] = ()


def balls_about(tips: Sequence[Tip]) -> list[tuple[Array, Array]]:
    """Return centres of balls about tips, and points outside them."""
    return [(tip.point, tip.near) for tip in tips]


def seeds_of(edges: Sequence[Array]) -> Array:
    """Return points of edges that a net starts from."""
    return np.concatenate([points[1:-1][:: max(1, len(points) // 40)] for points in edges])

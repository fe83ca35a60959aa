"""Test polyhedra for the statements of appendix B, and neighbourhoods of their points.

Near a point a chart maps a polyhedron to its local model, the cone that the gradients of its active
functions cut out, piece by piece. The hyperplanes of these functions divide the space into cells,
one for each sign vector that occurs; on a cell the stratum is constant, so that one point of each
cell determines the strata near the point.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, Skeleton, Stratum, skeleton, stratum_at
from polycorner.dumbbells import DumbbellPair, pair_atlas
from polycorner.models import Tutorial

if TYPE_CHECKING:
    import sympy

    from polycorner.toolkit import Array

PLANE, SPACE, FOUR = (Manifold.euclidean(names) for names in ("x y", "x y z", "x y z w"))
Points = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Example:
    """A polyhedron, points of it, at least one of every stratum, and whether it is connected."""

    name: str
    polyhedron: Polyhedron
    points: "tuple[Array, ...]"
    connected: bool


@dataclass(frozen=True)
class Spot:
    """A point of an example and its neighbourhood.

    Attributes
    ----------
    example : Example
        Example that contains the point.
    stratum : Stratum
        Stratum of the point according to the library.
    cells : tuple of (int, bool)
        For every cell of the polyhedron around the point, the dimension of its stratum, and
        whether all active functions vanish on it.
    """

    example: Example
    stratum: Stratum
    cells: tuple[tuple[int, bool], ...]

    @property
    def nearby(self) -> set[int]:
        """Dimensions of the strata in whose closures the point lies."""
        return {dimension for dimension, _ in self.cells}

    @property
    def is_locally_convex(self) -> bool:
        """Whether the polyhedron is a single cone near the point."""
        return len(self.stratum.pieces) == 1


# --------------------------------------------------------------------------------------- examples


def linear(name: str, polyhedron: Polyhedron, *points: Sequence[float]) -> Example:
    """Return a linear example; it is connected if all its convex pieces share the first point."""
    first, everywhere = polyhedron.values(points[0]), np.ones(len(polyhedron.names))
    shared, pieces = (polyhedron.selections(list(at)) for at in (first, everywhere))
    assert not polyhedron.hessians(points[0]).any()
    return Example(name, polyhedron, tuple(map(np.array, points)), len(shared) == len(pieces))


def plane_sets(x: "sympy.Expr", y: "sympy.Expr") -> dict[str, tuple[Any, Points]]:
    """Return linear sets in two coordinates, and points of all their strata."""
    segment = AllOf(x, 1 - x, y, -y)
    return {
        "a segment in the plane": (segment, ((0, 0), (0.5, 0), (1, 0))),
        "a square": (AllOf(x, 1 - x, y, 1 - y), ((0, 0), (0.5, 0), (0.5, 0.5), (1, 1))),
        "a half-plane with a segment attached": (
            AnyOf(-x, segment),
            ((0, 0), (-1, 0), (0, 1), (0.5, 0), (1, 0)),
        ),
        "two opposite quadrants": (
            AnyOf(AllOf(x, y), AllOf(-x, -y)),
            ((0, 0), (1, 0), (1, 1), (0, -1)),
        ),
    }


def linear_examples() -> Iterator[Example]:
    """Yield polyhedra that are their own local models, convex or not."""
    for name, (tree, points) in plane_sets(*PLANE.symbols).items():
        yield linear(name, Polyhedron(PLANE, tree), *points)
    x, y, z = SPACE.symbols
    pyramid = Polyhedron(SPACE, AllOf(1 - x - z, 1 + x - z, 1 - y - z, 1 + y - z, z))
    places = ((0, 0, 1), (0.5, 0.5, 0.5), (0.5, 0, 0.5), (1, 1, 0), (0, 0, 0.5))
    yield linear("a pyramid with four sides", pyramid, *places)
    x, y, z, w = FOUR.symbols
    planes = Polyhedron(FOUR, AnyOf(AllOf(x, -x, y, -y), AllOf(z, -z, w, -w)))
    cross = ((0, 0, 0, 0), (1, 0, 0, 0), (0, 0, 0, 1))
    yield linear("two planes that meet in a point of $\\mathbb{R}^4$", planes, *cross)


@cache
def examples() -> tuple[Example, ...]:
    """Return linear sets, the region of the figure, and both kinds of corner of the pair."""
    region = Tutorial()
    sides = region.sides(3).values()
    points = (*region.corners().values(), *(side[1] for side in sides), np.zeros(2))
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=math.inf)
    atlas = pair_atlas(pair)
    contacts = {len(corner.active): corner.point for corner in atlas.skeleton.corners}
    return (
        *linear_examples(),
        Example(
            "the region of the figure", region.polyhedron, points, in_one_piece(region_atlas())
        ),
        Example(
            "a pair of dumbbells in the plane",
            pair.polyhedron,
            tuple(contacts.values()),
            atlas.components[6] == 1,
        ),
    )


@cache
def region_atlas() -> Skeleton:
    """Return corners, edges and faces of the region of the figure."""
    region = Tutorial()
    return skeleton(region.polyhedron, region.starts(np.random.default_rng(0), 3))


def in_one_piece(atlas: Skeleton) -> bool:
    """Whether the highest stratum is connected."""
    return atlas.components[max(atlas.components)] == 1


# ------------------------------------------------------------------------------- the strata near by


@cache
def spots() -> tuple[Spot, ...]:
    """Return every point of the examples with its neighbourhood."""
    return tuple(_spot(example, point) for example in examples() for point in example.points)


def _spot(example: Example, point: "Array") -> Spot:
    D = example.polyhedron
    stratum = stratum_at(D, point)
    rows = D.gradients(point) * D.manifold.scale_array
    active = [D.names.index(name) for name in stratum.active]
    away = np.sign(D.values(point)).astype(int)
    cells = []
    for signs in _cells(rows[active]):
        away[active] = signs
        if pieces := D.signs_to_pieces(away.tolist()):
            mattering = sorted(set().union(*pieces))
            dimension = D.dimension - _rank(rows[mattering])
            cells.append((dimension, not any(signs)))
    return Spot(example, stratum, tuple(cells))


def _rank(rows: "Array") -> int:
    return int(np.linalg.matrix_rank(rows, tol=1e-6)) if len(rows) else 0


def _cells(rows: "Array") -> Iterator[tuple[int, ...]]:
    """Yield the sign vectors that occur: those of ``a_i d`` for all directions ``d``."""
    units = rows / np.linalg.norm(rows, axis=1, keepdims=True) if len(rows) else rows
    # Functions with the same hyperplane have the same sign, up to orientation.
    first = [
        next(j for j in range(i + 1) if np.allclose(abs(units[i] @ units[j]), 1))
        for i in range(len(units))
    ]
    sides = [round(float(units[i] @ units[j])) for i, j in enumerate(first)]
    planes = sorted(set(first))
    for chosen in product((-1, 0, 1), repeat=len(planes)):
        if _occurs(units[planes], chosen):
            by_plane = dict(zip(planes, chosen, strict=True))
            yield tuple(side * by_plane[j] for side, j in zip(sides, first, strict=True))


def _occurs(units: "Array", signs: Sequence[int]) -> bool:
    """Whether some direction has these signs, by a linear programme for the least slope."""
    from scipy.optimize import linprog

    sides = np.array(signs)
    strict, flat = units[sides != 0] * sides[sides != 0][:, None], units[sides == 0]
    if not len(strict):
        return True
    n = units.shape[1]
    found = linprog(
        [0.0] * n + [-1.0],
        A_ub=np.hstack([-strict, np.ones((len(strict), 1))]),
        b_ub=np.zeros(len(strict)),
        A_eq=np.hstack([flat, np.zeros((len(flat), 1))]) if len(flat) else None,
        b_eq=np.zeros(len(flat)) if len(flat) else None,
        bounds=[(-1, 1)] * (n + 1),
    )
    return found.fun is not None and bool(-found.fun > 1e-6)

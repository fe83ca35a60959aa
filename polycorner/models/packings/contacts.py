"""Gaps of neighbouring discs or spheres in a periodic box that are inflated together."""

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import Group, SparseRows
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array, Manifold

if TYPE_CHECKING:
    import sympy

AXES = "xyz"


@lru_cache(maxsize=2)
def gap(dimension: int) -> Family:
    """Return ``|x_2 - x_1 + v| - s sigma``: the gap of two bodies that are inflated by ``s``.

    ``sigma`` is the sum of their radii, ``v`` the vector of the box to the image that is meant.
    """
    from polycorner.formulas.cache import source_key

    axes = AXES[:dimension]
    variables = (*[f"{a}1" for a in axes], *[f"{a}2" for a in axes], "s")
    key = repr((source_key(__name__), dimension))
    parameters = (*[f"v{a}" for a in axes], "sigma")
    formulas = _plane if dimension == 2 else _space
    return Family(("gap",), variables, parameters, formulas, key, "length")


def _plane() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    return _formulas(AXES[:2])


def _space() -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    return _formulas(AXES)


def _formulas(axes: str) -> "tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]":
    import sympy

    def symbol(name: str) -> "sympy.Symbol":
        return sympy.Symbol(name, real=True)

    squares = [(symbol(f"{a}2") - symbol(f"{a}1") + symbol(f"v{a}")) ** 2 for a in axes]
    distance = sympy.sqrt(sum(squares[1:], squares[0]))
    return {}, {"gap": distance - symbol("s") * symbol("sigma")}


def neighbours(
    centres: Array, radii: Array, inflation: float, box: float, reach: float
) -> tuple[NDArray[np.int64], Array, Array]:
    """Return the pairs ``(m, 2)`` with gaps up to ``reach``, their images and their gaps.

    Of every pair the nearest image is taken; ``x_j - x_i + image`` is the vector between them.
    """
    tree = cKDTree(centres % box, boxsize=np.full(centres.shape[1], box))
    longest = min(2 * inflation * radii.max() + reach, box / 2)
    pairs = tree.query_pairs(longest, output_type="ndarray").astype(np.int64).reshape(-1, 2)
    between = centres[pairs[:, 1]] - centres[pairs[:, 0]]
    images = -box * np.round(between / box)
    gaps = np.linalg.norm(between + images, axis=1) - inflation * radii[pairs].sum(axis=1)
    near = gaps <= reach
    order = np.lexsort(pairs[near].T[::-1])
    return pairs[near][order], images[near][order], gaps[near][order]


def rows_of(
    pairs: NDArray[np.int64], images: Array, sums: Array, bodies: int, dimension: int
) -> SparseRows:
    """Return the gaps of pairs as functions of all centres and the inflation, in this order.

    ``sums`` are those of the two radii of each pair.
    """
    places = pairs[:, :, None] * dimension + np.arange(dimension)
    n = bodies * dimension + 1
    reads = np.column_stack([places.reshape(len(pairs), 2 * dimension), np.full(len(pairs), n - 1)])
    parameters = np.column_stack([images, sums])
    group = Group.separate(gap(dimension), reads, parameters)
    return SparseRows((group,) if len(pairs) else (), len(pairs), n)


def gaps_polyhedron(
    radii: Array, box: float, centres: Array, inflation: float, held: int, reach: float = 0.5
) -> Polyhedron:
    """Return the gaps of pairs up to ``reach`` mean diameters apart, as functions of a manifold.

    The equations hold one body in place, since a translation of all changes nothing.
    """
    count, d = centres.shape
    diameter = float(2 * inflation * radii.mean())
    names = [f"{a}{i}" for i in range(1, count + 1) for a in AXES[:d]]
    manifold = Manifold(
        (*names, "s"),
        scales=(*[diameter] * (count * d), inflation),
    )
    pairs, images, _ = neighbours(centres, radii, inflation, box, reach * diameter)
    parts = []
    for (i, j), image in zip(pairs.tolist(), images.tolist(), strict=True):
        reads = [*names[i * d : (i + 1) * d], *names[j * d : (j + 1) * d], "s"]
        parameters = [*image, float(radii[i] + radii[j])]
        label = f"{i + 1}-{j + 1}"
        parts.append(
            SmoothFunction.member(
                gap(d), "gap", manifold, parameters=parameters, reads=reads, label=label
            )
        )
    symbols = manifold.symbols[held * d : (held + 1) * d]
    pins = {
        f"hold {names[held * d + axis]}": symbol - float(centres[held, axis])
        for axis, symbol in enumerate(symbols)
    }
    return Polyhedron(manifold, AllOf(*parts), pins)

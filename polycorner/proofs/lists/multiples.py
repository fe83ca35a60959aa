"""Inequalities that say the same: positive multiples of each other, of which one is kept.

Where such functions vanish their gradients are dependent, on whole faces.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.proofs.lists.images import expanded

if TYPE_CHECKING:
    from polycorner.formulas.functions import SmoothFunction

PROBES = 4  # points at which functions are compared before their formulas are
CLOSE = 1e-9


def without_multiples(polyhedron: Polyhedron) -> Polyhedron:
    """Return the same set, of functions of which none is seen to be a multiple of another.

    The first of several stands for all of them.
    """
    first = _first(polyhedron)
    if first == list(range(len(first))):
        return polyhedron

    def part(tree: Any) -> Any:
        if isinstance(tree, int):
            return polyhedron.functions[first[tree]]
        parts = list(dict.fromkeys(part(child) for child in tree.children))
        return AnyOf(*parts) if tree.union else AllOf(*parts)

    return Polyhedron(
        polyhedron.manifold,
        [part(polyhedron.tree)],
        list(polyhedron.stated),
        annotations=polyhedron.annotations,
    )


def _first(polyhedron: Polyhedron) -> list[int]:
    """Return for each function the first of which it is a positive multiple."""
    rng = np.random.default_rng(0)
    size = polyhedron.manifold.size
    points = rng.uniform(-1, 1, (PROBES, size)) * polyhedron.manifold.scale_array
    with np.errstate(all="ignore"):
        values = polyhedron.values(points).T
        units = values / np.linalg.norm(values, axis=1, keepdims=True)
    found: list[int] = []
    for j, f in enumerate(polyhedron.functions):
        alike = (i for i in range(j) if found[i] == i and abs(units[i] - units[j]).max() < CLOSE)
        found.append(next((i for i in alike if _is_multiple(f, polyhedron.functions[i])), j))
    return found


def _is_multiple(f: "SmoothFunction", g: "SmoothFunction") -> bool:
    """Whether expanded formulas show that one function is a positive multiple of another."""
    import sympy

    one, other = expanded(f), expanded(g)
    ratio = sympy.cancel(one / other) if other != 0 else sympy.Integer(0)
    if not (ratio.is_number and ratio.is_positive):
        return False
    return bool(sympy.expand(one - ratio * other, deep=True) == 0)

"""Parameters of formulas as coordinates of a search that nothing moves along.

The functions become functions of the coordinates and the chosen parameters.  Directions, faces and
loci are those of the coordinates, at each value of the parameters.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.parametric import lifted_family
from polycorner.minimisation.problem import Problem, pose
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs.lists.domains import Domain
from polycorner.spaces.manifold import Array, Manifold

Interval = tuple[float, float]


def with_parameters(
    problem: Problem,
    found: Domain,
    symmetry: Symmetry | None,
    sides: Mapping[str, Interval],
) -> tuple[Problem, Domain, Symmetry | None]:
    """Return problem, domain and symmetry with some parameters as additional coordinates.

    Raises
    ------
    ValueError
        If a parameter has the name of a coordinate.
    """
    d, names = problem.polyhedron, tuple(sides)
    taken = [name for name in names if name in d.manifold.names]
    if taken:
        checks.refuse("parameters", "names that no coordinate has", ", ".join(taken))
    extended = d.manifold * Manifold(names, (math.inf,) * len(names))
    functions = [_lifted(f, extended, frozenset(names)) for f in problem.functions]
    m = problem.inequalities
    everything = pose(
        Polyhedron(extended, _tree(d.tree, functions[:m]), functions[m:-1]), functions[-1]
    )
    n, ends = d.manifold.size, np.array(list(sides.values()))
    lower, upper = (np.r_[side, ends[:, k]] for k, side in enumerate((found.lower, found.upper)))
    places = tuple(range(n, n + len(names)))
    return everything, Domain(extended, lower, upper, places), _extended(symmetry, n, len(names))


def _lifted(f: SmoothFunction, manifold: Manifold, chosen: frozenset[str]) -> SmoothFunction:
    family = lifted_family(f.family, frozenset({f.member_name}), chosen)
    own = tuple(p for p in f.family.parameters if p in chosen)
    values = dict(zip(f.family.parameters, f.parameters, strict=True))
    return SmoothFunction.member(
        family,
        f.member_name,
        manifold,
        parameters=[values[p] for p in family.parameters],
        reads=[*(manifold.names[i] for i in f.reads), *own],
        label=f.name,
    )


def _tree(tree: Any, functions: "list[SmoothFunction]") -> Any:
    if isinstance(tree, int):
        return functions[tree]
    kind = AnyOf if tree.union else AllOf
    return kind(*[_tree(child, functions) for child in tree.children])


def _extended(symmetry: Symmetry | None, n: int, count: int) -> Symmetry | None:
    if symmetry is None:
        return None

    def carried(apply: Any) -> Any:
        def moved(q: Array) -> Array:
            return np.concatenate([np.asarray(apply(q[..., :n])), q[..., n:]], axis=-1)

        return moved

    elements = tuple(Element(carried(e.apply), e.names) for e in symmetry.elements)
    fields = [f if isinstance(f, Mapping) else [*f, *[0] * count] for f in symmetry.fields]
    return Symmetry(fields=fields, elements=elements)

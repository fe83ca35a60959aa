"""Equations of the spheres and rotations of a manifold: their vectors have the length one.

With them a point of ``S^k`` is one of ``R^(k+1)`` with an equation, which polyhedra, conditions,
walks and proofs treat as they treat any other.
"""

from functools import cache

from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.spaces.manifold import Manifold


def normalisations(manifold: Manifold) -> tuple[SmoothFunction, ...]:
    """Return ``(|u|^2 - 1) / 2`` for the vector ``u`` of every sphere and rotation."""
    return tuple(
        SmoothFunction.member(
            _family(len(f.names)), "norm", manifold, reads=f.names, label=f"|{f.name}|"
        )
        for f in manifold.factors
    )


@cache
def _family(k: int) -> Family:
    import sympy

    u = sympy.symbols([f"u{i}" for i in range(k)], real=True)
    return Family.of({"norm": (sum(x**2 for x in u) - 1) / 2}, [x.name for x in u])

"""Functions of rotations: whether they are the same at opposite quaternions."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.formulas.expressions import SAMPLES, SPREAD
from polycorner.spaces.manifold import Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy


def check_even(
    name: str, expression: "sympy.Expr", manifold: Manifold, parameters: Mapping[str, float]
) -> None:
    """Raise ValueError for an expression that differs between opposite quaternions.

    Where it does not stay the same expression, it is evaluated at random rotations.

    Parameters
    ----------
    name : str
        Name of the function in the error.
    expression : sympy.Expr
        In the coordinates of the manifold and in parameters.
    manifold : Manifold
    parameters : mapping from str to float
        Values of the other symbols.
    """
    for factor in manifold.factors:
        quaternion = manifold.symbols[factor.at]
        if not factor.turns or expression.free_symbols.isdisjoint(quaternion):
            continue
        opposite = expression.xreplace({x: -x for x in quaternion})
        if opposite != expression and _differ(expression, opposite, manifold, parameters):
            msg = (
                f"{name}: expected a function of the rotation, the same at the quaternions "
                f"({', '.join(factor.names)}) and -({', '.join(factor.names)}), such as one of "
                f"the entries of matrix({factor.name!r}); got {expression}"
            )
            raise ValueError(msg)


def _differ(one: Any, other: Any, manifold: Manifold, parameters: Mapping[str, float]) -> bool:
    import sympy

    fixed = {s: parameters[s.name] for s in one.free_symbols if s.name in parameters}
    both = sympy.lambdify(manifold.symbols, [e.xreplace(fixed) for e in (one, other)], "numpy")
    rng = np.random.default_rng(0)
    for u in rng.uniform(-SPREAD, SPREAD, (SAMPLES, manifold.size)):
        with np.errstate(all="ignore"):
            a, b = both(*manifold.onto(u * manifold.scale_array))
        if abs(a - b) > DEFAULT.same / 10 * (1 + abs(a) + abs(b)):
            return True
    return False

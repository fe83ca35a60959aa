"""Checks of functions on a manifold: kinks, and periodicity on circles and rotations."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from polycorner.formulas.bundles import BoundFunction
from polycorner.formulas.expressions import SAMPLES, SPREAD, announce, check_periodic
from polycorner.spaces.manifold import Manifold
from polycorner.tolerances import DEFAULT

if TYPE_CHECKING:
    import sympy

    from polycorner.spaces.manifold import Manifold


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


class Stated(BoundFunction, Protocol):
    """A function of a family with a name, on a manifold."""

    name: str
    manifold: "Manifold"

    @property
    def kinks(self) -> tuple[str, ...]:
        """The parts across which derivatives may jump."""

    @property
    def expression(self) -> "sympy.Expr":
        """The expression in coordinates and parameters."""

    @property
    def parameter_values(self) -> dict[str, float]:
        """The values of its parameters, by name."""


def check_function(function: Stated, *, periodic: bool = True) -> None:
    """Warn of kinks; raise ValueError for a function that should be periodic and is not.

    A section, such as ``sin((a + b) / 2) = 0``, may change its sign, or fix an angle in one chart.
    """
    announce(function.name, function.kinks)
    if periodic and function.manifold.rotations:
        check_even(function.name, function.expression, function.manifold, function.parameter_values)
    circles = function.manifold.circles
    if periodic and circles and not circles.isdisjoint(function.reads):
        family = function.family
        check_periodic(
            function.name,
            family.expression(function.member_name),
            function.manifold,
            dict(zip(family.variables, function.reads, strict=True)),
            dict(zip(family.parameters, function.parameters, strict=True)),
        )

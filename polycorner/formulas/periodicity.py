"""Checks of functions on a manifold: kinks, and periodicity on circles and rotations."""

from typing import TYPE_CHECKING, Protocol

from polycorner.formulas.bundles import Member
from polycorner.formulas.expressions import announce, check_periodic
from polycorner.formulas.signs import check_even

if TYPE_CHECKING:
    import sympy

    from polycorner.spaces.manifold import Manifold


class Stated(Member, Protocol):
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

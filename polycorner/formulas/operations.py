"""The elementary functions of one argument: one table, which all that evaluates formulas reads.

A function has one name in SymPy, in files, in Python's ``math``, in the C library and in Arb.  What
else is known of it is its entry in ``OPERATIONS``: compiled values and enclosures, balls, exact
values, derivatives and power series follow from that.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

# Numbers of some kind with the operations ``const``, ``add``, ``sub``, ``mul``, ``div``, ``neg``
# and ``unary``, as a ``Graph`` has them for its nodes; balls and power series are others.
Algebra = Any

LARGEST_EXPONENT = 600.0  # arguments beyond this of exp, sinh and cosh are given up


@dataclass(frozen=True)
class Operation:
    """An elementary function ``y = f(u)``.

    Attributes
    ----------
    slope : callable
        Returns ``f'(u) d`` from an algebra, ``u``, ``y`` and ``d``.
    known : mapping
        Its rational values at rational arguments.
    shape : str
        ``"increasing"``, ``"decreasing"`` or ``"even"`` and increasing for positive arguments;
        ``"periodic"`` for those whose enclosures are formulas of their own.
    limits : pair of float
        The arguments at which enclosures in double precision are bounded; others are given up.
    values : pair of float or None
        Bounds of all values, where there are any.
    size : float
        Within the limits ``|f| <= 2**size``.
    analytic : (str, callable), optional
        For one that is not analytic everywhere: the reason why it may fail to be on a ball, and
        the condition under which it is analytic on the whole ball.
    cycle : tuple of callable, optional
        The function and its derivatives as functions of floats, for one whose derivatives repeat.
    turns : int, optional
        How many periods a full turn has; 0 for a function without period.
    """

    slope: Callable[[Algebra, Any, Any, Any], Any]
    known: Mapping[Any, int] = field(default_factory=lambda: {0: 0})
    shape: str = "increasing"
    limits: tuple[float, float] = (-math.inf, math.inf)
    values: tuple[float | None, float | None] = (None, None)
    size: float = 2000.0
    analytic: tuple[str, Callable[[Any], bool]] | None = None
    cycle: tuple[Callable[[float], float], ...] = ()
    turns: int = 0

    @property
    def keeps_signs(self) -> bool:
        """Whether values have the signs of the arguments."""
        return self.shape == "increasing" and self.known.get(0) == 0 and self.values[0] != 0


def _arc(g: Algebra, u: Any, d: Any) -> Any:
    return g.div(d, g.unary("sqrt", g.sub(g.const(1), g.mul(u, u))))


def _bell(g: Algebra, u: Any) -> Any:
    height = g.div(g.const(2), g.unary("sqrt", g.const("pi")))
    return g.mul(height, g.unary("exp", g.neg(g.mul(u, u))))


OPERATIONS: dict[str, Operation] = {
    "sin": Operation(
        lambda g, u, _, d: g.mul(g.unary("cos", u), d),
        shape="periodic",
        values=(-1.0, 1.0),
        size=0.0,
        cycle=(math.sin, math.cos, lambda t: -math.sin(t), lambda t: -math.cos(t)),
        turns=1,
    ),
    "cos": Operation(
        lambda g, u, _, d: g.mul(g.neg(g.unary("sin", u)), d),
        known={0: 1},
        shape="periodic",
        values=(-1.0, 1.0),
        size=0.0,
        cycle=(math.cos, lambda t: -math.sin(t), lambda t: -math.cos(t), math.sin),
        turns=1,
    ),
    "tan": Operation(
        lambda g, _, y, d: g.mul(g.add(g.const(1), g.mul(y, y)), d),
        shape="periodic",
        analytic=("a tangent may reach a pole", lambda x: x.cos() != 0),
        turns=2,
    ),
    "asin": Operation(
        lambda g, u, _, d: _arc(g, u, d),
        limits=(-1.0, 1.0),
        size=2.0,
        analytic=("the argument of an arcsine may reach 1 or -1", lambda x: -1 < x < 1),
    ),
    "acos": Operation(
        lambda g, u, _, d: g.neg(_arc(g, u, d)),
        known={1: 0},
        shape="decreasing",
        limits=(-1.0, 1.0),
        values=(0.0, None),
        size=2.0,
        analytic=("the argument of an arccosine may reach 1 or -1", lambda x: -1 < x < 1),
    ),
    "atan": Operation(lambda g, u, _, d: g.div(d, g.add(g.const(1), g.mul(u, u))), size=2.0),
    "sinh": Operation(
        lambda g, u, _, d: g.mul(g.unary("cosh", u), d),
        limits=(-LARGEST_EXPONENT, LARGEST_EXPONENT),
        size=900.0,
        cycle=(math.sinh, math.cosh),
    ),
    "cosh": Operation(
        lambda g, u, _, d: g.mul(g.unary("sinh", u), d),
        known={0: 1},
        shape="even",
        limits=(-LARGEST_EXPONENT, LARGEST_EXPONENT),
        values=(1.0, None),
        size=900.0,
        cycle=(math.cosh, math.sinh),
    ),
    "tanh": Operation(
        lambda g, _, y, d: g.mul(g.sub(g.const(1), g.mul(y, y)), d), values=(-1.0, 1.0), size=0.0
    ),
    "exp": Operation(
        lambda g, _, y, d: g.mul(y, d),
        known={0: 1},
        limits=(-math.inf, LARGEST_EXPONENT),
        values=(0.0, None),
        size=900.0,
        cycle=(math.exp,),
    ),
    "log": Operation(
        lambda g, u, _, d: g.div(d, u),
        known={1: 0},
        limits=(math.ulp(0.0), math.inf),  # positive doubles
        size=11.0,
        analytic=("the argument of a logarithm may reach 0", lambda x: x > 0),
    ),
    "sqrt": Operation(  # its size depends on that of the argument
        lambda g, _, y, d: g.mul(g.mul(g.const(Fraction(1, 2)), g.div(g.const(1), y)), d),
        known={0: 0, 1: 1},
        limits=(0.0, math.inf),
        values=(0.0, None),
        analytic=("the argument of a square root may reach 0", lambda x: x > 0),
    ),
    "erf": Operation(lambda g, u, _, d: g.mul(_bell(g, u), d), values=(-1.0, 1.0), size=0.0),
}

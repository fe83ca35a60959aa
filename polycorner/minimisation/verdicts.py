"""Verdicts on a point and kinds of entrapment: enums whose values are sentences."""

from enum import Enum


class Verdict(Enum):
    """Verdict on a point as a local minimum of an energy on a polyhedron, as a sentence."""

    STRICT_MINIMUM = "strict local minimum: no other point nearby is as low"
    MINIMUM_ALONG_LOCUS = "local minimum, attained along a locus on which the energy is constant"
    WEAK_MINIMUM = "strict local minimum with a weakly active function: its multiplier is zero"
    NOT_STATIONARY = "not a minimum: the energy decreases to first order in a feasible direction"
    SADDLE = "not a minimum: stationary, but the energy decreases to second or higher order"
    NO_MULTIPLIER = (
        "undecided: no multipliers exist, and no direction is seen to lead inward (a cusp, or a "
        "gradient that vanishes)"
    )
    UNDECIDED = (
        "undecided: stationary, but the second order vanishes in a feasible direction, and higher "
        "orders do not decide"
    )
    NOT_SMOOTH = "undecided: a derivative that the conditions need jumps there or is not finite"
    OUTSIDE = "the point does not lie in the polyhedron"
    INFEASIBLE = (
        "no point of the polyhedron was reached: no step lowers the violation to first order"
    )
    UNBOUNDED = "the energy decreases without end, as far as it was followed"
    NOT_ATTAINED = (
        "no minimum is attained: the search goes to infinity while the energy falls towards a bound"
    )
    DOMAIN_EDGE = (
        "the search ends at the edge of the domain of a function, beyond which it has no value or "
        "no derivatives"
    )
    NOT_CONVERGED = "the search stopped before it reached a stationary point"

    @property
    def is_minimum(self) -> bool:
        """Whether the verdict asserts a local minimum."""
        return self in _MINIMA


# Verdicts on a search rather than on the point at which it ended.
SEARCHES = frozenset(
    {Verdict.INFEASIBLE, Verdict.UNBOUNDED, Verdict.NOT_ATTAINED, Verdict.DOMAIN_EDGE}
)
_MINIMA = frozenset({Verdict.STRICT_MINIMUM, Verdict.MINIMUM_ALONG_LOCUS, Verdict.WEAK_MINIMUM})


class Entrapment(Enum):
    """Kind of entrapment of a point by the energy in one direction ([GMBN] app. C)."""

    HALF_V = "half-V"
    HALF_U = "half-U"
    U = "U"
    FREE = "free"
    NONE = "none"

"""The numbers that decide what counts as zero, equal or settled, and the boxes of searches."""

from dataclasses import dataclass
from functools import lru_cache

from polycorner import checks

TOLERANCE = 1e-8
RANK_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Tolerances:
    """The fifteen numbers behind ``tolerance`` and ``rank_tolerance``.

    Distances are in the scale units of the manifold.  Each number is its default times a power of
    ``tolerance / 1e-8`` (:meth:`of`), so that their order is kept: what is *settled* or *held* is
    finer than what is *zero*, which is finer than what is *the same*, and so on.  At the default
    the factor is exactly one.

    Attributes
    ----------
    zero : float
        Distance of a function's zero set up to which the function is active.
    feasible : float
        Violation that is left at the end of a projection.
    held : float
        Size of a function that stays zero along a curve.
    settled : float
        Length of a last step of Newton's method, whose square is rounding.
    same : float
        Distance up to which two points are one.
    near : float
        The same where roots are double.
    stationary : float
        First derivative, relative to a reference, that counts as zero.
    curvature : float
        Second derivative, relative to a reference, that counts as zero.
    level : float
        Relative difference up to which energies are equal.
    rank : float
        Smallest singular value of unit gradients, relative to the largest, that counts.
    dependent : float
        The same at singular points; above the square root of the rounding error.
    alike : float
        Relative difference up to which formulas, or numbers that were given, are the same.
    rounding : float
        Relative size of what is left of numbers that cancel: 450 units of rounding.
    difference : float
        Step of difference quotients.
    unbounded : float
        Distance from the start at which a descent counts as endless.
    """

    zero: float = 1e-8
    feasible: float = 1e-10
    held: float = 1e-11
    settled: float = 1e-8
    same: float = 1e-6
    near: float = 1e-4
    stationary: float = 1e-8
    curvature: float = 1e-8
    level: float = 1e-9
    rank: float = 1e-6
    dependent: float = 1e-7
    alike: float = 1e-9
    rounding: float = 1e-13
    difference: float = 1e-6
    unbounded: float = 1e8

    @classmethod
    def of(
        cls, tolerance: float = TOLERANCE, rank_tolerance: float = RANK_TOLERANCE
    ) -> "Tolerances":
        """Return the numbers that belong to the two that verbs take.

        Raises
        ------
        TypeError, ValueError
            Unless ``0 < tolerance < 1`` and ``0 < rank_tolerance < 1``.
        """
        checks.real("tolerance", tolerance, above=0, below=1)
        checks.real("rank_tolerance", rank_tolerance, above=0, below=1)
        return _belonging(float(tolerance), float(rank_tolerance))

    @property
    def corner(self) -> float:
        """Distance up to which two corners are one: between ``same`` and ``near``."""
        return float(1e-5 * self._factor**0.625)

    @property
    def beside(self) -> float:
        """Distance of points that a singular point is compared with."""
        return float(1e-3 * self._factor**0.375)

    @property
    def multiplier(self) -> float:
        """Multiplier, relative to the largest, that counts as zero."""
        return self.stationary / 10

    @property
    def flat(self) -> float:
        """Second derivative up to which higher orders are looked at."""
        return 30 * self.curvature

    @property
    def _factor(self) -> float:
        return self.zero / TOLERANCE


@dataclass(frozen=True)
class SearchOptions:
    """The boxes in which minima and corners are searched, and the steps that are tried there.

    Lengths are in the scale units of the manifold.

    Attributes
    ----------
    first_box, least_box : float
        Box of the first step of a descent by convex models, and the box in which one has stalled.
    least_descent : float
        The latter for a descent in a sparse polyhedron.
    finest_box : float
        Least box after a step that was accepted there.
    first_restoring : float
        Box of the first step towards a feasible point.
    wider, wider_linear : float
        Next box, in units of the displacement, with a quadratic and with a linear model.
    promised : float
        Part of the decrease that a model promises, with which a step is accepted.
    pushes : tuple of float
        Lengths of steps off a saddle, or along a line that may be free, the longest first.
    resolution : float
        Largest side of boxes that a list leaves undecided.
    max_boxes : int
        Boxes after which a list is given up.
    widest : float
        Reach of the widest box about a point in which a list proves that it is the only one.
    surroundings : float
        Sides of the largest region that is tried, over those of the box that it is tried for.
    small_box : float
        Side of boxes in which a list seeks singular corners.
    sharp_box : float
        Reach of the box whose image encloses a locus.
    """

    first_box: float = 0.25
    least_box: float = 1e-9
    least_descent: float = 1e-10
    finest_box: float = 1e-8
    first_restoring: float = 0.5
    wider: float = 4.0
    wider_linear: float = 3.0
    promised: float = 1e-4
    pushes: tuple[float, ...] = (0.1, 0.01, 0.001)
    resolution: float = 1e-6
    max_boxes: int = 10_000_000
    widest: float = 2.0
    surroundings: float = 64.0
    small_box: float = 0.05
    sharp_box: float = 1e-9


DEFAULT = Tolerances()
SEARCH = SearchOptions()


@lru_cache(maxsize=64)
def _belonging(tolerance: float, rank_tolerance: float) -> Tolerances:
    s = tolerance / TOLERANCE
    return Tolerances(
        zero=tolerance,
        feasible=max(1e-10 * s, Tolerances.rounding),
        held=max(1e-11 * s**0.75, Tolerances.rounding),
        same=1e-6 * s**0.75,
        near=1e-4 * s**0.5,
        stationary=tolerance,
        curvature=tolerance,
        level=1e-9 * s,
        rank=rank_tolerance,
        dependent=rank_tolerance / 10,
    )

"""The numbers that decide what counts as zero, equal, dependent or settled, in one value."""

from dataclasses import dataclass

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
        s = tolerance / TOLERANCE
        return cls(
            zero=tolerance,
            feasible=max(1e-10 * s, cls.rounding),
            held=max(1e-11 * s**0.75, cls.rounding),
            same=1e-6 * s**0.75,
            near=1e-4 * s**0.5,
            stationary=tolerance,
            curvature=tolerance,
            level=1e-9 * s,
            rank=rank_tolerance,
            dependent=rank_tolerance / 10,
        )

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


DEFAULT = Tolerances()
STRICT = Tolerances.of(1e-10)
MEASURED = Tolerances.of(1e-5)

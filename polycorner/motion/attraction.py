"""Attraction at short range, along gaps."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from polycorner.checks import real
from polycorner.formulas.expressions import as_expression
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy


@dataclass(frozen=True)
class Attraction(Checked):
    """A short-range attraction along a gap ``g``, with a finite energy of adhesion.

    The force is ``a`` along ``-grad g`` where the gap is closed, and falls to zero at the range
    ``d``: ``a (1 - g/d)`` for ``0 <= g <= d``.  It has the energy ``-a d (1 - g/d)^2 / 2``, so
    that ``a d / 2`` parts the two.  The force of a contact that is closed bears it: the contact
    opens where more than ``a`` pulls at it, and friction acts on what it presses with, the pull
    included, as between wet grains ([Radjai]).  The smaller the range is, the less depends on it
    but the energy.

    Parameters
    ----------
    force : float
        ``a >= 0``; a force if the gap is a length.
    range : float
        ``d > 0``, in the unit of the gap.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    force: float
    range: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "force", real("force", self.force, least=0))
        object.__setattr__(self, "range", real("range", self.range, above=0))
        super().__post_init__()

    def energy(self, gap: "sympy.Expr") -> "sympy.Expr":
        """Return the energy as a function of a gap, to be added to a potential.

        Examples
        --------
        >>> from polycorner import Manifold
        >>> (y,) = Manifold.euclidean("y").symbols
        >>> energy = Attraction(force=3.0, range=0.5).energy(y)
        >>> [float(energy.subs(y, gap)) for gap in (0.0, 0.25, 0.5, 2.0)]
        [-0.75, -0.1875, 0.0, 0.0]
        """
        import sympy

        gap = as_expression("gap", gap)
        # Of one maximum, so that the slope where the gap closes is the force, however it is taken.
        open_ = sympy.Max(gap, 0, evaluate=gap.is_number)
        near = sympy.Max(1 - open_ / self.range, 0, evaluate=gap.is_number)
        return self.force * (gap - open_) - self.force * self.range / 2 * near**2

"""Numbers with their derivatives along a direction, for third derivatives of functions."""

from typing import Any

from flint import arb

from .balls import NAN, ZERO


def parts(x: Any) -> tuple[Any, Any]:
    """Return value and derivative of a jet, or of a number that does not change."""
    return (x.value, x.slope) if isinstance(x, Jet) else (arb(x), ZERO)


class Jet:
    """A value on a box and its derivative along a direction, ``x + x' d`` with ``d^2 = 0``.

    Both may be jets themselves, of which the slopes of slopes are second derivatives.
    """

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    # --------------------------------------------------------------------------------- comparisons

    def __lt__(self, other: Any) -> bool:
        return bool(self.value < parts(other)[0])

    def __gt__(self, other: Any) -> bool:
        return bool(self.value > parts(other)[0])

    def __ne__(self, other: object) -> bool:
        return bool(self.value != parts(other)[0])

    def __eq__(self, other: object) -> bool:
        return bool(self.value == parts(other)[0])

    __hash__ = None  # type: ignore[assignment]

    def is_exact(self) -> bool:
        return bool(self.value.is_exact() and self.slope == 0)

    def is_integer(self) -> bool:
        return bool(self.value.is_integer())

    # ---------------------------------------------------------------------------------- arithmetic

    def __neg__(self) -> "Jet":
        return Jet(-self.value, -self.slope)

    def __add__(self, other: Any) -> "Jet":
        x, dx = parts(other)
        return Jet(self.value + x, self.slope + dx)

    __radd__ = __add__

    def __sub__(self, other: Any) -> "Jet":
        x, dx = parts(other)
        return Jet(self.value - x, self.slope - dx)

    def __rsub__(self, other: Any) -> "Jet":
        return Jet(*parts(other)) - self

    def __mul__(self, other: Any) -> "Jet":
        x, dx = parts(other)
        return Jet(self.value * x, self.value * dx + self.slope * x)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> "Jet":
        x, dx = parts(other)
        value = self.value / x
        return Jet(value, (self.slope - value * dx) / x)

    def __rtruediv__(self, other: Any) -> "Jet":
        return Jet(*parts(other)) / self

    def __pow__(self, other: Any) -> "Jet":
        """Return a power; a whole exponent that does not change has a derivative everywhere."""
        x, (y, dy) = self.value, parts(other)
        if y == 0 and dy == 0:
            return Jet(arb(1), ZERO)
        whole = dy == 0 and y.is_exact() and y.is_integer()
        if not (whole or x > 0):
            return Jet(NAN, NAN)
        along = y * x ** (y - 1) * self.slope
        return Jet(x**y, along if whole else along + x**y * x.log() * dy)

    def __rpow__(self, other: Any) -> "Jet":
        return Jet(*parts(other)) ** self

    # ------------------------------------------------------------------------ elementary functions

    def sqrt(self) -> "Jet":
        root = self.value.sqrt()
        return Jet(root, self.slope / (2 * root))

    def exp(self) -> "Jet":
        value = self.value.exp()
        return Jet(value, value * self.slope)

    def log(self) -> "Jet":
        return Jet(self.value.log(), self.slope / self.value)

    def sin(self) -> "Jet":
        return Jet(self.value.sin(), self.value.cos() * self.slope)

    def cos(self) -> "Jet":
        return Jet(self.value.cos(), -self.value.sin() * self.slope)

    def tan(self) -> "Jet":
        value = self.value.tan()
        return Jet(value, (1 + value * value) * self.slope)

    def sinh(self) -> "Jet":
        return Jet(self.value.sinh(), self.value.cosh() * self.slope)

    def cosh(self) -> "Jet":
        return Jet(self.value.cosh(), self.value.sinh() * self.slope)

    def tanh(self) -> "Jet":
        value = self.value.tanh()
        return Jet(value, (1 - value * value) * self.slope)

"""Products of lines and circles, with a length scale for each coordinate."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.checks import refuse
from polycorner.values import Value, read_only

if TYPE_CHECKING:
    import sympy

Array = NDArray[np.float64]

FEW = 24
_IDENTIFIER = re.compile(r"[^\W\d]\w*")


@dataclass(frozen=True)
class Manifold(Value):
    """The configuration manifold ``X``: a product of lines and circles with one chart.

    Parameters
    ----------
    names : sequence of str
        Coordinate names, distinct identifiers.
    periods : sequence of float, optional
        Period of each coordinate: a positive number for a circle, ``inf`` (default) for a line.
    scales : sequence of float, optional
        Unit displacement of each coordinate (default 1), so that millimetres and angles can
        share a vector.  Every tolerance of the package is measured in these units.
    units : sequence of str, optional
        Unit of each coordinate, such as ``"mm"``, and ``""`` where none is stated; default
        ``"rad"`` for circles of period ``2 pi``.  Tables and files show it; two manifolds that
        differ in nothing else are equal.

    Raises
    ------
    ValueError
        If names repeat or are no identifiers, if a period or scale is not positive, or if there is
        not one unit for each coordinate.

    Examples
    --------
    >>> M = Manifold(("phi", "eta"), periods=(2 * math.pi, math.inf))
    >>> M.difference([3.0, 1.0], [-3.0, 0.0]).round(3).tolist()
    [-0.283, 1.0]
    >>> (M * M).names
    ('phi1', 'eta1', 'phi2', 'eta2')
    """

    names: tuple[str, ...]
    periods: tuple[float, ...] = ()
    scales: tuple[float, ...] = ()
    units: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        names = _names(self.names)
        n = len(names)
        object.__setattr__(self, "names", names)
        periods = _positive("periods", _given(self.periods, math.inf, n), n, finite=False)
        scales = _positive("scales", _given(self.scales, 1.0, n), n, finite=True)
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "units", _units(self.units, periods))

    @classmethod
    def euclidean(
        cls, names: str | Sequence[str], *, scale: float = 1.0, unit: str = ""
    ) -> "Manifold":
        """``R^n`` with coordinates named in one string (``"x y"``) or a sequence.

        >>> Manifold.euclidean("x y").dimension
        2
        """
        parsed = _names(names)
        n = len(parsed)
        return cls(parsed, (math.inf,) * n, (scale,) * n, (unit,) * n)

    @property
    def dimension(self) -> int:
        """The number of coordinates."""
        return len(self.names)

    @cached_property
    def symbols(self) -> "tuple[sympy.Symbol, ...]":
        """The coordinates as real SymPy symbols, in order."""
        import sympy

        return tuple(sympy.Symbol(name, real=True) for name in self.names)

    def __mul__(self, other: object) -> "Manifold":
        """Return the product ``X x Y``; names that would repeat get the suffixes 1 and 2."""
        if not isinstance(other, Manifold):
            return NotImplemented
        return _product((self, other))

    def __pow__(self, copies: int) -> "Manifold":
        """Return ``X x ... x X``; names get the suffixes 1 to ``copies``."""
        if not isinstance(copies, int) or copies < 1:
            msg = f"copies: expected a positive whole number; got {copies!r}"
            raise ValueError(msg)
        return _product((self,) * copies)

    @cached_property
    def scale_array(self) -> Array:
        """The scales as an array."""
        scales: Array = read_only(np.array(self.scales))
        return scales

    @cached_property
    def _circles(self) -> tuple[NDArray[np.intp], Array]:
        """Positions and periods of the coordinates that are circles."""
        periods = np.array(self.periods, dtype=np.float64)
        positions = np.flatnonzero(periods < math.inf)
        return positions, periods[positions]

    def points(self, q: ArrayLike, argument: str = "q") -> Array:
        """Check that ``q`` is one point ``(n,)`` or a batch ``(..., n)`` of finite reals.

        Returns
        -------
        (..., n) array of float64

        Raises
        ------
        TypeError
            If ``q`` is not made of real numbers.
        ValueError
            If the last axis is not ``n`` long, or an entry is NaN or infinite.
        """
        array = reals(q, argument)
        if array.ndim == 0 or array.shape[-1] != len(self.names):
            msg = (
                f"{argument}: expected shape (..., {self.dimension}) for the coordinates "
                f"{', '.join(self.names)}; got shape {array.shape}"
            )
            raise ValueError(msg)
        return finite(array, argument)

    def point(self, q: ArrayLike | Mapping[str, float], argument: str = "q") -> Array:
        """Check one point: ``n`` finite reals, or a mapping from coordinate names to them."""
        if isinstance(q, Mapping):
            if set(q) != set(self.names):
                msg = (
                    f"{argument}: expected the coordinates {', '.join(self.names)}; got {sorted(q)}"
                )
                raise ValueError(msg)
            q = [q[name] for name in self.names]
        array = self.points(q, argument)
        if array.ndim != 1:
            msg = f"{argument}: expected one point of shape ({self.dimension},); got {array.shape}"
            raise ValueError(msg)
        return array

    def wrap(self, q: ArrayLike) -> Array:
        """Bring circle coordinates into ``(-period/2, period/2]``; lines stay as they are."""
        return self._principal(self.points(q).copy())

    def difference(self, p: ArrayLike, q: ArrayLike) -> Array:
        """Return the shortest tangent vector that leads from ``q`` to ``p``."""
        return self._principal(self.points(p, "p") - self.points(q))

    def _principal(self, array: Array) -> Array:
        circles, periods = self._circles
        if circles.size:
            values = array[..., circles]
            array[..., circles] = values - periods * np.ceil(values / periods - 0.5)
        return array

    def shift(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Return the point reached from ``q`` along the tangent vector ``v``."""
        return self.wrap(self.points(q) + self.points(v, "v"))


def reals(values: ArrayLike, argument: str) -> Array:
    """Turn ``values`` into an array of float64, refusing anything that is not real numbers."""
    if isinstance(values, np.ndarray) and values.dtype == np.float64:
        return values
    try:
        array = np.asarray(values)
    except ValueError as error:
        msg = f"{argument}: expected a rectangular array of real numbers; got ragged nesting"
        raise ValueError(msg) from error
    if array.dtype.kind not in "iuf":
        msg = f"{argument}: expected real numbers; got dtype {array.dtype}"
        raise TypeError(msg)
    return array.astype(np.float64)


def scalar(values: Any) -> Any:
    """Return a plain Python number for an array of no dimension, any other array as it is."""
    return values.item() if values.ndim == 0 else values


def finite(array: Array, argument: str) -> Array:
    """Return ``array`` unchanged, refusing NaN and infinities."""
    # For a single point a Python loop is faster than two passes of NumPy.
    few = array.size <= FEW
    if not (all(map(math.isfinite, array.ravel().tolist())) if few else np.isfinite(array).all()):
        msg = f"{argument}: expected finite numbers; got {_first_bad(array)}"
        raise ValueError(msg)
    return array


def _first_bad(array: Array) -> str:
    position = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
    return f"{array[position]} at index {position[0] if len(position) == 1 else position}"


def _names(names: str | Sequence[str]) -> tuple[str, ...]:
    if not isinstance(names, Iterable):
        msg = f"names: expected a string or a sequence of strings; got {names!r}"
        raise TypeError(msg)
    parsed = tuple(names.replace(",", " ").split()) if isinstance(names, str) else tuple(names)
    if not parsed:
        msg = "names: expected at least one coordinate name; got none"
        raise ValueError(msg)
    for name in parsed:
        if not isinstance(name, str) or not _IDENTIFIER.fullmatch(name):
            msg = f"names: expected identifiers; got {name!r}"
            raise ValueError(msg)
    repeated = [name for name, count in Counter(parsed).items() if count > 1]
    if repeated:
        msg = f"names: expected distinct names; got {', '.join(repeated)} more than once"
        raise ValueError(msg)
    return parsed


def _units(units: Any, periods: Sequence[float]) -> tuple[str, ...]:
    given = tuple("rad" if period == math.tau else "" for period in periods)
    if isinstance(units, tuple) and not units:
        return given
    words = () if isinstance(units, str) else tuple(units)
    if len(words) != len(given) or not all(isinstance(unit, str) for unit in words):
        refuse("units", f"{len(given)} strings, one for each coordinate", units)
    return words


def _given(values: Any, default: float, n: int) -> Any:
    return (default,) * n if isinstance(values, tuple) and not values else values


def _positive(argument: str, values: Any, n: int, *, finite: bool) -> tuple[float, ...]:
    array = reals(values, argument)
    if array.shape != (n,):
        msg = f"{argument}: expected {n} numbers, one for each coordinate; got {values!r}"
        raise ValueError(msg)
    numbers = tuple(array.tolist())
    if not all(v > 0 and (v < math.inf or not finite) for v in numbers):
        kind = "positive finite numbers" if finite else "positive numbers or inf"
        msg = f"{argument}: expected {kind}; got {numbers}"
        raise ValueError(msg)
    return numbers


def _product(factors: tuple[Manifold, ...]) -> Manifold:
    names = [name for factor in factors for name in factor.names]
    if len(set(names)) < len(names):
        names = [f"{name}{k}" for k, factor in enumerate(factors, 1) for name in factor.names]
    return Manifold(
        tuple(names),
        tuple(period for factor in factors for period in factor.periods),
        tuple(scale for factor in factors for scale in factor.scales),
        tuple(unit for factor in factors for unit in factor.units),
    )

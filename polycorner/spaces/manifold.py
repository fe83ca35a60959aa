"""Products of lines, circles, spheres and rotations, with a length scale for each coordinate.

Points of products by their coordinates: images of a point, chords, and ways along vectors.

These maps are for algorithms: they do not check that points lie on spheres.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.checks import instance, real, reals, refuse
from polycorner.kinds import checked
from polycorner.printing import Printed, Sheet, few, listed, number
from polycorner.signatures import shown
from polycorner.spaces.arguments import (
    finite,
    given,
    groups_of,
    names_of,
    positive,
    scalar,
    units_of,
)
from polycorner.spaces.embedding import rotation_matrix
from polycorner.spaces.factors import Factors, factors
from polycorner.values import Value, cached_property, read_only

if TYPE_CHECKING:
    import sympy


Array = NDArray[np.float64]
LONGEST = 300  # characters of arguments that are shown in one line


class Geometry(Value):
    """A product of lines, circles, spheres and rotations, by its coordinates."""

    names: tuple[str, ...]
    periods: tuple[float, ...]
    scales: tuple[float, ...]
    spheres: tuple[tuple[str, ...], ...]
    rotations: tuple[tuple[str, ...], ...]

    @cached_property
    def factors(self) -> Factors:
        """The spheres and rotations, in the order of their coordinates."""
        return factors(self.names, self.spheres, self.rotations, self.periods, self.scales)

    @cached_property
    def scale_array(self) -> Array:
        """The scales as an array."""
        scales: Array = read_only(np.array(self.scales))
        return scales

    @cached_property
    def positions(self) -> dict[str, int]:
        """The position of every coordinate, by name."""
        return {name: i for i, name in enumerate(self.names)}

    @cached_property
    def everything(self) -> tuple[int, ...]:
        """The positions of all coordinates: one tuple, which functions of them all share."""
        return tuple(range(len(self.names)))

    @cached_property
    def circles(self) -> frozenset[int]:
        """The positions of the coordinates that are circles."""
        return frozenset(self._circles[0].tolist())

    @cached_property
    def _circles(self) -> tuple[NDArray[np.intp], Array]:
        """Positions and periods of the coordinates that are circles."""
        periods = np.array(self.periods, dtype=np.float64)
        positions = np.flatnonzero(periods < math.inf)
        return positions, periods[positions]

    def placed(self, points: Array, argument: str = "q") -> Array:
        """Return points ``(..., N)`` with vectors and quaternions normalised.

        Raises
        ------
        ValueError
            For lengths that differ from one by more than 1e-3.
        """
        self.factors.check(points, argument)
        return self.onto(points)

    def onto(self, q: Array) -> Array:
        """Return the nearest points of the manifold; lines and circles stay as they are."""
        return self.factors.onto(q) if self.factors else q

    def canonical(self, points: Array) -> Array:
        """Return what :meth:`wrap` does, unchecked: vectors of length zero stay."""
        points = self._principal(points.copy())
        if self.factors:
            self.factors.wrap(points)
        return points

    def moved(self, q: Array, v: Array) -> Array:
        """Return what :meth:`shift` does, unchecked and without wrapping."""
        found = np.asarray(q + v)
        self.factors.shift(q, v, found)
        return found

    def chord(self, p: ArrayLike, q: ArrayLike) -> Array:
        """Return the shortest displacement from ``q`` to an image of ``p``, in coordinates.

        Images are points a period away on circles, and the negative quaternion of a rotation.
        """
        p, q = finite(reals("p", p), "p"), finite(reals("q", q), "q")
        for argument, array in (("p", p), ("q", q)):
            if array.shape[-1:] != (len(self.names),):
                refuse(argument, f"shape (..., {len(self.names)})", array.shape)
        return self._principal(self.image(p, q) - q)

    def image(self, p: Array, q: Array) -> Array:
        """Return ``p`` with the signs of its quaternions that bring it nearest to ``q``."""
        return self.factors.signs(p, q) * p if self.rotations else p

    def _principal(self, array: Array) -> Array:
        circles, periods = self._circles
        if circles.size:
            values = array[..., circles]
            array[..., circles] = values - periods * np.ceil(values / periods - 0.5)
        return array


@dataclass(frozen=True)
class Manifold(Geometry, Printed):
    """The configuration manifold ``X``: a product of lines, circles, spheres and rotations.

    A point is one vector of length ``N`` (:attr:`size`).  Points of a sphere are unit vectors, and
    rotations unit quaternions ``(w, x, y, z)``, of which ``a`` and ``-a`` are the same; they count
    with two and three to the :attr:`dimension` ``n``.  Formulas are written in all ``N``
    coordinates, and tangent vectors have ``N`` components; :meth:`frame` gives bases.
    :meth:`euclidean`, :meth:`sphere` and :meth:`rotation` make the factors.

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
    spheres, rotations : sequence of tuple of str, optional
        The names of coordinates, in succession and of one scale, that are unit vectors and unit
        quaternions.

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
    >>> pose = Manifold.euclidean("x y z", unit="mm") * Manifold.rotation("a")
    >>> pose.names, pose.size, pose.dimension
    (('x', 'y', 'z', 'aw', 'ax', 'ay', 'az'), 7, 6)
    """

    names: tuple[str, ...]
    periods: tuple[float, ...] = ()
    scales: tuple[float, ...] = ()
    units: tuple[str, ...] = field(default=(), compare=False)
    spheres: tuple[tuple[str, ...], ...] = ()
    rotations: tuple[tuple[str, ...], ...] = ()

    def __post_init__(self) -> None:
        names = names_of(self.names)
        n = len(names)
        object.__setattr__(self, "names", names)
        periods = positive("periods", given(self.periods, math.inf, n), n, finite=False)
        scales = positive("scales", given(self.scales, 1.0, n), n, finite=True)
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "scales", scales)
        object.__setattr__(self, "units", units_of(self.units, periods))
        for kind in ("spheres", "rotations"):
            object.__setattr__(self, kind, groups_of(kind, getattr(self, kind)))
        factors(names, self.spheres, self.rotations, periods, scales)

    def __repr__(self) -> str:
        """Return the arguments that make it, or the coordinates where there are many."""
        shown = [f for f in fields(self) if getattr(self, f.name) != ()]
        arguments = ", ".join(f"{f.name}={getattr(self, f.name)!r}" for f in shown)
        if len(arguments) > LONGEST:
            return f"Manifold({self.size} coordinates: {few(self.names)})"
        return f"Manifold({arguments})"

    def _sheet(self) -> Sheet:
        unit = [name for f in self.factors for name in f.names]
        rows = (
            (
                name,
                "of a unit vector"
                if name in unit
                else f"circle of period {number(period, 6)}"
                if math.isfinite(period)
                else "line",
                number(scale, 6),
                measure,
            )
            for name, period, scale, measure in zip(
                self.names, self.periods, self.scales, self.units, strict=True
            )
        )
        dimension = f"Manifold of dimension {self.dimension}"
        head = ("coordinate", "kind", "scale", "unit")
        return Sheet(dimension, (listed("", head, rows, self.size, (2,)),))

    @classmethod
    def euclidean(
        cls, names: str | Sequence[str], *, scale: float = 1.0, unit: str = ""
    ) -> "Manifold":
        """``R^n`` with coordinates named in one string (``"x y"``) or a sequence.

        >>> Manifold.euclidean("x y").dimension
        2
        """
        parsed = names_of(names)
        n = len(parsed)
        real("scale", scale, above=0)
        return cls(parsed, (math.inf,) * n, (scale,) * n, (instance("unit", unit, str),) * n)

    @classmethod
    def sphere(cls, names: str | Sequence[str], *, scale: float = 1.0) -> "Manifold":
        """``S^k``, unit vectors; one name ``"u"`` stands for the coordinates ``ux uy uz`` of S^2.

        ``scale`` is the arc, in radians, that counts as a unit displacement.

        >>> Manifold.sphere("u").names, Manifold.sphere("p q r s").dimension
        (('ux', 'uy', 'uz'), 3)
        """
        parsed = names_of(names)
        parsed = tuple(parsed[0] + axis for axis in "xyz") if len(parsed) == 1 else parsed
        n = len(parsed)
        real("scale", scale, above=0)
        return cls(parsed, (math.inf,) * n, (scale,) * n, spheres=(parsed,))

    @classmethod
    def rotation(cls, names: str | Sequence[str], *, scale: float = 1.0) -> "Manifold":
        """``SO(3)``, unit quaternions; ``"a"`` stands for the coordinates ``aw ax ay az``.

        ``scale`` is the angle, in radians, that counts as a unit displacement.  Quaternions are
        half the angle of the rotation apart, so that their coordinates have half that scale.

        >>> M = Manifold.rotation("a")
        >>> angle = M.distance([1, 0, 0, 0], [0.6, 0.8, 0, 0])
        >>> math.isclose(angle, 2 * math.acos(0.6))
        True
        """
        parsed = names_of(names)
        parsed = tuple(parsed[0] + axis for axis in "wxyz") if len(parsed) == 1 else parsed
        n = len(parsed)
        real("scale", scale, above=0)
        return cls(parsed, (math.inf,) * n, (scale / 2,) * n, rotations=(parsed,))

    @property
    def size(self) -> int:
        """The number ``N`` of coordinates."""
        return len(self.names)

    @property
    def dimension(self) -> int:
        """The dimension ``n``: one less than coordinates for every sphere and rotation."""
        return len(self.names) - len(self.spheres) - len(self.rotations)

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
            refuse("copies", "a positive whole number", copies)
        return _product((self,) * copies)

    @shown
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
        array = reals(argument, q)
        if array.ndim == 0 or array.shape[-1] != len(self.names):
            msg = (
                f"{argument}: expected shape (..., {self.size}) for the coordinates "
                f"{', '.join(self.names)}; got shape {array.shape}"
            )
            raise ValueError(msg)
        return finite(array, argument)

    @shown
    def point(self, q: ArrayLike | Mapping[str, float], argument: str = "q") -> Array:
        """Check one point: ``N`` finite reals, or a mapping from coordinate names to them.

        Vectors and quaternions must have a length near one, and are normalised.
        """
        if isinstance(q, Mapping):
            if set(q) != set(self.names):
                refuse(argument, f"the coordinates {', '.join(self.names)}", sorted(q))
            q = [q[name] for name in self.names]
        array = self.points(q, argument)
        if array.ndim != 1:
            refuse(argument, f"one point of shape ({self.size},)", array.shape)
        return self.placed(array, argument) if self.factors else array

    def wrap(self, q: ArrayLike) -> Array:
        """Bring points ``(..., N)`` into one form.

        Circle coordinates are brought into ``(-period/2, period/2]``; lines stay as they are;
        vectors and quaternions are normalised, with a sign of quaternions that makes the first
        component positive that is not zero.

        Raises
        ------
        ValueError
            For a vector or a quaternion of length zero.
        """
        points = self.points(q)
        if self.factors:
            self.factors.check(points, "q", None)
        return self.canonical(points)

    @shown
    def difference(self, p: ArrayLike, q: ArrayLike) -> Array:
        """Return the shortest tangent vector at ``q`` that leads to ``p``, ``(..., N)``.

        On spheres and rotations it is tangent to the great circle at ``q``, in the coordinates of
        the space around them, and as long as the arc: half the angle of a rotation.
        """
        p, q = self.points(p, "p"), self.points(q)
        found = self._principal(p - q)
        if self.factors:
            self.factors.check(p, "p", None)
            self.factors.check(q, "q", None)
            self.factors.difference(p, q, found)
        return found

    @shown
    def shift(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Return the point reached from ``q`` along the tangent vector ``v``, wrapped.

        On spheres and rotations the way is a great circle, along the tangent part of ``v``.
        """
        q, v = self.points(q), self.points(v, "v")
        self.factors.check(q, "q", None)
        return self.wrap(self.moved(q, v))

    @shown
    def distance(self, p: ArrayLike, q: ArrayLike) -> Any:
        """Return the distance in scale units, by arcs and angles of rotation, ``(...)``.

        >>> math.isclose(Manifold.sphere("u").distance([1, 0, 0], [0, 1, 0]), math.pi / 2)
        True
        """
        return scalar(np.linalg.norm(self.difference(p, q) / self.scale_array, axis=-1))

    def frame(self, q: ArrayLike) -> Array:
        """Return a basis of the tangent space at ``q`` as columns, ``(..., N, n)``.

        Lines and circles contribute their unit vectors, a sphere an orthonormal basis, and a
        rotation the derivatives by the angular velocity in the axes of the body: ``frame @ w`` is
        the velocity ``q'`` for components ``w``, and ``frame.T`` takes gradients ``dE/dq`` to
        slopes, of rotations to torques.

        >>> Manifold.rotation("a").frame([1, 0, 0, 0])[1:].tolist()
        [[0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 0.5]]
        """
        q = self.points(q)
        self.factors.check(q, "q", None)
        found = np.zeros((*q.shape[:-1], self.size, self.dimension))
        self.factors.frame(q, found)
        return found

    @checked
    def matrix(self, name: str | None = None) -> "sympy.ImmutableMatrix":
        """Return the matrix of a rotation as formulas in its quaternion, from body to space.

        Parameters
        ----------
        name : str, optional
            The name of the rotation, ``"a"`` for the coordinates ``aw ax ay az``; of ``M * M``,
            ``"a1"`` and ``"a2"``.  Needed where there are several.

        >>> Manifold.rotation("a").matrix()[0, 1]
        -2*aw*az + 2*ax*ay
        """
        return rotation_matrix(self.symbols[self.factors.named(name, turns=True).at])

    @checked
    def vector(self, name: str | None = None) -> "sympy.ImmutableMatrix":
        """Return the coordinates of a sphere as a column; ``name`` as for :meth:`matrix`."""
        import sympy

        return sympy.ImmutableMatrix(self.symbols[self.factors.named(name, turns=False).at])


def _product(parts: tuple[Manifold, ...]) -> Manifold:
    names = [name for factor in parts for name in factor.names]
    repeated = len(set(names)) < len(names)

    def renamed(given: Sequence[str], k: int) -> tuple[str, ...]:
        return tuple(f"{name}{k}" if repeated else name for name in given)

    numbered = list(enumerate(parts, 1))
    return Manifold(
        tuple(name for k, factor in numbered for name in renamed(factor.names, k)),
        tuple(period for factor in parts for period in factor.periods),
        tuple(scale for factor in parts for scale in factor.scales),
        tuple(unit for factor in parts for unit in factor.units),
        tuple(renamed(some, k) for k, factor in numbered for some in factor.spheres),
        tuple(renamed(some, k) for k, factor in numbered for some in factor.rotations),
    )

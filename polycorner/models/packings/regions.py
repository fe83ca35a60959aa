"""Regions that balls are packed into: boxes, the disc and flat tori, in exact numbers."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import refuse
from polycorner.formulas.families import Family
from polycorner.spaces.manifold import Array
from polycorner.values import cached_property

if TYPE_CHECKING:
    import sympy

    Formulas = tuple[dict[str, sympy.Expr], dict[str, sympy.Expr]]

AXES = "xyz"
SIDES = (("left", "right"), ("bottom", "top"), ("front", "back"))
IMAGES = tuple(product((-1, 0, 1), repeat=2))
HALF = ((1, 0), (0, 1), (1, 1), (1, -1))  # one of every two opposite images
KINDS = "'square', 'circle', 'torus', 'hexagonal torus', (width, height) or two lattice vectors"
# A function of a region: the family, its member, what it reads of a ball, parameters, its name.
Wall = tuple[Family, str, str, tuple[float, ...], str]


class Container(ABC):
    """Where the centres of balls may be, and how far they are from one another and the walls."""

    parameters: tuple[str, ...] = ()  # of the gap of two balls

    @property
    def periods(self) -> tuple[float, ...]:
        """The periods of the coordinates of a centre, one for each."""
        return (np.inf, np.inf)

    @property
    def dimension(self) -> int:
        """The number of these coordinates."""
        return len(self.periods)

    @property
    def unit(self) -> float:
        """The length of a unit of the coordinates."""
        return 1.0

    @property
    def images(self) -> tuple[tuple[int, ...], ...]:
        """The images of the second of two balls, each of which has a gap of its own."""
        return ((),)

    @property
    @abstractmethod
    def size(self) -> float:
        """Area or volume."""

    @abstractmethod
    def walls(self) -> Iterator[Wall]:
        """Yield the functions that keep one ball inside."""

    def square(self, d: "list[sympy.Expr]") -> "sympy.Expr":
        """Return ``|d|^2`` of a difference of coordinates."""
        return sum([x**2 for x in d[1:]], d[0] ** 2)

    @abstractmethod
    def room(self, centres: Array) -> Array:
        """Return the largest radius ``(n,)`` of each ball without the others."""

    @abstractmethod
    def scattered(self, rng: np.random.Generator, count: int) -> Array:
        """Return uniform points, ``(count, d)``."""

    @abstractmethod
    def placed(self, centres: Array) -> Array:
        """Return the nearest points of the region, or on a torus the images near zero."""

    def apart(self, one: Array, other: Array) -> Array:
        """Return the distances ``(k, l)`` of points ``(k, d)`` and ``(l, d)``."""
        return np.asarray(np.linalg.norm(one[:, None] - other, axis=2))

    def plane(self, centres: Array) -> Array:
        """Return Cartesian coordinates."""
        return centres

    def coordinates(self, points: Array) -> Array:
        """Return the coordinates of Cartesian points."""
        return points


@dataclass(frozen=True)
class BoxContainer(Container):
    """``0 <= x_k <= sides[k]``."""

    sides: tuple[Fraction, ...]

    @property
    def periods(self) -> tuple[float, ...]:
        """Lines."""
        return (np.inf,) * len(self.sides)

    @property
    def size(self) -> float:
        """The product of the sides."""
        return float(np.prod(self._sides))

    @cached_property
    def _sides(self) -> Array:
        return np.array(self.sides, dtype=np.float64)

    def walls(self) -> Iterator[Wall]:
        """Yield ``x_k - r`` and ``side - x_k - r``."""
        for axis, side, names in zip(AXES, self.sides, SIDES, strict=False):
            for member, name in zip(("low", "high"), names, strict=True):
                yield _wall(side), member, axis, (), name

    def room(self, centres: Array) -> Array:
        """Return the distances from the nearest wall."""
        return np.asarray(np.minimum(centres, self._sides - centres).min(axis=1))

    def scattered(self, rng: np.random.Generator, count: int) -> Array:
        """Return uniform points."""
        return rng.random((count, self.dimension)) * self._sides

    def placed(self, centres: Array) -> Array:
        """Return the nearest points."""
        return np.clip(centres, 0, self._sides)


@dataclass(frozen=True)
class DiscContainer(Container):
    """The unit disc about the origin."""

    size = np.pi

    def walls(self) -> Iterator[Wall]:
        """Yield ``(1 - r)^2 - |x|^2`` and ``1 - r``."""
        yield _rim(), "rim", "xy", (), "circle"
        yield _most(), "most", "", (), "most"

    def room(self, centres: Array) -> Array:
        """Return the distances from the circle."""
        return np.asarray(1 - np.linalg.norm(centres, axis=1))

    def scattered(self, rng: np.random.Generator, count: int) -> Array:
        """Return uniform points."""
        turns, squares = rng.random((2, count))
        angles = 2 * np.pi * turns
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        return np.asarray(np.sqrt(squares)[:, None] * directions)

    def placed(self, centres: Array) -> Array:
        """Return the nearest points."""
        return np.asarray(centres / np.maximum(np.linalg.norm(centres, axis=1), 1)[:, None])


@dataclass(frozen=True)
class TorusContainer(Container):
    """``R^2/L`` in lattice coordinates; ``gram`` has ``|a|^2, a.b, |b|^2`` of a reduced basis."""

    gram: tuple[Fraction, Fraction, Fraction]
    turn: float = 0.0  # of the first vector against the axis, in radians

    @property
    def periods(self) -> tuple[float, ...]:
        """One for each lattice vector."""
        return (1.0, 1.0)

    parameters = ("p", "q")

    @property
    def images(self) -> tuple[tuple[int, ...], ...]:
        """The nine images of the second disc that can be near."""
        return IMAGES

    @cached_property
    def basis(self) -> Array:
        """The lattice vectors as rows."""
        aa, ab, bb = map(float, self.gram)
        flat = np.array([[aa, 0.0], [ab, np.sqrt(aa * bb - ab * ab)]]) / np.sqrt(aa)
        c, s = np.cos(self.turn), np.sin(self.turn)
        return np.asarray(flat @ [[c, s], [-s, c]])

    @property
    def unit(self) -> float:
        """The length of the first vector."""
        return math.sqrt(self.gram[0])

    @property
    def size(self) -> float:
        """The area."""
        return float(abs(np.linalg.det(self.basis)))

    def walls(self) -> Iterator[Wall]:
        """Yield the distances from own images, ``|v|^2 - 4 r^2``."""
        for image in HALF:
            yield _own(self.gram), "own", "", image, f"own({image[0]},{image[1]})"

    def square(self, d: "list[sympy.Expr]") -> "sympy.Expr":
        """Return the quadratic form of the lattice."""
        import sympy

        (u, v), (aa, ab, bb) = d, map(sympy.Rational, self.gram)
        return aa * u**2 + 2 * ab * u * v + bb * v**2

    def room(self, centres: Array) -> Array:
        """Return half the length of the shortest lattice vector."""
        return np.full(len(centres), np.linalg.norm(self.basis, axis=1).min() / 2)

    def scattered(self, rng: np.random.Generator, count: int) -> Array:
        """Return uniform points."""
        return self.placed(rng.random((count, 2)))

    def placed(self, centres: Array) -> Array:
        """Return lattice coordinates in ``(-1/2, 1/2]``."""
        return np.asarray(centres - np.ceil(centres - 0.5))

    def apart(self, one: Array, other: Array) -> Array:
        """Return the distances of the nearest images."""
        between = self.placed(one[:, None] - other)[..., None, :] + np.array(IMAGES)
        return np.asarray(np.linalg.norm(between @ self.basis, axis=3).min(axis=2))

    def plane(self, centres: Array) -> Array:
        """Return points in the plane."""
        return np.asarray(centres @ self.basis)

    def coordinates(self, points: Array) -> Array:
        """Return lattice coordinates."""
        return np.asarray(points @ np.linalg.inv(self.basis))


def region_of(argument: str, given: Any) -> Container:
    """Return the region of a word, of two sides or of two lattice vectors, or raise."""
    one = Fraction(1)
    words: dict[str, Container] = {
        "square": BoxContainer((one, one)),
        "circle": DiscContainer(),
        "torus": TorusContainer((one, Fraction(0), one)),
        "hexagonal torus": TorusContainer((one, one / 2, one)),
    }
    if isinstance(given, str):
        if given not in words:
            refuse(argument, KINDS, given)
        return words[given]
    if not isinstance(given, tuple | list) or len(given) != 2:
        refuse(argument, KINDS, given, TypeError)
    if any(isinstance(part, tuple | list) for part in given):
        return _lattice(argument, given)
    sides = tuple([_exact(argument, side) for side in given])
    if min(sides) <= 0:
        refuse(argument, "positive sides", given)
    return BoxContainer(sides)


def _lattice(argument: str, given: Any) -> TorusContainer:
    if any(not isinstance(vector, tuple | list) or len(vector) != 2 for vector in given):
        refuse(argument, KINDS, given)
    a, b = ([_exact(argument, x) for x in vector] for vector in given)
    aa, ab, bb = (u[0] * v[0] + u[1] * v[1] for u, v in ((a, a), (a, b), (b, b)))
    if aa * bb <= ab * ab or 2 * abs(ab) > min(aa, bb) or a[0] * b[1] < a[1] * b[0]:
        refuse(
            argument,
            "two lattice vectors a, b, b to the left of a, whose product is at most half of the "
            "square of either: a reduced basis",
            given,
        )
    return TorusContainer((aa, ab, bb), float(np.arctan2(float(a[1]), float(a[0]))))


def _exact(argument: str, number: Any) -> Fraction:
    """Return an exact number: floats are the dyadic fractions they represent."""
    if isinstance(number, bool) or not isinstance(number, int | float | str | Fraction):
        refuse(argument, "numbers: whole ones, fractions, floats or decimals as text", number)
    try:
        return Fraction(number)
    except (ValueError, OverflowError, ZeroDivisionError):
        refuse(argument, "finite numbers", number)


def family(
    names: tuple[str, ...],
    variables: tuple[str, ...],
    parameters: tuple[str, ...],
    formulas: "Callable[[], Formulas]",
    *told: Any,
) -> Family:
    """Return a family whose formulas depend on what is told."""
    from polycorner.formulas.cache import source_key

    key = repr((source_key(__name__), names, variables, told))
    return Family(names, variables, parameters, formulas, key, "")


@lru_cache(maxsize=128)
def pair_gap(region: Container, shared: bool) -> Family:
    """Return ``|x_2 - x_1 + v|^2 - (r_1 + r_2)^2``; balls share a radius, or have their own."""
    axes = AXES[: region.dimension]
    centres = [f"{axis}{k}" for k in (1, 2) for axis in axes]
    radii = ("r",) if shared else ("r1", "r2")
    variables, formulas = (*centres, *radii), partial(_pair_formula, region, radii)
    return family(("gap",), variables, region.parameters, formulas, region)


@lru_cache(maxsize=1)
def radius() -> Family:
    """Return ``r`` and ``-r``."""
    return family(("least", "minus radius"), ("r",), (), _radius_formulas)


@lru_cache(maxsize=128)
def _wall(side: Fraction) -> Family:
    return family(("low", "high"), ("x", "r"), (), partial(_wall_formulas, side), side)


@lru_cache(maxsize=1)
def _rim() -> Family:
    return family(("rim",), ("x", "y", "r"), (), _rim_formula)


@lru_cache(maxsize=1)
def _most() -> Family:
    return family(("most",), ("r",), (), _most_formula)


@lru_cache(maxsize=128)
def _own(gram: tuple[Fraction, Fraction, Fraction]) -> Family:
    return family(("own",), ("r",), ("p", "q"), partial(_own_formula, gram), gram)


def symbols(names: str) -> "tuple[sympy.Symbol, ...]":
    """Return real symbols of given names."""
    import sympy

    return tuple(sympy.Symbol(name, real=True) for name in names.split())


def _pair_formula(region: Container, radii: tuple[str, ...]) -> "Formulas":
    axes = AXES[: region.dimension]
    one, two = (symbols(" ".join(f"{axis}{k}" for axis in axes)) for k in (1, 2))
    image = symbols(" ".join(region.parameters)) or (0,) * len(axes)
    both = symbols(" ".join(radii))
    between = [b - a + v for a, b, v in zip(one, two, image, strict=True)]
    return {}, {"gap": region.square(between) - (both[0] + both[-1]) ** 2}


def _radius_formulas() -> "Formulas":
    (r,) = symbols("r")
    return {}, {"least": r, "minus radius": -r}


def _wall_formulas(side: Fraction) -> "Formulas":
    import sympy

    x, r = symbols("x r")
    return {}, {"low": x - r, "high": sympy.Rational(side) - x - r}


def _rim_formula() -> "Formulas":
    x, y, r = symbols("x y r")
    return {}, {"rim": (1 - r) ** 2 - x**2 - y**2}


def _most_formula() -> "Formulas":
    (r,) = symbols("r")
    return {}, {"most": 1 - r}


def _own_formula(gram: tuple[Fraction, Fraction, Fraction]) -> "Formulas":
    r, p, q = symbols("r p q")
    return {}, {"own": TorusContainer(gram).square([p, q]) - 4 * r**2}

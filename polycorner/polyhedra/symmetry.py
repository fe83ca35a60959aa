"""Symmetries of a polyhedron: continuous motions and relabellings.

A continuous symmetry is given by its tangent vectors and by invariants that tell its orbits
apart; a discrete one by the relabellings that carry one point to another.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

if TYPE_CHECKING:
    from polycorner.formulas.functions import SmoothFunction

# From the names of functions at one point to the names of the same bodies' functions at another.
Relabelling = Mapping[str, str]


@dataclass(frozen=True)
class Element(Checked):
    """An element of a finite symmetry group: a map of points, and how it renames functions.

    Attributes
    ----------
    apply : callable
        From a point ``(n,)`` to its image.
    names : mapping from str to str
        ``names[f]`` is the function that takes at the image the value of ``f`` at the point;
        functions that are not listed keep their names.
    """

    apply: Callable[[Array], Array]
    names: Relabelling


@dataclass(frozen=True)
class Symmetry(Checked):
    """A group of symmetries of a polyhedron, continuous, finite or both.

    It can be pickled where its functions can: module-level functions and methods of values.

    Attributes
    ----------
    tangents : callable, optional
        ``(n,) -> (g, n)``: vectors that span the orbit of the continuous symmetries at a point,
        in the manifold's coordinates.  Every function must be constant along them.
    invariants : callable, optional
        ``(n,) -> (k,)``: continuous in the point, equal exactly on orbits of the continuous
        symmetries, of the size of the manifold's scales.  Default: the coordinates themselves.
    elements : sequence of Element, optional
        A finite group, without the identity.
    key : callable, optional
        ``(n,) -> (k,)``: continuous numbers that relabellings do not change; tells most points
        apart before relabellings are looked for.
    relabel : callable, optional
        ``(p, q, tolerance) -> relabellings`` that carry ``p`` to the orbit of ``q``, for groups
        that are too large to list; replaces ``elements``.
    canonical : callable, optional
        ``names -> names``: from a set of functions, the one of its images under the relabellings of
        ``relabel`` that stands for all of them.
    fields : sequence of vector fields, optional
        The continuous symmetries as formulas, which :func:`~polycorner.prove` checks by exact
        algebra; see :func:`vector_field`.  They span the orbits where ``tangents`` is not given.
    """

    tangents: Callable[[Array], Array] | None = None
    invariants: Callable[[Array], Array] | None = None
    elements: Sequence[Element] = ()
    key: Callable[[Array], Array] | None = None
    relabel: Callable[[Array, Array, float], Sequence[Relabelling]] | None = None
    fields: Sequence[Any] = ()
    canonical: Callable[[frozenset[str]], frozenset[str]] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in self.fields:
            _check_field("fields", field)

    @cached_property
    def _compiled(self) -> "dict[Manifold, list[tuple[SmoothFunction, ...]]]":
        """The vector fields on the manifolds they were evaluated on."""
        return {}

    @property
    def relabels(self) -> bool:
        """Whether functions may change their names."""
        return self.relabel is not None or any(
            name != image for g in self.elements for name, image in g.names.items()
        )

    @property
    def group(self) -> list[Element]:
        """The finite group with the identity first."""
        return [Element(_same, {}), *self.elements]

    @checked
    def representative(self, names: Iterable[str]) -> tuple[str, ...] | None:
        """Return the image of a set of functions that stands for all of them, sorted.

        None where relabellings are not listed and ``canonical`` is not given.
        """
        given = frozenset([checks.instance("names", name, str) for name in names])
        if self.relabel is None:
            return min(tuple(sorted(renamed(given, g.names))) for g in self.group)
        return None if self.canonical is None else tuple(sorted(self.canonical(given)))

    @checked
    def directions(self, manifold: Manifold, q: Array) -> Array:
        """Return the scaled tangent vectors of the orbit, ``(g, n)``."""
        return orbit_directions(self, manifold, _placed("q", q, manifold))

    @checked
    def displacement(self, manifold: Manifold, p: Array, q: Array) -> Array:
        """Return the displacement from one continuous orbit to another, by the invariants."""
        p, q = _placed("p", p, manifold), _placed("q", q, manifold)
        if self.invariants is None:
            return manifold.chord(p, q) / manifold.scale_array
        return self.invariants(p) - self.invariants(q)

    @checked
    def separation(self, manifold: Manifold, p: Array, q: Array) -> float:
        """Return how far the continuous orbits of two points are apart, in scale units."""
        return float(abs(self.displacement(manifold, p, q)).max())

    @checked
    def separations(self, manifold: Manifold, p: Array, points: Array) -> Array:
        """Return how far the orbit of ``p`` is apart from those of points ``(k, n)``, ``(k,)``."""
        p, points = _placed("p", p, manifold), _placed("points", points, manifold)
        if self.invariants is None:
            apart = manifold.chord(p, points) / manifold.scale_array
        else:
            apart = np.array([self.invariants(q) for q in points]) - self.invariants(p)
        return np.asarray(abs(apart).max(axis=1))

    @checked
    def possible(self, manifold: Manifold, p: Array, points: Array, tolerance: float) -> list[int]:
        """Return the positions of points ``(k, n)`` that ``p`` may be carried to.

        Distances alone exclude the others; nothing is excluded where relabellings or invariants
        are functions of the user's.
        """
        p, points = _placed("p", p, manifold), _placed("points", points, manifold)
        if self.relabel is not None or self.invariants is not None:
            return list(range(len(points)))
        moved = np.array([element.apply(p) for element in self.group])
        away = abs(manifold.chord(moved[:, None], points)) / manifold.scale_array
        found: list[int] = np.flatnonzero((away.max(axis=-1) <= tolerance).any(axis=0)).tolist()
        return found

    @checked
    def relabellings(
        self, manifold: Manifold, p: Array, q: Array, tolerance: float
    ) -> list[Relabelling]:
        """Return every relabelling that carries ``p`` to the orbit of ``q``; none if none does."""
        p, q = _placed("p", p, manifold), _placed("q", q, manifold)
        if self.key is not None and abs(self.key(p) - self.key(q)).max() > tolerance:
            return []
        if self.relabel is not None:
            return list(self.relabel(p, q, tolerance))
        return [
            element.names
            for element in self.group
            if self.separation(manifold, element.apply(p), q) <= tolerance
        ]


def orbit_directions(symmetry: Symmetry, manifold: Manifold, q: Array) -> Array:
    """Return :meth:`Symmetry.directions` at a point that is one: nothing is checked here."""
    if symmetry.tangents is not None:
        return np.asarray(symmetry.tangents(q), dtype=np.float64) / manifold.scale_array
    known = symmetry._compiled  # noqa: SLF001 - of this file
    if manifold not in known:
        known[manifold] = [vector_field(manifold, field) for field in symmetry.fields]
    vectors = [[f.value(q) for f in field] for field in known[manifold]]
    return np.array(vectors).reshape(-1, manifold.size) / manifold.scale_array


def _placed(argument: str, given: Array, manifold: Manifold) -> Array:
    array = checks.reals(argument, given)
    if array.shape[-1:] != (manifold.size,):
        checks.refuse(argument, f"coordinates {', '.join(manifold.names)}", array.shape)
    return array


def _check_field(argument: str, components: Any) -> None:
    if isinstance(components, str) or not isinstance(components, Iterable):
        expected = "components by name, or a sequence of them"
        checks.refuse(argument, expected, components, TypeError)


def _same(q: Array) -> Array:
    return q


def renamed(names: frozenset[str], relabelling: Relabelling) -> frozenset[str]:
    """Return the names after a relabelling."""
    return frozenset(relabelling.get(name, name) for name in names)


def generators(group: Sequence[Relabelling]) -> list[Relabelling]:
    """Return relabellings that generate a finite group of them, the identity never.

    Examples
    --------
    >>> turn = {"a": "b", "b": "c", "c": "a"}
    >>> back = {"a": "c", "b": "a", "c": "b"}
    >>> generators([{"a": "a", "b": "b", "c": "c"}, turn, back]) == [turn]
    True
    """
    names = sorted({name for p in group for name in p})
    known, found = {tuple(names)}, []
    for p in group:
        if tuple(p.get(name, name) for name in names) in known:
            continue
        found.append(p)
        fresh = list(known)
        while fresh:
            images = [tuple(g.get(name, name) for name in image) for image in fresh for g in found]
            fresh = [image for image in dict.fromkeys(images) if image not in known]
            known.update(fresh)
    return found


def vector_field(manifold: Manifold, components: Any) -> "tuple[SmoothFunction, ...]":
    """Return the components of a vector field as functions.

    Parameters
    ----------
    manifold : Manifold
    components : mapping or sequence
        A mapping from coordinate names to components, zero where not listed, or a sequence of
        ``n`` components: numbers, SymPy expressions or SmoothFunctions.

    Raises
    ------
    TypeError, ValueError
        For anything else.
    """
    import sympy

    from polycorner.formulas.functions import SmoothFunction

    if isinstance(components, Mapping) and components:
        checks.names("symmetry", components, manifold.names)
        components = [components.get(name, 0) for name in manifold.names]
    _check_field("symmetry", components if not isinstance(components, Mapping) else "")
    given = list(components)
    if len(given) != manifold.size:
        expected = f"{manifold.size} components, for {', '.join(manifold.names)}"
        checks.refuse("symmetry", expected, len(given))
    quaternions = {name for some in manifold.rotations for name in some}

    def component(name: str, expression: Any) -> SmoothFunction:
        # At the opposite quaternion a tangent vector has the opposite components.
        made = SmoothFunction.quantity if name in quaternions else SmoothFunction
        return made(name, expression, manifold)

    return tuple(
        f
        if isinstance(f, SmoothFunction)
        else component(
            name,
            sympy.Rational(f.numerator, f.denominator) if isinstance(f, Fraction) else f,
        )
        for name, f in zip(manifold.names, given, strict=True)
    )

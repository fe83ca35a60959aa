"""Bodies whose radii or sizes are one more coordinate, so that thick and large ones can be sought.

A gap is a distance less the radii ``s`` around what it is between.  With radii smaller by ``t`` it
is the same with ``s - w t``, where ``w`` of the bodies move.  With bodies ``c`` times as large,
about their origins, it is that of points ``c p`` and radii that are as many times as large.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.frames import Frame, symbols
from polycorner.bodies.gaps import points_of
from polycorner.bodies.kernels import together
from polycorner.bodies.pairs import PlacedPart, Tree, apart
from polycorner.bodies.shapes import Body, Part
from polycorner.bodies.walls import HalfSpace
from polycorner.checks import about, instance, refuse
from polycorner.formulas import cache
from polycorner.formulas.families import Family, substituted
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import cached_property

if TYPE_CHECKING:
    from polycorner.bodies.gaps import Formulas

BY, WEIGHT = "thinner", "weight"
TIMES, MOVING = "times", "moving"  # the size, and the radii that change with it
FULL, THIN = "full", "thin"  # bodies as they are given, and of no thickness
SMALL = "small"  # bodies as small as they may be

# From a family, and whether its gap is about hulls without their radii, to the family that reads
# the new coordinate as well, with its further parameters; None if the gap does not change.
Change = Callable[[Family, bool], tuple[Family, tuple[float, ...]] | None]


class Resized(Polyhedron):
    """The placements of bodies together with a coordinate of their sizes, the last one.

    Attributes
    ----------
    arrangement : Arrangement
        Of the bodies as they are given.
    scales : bool
        Whether the coordinate is a factor of all sizes, not a reduction of radii.
    """

    def __init__(
        self, arrangement: Arrangement, manifold: Manifold, parts: AllOf, *, scales: bool
    ) -> None:
        super().__init__(manifold, parts, arrangement.mechanism.equations)
        self.arrangement, self.scales = arrangement, scales

    def at(self, q: ArrayLike) -> Arrangement:
        """Return the arrangement of bodies of the sizes that they have at a point ``(N,)``."""
        size = float(self.manifold.point(q)[-1])
        factor, less = (size, 0.0) if self.scales else (1.0, size)
        parts = [part for body in self.arrangement.named.values() for part in body.parts.values()]
        least = min(part.radius for part in parts) - less
        if factor <= 0 or least < 0 or (least == 0 and not self.scales):
            refuse("q", "a point at which bodies have sizes", size)
        bodies = {
            name: Body(
                {
                    part: Part(factor * shape.points, factor * shape.radius - less)
                    for part, shape in body.parts.items()
                }
            )
            for name, body in self.arrangement.named.items()
        }
        return replace(self.arrangement, bodies=bodies)

    def placed(self, q: ArrayLike) -> dict[str, Body]:
        """Return the bodies where they are at a point ``(N,)``, of their sizes there."""
        return self.at(q).placed(self.manifold.point(q)[:-1])

    @cached_property
    def symmetry(self) -> Symmetry:
        """As :attr:`Arrangement.symmetry`: sizes do not change."""
        return self._symmetry(full=False)

    @cached_property
    def full_symmetry(self) -> Symmetry:
        """As :attr:`Arrangement.full_symmetry`: sizes do not change."""
        return self._symmetry(full=True)

    def _symmetry(self, *, full: bool) -> Symmetry:
        found = self.arrangement.congruences.symmetry(self, full=full, sized=self.scales)
        if found.invariants is None:
            return found
        last = partial(_and_size, found.invariants, self.manifold.scales[-1])
        return replace(found, invariants=last)


def _and_size(invariants: Callable[[Array], Array], scale: float, q: Array) -> Array:
    return np.append(invariants(q), q[-1] / scale)


@checked
def thinned(arrangement: Arrangement, name: str = "t", *, excluded: bool = True) -> Resized:
    """Return the placements of bodies whose radii are all smaller by a further coordinate.

    The least ``t`` that can be had is that of the thickest bodies, which are jammed.  It is at
    least zero (the function ``full``) and at most the least radius (``thin``); fixed bodies keep
    their radii.  The polyhedron has a ``symmetry`` and a ``full_symmetry``, as arrangements have,
    ``placed(q)`` returns the thinner bodies in their places, and ``at(q)`` their arrangement.

    Parameters
    ----------
    arrangement : Arrangement
        Of rounded bodies, as thick as they may become.
    name : str, optional
        Of the coordinate, the last one.
    excluded : bool, optional
        Whether bodies that cross each other are excluded, by unions that are never active.  A
        search is faster without them, and what it finds is to be checked with them.

    Raises
    ------
    ValueError
        For bodies with sharp parts.

    Examples
    --------
    Two discs in a square box grow to the radius ``1 / (2 + sqrt(2))``:

    >>> from polycorner import minimise
    >>> from polycorner.bodies import Arrangement, box, disc, thinned
    >>> a = Arrangement([disc(0.5), disc(0.5)], box([0, 0], [1, 1]))
    >>> D = thinned(a)
    >>> jammed = minimise(D, D.manifold.symbols[-1], [0.2, 0.3, 0.7, 0.6, 0.4])
    >>> radius = 0.5 - jammed.point[-1]
    >>> float(radius.round(9)), jammed.verdict.name
    (0.292893219, 'STRICT_MINIMUM')
    """
    instance("arrangement", arrangement, Arrangement)
    radii = {
        body: min(part.radius for part in shape.parts.values())
        for body, shape in arrangement.named.items()
    }
    sharp = [body for body, radius in radii.items() if radius == 0]
    if sharp:
        refuse("arrangement", "rounded bodies, which have a radius", sharp[0])
    with about("name"):
        last = Manifold.euclidean([name], scale=arrangement.scale, unit=arrangement.unit)
    manifold = arrangement.manifold * last
    gaps = [
        _lifted(
            apart(arrangement.manifold, one, two, excluded=excluded),
            manifold,
            partial(_thinner, float(_moving(one, two))),
        )
        for one, two in arrangement.pairs
    ]
    gaps += [
        _lifted(t.gap, manifold, partial(_thinner, 1.0 if isinstance(t.wall, HalfSpace) else -1.0))
        for t in arrangement.at_walls
    ]
    t = manifold.symbols[-1]
    least = min(radii.values())
    limits = SmoothFunction(FULL, t, manifold), SmoothFunction(THIN, least - t, manifold)
    held = [SmoothFunction(*one, manifold) for one in arrangement.mechanism.limits.items()]
    parts = AllOf(*together(gaps), *held, *limits)
    return Resized(arrangement, manifold, parts, scales=False)


@checked
def scaled(
    arrangement: Arrangement, name: str = "size", *, least: float = 0.01, excluded: bool = True
) -> Resized:
    """Return the placements of bodies that are all ``size`` times as large, a further coordinate.

    Bodies are scaled about their origins, with their radii; fixed bodies, walls and periods keep
    their sizes.  The coordinate is at most 1 (the function ``full``) and at least ``least``
    (``small``).  Where bodies do not turn, gaps of sharp polygons and polyhedra are linear in
    positions and size together.  There are ``symmetry``, ``placed`` and ``at`` as for
    :func:`thinned`.

    Parameters
    ----------
    arrangement : Arrangement
        Of bodies as large as they may become.
    name : str, optional
        Of the coordinate, the last one.
    least : float, optional
        The least size, between 0 and 1; default 0.01.
    excluded : bool, optional
        As in :func:`thinned`, for rounded bodies.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    Two squares that do not turn fill a square box side by side, at half its width:

    >>> from polycorner import minimise
    >>> from polycorner.bodies import Arrangement, box, polygon, scaled
    >>> square = polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    >>> D = scaled(Arrangement([square] * 2, box([0, 0], [1, 1]), orientations="none"))
    >>> best = minimise(D, -D.manifold.symbols[-1], [0.2, 0.3, 0.7, 0.6, 0.2])
    >>> float(best.point[-1].round(9)), best.verdict.name
    (0.5, 'MINIMUM_ALONG_LOCUS')
    """
    if instance("arrangement", arrangement, Arrangement).joints:
        refuse("arrangement", "one without joints, whose anchors would move", arrangement.joints)
    least = checks.real("least", least, above=0, below=1)
    unit = arrangement.scale / max(body.size for body in arrangement.named.values())
    with about("name"):
        manifold = arrangement.manifold * Manifold.euclidean([name], scale=unit)
    gaps = [
        _lifted(
            apart(arrangement.manifold, one, two, excluded=excluded),
            manifold,
            partial(_larger, _moving(one, two) == 2, _moving_radius(one, two)),
        )
        for one, two in arrangement.pairs
    ]
    for touch in arrangement.at_walls:
        radius = touch.member.part.radius
        moving = radius if isinstance(touch.wall, HalfSpace) else -radius
        gaps.append(_lifted(touch.gap, manifold, partial(_larger, False, moving)))
    size = manifold.symbols[-1]
    limits = SmoothFunction(FULL, 1 - size, manifold), SmoothFunction(SMALL, size - least, manifold)
    return Resized(arrangement, manifold, AllOf(*together(gaps), *limits), scales=True)


def _moving(one: PlacedPart, two: PlacedPart) -> int:
    return sum(m.frame is not Frame.FIXED for m in (one, two))


def _moving_radius(one: PlacedPart, two: PlacedPart) -> float:
    return sum(m.part.radius for m in (one, two) if m.frame is not Frame.FIXED)


def _lifted(tree: Tree, manifold: Manifold, change: Change, *, hulls: bool = False) -> Tree:
    """Return changed gaps on the product of their manifold with the new coordinate.

    Unions tell whether hulls are apart, and are about hulls without radii.
    """
    if isinstance(tree, AllOf | AnyOf):
        hulls = hulls or isinstance(tree, AnyOf)
        return type(tree)(*(_lifted(part, manifold, change, hulls=hulls) for part in tree.parts))
    family, numbers = tree.family, tree.parameters
    reads = [tree.manifold.names[i] for i in tree.reads]
    changed = change(family, hulls)
    if changed:
        family, numbers = changed[0], (*numbers, *changed[1])
        reads.append(manifold.names[-1])
    return SmoothFunction.member(
        family, tree.member_name, manifold, parameters=numbers, reads=reads, label=tree.name
    )


def _thinner(weight: float, family: Family, hulls: bool) -> tuple[Family, tuple[float, ...]] | None:
    return None if hulls else (_thinner_family(family), (weight,))


@lru_cache(maxsize=256)
def _thinner_family(family: Family) -> Family:
    """Return the gaps of a family as functions of a reduction of radii, the last variable."""
    return _changed(family, BY, WEIGHT, partial(_thinner_formulas, family))


def _thinner_formulas(family: Family) -> "Formulas":
    s, t, w = symbols(["s", BY, WEIGHT])
    return substituted(family.formulas(), {s: s - w * t})


def _larger(
    both: bool, radius: float, family: Family, hulls: bool
) -> tuple[Family, tuple[float, ...]]:
    """Return a gap of larger bodies; ``both`` of them move, with radii that add up to ``radius``.

    The positions of a body that moves alone are variables, those of the other one are not.
    """
    return _larger_family(family, both), (0.0 if hulls else radius,)


@lru_cache(maxsize=256)
def _larger_family(family: Family, both: bool) -> Family:
    """Return the gaps of a family as functions of the size of what moves, the last variable."""
    return _changed(family, TIMES, MOVING, partial(_larger_formulas, family, both))


def _larger_formulas(family: Family, both: bool) -> "Formulas":
    s, c, moving = symbols(["s", TIMES, MOVING])
    places = {p: c * p for p in symbols(points_of(family, both=both))}
    return substituted(family.formulas(), {**places, s: s - (1 - c) * moving})


def _changed(
    family: Family, variable: str, parameter: str, formulas: "partial[Formulas]"
) -> Family:
    """Return a family of one more variable and parameter."""
    key = repr((cache.source_key(__name__), family.key, formulas.args[1:], variable))
    return Family(
        family.names,
        (*family.variables, variable),
        (*family.parameters, parameter),
        formulas,
        key,
        stationary=family.stationary,
    )

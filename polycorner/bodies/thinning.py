"""Bodies whose radii are smaller by a common coordinate, so that their thickness can be sought.

A gap is a distance less the radii ``s`` around what it is between; with radii smaller by ``t`` it
is the same with ``s - w t``, where ``w`` of the bodies move.
"""

from functools import lru_cache, partial
from typing import TYPE_CHECKING

from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.frames import Frame, symbols
from polycorner.bodies.kernels import together
from polycorner.bodies.pairs import Tree, apart
from polycorner.bodies.walls import HalfSpace
from polycorner.checks import instance, refuse
from polycorner.formulas import cache
from polycorner.formulas.compositions import substituted
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.polyhedra.groups import AllOf, AnyOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Manifold

if TYPE_CHECKING:
    from polycorner.bodies.gaps import Formulas

BY, WEIGHT = "thinner", "weight"
FULL, THIN = "full", "thin"  # the reduction is at least zero, and at most the least radius


def thinned(arrangement: Arrangement, name: str = "t", *, excluded: bool = True) -> Polyhedron:
    """Return the placements of bodies whose radii are all smaller by a further coordinate.

    The least ``t`` that can be had is that of the thickest bodies, which are jammed.  It is at
    least zero (the function ``full``) and at most the least radius (``thin``); fixed bodies keep
    their radii.

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
    last = Manifold.euclidean([name], scale=arrangement.scale, unit=arrangement.unit)
    manifold = arrangement.manifold * last
    gaps = [
        _lifted(
            apart(arrangement.manifold, one, two, excluded=excluded),
            manifold,
            sum(m.frame is not Frame.FIXED for m in (one, two)),
        )
        for one, two in arrangement.pairs
    ]
    gaps += [
        _lifted(f, manifold, 1 if isinstance(wall, HalfSpace) else -1)
        for wall, f, *_ in arrangement.at_walls
    ]
    t = manifold.symbols[-1]
    least = min(radii.values())
    limits = SmoothFunction(FULL, t, manifold), SmoothFunction(THIN, least - t, manifold)
    return Polyhedron(manifold, AllOf(*together(gaps), *limits))


def _lifted(tree: Tree, manifold: Manifold, weight: float) -> Tree:
    """Return gaps on the product with the reduction ``t``: radii in them are ``s - weight t``.

    Unions tell whether hulls cross, and are about hulls without radii.
    """
    if isinstance(tree, AllOf):
        return AllOf(*(_lifted(part, manifold, weight) for part in tree.parts))
    if isinstance(tree, AnyOf):
        return AnyOf(*(_lifted(part, manifold, 0) for part in tree.parts))
    family, numbers = tree.family, tree.parameters
    reads = [tree.manifold.names[i] for i in tree.reads]
    if weight:
        family, numbers = _thinner(family), (*numbers, float(weight))
        reads.append(manifold.names[-1])
    return SmoothFunction.member(
        family, tree.member_name, manifold, parameters=numbers, reads=reads, label=tree.name
    )


@lru_cache(maxsize=256)
def _thinner(family: Family) -> Family:
    """Return the gaps of a family as functions of a reduction of radii, the last variable."""
    key = repr((cache.source_key(__name__), family.key, "thinner"))
    return Family(
        family.names,
        (*family.variables, BY),
        (*family.parameters, WEIGHT),
        partial(_formulas, family),
        key,
        stationary=family.stationary,
    )


def _formulas(family: Family) -> "Formulas":
    s, t, w = symbols(["s", BY, WEIGHT])
    return substituted(family.formulas(), {s: s - w * t})

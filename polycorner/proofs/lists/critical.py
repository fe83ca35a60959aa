"""Complete lists of critical points: where components of sublevel sets of a union may merge.

Let ``D`` be a union of intersections, and ``A`` the functions that vanish at a point ``q`` of it,
in whatever branch that may contain it.  The point is *critical* unless some ``v`` has ``dE v < 0``,
``df_i v > 0`` for all ``i`` in ``A``, and ``dh v = 0`` for the equations, whose gradients are
independent.

**Theorem.**  Let no point of the compact set ``D`` with ``a <= E <= b`` be critical.  Then
``D_a = {q in D : E <= a}`` is a deformation retract of ``D_b``.

*Proof.*  Such a ``v``, made tangent to the equations nearby, serves in a neighbourhood, in which no
functions vanish but those of ``A``.  A partition of unity gives a field with these properties.  Its
flow decreases ``E`` at a rate that is bounded below, and increases each function where that
vanishes: none of those that are nonnegative becomes negative, so that each branch that contains the
point keeps it.  Stop at ``a``.

A list is complete if every box in which none is listed is closed by such a direction, for all
functions that may vanish in it; the search is that for stationary points
(:mod:`~polycorner.proofs.lists.search`), with the branches of a box in one item.  Were gradients of
active functions positively dependent at a point that is not listed, then either no more than can be
independent were, and there is no such direction; or they span positively, and the point is a KKT
point of some of them (Caratheodory).

Of an intersection critical points are the stationary ones.  A union has others, such as the tip of
an obstacle on the far side of which a ball is held.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner import checks
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.enumeration import Limits, begun
from polycorner.proofs.lists.images import Motion, expanded
from polycorner.proofs.lists.listing import each, listed, loci_of, point_of, undecided
from polycorner.proofs.lists.loci import LocusRegion
from polycorner.proofs.lists.members import settled
from polycorner.proofs.lists.search import StationarySearch, Tally
from polycorner.proofs.lists.stationary import StationaryList, StationaryPoint
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH
from polycorner.values import Value

if TYPE_CHECKING:
    from polycorner.minimisation.problem import Energy


@dataclass(frozen=True, eq=False)
class CriticalMember(Value):
    """A box with exactly one critical point, where the gradients of some functions are independent.

    Attributes
    ----------
    point : StationaryPoint
        Its active functions have positive multipliers; ``index`` belongs to these alone.
    zeros, unknown : frozenset of int
        Inequalities that vanish there, and those that may.
    around : ((n,) array, (n,) array)
        A box in which it is the only KKT point of its active functions.
    is_open : bool
        Whether it is not decided that it is a point of the set, in the domain, and another one.
    """

    point: StationaryPoint
    zeros: frozenset[int]
    unknown: frozenset[int]
    around: tuple[Array, Array]
    is_open: bool


@dataclass(frozen=True, eq=False)
class CriticalList(Value):
    """All critical points in a box.

    Attributes
    ----------
    problem : Problem
        Without functions that are positive multiples of others.
    domain : Domain
    points : tuple of CriticalMember
        With their images, each once; but no images of open ones.
    loci : tuple of LocusRegion
    undecided : (k, 2, n) array
        Boxes outside of which, and of their images, there are no others.
    motions : tuple of Motion
        The group of the declared symmetries, without the identity.
    tally : Tally
    """

    problem: Problem
    domain: Domain
    points: tuple[CriticalMember, ...]
    loci: tuple[LocusRegion, ...]
    undecided: Array
    motions: tuple[Motion, ...]
    tally: Tally


def critical_points(
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    box: Any,
    limits: Limits,
    symmetry: Symmetry | None = None,
    cap: float = float("inf"),
    resolution: float = SEARCH.resolution,
    kept: Sequence[str] = (),
) -> CriticalList:
    """Return all critical points up to an energy; see :func:`.stationary_points`.

    Raises ValueError if one of the functions ``kept`` is a multiple of another one.
    """
    search = begun(
        StationarySearch, polyhedron, energy, box, symmetry, resolution, critical=True, cap=cap
    )
    lost = [name for name in kept if name not in search.problem.polyhedron.names]
    if lost:
        expected = "inequalities that are no multiples of others"
        checks.refuse("region", expected, lost[0])
    limits.run(search)
    members = (member for _, member in settled(search)[0])
    points = [
        CriticalMember(
            point_of(search, one, orbit),
            one.zeros,
            one.unknown,
            (one.region.lower, one.region.upper),
            is_open,
        )
        for one, orbit, is_open in each(search, members)
    ]
    return CriticalList(
        search.problem,
        search.domain,
        tuple(_once(search.problem, points)),
        tuple(loci_of(search)),
        undecided(search),
        tuple(search.motions),
        search.tally,
    )


def minima_on(
    polyhedron: Polyhedron,
    energy: "Energy",
    *,
    box: Any,
    limits: Limits,
    cap: float,
    resolution: float = SEARCH.resolution,
) -> StationaryList:
    """Return all local minima up to an energy."""
    about = polyhedron, energy, box, None, resolution
    search = begun(StationarySearch, *about, minima_only=True, cap=cap)
    limits.run(search)
    return listed(search, search.problem)


def _once(problem: Problem, points: list[CriticalMember]) -> Iterator[CriticalMember]:
    """Yield points, those once that whole turns around circles carry to each other.

    Functions that stand for images in a periodic arrangement change places with such a turn.
    """
    manifold = problem.polyhedron.manifold
    kept: list[CriticalMember] = []
    middles = np.array([p.point.point for p in points]).reshape(-1, problem.dimension)
    for k, one in enumerate(points):
        near = abs(manifold.difference(middles[:k], middles[k])) / problem.scales
        same = [
            j for j in np.flatnonzero((near < DEFAULT.same).all(axis=1)).tolist()
            if _is_turned(problem, points[j], one)
        ]  # fmt: skip
        if not same:
            kept.append(one)
    yield from kept


def _is_turned(problem: Problem, one: CriticalMember, other: CriticalMember) -> bool:
    """Whether a point is shown to be another one, carried around circles by whole turns."""
    import sympy

    manifold = problem.polyhedron.manifold
    periods = np.array(manifold.periods)
    circle = np.isfinite(periods)
    turns = np.zeros(len(periods))
    turns[circle] = np.rint((other.point.point - one.point.point)[circle] / periods[circle])
    if not turns.any() or len(one.point.active) != len(other.point.active):
        return False
    back = other.point.lower - turns * np.where(circle, periods, 0.0)
    ahead = other.point.upper - turns * np.where(circle, periods, 0.0)
    slack = 4 * np.spacing(abs(back) + abs(ahead))
    lower, upper = one.around
    if not ((back - slack >= lower) & (ahead + slack <= upper) | (lower == upper)).all():
        return False
    symbols = manifold.symbols
    moved = {
        symbols[i]: symbols[i] + sympy.Rational(turns[i] * periods[i])
        for i in np.flatnonzero(turns).tolist()
    }
    d = problem.polyhedron
    here = [expanded(d.functions[d.names.index(name)]) for name in one.point.active]
    there = [
        sympy.expand(expanded(d.functions[d.names.index(name)]).subs(moved, simultaneous=True))
        for name in other.point.active
    ]
    energy = expanded(problem.energy)
    if sympy.expand(energy.subs(moved, simultaneous=True) - energy) != 0:
        return False
    # One for one: the same functions, so that both solve the same equations.
    return all(any(sympy.expand(f - g) == 0 for g in there) for f in here)

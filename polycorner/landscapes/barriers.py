"""Landscapes: minima, passes, and the tree in which components of sublevel sets merge.

``D_c = {q in D : E(q) <= c}``.  Each local minimum starts a component of ``D_c``, and components
merge at passes alone (:mod:`~polycorner.landscapes.passes`).  The *barrier* between two minima is
the least ``c`` for which they are in one component of ``D_c``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nextafter
from typing import Literal

import numpy as np

from polycorner import checks
from polycorner.landscapes.graph import Forest, Tie
from polycorner.landscapes.routes import Route
from polycorner.minimisation.problem import Problem
from polycorner.printing import Printed, Sheet, Table, facts, number, units
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT
from polycorner.values import Checked, cached_property

OUTSIDE = -1  # the node beyond the region that may be left
Bounds = tuple[float, float]
Kind = Literal["saddle", "tip", "locus", "exit", "undecided"]


@dataclass(frozen=True, eq=False)
class Minimum(Checked):
    """A local minimum, or a connected set of them.

    Attributes
    ----------
    point : (n,) array
        The point, or one of the set.
    energy : (float, float)
        Bounds of its energy.
    active : tuple of str
        Functions that vanish at an isolated minimum.
    kind : {"isolated", "locus"}
    orbit : int
        Minima of one orbit are images of each other under the declared symmetries.
    """

    point: Array
    energy: Bounds
    active: tuple[str, ...]
    kind: Literal["isolated", "locus"]
    orbit: int


@dataclass(frozen=True, eq=False)
class Side(Checked):
    """A side of a pass: the minimum that a descent from it reaches, and the way.

    Attributes
    ----------
    minimum : int or None
        The number of the minimum; -1 for the outside of the region, and less for minima on its
        walls, each with a number of its own; None where none is known.
    route : Route or None
        From the pass to the minimum.
    """

    minimum: int | None
    route: Route | None = None

    @property
    def verified(self) -> bool:
        """Whether it is proved that the side and the minimum are joined below the pass."""
        shown = self.route is not None and self.route.verified
        return self.minimum is not None and (shown or self.minimum == OUTSIDE)


@dataclass(frozen=True, eq=False)
class Pass(Checked):
    """A point, or a set of points, at which components of sublevel sets may merge.

    Attributes
    ----------
    point : (n,) array
        The point, or one of the set; of an undecided one, the middle of a box.
    energy : (float, float)
        Bounds of its energy; of an undecided one, bounds over the box.
    active : tuple of str
        Functions that vanish there.
    index : int or None
        Negative eigenvalues of the Hessian of the Lagrangian along the face; None if not known.
    kind : {"saddle", "tip", "locus", "exit", "undecided"}
        A saddle of index 1; a minimum on two branches of a union at once, which the union does not
        have; a locus of index 1; a point where a region can be left; what may be one of these.
    sides : tuple of Side
        All sides, each with what lies below it; empty where they are not known.
    orbit : int
        Passes of one orbit are images of each other under the declared symmetries.
    """

    point: Array
    energy: Bounds
    active: tuple[str, ...]
    index: int | None
    kind: Kind
    sides: tuple[Side, ...]
    orbit: int


@dataclass(frozen=True)
class Merge(Checked):
    """Where two components merge as the energy rises.

    Attributes
    ----------
    number : int
        The pass.
    energy : (float, float)
        Its energy.
    kept, ended : int
        The lowest minima of the two components; that of ``ended`` is the higher one.
    """

    number: int
    energy: Bounds
    kept: int
    ended: int


@dataclass(frozen=True, eq=False)
class Barrier(Checked):
    """The least energy at which two minima are in one component.

    Attributes
    ----------
    start, end : int
        Minima, by their numbers; ``end`` is -1 for the outside of a region.
    lower, upper : float
        Bounds of the energy; infinite where there is no way, or none is known.
    rise : (float, float)
        Bounds of its rise over the minimum ``start``.
    passes : tuple of int
        The passes on the way of the upper bound.
    proved : bool
        Whether the lower bound is proved.  The upper one is if ``route`` is verified.
    route : Route or None
        The way.
    """

    start: int
    end: int
    lower: float
    upper: float
    rise: Bounds
    passes: tuple[int, ...]
    proved: bool
    route: Route | None = None


def below(a: float, b: float) -> float:
    """Return a lower bound of ``a - b``."""
    return nextafter(a - b, -inf) if isfinite(a) and isfinite(b) else a - b


def above(a: float, b: float) -> float:
    """Return an upper bound of ``a - b``."""
    return nextafter(a - b, inf) if isfinite(a) and isfinite(b) else a - b


@dataclass(frozen=True, eq=False)
class Landscape(Checked, Printed):
    """Minima and passes of an energy on a polyhedron; see :func:`landscape`.

    Attributes
    ----------
    problem : Problem
        Polyhedron and energy.
    minima : tuple of Minimum
        The lowest first.
    passes : tuple of Pass
        The lowest first, those that may be passes among them.
    proved : bool
        Whether minima and passes are those of complete lists: whatever is not decided is among the
        passes, so that bounds from below are proved, and bounds from above are where routes are
        verified.  Otherwise they were found by a search that may have missed some.
    cap : float
        The energy up to which the landscape is known; infinite for all of it.
    region : bool
        Whether a region was given that may be left.
    notes : tuple of str
        What is not decided, and what was assumed, in sentences.
    euler : int or None
        The Euler characteristic of the set, up to the cap, as the critical points of all kinds add
        up to it: a check where it is known.  None where some are not decided, or are no points.
    """

    problem: Problem
    minima: tuple[Minimum, ...]
    passes: tuple[Pass, ...]
    proved: bool
    cap: float = inf
    region: bool = False
    notes: tuple[str, ...] = ()
    euler: int | None = None

    # ------------------------------------------------------------------------------------ barriers

    def _nodes(self, leaving: bool) -> dict[int, int]:
        """Return the nodes of minima, also of those on walls of the region, by their numbers."""
        count = len(self.minima)
        sides = (side for p in self.passes for side in p.sides)
        walls = {s.minimum for s in sides if s.minimum is not None and s.minimum < 0}
        if leaving:
            return dict.fromkeys([*walls, OUTSIDE], count) | {k: k for k in range(count)}
        # Two ways out need not meet outside, which is no way from minimum to minimum.
        return {k: i for i, k in enumerate([*range(count), *sorted(walls - {OUTSIDE})])}

    def _forest(self, *, lower: bool, leaving: bool) -> Forest:
        """Return links by lower bounds, wherever there may be one; or those that are shown."""
        nodes, links = self._nodes(leaving), []
        every = tuple(sorted(set(nodes.values())))
        for k, p in enumerate(self.passes):
            known = self._is_known(p)
            sides = [s for s in p.sides if known or s.verified or not (lower or self.proved)]
            tops = [s.route.top for s in sides if s.route] if p.kind != "exit" else []
            weight = p.energy[0] if lower else max([p.energy[1], *tops])
            ends = tuple(nodes[s.minimum] for s in sides if s.minimum in nodes)
            links.append(Tie(every if lower and not known else ends, weight, k))
        return Forest(len(every), links)

    @cached_property
    def _lower(self) -> dict[bool, Forest]:
        """By whether the question is one of leaving the region."""
        return {leaving: self._forest(lower=True, leaving=leaving) for leaving in (False, True)}

    @cached_property
    def _upper(self) -> dict[bool, Forest]:
        return {leaving: self._forest(lower=False, leaving=leaving) for leaving in (False, True)}

    def _is_known(self, p: Pass) -> bool:
        """Whether it is proved what a pass joins; without proof, whether it was found."""
        known = (s.verified if self.proved else s.minimum is not None for s in p.sides)
        return bool(p.sides) and all(known)

    def barrier(self, start: int, end: int) -> Barrier:
        """Return the least energy at which two minima are in one component, between two bounds.

        Parameters
        ----------
        start, end : int
            Numbers of minima.

        Raises
        ------
        TypeError, ValueError
            For numbers of no minimum.
        """
        for name, k in (("start", start), ("end", end)):
            checks.whole(name, k, least=0, most=len(self.minima) - 1)
        return self._barrier(start, end)

    def _barrier(self, start: int, end: int) -> Barrier:
        leaving = end == OUTSIDE
        ends = [self.minima[k].energy for k in (start, end) if k != OUTSIDE]
        target = len(self.minima) if leaving else end
        lower = min(self._lower[leaving].bottleneck(start, target), self.cap)
        lower = max(lower, *(low for low, _ in ends))
        shown = self._upper[leaving]
        upper, way = shown.bottleneck(start, target), shown.path(start, target) or ()
        upper = max(upper, *(high for _, high in ends))
        low, high = self.minima[start].energy
        rise = max(below(lower, high), 0.0), above(upper, low)
        used = tuple(link.source for _, _, link in way)
        route = self._route(way, self._nodes(leaving))
        return Barrier(start, end, lower, upper, rise, used, self.proved, route)

    def _route(self, way: Sequence[tuple[int, int, Tie]], nodes: Mapping[int, int]) -> Route | None:
        """Return the ways down to both sides of the passes on a way, joined."""
        parts: list[tuple[Route, bool]] = []
        for a, b, link in way:
            routes = {
                nodes[s.minimum]: s.route
                for s in self.passes[link.source].sides
                if s.minimum is not None and s.minimum in nodes and s.route is not None
            }
            parts += [(routes[c], back) for c, back in ((a, True), (b, False)) if c in routes]
        if not parts:
            return None
        manifold = self.problem.polyhedron.manifold
        points, together = [np.zeros((0, manifold.dimension))], True
        for route, back in parts:
            part = route.vertices[::-1] if back else route.vertices
            if len(points) > 1:
                # Parts end where the next begins up to whole turns; on loci perhaps elsewhere.
                apart = manifold.difference(points[-1][-1], part[0])
                part = part + (points[-1][-1] - part[0] - apart)
                together &= bool((abs(apart) <= DEFAULT.alike * self.problem.scales).all())
            points.append(part)
        heights = np.concatenate([r.energies[::-1] if back else r.energies for r, back in parts])
        verified = together and all(route.verified for route, _ in parts)
        return Route(np.concatenate(points), heights, max(r.top for r, _ in parts), verified)

    def escape(self, start: int) -> Barrier:
        """Return the least energy at which the region can be left from a minimum.

        Both bounds are infinite where it is proved that it cannot: the region is a cage.

        Parameters
        ----------
        start : int
            The number of a minimum.

        Raises
        ------
        TypeError, ValueError
            For a number of no minimum, or if no region was given.
        """
        if not self.region:
            msg = "escape: expected a landscape of a region that may be left; none was given"
            raise ValueError(msg)
        checks.whole("start", start, least=0, most=len(self.minima) - 1)
        return self._barrier(start, OUTSIDE)

    def depth(self, start: int) -> Bounds:
        """Return bounds of the least rise after which a minimum is joined to one not higher.

        Infinite for a lowest minimum without an equal.  Of a region that may be left, points on its
        wall are not among the minima.

        Parameters
        ----------
        start : int
            The number of a minimum.

        Raises
        ------
        TypeError, ValueError
            For a number of no minimum.
        """
        checks.whole("start", start, least=0, most=len(self.minima) - 1)
        one = self.minima[start]
        # What is not decided may hide a minimum as low as its energy, and so may all above the cap.
        hidden = [self.cap, *(p.energy[0] for p in self.passes if not self._is_known(p))]
        low, high = (0.0 if min(hidden) <= one.energy[1] else inf), inf
        for k, other in enumerate(self.minima):
            if k == start:
                continue
            found = self._barrier(start, k)
            if other.energy[0] <= one.energy[1]:
                low = min(low, found.rise[0])
            if other.energy[1] <= one.energy[0] or other.orbit == one.orbit:
                high = min(high, found.rise[1])
        return low, high

    @cached_property
    def merges(self) -> tuple[Merge, ...]:
        """Where components merge, the lowest first."""
        found = []
        for one in self._upper[False].joins:
            if one.second < len(self.minima):
                p = self.passes[one.link.source]
                energy = p.energy[0], max(p.energy[1], one.link.weight)
                found.append(Merge(one.link.source, energy, one.first, one.second))
        return tuple(found)

    @cached_property
    def loops(self) -> tuple[int, ...]:
        """The passes whose sides are all known, and joined below them already."""
        used = {one.link.source for one in self._upper[False].joins}
        known = [
            k for k, p in enumerate(self.passes)
            if p.sides and all(side.minimum is not None for side in p.sides)
        ]  # fmt: skip
        return tuple(k for k in known if k not in used and self.passes[k].kind != "exit")

    @property
    def complete(self) -> bool:
        """Whether it is proved that the tree is the one of all minima and passes below ``cap``."""
        return self.proved and all(p.kind != "undecided" and self._is_known(p) for p in self.passes)

    # ------------------------------------------------------------------------------------- printed

    @property
    def statement(self) -> str:
        """What is proved, or found, in a sentence."""
        one = len(self.minima), len(self.passes)
        words = ("minimum" if one[0] == 1 else "minima", "pass" if one[1] == 1 else "passes")
        counts = f"{one[0]} {words[0]} and {one[1]} {words[1]}"
        below_cap = "" if self.cap == inf else f" up to the energy {number(self.cap)}"
        if not self.complete:
            return f"Found, not proved to be all: {counts}{below_cap}."
        return f"Proved: the energy has {counts}{below_cap}."

    def __repr__(self) -> str:
        """Return the statement."""
        return f"Landscape({self.statement})"

    def _sheet(self) -> Sheet:
        names = self.problem.polyhedron.manifold.names
        rows = []
        for k, m in enumerate(self.minima):
            rise = self.depth(k)[1] if len(self.minima) > 1 else inf
            rows.append(
                (str(k), *map(number, m.point), number(m.energy[0]), number(rise), _held(m.active))
            )
        head = ("", *names, "energy", "depth", "active")
        tables = [Table(head, tuple(rows), tuple(range(1, len(names) + 3)), "Minima")]
        loops = frozenset(self.loops)
        links = tuple(
            (
                str(k),
                number(p.energy[0]),
                number(p.energy[1]),
                p.kind + (" (loop)" if k in loops else ""),
                ", ".join("?" if s.minimum is None else _label(s.minimum) for s in p.sides) or "?",
                _held(p.active),
            )
            for k, p in enumerate(self.passes)
        )
        titles = ("", "energy from", "to", "kind", "sides", "active")
        if links:
            tables.append(Table(titles, links, (1, 2), "Passes"))
        counts = [("merges", str(len(self.merges))), ("loops", str(len(self.loops)))]
        if self.euler is not None:
            counts.append(("Euler characteristic", str(self.euler)))
        unit = units(self.problem.polyhedron.manifold.periods)
        return Sheet("Landscape", (self.statement, facts(counts), *tables, *self.notes, unit))


def _held(active: tuple[str, ...]) -> str:
    return " ".join(active) or "none"


def _label(minimum: int) -> str:
    return "outside" if minimum < 0 else str(minimum)

"""Landscapes: minima, passes, and the tree in which components of sublevel sets merge.

``D_c = {q in D : E(q) <= c}``.  Each local minimum starts a component of ``D_c``, and components
merge at passes alone (:mod:`~polycorner.landscapes.passes`).  The *barrier* between two minima is
the least ``c`` for which they are in one component of ``D_c``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, nextafter
from typing import Literal

import numpy as np

from polycorner import checks
from polycorner.landscapes.graph import Forest, Link
from polycorner.landscapes.routes import Route
from polycorner.minimisation.problem import Problem
from polycorner.printing import Printed, Sheet, Table, facts, number, units
from polycorner.spaces.manifold import Array
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
        The number of the minimum; -1 for the outside of the region; None where none is known.
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
    """

    problem: Problem
    minima: tuple[Minimum, ...]
    passes: tuple[Pass, ...]
    proved: bool
    cap: float = inf
    region: bool = False
    notes: tuple[str, ...] = ()

    # ------------------------------------------------------------------------------------ barriers

    @cached_property
    def _lower(self) -> Forest:
        """Links wherever there may be one, by lower bounds."""
        every, links = range(self._count), []
        for k, p in enumerate(self.passes):
            known = p.sides and all(side.verified for side in p.sides)
            nodes = [self._node(s.minimum) for s in p.sides] if known else every
            links.append(Link(tuple(nodes), p.energy[0], k))
        return Forest(self._count, links)

    @cached_property
    def _upper(self) -> Forest:
        """Links along routes, the verified ones of a proof alone, by upper bounds."""
        links = []
        for k, p in enumerate(self.passes):
            sides = [s for s in p.sides if s.minimum is not None]
            if self.proved:
                sides = [s for s in sides if s.verified]
            tops = [s.route.top for s in sides if s.route] if p.kind != "exit" else []
            top = max([p.energy[1], *tops])
            links.append(Link(tuple([self._node(s.minimum) for s in sides]), top, k))
        return Forest(self._count, links)

    @property
    def _count(self) -> int:
        return len(self.minima) + self.region

    def _node(self, minimum: int | None) -> int:
        return len(self.minima) if minimum == OUTSIDE else int(minimum or 0)

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
        a, b = start, self._node(end)
        ends = [self.minima[k].energy for k in (start, end) if k != OUTSIDE]
        lower = max(min(self._lower.bottleneck(a, b), self.cap), *(low for low, _ in ends))
        upper, way = self._upper.bottleneck(a, b), self._upper.path(a, b) or ()
        upper = max(upper, *(high for _, high in ends))
        low, high = self.minima[start].energy
        rise = max(below(lower, high), 0.0), above(upper, low)
        used = tuple(link.source for _, _, link in way)
        route = self._route(way)
        return Barrier(start, end, lower, upper, rise, used, self.proved, route)

    def _route(self, way: Sequence[tuple[int, int, Link]]) -> Route | None:
        """Return the ways down to both sides of the passes on a way, joined."""
        parts: list[tuple[Route, bool]] = []
        for a, b, link in way:
            sides = {self._node(s.minimum): s.route for s in self.passes[link.source].sides}
            for node, backwards in ((a, True), (b, False)):
                route = sides.get(node)
                if route is not None:
                    parts.append((route, backwards))
        if not parts:
            return None
        points = np.concatenate([r.vertices[::-1] if back else r.vertices for r, back in parts])
        heights = np.concatenate([r.energies[::-1] if back else r.energies for r, back in parts])
        period = np.array(self.problem.polyhedron.manifold.periods)
        finite = np.isfinite(period)
        # Parts end where the next begins up to whole turns, which are unrolled.
        steps = np.diff(points, axis=0)
        turns = np.zeros_like(steps)
        turns[:, finite] = np.rint(steps[:, finite] / period[finite]) * period[finite]
        points = points - np.vstack([np.zeros(points.shape[1]), np.cumsum(turns, axis=0)])
        tops = [route.top for route, _ in parts]
        return Route(points, heights, max(tops), all(route.verified for route, _ in parts))

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

        Infinite for a lowest minimum without an equal.

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
        low, high = inf, inf
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
        for one in self._upper.joins:
            if max(one.first, one.second) < len(self.minima):
                p = self.passes[one.link.source]
                energy = p.energy[0], max(p.energy[1], one.link.weight)
                found.append(Merge(one.link.source, energy, one.first, one.second))
        return tuple(found)

    @cached_property
    def loops(self) -> tuple[int, ...]:
        """The passes whose sides are joined below them already."""
        used = {one.link.source for one in self._upper.joins}
        known = (k for k, p in enumerate(self.passes) if p.sides and p.kind != "undecided")
        return tuple(k for k in known if k not in used)

    @property
    def complete(self) -> bool:
        """Whether it is proved that the tree is the one of all minima and passes below ``cap``."""
        return self.proved and all(
            p.kind != "undecided" and p.sides and all(s.verified for s in p.sides)
            for p in self.passes
        )

    # ------------------------------------------------------------------------------------- printed

    @property
    def statement(self) -> str:
        """What is proved, or found, in a sentence."""
        counts = f"{len(self.minima)} minima and {len(self.passes)} passes"
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
        unit = units(self.problem.polyhedron.manifold.periods)
        return Sheet("Landscape", (self.statement, facts(counts), *tables, *self.notes, unit))


def _held(active: tuple[str, ...]) -> str:
    return " ".join(active) or "none"


def _label(minimum: int) -> str:
    return "outside" if minimum == OUTSIDE else str(minimum)

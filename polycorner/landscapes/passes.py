"""From complete lists to minima and passes: what can join components of sublevel sets, and where.

Components of ``D_c = {q in D : E(q) <= c}`` change at critical points alone
(:mod:`~polycorner.proofs.lists.critical`).  Let the gradients of the functions ``A`` that vanish at
one be independent, ``dE = sum lam_i df_i`` with ``lam_i > 0`` for all of them, and the
Lagrangian's Hessian on the face ``f_A = 0`` be regular with ``k`` negative eigenvalues.  Let
``nu`` be the number of components of ``{E < E(p)}`` in ``D`` near ``p``.

*Intersections.*  ``nu`` is 0, 2, 1 for ``k = 0``, ``k = 1``, ``k >= 2``.  *Proof.*  In coordinates
``u = (f_i g_i), y`` with ``g_i > 0`` the energy is ``E(p) + sum u_i + Q(y)`` and the set is
``u >= 0``; ``{sum u_i + Q < 0, u >= 0}`` retracts to ``{u = 0, Q < 0}``, which is empty, two cones,
or connected.

*Unions.*  Let ``beta_1, beta_2, ...`` be the minimal sets of functions of ``A`` one of which has to
hold.  If there is but one, and it is ``A``, the above applies.  Otherwise join ``beta`` and
``gamma`` unless ``beta u gamma = A``; ``nu`` is the number of classes for ``k = 0`` and 1 for
``k >= 1``.  *Proof.*  Near ``p`` each part ``{f_beta >= 0, sum u_i < 0}`` is convex in these
coordinates and not empty, and two meet unless all ``u_i >= 0`` in both.  With ``Q`` the parts are
joined along a direction in which ``Q < 0``.

*Euler characteristic.*  Let ``N`` be the nerve of these parts: the sets of pieces whose union is
not ``A``.  Passing the energy of the point adds ``(-1)^k (1 - chi(N))`` to the Euler characteristic
of ``D_c``.  *Proof.*  The part of ``D`` near ``p`` below ``E(p)`` is homotopic to the nerve for
``k = 0``, as intersections of its parts are convex, and to its join with a sphere of dimension
``k - 1`` otherwise; what is added is the cone over it.

*Loci.*  Where ``E`` depends on ``z`` alone and has a regular stationary point of index ``k`` there,
each connected component of the points of ``D`` with this ``z`` counts as one point; the two sides
for ``k = 1`` differ in the sign of the unstable coordinate of ``z``, all along it.

*Regions that may be left.*  A component of ``D_c`` in the region reaches the wall ``g = 0`` exactly
if it contains a local minimum of ``E`` on that wall: the lowest of its points there is one.

A pass joins what lies on its sides.  A verified route from a side, below the pass, says which
component that is (:mod:`.descents`).  A pass without such routes, and whatever the list leaves
undecided, is taken to join everything, from the least energy it may have: bounds from below hold
all the same.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import numpy as np
from scipy.optimize import linprog

from polycorner.intervals.balls import ball, between, precision
from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Undecided
from polycorner.intervals.tapes import Box
from polycorner.landscapes.barriers import OUTSIDE, Bounds, Kind, Minimum, Pass, Side
from polycorner.landscapes.components import components
from polycorner.landscapes.curves import BITS, Curves, Spot, above, under
from polycorner.landscapes.descents import Descents, Target, unwound
from polycorner.landscapes.pieces import nerve, parted
from polycorner.polyhedra.polyhedron import Piece
from polycorner.proofs import StationaryList, StationaryPoint
from polycorner.proofs.kkt import KKTSystem, enclose, newton
from polycorner.proofs.lists.critical import CriticalList, CriticalMember
from polycorner.proofs.lists.images import Motion
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT

# Whether a way bends down, what is held or rises along it, and its direction, scaled.
Start: TypeAlias = tuple[bool, frozenset[int], Array]


def _both(held: frozenset[int], way: Array | None) -> list[Start]:
    return [] if way is None else [(True, held, way), (True, held, -way)]


@dataclass
class PossiblePass:
    """A pass before its sides are known.

    Attributes
    ----------
    spot : Spot
    active : tuple of str
    index : int or None
    kind : str
    orbit : int
    starts : list of (bool, frozenset of int, (n,) array)
        For each side whether it begins along the face, the functions that stay zero or grow, and a
        direction in scaled coordinates.
    sides : list of Side
    """

    spot: Spot
    active: tuple[str, ...]
    index: int | None
    kind: Kind
    orbit: int
    energy: Bounds
    starts: list[Start] = field(default_factory=list)
    sides: list[Side] = field(default_factory=list)

    def told(self, sides: Iterable[Side]) -> Pass:
        """Return the pass with its sides."""
        about = self.spot.middle, self.energy, self.active, self.index, self.kind
        return Pass(*about, tuple(sides), self.orbit)


@dataclass
class ListedMinimum:
    """A minimum, or a component of a locus of minima, and where descents to it end."""

    minimum: Minimum
    target: Target


class Sorted:
    """The critical points of a list, by what they are."""

    def __init__(
        self, found: CriticalList, exits: frozenset[str], room: Curves, cap: float
    ) -> None:
        self.found, self.problem, self.exits = found, found.problem, exits
        self.curves, self.cap = room, cap
        self.functions = BoxFunctions(found.problem.functions, found.problem.polyhedron.manifold)
        self.descents = Descents(room, found.domain.free)
        self.nodes: list[ListedMinimum] = []
        self.outside: list[Target] = []  # minima at the walls of a region that may be left
        self.candidates: list[PossiblePass] = []
        self.euler: int | None = 0
        for point in found.points:
            if self._asked(point.point.lower, point.point.upper):
                self._sort(point)
        for box in found.undecided:
            self._undecided(box[0], box[1])
        self._loci()

    # ------------------------------------------------------------------------------ what they are

    def spot(self, lower: Array, upper: Array, zeros: frozenset[int]) -> Spot:
        """Return an enclosed point."""
        with precision(BITS):
            box = tuple(between(a, b) for a, b in zip(lower.tolist(), upper.tolist(), strict=True))
        return Spot(box, zeros)

    def sharp(self, p: StationaryPoint, zeros: frozenset[int], names: Sequence[str]) -> Spot:
        """Return the point of a list, enclosed to more digits where that is possible."""
        wide = self.spot(p.lower, p.upper, zeros)
        n = self.problem.dimension
        d, fixed = self.problem.polyhedron, self.found.domain.fixed
        held = (*sorted(d.names.index(name) for name in names), *self.curves.equations)
        slopes = self.problem.evaluate(wide.middle, 1)[1]
        sizes = np.linalg.norm(slopes, axis=1)
        if not np.isfinite(sizes).all() or not (sizes[list(held)] > 0).all():
            return wide
        lam = np.linalg.lstsq(
            np.vstack([slopes[list(held)], np.eye(n)[list(fixed)]]).T, slopes[-1], rcond=None
        )[0]
        units = [*self.problem.scales, *(max(sizes[-1], 1.0) / sizes[list(held)])]
        units += [1.0] * len(fixed)
        gauges = tuple(tuple(row) for row in np.eye(n)[list(fixed)].tolist())
        about = self.curves.formulas, held, gauges, tuple(wide.middle.tolist())
        system = KKTSystem(*about, tuple(map(float, units)))
        start = [ball(x) for x in (*wide.middle.tolist(), *lam.tolist())]
        found = newton(system, start, bits=BITS)
        if isinstance(found, Undecided):
            return wide
        with precision(BITS):
            image = enclose(system, found, bits=BITS)
            if isinstance(image, Undecided):
                return wide
            box = image.solution[:n]
            # A solution in the box is its only one: the one that the list has.
            inside = all(x.contains(y) for x, y in zip(wide.box, box, strict=True))
            return replace(wide, box=tuple(box)) if inside else wide

    def energy(self, spot: Spot) -> Bounds:
        """Return bounds of the energy on a box."""
        with precision(BITS):
            value = self.curves.value(spot.box)
            return (under(value), above(value)) if value.is_finite() else (-np.inf, np.inf)

    def _asked(self, lower: Array, upper: Array) -> bool:
        return self.energy(self.spot(lower, upper, frozenset()))[0] <= self.cap

    def _sort(self, one: CriticalMember) -> None:
        p, d = one.point, self.problem.polyhedron
        spot = self.sharp(p, one.zeros, p.active)
        held = frozenset(d.names.index(name) for name in p.active)
        pieces, sure = self._pieces(spot, one.unknown)
        matter = frozenset[int]().union(*pieces)
        if one.is_open or not sure:
            self._undecided(p.lower, p.upper, p.active, p.orbit)
        elif len(pieces) == 1 and p.index == 0 and pieces[0] >= held:
            self._minimum(spot, p.active, p.orbit)
            self.euler = None if self.euler is None else self.euler + 1
        elif one.zeros != held or p.index is None:
            self._undecided(p.lower, p.upper, p.active, p.orbit)
        elif matter == held:
            self._regular(spot, one, held, pieces)

    def _pieces(self, spot: Spot, unknown: frozenset[int]) -> tuple[list[Piece], bool]:
        """Return the pieces of the set at a point, and whether they are sure."""
        signs = self._signs(spot)
        unknown = unknown.union(i for i, sign in enumerate(signs) if sign is None)
        pieces = self.problem.polyhedron.signs_to_pieces(
            [0 if i in unknown else s or 0 for i, s in enumerate(signs)]
        )
        # The set grows with each function, and depends on those in one of the pieces alone.
        return pieces, not any(piece & unknown for piece in pieces)

    def _signs(self, spot: Spot) -> list[int | None]:
        """Return the signs of all inequalities at a point, None for those that are not decided."""
        ends = (np.array([[f(x) for x in spot.box]]) for f in (under, above))
        low, high = self.functions.values(*ends)
        with precision(BITS):
            rows = range(self.problem.inequalities)
            values = self.curves.formulas.values(Box(list(spot.box)), rows)
        return [
            0 if i in spot.zeros else 1 if v > 0 or a > 0 else -1 if v < 0 or b < 0 else None
            for i, (v, a, b) in enumerate(zip(values, low[0], high[0], strict=False))
        ]

    def _regular(
        self, spot: Spot, one: CriticalMember, held: frozenset[int], pieces: Sequence[Piece]
    ) -> None:
        """Sort a point with independent gradients and positive multipliers."""
        p = one.point
        if self.euler is not None and p.index is not None:
            self.euler += (-1) ** p.index * (1 - nerve(held, pieces))
        about = spot, p.active, p.index
        if len(pieces) == 1:
            if p.index == 1:
                way = self._downwards(spot, held)
                starts = _both(held, way)
                new = PossiblePass(*about, "saddle", p.orbit, self.energy(spot), starts)
                self.candidates.append(new)
        elif p.index == 0:
            classes = parted(held, pieces)
            if len(classes) > 1:
                ways = [(piece, self._into(spot, piece)) for piece in classes]
                starts = [(False, piece, way) for piece, way in ways if way is not None]
                starts = starts if len(starts) == len(classes) else []
                new = PossiblePass(*about, "tip", p.orbit, self.energy(spot), starts)
                self.candidates.append(new)

    def _minimum(self, spot: Spot, active: tuple[str, ...], orbit: int) -> None:
        target = self.descents.target(spot)
        if self.exits.intersection(self.problem.polyhedron.names[i] for i in spot.zeros):
            self.outside.append(target)
            return
        new = Minimum(spot.middle, self.energy(spot), active, "isolated", orbit)
        self.nodes.append(ListedMinimum(new, target))

    def _undecided(
        self, lower: Array, upper: Array, active: tuple[str, ...] = (), orbit: int = -1
    ) -> None:
        spot = self.spot(lower, upper, frozenset())
        self.euler = None
        new = PossiblePass(spot, active, None, "undecided", orbit, self.energy(spot))
        self.candidates.append(new)

    def _downwards(self, spot: Spot, held: frozenset[int]) -> Array | None:
        """Return the direction of negative curvature on a face, scaled."""
        rows = [*sorted(held), *self.curves.equations]
        _, slopes, bends = self.problem.evaluate(spot.middle, 2)
        free = self.descents.free
        a, g = slopes[rows][:, free], slopes[-1][free]
        lam = np.linalg.lstsq(a.T, g, rcond=None)[0] if rows else np.zeros(0)
        form = (bends[-1] - np.einsum("i,ijk->jk", lam, bends[rows]))[np.ix_(free, free)]
        null = np.linalg.svd(a)[2][len(rows) :].T if rows else np.eye(int(free.sum()))
        values, vectors = np.linalg.eigh(null.T @ form @ null)
        if not len(values) or not values[0] < 0:
            return None
        way = np.zeros(len(free))
        way[free] = null @ vectors[:, 0]
        return way

    def _into(self, spot: Spot, piece: frozenset[int]) -> Array | None:
        """Return a scaled direction in which the energy falls and the functions of a piece grow."""
        slopes: Array = self.problem.evaluate(spot.middle, 1)[1]
        free = np.flatnonzero(self.descents.free)
        rows = slopes[[*sorted(piece), self.curves.energy]][:, free]
        rows[-1] *= -1
        sizes = np.linalg.norm(rows, axis=1)
        if not (sizes > 0).all():
            return None
        level = slopes[list(self.curves.equations)][:, free]
        found = linprog(
            np.append(np.zeros(len(free)), -1.0),
            A_ub=np.column_stack([-rows / sizes[:, None], np.ones(len(rows))]),
            b_ub=np.zeros(len(rows)),
            A_eq=np.column_stack([level, np.zeros(len(level))]) if len(level) else None,
            b_eq=np.zeros(len(level)) if len(level) else None,
            bounds=[*[(-1, 1)] * len(free), (None, 1)],
        )
        if found.x is None or not found.x[-1] > 0:
            return None
        way = np.zeros(self.problem.dimension)
        way[free] = found.x[:-1] / np.linalg.norm(found.x[:-1])
        return way

    def _loci(self) -> None:
        """Sort loci, each connected component by itself."""
        if self.found.loci:
            self.euler = None
        domain = self.found.domain
        for number, place in enumerate(self.found.loci):
            z = list(place.z)
            lower, upper = place.sides(domain)
            if not self._asked(lower, upper):
                continue
            if place.sample is None:
                self._undecided(lower, upper)
                continue
            if place.index > 1:
                continue
            parts = components(self.problem, domain, z, lower, upper)
            if parts.open:
                # Other components may be hidden in what is left, and some may be one.
                self._undecided(lower, upper)
            for part in parts.parts:
                low, high = part.sample.copy(), part.sample.copy()
                low[z], high[z] = place.sharp_lower, place.sharp_upper
                spot = self.spot(low, high, frozenset())
                orbit = -2 - number
                if place.index == 0:
                    new = Minimum(spot.middle, self.energy(spot), (), "locus", orbit)
                    target = self.descents.target(spot, part)
                    self.nodes.append(ListedMinimum(new, target))
                else:
                    way = self._unstable(spot, z)
                    about = self.energy(spot), _both(frozenset(), way)
                    self.candidates.append(PossiblePass(spot, (), 1, "locus", orbit, *about))

    def _unstable(self, spot: Spot, z: Sequence[int]) -> Array | None:
        bends = self.problem.evaluate(spot.middle, 2)[2][-1]
        values, vectors = np.linalg.eigh(bends[np.ix_(z, z)])
        way = np.zeros(self.problem.dimension)
        way[list(z)] = vectors[:, 0]
        return way if values[0] < 0 else None

    # ------------------------------------------------------------------------------------- exits

    def leave(self, found: StationaryList, wall: str) -> None:
        """Add the points where a region can be left through a wall: the minima on it."""
        d = self.problem.polyhedron
        g = d.names.index(wall)
        for p in found.points:
            lam = p.multipliers.get(wall)
            zeros = frozenset(d.names.index(name) for name in (*p.active, *p.redundant)) | {g}
            spot = self.sharp(p, zeros, (*p.active, wall))
            plain = p.index == 0 and not p.redundant and lam is not None
            pieces, sure = self._pieces(spot, frozenset())
            if lam is not None and plain and sure and lam[0] > 0 and len(pieces) == 1:
                continue  # a minimum of the region itself, at its wall
            starts = []
            if lam is not None and sure and lam[1] < 0:
                ways = [(piece, self._into(spot, piece)) for piece in pieces]
                starts = [(False, piece, way) for piece, way in ways if way is not None][:1]
            self.candidates.append(
                PossiblePass(
                    spot, (*p.active, wall), p.index, "exit", -1, self.energy(spot), starts,
                    [Side(OUTSIDE)],
                )
            )  # fmt: skip
        for p in found.open_points:
            self._undecided(p.lower, p.upper, (*p.active, wall))
        for box in found.undecided:
            self._undecided(box[0], box[1], (wall,))
        if found.loci:
            for place in found.loci:
                lower, upper = found.domain.lower.copy(), found.domain.upper.copy()
                for name, low in place.lower.items():
                    i = d.manifold.names.index(name)
                    lower[i], upper[i] = low, place.upper[name]
                self._undecided(lower, upper, (wall,))

    # ------------------------------------------------------------------------------------- sides

    def passes(self, stopped: Callable[[], bool]) -> Iterator[Pass]:
        """Yield the passes, with their sides followed down, each orbit once and carried along.

        Sides are not known any more once ``stopped`` is true.
        """
        self.nodes.sort(key=lambda node: node.minimum.energy)
        targets = [*(node.target for node in self.nodes), *self.outside]
        motions = [(g, self._permutation(g)) for g in self.found.motions]
        known: dict[tuple[int, str], Pass] = {}
        for one in sorted(self.candidates, key=lambda c: c.energy):
            first = known.get((one.orbit, one.kind)) if one.orbit >= 0 else None
            image = None if first is None else self._image(first, one, motions)
            if image is not None:
                yield image
                continue
            found = (
                Side(None) if stopped() else self._side(one, start, targets) for start in one.starts
            )
            sides = [*one.sides, *found]
            if one.kind == "exit" and not one.starts:
                sides = []
            new = one.told(sides)
            if one.orbit >= 0:
                known.setdefault((one.orbit, one.kind), new)
            yield new

    def _side(
        self,
        one: PossiblePass,
        start: Start,
        targets: Sequence[Target],
    ) -> Side:
        bent, held, way = start
        if bent:
            begun = self.descents.begin(one.spot, held, way)
        else:
            begun = self.descents.fall(one.spot, held, way)
        if not begun:
            return Side(None)
        found = self.descents.route(begun, one.spot, targets)
        if found is None:
            return Side(None)
        number, route = found
        if number >= len(self.nodes):
            return Side(OUTSIDE - 1 - number + len(self.nodes), route)
        return Side(number, route)

    def _permutation(self, g: Motion) -> list[int | None]:
        """Return where a symmetry takes the nodes; None where that is not decided."""
        manifold = self.problem.polyhedron.manifold
        found: list[int | None] = []
        for node in self.nodes:
            q = g(node.target.spot.middle, manifold)
            here = []
            for k, other in enumerate(self.nodes):
                apart = abs(manifold.difference(q, other.target.spot.middle)) / self.problem.scales
                apart[node.target.along] = 0.0
                alike = (node.target.part is None) == (other.target.part is None)
                if (
                    alike
                    and apart.max() < DEFAULT.same
                    and (not other.target.part or other.target.part.has(q))
                ):
                    here.append(k)
            found.append(here[0] if len(here) == 1 else None)
        return found

    def _image(
        self,
        first: Pass,
        one: PossiblePass,
        motions: Sequence[tuple[Motion, list[int | None]]],
    ) -> Pass | None:
        """Return a pass carried along by the symmetry that takes another one to it."""
        manifold = self.problem.polyhedron.manifold
        for g, moved in motions:
            apart = abs(manifold.difference(g(first.point, manifold), one.spot.middle))
            if (apart / self.problem.scales).max() < DEFAULT.same:
                sides = []
                for side in first.sides:
                    if side.minimum is None or side.route is None:
                        sides.append(side)
                        continue
                    # Where minima on walls go is not asked: such sides are followed once more.
                    there = None if side.minimum < 0 else moved[side.minimum]
                    if there is None:
                        return None
                    path = np.array([g(q, manifold) for q in side.route.vertices])
                    sides.append(Side(there, replace(side.route, vertices=unwound(manifold, path))))
                return one.told(sides)
        return None

"""Identification of minima: single points or connected loci, up to a symmetry.

Two stationary points of the same energy are identified if, for the image of the second under the
finite group that is nearest to the known points of the first,

1. their invariants agree: they are one point, up to the symmetry; or
2. the straight segment between them stays in the polyhedron and on the level of the energy; or
3. one can walk from the first to the second along directions in which the energy is flat, every
   step ending in Newton's method or a descent that stays on the level, none crossing a wall.

The third is tried only where more directions are flat than the symmetry explains.  Points that none
of these connects stay apart, and points separated by less than the samples' distance may be one.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from polycorner.minimisation.analysis import analyse
from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import rank
from polycorner.polyhedra.polyhedron import Piece
from polycorner.polyhedra.quotients import Quotient
from polycorner.polyhedra.strata import distances
from polycorner.spaces.manifold import Array

FINE = 0.05  # distance between samples of a segment, in scale units
LONGEST = 50_000  # samples of the longest segment tried
STRIDE = 0.5  # longest step of a walk, in scale units
STEPS = 200  # of a walk, at most
PARTS = (1.0, 0.5, 0.25, 0.1, 0.02)  # fractions of a step, tried in turn
GAIN = 0.1  # fraction of its length by which a step must approach its goal
BESIDE = 0.1  # distance of the second point at which a symmetry is checked, in scale units
NET = 0.5  # distance between the points kept of a locus, in scale units
PAIRS = 3  # nearest pairs of points tried to connect two loci


@dataclass(frozen=True, eq=False)
class Paths(Quotient):
    """The points of a problem's polyhedron up to a symmetry, and paths between them."""

    problem: Problem = field(kw_only=True)

    def are_relabelled(self, p: Array, q: Array) -> bool:
        """Whether a group too large to list carries ``p`` to the orbit of ``q``."""
        return self.symmetry.relabel is not None and bool(
            self.symmetry.relabellings(self.manifold, p, q, self.tolerances.same)
        )

    def flat_beyond(self, found: Certificate) -> bool:
        """Whether the energy is flat in more directions than the symmetry explains."""
        known = self.orbit(found.point)
        return found.signature[2] > rank(known, found.rank_tolerance)

    def active_count(self, found: Certificate) -> int:
        """Return the number of functions that vanish at a point, without analysing it."""
        values, gradients = self.problem.evaluate(found.point, 1)
        away = distances(values[:-1], gradients[:-1])
        return int((abs(away[: self.problem.inequalities]) <= found.tolerance).sum())

    def is_straight(self, p: Array, q: Array, energy: float, slack: float) -> bool:
        """Whether the segment from ``p`` to ``q`` stays in the set and on a level of the energy."""
        manifold = self.manifold
        way = manifold.difference(q, p)
        parts = math.ceil(float(abs(way / self.scales).max()) / FINE) + 1
        if parts > LONGEST:
            return False
        away, energies = self._along(
            # Both ends are known to lie in the set.
            manifold.moved(p, np.linspace(0, 1, parts + 1)[1:-1, None] * way)
        )
        if not (abs(energies - energy) <= slack).all():
            return False
        return self._holds(away)

    def _holds(self, away: Array) -> bool:
        inside, off = np.split(away, [self.problem.inequalities], axis=1)
        enters = self.polyhedron.implicit_of(inside) >= -self.tolerances.zero
        return bool(enters.all() and (abs(off) <= self.tolerances.zero).all())

    def _along(self, points: Array) -> tuple[Array, Array]:
        """Return the scaled distances to all functions at points, and the energies there."""
        values, gradients = self.problem.evaluate(points, 1)
        sizes = np.linalg.norm(gradients[:, :-1], axis=-1)
        return values[:, :-1] / np.maximum(sizes, 1e-300), values[:, -1]

    def _is_clear(self, p: Array, step: Array) -> bool:
        """Whether a step crosses no wall; contacts of ``p`` may be violated to second order."""
        parts = math.ceil(abs(step).max() / FINE)
        along = np.linspace(0, 1, parts + 1)[:, None]
        manifold = self.manifold
        away, _ = self._along(manifold.moved(p, along * step * self.scales))
        closed = abs(away[0]) <= self.tolerances.same
        # A chord of a curved wall cuts into it by about half the square of its length.
        bent = np.where(closed, (along * abs(step).max()) ** 2, 0.0)
        inside = (away + bent)[:, : self.problem.inequalities]
        enters = self.polyhedron.implicit_of(inside) >= -self.tolerances.zero
        return bool(enters.all())

    def is_walkable(self, p: Array, q: Array, energy: float, slack: float) -> bool:
        """Whether a walk on a level of the energy connects ``p`` to the orbit of ``q``."""
        goal = self.place(q)
        for _ in range(STEPS):
            miss = goal - self.place(p)
            if abs(miss).max() <= self.tolerances.same:
                return True
            way = self._towards(p, miss, slack)
            reached = None if way is None else self._stepped(p, *way, goal, energy, slack)
            if reached is None:
                return False
            p = reached
        return False

    def _towards(self, p: Array, miss: Array, slack: float) -> tuple[Array, Piece] | None:
        """Return the step along flat directions that best reduces ``miss``, and what is active.

        One that does not reduce it by a thousandth leads nowhere.
        Near a crossing of loci all curvatures are small: up to ``slack`` they are flat.
        """
        flat, active = self._flat(p, slack)
        if not flat.shape[1]:
            return None
        moves = 1e-5 * flat.T * self.scales
        # Differences: invariants of a user's symmetry have no derivatives that are known.
        slopes = [(self.place(p + v) - self.place(p - v)) / 2e-5 for v in moves]
        weights = np.linalg.lstsq(np.array(slopes).T, miss, rcond=1e-6)[0]
        if np.linalg.norm(miss - weights @ slopes) > (1 - 1e-3) * np.linalg.norm(miss):
            return None
        step = flat @ weights
        step = step * min(1.0, STRIDE / max(abs(step).max(), 1e-300))
        return step, active

    def _flat(self, p: Array, slack: float) -> tuple[Array, Piece]:
        """Return flat directions at a minimum as columns, none elsewhere, and what is active."""
        analysis = analyse(self.problem, p, self.tolerances, higher="none")
        curvature = analysis.curvature
        level = max(analysis.small_curvature, slack)
        flat = curvature.vectors[:, abs(curvature.values) <= level]
        falls = curvature.least < -level
        return flat[:, :0] if falls else flat, frozenset(analysis.active)

    def beside(self, p: Array, energy: float, slack: float) -> Iterator[Array]:
        """Yield points of a locus on all sides of one of it, about half a stride away."""
        flat, active = self._flat(p, slack)
        for step in STRIDE * np.vstack([flat.T, -flat.T]):
            if self._is_clear(p, step):
                guess = self.manifold.moved(p, step * self.scales)
                point = self._settled(guess, active, STRIDE / 2, (energy, slack))
                if point is not None:
                    yield point

    def _stepped(
        self, p: Array, step: Array, active: Piece, goal: Array, energy: float, slack: float
    ) -> Array | None:
        """Return the minimum near a fraction of ``p + step`` if that is nearer to the goal."""
        manifold = self.manifold
        before = float(np.linalg.norm(goal - self.place(p)))
        for part in PARTS:
            length = part * abs(step).max()
            if not self._is_clear(p, part * step):
                continue
            guess = manifold.moved(p, part * step * self.scales)
            point = self._settled(guess, active, 0.5 * length, (energy, slack))
            left = np.inf if point is None else float(np.linalg.norm(goal - self.place(point)))
            # A step that brings the goal hardly nearer goes around it.
            if before - left >= GAIN * min(length, before):
                return point
        return None

    def _settled(
        self, q: Array, active: Piece, near: float, level: tuple[float, float]
    ) -> Array | None:
        """Return a point near ``q`` on a level, by Newton's method or else by a longer descent."""
        point, last = self.problem.on_face(active, q)
        settled = last < self.tolerances.settled and self._holds(self._along(point[None])[0])
        if not settled or self._apart(point, q) > near:
            posed, both = self.problem, self.tolerances
            found = minimise(
                posed.polyhedron,
                posed.energy,
                q,
                tolerance=both.zero,
                rank_tolerance=both.rank,
            )
            point, settled = found.point, found.search is None
        # Another minimum may be as near as the locus.
        same = abs(self.problem.energy.value(point) - level[0]) <= level[1]
        return point if settled and same and self._apart(point, q) <= near else None

    def _apart(self, p: Array, q: Array) -> float:
        return float(abs(self.polyhedron.manifold.chord(p, q) / self.scales).max())


@dataclass(eq=False)
class Locus:
    """A stationary point, or a connected locus of them, up to the symmetry.

    Attributes
    ----------
    certificate : Certificate
        Of a representative.
    energy, slack : float
        The energy, and the difference up to which another energy is equal to it.
    wide : bool
        Whether the energy is flat in more directions than the symmetry explains.
    points, images : list of (n,) arrays
        One, or a net of points of the locus, and all images of these.
    places : (k, d) array
        Their invariants; see :meth:`~polycorner.polyhedra.quotients.Quotient.place`.
    starts : list of int
        The numbers of the starts that ended here.
    """

    certificate: Certificate
    energy: float
    slack: float
    wide: bool
    points: list[Array]
    images: list[Array]
    places: Array
    starts: list[int] = field(default_factory=list)

    def nearest(self, place: Array) -> tuple[float, int]:
        """Return the distance of a place from the nearest image, and the index of that image."""
        apart = ((self.places - place) ** 2).sum(axis=1)
        k = int(apart.argmin())
        return math.sqrt(apart[k]), k


Near = tuple[float, int, Locus]  # with the distance from a point and the nearest image's index


@dataclass(eq=False)
class Loci:
    """The stationary points found so far, each locus once up to the symmetry."""

    quotient: Paths
    loci: list[Locus] = field(default_factory=list)

    def add(self, found: Certificate) -> Locus:
        """Return the locus that the end of a descent belongs to, a new one if none is known."""
        energy, place = found.energy, self.quotient.place(found.point)
        level = [locus for locus in self.loci if abs(locus.energy - energy) <= locus.slack]
        # The nearest first: nearly always it is the one, and other comparisons are dear.
        near = sorted(((*locus.nearest(place), locus) for locus in level), key=lambda near: near[0])
        same = self._known(near, found.point)
        if same is None:
            same = self._connected(near, found.point)
            if same is None:
                same = self._new(found, energy)
                self.loci.append(same)
            else:
                self._extend(same, found, place)
        return same

    def merge(self) -> None:
        """Merge loci that turn out to be connected, once all descents are done."""
        wide = [locus for locus in self.loci if locus.wide]
        for k, first in enumerate(wide):
            for other in wide[k + 1 :]:
                level = abs(first.energy - other.energy) <= first.slack
                # It may have been merged with another one on the way.
                if level and other in self.loci and self._joined(first, other):
                    self._merge(first, other)

    def _new(self, found: Certificate, energy: float) -> Locus:
        slack = self.quotient.tolerances.level * (abs(energy) + found.analysis.reference)
        wide = self.quotient.flat_beyond(found)
        images = self.quotient.images(found.point)
        places = np.array([self.quotient.place(q) for q in images])
        return Locus(found, energy, slack, wide, [found.point], images, places)

    def _known(self, near: list[Near], point: Array) -> Locus | None:
        """Return the locus that contains a point, if one does."""
        for apart, _, locus in near:
            same = apart <= self.quotient.tolerances.same
            if same or self.quotient.are_relabelled(locus.points[0], point):
                return locus
        return None

    def _connected(self, near: list[Near], point: Array) -> Locus | None:
        """Return the nearest locus with a path to a point, a straight one if possible."""
        # Straight ways to all loci before a walk to any: a walk costs much more.
        for _, k, locus in near:
            if self.quotient.is_straight(locus.images[k], point, locus.energy, locus.slack):
                return locus
        for _, k, locus in near:
            if locus.wide and self.quotient.is_walkable(
                locus.images[k], point, locus.energy, locus.slack
            ):
                return locus
        return None

    def _extend(self, locus: Locus, found: Certificate, place: Array) -> None:
        """Add a point to the net; make it the representative if fewer functions vanish there."""
        counts = [self.quotient.active_count(c) for c in (locus.certificate, found)]
        if counts[1] < counts[0]:
            locus.certificate = found
        if locus.nearest(place)[0] > NET:
            self._cast(locus, found.point)

    def _cast(self, locus: Locus, point: Array) -> None:
        """Add a point to the net of a locus."""
        images = self.quotient.images(point)
        locus.points.append(point)
        locus.images += images
        locus.places = np.vstack([locus.places, [self.quotient.place(q) for q in images]])

    def spread(self, locus: Locus) -> None:
        """Walk along a locus on all sides of its net until that covers it, or has many points."""
        for p in locus.points:  # those that are found meanwhile among them
            if len(locus.points) >= STEPS:
                break
            for q in self.quotient.beside(p, locus.energy, locus.slack):
                if locus.nearest(self.quotient.place(q))[0] > NET / 2:
                    self._cast(locus, q)

    def _merge(self, first: Locus, other: Locus) -> None:
        self.loci.remove(other)
        first.starts += other.starts
        first.points += other.points
        first.images += other.images
        first.places = np.vstack([first.places, other.places])
        counts = [self.quotient.active_count(locus.certificate) for locus in (first, other)]
        if counts[1] < counts[0]:
            first.certificate = other.certificate

    def _joined(self, first: Locus, other: Locus) -> bool:
        """Whether a path connects two loci between their nearest points."""
        ends = [(*first.nearest(self.quotient.place(q)), q) for q in other.points]
        for _, k, q in sorted(ends, key=lambda end: end[0])[:PAIRS]:
            for way in (self.quotient.is_straight, self.quotient.is_walkable):
                if way(first.images[k], q, first.energy, first.slack):
                    return True
        return False


def check_symmetry(quotient: Paths, points: Array) -> None:
    """Raise ValueError for a symmetry that changes the energy at points, or at others nearby.

    At a point alone, the energy may happen to be stationary along a motion.
    """
    problem, symmetry = quotient.problem, quotient.symmetry
    changing = 10 * quotient.tolerances.level
    # In no special direction, and the same every time.
    beside = BESIDE * np.cos(np.arange(1, problem.dimension + 1)) * problem.scales
    for q in [*points, *(points + beside)]:
        values, gradients, hessians = problem.evaluate(q, 2)
        size = max(abs(gradients[-1]).max(), abs(hessians[-1]).max(), 1e-300)
        slopes = quotient.orbit(q) @ gradients[-1]
        images = [float(problem.energy.value(g.apply(q))) for g in symmetry.elements]
        changes = abs(np.array(images) - values[-1])
        for part, wrong in (
            ("tangent", abs(slopes) > changing * size),
            ("element", changes > changing * (abs(values[-1]) + size)),
        ):
            if wrong.any():
                msg = (
                    "symmetry: expected one that leaves the energy unchanged; "
                    f"got {part} {int(wrong.argmax())}, which changes it at {q.tolist()}"
                )
                raise ValueError(msg)

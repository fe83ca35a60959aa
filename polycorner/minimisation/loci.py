"""When two rests are one: the same point, or points of one locus, up to a symmetry.

Two rests of the same energy are taken for one where, for the image of the second under the finite
group that is nearest to what is known of the first,

1. their invariants agree: they are one point, up to the symmetry; or
2. the straight way between them stays in the polyhedron and on the level of the energy; or
3. one can walk from the first to the second along directions in which the energy is flat, every
   step brought back to rest on that level and through no wall.

The third is tried only where more directions are flat than the symmetry explains.  Rests that
nothing connects stay apart: a locus that winds may be counted more than once.  Two that a wall or
a barrier separates may be counted as one if it is thinner than the samples of a way are apart.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.certificate import Certificate
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.problem import Problem
from polycorner.polyhedra.cones import rank
from polycorner.polyhedra.strata import distances
from polycorner.polyhedra.symmetry import Symmetry
from polycorner.spaces.manifold import Array

SAME = 1e-6  # distance of invariants, in scale units, within which two rests are one point
LEVEL = 1e-9  # difference of energies, relative to their size, that counts as none
MISS = 1e-8  # scaled distance by which the straight way may miss the polyhedron
FINE = 0.05  # scale units between samples of a way
LONGEST = 50_000  # samples; no straight way is longer
STRIDE = 0.5  # longest step of a walk, in scale units
STEPS = 200
PARTS = (1.0, 0.5, 0.25, 0.1, 0.02)  # of a step, tried in turn
GAIN = 0.1  # part of its length by which a step must approach its goal
BESIDE = 0.1  # scale units between a point and the one beside it
INVARIANT = 1e-8  # relative change of the energy that a symmetry may make
NET = 0.5  # scale units between the points of a locus that are kept
PAIRS = 3  # nearest pairs of points between which two loci may be joined


@dataclass(frozen=True, eq=False)
class Quotient:
    """The points of a problem's manifold up to a symmetry, with the ways between them."""

    problem: Problem
    symmetry: Symmetry

    @cached_property
    def _circles(self) -> tuple[NDArray[np.bool_], Array]:
        """Which coordinates are circles, and the radii of those in scale units."""
        manifold = self.problem.polyhedron.manifold
        periods = np.array(manifold.periods)
        closed = np.isfinite(periods)
        return closed, periods[closed] / math.tau / manifold.scale_array[closed]

    def place(self, q: Array) -> Array:
        """Return numbers that agree on orbits of the continuous symmetries and nowhere else."""
        if self.symmetry.invariants is not None:
            return self.symmetry.invariants(q)
        u = q / self.problem.scales
        closed, radii = self._circles
        turn = u[closed] / radii
        return np.concatenate([u[~closed], radii * np.cos(turn), radii * np.sin(turn)])

    def images(self, q: Array) -> list[Array]:
        """Return a point and its images under the finite group."""
        return [element.apply(q) for element in self.symmetry.group]

    def are_relabelled(self, p: Array, q: Array) -> bool:
        """Whether a group too large to list carries ``p`` to the orbit of ``q``."""
        manifold = self.problem.polyhedron.manifold
        return self.symmetry.relabel is not None and bool(
            self.symmetry.relabellings(manifold, p, q, SAME)
        )

    def flat_beyond(self, found: Certificate) -> bool:
        """Whether the energy is flat in more directions than the symmetry explains."""
        known = self.symmetry.directions(self.problem.polyhedron.manifold, found.point)
        return found.signature[2] > rank(known, found.rank_tolerance)

    def active_count(self, found: Certificate) -> int:
        """Return how many functions vanish at a point, without analysing it."""
        values, gradients = self.problem.evaluate(found.point, 1)
        away = distances(values[:-1], gradients[:-1])
        return int((abs(away[: self.problem.inequalities]) <= found.tolerance).sum())

    def is_straight(self, p: Array, q: Array, energy: float, slack: float) -> bool:
        """Whether the straight way from ``p`` to ``q`` stays in the set and on a level."""
        way = self.problem.polyhedron.manifold.difference(q, p)
        parts = math.ceil(float(abs(way / self.problem.scales).max()) / FINE) + 1
        if parts > LONGEST:
            return False
        away, energies = self._along(p + np.linspace(0, 1, parts + 1)[1:-1, None] * way)
        if not (abs(energies - energy) <= slack).all():
            return False
        m = self.problem.inequalities
        inside = self.problem.polyhedron.implicit_of(away[:, :m]) >= -MISS
        return bool(inside.all() and (abs(away[:, m:]) <= MISS).all())

    def _along(self, points: Array) -> tuple[Array, Array]:
        """Return the scaled distances to all functions at points, and the energies there."""
        values, gradients = self.problem.evaluate(points, 1)
        sizes = np.linalg.norm(gradients[:, :-1], axis=-1)
        return values[:, :-1] / np.maximum(sizes, 1e-300), values[:, -1]

    def _is_clear(self, p: Array, step: Array) -> bool:
        """Whether a step leads through no wall, those that hold ``p`` missed to second order."""
        parts = math.ceil(abs(step).max() / FINE)
        along = np.linspace(0, 1, parts + 1)[:, None]
        away, _ = self._along(p + along * step * self.problem.scales)
        bent = np.where(abs(away[0]) <= SAME, (along * abs(step).max()) ** 2, 0.0)
        inside = (away + bent)[:, : self.problem.inequalities]
        return bool((self.problem.polyhedron.implicit_of(inside) >= -MISS).all())

    def is_walkable(self, p: Array, q: Array, energy: float, slack: float) -> bool:
        """Whether a walk on a level of the energy leads from ``p`` to the orbit of ``q``."""
        goal = self.place(q)
        for _ in range(STEPS):
            miss = goal - self.place(p)
            if abs(miss).max() <= SAME:
                return True
            step = self._towards(p, miss)
            reached = None if step is None else self._stepped(p, step, goal, energy, slack)
            if reached is None:
                return False
            p = reached
        return False

    def _towards(self, p: Array, miss: Array) -> Array | None:
        """Return the step along flat directions that best closes a difference of places."""
        analysis = Certificate(self.problem, p).analysis
        curvature = analysis.curvature
        flat = curvature.vectors[:, abs(curvature.values) <= analysis.small_curvature]
        if not flat.shape[1]:
            return None
        moves = 1e-5 * flat.T * self.problem.scales
        slopes = [(self.place(p + v) - self.place(p - v)) / 2e-5 for v in moves]
        weights = np.linalg.lstsq(np.array(slopes).T, miss, rcond=1e-6)[0]
        if np.linalg.norm(miss - weights @ slopes) > (1 - GAIN) * np.linalg.norm(miss):
            return None  # no flat direction leads there
        step = flat @ weights
        return np.asarray(step * min(1.0, STRIDE / max(abs(step).max(), 1e-300)))

    def _stepped(
        self, p: Array, step: Array, goal: Array, energy: float, slack: float
    ) -> Array | None:
        """Return the rest near ``p + step``, or part of the way, if that is nearer to the goal."""
        manifold = self.problem.polyhedron.manifold
        before = float(np.linalg.norm(goal - self.place(p)))
        for part in PARTS:
            if not self._is_clear(p, part * step):
                continue
            length = part * abs(step).max()
            guess = p + part * step * self.problem.scales
            found = minimise(self.problem.polyhedron, self.problem.energy, guess)
            away = manifold.difference(found.point, guess) / self.problem.scales
            level = found.search is None and abs(found.energy - energy) <= slack
            gain = before - float(np.linalg.norm(goal - self.place(found.point)))
            if level and abs(away).max() <= 0.5 * length and gain >= GAIN * min(length, before):
                return found.point
        return None


@dataclass(eq=False)
class Rest:
    """A rest, or a locus of them, and what was found to be the same.

    Attributes
    ----------
    certificate : Certificate
        Of a representative.
    energy, slack : float
        The energy, and by how much that of another of them may differ.
    wide : bool
        Whether the energy is flat in more directions than the symmetry explains.
    points : list of (n,) arrays
        One, or a net of points of the locus.
    images : list of (n,) arrays
        All images of these.
    places : (k, d) array
        Where those are; see :meth:`Quotient.place`.
    count : int
        How many starts ended here.
    """

    certificate: Certificate
    energy: float
    slack: float
    wide: bool
    points: list[Array]
    images: list[Array]
    places: Array
    count: int = 1

    def nearest(self, place: Array) -> tuple[float, int]:
        """Return how far a place is from the nearest image, and which one that is."""
        apart = ((self.places - place) ** 2).sum(axis=1)
        k = int(apart.argmin())
        return math.sqrt(apart[k]), k


# How far a rest is away, from which of its images, and the rest.
Near = tuple[float, int, Rest]


@dataclass(eq=False)
class Rests:
    """The rests that were met, each once up to the symmetry."""

    quotient: Quotient
    rests: list[Rest] = field(default_factory=list)

    def add(self, found: Certificate) -> None:
        """Put down where a start ended."""
        energy, place = found.energy, self.quotient.place(found.point)
        level = [rest for rest in self.rests if abs(rest.energy - energy) <= rest.slack]
        near = sorted(((*rest.nearest(place), rest) for rest in level), key=lambda found: found[0])
        same = self._known(near, found.point)
        if same is None:
            same = self._connected(near, found.point)
            if same is None:
                self.rests.append(self._new(found, energy))
                return
            self._extend(same, found, place)
        same.count += 1

    def join(self) -> None:
        """Merge the loci that turn out to be connected once all starts have fallen."""
        wide = [rest for rest in self.rests if rest.wide]
        for k, first in enumerate(wide):
            for other in wide[k + 1 :]:
                level = abs(first.energy - other.energy) <= first.slack
                if level and other in self.rests and self._joined(first, other):
                    self._merge(first, other)

    def _new(self, found: Certificate, energy: float) -> Rest:
        slack = LEVEL * (abs(energy) + found.analysis.reference)
        wide = self.quotient.flat_beyond(found)
        images = self.quotient.images(found.point)
        places = np.array([self.quotient.place(q) for q in images])
        return Rest(found, energy, slack, wide, [found.point], images, places)

    def _known(self, near: list[Near], point: Array) -> Rest | None:
        """Return the rest that a point is one of, if there is one."""
        for apart, _, rest in near:
            if apart <= SAME or self.quotient.are_relabelled(rest.points[0], point):
                return rest
        return None

    def _connected(self, near: list[Near], point: Array) -> Rest | None:
        """Return the nearest rest from which a way leads to a point, straight if possible."""
        for _, k, rest in near:
            if self.quotient.is_straight(rest.images[k], point, rest.energy, rest.slack):
                return rest
        for _, k, rest in near:
            if rest.wide and self.quotient.is_walkable(
                rest.images[k], point, rest.energy, rest.slack
            ):
                return rest
        return None

    def _extend(self, rest: Rest, found: Certificate, place: Array) -> None:
        """Make a point the representative if fewer functions vanish; make the net denser."""
        counts = [self.quotient.active_count(c) for c in (rest.certificate, found)]
        if counts[1] < counts[0]:
            rest.certificate = found
        if rest.nearest(place)[0] > NET:
            images = self.quotient.images(found.point)
            rest.points.append(found.point)
            rest.images += images
            rest.places = np.vstack([rest.places, [self.quotient.place(q) for q in images]])

    def _merge(self, first: Rest, other: Rest) -> None:
        self.rests.remove(other)
        first.count += other.count
        first.points += other.points
        first.images += other.images
        first.places = np.vstack([first.places, other.places])
        counts = [self.quotient.active_count(rest.certificate) for rest in (first, other)]
        if counts[1] < counts[0]:
            first.certificate = other.certificate

    def _joined(self, first: Rest, other: Rest) -> bool:
        """Whether a way connects two loci between the points of them that are nearest."""
        ends = [(*first.nearest(self.quotient.place(q)), q) for q in other.points]
        for _, k, q in sorted(ends, key=lambda end: end[0])[:PAIRS]:
            for way in (self.quotient.is_straight, self.quotient.is_walkable):
                if way(first.images[k], q, first.energy, first.slack):
                    return True
        return False


def check_symmetry(problem: Problem, symmetry: Symmetry, points: Array) -> None:
    """Refuse a symmetry that changes the energy at points, or at others a little beside them.

    A point may be special, such as one at which the energy is stationary along a motion.
    """
    manifold = problem.polyhedron.manifold
    beside = BESIDE * np.cos(np.arange(1, problem.dimension + 1)) * problem.scales
    for q in [*points, *(points + beside)]:
        values, gradients, hessians = problem.evaluate(q, 2)
        size = max(abs(gradients[-1]).max(), abs(hessians[-1]).max(), 1e-300)
        slopes = symmetry.directions(manifold, q) @ gradients[-1]
        images = [float(problem.energy.value(g.apply(q))) for g in symmetry.elements]
        changes = abs(np.array(images) - values[-1])
        for what, wrong in (
            ("tangent", abs(slopes) > INVARIANT * size),
            ("element", changes > INVARIANT * (abs(values[-1]) + size)),
        ):
            if wrong.any():
                msg = (
                    "symmetry: expected one that leaves the energy unchanged; "
                    f"{what} {int(wrong.argmax())} changes it at {q.tolist()}"
                )
                raise ValueError(msg)

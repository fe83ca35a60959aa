"""The corners found so far, and which of them a point is.

With relabellings only one corner of each orbit is kept, and of its rays one of each orbit under
the relabellings that leave the corner in place stands for all of them.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from polycorner.polyhedra.symmetry import Relabelling, renamed
from polycorner.skeletons.curves import Ground, Spot, settle
from polycorner.skeletons.rays import Ray, Star, star_at
from polycorner.spaces.manifold import Array

SAME = 1e-5
NEAR = 1e-4
SLACK = 1e-10

Names = frozenset[str]


@dataclass
class Place:
    """A corner while the atlas grows.

    ``orbit[k]`` is the ray that stands for ray ``k``; ``edges`` the edges by such rays.
    """

    spot: Spot
    active: frozenset[int]
    star: Star
    key: Array
    stabiliser: list[Relabelling]
    orbit: list[int]
    edges: dict[int, int] = field(default_factory=dict)


class Places:
    """Corners, and what there is to say about them and about the walks between them."""

    def __init__(self, ground: Ground) -> None:
        self.ground, self.symmetry = ground, ground.symmetry
        self.polyhedron, self.manifold = ground.polyhedron, ground.polyhedron.manifold
        self.places: list[Place] = []
        self.notes: dict[str, None] = {}
        self.lost = False

    def names(self, rows: Iterable[int]) -> Names:
        """Return the names of functions."""
        return frozenset(self.polyhedron.names[i] for i in rows)

    def written(self, rows: Iterable[int]) -> str:
        """Return the names of functions for a sentence."""
        return ", ".join(self.polyhedron.names[i] for i in sorted(rows))

    def note(self, sentence: str, *, lost: bool = False) -> None:
        """Keep a sentence for the user, once; say whether something could not be followed."""
        self.notes.setdefault(sentence)
        self.lost |= lost

    def find(self, spot: Spot) -> tuple[int, list[Relabelling]] | None:
        """Return the position of the corner at a point, new or known, and how to get there.

        The relabellings carry the names at the point to the names at the corner.
        """
        active = spot.active()
        if active is None:
            self.note(f"a walk ended outside the polyhedron at {written_point(spot.q)}", lost=True)
            return None
        spot = self._polished(spot, active)
        key = self._key(spot.q)
        for k, place in enumerate(self.places):
            if abs(place.key - key).max() > NEAR:
                continue
            carried = self.symmetry.relabellings(self.manifold, spot.q, place.spot.q, SAME)
            there = self.names(place.active)
            same = [p for p in carried if renamed(self.names(active), p) == there]
            if same:
                return k, same
            if carried:
                self.note(
                    f"corners {self.written(place.active)} and {self.written(active)} "
                    f"are closer than {SAME:g} scale units: kept apart"
                )
        return self._add(spot, active, key)

    def _polished(self, spot: Spot, active: frozenset[int]) -> Spot:
        basis = spot.basis(active)
        if len(basis) + len(spot.matrix([])) < len(spot.q):
            return spot
        exact = settle(self.ground, spot.q, basis, NEAR)
        if exact is None:
            return spot
        away = exact.distances
        if abs(away[sorted(active)]).max() > SLACK:
            self.note(
                f"{self.written(active)} meet within the tolerance but not in one "
                f"point: corners closer together than it count as one"
            )
        gaps = {i: away[i] for i in range(self.ground.count) if i not in active}
        near = [i for i, gap in gaps.items() if abs(gap) < SAME and not self.polyhedron.is_union]
        for i in near:
            self.note(
                f"at the corner {self.written(active)} {self.written([i])} is only "
                f"{abs(gaps[i]):.1g} scale units away: not counted as active"
            )
        return exact

    def _key(self, q: Array) -> Array:
        key = self.symmetry.key
        return np.zeros(1) if key is None else np.asarray(key(q))

    def restore(self, q: Array) -> None:
        """Add a corner at a point that was one before."""
        spot = self.ground.spot(q)
        self._add(spot, spot.active() or frozenset(), self._key(q))

    def _add(self, spot: Spot, active: frozenset[int], key: Array) -> tuple[int, list[Relabelling]]:
        star = star_at(spot, active)
        for sentence in star.notes:
            self.note(sentence, lost=True)
        if star.singular and star.full > 2:
            self.note(f"faces at the singular corner {self.written(active)} are not put together")
        stabiliser = self.symmetry.relabellings(self.manifold, spot.q, spot.q, SAME)
        place = Place(spot, active, star, key, stabiliser, [])
        for i, ray in enumerate(star.rays):
            twin = self.match(place, ray.frame.q, ray, stabiliser, range(i))
            place.orbit.append(i if twin is None else place.orbit[twin[0]])
        self.places.append(place)
        return len(self.places) - 1, list(stabiliser)

    def match(
        self,
        place: Place,
        sample: Array | None,
        ray: Ray,
        relabellings: Iterable[Relabelling],
        among: Iterable[int],
    ) -> tuple[int, Relabelling] | None:
        """Return which ray of a corner a ray is, after one of the relabellings."""
        among = list(among)
        named = {i: self.names(place.star.rays[i].active) for i in among}
        active = self.names(ray.active)
        possible = [(i, p) for p in relabellings for i in among if renamed(active, p) == named[i]]
        if possible and not place.star.singular and not self.polyhedron.is_union:
            return possible[0]
        for i, p in possible:
            other = place.star.rays[i]
            near = 0.2 * other.distance
            if sample is not None and p in self.symmetry.relabellings(
                self.manifold, sample, other.frame.q, near
            ):
                return i, p
        return None


def written_point(q: Array) -> str:
    """Return a point for a sentence."""
    return "(" + ", ".join(f"{x:.6g}" for x in q) + ")"

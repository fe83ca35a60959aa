"""A planar polyhedron with seven sides and seven corners, locally convex but not convex.

Its sides are straight or circular walls; some of the arcs bulge into the region.
"""

from dataclasses import dataclass

import numpy as np

from polycorner.kinds import checked
from polycorner.models.planar import Wall, meeting_corners, positive, uniform_points
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.strata import stratum_at
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Checked, cached_property

SIDES = (
    Wall("AB", (0.2, -1.6), (1, 12), 0.4),
    Wall("BC", (2.5, -1.8), (-3, 2)),
    Wall("CD", (3.3, 0.7), (-6, -1), -0.26),
    Wall("DE", (1.35, 2.2), (-1, -3), 0.57),
    Wall("EF", (-0.6, 2.7), (1, -5)),
    Wall("FG", (-2.6, 1.6), (7, -5), -0.25),
    Wall("GA", (-2.1, -0.75), (2, 1), 0.3),
)


@dataclass(frozen=True)
class Tutorial(Checked):
    """A region in the plane with corners A to G, locally a quadrant at each ([GMBN] app. B).

    Counterclockwise from A its sides ``AB``, ``BC``, ..., ``GA`` are two segments, two arcs that
    bulge outwards and three that bulge inwards.  Every side's inequality holds on the whole
    region, so that no ``AnyOf`` is needed.  Because of the three arcs the region is not convex,
    nor convex near any of their points; two functions that vanish at a corner nevertheless make a
    chart in which it is a quadrant, and that is what local convexity asks for.

    Parameters
    ----------
    size : float, optional
        Factor by which the region, about 6 wide and 5 high, is enlarged; default 1.

    Raises
    ------
    TypeError, ValueError
        If the size is not a positive finite number.

    Examples
    --------
    >>> region = Tutorial()
    >>> "".join(region.corners()), region.polyhedron.contains([0.0, 0.0])
    ('ABCDEFG', True)
    """

    size: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", positive("size", self.size))

    @cached_property
    def manifold(self) -> Manifold:
        """The plane."""
        return Manifold.euclidean("x y", scale=self.size, unit="1")

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """The seven sides, counterclockwise."""
        return tuple(
            Wall(
                side.name,
                (side.point[0] * self.size, side.point[1] * self.size),
                side.normal,
                side.bend / self.size,
            )
            for side in SIDES
        )

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """The region: all seven functions at least zero."""
        return Polyhedron(self.manifold, AllOf(*[w.function(self.manifold) for w in self.walls]))

    def corners(self) -> dict[str, Array]:
        """Return the seven corners ``(2,)`` by their letters, where two sides meet."""
        found: dict[str, Array] = {}
        for point in meeting_corners(self.polyhedron, self.walls):
            first, second = stratum_at(self.polyhedron, point).active
            (letter,) = set(first) & set(second)
            found[letter] = point
        return dict(sorted(found.items()))

    @checked
    def sides(self, count: int = 65) -> dict[str, Array]:
        """Return the seven sides as polylines ``(count, 2)``, each from its first corner."""
        corners = self.corners()
        return {
            wall.name: wall.arc(corners[wall.name[0]], corners[wall.name[1]], count)
            for wall in self.walls
        }

    @checked
    def starts(self, rng: np.random.Generator | int | None, count: int) -> Array:
        """Return ``count`` points of the region, uniformly distributed, ``(count, 2)``."""
        outline = np.vstack([*self.sides().values()])
        return uniform_points(self.polyhedron, outline.min(axis=0), outline.max(axis=0), rng, count)

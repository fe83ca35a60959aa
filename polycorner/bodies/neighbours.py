"""Pairs of parts that can touch, and of parts and images of others."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product

import numpy as np

from polycorner.bodies.images import Image
from polycorner.bodies.lattices import CLEAR, Lattice, radius, reaches
from polycorner.bodies.pairs import PlacedPart, apart, members
from polycorner.bodies.poses import Placement
from polycorner.bodies.shapes import Body
from polycorner.bodies.walls import Wall
from polycorner.checks import refuse
from polycorner.polyhedra.groups import AllOf
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.tolerances import DEFAULT

Pair = tuple[PlacedPart, PlacedPart]


def pairs(
    lattice: Lattice, placements: tuple[Placement, ...], fixed: dict[str, Body]
) -> list[Pair]:
    """Return two parts each, of different bodies of which one moves, and of a body and its image.

    The second is an image where there are any.
    """
    moving = [
        [(m, radius(p.body.markers, [*p.body.parts.values()])) for m in members(p.name, p.body, p)]
        for p in placements
    ]
    still = [
        [(m, radius(m.part.points, [m.part])) for m in members(*some, None)]
        for some in fixed.items()
    ]
    found = [
        (a, b if image is None else b.at(mark, image))
        for one, two in [*combinations(moving, 2), *product(moving, still)]
        for (a, reach), (b, other) in product(one, two)
        for mark, image in _images(lattice, reach + other)
    ]
    for p in placements:
        if p.frame.turns:
            found += _own(lattice, p)
    return found


def _images(lattice: Lattice, reach: float) -> Iterator[tuple[str, Image | None]]:
    """Yield the images of a body that can touch another, with the marks on their names."""
    if not lattice.axes:
        yield "", None
        return
    counts = lattice.counts(reach)
    periods = lattice.lengths * counts
    for whole in lattice.images(counts):
        yield _mark(whole), Image(lattice.shift(whole), periods)


def _mark(whole: tuple[int, ...]) -> str:
    return f"[{','.join(map(str, whole))}]" if any(whole) else ""


def _own(lattice: Lattice, p: Placement) -> Iterator[Pair]:
    """Yield parts of a body and of the images of it that can touch."""
    own = members(p.name, p.body, p)
    for a, b in product(own, own):
        away = np.linalg.norm(a.part.points[:, None] - b.part.points, axis=-1)
        reach = float(away.max()) + a.part.radius + b.part.radius
        for whole in lattice.shorter(reach):
            yield a, b.at(_mark(whole), Image(lattice.shift(whole), lattice.lengths))


def check_room(
    lattice: Lattice, placements: tuple[Placement, ...], walls: Mapping[str, Wall]
) -> None:
    """Raise ValueError for walls that change over a period, bodies that overlap their own image."""
    for name, wall in walls.items():
        across, _ = wall.fixed_by()
        if np.abs(across @ lattice.directions.T).max(initial=0.0) > DEFAULT.alike:
            refuse("walls", "walls parallel to the directions that have a period", name)
    for p in placements:
        least = float(min(lattice.lengths))
        thickest = 2 * max(part.thickness for part in p.body.parts.values())
        if thickest > least:
            refuse("period", f"at least {thickest:g}, the least width of {p.name!r}", least)
        if not p.frame.turns and _overlaps(lattice, p):
            refuse("period", f"periods in which {p.name!r} does not overlap its image", least)


def check_width(lattice: Lattice, kinds: Sequence[Body], fixed: Sequence[Body]) -> None:
    """Raise ValueError unless only one image can touch: of bodies like these, and of fixed ones."""
    reach, shortest = max(reaches([*kinds, *kinds], fixed)), float(min(lattice.lengths))
    if max(lattice.counts(reach)) > 1:
        least = f"lengths of at least {2 * reach / CLEAR:g} for bodies"
        told = f"{least} that touch up to {reach:g} apart, where any are repeated or joined"
        refuse("period", told, shortest)


def _overlaps(lattice: Lattice, p: Placement) -> bool:
    """Whether a body that does not turn overlaps one of its images."""
    origin = np.zeros(p.manifold.size)
    for whole in lattice.shorter(2 * p.body.size):
        image = members("image", p.body.moved(lattice.shift(whole)), None)
        gaps = [apart(p.manifold, *pair) for pair in product(members(p.name, p.body, p), image)]
        d = Polyhedron(p.manifold, AllOf(*gaps))
        if not d.contains(origin, tolerance=DEFAULT.alike * p.body.size):
            return True
    return False

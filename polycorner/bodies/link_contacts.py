"""Contacts of links and of what is around them: gaps, limits of joints, and coefficients."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from polycorner.bodies.chains import Pose
from polycorner.bodies.dynamics import friction_of
from polycorner.bodies.frames import Frame
from polycorner.bodies.kernels import together
from polycorner.bodies.laws import Coefficients, Meeting, Restitution, laws_of
from polycorner.bodies.link_trees import WORLD, LinkTree
from polycorner.bodies.pairs import PlacedPart, Tree, apart, distances
from polycorner.bodies.shapes import Body, Part, hull_distance
from polycorner.bodies.walls import Wall, WallTouch, within
from polycorner.checks import refuse
from polycorner.formulas.families import Family
from polycorner.formulas.functions import SmoothFunction
from polycorner.motion.contacts import Friction
from polycorner.spaces.manifold import Array, Manifold
from polycorner.tolerances import DEFAULT
from polycorner.values import Value, cached_property

MOST_GAPS = 20_000


class CarriedPart(NamedTuple):
    """A part in the axes of its carrier, and the link that may touch what is not next to it."""

    link: str
    name: str
    part: Part
    carrier: str
    is_linked: bool


def carried_parts(
    link: str, body: Body, carrier: str, *, is_linked: bool = False
) -> Iterator[CarriedPart]:
    """Yield the parts of a body."""
    for name, part in body.parts.items():
        yield CarriedPart(link, f"{link}.{name}" if name else link, part, carrier, is_linked)


@dataclass(frozen=True, eq=False)
class LinkContacts(Value):
    """What can touch: parts of links and bodies each other and walls, and joints their limits.

    Attributes
    ----------
    manifold : Manifold
    tree : LinkTree
    parts : tuple of CarriedPart
    walls : mapping from str to Wall
    ignored : frozenset of frozenset of str
        Pairs that do not touch each other.
    """

    manifold: Manifold
    tree: LinkTree
    parts: tuple[CarriedPart, ...]
    walls: Mapping[str, Wall]
    ignored: frozenset[frozenset[str]]

    def gaps(self, *, excluded: bool) -> list[Tree]:
        """Return the gaps of parts and at walls, and the distances of joints from their limits."""
        size = sum(gaps_of(one.part, two.part) for one, two in self.pairs)
        if size > MOST_GAPS:
            one, two = max(self.pairs, key=lambda pair: gaps_of(pair[0].part, pair[1].part))
            msg = (
                f"links: expected parts with at most {MOST_GAPS} gaps, of vertices, edges and "
                f"faces; got {size}, of which {one.name!r} and {two.name!r} have "
                f"{gaps_of(one.part, two.part)}; capsules have one each"
            )
            raise ValueError(msg)
        found = [apart(self.manifold, *two, excluded=excluded) for two in self._placed()]
        found += [met.gap for _, met in self.at_walls]
        found = [*together(found), *self.limits]
        if not found:
            links = [*self.tree.links]
            refuse("links", "something that links can touch, or limits of joints", links)
        return found

    def _placed(self) -> Iterator[tuple[PlacedPart, PlacedPart]]:
        """Yield pairs of parts, the first as joints place it in the axes of the second."""
        return ((self._linked(a, b.carrier), self._linked(b, None)) for a, b in self.pairs)

    def _linked(self, one: CarriedPart, start: str | None) -> PlacedPart:
        """Return a part as it is placed from a carrier, or in its own."""
        chain = None if start is None else self.tree.chain(start, one.carrier)
        frame = Frame.FIXED if chain is None else Frame.LINKED
        return PlacedPart(one.link, one.name, one.part, frame, None, (), np.zeros(3), chain=chain)

    @cached_property
    def pairs(self) -> tuple[tuple[CarriedPart, CarriedPart], ...]:
        """The parts that can touch; the first is one that moves."""
        return tuple(self._pairs())

    def _pairs(self) -> Iterator[tuple[CarriedPart, CarriedPart]]:
        for one, two in combinations(self.parts, 2):
            if one.carrier == two.carrier or frozenset((one.link, two.link)) in self.ignored:
                continue
            a, b = (self.tree.steps[c][0] if c else None for c in (one.carrier, two.carrier))
            if one.is_linked and two.is_linked and (a == two.carrier or b == one.carrier):
                continue  # links that a joint connects
            yield (one, two) if one.carrier else (two, one)  # what stands in space is the second

    @cached_property
    def at_walls(self) -> list[tuple[CarriedPart, WallTouch]]:
        """The gaps at walls, with the parts that they are of."""
        return [
            (one, met)
            for name, wall in self.walls.items()
            for one in self.parts
            if one.carrier != WORLD and frozenset((one.link, name)) not in self.ignored
            for met in within(self.manifold, name, wall, self._linked(one, WORLD))
        ]

    @cached_property
    def limits(self) -> list[SmoothFunction]:
        """How far the joints are from their limits."""
        found = []
        for name, joint in self.tree.joints.items():
            other, rate, offset = joint.driven_by(name)
            for sign, limit, word in ((1, joint.lower, "lower"), (-1, joint.upper, "upper")):
                if joint.moves and math.isfinite(limit):
                    numbers = sign * rate, sign * (offset - limit)
                    function = SmoothFunction.member(
                        affine(),
                        "gap",
                        self.manifold,
                        parameters=numbers,
                        reads=(other,),
                        label=f"{name} {word}",
                    )
                    found.append(function)
        return found

    def overlapping(self, q: Array, poses: Mapping[str, Pose]) -> list[tuple[str, str]]:
        """Return the pairs that overlap or touch, and links and bodies beyond walls, with these."""
        found = [
            (one.link, two.link)
            for one, two in self.pairs
            if touch(*(x.part.moved(*poses[x.carrier][::-1]) for x in (one, two)))
        ]
        found += [(one.link, met.name) for one, met in self.at_walls if met.gap.value(q) < 0]
        return [*dict.fromkeys(found)]

    def laws(
        self, friction: Coefficients, rolling: Coefficients, restitution: Restitution
    ) -> tuple[tuple[Friction, ...], dict[str, float]]:
        """Return the friction at contacts, and the coefficients of restitution by name."""
        touches = [t for two in self._placed() for t in distances(self.manifold, *two)]
        walls = [met for _, met in self.at_walls]
        meetings = [Meeting(t.gap.name, t.one.body, t.two.body) for t in touches]
        meetings += [Meeting(met.gap.name, met.member.body, met.name) for met in walls]
        meetings += [Meeting(f.name, j := f.name.rpartition(" ")[0], j) for f in self.limits]
        moving = {*self.tree.links, *self.tree.loose}
        known = laws_of(friction, rolling, restitution, meetings, moving)
        for m in meetings:
            for argument, by_name in (("friction", known.friction), ("rolling", known.rolling)):
                self._check_turning(argument, m, by_name.get(m.contact, (0.0, 0.0)))
        return friction_of(self.manifold, touches, walls, known.friction, known.rolling), {
            m.contact: known.restitution.get(m.contact, 0.0) for m in meetings
        }

    def _check_turning(self, argument: str, met: Meeting, given: tuple[float, float]) -> None:
        """Raise for friction at a ball without coordinates of its rotation."""
        for name in (met.one, met.two):
            if given[0] and self.tree.loose.get(name) is Frame.SHIFTED:
                missing = f"coordinates of all rotations (orientations='all') of {name!r}"
                refuse(argument, missing, given[0])


def gaps_of(one: Part, two: Part) -> int:
    """Return how many gaps two parts have, about."""
    (p, f, e), (q, g, d) = (
        (len(x.points), *((len(x.facets.faces), len(x.facets.edges)) if x.facets else (0, 1)))
        for x in (one, two)
    )
    if p == 1 or q == 1 or f + g == 0:
        return 1
    return p * max(g, 1) + q * max(f, 1) + 12 * e * d


def affine() -> Family:
    """Return the distance of a joint from its limit."""
    import sympy

    rate, q, offset = sympy.symbols("rate q offset", real=True)
    return Family.of({"gap": rate * q + offset}, ["q"], ["rate", "offset"])


def touch(one: Part, two: Part) -> bool:
    """Whether two parts overlap or touch."""
    size = max(float(np.ptp(np.concatenate([one.points, two.points]), axis=0).max()), one.radius)
    radius = one.radius + two.radius
    return hull_distance(one.points, two.points) <= radius + DEFAULT.same * (size + two.radius)

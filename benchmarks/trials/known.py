"""Problems whose stationary points are known, and what a list that is found has to agree with.

*complete*: the list is said to be complete, and is the known one: each known point in exactly one
box, and one in each box.  *open*: it is not said to be complete; each known point lies in a box of
the list or in one that is undecided.  *refused*: the problem was refused, as it has to be;
*declined*: it need not have been.  Anything else is *false*.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import product
from typing import Any

from benchmarks.trials.exact import Vector
from polycorner import Polyhedron, Symmetry
from polycorner.proofs.lists.stationary import StationaryList, StationaryPoint


@dataclass(frozen=True)
class Known:
    """A stationary point.

    Attributes
    ----------
    point : tuple of Fraction
    active : frozenset of str or None
        Functions that vanish there; None where they are not all needed.
    index : int or None
        None at a degenerate point.
    ways : mapping from frozenset of str to int
        Where more functions vanish than are needed: sets of them with which the point may be
        listed, and the index along their face.  No other degenerate point may be listed.
    alike : mapping from str to str
        Functions that are positive multiples of others, and the first of these.
    """

    point: Vector
    active: frozenset[str] | None = None
    index: int | None = None
    ways: Mapping[frozenset[str], int] = field(default_factory=dict)
    alike: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class KnownLocus:
    """All points of the set with given coordinates, by name; ``samples`` are some of them."""

    given: Mapping[str, Fraction]
    index: int
    samples: tuple[Vector, ...]


@dataclass(frozen=True)
class Posed:
    """A problem and its answer.

    Attributes
    ----------
    kind : str
        What it tries.
    polyhedron, energy, box
        The problem.
    points : tuple of Known
        All isolated stationary points in the box.
    loci : tuple of KnownLocus
        All connected sets of them that a list can hold.
    samples : tuple of points
        Points of others; where there are some no list is complete.
    beside : tuple of Known
        Isolated ones outside the box.
    partial : bool
        Whether there may be other isolated points.
    group : tuple of callables on points
        The symmetries that are declared and true, products included.
    symmetry : Symmetry or None
    refused : bool
        Whether the problem has to be refused.
    """

    kind: str
    polyhedron: Polyhedron
    energy: Any
    box: Any
    points: tuple[Known, ...] = ()
    loci: tuple[KnownLocus, ...] = ()
    samples: tuple[Vector, ...] = ()
    beside: tuple[Known, ...] = ()
    partial: bool = False
    group: tuple[Any, ...] = ()
    symmetry: Symmetry | None = None
    refused: bool = False
    circles: Mapping[int, Fraction] = field(default_factory=dict)

    def images(self, point: Vector) -> tuple[Vector, ...]:
        """Return a point and its images under the group."""
        return (point, *(g(point) for g in self.group))

    def holds(self, lower: Any, upper: Any, point: Vector) -> bool:
        """Whether a box contains a point, or one that is the same modulo whole turns."""
        for i, (a, b, x) in enumerate(zip(lower.tolist(), upper.tolist(), point, strict=True)):
            low, high, at = Fraction(a), Fraction(b), x
            if i in self.circles:
                turn = self.circles[i]
                at += round(((low + high) / 2 - x) / turn) * turn
            if not low <= at <= high:
                return False
        return True


def complaints(posed: Posed, found: StationaryList) -> Iterator[str]:
    """Yield what is false in a list."""
    for p in found.points:
        near = [*posed.points, *(posed.beside if _on_a_side(found, p) else ())]
        held = [k for k in near if posed.holds(p.lower, p.upper, k.point)]
        if len(held) > 1 or not (held or posed.partial):
            yield f"the box about {p.point} holds {len(held)} stationary points"
        for k in held:
            yield from _differences(k, p)
    for k in posed.points:
        boxes = [p for p in found.points if posed.holds(p.lower, p.upper, k.point)]
        if len(boxes) > 1 or (found.complete and not boxes):
            yield f"{len(boxes)} boxes hold {_shown(k.point)}"
        if not boxes and not _unsettled(posed, found, k.point):
            yield f"{_shown(k.point)} is lost"
    yield from _about_loci(posed, found)
    if found.complete and posed.samples:
        yield "it is said to be complete without points that are not isolated"
    for q in posed.samples:
        if not _unsettled(posed, found, q):
            yield f"{_shown(q)} is lost, which is not isolated"


def _on_a_side(found: StationaryList, p: StationaryPoint) -> bool:
    """Whether a side of the domain passes through a box."""
    inside = (p.lower >= found.domain.lower) & (p.upper <= found.domain.upper)
    return not inside.all() and not found.domain.misses(p.lower, p.upper, range(len(p.lower)))


def _differences(k: Known, p: StationaryPoint) -> Iterator[str]:
    active, more = (frozenset(k.alike.get(f, f) for f in fs) for fs in (p.active, p.redundant))
    index = k.ways.get(active) if k.index is None else k.index
    if index is None:
        yield f"{_shown(k.point)} is degenerate, but listed with {p.active} and index {p.index}"
    elif p.index not in {None, index} or (p.redundant and p.index not in {None, 0}):
        yield f"{_shown(k.point)} has index {index}, not {p.index}"
    if k.active is not None and active | more != k.active:
        yield f"at {_shown(k.point)} {sorted(k.active)} vanish, not {p.active}, {p.redundant}"
    if any(p.multipliers[name][1] <= 0 for name in p.active):
        yield f"at {_shown(k.point)} a multiplier is not positive"


def _unsettled(posed: Posed, found: StationaryList, point: Vector) -> bool:
    """Whether a point or an image of it lies in an undecided box, or where there may be a point."""
    boxes = [*found.undecided, *((p.lower, p.upper) for p in found.open_points)]
    return any(posed.holds(*box, q) for q, box in product(posed.images(point), boxes))


def _about_loci(posed: Posed, found: StationaryList) -> Iterator[str]:
    names = posed.polyhedron.manifold.names
    held: dict[int, list[int]] = {i: [] for i in range(len(posed.loci))}
    for j, place in enumerate(found.loci):
        here = [i for i, known in enumerate(posed.loci) if _on(posed, known.given, place, names)]
        if len(here) > 1 or not (here or place.sample is None):
            yield f"the locus {dict(place.lower)} holds {len(here)} known ones"
        for i in here:
            held[i].append(j)
            if place.index != posed.loci[i].index:
                yield f"the locus {dict(place.lower)} has index {posed.loci[i].index}"
    for i, known in enumerate(posed.loci):
        shown = [j for j in held[i] if found.loci[j].sample is not None]
        if len(held[i]) > 1 or (found.complete and not shown):
            yield f"{len(held[i])} loci hold {_shown(known.given.values())}"
        if not held[i] and not all(_unsettled(posed, found, q) for q in known.samples):
            yield f"the locus {_shown(known.given.values())} is lost"


def _on(posed: Posed, given: Mapping[str, Fraction], place: Any, names: Sequence[str]) -> bool:
    if set(given) != set(place.lower):
        return False
    for name, x in given.items():
        low, high = Fraction(place.lower[name]), Fraction(place.upper[name])
        turn = posed.circles.get(names.index(name))
        at = x + round(((low + high) / 2 - x) / turn) * turn if turn else x
        if not low <= at <= high:
            return False
    return True


def _shown(point: Any) -> tuple[float, ...]:
    return tuple(map(float, point))

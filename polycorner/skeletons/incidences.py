"""Incidences of a search: which beginnings of edges and faces belong to one face."""

from collections import Counter
from collections.abc import Container, Hashable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from polycorner.polyhedra.symmetry import Relabelling, generators
from polycorner.skeletons.curves import Flag as NamedFlag
from polycorner.skeletons.explorer import Explorer
from polycorner.skeletons.registry import FoundCorner
from polycorner.skeletons.vertex_figures import Sector

# Sets of functions are bits of integers here: a fiftieth of the memory of sets of names.
# An edge or an apex, as in :data:`~polycorner.skeletons.curves.Flag`, and the functions that vanish
# on a face beside it, as bits.
Flag = tuple[str, Any, int]


def mask_of(positions: Iterable[int]) -> int:
    """Return the integer whose bits are given positions.

    >>> mask_of([0, 3])
    9
    """
    mask = 0
    for i in positions:
        mask |= 1 << i
    return mask


def positions_in(mask: int) -> list[int]:
    """Return the positions of the bits of an integer, in ascending order.

    >>> positions_in(9)
    [0, 3]
    """
    found = []
    while mask:
        lowest = mask & -mask
        found.append(lowest.bit_length() - 1)
        mask ^= lowest
    return found


class Renaming:
    """A relabelling of named functions, acting on sets of them.

    >>> Renaming(["a", "b", "c"], {"a": "c", "c": "a"})(0b011) == 0b110
    True
    """

    def __init__(self, names: Sequence[str], relabelling: Relabelling) -> None:
        place = {name: i for i, name in enumerate(names)}
        self._images = [1 << place[relabelling.get(name, name)] for name in names]

    def __call__(self, mask: int) -> int:
        """Return the image of a set."""
        return sum(self._images[i] for i in positions_in(mask))


class Partition:
    """The finest partition of some things in which joined things are in one class.

    Parameters
    ----------
    things : iterable of hashable
        Others are added when they are joined.
    """

    def __init__(self, things: Iterable[Hashable] = ()) -> None:
        self._position = {thing: k for k, thing in enumerate(dict.fromkeys(things))}
        self._pairs: list[tuple[int, int]] = []
        self._classes: list[int] | None = None

    def join(self, one: Hashable, other: Hashable) -> None:
        """Put two things into one class."""
        known = self._position
        first = known.setdefault(one, len(known))
        self._pairs.append((first, known.setdefault(other, len(known))))
        self._classes = None

    def __getitem__(self, thing: Hashable) -> int:
        """Return the number of the class of a thing."""
        if self._classes is None:
            self._classes = self._connected()
        return self._classes[self._position[thing]]

    def _connected(self) -> list[int]:
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        count = len(self._position)
        rows, columns = np.array(self._pairs, dtype=np.int32).reshape(-1, 2).T
        graph = coo_array((np.ones(len(rows), np.int32), (rows, columns)), shape=(count, count))
        found: list[int] = connected_components(graph, directed=False)[1].tolist()
        return found


def groups_of(sets: Partition, flags: Iterable[Flag]) -> list[list[Flag]]:
    """Return flags by class, in the order they come."""
    found: dict[int, list[Flag]] = {}
    for flag in flags:
        found.setdefault(sets[flag], []).append(flag)
    return list(found.values())


def flags_of(explorer: Explorer) -> Iterator[Flag]:
    """Yield the flags of faces beside the ends of edges at corners, apexes and closed edges."""
    for k, record in enumerate(explorer.records):
        for s, sector in enumerate(record.figure.sectors):
            face = mask_of(sector.held)
            for i in sector.rays:
                yield ("half", (k, i), face)
            # Modulo relabellings, a face around a corner is counted by edges that it has elsewhere.
            if not sector.rays and not explorer.symmetry.relabels:
                yield ("apex", (k, s), face)
    for k, curve in enumerate(explorer.curves):
        if curve.start is None:
            for beside in explorer.faces_beside(k):
                yield masked(explorer, explorer.flag(k, beside))


def joins_of(explorer: Explorer) -> Iterator[tuple[Flag, Flag]]:
    """Yield flags that belong to one boundary curve of one face."""
    for k, record in enumerate(explorer.records):
        yield from _joins_at(explorer, k, record)
    beside = [_sectors_by_ray(record) for record in explorer.records]
    for curve in explorer.curves:
        if curve.start is not None:
            along = Renaming(explorer.polyhedron.names, curve.relabelled)
            for sector in beside[curve.start[0]].get(curve.start[1], ()):
                face = mask_of(sector.held)
                yield ("half", curve.start, face), ("half", curve.stop, along(face))


def untold(explorer: Explorer, flags: Container[Flag]) -> Iterator[str]:
    """Yield notes on corners at which faces beside their edges are missing.

    The closure of a face is a union of faces, edges and corners (the condition of the frontier,
    [GoreskyMacPherson], part I): a face whose closure contains a part of an edge contains its ends.
    """
    missing: Counter[int] = Counter()
    for k, curve in enumerate(() if explorer.symmetry.relabels else explorer.curves):
        faces = explorer.faces_beside(k)
        for end in (curve.start, curve.stop):
            if end is not None:
                told = (("half", end, mask_of(face)) in flags for face in faces)
                missing[end[0]] += sum(not known for known in told)
    for k, count in missing.items():
        if count:
            active = explorer.registry.written(explorer.records[k].active)
            yield f"at the corner {active} {count} faces beside its edges could not be followed"


def masked(explorer: Explorer, flag: NamedFlag) -> Flag:
    """Return a flag with the bits of its functions in place of their names."""
    kind, where, names = flag
    return kind, where, mask_of(map(explorer.polyhedron.names.index, names))


def edge_of(explorer: Explorer, flag: Flag) -> int:
    """Return the position of the edge that a flag is at; -1 for an apex and where it is unknown."""
    if flag[0] == "curve":
        return int(flag[1])
    if flag[0] == "apex":
        return -1
    k, i = flag[1]
    record = explorer.records[k]
    found: int = record.edges.get(record.orbit[i], -1)
    return found


def _sectors_by_ray(record: FoundCorner) -> dict[int, list[Sector]]:
    found: dict[int, list[Sector]] = {}
    for sector in record.figure.sectors:
        for ray in dict.fromkeys(sector.rays):
            found.setdefault(ray, []).append(sector)
    return found


def _joins_at(explorer: Explorer, k: int, record: FoundCorner) -> Iterator[tuple[Flag, Flag]]:
    """Yield flags at one corner that one sector has, or that a relabelling exchanges."""
    active = [mask_of(ray.active) for ray in record.figure.rays]
    alike: dict[int, list[int]] = {}
    for i, edge in enumerate(active):
        alike.setdefault(edge, []).append(i)
    # What generators join, all products of them join as well.
    names = explorer.polyhedron.names
    changes = [Renaming(names, p) for p in generators(record.stabiliser)]
    images = [[alike.get(change(edge), []) for edge in active] for change in changes]
    for sector in record.figure.sectors:
        if not sector.rays:
            continue
        face = mask_of(sector.held)
        first, last = sector.rays
        yield ("half", (k, first), face), ("half", (k, last), face)
        for change, image in zip(changes, images, strict=True):
            moved = change(face)
            for ray in sector.rays:
                for other in image[ray]:
                    yield ("half", (k, ray), face), ("half", (k, other), moved)

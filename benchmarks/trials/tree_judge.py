"""What is false in a landscape, by the answer that is known.

The judge reads the fields of a landscape, and what it says of each pair of minima; it shares
nothing with the code that found them.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np

from benchmarks.trials.flooding import Array
from benchmarks.trials.generated_landscapes import Posed
from benchmarks.trials.known_trees import Truth

SAME = 1e-5  # distance of points that are one
ERROR = 1e-8  # of the energies of the answer
TIGHT = 1e-9  # relative width of a barrier between two bounds


def holds(interval: Any, values: Any, error: float = ERROR) -> bool:
    """Whether an interval holds one of some values."""
    low, high = interval
    return any(low - error <= x <= high + error for x in values)


def away(truth: Truth, at: Array, points: Array) -> Array:
    """Return how far known points are from a place, which has to satisfy the equations, too."""
    d = truth.points.shape[1]
    apart = at[:d] - points
    turns = np.where(np.isfinite(truth.turns), truth.turns, 1.0)
    apart -= np.where(np.isfinite(truth.turns), turns * np.rint(apart / turns), 0.0)
    return np.maximum(abs(apart).max(axis=1), abs(at[d:]).max(initial=0.0))


def named(posed: Posed, found: Any) -> list[int | None]:
    """Return the number of the known minimum that each minimum is, if it is one."""
    names: list[int | None] = []
    for m in found.minima:
        apart = away(posed.truth, posed.place(m.point), posed.truth.points)
        k = int(apart.argmin())
        names.append(k if apart[k] <= SAME else None)
    return names


def complaints(posed: Posed, found: Any) -> Iterator[str]:
    """Yield what is false in a landscape that is said to be proved."""
    truth, names = posed.truth, named(posed, found)
    for k, m in zip(names, found.minima, strict=True):
        if k is None:
            yield f"{_shown(m.point)} with the energy {m.energy} is no minimum"
        elif not holds(m.energy, [truth.energies[k]]):
            yield f"minimum {k} has the energy {truth.energies[k]}, not {m.energy}"
    for k, energy in enumerate(truth.energies):
        times = names.count(k)
        if times > 1:
            yield f"minimum {k} is listed {times} times"
        if not times and not _may_be_missing(found, float(energy)):
            yield f"minimum {k} at {_shown(truth.points[k])} is missing"
    if None in names or len(set(names)) < len(names):
        return
    known = [k for k in names if k is not None]
    yield from _about_barriers(truth, known, found)
    yield from _about_passes(truth, known, found)
    if found.complete and found.euler is not None and posed.kind != "loci":
        known_one = truth.euler(found.cap)
        if known_one not in {None, found.euler}:
            yield f"the Euler characteristic is {known_one}, not {found.euler}"
    if found.complete and found.cap == np.inf:
        yield from _about_merges(truth, known, found)
        yield from _about_saddles(posed, found)


def _may_be_missing(found: Any, energy: float) -> bool:
    """Whether a minimum may lie in what is undecided, or above the cap."""
    open_ = [p for p in found.passes if p.kind == "undecided" or not p.sides]
    lowest = min((p.energy[0] for p in open_ if not found.complete), default=np.inf)
    return energy > min(found.cap, lowest) - ERROR


def _bounds(truth: Truth, a: int, b: int) -> tuple[float, float]:
    """Return the least and the greatest value that a barrier may have."""
    least = min(truth.height(a, b))
    inner = truth.within.get((min(a, b), max(a, b)))
    return least, max(inner if inner is not None else truth.height(a, b))


def _about_barriers(truth: Truth, known: list[int], found: Any) -> Iterator[str]:
    outside = len(truth.energies)
    for i, a in enumerate(known):
        ends = [(j, b, found.barrier(i, j)) for j, b in enumerate(known)]
        if found.region:
            ends.append((-1, outside, found.escape(i)))
        for j, b, said in ends:
            low, high = (float(truth.energies[a]),) * 2 if i == j else _bounds(truth, a, b)
            several = i != j and not truth.within and said.upper < np.inf
            claimed = f"barrier({i}, {j}) in [{said.lower!r}, {said.upper!r}]"
            if said.lower > high + ERROR or said.upper < low - ERROR:
                yield f"{claimed}, but it is in [{low!r}, {high!r}]"
            elif several and not holds((said.lower, said.upper), truth.height(a, b)):
                yield f"{claimed}, but it is one of {truth.height(a, b)}"
            rise = low - truth.energies[a], high - truth.energies[a]
            if said.rise[0] > rise[1] + ERROR or said.rise[1] < rise[0] - ERROR:
                yield f"the rise of {claimed} is {said.rise}, but it is in {rise}"
        yield from _about_depth(truth, known, found, i)


def _about_depth(truth: Truth, known: list[int], found: Any, i: int) -> Iterator[str]:
    """Compare with the least rise to any minimum that is not higher."""
    a = known[i]
    here = float(truth.energies[a])
    not_higher = [b for b, e in enumerate(truth.energies) if b != a and e <= here + ERROR]
    bounds = [_bounds(truth, a, b) for b in not_higher]
    low = min((x for x, _ in bounds), default=np.inf) - here
    high = min((x for _, x in bounds), default=np.inf) - here
    said = found.depth(i)
    if said[0] > high + ERROR or said[1] < low - ERROR:
        yield f"depth({i}) in {said}, but it is in {(low, high)}"


def _about_passes(truth: Truth, known: list[int], found: Any) -> Iterator[str]:
    for k, p in enumerate(found.passes):
        sides = [s for s in p.sides if s.verified]
        ends = [known[s.minimum] if s.minimum >= 0 else len(truth.energies) for s in sides]
        tops = [s.route.top for s in sides if s.route is not None]
        top = max([p.energy[1], *tops]) + ERROR
        for a, b in combinations(ends, 2):
            if a != b and min(truth.height(a, b)) > top:
                met = truth.height(a, b)
                yield f"pass {k} at {p.energy} joins {a} and {b}, which meet at {met}"
        for a in ends:
            if a < len(truth.energies) and truth.energies[a] > top:
                yield f"pass {k} at {p.energy} is below its side {a}"
        isolated = p.kind in {"saddle", "tip"} and truth.values is not None
        if isolated and not holds(p.energy, truth.values):
            yield f"pass {k} at {p.energy} is at no stationary value"


def _about_saddles(posed: Posed, found: Any) -> Iterator[str]:
    """Compare with the passes that are known, each once."""
    truth = posed.truth
    places = [posed.place(p.point) for p in found.passes]
    for q in truth.saddles:
        times = sum(away(truth, at, q[None])[0] <= SAME for at in places)
        if times != 1:
            yield f"the pass {_shown(q)} is listed {times} times"


def _about_merges(truth: Truth, known: list[int], found: Any) -> Iterator[str]:
    groups = [{k} for k in range(len(truth.energies))]
    for a, b in combinations(range(len(truth.energies)), 2):
        if min(truth.height(a, b)) < np.inf and groups[a] is not groups[b]:
            groups[a] |= groups[b]
            for k in groups[b]:
                groups[k] = groups[a]
    expected = len(truth.energies) - len({id(g) for g in groups})
    if len(found.merges) != expected and not truth.within:
        yield f"{len(found.merges)} merges, not {expected}"
    ended = [m.ended for m in found.merges]
    if len(set(ended)) < len(ended):
        yield f"a minimum ends twice: {ended}"
    for m in found.merges:
        a, b = known[m.kept], known[m.ended]
        if truth.energies[a] > truth.energies[b] + ERROR:
            yield f"the merge {m} keeps the higher one"
        low, high = _bounds(truth, a, b)
        if m.energy[0] > high + ERROR or m.energy[1] < low - ERROR:
            yield f"the merge {m} is at {truth.height(a, b)}"


def tightness(found: Any) -> tuple[int, int]:
    """Return how many barriers have bounds close to each other, and how many there are."""
    pairs = list(combinations(range(len(found.minima)), 2))
    close = 0
    for a, b in pairs:
        said = found.barrier(a, b)
        scale = max(abs(said.lower), abs(said.upper), 1.0)
        close += said.lower == said.upper or said.upper - said.lower <= TIGHT * scale
    return close, len(pairs)


def _shown(point: Array) -> tuple[float, ...]:
    return tuple(round(float(x), 6) for x in point)

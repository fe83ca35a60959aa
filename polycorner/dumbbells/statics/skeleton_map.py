"""Changes of the pair's skeleton in the plane with length and rod radius."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.dumbbells.pair import LONGEST, DumbbellPair
from polycorner.dumbbells.statics.skeleton import PairAtlas, long_rod_length, pair_atlas
from polycorner.dumbbells.symmetries import relabellings
from polycorner.skeletons import Completeness, Edge, Skeleton, skeleton
from polycorner.toolkit import Array, Checked, Orbits, Progress, checked, checks, silent

# Distance, in ball radii, below which corners are not distinguished reliably, and so the possible
# error of the position of a change.
BLUR = 2e-5
STARTS = 3

Counts = tuple[int, int, int]
Tally = tuple[tuple[str, int], ...]
Groups = Mapping[str, Orbits]
Positions = NDArray[np.int64]
# A rod radius, a bracket of the length, and the signatures below and above.
Change = tuple[float, tuple[float, float], tuple[int, int]]


@dataclass(frozen=True)
class Pattern:
    """Corners and motions up to relabelling, without their geometry.

    Attributes
    ----------
    counts : (int, int, int)
        Corners, edges and faces.
    corners : tuple of (str, int)
        Kinds of corners, as named by :meth:`PairAtlas.kind`, and their numbers.
    motions : tuple of (str, int)
        Kinds of edges: the numbers of ball-ball, ball-rod and rod-rod contacts, then the kinds of
        the corners at both ends, as in ``020 Delta_R E_R``; and their numbers.
    """

    counts: Counts
    corners: Tally
    motions: Tally


@dataclass(frozen=True)
class Signature:
    """The skeleton of a pair without its geometry.

    Attributes
    ----------
    labelled : (int, int, int)
        Corners, edges and faces for labelled dumbbells and balls.
    ordered : (int, int, int)
        The same with the balls of each dumbbell identified.
    pattern : Pattern
        The same up to every relabelling, with the kinds.
    sound : bool
        Whether the skeleton is complete: every edge ends in corners, the placements are connected,
        and their boundary, a torus, has Euler characteristic zero.
    """

    labelled: Counts
    ordered: Counts
    pattern: Pattern
    sound: bool


@dataclass(frozen=True)
class PairMap(Checked):
    """Signatures of the atlas over a grid, and their changes along ``l/r``.

    Attributes
    ----------
    lengths : (m,) array
        ``l/r``, increasing.
    rods : (n,) array
        ``t/r``, increasing.
    table : (n, m) array of int
        Signature at every point of the grid, as position in ``signatures``.
    signatures : tuple of Signature
        The distinct ones, in the order in which they were found.
    change_rods : (k,) array
        ``t/r`` of every change.
    change_brackets : (k, 2) array
        Two values of ``l/r`` that bracket it.
    change_kinds : (k, 2) array of int
        Signatures below and above.
    critical : (n,) array of int
        Signature exactly at the closed form, -1 if that is less than two ball radii.
    """

    lengths: Array
    rods: Array
    table: Positions
    signatures: tuple[Signature, ...]
    change_rods: Array
    change_brackets: Array
    change_kinds: Positions
    critical: Positions

    @property
    def closed_form(self) -> Array:
        """``long_rod_length / r`` for every rod radius of the grid, ``(n,)``."""
        return np.array([long_rod_length(1.0, t) for t in self.rods.tolist()])

    @property
    def deviations(self) -> Array:
        """Distance of the closed form from the bracket of every change, ``(k,)``; 0 inside it."""
        exact = np.array([long_rod_length(1.0, t) for t in self.change_rods.tolist()])
        low, high = self.change_brackets[:, 0], self.change_brackets[:, 1]
        return np.asarray(np.maximum(np.maximum(low - exact, exact - high), 0.0))

    @property
    def explained(self) -> NDArray[np.bool_]:
        """Whether the closed form predicts every change to within ``BLUR``, ``(k,)``."""
        return np.asarray(self.deviations <= BLUR)

    @property
    def missed(self) -> Array:
        """``t/r`` with the closed form inside the grid but without a change that it explains."""
        inside = (self.closed_form > self.lengths[0]) & (self.closed_form < self.lengths[-1])
        return np.setdiff1d(self.rods[inside], self.change_rods[self.explained])


@checked
def pair_map(
    lengths: ArrayLike,
    rods: ArrayLike,
    *,
    tolerance: float = 1e-4,
    progress: Progress = silent,
) -> PairMap:
    """Map the changes of the atlas of the pair in the plane; lengths in ball radii.

    On a grid the atlas is computed for labelled pairs.  Between neighbours with different
    signatures the change is bisected in ``l/r``; there the atlas is computed up to relabelling
    from the outset, which is several times faster.

    Parameters
    ----------
    lengths : (m,) array
        ``l/r``, increasing, at least 2 and below 1e8.
    rods : (n,) array
        ``t/r``, increasing and strictly between 0 and 1.
    tolerance : float, optional
        Width, in ball radii, to which every change is bracketed.  Below ``BLUR`` corners are not
        distinguished reliably.
    progress : callable, optional
        Called as ``progress(done, expected, note)`` after every skeleton.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind, shape or range.
    """
    across = checks.increasing("lengths", lengths, least=2, below=LONGEST)
    up = checks.increasing("rods", rods, above=0, below=1)
    checks.real("tolerance", tolerance, above=0)
    survey = _Signatures(float(tolerance), progress, len(across) * len(up) + len(up))
    table = np.array([[survey.at(x, t) for x in across.tolist()] for t in up.tolist()])
    exact = [(long_rod_length(1.0, t), t) for t in up.tolist()]
    critical = [survey.at(x, t) if x >= 2 else -1 for x, t in exact]
    changes = survey.changes(across.tolist(), up.tolist(), table)
    return PairMap(
        across,
        up,
        table,
        tuple(survey.signatures),
        np.array([t for t, *_ in changes]),
        np.array([bracket for _, bracket, _ in changes]).reshape(-1, 2),
        np.array([kinds for *_, kinds in changes], dtype=np.int64).reshape(-1, 2),
        np.array(critical, dtype=np.int64),
    )


def signature_of(atlas: PairAtlas) -> Signature:
    """Return the signature of a skeleton in the plane.

    If relabellings do not map the skeleton to itself, it is incomplete: it is not sound, and every
    corner, edge and face counts by itself.
    """
    found, single = atlas.skeleton, _single(atlas.skeleton)
    try:
        ordered, unordered = atlas.ordered, atlas.unordered
    except ValueError:
        return Signature(_sizes(single), _sizes(single), _pattern(atlas, single), sound=False)
    finished = found.complete in (Completeness.EXHAUSTED, Completeness.CORNERS_PROVED)
    whole = finished and found.components.get(6) == 1
    return Signature(
        labelled=_sizes(single),
        ordered=_sizes(ordered),
        pattern=_pattern(atlas, unordered),
        sound=whole and not _euler_of_discs(found),
    )


def _euler_of_discs(found: Skeleton) -> int:
    """Return the Euler characteristic if every face is a disc with holes."""
    open_edges = sum(not edge.is_closed for edge in found.edges)
    return len(found.corners) - open_edges + sum(2 - len(f.boundary) for f in found.faces)


def pattern_at(length: float, rod_radius: float, *, seed: int = 0) -> Pattern:
    """Return the pattern of one pair in the plane, found up to relabelling from the outset.

    Parameters
    ----------
    length, rod_radius : float
        In ball radii.
    seed : int, optional
        Seed of the placements from which the search starts.

    Examples
    --------
    >>> [pattern_at(length, 0.5).counts for length in (2.6, 2.7)]
    [(2, 2, 1), (4, 5, 2)]
    """
    pair = DumbbellPair(length, 1.0, rod_radius)
    starts = pair.placements(np.random.default_rng(seed), STARTS)
    symmetry = replace(pair.symmetry, elements=relabellings())
    found = skeleton(pair.polyhedron, starts, symmetry=symmetry)
    return _pattern(PairAtlas(pair, found, None), _single(found))


class _Signatures:
    """Signatures found so far, and the progress of the work."""

    def __init__(self, tolerance: float, progress: Progress, expected: int) -> None:
        self.tolerance, self.progress = tolerance, progress
        self.done, self.expected = 0, expected
        self.signatures: list[Signature] = []

    def at(self, length: float, rod: float) -> int:
        """Return the signature of the atlas at one point, as its position."""
        found = signature_of(pair_atlas(DumbbellPair(length, 1.0, rod)))
        self._tell()
        if found not in self.signatures:
            self.signatures.append(found)
        return self.signatures.index(found)

    def changes(self, lengths: list[float], rods: list[float], table: Positions) -> list[Change]:
        """Return every change between neighbours of the grid along the length, bracketed."""
        cells = [
            (rod, (lengths[i], lengths[i + 1]), (int(row[i]), int(row[i + 1])))
            for rod, row in zip(rods, table, strict=True)
            for i in range(len(lengths) - 1)
            if row[i] != row[i + 1]
        ]
        halvings = [math.log2((high - low) / self.tolerance) for _, (low, high), _ in cells]
        self.expected = self.done + sum(max(math.ceil(k), 0) for k in halvings)
        return [change for cell in cells for change in self._bisected(*cell)]

    def _bisected(
        self, rod: float, bracket: tuple[float, float], kinds: tuple[int, int]
    ) -> Iterator[Change]:
        (low, high), (below, above) = bracket, kinds
        alike = self.signatures[below].pattern == self.signatures[above].pattern
        if high - low <= self.tolerance or alike:
            yield rod, bracket, kinds
            return
        middle = (low + high) / 2
        kind = self._kind(middle, rod, kinds)
        if kind != below:
            yield from self._bisected(rod, (low, middle), (below, kind))
        if kind != above:
            yield from self._bisected(rod, (middle, high), (kind, above))

    def _kind(self, length: float, rod: float, likely: tuple[int, int]) -> int:
        """Return the signature of a point between two others; in full only if it is a third."""
        pattern = pattern_at(length, rod)
        for kind in likely:
            if self.signatures[kind].pattern == pattern:
                self._tell()
                return kind
        return self.at(length, rod)

    def _tell(self) -> None:
        self.done += 1
        self.expected = max(self.expected, self.done)
        self.progress(self.done, self.expected, "skeletons")


def _pattern(atlas: PairAtlas, groups: Groups) -> Pattern:
    found = atlas.skeleton
    kinds = Counter(atlas.kind(found.corners[group[0]]) for group in groups["corners"])
    motions = Counter(_motion(atlas, found.edges[group[0]]) for group in groups["edges"])
    return Pattern(_sizes(groups), tuple(sorted(kinds.items())), tuple(sorted(motions.items())))


def _single(found: Skeleton) -> Groups:
    """Return every corner, edge and face as a group by itself."""
    parts = {"corners": found.corners, "edges": found.edges, "faces": found.faces}
    return {kind: tuple((k,) for k in range(len(part))) for kind, part in parts.items()}


def _sizes(groups: Groups) -> Counts:
    return len(groups["corners"]), len(groups["edges"]), len(groups["faces"])


def _motion(atlas: PairAtlas, edge: Edge) -> str:
    corners = atlas.skeleton.corners
    ends = sorted("none" if k is None else atlas.kind(corners[k]) for k in edge.ends)
    lengths = Counter(len(name) for name in edge.active)
    return f"{lengths[4]}{lengths[3]}{lengths[2]} {' '.join(ends)}"

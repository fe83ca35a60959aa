"""Parts of skeletons: corners, edges, faces, and how much of them was found."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise

import numpy as np

from polycorner.polyhedra.cones import null_space, unit_rows
from polycorner.polyhedra.quotients import Quotient
from polycorner.polyhedra.strata import LocalType, Stratum
from polycorner.skeletons.dependence import held_at
from polycorner.skeletons.indices import face_euler_characteristic
from polycorner.skeletons.nets import Border
from polycorner.skeletons.walks import End
from polycorner.spaces.manifold import Array
from polycorner.values import Checked, cached_property

STEPS = 12  # of Newton's method


def arc_length(quotient: Quotient, points: Array, rows: list[int]) -> float:
    """Return the length of a curve in scale units, orthogonal to the symmetry.

    An arc from ``a`` to ``b`` is the curve of the points ``q(s)``, ``0 <= s <= 1``, with

    ``f_i(q) = 0``, ``O (q - a - s (b - a)) = 0``, ``u (q - a - s (b - a)) = 0``,

    where the rows of ``O`` span the directions of the orbit at the middle of the chord and ``u`` is
    what the chord has beside them.  The second set chooses a lift from the quotient; of any lift,
    the part of ``dq/ds`` that is orthogonal to the orbit has the same length, which is integrated
    by an adaptive rule of Gauss and Kronrod.  Its nodes avoid the ends, where gradients may be
    dependent.

    Parameters
    ----------
    quotient : Quotient
        Polyhedron and symmetry.
    points : (k, n) array
        Points of the curve in order; an arc between neighbours turns by less than a right angle.
    rows : list of int
        Inequalities that vanish along it; their gradients may have one relation.

    Notes
    -----
    An arc on which Newton's method fails counts with the length of its chord.
    """
    middle = quotient.at(points[len(points) // 2])
    kept = middle.basis(rows)
    if len(kept) + len(middle.matrix([])) + 1 == len(middle.q):
        return _length(quotient, points, kept)
    starts = (held_at(quotient, q, frozenset(rows), kept) for q in points[:-1])
    return sum(
        _length(at.quotient, np.array(ends), at.kept)
        for at, ends in zip(starts, pairwise(points), strict=True)
    )


def _length(quotient: Quotient, points: Array, rows: Sequence[int]) -> float:
    """Return the length of a curve on which given functions with independent gradients vanish."""
    from scipy.integrate import quad_vec

    moved = np.diff(points, axis=0)
    arcs = Arcs(quotient, points[:-1][moved.any(axis=1)], moved[moved.any(axis=1)], rows)
    error = 100 * quotient.tolerances.rounding  # absolute in scale units, and relative
    length, _ = quad_vec(arcs.speed, 0.0, 1.0, epsabs=error, epsrel=error, quadrature="gk15")
    return float(length)


class Arcs:
    """Arcs over chords, all of them at the same part of the way.

    The unknown is ``w``, how far the points of the arcs are from those of the chords, in scaled
    coordinates.
    """

    def __init__(
        self, quotient: Quotient, starts: Array, moved: Array, rows: Sequence[int]
    ) -> None:
        self.quotient, self.starts, self.held = quotient, starts, quotient.held(rows)
        self.scales = quotient.scales
        self.chords = moved / self.scales
        self.sizes = np.linalg.norm(self.chords, axis=1)
        lifts = []
        for q, chord in zip(starts + moved / 2, self.chords, strict=True):
            orbit = self._orbit(q)
            lifts.append(np.vstack([orbit, chord - orbit.T @ (orbit @ chord)]))
        self.lifts = np.array(lifts)

    def speed(self, s: float) -> float:
        """Return the sum over the arcs of the length of ``dq/ds`` orthogonal to the orbit."""
        return float(self.at(s)[1].sum())

    def at(self, s: float) -> tuple[Array, Array]:
        """Return the points of the arcs, and the lengths of ``dq/ds`` orthogonal to the orbit."""
        w, still = np.zeros_like(self.chords), 100 * self.quotient.tolerances.rounding * self.sizes
        for _ in range(STEPS):
            q = self.starts + self.scales * (s * self.chords + w)
            step, slope = self._solved(q)
            w = w + step
            settled = np.linalg.norm(step, axis=1) <= still
            if settled.all():
                break
        way = np.where(settled[:, None], self.chords + slope, self.chords)
        if len(self.lifts[0]) > 1:
            orbits = np.array([self._orbit(at) for at in q])
            way = way - np.einsum("kgi,kgj,kj->ki", orbits, orbits, way)
        return q, np.linalg.norm(way, axis=1)

    def _solved(self, q: Array) -> tuple[Array, Array]:
        """Return Newton's steps at points of the arcs, and the derivatives of ``w`` by ``s``."""
        values, gradients = self.quotient.polyhedron.bundle.evaluate(q, 1)
        rows = gradients[:, self.held] * self.scales
        lengths = np.linalg.norm(rows, axis=2)
        rows = rows / lengths[:, :, None]
        sides = np.zeros((len(q), len(self.held) + len(self.lifts[0]), 2))
        sides[:, : len(self.held), 0] = -values[:, self.held] / lengths
        sides[:, : len(self.held), 1] = -np.einsum("kij,kj->ki", rows, self.chords)
        matrix = np.concatenate([rows, self.lifts], axis=1)
        try:
            found = np.linalg.solve(matrix, sides)
        except np.linalg.LinAlgError:
            found = np.linalg.pinv(matrix) @ sides
        return found[..., 0], found[..., 1]

    def _orbit(self, q: Array) -> Array:
        """Return an orthonormal basis of the directions of the orbit."""
        orbit = unit_rows(self.quotient.orbit(q))
        limit = self.quotient.tolerances.rank
        return np.asarray(null_space(null_space(orbit, limit).T, limit).T)


class Completeness(Enum):
    """Completeness of a skeleton; the value is a sentence."""

    CORNERS_PROVED = (
        "all corners in the box of a complete list, as proved, and all that they lead to; \
closed edges and faces that no walk met are not excluded"
    )
    EXHAUSTED = "all that was met is traced; islands that no walk met are not excluded"
    GAPS = "some edges could not be traced: the notes say which"
    BUDGET = "budget or time was used up: edges or faces are left"
    INTERRUPTED = "interrupted: edges or faces are left"
    SEEDS = "no start leads to a corner, an edge or a closed face"


@dataclass(frozen=True, eq=False)
class Corner(Checked):
    """A corner: a point that its active functions isolate, modulo the symmetry.

    Attributes
    ----------
    point : (n,) array
        The point: of its orbit the first that was found.
    stratum : Stratum
        Active functions, rank, dimension and local type there.
    singular : bool
        Whether the rank falls short: curves cross, touch or have a cusp, or a surface an apex.
    edges : tuple of int
        Edges that leave it, as positions in ``Skeleton.edges``, once for every end.
    """

    point: Array
    stratum: Stratum
    singular: bool
    edges: tuple[int, ...]

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the active functions."""
        return self.stratum.active

    @property
    def rank(self) -> int:
        """Rank of the active gradients and equations."""
        return self.stratum.rank

    @property
    def local_type(self) -> LocalType:
        """What the polyhedron looks like here."""
        return self.stratum.local_type

    @property
    def chirality(self) -> str | None:
        """The model's ``chirality`` annotation, or None."""
        return self.stratum.chirality


@dataclass(frozen=True, eq=False)
class Edge(Checked):
    """An edge: a curve on which the active functions vanish, modulo the symmetry.

    Attributes
    ----------
    active : tuple of str
        Functions that vanish along it.
    ends : tuple of (int or None, int or None)
        Corners at its ends, as positions in ``Skeleton.corners``; None where there is none.
    kinds : tuple of (End, End)
        How either end comes about.
    polyline : (k, n) array
        Points along it, in coordinates that are not wrapped.
    quotient : Quotient
        The polyhedron modulo its symmetry.
    """

    active: tuple[str, ...]
    ends: tuple[int | None, int | None]
    kinds: tuple[End, End]
    polyline: Array
    quotient: Quotient = field(repr=False)

    @cached_property
    def length(self) -> float:
        """Length of the curve in scale units, orthogonal to the symmetry.

        Integrated to ``1e-11`` between the ends of the polyline; see
        :func:`~polycorner.skeletons.parts.arc_length`.  A cusp at an end is known less exactly, to
        about ``1e-7``.
        """
        names = self.quotient.polyhedron.names
        return arc_length(self.quotient, self.polyline, [names.index(f) for f in self.active])

    @property
    def is_closed(self) -> bool:
        """Whether it is a closed curve without a corner."""
        return self.kinds[0] is End.CLOSED

    @property
    def is_loop(self) -> bool:
        """Whether it returns to the corner it left, or is closed without a corner."""
        return self.is_closed or (self.ends[0] is not None and self.ends[0] == self.ends[1])


@dataclass(frozen=True)
class Face(Checked):
    """A two-dimensional face, modulo the symmetry.

    Attributes
    ----------
    active : tuple of str
        Functions that vanish on it.
    boundary : tuple of tuple of int
        Its boundary curves, each as the positions of its edges; none for an apex or a closed
        surface.
    closed : bool
        Whether every boundary curve closes: no end at infinity, and no corner where the face
        could not be followed.
    border : Border or None
        What its Euler characteristic is computed from; None modulo relabellings, and where no point
        of it is known beside a singular corner.
    """

    active: tuple[str, ...]
    boundary: tuple[tuple[int, ...], ...]
    closed: bool
    border: Border | None = field(default=None, compare=False, repr=False)

    @cached_property
    def euler_characteristic(self) -> int | None:
        """That of the face with its boundary, from the critical points of heights on it.

        A disc with ``b`` holes and ``g`` handles has ``1 - b - 2 g``.  None where it is not
        determined: the face is not compact, a net does not cover it or leaves it where no edge
        was found, heights do not agree, or a finite symmetry carries it to itself or relabels
        functions.  Computed when it is asked for.
        """
        if self.border is None or not self.closed:
            return None
        found = face_euler_characteristic(self.border)
        return None if found is None else found - self.boundary.count(())


@dataclass(frozen=True)
class Contact(Checked):
    """Where a function of a polyhedron vanishes on it, as far as was found.

    Attributes
    ----------
    corners, edges, faces : int
        On how many of them it is active.
    least : float or None
        Least value in the polyhedron that samples and minimisation found, if it was never met;
        None if it was met, or no islands were sought.
    """

    corners: int
    edges: int
    faces: int
    least: float | None

    @property
    def met(self) -> bool:
        """Whether it is active anywhere."""
        return self.corners + self.edges + self.faces > 0

"""Lengths of edges modulo the symmetry."""

from itertools import pairwise

import numpy as np

from polycorner.polyhedra.cones import null_space, unit_rows
from polycorner.skeletons.dependence import held_at
from polycorner.skeletons.points import Quotient
from polycorner.spaces.manifold import Array

STEPS = 12  # of Newton's method
SETTLED = 1e-11  # size of its last step relative to the chord
ERROR = 1e-11  # of a length, absolute in scale units and relative


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


def _length(quotient: Quotient, points: Array, rows: list[int]) -> float:
    """Return the length of a curve on which given functions with independent gradients vanish."""
    from scipy.integrate import quad_vec

    moved = np.diff(points, axis=0)
    arcs = _Arcs(quotient, points[:-1][moved.any(axis=1)], moved[moved.any(axis=1)], rows)
    length, _ = quad_vec(arcs.speed, 0.0, 1.0, epsabs=ERROR, epsrel=ERROR, quadrature="gk15")
    return float(length)


class _Arcs:
    """Arcs over chords, all of them at the same part of the way.

    The unknown is ``w``, how far the points of the arcs are from those of the chords, in scaled
    coordinates.
    """

    def __init__(self, quotient: Quotient, starts: Array, moved: Array, rows: list[int]) -> None:
        self.quotient, self.starts, self.held = quotient, starts, quotient.held(rows)
        self.scales = quotient.polyhedron.manifold.scale_array
        self.chords = moved / self.scales
        self.sizes = np.linalg.norm(self.chords, axis=1)
        lifts = []
        for q, chord in zip(starts + moved / 2, self.chords, strict=True):
            orbit = self._orbit(q)
            lifts.append(np.vstack([orbit, chord - orbit.T @ (orbit @ chord)]))
        self.lifts = np.array(lifts)

    def speed(self, s: float) -> float:
        """Return the sum over the arcs of the length of ``dq/ds`` orthogonal to the orbit."""
        w = np.zeros_like(self.chords)
        for _ in range(STEPS):
            q = self.starts + self.scales * (s * self.chords + w)
            step, slope = self._solved(q)
            w = w + step
            settled = np.linalg.norm(step, axis=1) <= SETTLED * self.sizes
            if settled.all():
                break
        way = np.where(settled[:, None], self.chords + slope, self.chords)
        if len(self.lifts[0]) > 1:
            orbits = np.array([self._orbit(at) for at in q])
            way = way - np.einsum("kgi,kgj,kj->ki", orbits, orbits, way)
        return float(np.linalg.norm(way, axis=1).sum())

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
        orbit = unit_rows(self.quotient.symmetry.directions(self.quotient.polyhedron.manifold, q))
        limit = self.quotient.tolerances.rank
        return np.asarray(null_space(null_space(orbit, limit).T, limit).T)

"""Strata: the face of a polyhedron that a point lies on, and its local type."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.kinds import checked
from polycorner.polyhedra.cones import inward_direction, rank
from polycorner.polyhedra.polyhedron import Piece, Polyhedron
from polycorner.printing import Printed, Sheet, facts, names
from polycorner.spaces.manifold import Array
from polycorner.tolerances import RANK_TOLERANCE, TOLERANCE, Tolerances
from polycorner.values import Checked


class LocalType(Enum):
    """Local type of a polyhedron at a point; the value is a sentence."""

    OUTSIDE = "the point does not lie in the polyhedron"
    INTERIOR = "no active function: the polyhedron is a neighbourhood of the point"
    QUADRANT = "independent active gradients: locally a quadrant"
    CONE = "dependent active gradients: locally a convex cone, not a quadrant as it is written"
    UNION = "several branches meet: locally a union of convex cones"
    NOT_SMOOTH = "an active function has no finite gradient there: the tip of a root, say"
    DEGENERATE = "the active gradients leave no inward direction: possibly a cusp, not a corner"


@dataclass(frozen=True)
class Stratum(Printed, Checked):
    """The face of a polyhedron that a point lies on.

    Attributes
    ----------
    active : tuple of str
        Functions that vanish at the point and decide membership near it.
    pieces : tuple of tuple of str
        The polyhedron near the point as a union: each piece is where its functions are >= 0.
    rank : int
        Rank of the gradients of active functions and equations on the manifold, as far as they
        are finite.
    dimension : int
        Dimension of the face, that of the manifold minus the rank.
    local_type : LocalType
        Interior, quadrant, cone, union, degenerate, not smooth, or outside.
    annotations : mapping from str to str or None
        The model's remarks on the point, such as ``{"chirality": "R"}``.
    """

    active: tuple[str, ...]
    pieces: tuple[tuple[str, ...], ...]
    rank: int
    dimension: int
    local_type: LocalType
    annotations: Mapping[str, str | None]

    @property
    def chirality(self) -> str | None:
        """The model's ``chirality`` annotation, or None."""
        return self.annotations.get("chirality")

    def __repr__(self) -> str:
        """Return active functions, dimension and type in one line."""
        active = names(self.active, 40) or "nothing"
        return f"Stratum({self.local_type.name} of dimension {self.dimension}; on {active})"

    def _sheet(self) -> Sheet:
        pieces = "; ".join(", ".join(piece) for piece in self.pieces)
        several = len(self.pieces) > 1
        rows = [
            ("local type", f"{self.local_type.name}: {self.local_type.value}"),
            ("dimension", str(self.dimension)),
            ("rank", str(self.rank)),
            ("active", ", ".join(self.active) or "none"),
            *([("branches", pieces)] if several else []),
            *((name, value or "none") for name, value in self.annotations.items()),
        ]
        return Sheet("Stratum", (facts(rows),))


@checked
def stratum_at(
    polyhedron: Polyhedron,
    q: ArrayLike | Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Stratum:
    """Classify a point: which functions are active, the rank, dimension and type of its face.

    Parameters
    ----------
    polyhedron : Polyhedron
        The set.
    q : (n,) array or mapping from coordinate names
        The point.
    tolerance : float, optional
        A function counts as active within this distance of its zero set, in scale units
        (``|f| <= tolerance |grad f|`` with the gradient in scaled coordinates).
    rank_tolerance : float, optional
        Singular values of the unit gradients below this fraction of the largest count as zero.

    Examples
    --------
    >>> from polycorner.spaces.manifold import Manifold
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> stratum_at(Polyhedron(M, {"floor": y, "wall": x}), [0.0, 0.0]).dimension
    0
    """
    checks.instance("polyhedron", polyhedron, Polyhedron)
    tolerances = Tolerances.of(tolerance, rank_tolerance)
    point = polyhedron.manifold.point(q)
    values, gradients = evaluated(polyhedron, point)
    return stratum_of(polyhedron, point, values, gradients, tolerances.zero, tolerances.rank)


def stratum_of(
    polyhedron: Polyhedron,
    point: Array,
    values: Array,
    gradients: Array,
    tolerance: float,
    rank_tolerance: float = RANK_TOLERANCE,
) -> Stratum:
    """Classify a point by values and scaled gradients there; see :func:`stratum_at`."""
    pieces = local_pieces(polyhedron, distances(values, gradients), tolerance)
    active = sorted(set().union(*pieces))
    m, hidden = len(polyhedron.functions), polyhedron.normalised
    jacobian = gradients[[*active, *range(m, len(values))]]
    known = np.isfinite(jacobian).all(axis=1)
    r = rank(jacobian[known], rank_tolerance) - hidden
    kind = _local_type(pieces, gradients, m, rank_tolerance) if known.all() else None
    return Stratum(
        active=tuple(polyhedron.names[i] for i in active),
        pieces=tuple(tuple(polyhedron.names[i] for i in sorted(piece)) for piece in pieces),
        rank=r,
        dimension=polyhedron.dimension - r,
        local_type=kind or LocalType.NOT_SMOOTH,
        annotations={name: label(point) for name, label in polyhedron.annotations.items()},
    )


def evaluated(polyhedron: Polyhedron, q: Array) -> tuple[Array, Array]:
    """Return values and scaled gradients of all inequalities, then all equations."""
    values, gradients = polyhedron.bundle.evaluate(q, 1)
    return values, gradients * polyhedron.manifold.scale_array


def distances(values: Array, gradients: Array) -> Array:
    """Return signed distances ``f / |grad f|``.

    Infinite where ``f`` is not zero and its gradient vanishes or is not finite; NaN where ``f`` is
    not finite.
    """
    sizes, known = np.sqrt(np.einsum("ij,ij->i", gradients, gradients)), np.isfinite(values)
    plain = (sizes > 0) & (sizes < np.inf) & known
    if plain.all():
        return np.asarray(values / sizes)
    far = np.where(values == 0, 0.0, np.copysign(np.inf, values))
    far[~known] = np.nan
    return np.asarray(np.divide(values, sizes, out=far, where=plain))


def local_pieces(polyhedron: Polyhedron, away: Array, tolerance: float) -> list[Piece]:
    """Return the polyhedron near a point as a union of pieces; none where the point is outside.

    Given are the :func:`distances` of its inequalities and equations.
    """
    m = len(polyhedron.functions)
    if (abs(away[m:]) > tolerance).any() or np.isnan(away).any():
        return []
    signs = np.sign(away[:m]) * (abs(away[:m]) > tolerance)
    return polyhedron.signs_to_pieces(signs.tolist())


def _local_type(pieces: list[Piece], gradients: Array, m: int, rank_tolerance: float) -> LocalType:
    if not pieces:
        return LocalType.OUTSIDE
    if len(pieces) > 1:
        return LocalType.UNION
    active = sorted(pieces[0])
    equations = gradients[m:]
    if not active and not len(equations):
        return LocalType.INTERIOR
    jacobian = np.vstack([gradients[active], equations])
    if rank(jacobian, rank_tolerance) == len(jacobian):
        return LocalType.QUADRANT if active else LocalType.INTERIOR
    if not active:
        return LocalType.DEGENERATE
    _, rate = inward_direction(gradients[active], equations)
    return LocalType.CONE if rate > rank_tolerance else LocalType.DEGENERATE

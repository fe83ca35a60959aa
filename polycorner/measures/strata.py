"""Corners by determinants and edges by quadrature: weights, symmetry numbers, probabilities.

Along an edge, arcs over the chords of its polyline are integrated by Gauss's rule, of more and more
nodes until two in succession agree.  With the density ``w`` of the edge three integrals are kept:
its measure ``Z = int w ds``, its *resistance* ``R = int ds / w``, and ``int w h ds`` with the
harmonic function ``h`` that falls from 1 to 0 along it: ``h' = -1 / (R w)``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from polycorner import checks
from polycorner.kinds import checked
from polycorner.measures.weighting import LIMIT, Weighting, boltzmann, densities, factors
from polycorner.measures.wells import confined
from polycorner.polyhedra.quotients import Quotient
from polycorner.printing import Printed, Sheet, listed, names, number
from polycorner.progress import Progress, silent
from polycorner.skeletons.elements import Skeleton, corner_name
from polycorner.skeletons.parts import Arcs, Corner, Edge
from polycorner.skeletons.states import SearchState
from polycorner.spaces.manifold import Array
from polycorner.values import Checked, cached_property

FEWEST, MOST = 6, 96  # nodes of Gauss's rule on an arc
FINE = 24  # the same where a point is sought
GENERIC = 0.381966  # part of an edge's length at which no symmetry but that of the edge is expected


class EdgeIntegrals(NamedTuple):
    """Integrals along an edge: see the module; ``near`` are those of ``h`` from either end."""

    measure: float
    resistance: float
    near: tuple[float, float]
    error: float  # of the measure and of the resistance, relative


@dataclass(frozen=True, eq=False)
class StrataMeasures(Checked, Printed):
    """What the corners and edges of a skeleton weigh.

    Weights are those of :mod:`polycorner.measures` without stickiness: ``Z`` over the symmetry
    number.  NaN where a weight is declined; the notes say why.

    Attributes
    ----------
    skeleton : Skeleton
    weighting : Weighting
    corners, edges : arrays ``(c,)`` and ``(e,)``
        Their weights.
    errors : (e,) array
        Of the edges' weights, relative: what the last two rules differ by.
    corner_orders, edge_orders : arrays of int
        Symmetry numbers: orders of the finite groups that carry them to themselves.
    resistances : (e,) array
        ``int ds / w`` along every edge, without its symmetry number.
    near : (e, 2) array
        What every edge weighs near its ends: ``int w h ds`` over the symmetry number.
    notes : tuple of str
        What was declined, and why.
    """

    skeleton: Skeleton
    weighting: Weighting
    corners: Array
    edges: Array
    errors: Array
    corner_orders: NDArray[np.int64]
    edge_orders: NDArray[np.int64]
    resistances: Array
    near: Array
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return the counts."""
        return f"StrataMeasures({len(self.corners)} corners, {len(self.edges)} edges)"

    def _factors(self, active: tuple[str, ...]) -> float:
        known = self.skeleton.polyhedron.names
        return float(factors(self.weighting, known)[[known.index(name) for name in active]].prod())

    @cached_property
    def sticky_corners(self) -> Array:
        """Weights of the corners with stickiness; in the limit only those with most contacts.

        Of corners with a weight.
        """
        parts, known = self.skeleton.corners, ~np.isnan(self.corners)
        sticky = np.array([self._factors(corner.active) for corner in parts])
        if self.weighting.is_limit and known.any():
            counts = np.array([len(corner.active) for corner in parts])
            sticky = sticky * (counts == counts[known].max())
        return np.asarray(self.corners * sticky)

    @cached_property
    def sticky_edges(self) -> Array:
        """Weights of the edges with stickiness; zero in the limit."""
        if self.weighting.is_limit:
            return np.zeros(len(self.edges))
        sticky = [self._factors(edge.active) for edge in self.skeleton.edges]
        return np.asarray(self.edges * sticky)

    @property
    def probabilities(self) -> Array:
        """Shares of the corners among all corners with a weight, ``(c,)``."""
        total = np.nansum(self.sticky_corners)
        return np.asarray(self.sticky_corners / total if total else self.sticky_corners)

    @property
    def partition(self) -> Mapping[int, float]:
        """Sums of the weights by dimension, with stickiness; what was declined is left out."""
        return {0: float(np.nansum(self.sticky_corners)), 1: float(np.nansum(self.sticky_edges))}

    @property
    def balance(self) -> str:
        """How corners and edges share the weight, in sentences."""
        corners, edges = self.partition.values()
        if not self.weighting.is_limit:
            total = corners + edges or 1.0
            shares = (number(part / total, 6) for part in (corners, edges))
            return "Corners have {} of the weight of corners and edges, edges {}.".format(*shares)
        limit = "In the sticky limit corners with the most contacts have all the weight."
        known, loose = ~np.isnan(self.corners), float(np.nansum(self.edges))
        most = {len(self.skeleton.corners[k].active) for k in np.flatnonzero(known)}
        fewer = {len(edge.active) + 1 for edge in self.skeleton.edges}
        if most != fewer or len(most) != 1 or not corners or not loose:
            return limit
        ratio = number(loose / corners, 6)
        return f"{limit}  With a stickiness K edges are met {ratio} / K times as often as they are."

    def _sheet(self) -> Sheet:
        corners = zip(
            self.skeleton.corners, self.corners, self.corner_orders, self.probabilities, strict=True
        )
        told = (
            (corner_name(k), names(c.active), number(z, 9), str(order), number(p, 9))
            for k, (c, z, order, p) in enumerate(corners)
        )
        head = ("corner", "contacts", "weight", "symmetry number", "probability")
        edges = zip(
            self.skeleton.edges, self.edges, self.edge_orders, self.resistances, strict=True
        )
        rows = (
            (str(k), names(e.active), number(z, 9), str(order), number(r, 9))
            for k, (e, z, order, r) in enumerate(edges)
        )
        second = ("edge", "contacts", "weight", "symmetry number", "resistance")
        parts = (
            listed("Corners", head, told, len(self.corners), (2, 3, 4)),
            listed("Edges", second, rows, len(self.edges), (2, 3, 4)),
        )
        notes = (f"Note: {n}" for n in self.notes)
        return Sheet("Measures of strata", (*parts, self.balance, *notes))


@checked
def measure(
    skeleton: Skeleton,
    *,
    weighting: Weighting = LIMIT,
    edges: bool = True,
    tolerance: float = 1e-10,
    progress: Progress = silent,
) -> StrataMeasures:
    """Return what the corners and edges of a skeleton weigh, modulo its symmetry.

    Parameters
    ----------
    skeleton : Skeleton
        Its symmetry's ``tangents`` are values of fixed vector fields whose flows are isometries of
        the scaled coordinates, but for multiples of the others.
    weighting : Weighting, optional
        The sticky limit by default.
    edges : bool, optional
        Whether edges are weighed, too; otherwise their weights are NaN.
    tolerance : float, optional
        Relative error of the edges' integrals that is aimed at.
    progress : callable, optional
        Told the number of edges.

    Returns
    -------
    StrataMeasures
        Corners with more contacts than dimensions and singular ones outweigh all others in the
        limit; they are declined unless the weighting has a stiffness or asks for surface measure.
        So are edges along which gradients are dependent, whatever the stiffness.

    Raises
    ------
    TypeError, ValueError
        For other arguments.

    Examples
    --------
    >>> from polycorner import skeleton
    >>> from polycorner.models import SphereCluster
    >>> six = SphereCluster(6)
    >>> found = measure(skeleton(six.polyhedron, six.starts(), symmetry=six.symmetry))
    >>> found.probabilities.round(9).tolist()
    [0.96, 0.04]
    """
    checks.real("tolerance", tolerance, above=0, below=1)
    quotient = skeleton_quotient(skeleton)
    work = _Measuring(skeleton, quotient, weighting, tolerance)
    corners = [work.corner(k, corner) for k, corner in enumerate(skeleton.corners)]
    weighed = []
    for k, edge in enumerate(skeleton.edges):
        weighed.append(work.edge(k, edge) if edges else (0, NONE))
        progress(k + 1, len(skeleton.edges), "edges")
    orders = np.array([order for order, _ in weighed], dtype=np.int64)
    found = [integrals for _, integrals in weighed]
    return StrataMeasures(
        skeleton,
        weighting,
        np.array([z for _, z in corners]),
        np.array([one.measure for one in found]) / np.maximum(orders, 1),
        np.array([one.error for one in found]),
        np.array([order for order, _ in corners], dtype=np.int64),
        orders,
        np.array([one.resistance for one in found]),
        np.reshape([one.near for one in found], (-1, 2)) / np.maximum(orders, 1)[:, None],
        tuple(work.notes),
    )


def skeleton_quotient(skeleton: Skeleton) -> Quotient:
    """Return the polyhedron of a skeleton modulo the symmetry of its search."""
    state = skeleton.state
    if not isinstance(state, SearchState):
        checks.refuse("skeleton", "one that a search made", skeleton)
    return state.quotient


NONE = EdgeIntegrals(math.nan, math.nan, (math.nan, math.nan), math.nan)


class _Measuring:
    def __init__(
        self, skeleton: Skeleton, quotient: Quotient, weighting: Weighting, tolerance: float
    ) -> None:
        self.quotient, self.weighting, self.tolerance = quotient, weighting, tolerance
        self.names = skeleton.polyhedron.names
        self.notes: list[str] = []

    def rows(self, active: tuple[str, ...]) -> list[int]:
        """Return the positions of contacts."""
        return [self.names.index(name) for name in active]

    def order(self, q: Array) -> int:
        """Return the order of the stabiliser of a point in the finite group."""
        quotient = self.quotient
        same = quotient.tolerances.corner
        return len(quotient.symmetry.relabellings(quotient.manifold, q, q, same))

    def corner(self, k: int, corner: Corner) -> tuple[int, float]:
        """Return the symmetry number and the weight of a corner."""
        order, rows, q = self.order(corner.point), self.rows(corner.active), corner.point
        if not self.weighting.gradients or not (
            corner.singular or len(self.quotient.at(q).basis(rows)) < len(rows)
        ):
            return order, float(densities(self.weighting, self.quotient, rows, q[None])[0]) / order
        stiffness = self.weighting.stiffness
        if stiffness is None:
            why = "is singular" if corner.singular else "has more contacts than dimensions"
            self.notes.append(f"{corner_name(k)} {why}, and was declined: give a stiffness")
            return order, math.nan
        weight = confined(self.quotient, rows, q, stiffness, self.tolerance)
        if math.isnan(weight):
            why = "is not rigid to second order, or has more than two flexes"
            self.notes.append(f"{corner_name(k)} {why}, and was declined")
        factor = float(boltzmann(self.weighting, self.quotient.polyhedron, q[None])[0])
        return order, weight * factor / order

    def edge(self, k: int, edge: Edge) -> tuple[int, EdgeIntegrals]:
        """Return the symmetry number and the integrals of an edge."""
        rows, points = self.rows(edge.active), edge.polyline
        middle = edge.quotient.at(points[len(points) // 2])
        if len(middle.basis(rows)) + len(middle.matrix([])) + 1 != len(middle.q) or (
            self.weighting.gradients and len(middle.basis(rows)) < len(rows)
        ):
            self.notes.append(f"gradients are dependent along edge {k}, and it was declined")
            return 0, NONE
        moved = np.diff(points, axis=0)
        moving = moved.any(axis=1)
        arcs = Arcs(edge.quotient, points[:-1][moving], moved[moving], middle.basis(rows))
        return self._edge_order(k, edge, arcs), self._integrals(k, arcs, edge.quotient, rows)

    def _edge_order(self, k: int, edge: Edge, arcs: Arcs) -> int:
        """Return the order of the group that carries an edge to itself.

        What turns an edge with two ends about keeps its middle, which other points are not kept by.
        """
        symmetry = edge.quotient.symmetry
        if symmetry.relabel is None and not symmetry.elements:
            return 1
        generic = self.order(_placed(arcs, GENERIC))
        if not edge.is_closed:
            return max(generic, self.order(_placed(arcs, 0.5)))
        self.notes.append(f"edge {k} is closed: symmetries that turn it are not counted")
        return generic

    def _integrals(self, k: int, arcs: Arcs, quotient: Quotient, rows: list[int]) -> EdgeIntegrals:
        last, count = NONE, FEWEST
        error = math.inf
        while count <= MOST:
            found = self._rule(arcs, quotient, rows, count)
            error = max(
                abs(found.measure / last.measure - 1), abs(found.resistance / last.resistance - 1)
            )
            last = found._replace(error=error)
            if error <= self.tolerance:
                return last
            count *= 2
        if not error <= self.tolerance:
            self.notes.append(f"the integrals along edge {k} are known to {error:.1g} only")
        return last

    def _rule(self, arcs: Arcs, quotient: Quotient, rows: list[int], count: int) -> EdgeIntegrals:
        """Return the integrals by Gauss's rule of so many nodes on every arc."""
        points, lengths = _gauss(arcs, count)
        flat = points.reshape(-1, points.shape[-1])
        density = densities(self.weighting, quotient, rows, flat).reshape(lengths.shape)
        resistances = lengths / density
        before = np.cumsum(resistances.sum(axis=0)) - resistances.sum(axis=0)
        passed = before + _partial(count) @ (resistances / _nodes(count)[1][:, None])
        whole = float(resistances.sum())
        mass = density * lengths
        far = float((mass * passed).sum() / whole)
        total = float(mass.sum())
        return EdgeIntegrals(total, whole, (total - far, far), 0.0)


def _nodes(count: int) -> tuple[Array, Array]:
    """Return nodes and weights of Gauss's rule between 0 and 1."""
    x, w = legendre.leggauss(count)
    return (x + 1) / 2, w / 2


def _gauss(arcs: Arcs, count: int) -> tuple[Array, Array]:
    """Return points ``(p, k, n)`` and weights ``(p, k)`` of Gauss's rule on arcs, by length."""
    nodes, weights = _nodes(count)
    found = [arcs.at(s) for s in nodes]
    points, speeds = (np.array(parts) for parts in zip(*found, strict=True))
    return points, speeds * weights[:, None]


def _partial(count: int) -> Array:
    """Return the matrix of integrals from 0 to the nodes, of values at the nodes."""
    x, _ = legendre.leggauss(count)
    coefficients = np.linalg.inv(legendre.legvander(x, count - 1))
    integrals = legendre.legint(coefficients, lbnd=-1, axis=0)
    return np.asarray(legendre.legval(x, integrals).T / 2)


def _placed(arcs: Arcs, part: float) -> Array:
    """Return the point of arcs after a part of their length."""
    lengths = _gauss(arcs, FINE)[1]
    ends = np.cumsum([0.0, *lengths.sum(axis=0)])
    wanted = part * ends[-1]
    k = min(int(np.searchsorted(ends, wanted, side="right")) - 1, len(ends) - 2)
    x, _ = legendre.leggauss(FINE)
    speeds = np.linalg.solve(legendre.legvander(x, FINE - 1), lengths[:, k] / _nodes(FINE)[1])
    grid = np.linspace(-1.0, 1.0, 100 * FINE)
    run = legendre.legval(grid, legendre.legint(speeds, lbnd=-1)) / 2
    return np.asarray(arcs.at(float(np.interp(wanted - ends[k], run, (grid + 1) / 2)))[0][k])

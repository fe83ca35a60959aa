"""Rates of transitions between corners along edges, passage times and committors.

Let a point diffuse with the constant ``D0`` in scaled coordinates, reflected at the boundary and
held by contacts, in equilibrium with the weights of :mod:`polycorner.measures`.  Where stickiness
is large it is at a corner most of the time, and on an edge for the rest: diffusion on a graph
with sticky vertices ([HGB]).  A function ``u`` of the start, such as a mean time, solves
``D0 (w u')' = -w`` along edges of density ``w``, and at a corner of weight ``Z`` the fluxes
``D0 w u'`` into its edges sum to ``-Z``.  With ``R = int ds / w``, by parts and exactly,

``sum_e D0 / R_e (u_a - u_b) = M_a,   M_a = Z_a + sum_e int w h_a ds``,

the sum over the edges at ``a`` and ``h_a`` the function that falls along an edge from 1 at ``a``
to 0, ``h_a' = -1 / (R w)``.  So corners are the states of a Markov chain with the rates
``D0 / (R_e M_a)``: mean passage times of the chain are those of the diffusion, and a committor, for
which the right-hand side is zero, too.  Where stickiness grows, ``M_a`` tends to ``Z_a``, and the
rates are those of transition-state theory to leading order.  Faces and larger strata are left out:
rates that lead over them are smaller by one power of the stickiness than those along edges, and
the time that is spent there is not counted.

Symmetry: an edge of the quotient stands for ``|G| / |S_e|`` edges, a corner for ``|G| / |S_a|``
corners; ``R_e`` counts once for each edge, weights for each corner.  Edges that lead from a
cluster to an image of itself change nothing.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polycorner import checks
from polycorner.kinds import checked
from polycorner.measures.strata import StrataMeasures
from polycorner.printing import Printed, Sheet, listed, number
from polycorner.skeletons.elements import corner_name
from polycorner.spaces.manifold import Array
from polycorner.values import Checked, cached_property

LEFT_OUT = (
    "rates are along edges alone: faces and larger strata, which large stickiness makes rare, \
are left out"
)


@dataclass(frozen=True, eq=False)
class TransitionRates(Checked, Printed):
    """A Markov chain on the corners of a skeleton.

    Attributes
    ----------
    conductances : (c, c) array
        Flux from corner to corner in equilibrium, per unit of weight and time; symmetric.
    weights : (c,) array
        What every corner weighs, with its share of the edges.
    notes : tuple of str
        What was left out.
    """

    conductances: Array
    weights: Array
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return the number of corners."""
        return f"TransitionRates({len(self.weights)} corners)"

    @cached_property
    def matrix(self) -> Array:
        """Rates from the corner of a row to that of a column; rows sum to zero."""
        rates = self.conductances / self.weights[:, None]
        return np.asarray(rates - np.diag(rates.sum(axis=1)))

    @property
    def stationary(self) -> Array:
        """The shares of the corners in equilibrium."""
        return np.asarray(self.weights / self.weights.sum())

    @checked
    def passage_times(self, targets: Iterable[int]) -> Array:
        """Return the mean times until one of some corners is reached, from every corner.

        Infinite where none of them can be reached.
        """
        reached = self._positions("targets", targets)
        return self._solved(np.where(reached, 0.0, np.nan), self.weights, np.inf)

    @checked
    def committor(self, sources: Iterable[int], targets: Iterable[int]) -> Array:
        """Return the probability of reaching targets before sources, from every corner.

        NaN where neither can be reached.
        """
        begun, reached = self._positions("sources", sources), self._positions("targets", targets)
        if (begun & reached).any():
            checks.refuse("targets", "corners that are no sources", np.flatnonzero(begun & reached))
        known = np.where(reached, 1.0, np.where(begun, 0.0, np.nan))
        return self._solved(known, np.zeros(len(known)), np.nan)

    def _positions(self, argument: str, corners: Iterable[int]) -> NDArray[np.bool_]:
        found = np.zeros(len(self.weights), dtype=np.bool_)
        for corner in corners:
            found[checks.whole(argument, corner, least=0, most=len(found) - 1)] = True
        if not found.any():
            checks.refuse(argument, "at least one corner", [])
        return found

    def _solved(self, known: Array, sources: Array, otherwise: float) -> Array:
        """Solve ``sum_b g_ab (u_a - u_b) = sources_a`` where ``u`` is not known."""
        from scipy.sparse.csgraph import connected_components

        _, parts = connected_components(self.conductances > 0, directed=False)
        met = np.isin(parts, parts[~np.isnan(known)])
        found = np.where(met, known, otherwise)
        free = met & np.isnan(known)
        g = self.conductances
        matrix = np.diag(g.sum(axis=1)) - g
        given = np.where(np.isnan(known), 0.0, known)
        right = sources[free] + g[free] @ given
        found[free] = np.linalg.solve(matrix[np.ix_(free, free)], right)
        return np.asarray(found)

    def _sheet(self) -> Sheet:
        pairs: list[list[int]] = np.argwhere(np.triu(self.conductances, 1)).tolist()
        rows = (
            (
                corner_name(a),
                corner_name(b),
                number(self.matrix[a, b], 6),
                number(self.matrix[b, a], 6),
            )
            for a, b in pairs
        )
        table = listed("Rates", ("from", "to", "rate", "rate back"), rows, len(pairs), (2, 3))
        return Sheet("Rates of transitions", (table, *(f"Note: {n}" for n in self.notes)))


@checked
def rates(
    measures: StrataMeasures, *, diffusion: float = 1.0, edges: bool = True
) -> TransitionRates:
    """Return the rates of transitions between corners along edges.

    Parameters
    ----------
    measures : StrataMeasures
        With a finite stickiness: in the limit nothing ever leaves a corner.
    diffusion : float, optional
        Diffusion constant of every scaled coordinate, in squared scale units per unit of time.
    edges : bool, optional
        Whether time on edges counts; without it the rates are those to leading order in the
        stickiness.

    Raises
    ------
    TypeError, ValueError
        In the sticky limit, without gradients, and where a corner was declined.

    Examples
    --------
    >>> from polycorner import skeleton
    >>> from polycorner.measures import Weighting, measure
    >>> from polycorner.models import SphereCluster
    >>> six = SphereCluster(6)
    >>> found = skeleton(six.polyhedron, six.starts(), symmetry=six.symmetry)
    >>> k = rates(measure(found, weighting=Weighting(stickiness=100.0)), edges=False)
    >>> round(float(k.matrix[1, 0] / k.matrix[0, 1]), 6)
    24.0
    """
    checks.real("diffusion", diffusion, above=0)
    if measures.weighting.is_limit:
        checks.refuse("measures", "those of a finite stickiness", measures.weighting)
    if np.isnan(measures.corners).any():
        declined = ", ".join(corner_name(k) for k, z in enumerate(measures.corners) if np.isnan(z))
        checks.refuse("measures", "weights of all corners", f"none of {declined}")
    count = len(measures.corners)
    conductances, weights = np.zeros((count, count)), measures.sticky_corners.copy()
    factors = measures.sticky_edges / measures.edges
    for k, edge in enumerate(measures.skeleton.edges):
        if np.isnan(measures.edges[k]):
            continue
        flux = diffusion * factors[k] / (measures.resistances[k] * measures.edge_orders[k])
        a, b = edge.ends
        for end, at in enumerate(edge.ends):
            if at is not None and edges:
                weights[at] += factors[k] * measures.near[k, end]
        if a is not None and b is not None and a != b:
            conductances[a, b] += flux
            conductances[b, a] += flux
    return TransitionRates(conductances, weights, (*measures.notes, LEFT_OUT))

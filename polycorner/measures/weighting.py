"""What a stratum weighs: stickiness of contacts, energies, and the density at a point."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.formulas.expressions import as_expression
from polycorner.formulas.functions import SmoothFunction
from polycorner.minimisation.problem import pose
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.polyhedra.quotients import Quotient
from polycorner.spaces.manifold import Array
from polycorner.values import Checked


@dataclass(frozen=True)
class Weighting(Checked):
    """How strata are weighed.

    Attributes
    ----------
    stickiness : float or mapping from str to float
        Factor of every contact that is held, in the units of its function; by name, those that are
        not named have the factor 1.  Infinite: the sticky limit, in which only the strata with the
        most contacts count.
    gradients : bool
        Whether a contact is weighed as ``delta(f)``, as a narrow well is.  Otherwise a stratum has
        its surface measure, in the scales of the manifold: lengths, areas, volumes, and 1 for a
        corner.
    energy : SmoothFunction or SymPy expression, optional
        Its Boltzmann factor ``exp(-E / temperature)`` weighs points.
    temperature : float
        In the units of the energy.
    stiffness : float, optional
        Second derivative over temperature of every contact's well at its minimum, in inverse
        squared units of the functions.  Only corners whose gradients are dependent need it.
    """

    stickiness: float | Mapping[str, float] = 1.0
    gradients: bool = True
    energy: Any = None
    temperature: float = 1.0
    stiffness: float | None = None

    def __post_init__(self) -> None:
        given = self.stickiness
        if isinstance(given, Mapping):
            for name, factor in given.items():
                checks.real(f"stickiness[{name!r}]", factor, above=0)
        else:
            checks.real("stickiness", given, above=0, infinite=True)
        checks.real("temperature", self.temperature, above=0)
        if self.stiffness is not None:
            checks.real("stiffness", self.stiffness, above=0)
        if self.energy is not None and not isinstance(self.energy, SmoothFunction):
            as_expression("energy", self.energy)
        super().__post_init__()

    @property
    def is_limit(self) -> bool:
        """Whether it is the sticky limit."""
        return not isinstance(self.stickiness, Mapping) and math.isinf(self.stickiness)


PLAIN, LIMIT = Weighting(), Weighting(stickiness=math.inf)


def factors(weighting: Weighting, names: Sequence[str]) -> Array:
    """Return the factor of every contact; 1 in the limit, where all have the same."""
    given = weighting.stickiness
    if isinstance(given, Mapping):
        checks.names("stickiness", given, names)
        return np.array([float(given.get(name, 1.0)) for name in names])
    return np.full(len(names), 1.0 if weighting.is_limit else float(given))


def posed(weighting: Weighting, polyhedron: Polyhedron) -> SmoothFunction | None:
    """Return the energy as a function on the polyhedron's manifold."""
    return None if weighting.energy is None else pose(polyhedron, weighting.energy).energy


def densities(
    weighting: Weighting, quotient: Quotient, rows: Sequence[int], points: Array
) -> Array:
    """Return the density with respect to surface measure across orbits, ``(k,)``.

    Without stickiness; infinite where gradients are dependent.  ``rows`` are the contacts that are
    held at the points ``(k, n)``.
    """
    orbits = np.array([quotient.orbit(q) for q in points])
    density = _volumes(orbits)
    if weighting.gradients:
        scaled = quotient.polyhedron.bundle.evaluate(points, 1)[1] * quotient.scales
        sections = _volumes(scaled[:, list(quotient.equations)])
        with np.errstate(divide="ignore"):
            density = density * sections / _volumes(scaled[:, quotient.held(rows)])
    return density * boltzmann(weighting, quotient.polyhedron, points)


def boltzmann(weighting: Weighting, polyhedron: Polyhedron, points: Array) -> Array:
    """Return the factor of the energy at points ``(k, n)``, ``(k,)``."""
    energy = posed(weighting, polyhedron)
    if energy is None:
        return np.ones(len(points))
    return np.asarray(np.exp(-energy.value(points) / weighting.temperature))


def _volumes(rows: Array) -> Array:
    """Return the volumes spanned by rows ``(k, r, n)``."""
    if not rows.shape[1]:
        return np.ones(len(rows))
    return np.asarray(np.linalg.svd(rows, compute_uv=False).prod(axis=-1))

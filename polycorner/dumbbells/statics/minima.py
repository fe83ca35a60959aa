"""The dyad's minima: both nested corners and the two dumbbells end to end, with certificates."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.minimisation import Certificate, minimise, stationary_on
from polycorner.toolkit import Array, Checked, checked, checks

CORNER = ("A2B1", "A2b", "aB1")


@dataclass(frozen=True)
class DyadMinimum(Checked):
    """One of the three loci that the paper names, for one pair.

    Attributes
    ----------
    name : str
        ``delta_R``, ``delta_L`` or ``G``.
    pair : DumbbellPair
        The model.
    certificate : Certificate
        The certificate there; its verdict may be that it is no minimum.
    """

    name: str
    pair: DumbbellPair
    certificate: Certificate

    @property
    def point(self) -> Array:
        """The configuration."""
        return self.certificate.point

    @property
    def headings(self) -> tuple[float, float]:
        """Headings of A and B in degrees, in ``(-90, 90]``."""
        return _both(np.degrees(self.pair.heading(self.point)))

    @property
    def azimuths(self) -> tuple[float, float]:
        """Azimuths of A and B in degrees; zero in the plane, the limit of a large drum."""
        return (0.0, 0.0) if self.pair.is_plane else _both(np.degrees(self.point[[0, 3]]))

    @property
    def lateral(self) -> tuple[float, float]:
        """Lateral positions of A and B in mm: ``rho phi`` in the drum, ``x`` in the plane."""
        factor = 1.0 if self.pair.is_plane else self.pair.centre_radius
        return _both(factor * self.point[[0, 3]])

    @property
    def axial_gap(self) -> float:
        """``eta2 - eta1`` in mm."""
        return float(self.point[4] - self.point[1])

    @property
    def height(self) -> float:
        """Sum of the heights of the four ball centres above the drum's floor, in mm."""
        if self.pair.is_plane:
            return 4 * self.pair.ball_radius
        return self.certificate.energy * self.pair.ball_heights_per_energy

    @property
    def multipliers(self) -> dict[str, float]:
        """``dE/dgap`` by contact, with ``E`` the sum of ball heights.

        In the plane, of the trough energy ``rho (E - E_min)``, in mm.
        """
        factor = self.pair.ball_heights_per_energy
        return {name: factor * value for name, value in self.certificate.multipliers.items()}


@checked
def dyad_minima(pair: DumbbellPair) -> tuple[DyadMinimum, ...]:
    """Find and certify ``delta_R``, ``delta_L`` and ``G`` of a pair.

    ``delta`` is the stationary point of the energy on the face of the three contacts
    ``A2B1, A2b, aB1``.  If the descent from a nested start does not end there (thick rods: a
    multiplier is negative), the point is still found on its face, and its certificate says that
    it is no minimum.
    """
    corners = [dyad_corner(pair, chirality) for chirality in ("R", "L")]
    ends = minimise(pair.polyhedron, pair.energy, pair.end_to_end())
    return (*corners, DyadMinimum("G", pair, ends))


def dyad_corner(pair: DumbbellPair, chirality: Chirality) -> DyadMinimum:
    """Return ``delta_R`` or ``delta_L``: the corner of three contacts, minimum or not."""
    found = minimise(pair.polyhedron, pair.energy, pair.nested(chirality))
    if set(found.active) != set(CORNER):
        start = pair.nested(chirality, clearance=0.0)
        found = stationary_on(pair.polyhedron, pair.energy, start, CORNER)
    return DyadMinimum(f"delta_{chirality}", pair, found)


@checked
def paper_heading(pair: DumbbellPair) -> float:
    """Return the paper's heading of a right-handed dyad, ``arctan(r/l)``, in degrees."""
    return math.degrees(math.atan2(pair.ball_radius, pair.length))


@checked
def heading_curve(
    pair: DumbbellPair, lengths: Iterable[float], chirality: Chirality = "R"
) -> tuple[Array, Array]:
    """Return the dyad's heading in degrees at each length, and whether it is a minimum there."""
    several = checks.numbers("lengths", [*lengths], "a few numbers").tolist()
    with checks.about("lengths"):
        entries = [dyad_corner(replace(pair, length=length), chirality) for length in several]
    headings = np.array([entry.headings[0] for entry in entries])
    return headings, np.array([entry.certificate.is_minimum for entry in entries])


def _both(values: Array) -> tuple[float, float]:
    first, second = np.asarray(values).tolist()
    return first, second

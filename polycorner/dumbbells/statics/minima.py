"""The minima of two dumbbells: nested corners, dumbbells end to end, and all from many starts."""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.symmetries import half_turn_in_place, relabellings
from polycorner.minimisation import Certificate, Minima, minima, minimise, stationary_on
from polycorner.polyhedra import Element, Symmetry
from polycorner.toolkit import Array, Checked, Progress, checked, checks, silent

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


# -------------------------------------------------------------------------- minima from many starts

# A kind of minimum is named by its contacts with positive multipliers:
#
# ============= ==================================================================== ``G`` none: end
# to end on the lowest line, at any distance ``delta`` a ball-ball contact and two ball-rod
# contacts: nested ``staggered`` three ball-ball contacts: nested without touching a rod ``crossed``
# rod on rod: one lies across the other, free to shift along it others the numbers of ball-ball,
# ball-rod and rod-rod contacts, ``crossed 201`` where there is one between the rods =============
# ====================================================================

NAMES = {(0, 0, 0): "G", (1, 2, 0): "delta", (3, 0, 0): "staggered", (0, 0, 1): "crossed"}


def energy_symmetry(pair: DumbbellPair, *, mirror: bool = False) -> Symmetry:
    """Return the symmetries of both the polyhedron and the energy of a pair.

    Shifting the pair along the drum, relabelling the dumbbells and the balls of either, and the
    half-turn about the vertical axis; rolling the pair is no symmetry of its energy.  ``mirror``
    adds the reflection in the vertical plane through the drum's axis, so that right- and
    left-handed minima count as one.
    """
    unit, half = pair.ball_radius, pair.length / 2

    def invariants(q: Array) -> Array:
        arms = [half * f(theta) for theta in (q[2], q[5]) for f in (math.cos, math.sin)]
        if pair.is_plane:
            return np.array([q[0], q[3], q[4] - q[1], *arms]) / unit
        rho = pair.centre_radius
        sides = [rho * f(phi) for phi in (q[0], q[3]) for f in (math.cos, math.sin)]
        return np.array([*sides, q[4] - q[1], *arms]) / unit

    group = _with(relabellings(), half_turn_in_place())
    if mirror:
        group = _with(group, Element(pair.mirror, {}))
    return Symmetry(_shift, invariants, elements=group)


def _shift(q: Array) -> Array:
    """Return the velocity of shifting the pair along the drum, ``(1, 6)``."""
    del q  # the same everywhere
    return np.array([[0.0, 1, 0, 0, 1, 0]])


def _with(group: tuple[Element, ...], more: Element) -> tuple[Element, ...]:
    """Return a group, without the identity, enlarged by an involution that preserves names."""

    def both(element: Element) -> Element:
        return Element(lambda q: more.apply(element.apply(q)), element.names)

    return (*group, more, *[both(element) for element in group])


def scattered(pair: DumbbellPair, rng: np.random.Generator, count: int) -> Array:
    """Return random placements without overlap anywhere in the drum, ``(count, 6)``.

    Independent draws from one distribution.  Headings are uniform, and so is the azimuth of A; with
    even odds B is near A, within ``l/2 + 2 r`` across and along, or anywhere, with a uniform
    azimuth and within ``l + 2 r`` along.  In the plane azimuths are replaced by lateral positions
    within ``l + 2 r``.
    """
    close = int(rng.binomial(count, 0.5))
    near = _placed(pair, rng, close, pair.length / 2 + 2 * pair.ball_radius)
    return np.asarray(rng.permutation(np.concatenate([near, _placed(pair, rng, count - close)])))


def _placed(
    pair: DumbbellPair, rng: np.random.Generator, count: int, near: float | None = None
) -> Array:
    """Return placements of B within ``near`` of A, in mm, or anywhere."""
    reach, rho = pair.length + 2 * pair.ball_radius, pair.centre_radius
    around = reach if pair.is_plane else math.pi
    beside = around if near is None else near / (1 if pair.is_plane else rho)
    size = np.array([around, 0.0, math.pi, beside, reach if near is None else near, math.pi])
    found = np.empty((0, 6))
    while len(found) < count:  # lying across the drum, two always fit beside each other
        q = size * rng.uniform(-1, 1, (4 * count, 6))
        q[:, 3] += q[:, 0]
        found = np.concatenate([found, q[np.asarray(pair.polyhedron.contains(q))]])
    return pair.manifold.wrap(found[:count])


@checked
def pair_minima(
    pair: DumbbellPair,
    *,
    starts: int = 1000,
    rng: np.random.Generator | int | None = None,
    mirror: bool = False,
    progress: Progress = silent,
) -> Minima:
    """Find the minima of a pair, up to shifts and relabelling, from scattered placements.

    Parameters
    ----------
    pair : DumbbellPair
        The dumbbells.
    starts : int, optional
        Number of placements that :func:`scattered` draws.
    rng : Generator or int, optional
        Source of the placements; default a generator with seed 0.
    mirror : bool, optional
        Whether mirror images count as one.
    progress : callable, optional
        As for :func:`~polycorner.minima`.
    """
    checks.whole("starts", starts, least=1, most=checks.MOST)
    generator = checks.generator("rng", rng)
    return minima(
        pair.polyhedron,
        pair.energy,
        starts=scattered(pair, generator, starts),
        symmetry=energy_symmetry(pair, mirror=mirror),
        progress=progress,
    )


def kind_of(certificate: Certificate) -> str:
    """Return the name of a minimum by the contacts that hold it; see the table above."""
    analysis = certificate.analysis
    lengths = Counter(len(certificate.active[k]) for k in analysis.strong_positions)
    numbers = (lengths[4], lengths[3], lengths[2])
    word = "crossed " if numbers[2] else ""
    return NAMES.get(numbers, word + "{}{}{}".format(*numbers))

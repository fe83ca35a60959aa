"""One-dimensional wells that make up a dyad's corner, and their extents.

A certificate labels the directions at the corner; here each of them becomes a well on a line with
the slope and the stiffness that the heights of the balls give it.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.statics.minima import CORNER, dyad_minima
from polycorner.minimisation import Certificate, Entrapment
from polycorner.models.wells.escape import mean_escape_time
from polycorner.models.wells.holding import Escapes, escapes
from polycorner.models.wells.wells import Well
from polycorner.spaces.manifold import Array

GRAVITY = 9810.0  # mm/s^2
BALLS = 4  # whose mass moves in every direction


@dataclass(frozen=True, eq=False)
class Hold:
    """One direction in which a dyad's corner holds it, as a well.

    The coordinate ``s`` is the way in mm that the four balls go in the mean (root mean square, the
    turning of balls of one dumbbell about its axis left out): in every direction the inertia is
    that of four balls.

    Attributes
    ----------
    direction : str
        Contact that opens, or coordinates that change, as in :meth:`Certificate.entrapment`.
    kind : Entrapment
        As the certificate says.
    opening : float
        ``d gap / ds`` of the contact; 0 along the face.
    multiplier : float
        Force in the contact in units of the weight of a ball; 0 along the face.
    slope, stiffness : float
        ``E = slope s + stiffness s^2 / 2``, in weights of a ball, and of a ball per mm: to second
        order, but for the curvature of the gap itself.
    """

    direction: str
    kind: Entrapment
    opening: float
    multiplier: float
    slope: float
    stiffness: float

    @property
    def crossover(self) -> float:
        """Way in mm up to which the slope holds more than the stiffness does; 0 without a slope."""
        return 2 * self.slope / self.stiffness if self.stiffness > 0 else math.inf

    @property
    def without_slope(self) -> "Hold":
        """The half-U hold that is left if the contact presses with no force."""
        return replace(self, kind=Entrapment.HALF_U, multiplier=0.0, slope=0.0)

    def well(
        self, rim: float, *, ball_mass: float = 1.0, gravity: float = GRAVITY, **others: float
    ) -> Well:
        """Return the well in mm, g and s, with a rim at ``s = rim`` mm.

        ``others`` may be drag (g/s), friction (g mm/s^2) and restitution.
        """
        weight = ball_mass * gravity
        wall = self.kind is not Entrapment.U
        slope, stiffness = weight * self.slope, weight * self.stiffness
        return Well(slope, stiffness, rim, wall, BALLS * ball_mass, **others)


def dyad_holds(pair: DumbbellPair, chirality: Chirality = "R") -> tuple[Hold, ...]:
    """Take a dyad's corner apart into directions that inertia does not couple.

    First the contacts: direction ``i`` opens contact ``i`` alone, without momentum along the face.
    Then the normal modes along the face, stiffest first; the last is free and has no well.
    Balls slide without friction and have their moment of inertia about the vertical; their spin
    about the dumbbell's axis does not take part.

    Raises
    ------
    ValueError
        For a pair in the plane, or one whose corner is no minimum held by three forces.
    """
    if pair.is_plane:
        msg = "pair: expected one in a drum, where heights differ; got one in the plane"
        raise ValueError(msg)
    if chirality not in ("R", "L"):
        msg = f"chirality: expected 'R' or 'L'; got {chirality!r}"
        raise ValueError(msg)
    corner = dyad_minima(pair)["RL".index(chirality)].certificate
    if not corner.is_minimum or corner.signature[0] != len(CORNER):
        msg = f"pair: expected one held by three contacts; its corner is {corner.verdict.value}"
        raise ValueError(msg)
    return _holds(pair, corner)


def _holds(pair: DumbbellPair, corner: Certificate) -> tuple[Hold, ...]:
    gradients, hessian = _derivatives(pair, corner)
    unit = pair.manifold.scale_array
    scale = (
        np.sqrt(BALLS / inertia(pair)) / unit
    )  # steps by which all have the inertia of four balls
    slopes, curved = gradients * scale, hessian * np.outer(scale, scale)
    opening = np.linalg.pinv(slopes)
    length = np.linalg.norm(opening, axis=0)
    forces = pair.ball_heights_per_energy * np.array(list(corner.multipliers.values()))
    stiff = np.einsum("ij,ik,kj->j", opening, curved, opening) / length**2
    labels = corner.entrapment
    holds = [
        Hold(name, labels[name], 1 / size, force, force / size, k)
        for name, size, force, k in zip(
            corner.active, length.tolist(), forces.tolist(), stiff.tolist(), strict=True
        )
    ]
    return (*holds, *_modes(corner, scale, slopes, curved))


def _modes(corner: Certificate, scale: Array, slopes: Array, curved: Array) -> Iterator[Hold]:
    """Yield the normal modes along the face, each with the certificate's name that is nearest."""
    face = np.linalg.svd(slopes)[2][len(slopes) :].T
    stiff, modes = np.linalg.eigh(face.T @ curved @ face)
    along = [(name, k) for name, k in corner.entrapment.items() if name not in corner.active]
    bent = corner.curvatures > corner.analysis.small_curvature
    order = [*np.flatnonzero(bent), *np.flatnonzero(~bent)]  # the order of the certificate's names
    vectors = corner.analysis.curvature.vectors[:, order]
    moved = scale[:, None] * (face @ modes)
    nearest = abs(vectors.T @ moved / np.linalg.norm(moved, axis=0)).argmax(axis=0)
    for k, which in reversed(list(zip(stiff.tolist(), nearest.tolist(), strict=True))):
        name, kind = along[which]
        yield Hold(name, kind, 0.0, 0.0, 0.0, 0.0 if kind is Entrapment.FREE else k)


def inertia(pair: DumbbellPair) -> Array:
    """Return the inertia of the six coordinates in masses of a ball; they are not coupled."""
    turning = 2 * (pair.length**2 / 4 + 2 * pair.ball_radius**2 / 5)
    return np.array([2 * pair.centre_radius**2, 2.0, turning] * 2)


def _derivatives(pair: DumbbellPair, corner: Certificate) -> tuple[Array, Array]:
    """Return gradients of the closed gaps and the Hessian of the Lagrangian, scaled coordinates."""
    _, gradients, hessians = corner.problem.evaluate(corner.point, 2)
    rows = [pair.polyhedron.names.index(name) for name in corner.active]
    hessian = hessians[-1].copy()
    for row, force in zip(rows, corner.multipliers.values(), strict=True):
        hessian -= force * hessians[row]
    return gradients[rows], pair.ball_heights_per_energy * hessian


@dataclass(frozen=True)
class Shaking:
    """Noise and drag that are the same in every direction.

    Attributes
    ----------
    energy : float
        At which noise and drag balance, ``T``, in weights of a ball times mm.
    drag_rate : float
        Drag over mass, in 1/s.
    restitution : float
        Between the dumbbells; default 0.
    """

    energy: float
    drag_rate: float
    restitution: float = 0.0

    @property
    def kick(self) -> float:
        """Intensity of the force, in g mm / s^(3/2), for balls of 1 g."""
        return math.sqrt(2 * BALLS * self.drag_rate * self.energy * GRAVITY)

    def well(self, hold: Hold, rim: float) -> Well:
        """Return the well of a direction, for balls of 1 g."""
        return hold.well(rim, drag=BALLS * self.drag_rate, restitution=self.restitution)


def hold_times(
    holds: Iterable[Hold], rims: Sequence[float], shaking: Shaking, *, cells: int = 40
) -> Array:
    """Return mean times in s until noise moves the balls by ``rims`` mm, ``(holds, rims)``.

    They do not depend on the mass of a ball.  Times too long for the grid of
    :func:`~polycorner.models.wells.escape.mean_escape_time` are nan; the free direction has no
    well.
    """
    return np.array([[_time(shaking.well(h, a), shaking.kick, cells) for a in rims] for h in holds])


def _time(well: Well, kick: float, cells: int) -> float:
    try:
        return mean_escape_time(well, kick, cells=cells)
    except ValueError:
        return math.nan


def hold_escapes(
    hold: Hold, rim: float, shaking: Shaking, *, duration: float, count: int = 300, seed: int = 0
) -> Escapes:
    """Simulate escapes whose mean times :func:`hold_times` computes."""
    well = shaking.well(hold, rim)
    return escapes(well, shaking.kick, count=count, duration=duration, seed=seed)

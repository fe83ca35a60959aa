"""One-dimensional wells that make up a dyad's corner, and their extents.

A certificate labels the directions at the corner; here each of them becomes a well on a line, with
slope and stiffness from the heights of the balls.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from polycorner.dumbbells.pair import Chirality, DumbbellPair
from polycorner.dumbbells.statics.minima import CORNER, dyad_minima
from polycorner.minimisation import Certificate, Entrapment
from polycorner.models.wells import Escapes, Well, escapes, mean_escape_time
from polycorner.toolkit import Array, Value, checks

GRAVITY = 9810.0  # mm/s^2
BALLS = 4  # number of balls whose inertia every direction has


@dataclass(frozen=True, eq=False)
class Hold(Value):
    """One direction in which a dyad's corner holds it, as a well.

    The coordinate ``s`` is the root mean square displacement of the four balls in mm, rotation of
    balls about the dumbbell's axis disregarded: in every direction the inertia is that of four
    balls.

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
        ``E = slope s + stiffness s^2 / 2``, in ball weights and ball weights per mm: to second
        order, disregarding the curvature of the gap itself.
    """

    direction: str
    kind: Entrapment
    opening: float
    multiplier: float
    slope: float
    stiffness: float

    @property
    def crossover(self) -> float:
        """Distance in mm up to which the slope term exceeds the stiffness term; 0 without slope."""
        return 2 * self.slope / self.stiffness if self.stiffness > 0 else math.inf

    @property
    def without_slope(self) -> "Hold":
        """The half-U hold that remains if the contact carries no force."""
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
    """Decompose a dyad's corner into directions that inertia does not couple.

    First come the contacts: direction ``i`` opens contact ``i`` alone, without momentum along the
    face.  Then follow the normal modes along the face, stiffest first; the last is free and has no
    well.  Balls slide without friction and have their moment of inertia about the vertical; their
    spin about the dumbbell's axis is disregarded.

    Raises
    ------
    ValueError
        For a pair in the plane, or one whose corner is no minimum with three contact forces.
    """
    if pair.is_plane:
        checks.refuse("pair", "one in a drum, where heights differ", pair)
    checks.choice("chirality", chirality, ("R", "L"))
    corner = dyad_minima(pair)["RL".index(chirality)].certificate
    if not corner.is_minimum or corner.signature[0] != len(CORNER):
        msg = f"pair: expected one held by three contacts; its corner: {corner.verdict.value}"
        raise ValueError(msg)
    return _holds(pair, corner)


def _holds(pair: DumbbellPair, corner: Certificate) -> tuple[Hold, ...]:
    gradients, hessian = _derivatives(pair, corner)
    unit = pair.manifold.scale_array
    # in steps of this size every coordinate has the inertia of four balls
    scale = np.sqrt(BALLS / inertia(pair)) / unit
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
    """Yield the normal modes along the face, each under the certificate's nearest name."""
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
    """Return the inertia of the six coordinates in ball masses; the coordinates are uncoupled."""
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
class Agitation(Value):
    """Noise and drag that are the same in every direction.

    Attributes
    ----------
    energy : float
        Energy ``T`` at which noise and drag balance, in ball weights times mm.
    drag_rate : float
        Drag over mass, in 1/s.
    restitution : float
        Coefficient of restitution between the dumbbells; default 0.
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
    holds: Iterable[Hold], rims: Sequence[float], shaking: Agitation, *, cells: int = 40
) -> Array:
    """Return mean times in s until noise moves the balls by ``rims`` mm, ``(holds, rims)``.

    The times do not depend on the mass of a ball.  Times too long for the grid of
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
    hold: Hold, rim: float, shaking: Agitation, *, duration: float, count: int = 300, seed: int = 0
) -> Escapes:
    """Simulate escapes whose mean times :func:`hold_times` computes."""
    well = shaking.well(hold, rim)
    return escapes(well, shaking.kick, count=count, duration=duration, seed=seed)

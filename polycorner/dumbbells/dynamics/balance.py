"""Turning of a dyad in the drum: by its weight, and by impacts between its dumbbells.

A nested pair of heading ``theta`` is two parallel dumbbells, ``p = r + t`` across and
``s = l - sqrt(4 r^2 - p^2)`` along their axes apart.  Its weight turns it towards the heading of
least energy, as far as noise overcomes sliding friction.  The higher dumbbell rolls against the
lower one, and an impact at their inner ends turns both the same way: to more positive headings in
right-handed pairs.  This ends where both are equally high; beyond, the weight parts them.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum
from polycorner.dumbbells.dynamics.dyads import SOLVER
from polycorner.motion import simulate

FLAT = 1e7  # mm: radius of a drum that is as good as a plane
CONTACT = 1e-5  # mm between dumbbells before an impact
STEPS = 60  # in the time for which the dumbbells slide


def offsets(drum: DumbbellDrum) -> tuple[float, float]:
    """Return ``p`` and ``s`` of a nested pair, its dumbbells' distance across and along, in mm."""
    _, along, across = drum.pair.plane_corner()
    return across, along


def parting_heading(drum: DumbbellDrum) -> float:
    """Return the heading ``arctan(p/s)`` in degrees where both dumbbells are equally high.

    Beyond it the weight of the dumbbells no longer presses them against each other.
    """
    return math.degrees(math.atan2(*offsets(drum)))


def pressing(drum: DumbbellDrum, heading: float) -> float:
    """Return the force by which dumbbells press on each other, over the weight of a ball.

    It acts across their axes: ``(p cos(theta) - s sin(theta)) / rho`` near the lowest line, where
    both meet the same resistance to rolling.  ``heading`` in degrees, of right-handed pairs.
    """
    (across, along), theta = offsets(drum), math.radians(heading)
    return (across * math.cos(theta) - along * math.sin(theta)) / drum.centre_radius


def return_ratio(drum: DumbbellDrum) -> float:
    """Return how much faster a pair turns to its heading of least energy than a dumbbell to zero.

    If slips of any dumbbell turn it by the same mobility times the torque on it: small deviations
    decay ``sqrt((s^2 + l^2 - p^2)^2 + 4 s^2 p^2) / l^2`` times as fast, by the energy
    ``m g / (2 rho)`` times the sum of the squared distances of the balls from the lowest line.
    """
    across, along = offsets(drum)
    stretched = along**2 + drum.length**2 - across**2
    return math.hypot(stretched, 2 * along * across) / drum.length**2


@dataclass(frozen=True)
class ImpactTurn:
    """What one impact does to a pair in a plane.

    Attributes
    ----------
    turn : float
        Mean turn of the two dumbbells, in rad, positive for right-handed pairs.
    dissipated : float
        Energy that the impact itself dissipated, in nJ.
    """

    turn: float
    dissipated: float


def turn_by_impact(drum: DumbbellDrum, speed: float) -> ImpactTurn:
    """Return how far a right-handed pair turns if one dumbbell rolls against the other, at rest.

    ``speed`` in mm/s.  On a plane, from the impact until both have stopped.  The turn grows as the
    square of the speed over ``mu g``, ``mu`` being the dynamic coefficient of sliding.
    """
    plane = replace(
        drum, drum_radius=FLAT, count=2, tilt=0.0, spin=0.0, restitution=0.0, floor=False
    )
    places = plane.pair.nested("R", heading=0.0, clearance=CONTACT).reshape(2, 3)
    towards = math.copysign(1.0, places[1, 0] - places[0, 0])
    v = np.zeros((2, 4))
    v[0, 0], v[0, 3] = towards * speed / plane.centre_radius, -towards * speed / plane.ball_radius
    slide, roll = (abs(speed) / (mu[1] * GRAVITY) for mu in (plane.sliding, plane.rolling))
    duration = 2 * (slide + roll)
    start = plane.state(places, v)
    path = simulate(plane, start, duration, slide / STEPS, solver=SOLVER)
    turn = float((path.q[-1, :, 2] - path.q[0, :, 2]).mean())
    return ImpactTurn(turn, float(path.dissipated["impact"][-1]))

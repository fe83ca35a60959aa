"""The dumbbells of a drum as rigid bodies in space.

:class:`~polycorner.dumbbells.DumbbellDrum` describes dumbbells that lie on a developed drum,
pressed by their weight at rest.  Here they are compounds of two balls and a rod inside a cylinder
that turns: loads follow from the motion, dumbbells may lift, climb on each other, and pivot.

The axis of the drum is ``y``, rising where the drum is tilted; the lowest line is at ``x = 0, z =
-R``, and azimuths grow towards ``x``.  Sliding friction and rolling resistance act at each ball.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from polycorner.bodies import Arrangement, Cylinder, HalfSpace, Mass, capsule, compound, sphere
from polycorner.checks import instance, refuse
from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum
from polycorner.dumbbells.drum_motion import effective_gravity
from polycorner.motion.mechanics import State
from polycorner.motion.system import System
from polycorner.spaces.arguments import reals
from polycorner.spaces.manifold import Array
from polycorner.values import Value

BALLS = ("D.1-drum", "D.2-drum")  # contacts of the balls with the drum


@dataclass(frozen=True, eq=False)
class RigidDumbbells(Value):
    """Dumbbells in a rotating, tilted drum, as rigid bodies in space.

    Parameters
    ----------
    drum : DumbbellDrum
        Lengths, tilt, spin, friction and masses: two balls, each of uniform density, on a rod
        without mass.  ``top`` and ``floor`` are the ends of the drum.  It may be shaken and
        wobble, which change the effective gravity; other imperfections are refused.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> from polycorner.dumbbells import DumbbellDrum
    >>> rigid = RigidDumbbells(DumbbellDrum())
    >>> rigid.system.contacts
    ('D.1-drum', 'D.2-drum', 'D.rod.v1-drum', 'D.rod.v2-drum')
    >>> rigid.placements(rigid.state([0.1, 5.0, 0.2]).q).round(12).tolist()
    [0.1, 5.0, 0.2]
    """

    drum: DumbbellDrum

    def __post_init__(self) -> None:
        instance("drum", self.drum, DumbbellDrum, "DumbbellDrum()")
        for name in ("out_of_round", "uneven_friction"):
            if (given := getattr(self.drum, name)) is not None:
                refuse("drum", f"no {name}", given)
        super().__post_init__()

    @cached_property
    def arrangement(self) -> Arrangement:
        """One dumbbell ``D``, its rod along ``y``, in the drum and above its bottom."""
        drum = self.drum
        half, r = np.array([0.0, drum.length / 2, 0.0]), drum.ball_radius
        rod = capsule(-half, half, drum.rod_radius)
        dumbbell = compound({"1": sphere(r, at=-half), "2": sphere(r, at=half), "rod": rod})
        wall = Cylinder(drum.drum_radius, np.array([0.0, -1.0, 0.0]), spin=drum.spin)
        walls: dict[str, Cylinder | HalfSpace] = {"drum": wall}
        if drum.floor:
            walls["bottom"] = HalfSpace(np.array([0.0, 1.0, 0.0]), np.zeros(3))
        return Arrangement({"D": dumbbell}, walls, orientations="all", unit="mm")

    @cached_property
    def mass(self) -> Mass:
        """The mass of a dumbbell, in g and mm."""
        drum = self.drum
        along = 2 * 0.4 * drum.ball_mass * drum.ball_radius**2
        across = along + drum.ball_mass * drum.length**2 / 2
        return Mass(2 * drum.ball_mass, np.zeros(3), np.array([across, along, across]))

    @cached_property
    def system(self) -> System:
        """The mechanical system, in mm, g and s."""
        drum = self.drum
        sliding = dict.fromkeys(BALLS, drum.sliding)
        if drum.count > 1:
            sliding["between"] = drum.rubbing
        restitution = {"between": drum.restitution} if drum.count > 1 else {}
        return self.arrangement.system(
            gravity=effective_gravity(drum.imperfections, drum.spin, GRAVITY, drum.tilt),
            masses={"D": self.mass},
            friction=sliding,
            rolling=dict.fromkeys(BALLS, drum.rolling),
            restitution=restitution,
            exits={"yD": drum.top} if math.isfinite(drum.top) else {},
            count=drum.count,
        )

    def state(self, q: ArrayLike) -> State:
        """Return the state of dumbbells that lie on the drum, move with it and stick to it.

        Parameters
        ----------
        q : (count, 3) array, or (3,) of a single one
            ``phi``, ``eta`` in mm and ``theta`` of each dumbbell, in rad.
        """
        given, alone = reals(q, "q"), self.drum.count == 1
        if given.shape != (self.drum.count, 3) and not (alone and given.shape == (3,)):
            refuse("q", f"shape ({self.drum.count}, 3) for phi, eta, theta", given.shape)
        places = np.array([self._place(*row) for row in given.reshape(-1, 3).tolist()])
        spin = np.array([0.0, -self.drum.spin, 0.0])
        speeds = [
            self.arrangement.velocity(p, {"D": (np.cross(spin, p[:3]), spin)}) for p in places
        ]
        state = self.system.state(*((places[0], speeds[0]) if alone else (places, speeds)))
        return replace(state, sticking=np.ones_like(state.sticking))  # slips are rounding errors

    def _place(self, phi: float, eta: float, theta: float) -> Array:
        """Return the coordinates of a dumbbell with both balls on the drum."""
        across = self.drum.length / 2 * math.sin(theta)
        away = math.sqrt(self.drum.centre_radius**2 - across**2)
        around = np.array([math.cos(phi), 0.0, math.sin(phi)])
        inward = np.array([-math.sin(phi), 0.0, math.cos(phi)])
        rod = math.sin(theta) * around + math.cos(theta) * np.array([0.0, 1.0, 0.0])
        turned = Rotation.from_matrix(np.stack([np.cross(rod, inward), rod, inward], axis=-1))
        centre = np.array([0.0, eta, 0.0]) - away * inward
        return self.arrangement.point({"D": (centre, turned)})

    def placements(self, q: ArrayLike) -> Array:
        """Return ``phi, eta, theta`` of dumbbells in space, ``(..., 3)``.

        These are azimuth and height of the centre, and the direction of the rod as seen from the
        axis of the drum; a dumbbell that does not lie on the drum has them as well.

        Parameters
        ----------
        q : (..., 7) array
        """
        places = np.asarray(q, dtype=np.float64)
        flat = places.reshape(-1, places.shape[-1])
        rod = Rotation.from_quat(flat[:, 3:], scalar_first=True).apply([0.0, 1.0, 0.0])
        phi = np.arctan2(flat[:, 0], -flat[:, 2])
        around = rod[:, 0] * np.cos(phi) + rod[:, 2] * np.sin(phi)
        found = np.stack([phi, flat[:, 1], np.arctan2(around, rod[:, 1])], axis=-1)
        return found.reshape(*places.shape[:-1], 3)

    def lifts(self, q: ArrayLike) -> Array:
        """Return how far the farther ball of each dumbbell is from the drum, ``(...)``, in mm."""
        places = np.asarray(q, dtype=np.float64)
        polyhedron = self.arrangement.polyhedron
        balls = [polyhedron.names.index(name) for name in BALLS]
        gaps = polyhedron.values(places.reshape(-1, places.shape[-1]))[:, balls]
        return np.asarray(gaps.max(axis=-1)).reshape(places.shape[:-1])

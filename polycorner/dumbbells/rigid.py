"""The dumbbells of a drum as rigid bodies in space.

:class:`~polycorner.dumbbells.DumbbellDrum` describes dumbbells that lie on a developed drum,
pressed by their weight at rest.  Here they are compounds of two balls and a rod inside a cylinder
that turns: loads follow from the motion, dumbbells may lift, climb on each other, and pivot.

The axis of the drum is ``y``, rising where the drum is tilted; the lowest line is at ``x = 0, z =
-R``, and azimuths grow towards ``x``: so they are at the time 0, and from then on these axes turn
with the drum.  What it carries is at rest in them, exactly; without shaking, nothing depends on the
time but the direction of gravity.  Sliding friction and rolling resistance act at each ball.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from polycorner.bodies import Arrangement, Cylinder, HalfSpace, Mass, capsule, compound, sphere
from polycorner.dumbbells.drum import GRAVITY, DumbbellDrum
from polycorner.dumbbells.drum_motion import effective_gravity, uneven_factor
from polycorner.motion import Friction, State, System
from polycorner.toolkit import (
    LONGEST,
    Array,
    Checked,
    cached_property,
    checked,
    finite,
    instance,
    reals,
    refuse,
    wave_depth,
)

BALLS = ("D.1-drum", "D.2-drum")  # contacts of the balls with the drum
SIZE = 7  # coordinates of a placement in space: the centre and a quaternion


@dataclass(frozen=True, eq=False)
class RigidDumbbells(Checked):
    """Dumbbells in a rotating, tilted drum, as rigid bodies in space.

    Parameters
    ----------
    drum : DumbbellDrum
        Lengths, tilt, spin, friction and masses: two balls, each of uniform density, on a rod
        without mass.  ``top`` and ``floor`` are the ends of the drum.  Shaking and a wobble change
        the effective gravity; attraction acts at gaps; the inside of a wall that is out of round
        has to be convex.

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
        if (oval := self.drum.out_of_round) is not None:
            room = self.drum.drum_radius - self.drum.ball_radius
            if wave_depth({k: (a, 0.0) for k, a in oval.amplitudes.items()}) >= room:
                least = (
                    f"a convex wall, out of round with the sum of |a_k| (k^2 + 1) below {room:g} mm"
                )
                refuse("drum", least, oval)
        super().__post_init__()

    @property
    def spin(self) -> Array:
        """The angular velocity of the drum, ``(3,)``, in rad/s."""
        return np.array([0.0, -self.drum.spin, 0.0])

    @cached_property
    def arrangement(self) -> Arrangement:
        """One dumbbell ``D``, its rod along ``y``, in the drum and above its bottom."""
        drum = self.drum
        half, r = np.array([0.0, drum.length / 2, 0.0]), drum.ball_radius
        rod = capsule(-half, half, drum.rod_radius)
        dumbbell = compound({"1": sphere(r, at=-half), "2": sphere(r, at=half), "rod": rod})
        axis, oval = np.array([0.0, -1.0, 0.0]), drum.out_of_round
        waves = {}
        if oval is not None:  # azimuths of a cylinder begin at x, a quarter turn from the bottom
            turned = {k: oval.phases.get(k, 0.0) + k * math.pi / 2 for k in oval.amplitudes}
            waves = {k: (a, turned[k]) for k, a in oval.amplitudes.items()}
        wall = Cylinder(drum.drum_radius, axis, waves=waves)
        walls: dict[str, Cylinder | HalfSpace] = {"drum": wall}
        if drum.floor:
            walls["bottom"] = HalfSpace(np.array([0.0, 1.0, 0.0]), np.zeros(3))
        named, axes = {"D": dumbbell}, self.spin
        return Arrangement(named, walls, orientations="all", unit="mm", turning=axes)

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
        wall, among = (drum.attraction(share) for share in (drum.adhesion / 2, drum.cohesion))
        pulls = dict.fromkeys(BALLS, wall) | ({"between": among} if drum.count > 1 else {})
        system = self.arrangement.system(
            gravity=effective_gravity(drum.imperfections, drum.spin, GRAVITY, drum.tilt),
            masses={"D": self.mass},
            friction=sliding,
            rolling=dict.fromkeys(BALLS, drum.rolling),
            restitution=restitution,
            attraction={name: pull for name, pull in pulls.items() if pull is not None},
            exits={"yD": drum.top} if math.isfinite(drum.top) else {},
            count=drum.count,
        )
        assert isinstance(system, System)  # of one kind
        if drum.uneven_friction is None:
            return system
        return replace(system, friction=tuple(map(self._uneven, system.friction)))

    def _uneven(self, friction: Friction) -> Friction:
        """Return the friction of a ball where coefficients have the factor of its place.

        The power of a force ``p`` in ``mu f C`` at the slip ``s`` is that of ``p / f`` in ``mu C``
        at ``f s``.  So the slip gets the factor.
        """
        import sympy

        drum, (placement,) = self.drum, self.arrangement.placements
        assert drum.uneven_friction is not None
        amplitude, *modes = drum.uneven_friction.numbers(math.tau * drum.centre_radius)
        part = BALLS.index(friction.load)
        end = [0.0, (part - 0.5) * drum.length, 0.0]
        x, y, z = placement.frame.point(placement.name, list(map(sympy.Float, end)), 3)
        factor = uneven_factor(
            sympy.atan2(x, -z), y, amplitude, np.reshape(modes, (-1, 3)).tolist()
        )
        return replace(friction, slip=tuple(factor * s for s in friction.formulas))

    def state(self, q: ArrayLike) -> State:
        """Return the state at the time 0 of dumbbells that lie on the drum, at rest on it.

        Parameters
        ----------
        q : (count, 3) array, or (3,) of a single one
            ``phi``, ``eta`` in mm and ``theta`` of each dumbbell, in rad.
        """
        given, alone = reals("q", q), self.drum.count == 1
        if given.shape != (self.drum.count, 3) and not (alone and given.shape == (3,)):
            refuse("q", f"shape ({self.drum.count}, 3) for phi, eta, theta", given.shape)
        places = np.array([self._place(*row) for row in given.reshape(-1, 3).tolist()])
        state = self.system.state(places[0] if alone else places)
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

    @checked
    def seen(self, q: ArrayLike, t: ArrayLike = 0.0) -> Array:
        """Return coordinates ``(..., 7)`` in axes at rest.

        Parameters
        ----------
        q : (..., 7) array
        t : float or array that broadcasts with ``(...)``, optional
            Times in s; default 0.
        """
        given, instants = _many(q), finite(reals("t", t), "t")
        if abs(instants).max(initial=0.0) > LONGEST:
            refuse("t", f"times up to {LONGEST:g} s", t)
        places = given.reshape(-1, SIZE)
        try:
            times = np.broadcast_to(instants, given.shape[:-1])
        except ValueError:
            refuse("t", f"times that broadcast with {given.shape[:-1]}", instants.shape)
        turn = Rotation.from_rotvec(times.reshape(-1, 1) * self.spin)
        turned = turn * Rotation.from_quat(places[:, 3:], scalar_first=True)
        found = [turn.apply(places[:, :3]), turned.as_quat(scalar_first=True)]
        return np.concatenate(found, axis=-1).reshape(given.shape)

    @checked
    def placements(self, q: ArrayLike, t: ArrayLike = 0.0) -> Array:
        """Return ``phi, eta, theta`` of dumbbells in space, ``(..., 3)``.

        These are azimuth and height of the centre, and the direction of the rod as seen from the
        axis of the drum; a dumbbell that does not lie on the drum has them as well.

        Parameters
        ----------
        q, t
            As of :meth:`seen`.
        """
        places = self.seen(q, t)
        flat = places.reshape(-1, places.shape[-1])
        rod = Rotation.from_quat(flat[:, 3:], scalar_first=True).apply([0.0, 1.0, 0.0])
        phi = np.arctan2(flat[:, 0], -flat[:, 2])
        around = rod[:, 0] * np.cos(phi) + rod[:, 2] * np.sin(phi)
        found = np.stack([phi, flat[:, 1], np.arctan2(around, rod[:, 1])], axis=-1)
        return found.reshape(*places.shape[:-1], 3)

    @checked
    def lifts(self, q: ArrayLike) -> Array:
        """Return how far the farther ball of each dumbbell is from the drum, ``(...)``, in mm."""
        places = _many(q)
        polyhedron = self.arrangement.polyhedron
        balls = [polyhedron.names.index(name) for name in BALLS]
        gaps = polyhedron.values(places.reshape(-1, places.shape[-1]))[:, balls]
        return np.asarray(gaps.max(axis=-1)).reshape(places.shape[:-1])


def _many(q: ArrayLike) -> Array:
    """Return coordinates of dumbbells in space, ``(..., 7)``."""
    given = reals("q", q)
    if given.ndim == 0 or given.shape[-1] != SIZE:
        refuse("q", f"shape (..., {SIZE})", given.shape)
    return given.copy()  # SciPy's rotations want arrays that they could change

"""Dumbbells in a slowly rotating, tilted drum: the experiment of [GMBN], in motion.

Each dumbbell has four coordinates: azimuth ``phi``, axial position ``eta``, heading ``theta`` and
the spin ``psi`` about its own axis, for a rigid dumbbell is an axle.  Its balls grip the drum by
dry friction, its rolling is resisted by a torque of its own, and dumbbells that touch rub; what
keels, zigzags and climbs follows from that.  Units: mm, g, s, rad; energies in g mm^2/s^2 = nJ.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells import formulas as dumbbell_formulas
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.formulas.bundles import Call
from polycorner.formulas.cache import source_key
from polycorner.formulas.families import Family
from polycorner.motion import formulation as equations
from polycorner.motion.bodies import Body, ContactFamily, FrictionContact, IdenticalBodies
from polycorner.motion.friction import Disc, Interval
from polycorner.motion.noise import Noise, Solver
from polycorner.motion.simulation import check_step, run, whole_steps, whole_stride
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    from polycorner.motion.engine.driver import Engine
    from polycorner.motion.trajectory import Trajectory

GRAVITY = 9806.65  # mm/s^2
COORDINATES = ("phi", "eta", "theta", "psi")
PARAMETERS = ("l", "r", "rho", "m", "surface", "weight", "pull")
FREE_FALL = 0.1  # of the rod radius, that gravity may move a ball within one step
HEAPS = Solver(tolerance=1e-4, sweeps=62)  # where many touch
OVERLAP = 1e-6  # mm up to which a start counts as touching

Pair = tuple[float, float]


@dataclass(frozen=True)
class DumbbellDrum:
    """Dumbbells in a drum that turns.

    Parameters
    ----------
    length, ball_radius, rod_radius, drum_radius : float
        ``l``, ``r``, ``t`` and ``R`` in mm, as for :class:`DumbbellPair`.
    count : int
        Number of dumbbells.
    tilt : float
        ``alpha``, in rad; the drum's axis rises with ``eta``.
    spin : float
        ``omega`` in rad/s; positive carries towards growing azimuth.
    sliding, rolling, rubbing : (float, float)
        Static and dynamic coefficients: of sliding on the drum, per ball; of rolling, the torque
        per ball radius and load; of dumbbells that touch.
    restitution : float
        Newton's coefficient between dumbbells and with the bottom.
    ball_mass : float
        In g.  It scales energies and forces and leaves motion as it is.
    floor : bool
        Whether the drum has a flat bottom at ``eta = 0``.
    top : float
        Where the drum ends, in mm: a dumbbell whose centre passes it has left; ``inf``: never.

    Notes
    -----
    Normal forces on the drum are those of rest, ``m g cos(alpha) cos(phi_i)``: the weight of the
    slow motion is neglected against them, as are changes by vertical rubbing forces between
    dumbbells.  Dumbbells lie on the drum; none climbs on another.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    length: float = 16.0
    ball_radius: float = 3.0
    rod_radius: float = 1.5
    drum_radius: float = 125.0
    count: int = 1
    tilt: float = math.radians(7.0)
    spin: float = 0.01
    sliding: Pair = (0.3, 0.2)
    rolling: Pair = (0.1, 0.06)
    rubbing: Pair = (0.3, 0.3)
    restitution: float = 0.0
    ball_mass: float = 0.14
    floor: bool = False
    top: float = math.inf

    def __post_init__(self) -> None:
        _ = self.pair  # checks the lengths
        if isinstance(self.count, bool) or not isinstance(self.count, int) or self.count < 1:
            msg = f"count: expected a positive whole number; got {self.count!r}"
            raise ValueError(msg)
        for name in ("sliding", "rolling", "rubbing"):
            object.__setattr__(self, name, _coefficients(name, getattr(self, name)))
        for name, low, high, expected in (
            ("tilt", -math.pi / 2, math.pi / 2, "an angle between -pi/2 and pi/2 rad"),
            ("spin", -math.inf, math.inf, "an angular speed in rad/s"),
            ("restitution", -1e-300, 1 + 1e-15, "a number from 0 to 1"),
            ("ball_mass", 0.0, math.inf, "a positive mass in g"),
            ("top", 0.0, math.nan, "a positive length in mm or inf"),
        ):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, Real) or not low < float(value):
                msg = f"{name}: expected {expected}; got {value!r}"
                raise ValueError(msg)
            if float(value) >= high:
                msg = f"{name}: expected {expected}; got {value!r}"
                raise ValueError(msg)

    @cached_property
    def pair(self) -> DumbbellPair:
        """Two of the dumbbells in the drum when it is level and still."""
        lengths = (self.length, self.ball_radius, self.rod_radius, self.drum_radius)
        pair = DumbbellPair(*lengths)
        if pair.is_plane:
            msg = "drum_radius: expected a finite length in mm; got inf"
            raise ValueError(msg)
        return pair

    @property
    def centre_radius(self) -> float:
        """``rho = R - r``, on which the centres move."""
        return self.drum_radius - self.ball_radius

    @cached_property
    def bodies(self) -> IdenticalBodies:
        """The dumbbells as bodies, for the engine."""
        reach = self.length + 2 * self.ball_radius + 0.05 * self.ball_radius
        return IdenticalBodies(
            self._body,
            count=self.count,
            contacts=self._contact_family(reach) if self.count > 1 else None,
            position=(0, 1),
            substrate_speed=self.spin * self.centre_radius,
            exit_coordinate=1 if math.isfinite(self.top) else -1,
            exit_limit=self.top if math.isfinite(self.top) else 0.0,
        )

    @cached_property
    def _body(self) -> Body:
        length, r, rho = self.length, self.ball_radius, self.centre_radius
        m, g = self.ball_mass, GRAVITY
        weight, pull = m * g * math.cos(self.tilt), m * g * math.sin(self.tilt)
        numbers = np.array([length, r, rho, m, self.spin * rho, weight, pull])
        slide, roll = self.sliding, self.rolling
        friction = (
            *(
                FrictionContact(
                    f"ball {i + 1}", 2, Disc(slide[0]), Disc(slide[1]), -1, (i,), "sliding"
                )
                for i in range(2)
            ),
            FrictionContact(
                "rolling", 1, Interval(roll[0]), Interval(roll[1]), -1, (0, 1), "rolling"
            ),
        )
        names = ("floor1", "floor2") if self.floor else ()
        gaps = [Call(drum_formulas.floors(), (1, 2), np.array([length, r]), (0, 1), (0, 1))]
        units = np.array([rho, 1.0, length / 2, r])
        return Body(
            dumbbell_motion(),
            numbers,
            friction,
            gaps if self.floor else [],
            names,
            np.full(len(names), float(self.restitution)),
            units,
            1.0,
        )

    def _contact_family(self, reach: float) -> ContactFamily:
        names = ("length", "ball_radius", "rod_radius", "centre_radius")
        length, r, t, rho = (float(getattr(self, name)) for name in names)
        gaps = dumbbell_formulas.drum_gaps()
        reads = tuple((int(name[-1]) - 1, COORDINATES.index(name[:-1])) for name in gaps.variables)
        values = {"l": length, "r": r, "t": t, "rho": rho}
        return ContactFamily(
            gaps,
            tuple(values[name] for name in gaps.parameters),
            reads,
            tuple(_rub(contact, (length, r, t, rho)) for contact in gaps.names),
            Disc(self.rubbing[0]),
            Disc(self.rubbing[1]),
            float(self.restitution),
            reach,
        )

    @property
    def largest_step(self) -> float:
        """The longest step, in s: gravity moves a ball by a tenth of the rod radius in it."""
        return math.sqrt(2 * FREE_FALL * self.rod_radius / GRAVITY)

    def engine(
        self,
        q: ArrayLike,
        v: ArrayLike | None = None,
        *,
        dt: float = 1e-3,
        start: float = 0.0,
        noise: Noise | None = None,
        solver: Solver | None = None,
    ) -> "Engine":
        """Return an engine with the dumbbells at ``q``, carried by the drum or moving with ``v``.

        Parameters
        ----------
        q : (count, 3) or (count, 4) array
            ``phi, eta, theta`` and, if given, ``psi`` of each dumbbell.
        v : (count, 4) array, optional
            Velocities; default those of the drum, every contact sticking.
        solver : Solver, optional
            How exactly steps are solved; default to 1e-8 of the speeds, and to 1e-4 with at most
            62 sweeps for more than two dumbbells: in a heap a slip of 1e-4 of the drum's speed is
            2 mm in four hours.

        Raises
        ------
        ValueError
            If dumbbells overlap, with each other or the bottom, naming the worst.
        """
        from polycorner.motion.engine.driver import Engine

        places = self.placed(q)
        check_step(dt, self.largest_step, "in which a ball falls by a tenth of the rod's radius")
        sticking = np.ones((self.count, 3), dtype=np.bool_)
        if v is None:
            speeds = np.zeros((self.count, 4))
            speeds[:, 0] = self.spin
        else:
            speeds = np.array(v, dtype=np.float64)
            if speeds.shape != (self.count, 4) or not np.isfinite(speeds).all():
                msg = f"v: expected finite numbers of shape ({self.count}, 4); got {speeds.shape}"
                raise ValueError(msg)
            sticking[:] = (speeds == [self.spin, 0, 0, 0]).all(axis=1)[:, None]
        return Engine(
            self.bodies,
            places,
            speeds,
            sticking,
            dt,
            start=start,
            noise=noise or Noise(),
            solver=solver or (Solver() if self.count <= 2 else HEAPS),
        )

    def simulate(
        self,
        q: ArrayLike,
        duration: float,
        *,
        dt: float = 1e-3,
        every: int | None = None,
        noise: Noise | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> "Trajectory":
        """Follow the dumbbells for ``duration`` s from rest on the drum at ``q``.

        ``every``: record every so many steps, default about a thousand times.  See
        :func:`polycorner.motion.simulation.simulate`.
        """
        engine = self.engine(q, dt=dt, noise=noise)
        steps = whole_steps(duration, dt)
        return run(engine, steps, whole_stride(every, steps), progress).trajectory(self.bodies)

    def placed(self, q: ArrayLike) -> Array:
        """Return placements ``(count, 4)``, refusing what overlaps or does not lie in the drum."""
        array = np.array(q, dtype=np.float64)
        if array.ndim == 1:
            array = array[None]
        if array.shape[0] != self.count or array.ndim != 2 or array.shape[1] not in (3, 4):
            msg = (
                f"q: expected shape ({self.count}, 3) for phi, eta, theta or ({self.count}, 4) "
                f"with psi; got {array.shape}"
            )
            raise ValueError(msg)
        if not np.isfinite(array).all():
            msg = "q: expected finite numbers; got NaN or infinity"
            raise ValueError(msg)
        if array.shape[1] == 3:
            array = np.concatenate([array, np.zeros((self.count, 1))], axis=1)
        steep = np.abs(array[:, 0]).max()
        if steep >= math.pi / 2:
            msg = f"q: expected azimuths within a quarter turn, where balls press; got {steep:g}"
            raise ValueError(msg)
        self._check_ends(array)
        self._check_overlap(array)
        return array

    def _check_ends(self, q: Array) -> None:
        worst = int(np.argmax(q[:, 1]))
        if q[worst, 1] > self.top:
            msg = (
                f"top: expected a height above all dumbbells; got {self.top:g} mm, and number "
                f"{worst + 1} is at {q[worst, 1]:.6g} mm"
            )
            raise ValueError(msg)
        if not self.floor:
            return
        low = q[:, 1] - self.length / 2 * np.abs(np.cos(q[:, 2])) - self.ball_radius
        worst = int(np.argmin(low))
        if low[worst] < -OVERLAP:
            msg = (
                f"q: expected dumbbells above the bottom; number {worst + 1} overlaps it by "
                f"{-low[worst]:.6g} mm"
            )
            raise ValueError(msg)

    def _check_overlap(self, q: Array) -> None:
        reach = self.length + 2 * self.ball_radius
        worst = (0.0, 0, 0, "")
        for i in range(self.count - 1):
            rest = q[i + 1 :]
            apart = np.hypot(self.centre_radius * (rest[:, 0] - q[i, 0]), rest[:, 1] - q[i, 1])
            close = i + 1 + np.flatnonzero(apart < reach)
            if close.size:
                pairs = np.concatenate([np.tile(q[i, :3], (close.size, 1)), q[close, :3]], axis=1)
                gaps = self.pair.polyhedron.bundle.evaluate(pairs, 0)[0]
                at, name = divmod(int(np.argmin(gaps)), gaps.shape[1])
                names = dumbbell_formulas.CONTACTS
                worst = min(worst, (float(gaps.min()), i + 1, int(close[at]) + 1, names[name]))
        if worst[0] < -OVERLAP:
            msg = (
                f"q: expected dumbbells that do not overlap; numbers {worst[1]} and {worst[2]} "
                f"overlap by {-worst[0]:.6g} mm at contact {worst[3]}"
            )
            raise ValueError(msg)


def dumbbell_motion() -> equations.Formulation:
    """Return the equations of motion of one dumbbell in the drum."""
    modules = (equations.__name__, drum_formulas.__name__, dumbbell_formulas.__name__, __name__)
    return equations.Formulation(COORDINATES, PARAMETERS, _laws, 5, 2, source_key(*modules))


def _laws() -> equations.Laws:
    grip = drum_formulas.grip()
    slips = ("slip1_r", "slip1_s", "slip2_r", "slip2_s", "spin")
    return equations.Laws(
        drum_formulas.kinetic().expression("kinetic"),
        drum_formulas.weight().expression("potential"),
        {},
        tuple(grip.expression(name) for name in slips),
        tuple(grip.expression(name) for name in ("load1", "load2")),
    )


def _rub(
    contact: str, lengths: tuple[float, float, float, float]
) -> tuple[Family, bool, tuple[float, ...]]:
    """Return the slip at a contact: its family, whether bodies are exchanged, its parameters."""
    ends = {"1": -1.0, "2": 1.0}
    balls = [ends[c] for c in contact if c in ends]
    if len(balls) == 2:
        return drum_formulas.rubs("ball_ball"), False, (*lengths, *balls)
    if balls:
        swapped = contact.startswith("a")  # the ball belongs to the second dumbbell
        return drum_formulas.rubs("ball_rod"), swapped, (*lengths, balls[0], 0.0)
    return drum_formulas.rubs("rod_rod"), False, (*lengths, 0.0, 0.0)


def _coefficients(name: str, value: Any) -> Pair:
    try:
        static, dynamic = (float(x) for x in value)
    except (TypeError, ValueError) as error:
        msg = f"{name}: expected the static and the dynamic coefficient; got {value!r}"
        raise TypeError(msg) from error
    if not 0 <= dynamic <= static < math.inf:
        msg = f"{name}: expected 0 <= dynamic <= static; got static {static:g}, dynamic {dynamic:g}"
        raise ValueError(msg)
    return static, dynamic

"""The mechanical system of [GMBN]: dumbbells in a slowly rotating, tilted drum.

Each dumbbell has four coordinates: azimuth ``phi``, axial position ``eta``, heading ``theta`` and
the spin ``psi`` about its own axis; balls and rod are one rigid axle.  Dry friction acts between
balls and drum and between dumbbells that touch, and a torque of its own resists rolling; keel
effect, zigzag and climbing follow from these.  Units: mm, g, s, rad; energies in
g mm^2/s^2 = nJ.
"""

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells import formulas as dumbbell_formulas
from polycorner.dumbbells.drum_motion import COORDINATES, imperfect_body, perfect_motion, rub
from polycorner.dumbbells.imperfections import (
    Imperfections,
    OutOfRound,
    Shaking,
    UnevenFriction,
    Wobble,
)
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.motion import Attraction, Disc, Interval, MechanicalSystem, State
from polycorner.toolkit import (
    SHORTEST_STEP,
    Array,
    Call,
    FrictionContact,
    IdenticalBodies,
    MovingBody,
    PairContacts,
    PairLaw,
    about,
    cached_property,
    checked,
    flag,
    real,
    reals,
    refuse,
    whole,
)

if TYPE_CHECKING:
    from polycorner.motion import Trajectory

GRAVITY = 9806.65  # mm/s^2
FREE_FALL = 0.1  # part of the rod radius by which a ball may fall within one step
OVERLAP = 1e-6  # mm up to which a start counts as touching

Pair = tuple[float, float]


@dataclass(frozen=True)
class DumbbellDrum(MechanicalSystem):
    """Dumbbells in a rotating drum, a system for :func:`~polycorner.motion.simulation.simulate`.

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
        Coefficient of Poisson's law of impact between dumbbells and with the bottom.
    ball_mass : float
        In g.  It scales energies and forces and leaves motion as it is.
    floor : bool
        Whether the drum has a flat bottom at ``eta = 0``.
    top : float
        Where the drum ends, in mm: a dumbbell whose centre passes it has left; ``inf``: never.
    cohesion, adhesion : float
        Force over the weight of a dumbbell with which dumbbells that touch attract each other, at
        each contact, and with which the wall attracts a dumbbell, half at each ball.
    attraction_range : float
        Gap in mm at which they vanish (:class:`~polycorner.motion.Attraction`).
    shaking, out_of_round, wobble, uneven_friction : optional
        :class:`Shaking`, :class:`OutOfRound`, :class:`Wobble` and :class:`UnevenFriction`, the
        imperfections of a real drum; none by default.

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
    cohesion: float = 0.0
    adhesion: float = 0.0
    attraction_range: float = 0.05
    shaking: Shaking | None = None
    out_of_round: OutOfRound | None = None
    wobble: Wobble | None = None
    uneven_friction: UnevenFriction | None = None

    def __post_init__(self) -> None:
        _ = self.pair  # checks the lengths
        whole("count", self.count, least=1)
        for name in ("sliding", "rolling", "rubbing"):
            object.__setattr__(self, name, _coefficients(name, getattr(self, name)))
        real("tilt", self.tilt, above=-math.pi / 2, below=math.pi / 2, unit="rad")
        most = math.tau / SHORTEST_STEP  # one turn in the shortest step
        real("spin", self.spin, least=-most, most=most, unit="rad/s")
        real("restitution", self.restitution, least=0, most=1)
        real("ball_mass", self.ball_mass, above=0, unit="g")
        real("cohesion", self.cohesion, least=0)
        real("adhesion", self.adhesion, least=0)
        real("attraction_range", self.attraction_range, above=0, most=self.rod_radius, unit="mm")
        real("top", self.top, above=0, infinite=True, unit="mm")
        flag("floor", self.floor)
        self.imperfections.check(self.tilt, self.centre_radius)
        super().__post_init__()

    @property
    def imperfections(self) -> Imperfections:
        """The imperfections of the drum together."""
        return Imperfections(self.shaking, self.out_of_round, self.wobble, self.uneven_friction)

    @cached_property
    def pair(self) -> DumbbellPair:
        """Two of the dumbbells in the drum when it is level and still."""
        lengths = (self.length, self.ball_radius, self.rod_radius, self.drum_radius)
        pair = DumbbellPair(*lengths)
        if pair.is_plane:
            msg = "drum_radius: expected a finite length in mm; got inf"
            raise ValueError(msg)
        return pair

    @checked
    def attraction(self, share: float) -> Attraction | None:
        """Return the attraction by a share of the weight of a dumbbell; None if it is 0."""
        force = real("share", share, least=0) * 2 * self.ball_mass * GRAVITY
        with about("share"):
            return Attraction(force, self.attraction_range) if share else None

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
            contacts=self._pair_contacts(reach) if self.count > 1 else None,
            position=(0, 1),
            substrate_speed=self.spin * self.centre_radius,
            exit_coordinate=1 if math.isfinite(self.top) else -1,
            exit_limit=self.top if math.isfinite(self.top) else 0.0,
        )

    @cached_property
    def _body(self) -> MovingBody:
        length, r, rho = self.length, self.ball_radius, self.centre_radius
        m, g = self.ball_mass, GRAVITY
        weight, pull = m * g * math.cos(self.tilt), m * g * math.sin(self.tilt)
        numbers = [length, r, rho, m, self.spin * rho, weight, pull]
        numbers += [self.adhesion * m * g] if self.adhesion else []
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
        body = MovingBody(
            perfect_motion(bool(self.adhesion)),
            np.array(numbers),
            friction,
            gaps if self.floor else [],
            names,
            np.full(len(names), float(self.restitution)),
            units,
            1.0,
        )
        if self.imperfections == Imperfections():
            return body
        driven = (self.spin, self.ball_mass, GRAVITY, self.tilt)
        return imperfect_body(body, self.imperfections, rho, driven)

    def _pair_contacts(self, reach: float) -> PairContacts:
        names = ("length", "ball_radius", "rod_radius", "centre_radius")
        length, r, t, rho = (float(getattr(self, name)) for name in names)
        gaps = dumbbell_formulas.drum_gaps()
        reads = tuple((int(name[-1]) - 1, COORDINATES.index(name[:-1])) for name in gaps.variables)
        values = {"l": length, "r": r, "t": t, "rho": rho}
        return PairContacts(
            gaps,
            tuple(values[name] for name in gaps.parameters),
            reads,
            tuple(rub(contact, (length, r, t, rho)) for contact in gaps.names),
            (PairLaw(2, Disc(self.rubbing[0]), Disc(self.rubbing[1])),),
            float(self.restitution),
            reach,
            self.attraction(self.cohesion),
        )

    @checked
    def largest_step(self, state: State) -> tuple[float, str]:
        """Return the time in which gravity moves a ball by a tenth of the rod radius.

        In a drum that is shaken it is the effective gravity, and a step is at most a tenth of the
        shortest period.
        """
        del state  # it is the same everywhere in the drum
        shaking = self.shaking
        gravity = GRAVITY + (shaking.peak if shaking is not None else 0.0)
        longest = math.sqrt(2 * FREE_FALL * self.rod_radius / gravity)
        if shaking is not None and shaking.longest_step < longest:
            return shaking.longest_step, "a tenth of the shortest period of shaking"
        return longest, "in which a ball falls by a tenth of rod_radius"

    def described(self) -> dict[str, Any]:
        """Return the parameters of the drum by name."""
        return asdict(self)

    @checked
    def state(self, q: ArrayLike, v: ArrayLike | None = None, time: float = 0.0) -> State:
        """Return a state of the dumbbells, after checking that nothing overlaps.

        Parameters
        ----------
        q : (count, 3) or (count, 4) array
            ``phi, eta, theta`` and, if given, ``psi`` of each dumbbell.
        v : (count, 4) array, optional
            Velocities; default those of the drum, every contact sticking.
        time : float, optional
            In s.

        Raises
        ------
        ValueError
            If dumbbells overlap, with each other or the bottom, naming the worst.
        """
        places = self.placed(q)
        carried = np.array([self.spin, 0.0, 0.0, 0.0])
        speeds = np.tile(carried, (self.count, 1)) if v is None else np.array(reals("v", v))
        if speeds.shape != (self.count, 4) or not np.isfinite(speeds).all():
            refuse("v", f"finite numbers of shape ({self.count}, 4)", speeds.shape)
        at_rest = (speeds == carried).all(axis=1)
        return State(real("time", time), places, speeds, np.repeat(at_rest[:, None], 3, axis=1))

    @checked
    def check_placement(self, q: Array) -> None:
        """Raise ValueError if dumbbells overlap or do not lie in the drum, naming the worst."""
        self.placed(q)

    @checked
    def placed(self, q: ArrayLike) -> Array:
        """Return placements ``(count, 4)`` after checking that they lie in the drum and apart."""
        array = np.array(reals("q", q))
        if array.ndim == 1:
            array = array[None]
        if array.ndim != 2 or array.shape[0] != self.count or array.shape[1] not in (3, 4):
            refuse(
                "q",
                f"shape ({self.count}, 3) for phi, eta, theta or ({self.count}, 4) with psi",
                array.shape,
            )
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
        gap, (i, j), name = self.bodies.least_pair_gap(q)
        if gap < -OVERLAP:
            msg = (
                f"q: expected dumbbells that do not overlap; numbers {i + 1} and {j + 1} overlap "
                f"by {-gap:.6g} mm at contact {name}"
            )
            raise ValueError(msg)


def drum_of(trajectory: "Trajectory") -> DumbbellDrum:
    """Return the drum of a trajectory, or raise TypeError for that of another system."""
    if not isinstance(trajectory.system, DumbbellDrum):
        got = type(trajectory.system).__name__
        msg = f"trajectory: expected one of dumbbells in a drum; got one of a {got}"
        raise TypeError(msg)
    return trajectory.system


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

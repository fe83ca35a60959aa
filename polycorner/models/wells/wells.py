r"""Potential wells of a point mass on a line, of the three kinds of [GMBN] app. C.

::

      U            half-U        half-V
    \     /        |     /       |    /
     \   /         |    /        |  /
      `-'          |.-'          |/
       0           0             0

A wall at 0 dissipates energy by its restitution; the well ends at the rim.  The law of dissipation
is the same in all wells: viscous drag ``-c v``, dry friction of constant size, or both.

Capture times without noise are given here in closed form, escape times with noise in
:mod:`polycorner.models.wells.escape`.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.checks import reals
from polycorner.minimisation import Entrapment
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.arguments import scalar
from polycorner.spaces.manifold import Array, Manifold
from polycorner.values import Value, cached_property

if TYPE_CHECKING:
    import sympy

    from polycorner.motion.system import System

KINDS = (Entrapment.U, Entrapment.HALF_U, Entrapment.HALF_V)


@dataclass(frozen=True)
class Flight(Value):
    """A motion from 0 up and back, without drag.

    Attributes
    ----------
    duration : float
        Time until it is back at 0 or at rest on the way.
    height : float
        The largest ``x``.
    speed : float
        Speed of return; 0 where friction holds it.
    place : float
        Final position: 0, or where friction holds it.
    """

    duration: float
    height: float
    speed: float
    place: float


@dataclass(frozen=True)
class Well(Value):
    """A point mass on a line with the energy ``V(x) = slope |x| + stiffness x^2 / 2``.

    With a wall at ``x = 0`` the mass stays in ``0 <= x``, otherwise on the whole line; the well
    ends at ``|x| = rim``.  Units are free; those of a dyad are mm, g and s.

    Parameters
    ----------
    slope : float
        Force at the wall; 0 without one.
    stiffness : float
    rim : float, optional
        End of the well; default 1.
    wall : bool, optional
        Default True.
    mass : float, optional
        Default 1.
    drag : float, optional
        Viscous force per speed; default 0.
    friction : float, optional
        Size of the force of dry friction; default 0.
    restitution : float, optional
        Restitution of the wall; default 0, no rebound.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.

    Examples
    --------
    >>> [Well.of_depth(kind, 2.0, rim=4.0).potential(2.0) for kind in KINDS]
    [0.5, 0.5, 1.0]
    """

    slope: float
    stiffness: float
    rim: float = 1.0
    wall: bool = True
    mass: float = 1.0
    drag: float = 0.0
    friction: float = 0.0
    restitution: float = 0.0

    def __post_init__(self) -> None:
        for name in (f.name for f in fields(self) if f.name != "wall"):
            object.__setattr__(self, name, _number(name, getattr(self, name)))
        for name in ("rim", "mass"):
            if not getattr(self, name) > 0:
                msg = f"{name}: expected a positive number; got {getattr(self, name):g}"
                raise ValueError(msg)
        if self.slope == 0 and self.stiffness == 0:
            msg = "slope, stiffness: expected one of them positive; got 0 and 0"
            raise ValueError(msg)
        if self.slope > 0 and not self.wall:
            msg = f"slope: expected 0 without a wall, where V is smooth; got {self.slope:g}"
            raise ValueError(msg)
        if self.restitution > 1:
            msg = f"restitution: expected a number from 0 to 1; got {self.restitution:g}"
            raise ValueError(msg)

    @classmethod
    def of_depth(cls, kind: Entrapment, depth: float, rim: float = 1.0, **others: float) -> "Well":
        """Return the well of a kind whose energy at the rim is ``depth``."""
        if kind not in KINDS:
            checks.refuse("kind", "U, half-U or half-V", kind)
        slope = depth / rim if kind is Entrapment.HALF_V else 0.0
        stiffness = 0.0 if kind is Entrapment.HALF_V else 2 * depth / rim**2
        return cls(slope, stiffness, rim, kind is not Entrapment.U, **others)

    @property
    def kind(self) -> Entrapment:
        """Half-V with a force at the wall, half-U without such a force, U without a wall."""
        if not self.wall:
            return Entrapment.U
        return Entrapment.HALF_V if self.slope > 0 else Entrapment.HALF_U

    @property
    def depth(self) -> float:
        """Energy at the rim."""
        return float(self.potential(self.rim))

    def potential(self, x: ArrayLike) -> Any:
        """Return ``V(x)``."""
        away = abs(reals("x", x))
        return scalar(self.slope * away + self.stiffness * away**2 / 2)

    @property
    def frequency(self) -> float:
        """``sqrt(stiffness / mass)``, radians per time."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def kept(self) -> float:
        """The share of its speed with which the mass leaves 0; without a wall it passes."""
        return self.restitution if self.wall else 1.0

    @property
    def time_step(self) -> float:
        """Time step for simulations, short compared with the time scales of the well."""
        times = [self.rim * math.sqrt(self.mass / self.depth)]
        if self.drag > 0:
            times.append(self.mass / self.drag)
        return 0.02 * min(times)

    def temperature(self, kick: float) -> float:
        """Return the temperature, an energy, at which drag balances white noise: ``kick^2 / 2c``.

        ``kick`` is as in :class:`~polycorner.motion.noise.Noise`: ``<dv^2> = (kick / mass)^2 t``.
        Dry friction and the wall's losses are not in this balance and cool the mass further.
        """
        return kick**2 / (2 * self.drag) if self.drag > 0 else math.inf

    # ---------------------------------------------------------------------------------- as a system

    @cached_property
    def manifold(self) -> Manifold:
        """The line; lengths are measured in rims."""
        return Manifold(("x",), (math.inf,), (self.rim,))

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """The admissible positions: ``wall: x >= 0``, and inside the ``rim``.

        The rim is no body; a simulation ends there.
        """
        (x,) = self.manifold.symbols
        if not self.wall:
            return Polyhedron(self.manifold, {"rim": (self.rim**2 - x**2) / (2 * self.rim)})
        return Polyhedron(self.manifold, {"wall": x, "rim": self.rim - x})

    @property
    def energy(self) -> "sympy.Expr":
        """``V`` as an expression in ``x``; ``|x|`` is ``x`` where there is a wall."""
        (x,) = self.manifold.symbols
        return self.slope * x + self.stiffness * x**2 / 2

    @cached_property
    def system(self) -> "System":
        """The mass with its wall, drag and friction; reaching ``rim`` is a contact."""
        from polycorner.motion.contacts import Friction, velocities
        from polycorner.motion.friction import Interval
        from polycorner.motion.system import System

        (v,) = velocities(self.manifold)
        rubbing = Friction("friction", (v,), Interval(1.0), self.friction + 0 * v)
        return System(
            self.polyhedron,
            self.mass * v**2 / 2,
            self.energy,
            forces={"x": -self.drag * v} if self.drag > 0 else {},
            friction=(rubbing,) if self.friction > 0 else (),
            restitution={"wall": self.restitution} if self.wall else {},
        )

    def starts(self, rng: np.random.Generator, count: int) -> Array:
        """Return ``count`` places in the well, uniformly distributed, ``(count, 1)``."""
        return rng.uniform(0.0 if self.wall else -self.rim, self.rim, (count, 1))

    # -------------------------------------------------------------------------------------- capture

    def flight(self, speed: float) -> Flight:
        """Return the flight that leaves 0 with a given speed.

        For no drag; the rim is not looked at.  Up the forces ``slope + friction`` and the spring
        slow it down, and down ``slope - friction`` and the spring drive it.
        """
        self.check_no("drag")
        if not 0 < speed < math.inf:
            msg = f"speed: expected a positive number; got {speed:g}"
            raise ValueError(msg)
        up, height = _rise(speed, self.slope + self.friction, self.stiffness, self.mass)
        down, back, place = _fall(height, self.slope - self.friction, self.stiffness, self.mass)
        return Flight(up + down, height, back, place)

    def flights(self, speed: float) -> Iterator[Flight]:
        """Yield successive flights until the mass comes to rest, or without end."""
        while speed > 0:
            flight = self.flight(speed)
            yield flight
            speed = self.kept * flight.speed

    def capture(self, speed: float) -> tuple[float, float]:
        """Return when and where the mass that leaves 0 with a speed comes to rest, without drag.

        - half-V: after ``2 m v / (f (1 - e))``, at the wall; with friction also, if ``F < f``.
        - half-U: an absorbing wall takes ``pi / omega``; one that absorbs in part leaves motion for
          ever, smaller by ``e`` each ``pi / omega``.
        - U: never.
        - half-U and U with friction: within ``|x| <= F / k``, after finitely many flights.

        Raises
        ------
        ValueError
            If there is drag, or the speed reaches the rim.
        """
        if speed == 0:
            return 0.0, 0.0
        if (top := self.flight(speed).height) > self.rim * (1 + 1e-12):
            msg = f"speed: expected one that stays below the rim {self.rim:g}; it gets to {top:g}"
            raise ValueError(msg)
        lossless = self.friction == 0 and self.kept == 1
        if lossless or (self.slope == 0 and self.friction == 0 and self.kept > 0):
            return math.inf, math.nan
        total, place = 0.0, 0.0
        for flight in self.flights(speed):
            total, place = total + flight.duration, flight.place
            if flight.duration <= 1e-17 * total:
                break
        return total, place

    def capture_speed(self) -> float:
        """Return the largest inward speed at the rim with which the mass stays, without drag.

        Its energy after the first bounce must not lift it to the rim again, against friction:
        ``m u^2 / 2 <= (D + F a) / e^2 - D + F a``; without a wall it must be used up by friction.
        """
        self.check_no("drag")
        if self.kept == 0:
            return math.inf
        loss = self.friction * self.rim
        return math.sqrt(2 / self.mass * ((self.depth + loss) / self.kept**2 - self.depth + loss))

    def check_no(self, name: str) -> None:
        """Raise for a well with drag or friction where the closed form excludes it."""
        if getattr(self, name) > 0:
            msg = f"{name}: expected 0, for there is no closed form; got {getattr(self, name):g}"
            raise ValueError(msg)


def _rise(speed: float, force: float, stiffness: float, mass: float) -> tuple[float, float]:
    """Return time and height until a force and a spring have stopped a mass."""
    if stiffness == 0:
        return mass * speed / force, mass * speed**2 / (2 * force)
    omega = math.sqrt(stiffness / mass)
    reach, centre = speed / omega, force / stiffness
    return math.atan2(reach, centre) / omega, reach**2 / (math.hypot(reach, centre) + centre)


def _fall(height: float, force: float, stiffness: float, mass: float) -> tuple[float, float, float]:
    """Return time, speed and place of a mass that comes down from rest; the force may be < 0."""
    if force + stiffness * height <= 0:
        return 0.0, 0.0, height
    if stiffness == 0:
        return math.sqrt(2 * height * mass / force), math.sqrt(2 * height * force / mass), 0.0
    omega, centre = math.sqrt(stiffness / mass), force / stiffness
    if height + 2 * centre < 0:
        return math.pi / omega, 0.0, -height - 2 * centre
    back = math.sqrt(height * (height + 2 * centre))
    return math.atan2(back, centre) / omega, omega * back, 0.0


def _number(name: str, value: object) -> float:
    return checks.real(name, value, least=0)

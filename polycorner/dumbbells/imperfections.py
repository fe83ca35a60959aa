"""Imperfections of a real drum: shaking, a wall that is out of round, wobble, uneven friction.

Each has a strength with a unit, and a correlation time or length, so that motions converge as the
step is shortened.  Azimuths that turn with the drum are ``phi - omega t``.  Lengths are in mm,
times in s, angles in rad.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np

from polycorner.toolkit import (
    Array,
    Checked,
    check_band,
    field_modes,
    instance,
    mapping,
    real,
    refuse,
    signal_modes,
    whole,
)

AXES = ("across", "along", "up")
SIGNAL_MODES, FIELD_MODES = 16, 32
HIGHEST = 64  # harmonic of a wall that is out of round
RESOLVED = 0.1  # part of the shortest period of shaking that a step may last
PEAK = 3.0  # multiple of the root mean square that counts as the largest acceleration
STEEPEST = 0.5  # slope of a wall out of round up to which formulas of first order are taken
SHAKING, UNEVEN_FRICTION = 1, 2  # kinds of random numbers that one and the same seed makes


class Imperfection(Checked):
    """Base of what makes a drum imperfect."""

    def described(self) -> dict[str, Any]:
        """Return the parameters by name, as plain values; see :meth:`restored`."""
        return asdict(self)  # type: ignore[call-overload, no-any-return]  # all are dataclasses

    @classmethod
    def restored(cls, told: Mapping[str, Any]) -> Self:
        """Return the imperfection that was described, also after a passage through JSON."""
        return cls(**{n: tuple(x) if isinstance(x, list) else x for n, x in told.items()})


@dataclass(frozen=True)
class Shaking(Imperfection):
    """Accelerations of the whole drum, as by its motor, its bearings or the floor.

    In the frame of the drum they are an effective gravity: the force ``-m a`` on every ball, and
    changed loads on the wall.  Each component is a
    :func:`~polycorner.motion.random_functions.random_signal`.

    Parameters
    ----------
    rms : (float, float, float)
        Root mean squares of the accelerations in mm/s^2: across (horizontal, towards growing
        azimuth), along the axis (towards growing ``eta``), and up (perpendicular to both).
    band : (float, float)
        Least and greatest frequency in Hz.
    seed : int, optional
    """

    rms: tuple[float, float, float]
    band: tuple[float, float]
    seed: int = 0

    def __post_init__(self) -> None:
        try:
            given = tuple(self.rms)
        except TypeError:
            given = ()
        if len(given) != len(AXES):
            refuse("rms", "three accelerations in mm/s^2: across, along, up", self.rms, TypeError)
        values = tuple(real("rms", value, least=0, unit="mm/s^2") for value in given)
        object.__setattr__(self, "rms", values)
        object.__setattr__(self, "band", check_band(self.band))
        whole("seed", self.seed, least=0)
        super().__post_init__()

    @property
    def peak(self) -> float:
        """The acceleration in mm/s^2 that is exceeded rarely: three times the root mean square."""
        return PEAK * math.hypot(*self.rms)

    @property
    def longest_step(self) -> float:
        """A tenth of the period of the greatest frequency, in s."""
        return RESOLVED / self.band[1]

    @property
    def numbers(self) -> list[float]:
        """For each axis the amplitude of a mode, frequencies and phases of all modes."""
        found: list[float] = []
        for axis, rms in enumerate(self.rms):
            rng = np.random.default_rng([self.seed, SHAKING, axis])
            frequencies, phases = signal_modes(self.band, SIGNAL_MODES, rng)
            found += [rms * math.sqrt(2 / SIGNAL_MODES), *frequencies.tolist(), *phases.tolist()]
        return found


@dataclass(frozen=True)
class OutOfRound(Imperfection):
    """A wall whose radius varies around the drum, ``R + sum_k a_k cos(k (phi - omega t) + p_k)``.

    To first order in ``a / R`` it changes the heights of the balls' centres, hence the forces, and
    the direction of the wall, hence the loads and the slope under each ball.  A harmonic ``k = 1``
    is a drum whose axis is not in the middle, ``k = 2`` an oval one.  Neglected are changes of
    velocities and of gaps between dumbbells of order ``a / R``, and the inertia of the radial
    motion.

    Parameters
    ----------
    amplitudes : mapping from int to float
        ``a_k`` in mm, by harmonic ``k >= 1``.
    phases : mapping from int to float, optional
        ``p_k`` in rad; default 0.
    """

    amplitudes: Mapping[int, float]
    phases: Mapping[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        amplitudes = _by_harmonic("amplitudes", self.amplitudes, "mm")
        phases = _by_harmonic("phases", self.phases, "rad")
        if not amplitudes:
            refuse("amplitudes", "at least one harmonic", self.amplitudes)
        if not phases.keys() <= amplitudes.keys():
            refuse("phases", f"harmonics among {sorted(amplitudes)}", sorted(phases))
        object.__setattr__(self, "amplitudes", amplitudes)
        object.__setattr__(self, "phases", phases)
        super().__post_init__()

    def __hash__(self) -> int:
        return hash((tuple(self.amplitudes.items()), tuple(self.phases.items())))

    @property
    def steepest(self) -> float:
        """Bound of the change of the radius per radian, in mm."""
        return sum(k * abs(a) for k, a in self.amplitudes.items())

    @property
    def numbers(self) -> list[float]:
        """Harmonic, amplitude and phase of each term."""
        terms = self.amplitudes.items()
        return [x for k, a in terms for x in (float(k), a, self.phases.get(k, 0.0))]

    @classmethod
    def restored(cls, told: Mapping[str, Any]) -> Self:
        """Return the imperfection that was described; keys may be strings, as in JSON."""
        return cls(**{name: {int(k): x for k, x in part.items()} for name, part in told.items()})


@dataclass(frozen=True)
class Wobble(Imperfection):
    """A drum whose axis is inclined against its axis of rotation.

    The tilt is ``alpha + beta cos(omega t + gamma)``.  The drum's axis also swings from side to
    side, by ``beta``; what is neglected are velocities and accelerations of that precession, of
    order ``beta omega eta`` and ``beta omega^2 eta``.

    Parameters
    ----------
    angle : float
        ``beta``, in rad.
    phase : float, optional
        ``gamma``, in rad; default 0.
    """

    angle: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        real("angle", self.angle, least=0, below=math.pi / 2, unit="rad")
        real("phase", self.phase, unit="rad")
        super().__post_init__()

    @property
    def numbers(self) -> list[float]:
        """Angle and phase."""
        return [float(self.angle), float(self.phase)]


@dataclass(frozen=True)
class UnevenFriction(Imperfection):
    """Friction of the wall that differs from place to place and turns with the wall.

    The coefficients of sliding and of rolling at a place are those of the drum times
    ``max(0, 1 + f)``, where ``f`` is a
    :func:`~polycorner.motion.random_functions.random_field` on the developed wall, periodic around
    the drum.  Each ball has the factor of the place of its centre.

    Parameters
    ----------
    rms : float
        Root mean square of ``f``, relative to 1.
    correlation_length : float
        ``L`` in mm; the covariance of ``f`` at the distance ``d`` is ``rms^2 exp(-d^2/(2 L^2))``.
    seed : int, optional
    """

    rms: float
    correlation_length: float
    seed: int = 0

    def __post_init__(self) -> None:
        real("rms", self.rms, least=0)
        real("correlation_length", self.correlation_length, above=0, unit="mm")
        whole("seed", self.seed, least=0)
        super().__post_init__()

    def numbers(self, circumference: float) -> list[float]:
        """Amplitude of a mode; for each mode waves around, wave number along, phase."""
        rng = np.random.default_rng([self.seed, UNEVEN_FRICTION])
        modes: tuple[Array, ...] = field_modes(
            self.correlation_length, circumference, FIELD_MODES, rng
        )
        amplitude = float(self.rms) * math.sqrt(2 / FIELD_MODES)
        return [amplitude, *np.stack(modes, axis=1).ravel().tolist()]


class Imperfections(NamedTuple):
    """The imperfections of one drum."""

    shaking: Shaking | None = None
    out_of_round: OutOfRound | None = None
    wobble: Wobble | None = None
    uneven_friction: UnevenFriction | None = None

    def check(self, tilt: float, centre_radius: float) -> None:
        """Raise TypeError or ValueError for what a drum of this tilt and radius cannot have."""
        for name, kind in KINDS.items():
            if getattr(self, name) is not None:
                instance(name, getattr(self, name), kind)
        if self.wobble is not None and abs(tilt) + self.wobble.angle >= math.pi / 2:
            refuse("wobble", "a tilt that remains below a quarter turn", self.wobble.angle)
        if self.out_of_round is not None:
            slope = self.out_of_round.steepest / centre_radius
            if slope > STEEPEST:
                refuse("out_of_round", f"a wall with slopes below {STEEPEST:g}", slope)

    def described(self) -> dict[str, dict[str, Any]]:
        """Return the parameters of those that there are, by name, as plain values."""
        found = self._asdict()
        return {name: x.described() for name, x in found.items() if x is not None}


KINDS: dict[str, type[Imperfection]] = {
    "shaking": Shaking,
    "out_of_round": OutOfRound,
    "wobble": Wobble,
    "uneven_friction": UnevenFriction,
}


def _by_harmonic(argument: str, value: object, unit: str) -> dict[int, float]:
    given = mapping(argument, value)
    found = {
        whole(argument, k, least=1, most=HIGHEST): real(argument, x, unit=unit)
        for k, x in given.items()
    }
    return dict(sorted(found.items()))

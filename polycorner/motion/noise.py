"""Seeded noise, and how exactly steps are solved: what a simulation is told besides its system."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real


@dataclass(frozen=True)
class Solver:
    """How exactly the inclusion of each step is solved.

    Parameters
    ----------
    tolerance : float, optional
        Largest residual of a step, relative to the speeds in it; default 1e-8.  A step that
        misses it is counted in ``Effort.unconverged``, with the worst residual.
    sweeps : int, optional
        Most Gauss-Seidel sweeps over one island of touching bodies; default 2000.
    """

    tolerance: float = 1e-8
    sweeps: int = 2000

    def __post_init__(self) -> None:
        if not isinstance(self.tolerance, Real) or not 0 < float(self.tolerance) < 1:
            msg = f"tolerance: expected a number between 0 and 1; got {self.tolerance!r}"
            raise ValueError(msg)
        if isinstance(self.sweeps, bool) or not isinstance(self.sweeps, int) or self.sweeps < 1:
            msg = f"sweeps: expected a positive whole number; got {self.sweeps!r}"
            raise ValueError(msg)


@dataclass(frozen=True)
class Noise:
    """Chattering loads and random impulses.

    A substrate that is not quite smooth presses irregularly.  *Chatter*: every known load ``N`` is
    multiplied by ``max(0, 1 + A xi)`` with ``xi`` standard normal, independent for each body and
    load, held for a correlation time and then drawn anew.  What is held by less than its full
    friction slips now and then: these are the slippages of [GMBN] sec. 3.  *Kicks*: white noise
    forces, impulses ``sigma sqrt(h) xi`` in each step of length ``h``.

    Each number is a function of the seed, the time, the body and the place (SplitMix64,
    [Steele]): a run resumed in the middle meets the same noise.

    Parameters
    ----------
    chatter : float, optional
        Amplitude ``A >= 0`` of the loads' relative fluctuation; default 0.
    correlation_time : float, optional
        How long a draw is held, in s; default 0.01.
    kicks : mapping from str to float, optional
        ``sigma`` by coordinate: a coordinate of mass ``m`` diffuses in velocity with
        ``<dv^2> = (sigma / m)^2 t``.
    seed : int, optional
        Any whole number from 0 to 2^63 - 1; default 0.
    """

    chatter: float = 0.0
    correlation_time: float = 0.01
    kicks: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0

    def __post_init__(self) -> None:
        for name, least in (("chatter", 0.0), ("correlation_time", 1e-12)):
            value = getattr(self, name)
            if not isinstance(value, Real) or not least <= float(value) < float("inf"):
                expected = "a number not below 0" if least == 0 else "a positive time in s"
                msg = f"{name}: expected {expected}; got {value!r}"
                raise ValueError(msg)
        for name, value in self.kicks.items():
            if not isinstance(value, Real) or not 0 <= float(value) < float("inf"):
                msg = f"kicks: expected a number not below 0 for {name!r}; got {value!r}"
                raise ValueError(msg)
        whole = isinstance(self.seed, int) and not isinstance(self.seed, bool)
        if not whole or not 0 <= self.seed < 2**63:
            msg = f"seed: expected a whole number from 0 to 2^63 - 1; got {self.seed!r}"
            raise ValueError(msg)

"""Random signals and fields as formulas: sums of cosines with random phases ([Shinozuka])."""

import math
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.checks import real, refuse, whole
from polycorner.formulas.expressions import as_expression
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array

if TYPE_CHECKING:
    import sympy

TAIL = 9.0  # standard deviations of the wave numbers that are drawn


@checked
def random_signal(
    time: Any, *, rms: float, band: tuple[float, float], modes: int = 16, seed: int = 0
) -> "sympy.Expr":
    """Return a stationary random signal ``s(t) = rms sqrt(2/K) sum_k cos(2 pi f_k t + p_k)``.

    Its spectrum is flat in the band: the band is divided into ``K`` equal parts, with one frequency
    drawn in each; phases are uniform.  The mean square over time is exactly ``rms^2``, and values
    are the nearer to Gaussian the more modes there are (kurtosis ``3 - 3 / (2 K)``).  Over many
    seeds the covariance is that of the band,
    ``rms^2 (sin(2 pi f_2 u) - sin(2 pi f_1 u)) / (2 pi (f_2 - f_1) u)`` at the lag ``u``.  One
    signal has ``K`` lines: it is correlated with itself, by about ``1 / sqrt(K)``, also after times
    that are long against ``K / (f_2 - f_1)``.

    Parameters
    ----------
    time : sympy.Expr or number
        Such as :func:`~polycorner.motion.contacts.time_symbol`, in s.
    rms : float
        Root of the mean square, in any unit.
    band : (float, float)
        Least and greatest frequency ``f_1 < f_2``, in Hz.
    modes : int, optional
        ``K``; default 16.
    seed : int, optional

    Examples
    --------
    >>> from polycorner.motion import time_symbol
    >>> random_signal(time_symbol(), rms=0.5, band=(2.0, 3.0), modes=2)
    0.5*cos(14.567*time + 0.2574) + 0.5*cos(16.556*time + 0.1038)
    """
    whole("modes", modes, least=1)
    time = as_expression("time", time)
    frequencies, phases = signal_modes(band, modes, random_generator(seed))
    turns = [
        2 * math.pi * f * time + p
        for f, p in zip(frequencies.tolist(), phases.tolist(), strict=True)
    ]
    return sum_of_cosines(real("rms", rms, least=0) * math.sqrt(2 / modes), turns)


@checked
def random_field(
    x: Any,
    y: Any,
    *,
    rms: float,
    correlation_length: float,
    circumference: float = math.inf,
    modes: int = 32,
    seed: int = 0,
) -> "sympy.Expr":
    """Return a homogeneous random field ``f(x, y)`` with the covariance of a Gaussian.

    ``f = rms sqrt(2/K) sum_k cos(a_k x + b_k y + p_k)`` with wave numbers drawn from the spectrum
    of ``C(d) = rms^2 exp(-d^2 / (2 L^2))``, stratified in either direction, and uniform phases.
    Over many seeds the covariance at the distance ``d`` is ``C(d)``; with a circumference ``P`` the
    field is periodic in ``x``, ``a_k P / (2 pi)`` are whole numbers, and the covariance is the sum
    of ``C`` over all periods, divided by its value at zero distance times ``rms^2``.  The mean
    square over the plane is exactly ``rms^2``.

    Parameters
    ----------
    x, y : sympy.Expr or number
        Position.
    rms : float
        Root of the mean square, in any unit.
    correlation_length : float
        ``L``, in the unit of ``x`` and ``y``.
    circumference : float, optional
        Period in ``x``; default ``inf``, none.
    modes : int, optional
        ``K``; default 32.
    seed : int, optional
    """
    whole("modes", modes, least=1)
    x, y = as_expression("x", x), as_expression("y", y)
    across, along, phases = field_modes(
        correlation_length, circumference, modes, random_generator(seed)
    )
    unit = 2 * math.pi / circumference if math.isfinite(circumference) else 1.0
    turns = [
        unit * a * x + b * y + p
        for a, b, p in zip(across.tolist(), along.tolist(), phases.tolist(), strict=True)
    ]
    return sum_of_cosines(real("rms", rms, least=0) * math.sqrt(2 / modes), turns)


def sum_of_cosines(amplitude: float, turns: "list[sympy.Expr]") -> "sympy.Expr":
    """Return ``amplitude`` times the sum of the cosines of some angles."""
    import sympy

    return amplitude * sympy.Add(*(sympy.cos(turn) for turn in turns))


def random_generator(*seeds: int) -> np.random.Generator:
    """Return the generator that belongs to a seed, and to what it is used for if that is given."""
    return np.random.default_rng([whole("seed", seed, least=0) for seed in seeds])


def check_band(band: Any) -> tuple[float, float]:
    """Return the least and the greatest frequency of a band, or raise."""
    try:
        low, high = band
    except (TypeError, ValueError):
        refuse("band", "the least and the greatest frequency in Hz", band, TypeError)
    first = real("band", low, least=0, unit="Hz")
    return first, real("band", high, above=first, unit="Hz")


def signal_modes(band: Any, modes: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return frequencies in Hz, one in each of equal parts of the band, and phases."""
    low, high = check_band(band)
    frequencies = low + (high - low) * (np.arange(modes) + rng.random(modes)) / modes
    return frequencies, rng.uniform(0, 2 * math.pi, modes)


def field_modes(
    correlation_length: float,
    circumference: float,
    modes: int,
    rng: np.random.Generator,
    *,
    finest: float = 1e-4,
) -> tuple[Array, Array, Array]:
    """Return wave numbers across and along, and phases, of a field with Gaussian covariance.

    Those across are whole numbers, of waves in a circumference, if that is finite; the correlation
    length then is at least the part ``finest`` of it.
    """
    real("circumference", circumference, above=0, infinite=True)
    periodic = math.isfinite(circumference)
    length = real("correlation_length", correlation_length, above=0)
    if periodic:
        least = finest * circumference
        real("correlation_length", length, least=least, unit="the unit of circumference")
    first, second = (_stratified(modes, rng) for _ in range(2))
    along = _normal(second) / length
    if not periodic:
        return _normal(first) / length, along, rng.uniform(0, 2 * math.pi, modes)
    spread = circumference / (2 * math.pi * length)
    most = math.ceil(TAIL * spread)
    waves = np.arange(-most, most + 1)
    weights = np.cumsum(np.exp(-0.5 * (waves / spread) ** 2))
    across = waves[np.searchsorted(weights, first * weights[-1])].astype(np.float64)
    return across, along, rng.uniform(0, 2 * math.pi, modes)


def _stratified(modes: int, rng: np.random.Generator) -> Array:
    """Return numbers in (0, 1), one in each of equal parts, in random order."""
    return np.asarray((rng.permutation(modes) + rng.uniform(1e-12, 1, modes)) / modes)


def _normal(shares: Array) -> Array:
    """Return the standard normal numbers below which these shares lie."""
    quantile = NormalDist().inv_cdf
    return np.array([quantile(share) for share in shares.tolist()])

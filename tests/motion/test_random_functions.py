"""Random signals and fields: their means, spectra and covariances, from samples."""

import math

import numpy as np
import pytest
import sympy as sp

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.motion import random_field, random_signal, simulate, time_symbol

T = time_symbol()
X, Y = sp.symbols("x y", real=True)
BAND = (3.0, 11.0)


def sampled(expression, *arrays, symbols=(T,)):
    return np.asarray(sp.lambdify(symbols, expression)(*arrays))


def test_the_mean_square_of_a_signal_is_that_stated():
    """Over a time that is long against the inverse distance of its lines."""
    times = np.arange(0, 1000, 0.02)
    for modes in (1, 2, 16):
        values = sampled(random_signal(T, rms=0.3, band=BAND, modes=modes, seed=4), times)
        assert (values**2).mean() == pytest.approx(0.09, rel=5e-3)
        assert abs(values.mean()) < 1e-3
        kurtosis = (values**4).mean() / (values**2).mean() ** 2
        assert kurtosis == pytest.approx(3 - 1.5 / modes, abs=0.05)


def test_the_power_of_a_signal_is_even_in_its_band():
    values = sampled(
        random_signal(T, rms=2.0, band=BAND, modes=16, seed=1), np.arange(0, 400, 0.01)
    )
    power = np.abs(np.fft.rfft(values * np.hanning(values.size))) ** 2
    frequency = np.fft.rfftfreq(values.size, 0.01)
    inside = (frequency > BAND[0] - 0.01) & (frequency < BAND[1] + 0.01)
    assert power[~inside].sum() < 1e-4 * power.sum()
    shares = [
        power[(frequency >= f) & (frequency < f + 0.5)].sum() / power.sum()
        for f in np.arange(*BAND, 0.5)
    ]
    assert shares == pytest.approx(np.full(16, 1 / 16), rel=0.1)


def test_over_seeds_a_signal_is_stationary_with_the_covariance_of_its_band():
    times, lags = np.arange(0, 900, 3.7), np.array([0.0, 0.02, 0.05, 0.11, 0.3])
    at = times[:, None] + lags
    paths = [sampled(random_signal(T, rms=1.0, band=BAND, seed=s), at) for s in range(30)]
    found = np.mean([path * path[:, :1] for path in paths], axis=(0, 1))
    turn = 2 * np.pi * lags[1:]
    exact = (np.sin(BAND[1] * turn) - np.sin(BAND[0] * turn)) / ((BAND[1] - BAND[0]) * turn)
    assert found == pytest.approx([1, *exact], abs=0.05)


def test_seeds_make_different_signals_and_the_same_one_the_same():
    one, two, again = (random_signal(T, rms=1.0, band=BAND, seed=s) for s in (0, 1, 0))
    assert one == again
    assert one != two


def test_an_oscillator_driven_by_a_signal_follows_the_closed_form():
    """Its response to a cosine is one: ``x'' + w^2 x = cos(v t + p)``."""
    line = Manifold.euclidean("x")
    (x,), (v,) = line.symbols, velocities(line)
    signal = random_signal(T, rms=2.0, band=(0.5, 1.5), modes=5, seed=3)
    steady = sum(
        term / (100 - sp.Poly(term.args[-1].args[0], T).nth(1) ** 2)
        for term in signal.expand().args
    )
    at = [float(sp.N(e.subs(T, 0))) for e in (steady, steady.diff(T))]
    system = System(Polyhedron(line, {"far": 1e6 - x}), v**2 / 2, 50 * x**2, {"x": signal})
    errors = []
    for dt in (4e-3, 2e-3):
        path = simulate(system, system.state([at[0]], [at[1]]), 3.0, dt)
        errors.append(abs(path.q[-1, 0, 0] - float(sp.N(steady.subs(T, 3.0)))))
    assert errors[0] / errors[1] == pytest.approx(4, abs=0.3)


LENGTH, AROUND = 6.0, 50.0


def field(seed, **options):
    given = {"rms": 0.5, "correlation_length": LENGTH, "circumference": AROUND} | options
    return random_field(X, Y, seed=seed, **given)


def test_a_field_is_periodic_around_and_has_the_mean_square_stated():
    expression = field(2)
    around = np.linspace(0, AROUND, 60, endpoint=False)
    x, y = (a.ravel() for a in np.meshgrid(around, np.linspace(0, 6000, 1501)))
    values = sampled(expression, x, y, symbols=(X, Y))
    assert (values**2).mean() == pytest.approx(0.25, rel=0.01)
    assert sampled(expression, x + 3 * AROUND, y, symbols=(X, Y)) == pytest.approx(values, abs=1e-9)


@pytest.mark.parametrize("circumference", [AROUND, math.inf, 12.0])
def test_over_seeds_the_covariance_of_a_field_is_gaussian(circumference):
    """With a period it is the sum over the periods, relative to that at zero distance."""
    steps = np.array([[0, 0], [3, 0], [0, 3], [4, 4], [-4, 4], [9, 0], [0, 9]], dtype=float)
    corners = np.random.default_rng(0).uniform(0, 3000, (500, 1, 2))
    x, y = np.moveaxis(steps + corners, -1, 0)
    fields = (field(s, rms=1.0, circumference=circumference) for s in range(30))
    values = (sampled(expression, x, y, symbols=(X, Y)) for expression in fields)
    found = np.mean([value * value[:, :1] for value in values], axis=(0, 1))
    shifts = np.arange(-40, 41) * circumference if math.isfinite(circumference) else np.zeros(1)
    square = (steps[:, :1] + shifts) ** 2 + steps[:, 1:] ** 2
    exact = np.exp(-square / (2 * LENGTH**2)).sum(axis=1)
    assert found == pytest.approx(exact / exact[0], abs=0.05)


@pytest.mark.parametrize(
    ("call", "kind", "named"),
    [
        (lambda: random_signal(T, rms=-1.0, band=BAND), ValueError, "rms"),
        (lambda: random_signal(T, rms=1.0, band=(2.0, 1.0)), ValueError, "band"),
        (lambda: random_signal(T, rms=1.0, band=3.0), TypeError, "band"),
        (lambda: random_signal(T, rms=1.0, band=BAND, modes=0), ValueError, "modes"),
        (lambda: random_signal(T, rms=1.0, band=BAND, seed=-1), ValueError, "seed"),
        (lambda: field(0, correlation_length=0.0), ValueError, "correlation_length"),
        (lambda: field(0, circumference=-1.0), ValueError, "circumference"),
    ],
)
def test_wrong_arguments_are_named(call, kind, named):
    with pytest.raises(kind, match=f"^{named}: expected"):
        call()

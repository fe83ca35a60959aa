"""Equations of motion of one dumbbell in a drum, perfect or not.

In an imperfect drum the effective gravity depends on the time, and the wall on the material angle
``phi - omega t``.  With ``W = m (g cos(tilt) + a_z)``, ``P = m (g sin(tilt) + a_y)`` and
``S = m a_x`` the energy of a ball at the azimuth ``phi_i``, on a wall that is ``delta_i`` further
out, is ``(S sin(phi_i) - W cos(phi_i)) (rho + delta_i) + P eta_i``, and it presses on the wall with

.. code-block:: text

    N_i = W cos(phi_i) - S sin(phi_i) + (delta_i' / rho) (W sin(phi_i) + S cos(phi_i))

if that is positive, else with 0; if it clings to the wall, with so much more.  What differs from
the energy of the perfect drum at rest is an applied force, so that its work is booked.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from polycorner.dumbbells import drum_formulas
from polycorner.dumbbells import formulas as dumbbell_formulas
from polycorner.dumbbells.imperfections import AXES, FIELD_MODES, SIGNAL_MODES, Imperfections
from polycorner.formulas import Family
from polycorner.toolkit import TIME, Array, Formulation, Laws, MovingBody, source_key, waves

if TYPE_CHECKING:
    import sympy

    Expressions = dict[str, sympy.Expr]

COORDINATES = ("phi", "eta", "theta", "psi")
PARAMETERS = ("l", "r", "rho", "m", "surface", "weight", "pull")
CLINGING = "clinging"  # parameter: by how much more each ball presses on the wall
# Functions of the time: angle by which the drum has turned; S, and what W and P differ by.
SIGNALS = ("turned", "side", "heavier", "steeper")
SLIPS = ("slip1_r", "slip1_s", "slip2_r", "slip2_s", "spin")
MODULES = (
    Formulation.__module__,
    drum_formulas.__name__,
    dumbbell_formulas.__name__,
    waves.__module__,
    __name__,
)


class Shape(NamedTuple):
    """What the formulas of an imperfect drum depend on, apart from numbers."""

    harmonics: int  # of a wall that is out of round
    uneven: bool  # whether friction is uneven
    clings: bool = False  # whether balls cling to the wall

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters of the equations of motion."""
        clinging = [CLINGING] if self.clings else []
        wall = [f"{name}{j}" for j in range(self.harmonics) for name in ("harmonic", "a", "p")]
        modes = range(FIELD_MODES if self.uneven else 0)
        place = [f"{name}{j}" for j in modes for name in ("waves", "along", "start")]
        amplitude = ["unevenness"] if self.uneven else []
        return (*PARAMETERS, *clinging, *wall, *amplitude, *place, TIME, *SIGNALS)


@lru_cache(maxsize=2)
def perfect_motion(clings: bool = False) -> Formulation:
    """Return the equations of motion of one dumbbell in a perfect drum, to which it may cling."""
    key = source_key(*MODULES)
    if not clings:
        return Formulation(COORDINATES, PARAMETERS, _laws, 5, 2, key)
    known = (*PARAMETERS, CLINGING)
    return Formulation(COORDINATES, known, _clinging_laws, 5, 2, repr((key, CLINGING)))


@lru_cache(maxsize=16)
def imperfect_motion(shape: Shape) -> Formulation:
    """Return the equations of motion of one dumbbell in an imperfect drum."""
    key = repr((source_key(*MODULES), tuple(shape)))
    laws = partial(_imperfect_laws, shape)
    return Formulation(COORDINATES, shape.parameters, laws, 5, 2, key)


@lru_cache(maxsize=4)
def signals(shaken: bool, wobbling: bool) -> Family:
    """Return the functions of the time, ``SIGNALS``, as a family with the variable ``time``.

    Parameters ``omega m g tilt``, then ``angle phase`` of a wobble, then for each axis of shaking
    the amplitude of a mode, frequencies and phases.
    """
    parameters = ["omega", "m", "g", "tilt"]
    parameters += ["angle", "phase"] if wobbling else []
    if shaken:
        parameters += [name for axis in AXES for name in _signal_names(axis)]
    key = repr((source_key(*MODULES), "signals", shaken, wobbling))
    formulas = partial(_signals, shaken, wobbling)
    return Family(SIGNALS, (TIME,), tuple(parameters), formulas, key)


def imperfect_body(
    body: MovingBody, found: Imperfections, rho: float, driven: tuple[float, float, float, float]
) -> MovingBody:
    """Return a dumbbell of the perfect drum as one of an imperfect drum.

    Parameters
    ----------
    body : MovingBody
    found : Imperfections
    rho : float
        Radius in mm on which the centres move.
    driven : (float, float, float, float)
        Spin in rad/s, mass of a ball in g, acceleration of gravity in mm/s^2, tilt in rad.
    """
    shaking, wall, _, uneven = found
    family, numbers = _driving(found, driven)
    (now,) = family.evaluate(np.zeros(1), numbers)
    fixed = body.parameters.tolist()
    fixed += [] if wall is None else wall.numbers
    fixed += [] if uneven is None else uneven.numbers(2 * math.pi * rho)
    clings = len(body.parameters) > len(PARAMETERS)
    shape = Shape(0 if wall is None else len(wall.amplitudes), uneven is not None, clings)
    return replace(
        body,
        formulation=imperfect_motion(shape),
        parameters=np.array([*fixed, 0.0, *now.tolist()]),
        signals=family,
        signal_parameters=numbers,
        slow_signals=shaking is None,
    )


def effective_gravity(
    found: Imperfections, spin: float, gravity: float, tilt: float
) -> "tuple[sympy.Expr, ...]":
    """Return the force per mass across, along the axis and up, as functions of the time.

    Parameters
    ----------
    found : Imperfections
        Of which shaking and a wobble have an effect on it.
    spin, gravity, tilt : float
        In rad/s, mm/s^2 and rad.
    """
    family, numbers = _driving(found, (spin, 1.0, gravity, tilt))
    values = dict(zip(_symbols(*family.parameters), numbers.tolist(), strict=True))
    side, heavier, steeper = (family.expression(name).subs(values) for name in SIGNALS[1:])
    return -side, -(gravity * math.sin(tilt) + steeper), -(gravity * math.cos(tilt) + heavier)


def _driving(
    found: Imperfections, driven: tuple[float, float, float, float]
) -> tuple[Family, Array]:
    """Return the functions of the time of an imperfect drum, and their parameters."""
    known = list(driven)
    known += [] if found.wobble is None else found.wobble.numbers
    known += [] if found.shaking is None else found.shaking.numbers
    return signals(found.shaking is not None, found.wobble is not None), np.array(known)


def _signal_names(axis: str) -> list[str]:
    return [axis, *(f"{axis}_{letter}{k}" for letter in "fp" for k in range(SIGNAL_MODES))]


def _symbols(*names: str) -> "list[sympy.Symbol]":
    import sympy

    return [sympy.Symbol(name, real=True) for name in names]


def _laws() -> Laws:
    grip = drum_formulas.grip()
    return Laws(
        drum_formulas.kinetic().expression("kinetic"),
        drum_formulas.weight().expression("potential"),
        {},
        tuple(grip.expression(name) for name in SLIPS),
        tuple(grip.expression(name) for name in ("load1", "load2")),
    )


def _clinging_laws() -> Laws:
    perfect, (more,) = _laws(), _symbols(CLINGING)
    return replace(perfect, loads=tuple(load + more for load in perfect.loads))


def _signals(shaken: bool, wobbling: bool) -> "tuple[Expressions, Expressions]":
    import sympy

    time, omega, m, g, tilt, angle, phase = _symbols(
        TIME, "omega", "m", "g", "tilt", "angle", "phase"
    )
    tilted = tilt + angle * sympy.cos(omega * time + phase) if wobbling else tilt
    a = [_signal(axis, time) if shaken else sympy.S.Zero for axis in AXES]
    return {}, {
        "turned": omega * time,
        "side": m * a[0],
        "heavier": m * (g * (sympy.cos(tilted) - sympy.cos(tilt)) + a[2]),
        "steeper": m * (g * (sympy.sin(tilted) - sympy.sin(tilt)) + a[1]),
    }


def _signal(axis: str, time: "sympy.Expr") -> "sympy.Expr":
    import sympy

    amplitude, *modes = _symbols(*_signal_names(axis))
    pairs = zip(modes[:SIGNAL_MODES], modes[SIGNAL_MODES:], strict=True)
    return amplitude * sympy.Add(*(sympy.cos(2 * sympy.pi * f * time + p) for f, p in pairs))


def _imperfect_laws(shape: Shape) -> Laws:
    import sympy

    q = _symbols(*COORDINATES)
    rho, weight, side, heavier, steeper = _symbols("rho", "weight", "side", "heavier", "steeper")
    energy, loads = sympy.S.Zero, []
    for e in drum_formulas.BALLS.values():
        azimuth, eta, sine, cosine = _ball(e)
        wall, slope = _wall(shape, azimuth)
        down = (weight + heavier) * cosine - side * sine
        energy += side * rho * sine - heavier * rho * cosine - wall * down + steeper * eta
        load = down + slope / rho * ((weight + heavier) * sine + side * cosine)
        load += _symbols(CLINGING)[0] if shape.clings else 0
        loads.append(_positive(load) * _unevenness(shape, azimuth, eta))
    perfect = _laws()
    forces = {str(x): -sympy.diff(energy, x) for x in q[:3]}
    return Laws(perfect.kinetic, perfect.potential, forces, perfect.slips, tuple(loads))


def _ball(e: int) -> "tuple[sympy.Expr, sympy.Expr, sympy.Expr, sympy.Expr]":
    """Return azimuth and axial position of a ball, and sine and cosine of its azimuth."""
    import sympy

    phi, eta, theta, length, rho = _symbols("phi", "eta", "theta", "l", "rho")
    half = length * sympy.sin(theta) / (2 * rho)
    chord = sympy.sqrt(1 - half**2)
    sine = sympy.sin(phi) * chord + e * sympy.cos(phi) * half
    cosine = sympy.cos(phi) * chord - e * sympy.sin(phi) * half
    return phi + e * sympy.asin(half), eta + e * length * sympy.cos(theta) / 2, sine, cosine


def _wall(shape: Shape, azimuth: "sympy.Expr") -> "tuple[sympy.Expr, sympy.Expr]":
    """Return by how much the wall is further out at an azimuth, and its derivative."""
    (turned,) = _symbols("turned")
    terms = [tuple(_symbols(f"harmonic{j}", f"a{j}", f"p{j}")) for j in range(shape.harmonics)]
    return waves(azimuth - turned, terms)


def _unevenness(shape: Shape, azimuth: "sympy.Expr", eta: "sympy.Expr") -> "sympy.Expr":
    """Return the factor of the coefficients of friction at a place of the wall."""
    import sympy

    if not shape.uneven:
        return sympy.S.One
    amplitude, turned = _symbols("unevenness", "turned")
    modes = [_symbols(f"waves{j}", f"along{j}", f"start{j}") for j in range(FIELD_MODES)]
    return uneven_factor(azimuth - turned, eta, amplitude, modes)


def _positive(expression: "sympy.Expr") -> "sympy.Expr":
    """Return the positive part of an expression that has both signs, as SymPy need not find out."""
    import sympy

    return sympy.Max(0, expression, evaluate=False)


def uneven_factor(
    azimuth: "sympy.Expr", eta: "sympy.Expr", amplitude: Any, modes: "Sequence[Sequence[Any]]"
) -> "sympy.Expr":
    """Return the factor of friction at a place of the wall, by an azimuth that turns with it."""
    import sympy

    phases = (around * azimuth + along * eta + start for around, along, start in modes)
    return _positive(1 + amplitude * sympy.Add(*map(sympy.cos, phases)))


def rub(
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

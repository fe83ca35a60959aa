"""The tilted, turning drum and its dumbbells as an MJCF document, MuJoCo's format ([MuJoCo]).

Units are mm, g and s; MuJoCo has no units, but some of its defaults are lengths, and those are set
here.

The drum is a ring of boxes (:class:`~mjcf_ring.Ring`).
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from mjcf_ring import IMPEDANCE, Ring, contacts, text, tolerance_in_ring

from polycorner import checks
from polycorner.dumbbells.pair import DumbbellPair
from polycorner.spaces.manifold import Array

GRAVITY = 9806.65  # mm/s^2
SPINNING_FRICTION = 1e-4  # mm; spinning on the spot is free in the drum, but MuJoCo requires it > 0
TOLERANCE = 1e-8  # of the solver, relative to the inertia of the dumbbells


@dataclass(frozen=True)
class DrumScene:
    """Equal dumbbells in a tilted drum that turns; defaults are those of [GMBN] sec. 2, app. A.

    In space the drum's axis is ``y`` and its bottom ``y = 0``; a ball's centre at azimuth ``phi``
    and ``eta`` along the axis is ``(rho sin phi, eta, -rho cos phi)`` with ``rho = R - r``.
    Tilting turns gravity, not the drum.

    Parameters
    ----------
    length, ball_radius, rod_radius, drum_radius : float
        Sizes in mm, as in :class:`~polycorner.dumbbells.pair.DumbbellPair`; an infinite drum is
        the plane ``z = 0``, at rest and endless.
    tilt : float
        Angle between the drum's axis and the horizontal, in radians.
    spin : float
        Angular velocity of the drum in rad/s; positive spin carries towards positive ``phi``.
    count : int
        Number of dumbbells.
    ball_mass : float
        Mass of a ball in g; rods have none.
    mu_slide, mu_roll : float
        Sliding friction and rolling resistance of a ball on the drum, force per load.  MuJoCo
        does not distinguish static from dynamic coefficients.
    mu_contact : float
        Sliding friction where dumbbells touch.
    drum_length : float
        Length of the drum in mm, open at the top.
    dt : float
        Time step in s.
    segments : int
        Number of boxes that make the drum.
    impratio : float
        MuJoCo's stiffness of friction relative to that of normal forces; bodies at rest creep at a
        speed inversely proportional to it.
    noslip_iterations : int
        Sweeps of MuJoCo's NoSlip solver after each solve.
    rolling : {"cone", "joint"}
        Model of rolling resistance: with sliding in the friction cone of the contact, as is usual
        in MuJoCo, or by itself, as friction of a joint about the dumbbell's own axis; the joint's
        friction is that of the load on level ground, ``2 m g cos(tilt)``.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    length: float
    ball_radius: float
    rod_radius: float
    drum_radius: float = math.inf
    tilt: float = math.radians(7)
    spin: float = 0.01
    count: int = 1
    ball_mass: float = 0.12
    mu_slide: float = 0.3
    mu_roll: float = 0.1
    mu_contact: float = 0.3
    drum_length: float = 300.0
    dt: float = 1e-3
    segments: int = 720
    impratio: float = 100.0
    noslip_iterations: int = 0
    rolling: Literal["cone", "joint"] = "cone"

    def __post_init__(self) -> None:
        _check(self)

    @cached_property
    def pair(self) -> DumbbellPair:
        """Two such dumbbells in such a drum, untilted and at rest."""
        return DumbbellPair(self.length, self.ball_radius, self.rod_radius, self.drum_radius)

    def rows(self, *, across: int = 12) -> Array:
        """Return parallel dumbbells in rows across the lowest meridian, ``(count, 3)``.

        Columns are ``phi, eta, theta``, in the plane ``x, y, theta``.  Nothing touches; the lowest
        balls hang a radius above the bottom.
        """
        row, column = np.divmod(np.arange(self.count), across)
        pitch, lift = 2.2 * self.ball_radius, 2 * self.ball_radius + self.length / 2
        if not self.pair.is_plane:
            pitch = 2 * math.asin(pitch / (2 * self.pair.centre_radius))
        lateral = pitch * (column - (min(self.count, across) - 1) / 2)
        along = lift + row * (self.length + 2.4 * self.ball_radius)
        return np.stack([lateral, along, np.zeros(self.count)], axis=-1)


def mjcf(scene: DrumScene) -> str:
    """Return the scene as an MJCF document, ready for ``mujoco.MjModel.from_xml_string``.

    A dumbbell is a body along its own ``y``; all of them start at the origin and have to be placed
    afterwards.  Friction cones are elliptic.  On the drum they have six dimensions
    (``condim`` 6: normal force, sliding in two directions, spinning, rolling about two axes), or
    three if rolling resistance belongs to a joint; between dumbbells three.  The coefficient of
    rolling is a length, ``mu_roll r``.

    Parameters
    ----------
    scene : DrumScene
        Scene to write.
    """
    in_drum = not scene.pair.is_plane
    bodies = "\n".join(_dumbbell(scene, k) for k in range(scene.count))
    return f"""<mujoco model="drum">
  <compiler angle="radian" boundmass="0" boundinertia="0"/>
  {_option(scene)}
  {_default(scene)}
  <worldbody>
{_drum(scene) if in_drum else '    <geom class="surface" type="plane" size="0 0 1"/>'}
{bodies}
  </worldbody>
  {_ring(scene).servo() if in_drum else ""}
</mujoco>
"""


def _option(scene: DrumScene) -> str:
    """Return the solver's settings."""
    down = (0.0, -GRAVITY * math.sin(scene.tilt), -GRAVITY * math.cos(scene.tilt))
    tolerance = TOLERANCE
    if not scene.pair.is_plane:
        tolerance = tolerance_in_ring(TOLERANCE, _trace(scene), _ring(scene))
    return (
        f'<option timestep="{text(scene.dt)}" gravity="{text(*down)}" integrator="implicitfast" '
        f'cone="elliptic" impratio="{text(scene.impratio)}" tolerance="{text(tolerance)}"'
        f' noslip_iterations="{scene.noslip_iterations}" noslip_tolerance="0"/>'
    )


def _default(scene: DrumScene) -> str:
    """Return the classes of surfaces; the drum's friction has priority over the dumbbells'.

    Fixed or turning surfaces (type 1) collide with dumbbells (type 2) only.
    """
    friction = text(scene.mu_slide, SPINNING_FRICTION, scene.mu_roll * scene.ball_radius)
    condim = 6 if scene.rolling == "cone" else 3
    return f"""<default>
    <geom {contacts(scene.dt)} contype="2" conaffinity="3"
          condim="3" friction="{text(scene.mu_contact, 0, 0)}"/>
    <default class="surface">
      <geom contype="1" conaffinity="0" priority="1" condim="{condim}" friction="{friction}"/>
    </default>
    <default class="bottom">
      <geom contype="1" conaffinity="0" priority="2" condim="1"/>
    </default>
  </default>"""


def _drum(scene: DrumScene) -> str:
    """Return the bottom, which has no friction, and the turning ring."""
    bottom = '<geom class="bottom" type="plane" size="0 0 1" zaxis="0 1 0"/>'
    return f"    {bottom}\n{_ring(scene).body()}"


def _ring(scene: DrumScene) -> Ring:
    return Ring(
        scene.drum_radius,
        thickness=scene.ball_radius,
        start=0.0,
        length=scene.drum_length,
        spin=scene.spin,
        content=scene.count * 2 * scene.ball_mass,
        dt=scene.dt,
        segments=scene.segments,
    )


def _dumbbell(scene: DrumScene, k: int) -> str:
    half, ball = scene.length / 2, f'size="{text(scene.ball_radius)}"'
    mass = f'mass="{text(scene.ball_mass)}"'
    return f"""    <body name="dumbbell{k}">
      {"<freejoint/>" if scene.rolling == "cone" else _joints(scene)}
      <geom type="sphere" {ball} pos="{text(0, -half, 0)}" {mass}/>
      <geom type="sphere" {ball} pos="{text(0, half, 0)}" {mass}/>
      <geom type="capsule" size="{text(scene.rod_radius)}" mass="0"
            fromto="{text(0, -half, 0, 0, half, 0)}"/>
    </body>"""


def _joints(scene: DrumScene) -> str:
    """Return slides along x, y, z, hinges about z, x and the own axis; the last has friction."""
    load = 2 * scene.ball_mass * GRAVITY * math.cos(scene.tilt)
    loss = text(scene.mu_roll * scene.ball_radius * load)
    x, y, z = "1 0 0", "0 1 0", "0 0 1"
    kinds = (("slide", x), ("slide", y), ("slide", z), ("hinge", z), ("hinge", x))
    return "".join(f'<joint type="{kind}" axis="{axis}"/>' for kind, axis in kinds) + (
        f'<joint type="hinge" axis="{y}" frictionloss="{loss}" '
        f'solreffriction="{text(4 * scene.dt, 1)}" solimpfriction="{IMPEDANCE}"/>'
    )


def _trace(scene: DrumScene) -> float:
    """Return the trace of the inertia matrix of all dumbbells."""
    ball = 0.4 * scene.ball_radius**2
    return scene.count * 2 * scene.ball_mass * (3 + 3 * ball + scene.length**2 / 2)


def _check(scene: DrumScene) -> None:
    checks.whole("count", scene.count, least=1)
    checks.whole("segments", scene.segments, least=8)
    checks.whole("noslip_iterations", scene.noslip_iterations, least=0)
    checks.real("ball_mass", scene.ball_mass, above=0, unit="g")
    checks.real("drum_length", scene.drum_length, above=0, unit="mm")
    checks.real("dt", scene.dt, above=0, unit="s")
    checks.real("mu_slide", scene.mu_slide, above=0)
    checks.real("impratio", scene.impratio, above=0)
    checks.real("mu_roll", scene.mu_roll, least=0)
    checks.real("mu_contact", scene.mu_contact, least=0)
    checks.choice("rolling", scene.rolling, ("cone", "joint"))
    if scene.pair.is_plane and scene.spin != 0:
        checks.refuse("spin", "0 in the plane, which cannot turn", scene.spin)

"""Rigid dumbbells in space in the turning drum moved by MuJoCo ([MuJoCo])."""

import numpy as np
from bodies_in_drum import (
    BALL,
    DENSITY,
    DT,
    FRICTION,
    GRAVITY,
    LENGTH,
    LEVEL,
    RADIUS,
    ROD,
    SPIN,
    TOLERANCE,
)
from mjcf_ring import Ring, contacts, text, tolerance_in_ring
from mujoco_drum import load_mujoco

from polycorner.bodies import mass_of
from polycorner.spaces.manifold import Array

START, END = -150.0, 450.0  # of the drum along its axis


class MujocoMotion:
    """Dumbbells moved by MuJoCo, from placements ``(count, 7)`` at rest.

    Keywords are those of :func:`mjcf`.

    Raises
    ------
    ImportError
        If MuJoCo is missing.
    RuntimeError
        From :meth:`advance`, if MuJoCo warned, for example of too many contacts for its memory.
    """

    unsolved = None  # MuJoCo does not tell

    def __init__(self, placements: Array, **changes: float) -> None:
        self.mujoco = load_mujoco()
        self.model = self.mujoco.MjModel.from_xml_string(mjcf(len(placements), **changes))
        self.data = self.mujoco.MjData(self.model)
        self.data.qpos[1:] = placements.ravel()  # the first is the drum's
        self.data.qvel[0] = -SPIN
        self.kind = int(self.mujoco.mjtState.mjSTATE_INTEGRATION)  # what a step depends on

    def advance(self, steps: int) -> object:
        """Advance by steps of :data:`~bodies_in_drum.DT`."""
        self.mujoco.mj_step(self.model, self.data, steps)
        if self.data.warning.number.any():
            msg = f"MuJoCo warned, so many times of each kind: {self.data.warning.number.tolist()}"
            raise RuntimeError(msg)
        return None

    def placements(self) -> Array:
        """Return the placements now, ``(count, 7)``."""
        return np.reshape(self.data.qpos[1:], (-1, 7)).copy()

    def save(self) -> Array:
        """Return a copy of the state."""
        saved = np.empty(self.mujoco.mj_stateSize(self.model, self.kind))
        self.mujoco.mj_getState(self.model, self.data, saved, self.kind)
        return saved

    def load(self, saved: Array) -> None:
        """Continue from a saved state."""
        self.mujoco.mj_setState(self.model, self.data, saved, self.kind)


def mjcf(count: int, *, segments: int = 720, impratio: float = 100.0) -> str:
    """Return dumbbells in the drum as an MJCF document; they have to be placed afterwards.

    Dumbbells have the mass and inertia that polycorner gives them.  Friction cones are elliptic,
    contacts have three dimensions, and all have the same coefficient of friction.

    Parameters
    ----------
    count : int
        Number of dumbbells.
    segments : int
        Number of boxes that make the drum.
    impratio : float
        MuJoCo's stiffness of friction relative to that of normal forces, as in
        :class:`~mjcf.DrumScene`; MuJoCo's own default is 1.
    """
    mass = mass_of(LEVEL, DENSITY)
    ring = Ring(
        RADIUS,
        thickness=BALL,
        start=START,
        length=END - START,
        spin=-SPIN,
        content=count * mass.mass,
        dt=DT,
        segments=segments,
    )
    trace = count * (3 * mass.mass + float(np.trace(mass.inertia)))
    bodies = "\n".join(_dumbbell(k) for k in range(count))
    return f"""<mujoco model="dumbbells">
  <compiler angle="radian" boundmass="0" boundinertia="0"/>
  <option timestep="{text(DT)}" gravity="{text(0, 0, -GRAVITY)}" integrator="implicitfast"
          cone="elliptic" impratio="{text(impratio)}"
          tolerance="{text(tolerance_in_ring(TOLERANCE, trace, ring))}"/>
  <default>
    <geom {contacts(DT)} contype="2" conaffinity="3" condim="3" friction="{text(FRICTION, 0, 0)}"/>
    <default class="surface">
      <geom contype="1" conaffinity="0"/>
    </default>
  </default>
  <worldbody>
{ring.body()}
{bodies}
  </worldbody>
  {ring.servo()}
</mujoco>
"""


def _dumbbell(k: int) -> str:
    mass, half = mass_of(LEVEL, DENSITY), LENGTH / 2
    return f"""    <body name="dumbbell{k}">
      <freejoint/>
      <inertial pos="{text(*mass.centre)}" mass="{text(mass.mass)}"
                diaginertia="{text(*np.diag(mass.inertia))}"/>
      <geom type="sphere" size="{text(BALL)}" pos="{text(0, -half, 0)}"/>
      <geom type="sphere" size="{text(BALL)}" pos="{text(0, half, 0)}"/>
      <geom type="capsule" size="{text(ROD)}" fromto="{text(0, -half, 0, 0, half, 0)}"/>
    </body>"""

"""Links of robots, and the joints between them."""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from polycorner import checks
from polycorner.bodies.chains import clean
from polycorner.bodies.masses import Mass
from polycorner.bodies.shapes import Body
from polycorner.checks import refuse
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

KINDS = ("revolute", "continuous", "prismatic", "fixed")


@dataclass(frozen=True, eq=False)
class RobotLink(Checked):
    """A rigid link.

    Attributes
    ----------
    body : Body, optional
        What must not touch others, in the axes of the link.
    mass : Mass, optional
        In the axes of the link; without it the link has no mass.
    """

    body: Body | None = None
    mass: Mass | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.body is not None and self.body.dimension != 3:
            refuse("body", "a body in space", self.body)
        if self.mass is not None and len(self.mass.centre) != 3:
            refuse("mass", "a mass in space, with a centre (3,)", self.mass)


@dataclass(frozen=True, eq=False)
class RobotJoint(Checked):
    """A joint between two links.

    Attributes
    ----------
    parent, child : str
        The links.
    kind : {"revolute", "continuous", "prismatic", "fixed"}
        It turns between limits, or without end, slides, or holds.
    origin : (3,) array
        The joint, and with it the child at zero, in the axes of the parent.
    turn : (3, 3) array
        The matrix of its axes.
    axis : (3,) array
        The direction about or along which the child moves, in the axes of the joint.
    lower, upper : float
        Limits; infinite ones are none.
    damping : float
        Torque or force against the velocity, per velocity.
    friction : float
        Torque or force of dry friction.
    effort : float
        The largest torque or force of a drive.
    follows : (str, float, float), optional
        Another joint, a rate, not zero, and an offset: it stands at ``rate q + offset`` of the
        other's ``q``.
    """

    parent: str
    child: str
    kind: Literal["revolute", "continuous", "prismatic", "fixed"] = "revolute"
    origin: Array = field(default_factory=lambda: np.zeros(3))
    turn: Array = field(default_factory=lambda: np.eye(3))
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    lower: float = -math.inf
    upper: float = math.inf
    damping: float = 0.0
    friction: float = 0.0
    effort: float = math.inf
    follows: tuple[str, float, float] | None = None

    def __post_init__(self) -> None:
        checks.choice("kind", self.kind, KINDS)
        for name, shape in (("origin", (3,)), ("turn", (3, 3)), ("axis", (3,))):
            given = checks.reals(name, getattr(self, name))
            if given.shape != shape or not np.isfinite(given).all():
                refuse(name, f"finite numbers of shape {shape}", given)
            object.__setattr__(self, name, given)
        if not np.allclose(self.turn @ self.turn.T, np.eye(3)) or np.linalg.det(self.turn) < 0:
            refuse("turn", "the matrix of a rotation", self.turn)
        if not self.axis.any():
            refuse("axis", "a direction, not zero", self.axis)
        along = self.axis / np.abs(self.axis).max()
        object.__setattr__(self, "axis", clean(along / np.linalg.norm(along)))
        for name in ("damping", "friction"):
            object.__setattr__(self, name, checks.real(name, getattr(self, name), least=0))
        for name in ("lower", "upper"):
            object.__setattr__(self, name, checks.real(name, getattr(self, name), infinite=True))
        effort = checks.real("effort", self.effort, least=0, infinite=True)
        object.__setattr__(self, "effort", effort)
        if not self.lower < self.upper:
            refuse("upper", f"a limit above the lower one, {self.lower:g}", self.upper)
        limited = math.isfinite(self.lower) or math.isfinite(self.upper)
        if self.kind == "continuous" and limited:
            refuse("kind", "'revolute' for a joint with limits", self.kind)
        super().__post_init__()
        if self.follows is not None:
            _, rate, offset = self.follows
            if checks.real("follows", rate) == 0:
                refuse("follows", "a rate that is not zero", rate)
            checks.real("follows", offset)

    @property
    def moves(self) -> bool:
        """Whether the links move relative to each other."""
        return self.kind != "fixed"

    @checked
    def driven_by(self, name: str) -> tuple[str, float, float]:
        """Return the joint whose coordinate ``q`` places it at ``rate q + offset``, and these."""
        return self.follows or (name, 1.0, 0.0)

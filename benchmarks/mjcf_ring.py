"""A turning ring of boxes as MJCF: the inside of a drum, for which MuJoCo has no shape ([MuJoCo]).

The inner faces are tangent to the drum.  The ring is a body on a hinge, heavy and servo-driven, so
that it turns evenly whatever rolls in it.  With ``n`` boxes the surface at a ball is at most
``R (sec(pi/n) - 1)`` too far out and ``pi/n`` too steep or too flat: a micrometre and a quarter of
a degree with 720 boxes and a radius of 125 mm.
"""

import math
from dataclasses import dataclass

import numpy as np

TIMES_HEAVIER = 1e5  # inertia of the ring about its axis over that of its content
IMPEDANCE = "0.95 0.99 0.1"  # of contacts; the third number is a length


@dataclass(frozen=True)
class Ring:
    """A ring of boxes about the ``y`` axis.

    Parameters
    ----------
    radius, thickness : float
        Inner radius of the ring and thickness of its boxes, half of it.
    start, length : float
        Lower end of the ring along ``y``, and its length.
    spin : float
        Angular velocity in rad/s; positive spin carries the bottom, at negative ``z``, towards
        positive ``x``.
    content : float
        Mass of what moves in the ring.
    dt : float
        Time step in s.
    segments : int
        Number of boxes.
    """

    radius: float
    thickness: float
    start: float
    length: float
    spin: float
    content: float
    dt: float
    segments: int = 720

    @property
    def inertia(self) -> float:
        """Moment of inertia of the ring about its axis."""
        return TIMES_HEAVIER * self.content * self.radius**2

    def body(self) -> str:
        """Return the body ``drum`` with the joint ``spin``; its boxes are of class ``surface``."""
        step, half = math.tau / self.segments, self.length / 2
        wide = 1.01 * self.radius * math.tan(step / 2)  # faces overlap outside the ring
        out, middle = self.radius + self.thickness, self.start + half
        boxes = "\n".join(
            f'      <geom class="surface" type="box" size="{text(wide, half, self.thickness)}" '
            f'pos="{text(out * math.sin(b), middle, -out * math.cos(b))}" '
            f'xyaxes="{text(math.cos(b), 0, math.sin(b), 0, 1, 0)}"/>'
            for b in step * np.arange(self.segments)
        )
        return f"""    <body name="drum">
      <inertial pos="0 0 0" mass="1" diaginertia="{text(*3 * [self.inertia])}"/>
      <joint name="spin" type="hinge" axis="0 -1 0"/>
{boxes}
    </body>"""

    def servo(self) -> str:
        """Return the drive, which restores the spin within a step against the load."""
        gain = self.inertia / self.dt
        return (
            '<actuator><general joint="spin" gainprm="0" biastype="affine" '
            f'biasprm="{text(gain * self.spin, 0, -gain)}"/></actuator>'
        )


def contacts(dt: float) -> str:
    """Return the attributes of contacts at a step ``dt``.

    Their time constant is four steps, twice the least that MuJoCo accepts: the friction cone of a
    convex model pushes sliding or rolling bodies away from the surface, and stiffer contacts
    rattle.
    """
    return f'solref="{text(4 * dt, 1)}" solimp="{IMPEDANCE}"'


def tolerance_in_ring(tolerance: float, trace: float, ring: Ring) -> float:
    """Return the tolerance of MuJoCo's solver that is one relative to the inertia of the content.

    MuJoCo compares costs divided by the trace of the inertia matrix with the tolerance.  The ring
    dominates that trace: without the factor Newton's method would stop before it starts.

    Parameters
    ----------
    tolerance : float
        Relative to the inertia of the content.
    trace : float
        Trace of the inertia matrix of the content.
    ring : Ring
    """
    return tolerance * (trace / ring.inertia)


def text(*numbers: float) -> str:
    """Return numbers as an attribute of MJCF."""
    return " ".join(repr(float(number)) for number in numbers)

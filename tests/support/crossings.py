"""Room for a level crossing of two dumbbells, in closed form."""

import math


def crossing_clearance(pair):
    """Return the clearance of a level crossing, in mm; negative where there is none.

    One dumbbell lies on the lowest line; the rod of the other, ``2 t`` higher, is a level chord
    across it, ``2 w`` wide with ``w^2 = 4 t (rho - t)``, and not above the drum's axis,
    ``2 t <= rho``.  It has to be long enough, ``l >= 2 w``.  Its outer ends are
    ``u = l/2 - sqrt(l^2/4 - w^2)`` short of the balls below when it crosses in the middle; those
    have to be ``g`` apart along the drum, ``g^2 = 4 r^2 - 4 t rho``.  So the equilibrium is at the
    middle if ``u >= g``, and otherwise ``u + g`` off the middle, with one of its balls beyond the
    lower ones, provided the lower ball clears the upper rod there.  The smallest clearance of the
    better one is returned; in both the upper balls clear the lower rod, ``4 t rho >= (r + t)^2``.
    """
    if pair.is_plane:
        return -math.inf
    half, r, t, rho = pair.length / 2, pair.ball_radius, pair.rod_radius, pair.centre_radius
    width = 2 * math.sqrt(t * max(rho - t, 0.0))
    if width > half or 2 * t > rho:
        return min(half - width, rho - 2 * t)
    short = half - math.sqrt(half**2 - width**2)
    apart = math.sqrt(max(4 * r**2 - 4 * t * rho, 0.0))
    arm = max(half - short - apart, 0.0) * width / half
    off = math.hypot(arm, 2 * t) - r - t
    return min(half - width, max(short - apart, off))

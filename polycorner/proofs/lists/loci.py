"""Sets of stationary points along coordinates on which the energy does not depend.

Let ``E`` depend on some coordinates ``z`` only, and ``y`` be the others.  In a box ``X`` of ``z``
let ``E'`` vanish at ``z*`` and ``[H]`` enclose ``E''``, with the symmetric middle ``C``.  For each
``z`` in ``X`` there is a matrix ``M`` in ``[H]`` with ``E'(z) = M (z - z*)``; if the symmetric
parts of all products ``M^T C`` are positive definite, ``v = -C (z - z*)`` has ``E'(z) v < 0``
except at ``z*``, which is therefore the only zero of ``E'``.

Now let ``u`` be a vector along ``y`` in which all functions that may vanish in a box grow, and let
``z`` of the box lie in ``X``.  At a point of the set with ``z != z*`` the direction ``(v, K u)``
descends, and for a large ``K`` it leads into the set: the point is not stationary.  At ``z = z*``
the energy has no derivative.  The stationary points in the box are therefore those with ``z = z*``.

There may be none, as the set may have no point with ``z = z*``: the domain is bisected along ``y``,
with ``z`` in its enclosure, until one box lies in the set, or all lie outside.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from polycorner.intervals.balls import (
    matrix,
    middle_inverse,
    precision,
)
from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Formulas, Undecided
from polycorner.intervals.tapes import Box
from polycorner.proofs.definite import is_definite
from polycorner.proofs.kkt import krawczyk, strictly_inside
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.faces import BITS, QUARTERINGS, enclosing, inertia, outward
from polycorner.proofs.lists.tree import bisected
from polycorner.spaces.manifold import Array
from polycorner.tolerances import SEARCH
from polycorner.values import Value

MOST_PIECES = 4096  # boxes in which a point of the set is looked for, at a time and in all


@dataclass(frozen=True, eq=False)
class LocusRegion(Value):
    """A point ``z*`` where the derivative of the energy vanishes, whatever ``y`` is.

    Attributes
    ----------
    z : tuple of int
        Positions of the coordinates that the energy depends on.
    lower, upper : (z,) arrays
        The box ``X`` in which there is no other.
    sharp_lower, sharp_upper : (z,) arrays
        Enclosure of ``z*``.
    index : int
        Negative eigenvalues of the second derivative.
    sample : (n,) array or None
        A point with ``z`` in the enclosure; with ``z = z*`` instead it is in the set.  None
        where none was found.
    """

    z: tuple[int, ...]
    lower: Array
    upper: Array
    sharp_lower: Array
    sharp_upper: Array
    index: int
    sample: Array | None = None

    def sides(self, domain: Domain) -> tuple[Array, Array]:
        """Return its sharp sides, in all coordinates of a domain."""
        sides = np.array([domain.lower, domain.upper])
        sides[:, list(self.z)] = self.sharp_lower, self.sharp_upper
        return sides[0], sides[1]


def read_coordinates(formulas: Formulas, free: tuple[int, ...]) -> tuple[int, ...]:
    """Return the free coordinates that the energy depends on."""
    nodes = (formulas.graph.nodes[a] for a in formulas.graph.needed(formulas.outputs[-1:]))
    read = {int(args[0]) for op, args in nodes if op == "var"}
    return tuple(i for i in free if i in read)


def locus(
    formulas: Formulas,
    z: tuple[int, ...],
    q: Array,
    scales: Array,
    held: Mapping[int, tuple[float, float]] = MappingProxyType({}),
) -> LocusRegion | None:
    """Return the widest locus tried about ``q``, where the energy's derivative nearly vanishes.

    It is one for all values of the parameters, with their sides ``held``.
    """
    units = scales[list(z)]
    with precision(BITS):
        # The widest first, as a wide box closes more of the search at once.
        for power in range(QUARTERINGS):
            shown = _shown(formulas, z, q, units * SEARCH.widest / 4**power, held)
            if shown is not None:
                # The wide box closes other boxes, the sharp one is told.
                sharp = _shown(formulas, z, q, units * SEARCH.sharp_box, held)
                return replace(
                    shown,
                    sharp_lower=(sharp or shown).sharp_lower,
                    sharp_upper=(sharp or shown).sharp_upper,
                )
    return None


def _shown(
    formulas: Formulas,
    z: tuple[int, ...],
    q: Array,
    radii: Array,
    held: Mapping[int, tuple[float, float]],
) -> LocusRegion | None:
    places = list(z)
    lower, upper = q[places] - radii, q[places] + radii
    ends = np.array([q, q])
    for i, side in held.items():
        ends[:, i] = side
    ends[:, places] = lower, upper
    hull = list(enclosing(*ends).hull)
    row = len(formulas.names) - 1
    forms = formulas.smooth(Box(hull), [row])
    if isinstance(forms, Undecided):
        return None
    hessian = forms.evaluate(Box(hull), 2)[2][0]
    form = [[hessian[i][j] for j in places] for i in places]
    middle = matrix([[x.mid() for x in line] for line in form])
    # If H' M + M' H is definite, every matrix in the enclosure H is regular.
    product = matrix(form).transpose() * middle
    if not is_definite((product + product.transpose()).tolist()):
        return None
    unknowns = [hull[i] for i in places]
    centre = [x.mid() for x in unknowns]
    for i, x in zip(places, centre, strict=True):
        hull[i] = x
    _, slopes, bent = forms.evaluate(Box(hull), 2)
    at = [[bent[0][i][j] for j in places] for i in places]
    inverse, signs = middle_inverse(at), inertia(at)
    if inverse is None or signs is None:
        return None
    image = krawczyk([slopes[0][i] for i in places], form, inverse, unknowns, centre)
    if not strictly_inside(image, unknowns):
        return None
    sharp = np.array([outward(x) for x in image]).reshape(-1, 2)  # none where nothing moves
    return LocusRegion(z, lower, upper, sharp[:, 0], sharp[:, 1], signs[0])


def met(
    place: LocusRegion, functions: BoxFunctions, conj: Mask, domain: Domain
) -> LocusRegion | None:
    """Return the locus with a sample, if one is found; None if it is shown to miss the set."""
    z = list(place.z)
    along = np.setdiff1d(domain.free, z)
    lower, upper = domain.lower[None].copy(), domain.upper[None].copy()
    lower[:, z], upper[:, z] = place.sharp_lower, place.sharp_upper
    treated = 0
    while len(lower):
        # A limit on work, not on proof: without a sample the list says that it is open.
        treated += len(lower)
        if treated > MOST_PIECES:
            return place
        middle = 0.5 * (lower + upper)
        low, high = middle.copy(), middle.copy()
        low[:, z], high[:, z] = place.sharp_lower, place.sharp_upper
        for i, (least, most) in domain.held.items():
            low[:, i], high[:, i] = least, most
        # In the middle of the piece along the locus, for all of z and all parameters.
        bounds = functions.values(low, high)[0][:, : conj.shape[1]]
        missed: Mask = np.any((bounds <= 0)[:, None, :] & conj, axis=2)
        inside = np.flatnonzero(~np.all(missed, axis=1))
        if inside.size:
            return replace(place, sample=middle[inside[0]])
        # Pieces that miss the set in every branch are dropped; when none is left, all of it does.
        bounds = functions.values(lower, upper)[1][:, : conj.shape[1]]
        missed = np.any((bounds < 0)[:, None, :] & conj, axis=2)
        left = ~np.all(missed, axis=1)
        lower, upper = lower[left], upper[left]
        axes = along[((upper - lower) / domain.manifold.scale_array)[:, along].argmax(axis=1)]
        lower, upper = bisected(lower, upper, axes)
    return None

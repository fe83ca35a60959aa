"""Two dumbbells in a horizontal drum, or in the plane the drum develops into.

The pair is the flagship model ([GMBN] sec. 5, 6): nine gaps carve the polyhedron ``D`` of
non-overlapping placements out of ``M x M``; the energy is the height of the balls.
"""

import math
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from polycorner.dumbbells import formulas
from polycorner.dumbbells import symmetries as motions
from polycorner.formulas import SmoothFunction
from polycorner.polyhedra import AllOf, Polyhedron, Symmetry
from polycorner.spaces import Manifold
from polycorner.toolkit import TOLERANCE, Array, Checked, cached_property, checked, checks

Chirality = Literal["L", "R"]
LONGEST = 1 / TOLERANCE  # l / r, above which a ball is smaller than what counts as zero


@dataclass(frozen=True)
class DumbbellPair(Checked):
    """Two equal dumbbells A and B on the inside of a horizontal drum.

    ::

        A1 o=======o A2          the axis points from ball 1 to ball 2;
             B1 o=======o B2     this nested pair is right-handed

    Coordinates are azimuth ``phi``, axial position ``eta`` and heading ``theta`` of each dumbbell
    (``x``, ``y``, ``theta`` in the plane).  A contact is called ``A1B2`` (ball on ball), ``A1b``
    (ball A1 on the rod of B), ``aB2`` (ball B2 on the rod of A) or ``ab`` (rod on rod).

    Parameters
    ----------
    length : float
        Distance ``l`` of the two centres of a dumbbell, in mm; ``2 r <= l <= 2 (R - r)``.
    ball_radius, rod_radius : float
        ``r`` and ``t < r``, in mm.
    drum_radius : float, optional
        ``R`` in mm; ``inf`` (default) is the developed plane.
    rod_weight : float, optional
        Weight of a rod as a multiple of the weight of a ball; default 0.

    Raises
    ------
    TypeError, ValueError
        Naming the parameter, what was expected and what came.
    """

    length: float
    ball_radius: float
    rod_radius: float
    drum_radius: float = math.inf
    rod_weight: float = 0.0

    def __post_init__(self) -> None:
        r = checks.real("ball_radius", self.ball_radius, above=0, unit="mm")
        less, more = "mm, less than ball_radius", "mm, more than ball_radius"
        t = checks.real("rod_radius", self.rod_radius, above=0, below=r, unit=less)
        radius = checks.real("drum_radius", self.drum_radius, above=r, infinite=True, unit=more)
        widest = 2 * (radius - r)  # the longest chord of the cylinder of ball centres
        length = checks.real("length", self.length, above=0, unit="mm")
        checks.real("length", length, least=2 * r, most=widest, unit="mm")
        weight = checks.real("rod_weight", self.rod_weight, least=0)
        for field, value in zip(fields(self), (length, r, t, radius, weight), strict=True):
            object.__setattr__(self, field.name, value)

    @property
    def is_plane(self) -> bool:
        """Whether the pair lies in the developed plane."""
        return math.isinf(self.drum_radius)

    @property
    def centre_radius(self) -> float:
        """``rho = R - r``, the radius of the cylinder of ball centres, in mm."""
        return self.drum_radius - self.ball_radius

    @cached_property
    def manifold(self) -> Manifold:
        """``M x M``; a unit displacement moves a ball by about its radius."""
        r, turn = self.ball_radius, 2 * self.ball_radius / self.length
        if self.is_plane:
            lines, units = (math.inf, math.inf, math.tau), ("mm", "mm", "rad")
            return Manifold(formulas.PLANE, lines, (r, r, turn), units) ** 2
        scales = (r / self.centre_radius, r, turn)
        periods, units = (math.tau, math.inf, math.tau), ("rad", "mm", "rad")
        return Manifold(formulas.DRUM, periods, scales, units) ** 2

    @cached_property
    def polyhedron(self) -> Polyhedron:
        """``D``: four ball-ball, four ball-rod and one rod-rod gap, all at least zero (mm)."""
        family = formulas.plane_gaps() if self.is_plane else formulas.drum_gaps()
        sizes = (self.length, self.ball_radius, self.rod_radius)
        numbers = sizes if self.is_plane else (*sizes, self.centre_radius)
        gaps = [
            SmoothFunction.member(family, name, self.manifold, parameters=numbers)
            for name in formulas.CONTACTS
        ]
        return Polyhedron(self.manifold, AllOf(*gaps), annotations={"chirality": self.chirality})

    @cached_property
    def symmetry(self) -> Symmetry:
        """Motions of the pair as a whole.

        In the plane these are all rigid motions; in the drum rolling, shifting and the half-turn
        about a vertical axis.
        """
        if self.is_plane:
            return Symmetry(motions.plane_tangents, self._invariants)
        return Symmetry(
            motions.drum_tangents, self._invariants, elements=(motions.half_turn_in_place(),)
        )

    def _invariants(self, q: Array) -> Array:
        half, unit = self.length / 2, self.ball_radius
        if self.is_plane:
            return motions.plane_invariants(q, half, unit)
        return motions.drum_invariants(q, half, unit, self.centre_radius)

    def section(self, heading: float = 0.0) -> Polyhedron:
        """Return the section of ``D`` at a given mean heading, in radians.

        The equation is ``sin((theta_1 + theta_2)/2 - heading) = 0``: the mean of two directions
        is defined modulo half a turn.  Modulo the symmetry, the section is three-dimensional and
        contains every relative placement once.
        """
        mean = SmoothFunction.member(
            formulas.mean_heading(),
            "heading",
            self.manifold,
            parameters=(checks.real("heading", heading),),
        )
        return Polyhedron(
            self.manifold,
            AllOf(*self.polyhedron.functions),
            mean,
            annotations=self.polyhedron.annotations,
        )

    @cached_property
    def energy(self) -> SmoothFunction:
        """``E``: balls and weighted rods times their height above the drum's floor, in mm.

        In the plane, where heights vanish, the limit of ``rho (E - E_min)``: half the weighted
        sum of squared lateral positions, in mm^2.
        """
        if self.is_plane:
            numbers: tuple[float, ...] = (self.length, self.rod_weight)
            family = formulas.plane_energy()
        else:
            numbers = (self.length, self.drum_radius, self.centre_radius, self.rod_weight)
            family = formulas.drum_energy()
        return SmoothFunction.member(family, family.names[0], self.manifold, parameters=numbers)

    @property
    def ball_heights_per_energy(self) -> float:
        """Sum of ball heights as a fraction of ``E``.

        A rod's centre is the middle of its chord, so its height is the mean of its balls' heights
        and a rod of weight ``w`` only multiplies the energy by ``1 + w/2``.
        """
        return 1.0 / (1.0 + self.rod_weight / 2)

    def ball_centres(self, q: ArrayLike) -> Array:
        """Return the centres of A1, A2, B1, B2 in space, ``(..., 4, 3)``, in mm.

        In the drum ``(rho sin phi, eta, -rho cos phi)``; in the plane ``(x, y, 0)``.
        """
        points = self.manifold.points(q)
        across, along, theta = (points[..., [k, k + 3]] for k in range(3))
        half = np.array([-0.5, 0.5]) * self.length
        y = along[..., None] + half * np.cos(theta)[..., None]
        lateral = half * np.sin(theta)[..., None]
        if self.is_plane:
            x = across[..., None] + lateral
            z = np.zeros_like(x)
        else:
            angle = across[..., None] + np.arcsin(lateral / self.centre_radius)
            x, z = self.centre_radius * np.sin(angle), -self.centre_radius * np.cos(angle)
        return np.stack([x, y, z], axis=-1).reshape(*points.shape[:-1], 4, 3)

    def developed(self, q: ArrayLike) -> Array:
        """Return the ball centres in the developed plane ``(rho phi, eta)``, ``(..., 4, 2)``."""
        points = self.manifold.points(q)
        centres = self.ball_centres(points)
        if self.is_plane:
            return centres[..., :2]
        middle = np.angle(np.exp(1j * points[..., 0]) + np.exp(1j * points[..., 3]))
        angle = np.arctan2(centres[..., 0], -centres[..., 2])
        lateral = self.centre_radius * np.angle(np.exp(1j * (angle - middle[..., None])))
        return np.stack([lateral, centres[..., 1]], axis=-1)

    def chirality(self, q: ArrayLike) -> Chirality | None:
        """Return ``"R"`` or ``"L"`` for one pair, or None where it is not defined.

        With ``A_i, B_j`` the farthest pair of centres and ``A_p, B_q`` the other two, the pair is
        right-handed when the vectors ``A_i B_j``, ``A_p B_q`` are positively oriented in the
        plane ``(rho phi, eta)`` ([GMBN] sec. 5); undefined when they are parallel or the farthest
        pair is not unique, to within ``1e-9`` of the length.
        """
        a1, a2, b1, b2 = self.developed(self.manifold.point(q))
        pairs = [(a1, b1, a2, b2), (a1, b2, a2, b1), (a2, b1, a1, b2), (a2, b2, a1, b1)]
        far = sorted(pairs, key=lambda pair: -float(np.hypot(*(pair[1] - pair[0]))))
        reach = [float(np.hypot(*(pair[1] - pair[0]))) for pair in far[:2]]
        outer, inner = far[0][1] - far[0][0], far[0][3] - far[0][2]
        turn = float(outer[0] * inner[1] - outer[1] * inner[0])
        small = 1e-9 * self.length
        if reach[0] - reach[1] <= small or abs(turn) <= small * reach[0]:
            return None
        return "R" if turn > 0 else "L"

    def plane_corner(self) -> tuple[float, float, float]:
        """Return ``(theta_s, D, p)`` of the three-contact corner in the plane.

        Parallel dumbbells, each with a ball in the other's waist, are shifted by ``p = r + t``
        across and ``D = l - sqrt(4 r^2 - p^2)`` along their common axis; the trough energy
        is stationary at ``tan 2 theta_s = 2 D p / (D^2 + l^2 - p^2)`` (derived in the
        documentation, page "Heading"); ``theta_s`` in radians.
        """
        p = self.ball_radius + self.rod_radius
        diameter = 2 * self.ball_radius
        along = self.length - math.sqrt(diameter - p) * math.sqrt(diameter + p)
        s, d = p / self.length, along / self.length
        heading = math.atan2(2 * d * s, d**2 + 1 - s**2) / 2
        return heading, along, p

    def nested(
        self, chirality: Chirality, *, heading: float | None = None, clearance: float | None = None
    ) -> Array:
        """Return a nested pair: parallel, a ball of each beside the other's rod, inner balls near.

        Parameters
        ----------
        chirality : {"R", "L"}
            Handedness.
        heading : float, optional
            Common heading in radians; default that of the corner in the plane.
        clearance : float, optional
            Distance, in mm, left at each of the three contacts; default a tenth of the ball radius.
            Exact in the plane; in the drum, to within terms of order ``1/R^2``.
        """
        sign = 1 if checks.choice("chirality", chirality, ("R", "L")) == "R" else -1
        clearance = self.ball_radius / 10 if clearance is None else clearance
        gap = checks.real("clearance", clearance, unit="mm")
        angle, _, p = self.plane_corner()
        theta = sign * angle if heading is None else checks.real("heading", heading)
        across = p + gap
        # sqrt((2 r + gap)^2 - across^2), whose squares may be too large for doubles
        least, middle = self.ball_radius - self.rod_radius, self.ball_radius + p / 2 + gap
        along = self.length - math.sqrt(2 * least) * math.sqrt(max(middle, 0.0))
        axis = np.array([math.sin(theta), math.cos(theta)])
        normal = sign * np.array([-math.cos(theta), math.sin(theta)])
        return self._pair(along * axis + across * normal, theta)

    def relative(self, q: Array) -> Array:
        """Return the placement of B relative to A, in the developed plane, in ball radii, ``(4,)``.

        Its position across and along the axis of A, then cosine and sine of the angle between the
        axes times half a length.
        """
        flat = self.manifold.points(q).copy()
        if not self.is_plane:
            apart = math.remainder(q[3] - q[0], math.tau)
            flat[[0, 3]] = 0.0, self.centre_radius * apart
        return motions.plane_invariants(flat, self.length / 2, self.ball_radius)

    @checked
    def placements(
        self, rng: np.random.Generator, count: int, *, heading: float | None = None
    ) -> Array:
        """Return random placements without overlap, near enough to touch, ``(count, 6)``.

        Parameters
        ----------
        rng : Generator
            Source of the random numbers.
        count : int
            Number of placements.
        heading : float, optional
            Mean heading in radians; default random.
        """
        reach = self.length + 4 * self.ball_radius
        found = np.empty((0, 6))
        while len(found) < count:
            offset = rng.uniform(-reach, reach, (4 * count, 2)) / 2
            turn = rng.uniform(-math.pi, math.pi, 4 * count)
            mean: Any = rng.uniform(-math.pi, math.pi, 4 * count)
            mean = mean if heading is None else checks.real("heading", heading)
            across = offset[:, 0] if self.is_plane else offset[:, 0] / self.centre_radius
            half = np.stack([across, offset[:, 1], turn], axis=-1) / 2
            middle = np.zeros((4 * count, 3))
            middle[:, 2] = mean
            q = np.concatenate([middle - half, middle + half], axis=-1)
            found = np.concatenate([found, q[np.asarray(self.polyhedron.contains(q))]])
        return self.manifold.wrap(found[:count])

    def side_by_side(self, *, clearance: float = 0.0) -> Array:
        """Return two dumbbells on parallel meridians, ball beside ball, ``clearance`` mm apart."""
        r, widest = self.ball_radius, math.inf if self.is_plane else 2 * self.centre_radius
        gap = checks.real("clearance", clearance, least=-2 * r, most=widest - 2 * r, unit="mm")
        apart = 2 * r + gap
        if not self.is_plane:
            apart = 2 * self.centre_radius * math.asin(apart / (2 * self.centre_radius))
        return self._pair(np.array([apart, 0.0]), 0.0)

    def end_to_end(self, *, gap: float | None = None) -> Array:
        """Return two dumbbells on the lowest meridian, ``gap`` mm (default ``r``) between them."""
        gap = self.ball_radius if gap is None else checks.real("gap", gap, unit="mm")
        return self._pair(np.array([0.0, self.length + 2 * self.ball_radius + gap]), 0.0)

    def _pair(self, offset: Array, theta: float) -> Array:
        across = offset[0] / 2 if self.is_plane else offset[0] / (2 * self.centre_radius)
        half = np.array([across, offset[1] / 2])
        return np.array([*-half, theta, *half, theta])

    def mirror(self, q: ArrayLike) -> Array:
        """Return the mirror image in the vertical plane through the drum's axis."""
        return self.manifold.wrap(self.manifold.points(q) * np.array([-1, 1, -1] * 2))

    def swap(self, q: ArrayLike) -> Array:
        """Return the pair with the roles of A and B exchanged."""
        return self.manifold.points(q)[..., [3, 4, 5, 0, 1, 2]]

    def half_turn(self, q: ArrayLike, which: Literal["A", "B"]) -> Array:
        """Return the pair with the two balls of one dumbbell exchanged: ``theta + pi``."""
        checks.choice("which", which, ("A", "B"))
        turned = self.manifold.points(q).copy()
        turned[..., 2 if which == "A" else 5] += math.pi
        return self.manifold.wrap(turned)

    def canonical(self, q: ArrayLike) -> Array:
        """Return the same bodies with both headings in ``(-pi/2, pi/2]``."""
        wrapped = self.manifold.wrap(q)
        theta = wrapped[..., [2, 5]]
        wrapped[..., [2, 5]] = theta - math.pi * np.ceil(theta / math.pi - 0.5)
        return wrapped

    def heading(self, q: ArrayLike) -> Array:
        """Return the headings of A and B in ``(-pi/2, pi/2]``, ``(..., 2)``, in radians."""
        return self.canonical(q)[..., [2, 5]]

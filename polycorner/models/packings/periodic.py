"""Discs or spheres in a periodic box, inflated together until they jam."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize

from polycorner import checks
from polycorner.formulas.rows import SparseRows
from polycorner.kinds import checked
from polycorner.minimisation.sparse.chain import ChainEnd, ChainEnergy, descend
from polycorner.models.packings.jammed import JammedPacking, neighbours, rows_of
from polycorner.printing import Described
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

SKIN = 0.3, 0.05  # margins of the list of neighbours in mean diameters: at first, and later
MOST_CHANGES = 30  # of the inflation
DEFLATED = 0.8  # share of the excess inflation that one deflation takes away
FIRST = 4e-3  # mean overlap, relative to the sum of radii, that is expected at first
APART = 0.1  # share of the expected overlap below which the bodies have come apart
WIDEST = 0.02  # largest overlap that is expected
# Largest unbalanced force, relative to the mean: before a deflation, and at the end.
BALANCE = 5e-2, 2e-3
MEMORY = 20  # pairs of vectors that L-BFGS keeps
# Densities at which soft bodies are pushed apart: a little above those at which they jam.
SOFT_DENSITY = {2: 0.85, 3: 0.65}
REACH = 0.3  # first box of the linear programmes, in mean diameters


class _SoftBodies:
    """The energy ``1/2 sum (1 - |x_j - x_i| / sigma_ij)^2`` over overlapping pairs ([OSLN])."""

    def __init__(self, centres: Array, radii: Array, box: float, skin: float) -> None:
        self.radii, self.box, self.shape = radii, box, centres.shape
        self.skin = skin * 2 * float(radii.mean())
        self._listed(centres)

    def _listed(self, centres: Array) -> None:
        self.at = centres.copy()
        pairs, _, _ = neighbours(centres, self.radii, 1.0, self.box, self.skin)
        self.first, self.second = pairs.T
        self.sigma = self.radii[pairs].sum(axis=1)

    def __call__(self, u: Array) -> tuple[float, Array]:
        centres = u.reshape(self.shape)
        if np.linalg.norm(centres - self.at, axis=1).max() > self.skin / 2:
            self._listed(centres)
        between = centres[self.second] - centres[self.first]
        between -= self.box * np.round(between / self.box)
        distance = np.sqrt(np.einsum("ij,ij->i", between, between))
        hit = np.flatnonzero(distance < self.sigma)
        distance, sigma = np.maximum(distance[hit], 1e-300), self.sigma[hit]
        overlap = 1 - distance / sigma
        push = (overlap / (sigma * distance))[:, None] * between[hit]
        first, second, count = self.first[hit], self.second[hit], len(centres)
        slope = [
            np.bincount(first, along, count) - np.bincount(second, along, count) for along in push.T
        ]
        return float(overlap @ overlap) / 2, np.column_stack(slope).ravel()


def pushed_apart(
    centres: Array, radii: Array, box: float, iterations: int, *, unbalanced: float, skin: float
) -> Array:
    """Return centres after a minimisation of the energy of soft bodies by L-BFGS.

    It ends when the gradient, times the mean diameter, is at most ``unbalanced``.
    """
    energy = _SoftBodies(centres, radii, box, skin)
    options = {
        "maxiter": iterations,
        "maxfun": 2 * iterations,
        "maxcor": MEMORY,
        "ftol": 0.0,
        "gtol": unbalanced / (2 * float(radii.mean())),
    }
    solve: Any = minimize  # whose stubs know no callable object that returns a gradient, too
    found = solve(energy, centres.ravel(), jac=True, method="L-BFGS-B", options=options)
    return np.asarray(found.x).reshape(centres.shape)


def decompressed(
    centres: Array, radii: Array, box: float, iterations: int, *, overlap: float
) -> Array:
    """Return centres of soft bodies that are deflated until they overlap by ``overlap`` only.

    Of the excess inflation most is taken away, and the rest minimised, again and again.  Where a
    rearrangement lets the bodies come apart, they are inflated.  The contacts are then nearly those
    of the jammed packing.
    """
    inflation, expected = 1.0, FIRST
    for count in range(MOST_CHANGES):
        last = expected <= overlap
        unbalanced = expected * BALANCE[last]
        centres = pushed_apart(
            centres, inflation * radii, box, iterations, unbalanced=unbalanced, skin=SKIN[count > 0]
        )
        overlaps = relative_overlaps(centres, inflation * radii, box)
        mean = float(overlaps.mean()) if len(overlaps) else 0.0
        if mean < APART * expected:
            expected = min(expected / (1 - DEFLATED), WIDEST)
            inflation *= 1 + expected
        elif last:
            break
        else:  # where they overlap little enough, they have only to be balanced
            share = min(DEFLATED, max(1 - overlap / mean, 0.0))
            inflation *= 1 - share * excess(overlaps)
            expected = max((1 - DEFLATED) * mean, overlap)
    return centres


def relative_overlaps(centres: Array, radii: Array, box: float) -> Array:
    """Return the overlaps of the pairs that overlap, relative to the sums of their radii."""
    pairs, _, gaps = neighbours(centres, radii, 1.0, box, 0.0)
    overlaps: Array = -gaps / radii[pairs].sum(axis=1)
    return overlaps


def excess(overlaps: Array) -> float:
    """Return ``(s - s_J) / s`` for soft bodies in equilibrium at ``s``, which jam at ``s_J``.

    Near jamming their energy is ``E = k (s - s_J)^2``, so that ``s - s_J = 2 E / E'``, and
    ``E' = sum o (1 - o) / s`` for the overlaps ``o`` (``(m,)``, relative to the sums of radii).
    """
    return float((overlaps @ overlaps) / (overlaps @ (1 - overlaps)))


def largest_inflation(centres: Array, radii: Array, box: float, guess: float) -> float:
    """Return the largest factor of the radii without overlap, at most ``guess`` times a bit."""
    margin = 0.5 * guess * float(radii.max())
    pairs, _, gaps = neighbours(centres, radii, guess, box, margin)
    sums = radii[pairs].sum(axis=1)
    return float(((gaps + guess * sums) / sums).min(initial=guess))


@dataclass(frozen=True, eq=False)
class PeriodicPacking(Checked, Described):
    """Discs (``d = 2``) or spheres (``d = 3``) in a periodic square or cube.

    Their radii are ``s radii``, and the inflation ``s`` is to be as large as possible while no two
    of them overlap: the energy ``-s`` on ``{|x_j - x_i| - s (r_i + r_j) >= 0}``.

    Parameters
    ----------
    radii : (N,) array_like
        Radii up to the common factor.
    dimension : {2, 3}
        ``d``.
    box : float, optional
        Edge of the box.

    Raises
    ------
    TypeError, ValueError
        If radii are no numbers or not positive, or one body is so large that it might touch
        another in two images.

    Examples
    --------
    >>> jammed = PeriodicPacking.bidisperse(64).jam(1)
    >>> jammed.is_isostatic, bool((jammed.forces > 0).all())
    (True, True)
    """

    radii: Array
    dimension: int = 2
    box: float = 1.0

    def __repr__(self) -> str:
        """Return the number of bodies, in one line."""
        count, d = len(self.radii), self.dimension
        return f"PeriodicPacking({count} bodies in {d} dimensions, box {self.box:g})"

    def __post_init__(self) -> None:
        expected = "at least two positive numbers"
        radii = checks.numbers("radii", self.radii, expected)
        if radii.ndim != 1 or len(radii) < 2 or not (np.isfinite(radii) & (radii > 0)).all():
            checks.refuse("radii", expected, self.radii)
        checks.whole("dimension", self.dimension, least=2, most=3)
        checks.real("box", self.box, above=0)
        object.__setattr__(self, "radii", radii)
        super().__post_init__()
        jammed = self._inflation_at(SOFT_DENSITY[self.dimension]) / self.box
        if 2 * jammed * radii.max() > 1 / 3:
            msg = (
                "radii: expected bodies that are small beside the box, their jammed diameters at "
                f"most a third of its edge; got {len(radii)} bodies"
            )
            raise ValueError(msg)

    @classmethod
    @checked
    def monodisperse(cls, count: int, dimension: int = 3, box: float = 1.0) -> "PeriodicPacking":
        """Return ``count`` equal bodies."""
        checks.whole("count", count, least=2)
        return cls(np.ones(count), dimension, box)

    @classmethod
    @checked
    def bidisperse(
        cls, count: int, dimension: int = 2, ratio: float = 1.4, box: float = 1.0
    ) -> "PeriodicPacking":
        """Return equal numbers of small and large bodies, which do not crystallise ([OSLN])."""
        checks.whole("count", count, least=2)
        checks.real("ratio", ratio, above=0)
        return cls(np.where(np.arange(count) % 2, ratio, 1.0), dimension, box)

    @property
    def count(self) -> int:
        """The number of bodies ``N``."""
        return len(self.radii)

    @checked
    def density(self, inflation: float) -> float:
        """Return the part of the box that the inflated bodies fill."""
        found = self._filled * math.prod([inflation / self.box] * self.dimension)
        if not math.isfinite(found):
            checks.refuse("inflation", "one of a finite density", inflation)
        return found

    def scattered(self, rng: "np.random.Generator | int | None" = None) -> Array:
        """Return ``N`` independent uniform centres, ``(N, d)``."""
        rng = checks.generator("rng", rng)
        return np.asarray(rng.random((self.count, self.dimension)) * self.box)

    @checked
    def soft_start(
        self,
        rng: "np.random.Generator | int | None" = None,
        *,
        iterations: int = 20_000,
        overlap: float = 1e-5,
    ) -> Array:
        """Return centres ``(N, d)`` of soft bodies that push each other apart, nearly jammed.

        From scattered centres they are pushed apart by L-BFGS until the forces balance, and
        deflated, in turn.  This saves most of the linear programmes.

        Parameters
        ----------
        rng : random generator or seed, optional
            For the scattered centres.
        iterations : int, optional
            Limit on the iterations after each deflation; most end earlier, in equilibrium.
        overlap : float, optional
            Mean overlap, relative to the sum of radii, at which the deflations end.
        """
        iterations = checks.whole("iterations", iterations, least=1)
        checks.real("overlap", overlap, above=0)
        radii = self.radii * self._inflation_at(SOFT_DENSITY[self.dimension])
        return decompressed(self.scattered(rng), radii, self.box, iterations, overlap=overlap)

    @checked
    def jam(
        self,
        start: "ArrayLike | np.random.Generator | int | None" = None,
        *,
        max_programmes: int = 500,
        progress: Callable[[int, float], None] | None = None,
    ) -> JammedPacking:
        """Inflate until nothing moves: a chain of linear programmes, then Newton's method.

        Parameters
        ----------
        start : (N, d) array, random generator or seed, optional
            Where to start; a generator or seed chooses a :meth:`soft_start`.
        max_programmes : int, optional
            Limit on the linear programmes.
        progress : callable, optional
            Called after every programme with its number and the largest displacement of a body
            that carries force, in mean diameters.

        Returns
        -------
        JammedPacking
            Its verdict says whether a strict maximum was reached.
        """
        checks.whole("max_programmes", max_programmes, least=1)
        if start is None or isinstance(start, np.random.Generator | int):
            centres = self.soft_start(checks.generator("start", start))
        else:
            centres = self._centres(start)
        guess = self._inflation_at(0.95)
        unit = 2 * self._inflation_at(SOFT_DENSITY[self.dimension]) * float(self.radii.mean())
        scaled = _Scaled(self, unit, unit / (2 * float(self.radii.mean())))
        inflation = largest_inflation(centres, self.radii, self.box, guess)
        q = np.append(centres.ravel() / unit, inflation / scaled.factor)
        end = descend(scaled.landscape(), q, reach=REACH, limit=max_programmes, progress=progress)
        return scaled.jammed(end)

    def _centres(self, start: ArrayLike) -> Array:
        expected = f"finite centres of shape ({self.count}, {self.dimension})"
        centres = checks.numbers("start", start, f"{expected}, a random generator or a seed")
        if centres.shape != (self.count, self.dimension) or not np.isfinite(centres).all():
            checks.refuse("start", expected, np.shape(start))
        return centres

    def _inflation_at(self, density: float) -> float:
        return float(self.box * (density / self._filled) ** (1 / self.dimension))

    @property
    def _filled(self) -> float:
        """The area or volume of the bodies as they are given."""
        ball = math.pi if self.dimension == 2 else 4 * math.pi / 3
        return float(ball * (self.radii**self.dimension).sum())


@dataclass(frozen=True)
class _Scaled:
    """The packing with lengths in units of ``unit`` and inflations in units of ``factor``."""

    packing: PeriodicPacking
    unit: float
    factor: float

    @property
    def radii(self) -> Array:
        return self.packing.radii * (self.factor / self.unit)

    @property
    def box(self) -> float:
        return self.packing.box / self.unit

    def near(self, q: Array, reach: float) -> SparseRows:
        """Return the gaps that may close within a box of the size ``reach`` around ``q``."""
        d, s = self.packing.dimension, float(q[-1])
        # Two bodies approach by at most 2 sqrt(d) reach; the inflation closes gaps, too.
        farthest = 2 * math.sqrt(d) * reach + 1e-6 + 2 * reach * float(self.radii.max())
        pairs, images, _ = neighbours(q[:-1].reshape(-1, d), self.radii, s, self.box, farthest)
        sums = self.radii[pairs].sum(axis=1)
        return rows_of(pairs, images, sums, self.packing.count, d)

    def level(self, displacement: Array, used: NDArray[np.bool_]) -> Array:
        """Return a step without the mean translation of the bodies that carry force."""
        d = self.packing.dimension
        moved = displacement[:-1].reshape(-1, d)
        carrying = used[:-1].reshape(-1, d)[:, 0]
        if not carrying.any():
            return displacement
        return np.append((moved - moved[carrying].mean(axis=0)).ravel(), displacement[-1])

    def pinned(self, used: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the coordinates of one body that carries force."""
        d = self.packing.dimension
        first = int(np.argmax(used[:-1])) // d
        return np.arange(first * d, (first + 1) * d)

    def landscape(self) -> ChainEnergy:
        gradient = np.zeros(self.packing.count * self.packing.dimension + 1)
        gradient[-1] = -1.0
        return ChainEnergy(gradient, self.near, self.level, self.pinned)

    def jammed(self, end: ChainEnd) -> JammedPacking:
        """Return what a chain has ended at, in units of the packing."""
        d = self.packing.dimension
        centres = end.point[:-1].reshape(-1, d) * self.unit
        (group,) = end.held.groups or (None,)
        pairs = np.empty((0, 2), dtype=np.int64)
        images = np.empty((0, d))
        if group is not None:
            pairs = group.reads[:, [0, d]] // d
            images = group.parameters[:, :d] * self.unit
        return JammedPacking(
            radii=self.packing.radii,
            box=self.packing.box,
            centres=centres,
            inflation=float(end.point[-1]) * self.factor,
            pairs=pairs,
            images=images,
            forces=end.multipliers * (self.factor / self.unit),
            programmes=end.programmes,
            converged=end.corner is not None,
        )

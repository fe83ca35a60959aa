"""Attempts to find the stationary points near items that are left.

Newton's method in doubles, many points at a time, proposes KKT points; a screen then guesses boxes
in which Krawczyk's operator will show one.  It makes the same tests as
:mod:`~polycorner.proofs.lists.faces`, with compiled enclosures of derivatives and matrices in
floating point without regard to rounding: they prove nothing and save nearly all attempts in ball
arithmetic that would fail.
"""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.branches import Mask
from polycorner.proofs.lists.examination import Examined
from polycorner.proofs.lists.faces import (
    GROWTH,
    MOST_WIDENING,
    QUARTERINGS,
    WIDENINGS,
)
from polycorner.proofs.lists.known import Setting, Tried
from polycorner.proofs.lists.loci import locus, met
from polycorner.proofs.lists.tree import Batch
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH

MOST_STEPS = 20
STRIDE = 0.5  # longest step in scale units
Sides = tuple[Array, Array]
SURE = 0.8  # of the unknowns' radii, below which those of the image are small enough
Mapped: TypeAlias = Callable[..., Iterable[Any]]
PART = 512  # starts that Newton's method goes on from at a time, at most
ATTEMPTS = 1024  # candidates that are tried in one round
EVERY = 2  # bisections of every coordinate between two attempts at a box
LOCUS = (-1,)  # in place of the functions of a face
MANY = 48  # candidates for which it is worth compiling second derivatives


def bordered(bent: Array, rows: Array) -> Array:
    """Return the Jacobians of KKT equations, from Hessians ``(B, n, n)`` and rows ``(B, k, n)``."""
    n, k = bent.shape[1], rows.shape[1]
    found = np.zeros((len(bent), n + k, n + k))
    found[:, :n, :n], found[:, n:, :n] = bent, rows
    # Not symmetric: with this sign the unknowns are multipliers as certificates state them.
    found[:, :n, n:] = -rows.transpose(0, 2, 1)
    return found


def solved(matrix: Array, right: Array) -> Array:
    """Return the solutions ``(B, N)`` of linear systems, NaN for those that are singular."""
    columns = right[:, :, None]
    return _each(np.linalg.solve, np.full_like(columns, np.nan), matrix, columns)[:, :, 0]


def inverted(matrix: Array) -> Array:
    """Return the inverses ``(B, N, N)``, NaN for matrices that are singular."""
    return _each(np.linalg.inv, np.full_like(matrix, np.nan), matrix)


def _each(function: Callable[..., Array], found: Array, *arrays: Array) -> Array:
    """Put results of a function into an array, where the matrix is not singular."""
    fine = _regular(arrays[0])
    try:
        found[fine] = function(*(array[fine] for array in arrays))
    except np.linalg.LinAlgError:  # a pivot was zero after all: rounding decides that
        for k in np.flatnonzero(fine):
            with suppress(np.linalg.LinAlgError):
                found[k] = function(*(array[k] for array in arrays))
    return found


def _regular(matrix: Array) -> NDArray[np.bool_]:
    """Return which matrices are eliminated without a pivot of zero."""
    regular: NDArray[np.bool_] = np.linalg.slogdet(matrix)[0] != 0
    return regular


@dataclass
class FacesOfPoints:
    """Rows of the functions that vanish on faces, one face for each point.

    ``rows`` ``(B, k)`` are the active inequalities, filled up to the most that a face has, then the
    equations; ``filled`` says which of them only fill up.
    """

    rows: NDArray[np.intp]
    filled: Mask

    @classmethod
    def of(cls, problem: Problem, active: Mask) -> "FacesOfPoints":
        """Return the faces with some active inequalities ``(B, m)``."""
        counts = active.sum(axis=1)
        most = int(counts.max(initial=0))
        # A stable sort brings the active ones to the front in the order of their rows.
        first = np.argsort(~active, axis=1, kind="stable")[:, :most]
        others = np.arange(problem.inequalities, problem.rows - 1)
        rows = np.hstack([first, np.broadcast_to(others, (len(active), len(others)))])
        filled = np.zeros(rows.shape, dtype=np.bool_)
        filled[:, :most] = np.arange(most) >= counts[:, None]
        return cls(rows, filled)

    def of_rows(self, which: NDArray[np.intp], quantity: Array) -> Array:
        """Return the rows of a quantity ``(b, M, ...)`` at some of the points, 0 for fillings."""
        found: Array = quantity[np.arange(len(which))[:, None], self.rows[which]]
        found[self.filled[which]] = 0.0
        return found


def newton(
    problem: Problem,
    q: Array,
    active: Mask,
    free: Sequence[int],
    reach: ArrayLike = np.inf,
) -> tuple[Array, NDArray[np.bool_]]:
    """Return solutions near some points of the KKT equations of a face each.

    Parameters
    ----------
    problem : Problem
    q : (B, n) array
        Starting points.
    active : (B, m) array of bool
        Inequalities that vanish on the face.
    free : sequence of int
        Coordinates that are unknowns.
    reach : (B,) array, optional
        How far from the start in scale units a solution may be; the method is ended at points that
        are twice as far.

    Returns
    -------
    points : (B, n) array
    found : (B,) array of bool
        Where the method has settled, with positive multipliers of the inequalities.
    """
    faces, free = FacesOfPoints.of(problem, active), list(free)
    n, units, count = len(free), problem.scales[free], faces.rows.shape[1]
    start, reach = q, np.broadcast_to(reach, len(q))
    q, lam, found = q.copy(), np.zeros((len(q), count)), np.zeros(len(q), dtype=np.bool_)
    # Points that have settled leave `going`: those that take longer cost no evaluations of them.
    going, unit = np.arange(len(q)), np.arange(n, n + count)
    for step in range(MOST_STEPS):
        values, gradients, hessians = problem.evaluate(q[going], 2)
        bends = faces.of_rows(going, hessians)[:, :, free][:, :, :, free]
        bent = hessians[:, -1][:, free][:, :, free]
        fine = np.isfinite(values).all(axis=1) & np.isfinite(bends).all(axis=(1, 2, 3))
        fine &= np.isfinite(bent).all(axis=(1, 2))
        slopes = faces.of_rows(going, gradients)[fine][:, :, free]
        pull, values = gradients[fine, -1][:, free], faces.of_rows(going, values)[fine]
        going, bends, bent = going[fine], bends[fine], bent[fine]
        # Multipliers are those of least squares at the start: a bad guess of them would throw q far
        # off.
        if step == 0 and count:
            lam[going] = np.einsum("bik,bi->bk", np.linalg.pinv(slopes), pull)
        weights = lam[going]
        matrix = bordered(bent - np.einsum("bk,bkij->bij", weights, bends), slopes)
        # A row that only fills up says that its multiplier does not change.
        matrix[:, unit, unit] = faces.filled[going]
        balance = pull - np.einsum("bk,bki->bi", weights, slopes)
        change = solved(matrix, -np.concatenate([balance, values], axis=1))
        # The step of the multipliers has other units, and does not tell whether a point has
        # settled.
        length = abs(change[:, :n]).max(axis=1, initial=0.0)
        with np.errstate(divide="ignore"):
            # Far from a solution a step may leave the place where formulas are defined.
            change *= np.minimum(1.0, STRIDE / length)[:, None]
        fine = np.isfinite(change).all(axis=1)
        going, change, length = going[fine], change[fine], length[fine]
        q[going[:, None], free] += change[:, :n] * units
        lam[going] += change[:, n:]
        away = abs((q[going] - start[going])[:, free] / units).max(axis=1, initial=0.0)
        # A solution far from its start is that of another box, where it is found from nearby.
        found[going[(length < DEFAULT.rounding) & (away <= reach[going])]] = True
        going = going[(length >= DEFAULT.rounding) & (away <= 2 * reach[going])]
        if not going.size:
            break
    # Of equations any sign will do, of inequalities positive ones alone: zeros are degenerate.
    most = count - (problem.rows - 1 - problem.inequalities)
    return q, found & ((lam > 0) | faces.filled)[:, :most].all(axis=1)


def active_sets(weights: Array, pulls: Array) -> Mask:
    """Return the functions ``(B, m)`` that balance the energy in nearest combinations.

    From the weights and the lengths of the gradients, ``(B, m + 1)`` each, the energy's last.
    """
    forces = weights * pulls
    most = forces.max(axis=1, keepdims=True, initial=0.0)
    with np.errstate(invalid="ignore"):
        # A smaller share of the largest force is what the nearest combination leaves of zero.
        return np.asarray((forces[:, :-1] > 1e-6 * most) & (most > 0))


@dataclass
class Screen:
    """KKT points of one face, approximately, about which boxes are tried."""

    setting: Setting
    active: Sequence[int]
    q: Array

    def __post_init__(self) -> None:
        problem, m = self.setting.problem, self.setting.problem.inequalities
        self.rows = [*self.active, *range(m, problem.rows - 1), problem.rows - 1]
        self.free = list(self.setting.domain.free)
        values, slopes, bends = problem.evaluate(self.q, 2)
        free, units = self.free, problem.scales[self.free]
        self.values = values[:, self.rows[:-1]]
        self.start = (
            slopes[:, self.rows][:, :, free] / units,
            bends[:, self.rows][:, :, free][:, :, :, free] / np.outer(units, units),
        )

    def radii(self, widest: Array) -> Array:
        """Return the radii ``(B, n)`` of the widest boxes that pass, NaN where none does."""
        scales = self.setting.problem.scales[self.free]
        found = np.full((len(self.q), len(self.free)), np.nan)
        left = np.arange(len(self.q))
        for power in range(QUARTERINGS):
            # The radii that `EnclosedFaces.reaches` tries, so that a guess fits one of its
            # attempts.
            reach = np.minimum(widest[left], SEARCH.widest)[:, None] / 4**power * scales
            found[left] = self._widened(left, reach)
            left = left[np.isnan(found[left]).any(axis=1)]
            if not left.size:
                break
        result = np.zeros_like(self.q)
        result[:, self.free] = found
        return result

    def _widened(self, which: NDArray[np.intp], radii: Array) -> Array:
        """Return radii that pass for some points, starting from given ones; NaN for none."""
        found, going = np.full_like(radii, np.nan), np.arange(len(which))
        for _ in range(WIDENINGS):
            here = radii[going]
            images, sure = self._images(which[going], here)
            found[going[sure]] = here[sure]
            with np.errstate(invalid="ignore"):
                more = ~sure & (images <= MOST_WIDENING * here).all(axis=1)
            # Never narrower than before, and wider than the image by some margin, so that the next
            # one fits.
            radii[going[more]] = np.maximum(here[more], GROWTH * images[more])
            going = going[more]
            if not going.size:
                break
        return found

    def _bounds(self, lower: Array, upper: Array) -> tuple[Sides, Sides]:
        """Return middles and radii of derivatives of the face's rows."""
        ends = self.setting.functions.mean_value_gradients(lower, upper, hessians=True)
        g_lo, g_hi = (side[:, self.rows][:, :, self.free] for side in ends[:2])
        h_lo, h_hi = (side[:, self.rows][:, :, self.free][:, :, :, self.free] for side in ends[2:])
        with np.errstate(all="ignore"):
            # Infinite ends give NaN here, which `_images` sorts out before it inverts anything.
            middles = [0.5 * (low + high) for low, high in ((g_lo, g_hi), (h_lo, h_hi))]
            radii = [0.5 * (high - low) for low, high in ((g_lo, g_hi), (h_lo, h_hi))]
        return (middles[0], radii[0]), (middles[1], radii[1])

    def _images(self, which: NDArray[np.intp], radii: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return radii of the images of boxes about some points, and whether these pass."""
        reach = np.zeros((len(which), self.q.shape[1]))
        reach[:, self.free] = radii
        for i, (low, high) in self.setting.domain.held.items():
            reach[:, i] = 0.5 * (high - low)
        q, n, k = self.q[which], len(self.free), len(self.active)
        (g, g_rad), (h, h_rad) = self._bounds(q - reach, q + reach)
        fine = np.isfinite(g_rad).all(axis=(1, 2)) & np.isfinite(h_rad).all(axis=(1, 2, 3))
        images, sure = np.full_like(radii, np.nan), np.zeros(len(which), dtype=np.bool_)
        which, g, g_rad, h, h_rad = which[fine], g[fine], g_rad[fine], h[fine], h_rad[fine]
        rows, rows_rad = g[:, :-1], g_rad[:, :-1]
        # The steps of `faces.enclosed_multipliers` and `kkt.krawczyk`, in doubles and for many
        # boxes.
        left = np.linalg.pinv(rows.transpose(0, 2, 1))
        lam = np.einsum("bij,bj->bi", left, g[:, -1])
        defect = np.eye(lam.shape[1]) - abs(left) @ rows_rad.transpose(0, 2, 1)
        pull = g_rad[:, -1] + np.einsum("bki,bk->bi", rows_rad, abs(lam))
        spread = solved(defect, np.einsum("bij,bj->bi", abs(left), pull))
        # Multipliers get boxes twice as wide as their enclosure, as `faces.wider` makes them.
        rho = np.concatenate([radii[fine], 2 * spread], axis=1)
        weights = np.concatenate([-lam, np.ones((len(lam), 1))], axis=1)
        slopes, bends = self.start[0][which], self.start[1][which]
        inverse = inverted(bordered(np.einsum("bk,bkij->bij", weights, bends), slopes[:, :-1]))
        jacobian = bordered(np.einsum("bk,bkij->bij", weights, h), rows)
        apart = np.einsum("bk,bkij->bij", abs(weights), h_rad)
        apart += np.einsum("bk,bkij->bij", 2 * spread, abs(h[:, :-1]) + h_rad[:, :-1])
        wide = abs(bordered(apart, rows_rad))
        residual = np.einsum("bk,bki->bi", weights, slopes)
        residual = np.concatenate([residual, self.values[which]], axis=1)
        shrink = abs(np.eye(rho.shape[1]) - inverse @ jacobian) + abs(inverse) @ wide
        image = abs(np.einsum("bij,bj->bi", inverse, residual))
        image += np.einsum("bij,bj->bi", shrink, rho)
        with np.errstate(invalid="ignore"):
            fit = (spread >= 0).all(axis=1) & (lam[:, :k] > spread[:, :k]).all(axis=1)
            sure[fine] = fit & (image < SURE * rho).all(axis=1)
        images[fine] = np.where(fit[:, None], image[:, :n], np.nan)
        return images, sure


@dataclass
class Starts(Batch):
    """Points to start from.

    With the functions that seem active there, the widest regions to try, and whether the energy's
    derivative may vanish nearby.
    """

    q: Array
    active: Mask
    widest: Array
    still: Mask


@dataclass
class Attempts:
    """Attempts, what they found, and which were in vain.

    ``sharp``: whether second derivatives are compiled already.
    """

    setting: Setting
    sharp: bool = False
    failed: Tried = field(init=False)

    def __post_init__(self) -> None:
        self.failed = Tried(self.setting.problem.scales)

    def at(self, examined: Sequence[Examined], mapped: Mapped = map) -> None:
        """Try boxes in which no candidate was tried for some bisections, longest ago first.

        ``mapped`` applies a function to each of some arguments, like ``map``.
        """
        parts, chosen = [], []
        for e in examined:
            ripe = self._ripe(e)
            if ripe.size:
                parts.append(self._starts(e, ripe))
                chosen.append((e, e.where[e.rest.items[ripe]]))
        if not parts:
            return
        # The limit is one for all chunks, so that it does not matter into how many boxes are
        # divided.
        since = np.concatenate([e.boxes.since[boxes] for e, boxes in chosen])
        # Those that have waited longest; ties in the order of the boxes, whatever the threads did.
        order = np.argsort(-since, kind="stable")[:ATTEMPTS]
        tried = np.zeros(len(since), dtype=np.bool_)
        tried[order] = True
        place = 0
        for e, boxes in chosen:
            # Those that had no turn keep their age, and are among the first in the next round.
            e.boxes.since[boxes[tried[place : place + len(boxes)]]] = 0
            place += len(boxes)
        self.run(Starts.joined(parts).part(order), mapped)

    def _ripe(self, e: Examined) -> NDArray[np.intp]:
        """Return positions in the rest of the items to try, one for a box."""
        left = e.open_items
        # Newton's method from a box and from its half leads to the same point: bisect a few times
        # first.
        ripe = left[
            e.boxes.since[e.where[e.rest.items[left]]] >= EVERY * len(self.setting.domain.free)
        ]
        return ripe[np.unique(e.where[e.rest.items[ripe]], return_index=True)[1]]

    def _starts(self, e: Examined, ripe: NDArray[np.intp]) -> Starts:
        boxes = e.boxes.part(e.where[e.rest.items[ripe]])
        widths = ((boxes.upper - boxes.lower) / self.setting.problem.scales)[
            :, self.setting.domain.free
        ]
        active = active_sets(e.rest.weights[ripe], e.rest.pulls[ripe])
        still = np.zeros(len(ripe), dtype=np.bool_)
        if self.setting.may_have_loci:
            # All components of the energy's derivative enclose 0: only there a locus can pass.
            still = ((e.rest.low[ripe, -1] <= 0) & (e.rest.high[ripe, -1] >= 0)).all(axis=1)
        return Starts(boxes.middles, active, SEARCH.surroundings * widths.max(axis=1), still)

    def run(self, starts: Starts, mapped: Mapped = map) -> None:
        """Try to find loci and regions from some points, for parameters in their middles."""
        if not len(starts.q):
            return
        q = starts.q.copy()
        for i, side in self.setting.domain.held.items():
            # Parameters are no unknowns: one value is polished, the enclosure covers all others.
            q[:, i] = 0.5 * sum(side)
        starts = replace(starts, q=q)
        if self.setting.may_have_loci:
            self._find_loci(starts.q[starts.still])
        each = np.array_split(np.arange(len(q)), -(-len(q) // PART))
        points = np.concatenate(list(mapped(self._candidates, map(starts.part, each))))
        fine = np.flatnonzero(np.isfinite(points).all(axis=1))
        # Points of one face are screened together, in the order in which they were found.
        kinds, which = np.unique(starts.active[fine], axis=0, return_inverse=True)
        order = np.argsort(which.ravel(), kind="stable")
        ends = np.searchsorted(which.ravel()[order], np.arange(1, len(kinds)))
        for active, here in zip(kinds, np.split(fine[order], ends), strict=False):
            self._show(points[here], tuple(np.flatnonzero(active).tolist()), starts.widest[here])

    def _find_loci(self, starts: Array) -> None:
        setting, known, z = self.setting, self.setting.known, self.setting.reads
        if setting.equations or not len(starts):
            return
        inside = np.zeros((len(starts), setting.problem.inequalities), dtype=np.bool_)
        points, found = newton(setting.problem, starts, inside, z)
        for q in points[found]:
            if known.has_value(q[list(z)]) or self.failed.has(LOCUS, q, SEARCH.widest):
                continue
            place = locus(setting.faces.formulas, z, q, setting.problem.scales, setting.domain.held)
            if place is None:
                self.failed.add(LOCUS, q, SEARCH.widest)
            elif not known.has_locus(place):
                shown = met(place, setting.functions, setting.conj, setting.domain)
                (known.missed if shown is None else known.loci).append(shown or place)

    def _candidates(self, starts: Starts) -> Array:
        """Return KKT points near some points, ``(B, n)``, NaN where there is none."""
        domain, slack = self.setting.domain, self.setting.domain.units
        points, found = newton(
            self.setting.problem, starts.q, starts.active, domain.free, starts.widest
        )
        # A point beside the domain may close boxes at its side; one far off never does.
        found &= (points >= domain.lower - slack).all(axis=1)
        found &= (points <= domain.upper + slack).all(axis=1)
        return np.where(found[:, None], points, np.nan)

    def _show(self, points: Array, active: tuple[int, ...], widest: Array) -> None:
        """Try regions about approximate KKT points of a face, each once."""
        fresh, grid = list[int](), set[bytes]()
        for i, (q, size) in enumerate(zip(points, widest.tolist(), strict=True)):
            # Starts in neighbouring boxes lead to one point: it is tried once.
            place = np.rint(q / (DEFAULT.same / 10 * self.setting.problem.scales)).tobytes()
            if place not in grid and self._is_new(q, active, size):
                grid.add(place)
                fresh.append(i)
        points, widest = points[fresh], widest[fresh]
        guesses: Array | None = None
        if len(fresh) >= (1 if self.sharp else MANY):
            guesses = Screen(self.setting, active, points).radii(widest)
        for i, (q, size) in enumerate(zip(points, widest.tolist(), strict=True)):
            guess = None if guesses is None else guesses[i]
            # A region that was added in this loop may contain the point.
            if not self._is_new(q, active, size):
                continue
            if guess is not None and np.isnan(guess).any():
                region = None
            else:
                region = self.setting.faces.region(q, active, size, guess)
            if region is None:
                self.failed.add(active, q, size)
            else:
                self.setting.known.add(region)

    def _is_new(self, q: Array, active: tuple[int, ...], widest: float) -> bool:
        return not self.setting.known.has(q, frozenset(active)) and not self.failed.has(
            active, q, widest
        )

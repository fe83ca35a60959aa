"""Basin hopping: descents from moved configurations, until nothing lower is found for a while.

Most arrangements that hold a record have more contacts than dimensions, or bodies that rattle.  A
descent is made for them: soft functions are minimised by L-BFGS, then linear programmes lead to a
corner; distances are convex, so that these converge quadratically there ([NW] sec. 18.5).
"""

import math
import os
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from scipy.optimize import minimize
from scipy.sparse import csr_array, hstack

from polycorner import checks, forms
from polycorner.container import JSON, FileKind
from polycorner.formulas.functions import SmoothFunction
from polycorner.formulas.rows import Mask, SparseRows
from polycorner.kinds import checked
from polycorner.minimisation.certificate import Certificate, certify
from polycorner.minimisation.methods import minimise
from polycorner.minimisation.sparse.programmes import Linearised, step
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.printing import Described
from polycorner.progress import Progress, silent
from polycorner.searches import Clock, Ending, Task, work_through
from polycorner.spaces.manifold import Array
from polycorner.tolerances import DEFAULT, SEARCH
from polycorner.values import Checked, cached_property

SEARCHES = FileKind("basin hopping", "basin_hopping(keep=...)", JSON)
SOFT = 2.0, 20.0  # stiffness of soft functions, one after the other, in scale units
ITERATIONS = 60  # of L-BFGS at each of them
PROGRAMMES = 30  # of a descent
REACH = 0.3  # first box of the linear programmes, in scale units
CENTRINGS = 12  # linear programmes that move rattling bodies apart from others
SHRINK = 0.25  # of the box after a step that does not lower the energy
FLAT = 0.1  # share of the median slope below which a function's own is not divided by


class Hopped(Protocol):
    """A model that basin hopping takes."""

    @property
    def polyhedron(self) -> Polyhedron:
        """Inequalities without unions."""

    @property
    def energy(self) -> SmoothFunction:
        """What is to be low."""

    def starts(self, rng: np.random.Generator, count: int) -> Array:
        """Return points of the polyhedron, ``(count, n)``."""

    def repaired(self, q: Array) -> Array:
        """Return a point of the polyhedron near ``q``, as low as it can cheaply be found."""

    def moved(self, q: Array, rng: np.random.Generator) -> Array:
        """Return another point, from which to descend."""


@dataclass(frozen=True)
class BasinHopping(Checked, Described):
    """What basin hopping has found.

    Attributes
    ----------
    model : CirclesIn, SpheresInCube, PointsOnSphere or the like
        See :func:`basin_hopping`.
    point : (n,) array
        The lowest point.
    hops, found_after : int
        How many descents there were, and after how many the lowest point was found.
    ending : Ending
        How the search ended.
    """

    model: Hopped
    point: Array
    hops: int
    found_after: int
    ending: Ending

    @property
    def energy(self) -> float:
        """The energy of the point."""
        return float(self.model.energy.value(self.point))

    @cached_property
    def certificate(self) -> Certificate:
        """The certificate of the point, which :func:`~polycorner.prove` takes."""
        return certify(self.model.polyhedron, self.model.energy, self.point)

    def __repr__(self) -> str:
        """Return energy, hops and ending in one line."""
        return (
            f"BasinHopping(energy {self.energy:.12g}, found after {self.found_after} of "
            f"{self.hops} descents; {self.ending.value})"
        )


class CornerDescent:
    """Descents on one model, in scale units."""

    def __init__(self, model: Hopped) -> None:
        self.model, self.manifold = model, model.polyhedron.manifold
        self.scales, n = self.manifold.scale_array, len(model.polyhedron.manifold.names)
        self.rows = SparseRows.of(model.polyhedron.functions, n)
        self.terms = SparseRows.of(model.energy.terms, n)

    def __call__(self, q: Array) -> Array:
        """Return a point of the polyhedron as low as a descent from ``q`` comes."""
        return self.to_corner(self.model.repaired(self.softly(q)))

    def settled(self, q: Array) -> Array:
        """Return the minimum near the end of a descent, to the last digits."""
        if self.rows.count:
            return self._apart(self.to_corner(q, 0.0))
        return np.array(minimise(self.model.polyhedron, self.model.energy, q).point)

    def softly(self, q: Array) -> Array:
        """Minimise the energy and ``mu / 2 sum min(f_i, 0)^2``, functions as long as gradients."""
        _, jacobian = self._scaled(self.rows, q)
        lengths = np.sqrt(jacobian.multiply(jacobian).sum(axis=1))
        flat = FLAT * float(np.median(lengths)) if len(lengths) else 1.0
        weights = 1 / np.maximum(lengths, flat)
        _, slope = self._scaled(self.terms, q)
        size = float(np.linalg.norm(slope.sum(axis=0))) or 1.0
        options = {"maxiter": ITERATIONS, "maxcor": 20}
        solve: Any = minimize  # whose stubs know no function that returns a gradient, too
        for stiffness in SOFT if self.rows.count else SOFT[:1]:
            arguments = (weights, stiffness * size)
            u = self.manifold.onto(q) / self.scales
            found = solve(self._soft, u, arguments, "L-BFGS-B", jac=True, options=options)
            q = self.manifold.onto(found.x * self.scales)
        return q

    def to_corner(self, q: Array, level: float = DEFAULT.level) -> Array:
        """Solve linear programmes until none lowers the energy, relatively, by ``level``."""
        energy, reach = self._energy(q), REACH
        for _ in range(PROGRAMMES if self.rows.count else 0):
            found = self._programme(q, reach) if reach > DEFAULT.settled else None
            if found is None:
                break
            displacement, carrying = found
            size = float(abs(displacement[carrying]).max(initial=0.0))
            tried = self.model.repaired(self.manifold.onto(q + displacement * self.scales))
            lowered = energy - self._energy(tried)
            if lowered > 0:
                q, energy = tried, energy - lowered
                reach = min(reach, SEARCH.wider_linear * size)
            else:
                reach *= SHRINK
            if 0 < lowered < level * abs(energy):
                break
        return q

    def _programme(self, q: Array, reach: float) -> tuple[Array, Mask] | None:
        """Return the step of one linear programme, and the coordinates that multipliers hold."""
        values, jacobian = self._scaled(self.rows, q)
        _, slope = self._scaled(self.terms, q)
        near = np.flatnonzero(values <= reach * abs(jacobian).sum(axis=1))
        held, sections = jacobian[near], self._tangents(q)
        nothing = np.zeros(sections.shape[0])
        gradient = np.asarray(slope.sum(axis=0), dtype=np.float64)
        at = Linearised(values[near], held, nothing, sections, gradient)
        found = step(at, np.full(len(q), reach))
        if found is None:
            return None
        strong = found.multipliers > DEFAULT.multiplier * found.multipliers.max(initial=0.0)
        return found.displacement, abs(held[np.flatnonzero(strong)]).sum(axis=0) > 0

    def _apart(self, q: Array) -> Array:
        """Move what no multiplier holds to the middle of its room: its least function grows."""
        found = self._programme(q, DEFAULT.near)
        if found is None or found[1].all():
            return q
        loose, reach = ~found[1], np.append(np.full(len(q), REACH), 1.0)
        growth = np.append(np.zeros(len(q)), -1.0)
        for _ in range(CENTRINGS):
            values, jacobian = self._scaled(self.rows, q)
            free = csr_array(jacobian.multiply(loose))
            near = np.flatnonzero(abs(free).sum(axis=1))
            if not len(near):
                break
            rows, sections = (
                _wider(part, x) for part, x in ((free[near], -1), (self._tangents(q), 0))
            )
            at = Linearised(values[near], rows, np.zeros(sections.shape[0]), sections, growth)
            moved = step(at, reach)
            if moved is None:
                break
            tried = self.manifold.onto(q + moved.displacement[:-1] * loose * self.scales)
            if self.rows.values(tried)[near].min() > values[near].min():
                q = tried
            else:
                reach[:-1] *= SHRINK
        return q

    def _tangents(self, q: Array) -> csr_array:
        """Return the conditions on displacements of unit vectors."""
        rows = np.zeros((len(self.manifold.factors), len(q)))
        for row, factor in zip(rows, self.manifold.factors, strict=True):
            row[factor.at] = q[factor.at]
        return csr_array(rows * self.scales)

    def _soft(self, u: Array, weights: Array, stiffness: float) -> tuple[float, Array]:
        q = self.manifold.onto(u * self.scales)
        value, slope = 0.0, np.zeros(len(q))
        for group in self.terms.groups:
            values, slopes = group.evaluate(q, 1)
            value += float(values.sum())
            slope += np.bincount(group.read.ravel(), slopes.ravel(), len(q))
        for group in self.rows.groups:
            values, slopes = group.evaluate(q, 1)
            weight = weights[group.rows]
            below = np.flatnonzero(values < 0)
            missing = weight[below] * values[below]
            value += stiffness / 2 * float(missing @ missing)
            pull = (stiffness * weight[below] * missing)[:, None] * slopes[below]
            slope += np.bincount(group.read[below].ravel(), pull.ravel(), len(q))
        slope *= self.scales
        for factor in self.manifold.factors:
            # The energy is that of the unit vector, whichever length the vector has.
            along, length = q[factor.at], np.linalg.norm(u[factor.at] * self.scales[factor.at])
            part = slope[factor.at]
            slope[factor.at] = (part - (part @ along) * along) / length
        return value, slope

    def _scaled(self, rows: SparseRows, q: Array) -> tuple[Array, csr_array]:
        values, jacobian = rows.evaluate(q)
        return values, csr_array(jacobian.multiply(self.scales))

    def _energy(self, q: Array) -> float:
        return float(self.terms.values(q).sum())


def _wider(rows: csr_array, entry: float) -> csr_array:
    """Return a matrix with one column more."""
    column = csr_array(np.full((rows.shape[0], 1), entry))
    return csr_array(hstack([rows, column]))


class _Search:
    """The state of a search; it can be saved between two descents."""

    def __init__(self, model: Hopped, rng: np.random.Generator, patience: int) -> None:
        self.model, self.rng, self.patience = model, rng, patience
        self.descent = CornerDescent(model)
        self.hops = self.found_after = self.since = 0
        self.current: Array | None = None
        self.best: Array | None = None

    def hop(self) -> None:
        """Descend from a moved point, or from a new one after ``patience`` hops for nothing."""
        rng = deepcopy(self.rng)  # an interrupted descent leaves no trace
        current = None if self.since >= self.patience else self.current
        start = self.model.starts(rng, 1)[0] if current is None else self.model.moved(current, rng)
        found = self.descent(start)
        lower = self._below(found, current)
        self.since = 0 if lower else self.since + 1
        self.current = found if lower else self.current
        self.hops, self.rng = self.hops + 1, rng
        if self._below(found, self.best):
            self.best, self.found_after = found, self.hops

    def _below(self, found: Array, other: Array | None) -> bool:
        if other is None:
            return True
        energies = [self.model.energy.value(q) for q in (found, other)]
        return bool(energies[0] < energies[1] - DEFAULT.level * abs(energies[1]))

    def tasks(self, hops: int, below: float) -> Iterator[Task]:
        """Yield descents, until there were enough or one has ended below a level."""
        enough = below + DEFAULT.level * abs(below) if math.isfinite(below) else below
        while self.best is None or self.model.energy.value(self.best) > enough:
            yield self.hops < hops, self.hop

    def entries(self) -> dict[str, Any]:
        """Return the state as plain values."""
        return {
            "model": repr(self.model),
            "patience": self.patience,
            "counts": [self.hops, self.found_after, self.since],
            "points": [None if q is None else q.tolist() for q in (self.current, self.best)],
            "random": forms.generator_entry(self.rng),
        }

    def restore(self, path: Path) -> None:
        """Take the state of a file over."""
        entries, ours = SEARCHES.load_json(path), (repr(self.model), self.patience)
        with SEARCHES.reading(path):
            read = _SAVED("", entries)
            rng = forms.read_generator("random", read["random"])
        if (read["model"], read["patience"]) != ours:
            told = f"{read['model']} with patience {read['patience']}"
            checks.refuse("keep", "a search of {} with patience {}".format(*ours), told)
        with SEARCHES.reading(path):
            point = self.model.polyhedron.manifold.point
            points = [None if q is None else self.model.repaired(point(q)) for q in read["points"]]
        self.hops, self.found_after, self.since = read["counts"]
        self.current, self.best = points
        self.rng = rng


_SAVED = forms.entries(
    {
        "model": forms.text,
        "patience": forms.count,
        "counts": forms.row(forms.count, forms.count, forms.count),
        "points": forms.many(forms.optional(forms.many(forms.number())), exactly=2),
        "random": forms.anything,
    }
)


@checked
def basin_hopping(
    model: Hopped,
    rng: "np.random.Generator | int | None" = None,
    *,
    hops: int = 200,
    seconds: float = math.inf,
    below: float = -math.inf,
    patience: int = 50,
    keep: "str | os.PathLike[str] | None" = None,
    progress: Progress = silent,
) -> BasinHopping:
    """Search for the lowest minimum of a model by descents from moved configurations.

    Each descent starts from the lowest configuration so far, moved, and replaces it if it ends
    lower; after ``patience`` descents for nothing the next one starts anywhere ([WD]).  Nothing is
    proved: the search may end at any local minimum.

    Parameters
    ----------
    model : CirclesIn, SpheresInCube, PointsOnSphere or the like
        It has ``polyhedron``, ``energy``, ``starts(rng, count)``, ``repaired(q)`` (a point of the
        polyhedron nearby, as low as it can cheaply be found) and ``moved(q, rng)``.
    rng : random generator or seed, optional
        One seed gives one sequence of descents, however often the search is interrupted.
    hops, seconds : int and float, optional
        Limits on the number of descents, those of the file included, and on the time.
    below : float, optional
        An energy at which, up to the billionth part, the search ends, such as a published one.
    patience : int, optional
        Descents for nothing before a new start.
    keep : path, optional
        A file in which the state is kept; a search that finds it there goes on.
    progress : callable, optional
        Called after every descent with their number, the limit, and the lowest energy.

    Returns
    -------
    BasinHopping
        After Ctrl-C too, with what was found so far.

    Raises
    ------
    TypeError, ValueError
        For arguments of a wrong kind, or a file of another search.

    Examples
    --------
    >>> from polycorner.models import CirclesIn
    >>> found = basin_hopping(CirclesIn("square", 5), 1, hops=5)
    >>> round(-found.energy, 9), found.certificate.is_minimum
    (0.207106781, True)
    """
    hops = checks.whole("hops", hops, least=1)
    checks.real("seconds", seconds, above=0, infinite=True)
    checks.real("below", below, infinite=True)
    checks.whole("patience", patience, least=1)
    search = _Search(model, deepcopy(checks.generator("rng", rng)), patience)
    path = None if keep is None else Path(keep)
    if path is not None and path.exists():
        search.restore(path)
    clock = None if path is None else Clock(lambda: SEARCHES.save_json(path, search.entries()))

    def told() -> tuple[float, float, str]:
        lowest = math.inf if search.best is None else float(model.energy.value(search.best))
        return search.hops, hops, f"lowest energy {lowest:.12g}"

    tasks = search.tasks(hops, below)
    ending = work_through(tasks, told, progress, seconds=seconds, clock=clock)
    if clock is not None:
        clock.save()
    if search.best is None:
        raise KeyboardInterrupt  # before anything was found
    point = search.descent.settled(search.best)
    return BasinHopping(model, point, search.hops, search.found_after, ending)

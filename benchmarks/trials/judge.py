"""An independent judge of verdicts: SymPy's expressions, NumPy, SciPy and mpmath, nothing else.

A claimed local minimum is refuted by a feasible point nearby whose energy is lower.  Points are
sampled on spheres about it, from 1e-1 to 1e-3 of its size, carried back to the set by Newton's
method on the violated functions; and SLSQP looks for lower points in boxes about it.  A point that
is lower counts only if mpmath confirms both, with 30 digits and a margin far above the point's own
error; farther away, or behind a barrier, only if the energy stays below the point's all the way.
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
import sympy
from scipy.optimize import OptimizeWarning, minimize

Array = np.ndarray
Parts = tuple[mpmath.mpf, list[mpmath.mpf], list[mpmath.mpf]]  # energy, inequalities, equations
RADII = (1e-3, 1e-2, 3e-2, 1e-1)
TINY = (1e-9, 1e-7, 1e-5)  # for what is claimed to be no minimum, beside poles
NEAR = 1e-2  # up to which a lower point refutes without a way to it, unless there is a barrier
BARRIER = 1e-11  # relative rise of the energy all over the smallest sphere
FEASIBLE = 1e-9
EXACT = 1e-24  # violation of a point that counts, with 30 digits
SAME = 1e-6  # relative difference at which two energies count as the same
CLEARLY = 1 - 1e-5  # factor of a violation that has decreased
STEPS = 12  # on the way to a lower point


@dataclass(frozen=True)
class Lower:
    """A feasible point of lower energy: how far away, how much lower."""

    radius: float
    gain: float
    point: tuple[float, ...]


@dataclass(frozen=True)
class Judge:
    """A set and an energy as expressions; ``inequalities`` may contain ``Max`` for unions."""

    symbols: Sequence[sympy.Symbol]
    energy: sympy.Expr
    inequalities: Sequence[sympy.Expr]
    equations: Sequence[sympy.Expr]

    @cached_property
    def _double(self) -> Any:
        parts = [self.energy, *self.inequalities, *self.equations]
        return sympy.lambdify([list(self.symbols)], parts, ["scipy", "numpy"], cse=True)

    @cached_property
    def _digits(self) -> Any:
        parts = [self.energy, *self.inequalities, *self.equations]
        return sympy.lambdify([list(self.symbols)], parts, "mpmath")

    def values(self, q: Array) -> tuple[float, Array, Array]:
        """Return energy, inequalities and equations in double precision; nan where undefined."""
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                parts = [_real(value) for value in self._double(np.asarray(q, float))]
            except (ArithmeticError, ValueError, TypeError):
                parts = [np.nan] * (1 + len(self.inequalities) + len(self.equations))
        return parts[0], *np.split(np.array(parts[1:]), [len(self.inequalities)])

    def violation(self, q: Array) -> float:
        """Return the largest violation of a constraint."""
        _, g, h = self.values(q)
        worst = np.max(np.concatenate([[0.0], -g, abs(h)]))
        return float(worst) if np.isfinite(worst) else np.inf

    def confirmed(self, q: Array, p: Array) -> float:
        """Return how much lower ``p`` is than ``q`` beyond the margin, or 0 if it is not."""
        before, after = self._exactly(q), self._exactly(self._polished(p))
        if before is None or after is None:
            return 0.0
        gain, worst = before[0] - after[0], after[1]
        slope = self._slope(q)
        margin = 1e-14 * (1 + abs(before[0])) + slope * 1e-12 * (1 + np.abs(q).max())
        return float(gain) if worst <= EXACT and gain > margin else 0.0

    def _polished(self, p: Array) -> list[mpmath.mpf]:
        """Return ``p`` moved onto the set by Newton's method with 30 digits, as far as it goes.

        Where gradients vanish it does not go far, and nothing is concluded from such a point.
        """
        with mpmath.workdps(30):
            point = [mpmath.mpf(x) for x in p]
            for _ in range(10):
                here = self._parts(point)
                if here is None or _worst(here) <= EXACT:
                    break
                c = [*(g for g in here[1] if g < 0), *here[2]]
                size = max(map(abs, c))
                near = np.array([float(x) for x in point])
                rows = [i for i, g in enumerate(here[1]) if g < 0]
                J = _jacobian(lambda z, rows=rows: self._chosen(z, rows), near)
                if not np.isfinite(J).all():
                    break
                step = np.linalg.lstsq(J, np.array([float(v / size) for v in c]), rcond=1e-6)[0]
                point = [x - size * mpmath.mpf(float(s)) for x, s in zip(point, step, strict=True)]
        return point

    def _chosen(self, z: Array, rows: list[int]) -> Array:
        _, g, h = self.values(z)
        return np.concatenate([g[rows], h])

    def _exactly(self, q: Sequence[Any]) -> tuple[mpmath.mpf, mpmath.mpf] | None:
        """Return energy and violation with 30 digits, or None where they are not real."""
        parts = self._parts(q)
        return None if parts is None else (parts[0], _worst(parts))

    def _parts(self, q: Sequence[Any]) -> Parts | None:
        with mpmath.workdps(30):
            try:
                parts = [mpmath.mpmathify(v) for v in self._digits([mpmath.mpf(x) for x in q])]
            except (ArithmeticError, ValueError, TypeError):
                return None
            if any(mpmath.im(v) != 0 or not mpmath.isfinite(v) for v in parts):
                return None
            energy, *others = map(mpmath.re, parts)
            m = len(self.inequalities)
            return energy, others[:m], others[m:]

    def as_low(self, q: Array) -> tuple[float, ...] | None:
        """Return a point nearby on an axis or a diagonal with the very same energy, if any is."""
        q = np.asarray(q, float)
        rays = [*np.eye(len(q)), *(a + b for a in np.eye(len(q)) for b in np.eye(len(q)))]
        for ray in [*rays, *(-r for r in rays)]:
            ends = [self.carried(q + length * ray) for length in (0.1, 0.05)]
            if all(self._same(q, p) for p in ends):
                return tuple(map(float, ends[0]))
        return None

    def _same(self, q: Array, p: Array) -> bool:
        before, after = self._exactly(q), self._exactly(self._polished(p))
        if before is None or after is None or np.abs(p - q).max() < NEAR:
            return False
        return bool(after[1] <= EXACT and abs(before[0] - after[0]) <= 1e-26 * (1 + abs(before[0])))

    def _slope(self, q: Array) -> float:
        return float(np.nan_to_num(np.abs(_jacobian(lambda z: self.values(z)[0], q)).max()))

    def carried(self, p: Array) -> Array:
        """Return ``p`` moved onto the set by Newton's method on the violated functions."""
        for _ in range(8):
            if self.violation(p) <= 1e-13:
                break
            c, J = self._violated(p), _jacobian(self._violations(p), p)
            if not (np.isfinite(c).all() and np.isfinite(J).all()):
                break
            p = p - np.linalg.lstsq(J, c, rcond=1e-10)[0]
        return p

    def _violated(self, p: Array) -> Array:
        return self._violations(p)(p)

    def _violations(self, p: Array) -> Any:
        inside = self.values(p)[1] >= 0

        def functions(z: Array) -> Array:
            _, g, h = self.values(z)
            return np.concatenate([g[~inside], h])

        return functions

    def lower_points(
        self,
        q: Array,
        generator: np.random.Generator,
        radii: Sequence[float] = RADII,
        directions: int = 150,
    ) -> Iterator[Lower]:
        """Yield confirmed lower points that refute ``q`` as a local minimum, nearest first."""
        q = np.asarray(q, float)
        size, here = np.maximum(1.0, abs(q)), self.values(q)[0]
        barred = False
        for radius in radii:
            sphere = list(self._sampled(q, radius * size, generator, directions))
            if radius == RADII[0] and sphere:
                lowest = min(energy for energy, _ in sphere)
                barred = lowest - here > BARRIER * (1 + abs(here))
            candidates = [*sphere, *self._descended(q, radius * size, generator)]
            best = min(candidates, key=lambda c: c[0], default=None)
            if best is None or best[0] >= here:
                continue
            gain = self.confirmed(q, best[1])
            direct = radius <= NEAR and not barred
            if gain > 0 and (direct or self._downhill(q, best[1])):
                yield Lower(radius, gain, tuple(map(float, best[1])))

    def _sampled(
        self, q: Array, size: Array, generator: np.random.Generator, directions: int
    ) -> Iterator[tuple[float, Array]]:
        rays = generator.normal(size=(directions, len(q)))
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        axes = np.concatenate([np.eye(len(q)), -np.eye(len(q))])
        for ray in np.concatenate([axes, rays]):
            p = self.carried(q + size * ray)
            if np.all(abs(p - q) <= 2 * size) and self.violation(p) <= FEASIBLE:
                yield self.values(p)[0], p

    def _descended(
        self, q: Array, size: Array, generator: np.random.Generator
    ) -> Iterator[tuple[float, Array]]:
        for _ in range(3):
            p = self.slsqp(
                q + size * generator.uniform(-0.5, 0.5, len(q)),
                list(zip(q - size, q + size, strict=True)),
            )
            p = self.carried(p)
            if np.all(abs(p - q) <= 2 * size) and self.violation(p) <= FEASIBLE:
                yield self.values(p)[0], p

    def _downhill(self, q: Array, p: Array) -> bool:
        """Whether the energy stays below its value at ``q`` all the way from ``p``."""
        for k in range(1, STEPS + 1):
            between = self.carried(q + (p - q) * 0.6**k)
            if self.violation(between) > FEASIBLE or self.values(between)[0] > self.values(q)[0]:
                return False
        return True

    def slsqp(self, start: Array, bounds: Any = None) -> Array:
        """Return where SLSQP ends from a start, whether it converges or not."""
        constraints = []
        if self.inequalities:
            constraints.append({"type": "ineq", "fun": lambda z: _finite(self.values(z)[1])})
        if self.equations:
            constraints.append({"type": "eq", "fun": lambda z: _finite(self.values(z)[2])})
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore", OptimizeWarning)
            warnings.simplefilter("ignore", RuntimeWarning)
            try:
                found = minimize(
                    lambda z: float(_finite(self.values(z)[0])),
                    start,
                    method="SLSQP",
                    bounds=bounds,
                    constraints=constraints,
                    options={"ftol": 1e-14, "maxiter": 300},
                )
            except (ValueError, np.linalg.LinAlgError):
                return np.asarray(start, float)
        return np.asarray(found.x if np.isfinite(found.x).all() else start, float)

    def feasible_point(self, start: Array, generator: np.random.Generator) -> Array | None:
        """Return a feasible point found from about the start, or None."""
        start = np.asarray(start, float)
        for spread in (0.0, *[0.3] * 5, *[1.0] * 10, *[5.0] * 10):
            noise = generator.normal(size=len(start)) * spread
            p = self.carried(start + noise * np.maximum(1.0, abs(start)))
            if self.violation(p) <= FEASIBLE:
                return p
        return None

    def reachable(self, q: Array, generator: np.random.Generator) -> bool:
        """Whether feasible points exist and all violations decrease together from ``q``.

        At a point where they do not, some weighted sum of them is stationary.
        """
        if not self.less_violated_nearby(q, generator):
            return False
        return self.feasible_point(q, generator) is not None

    def less_violated_nearby(self, q: Array, generator: np.random.Generator) -> bool:
        """Whether every violation is clearly less at a point within 1e-2 of ``q``, and none new."""
        q = np.asarray(q, float)
        size = 1e-2 * np.maximum(1.0, abs(q))
        here = self._each_violation(q)
        c, J = self._violated(q), _jacobian(self._violations(q), q)
        rays = [size * generator.normal(size=len(q)) for _ in range(300)]
        if np.isfinite(c).all() and np.isfinite(J).all():
            norms = np.maximum(np.linalg.norm(J, axis=1), 1e-300)
            unit = J / norms[:, None]
            steps = [-(c @ J), -((c / norms) @ unit), -np.linalg.lstsq(J, c, rcond=1e-10)[0]]
            steps.append(-np.linalg.lstsq(J, norms * np.sign(c), rcond=1e-10)[0])
            lengths = [max(np.abs(step / size).max(), 1e-300) for step in steps]
            pairs = zip(steps, lengths, strict=True)
            rays += [step / length * 0.3**k for step, length in pairs for k in range(8)]
        around = (self._each_violation(q + ray) for ray in rays)
        return any(np.all(there <= CLEARLY * here) for there in around)

    def _each_violation(self, q: Array) -> Array:
        _, g, h = self.values(q)
        each = np.concatenate([np.maximum(-g, 0), abs(h)])
        return np.where(np.isfinite(each), each, np.inf)


def _worst(parts: Parts) -> mpmath.mpf:
    return max([mpmath.mpf(0), *(-g for g in parts[1]), *map(abs, parts[2])])


def _real(value: Any) -> float:
    number = complex(value)
    return number.real if number.imag == 0 else np.nan


def _finite(values: Any) -> Any:
    return np.nan_to_num(values, nan=1e10, posinf=1e10, neginf=-1e10)


def _jacobian(function: Any, q: Array) -> Array:
    columns = []
    for i in range(len(q)):
        step = np.zeros(len(q))
        step[i] = 1e-6 * max(1.0, abs(q[i]))
        columns.append((function(q + step) - function(q - step)) / (2 * step[i]))
    return np.stack(columns, axis=-1)

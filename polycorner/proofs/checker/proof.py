"""Proof in a file: why each of its boxes is closed."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from math import comb
from typing import Any

from flint import arb, arb_mat

from .balls import NAN, ZERO, column, different, dot, hull, moved, need, places, sides
from .faces import StoredPin, StoredRegion
from .problem import StoredProblem
from .symmetries import symmetries

PIECES = 4000  # into which a box is bisected at most
MOST_SETS = 500  # of functions that are looked at in a box


class StoredProof:
    """The problem of a file, with regions, loci and symmetries."""

    kind = "stationary points"  # that are listed
    related: Sequence[frozenset[int]] = ()  # functions with linear relations, tested
    loci: Sequence[StoredRegion] = ()
    ways: Sequence[list[float]] = ()
    points: Sequence[Any] = ()  # regions of those that are counted
    open = unproved = 0  # points that may be; linear relations that are tested

    def __init__(self, data: dict[str, Any]) -> None:
        self.p = p = StoredProblem(data)
        self.kind = "local minima" if p.minima_only else self.kind
        different(data["regions"], "a region is stated")
        self.regions: list[Any] = [
            StoredPin(p, r) if "corner" in r else StoredRegion(p, r, p.free, r["active"])
            for r in data["regions"]
        ]
        self.ways = [
            sides(r, ("way", "way"), p.n)[0] if "way" in r else [] for r in data["regions"]
        ]
        self.loci = [StoredRegion(p, r, r["z"], None) for r in data["loci"]]
        self.symmetries, self.periodic = symmetries(p, data)
        self.tested = sum(region.tested for region in self.regions)

    @property
    def axes(self) -> Sequence[int]:
        """The coordinates along which boxes are bisected."""
        return self.p.free

    def closed(self, lower: list[float], upper: list[float], hints: list[Any]) -> bool:
        """Whether a box is closed rightly, or every piece of a bisection of it."""
        ways = [[arb(x) for x in h] for h in hints]
        ways = [h for h in ways if all(h[i] == 0 or i in self.p.free for i in range(self.p.n))]
        waiting = [(lower, upper)]
        for _ in range(PIECES):
            lo, hi = waiting.pop()
            if not self.shown(lo, hi, ways):
                shares = [(hi[i] - lo[i]) / self.p.widths[i] for i in self.axes]
                axis = self.axes[shares.index(max(shares))] if shares else 0
                middle = 0.5 * (lo[axis] + hi[axis])
                if not lo[axis] < middle < hi[axis]:
                    return False
                waiting += [(lo, moved(hi, axis, middle)), (moved(lo, axis, middle), hi)]
            if not waiting:
                return True
        return False

    def shown(self, lo: list[float], hi: list[float], ways: list[list[arb]]) -> bool:
        """Whether a box is closed rightly."""
        if any(g.carries(lo, hi) for g in self.symmetries):
            return True
        box, memo = hull(lo, hi), dict[int, Any]()
        v, near = self.p.values(box), list[Any]()  # near: what a sharper enclosure reads, if any
        signs, turned = self.p.signs(v), list[Any]()
        regions, loci = ([f for f in all_ if f.holds(lo, hi)] for all_ in (self.regions, self.loci))

        def grows(row: int, w: list[arb]) -> arb:
            found = self.p.forms(v, row, memo)
            natural = dot([*found[0].values()], [w[i] for i in found[0]]) if found else NAN
            return self.slope(row, w, *near) if near else natural

        def leads(u: frozenset[int], w: list[arb]) -> bool:
            return all(grows(i, w) > 0 for i in u)

        def descends(u: frozenset[int]) -> bool:
            if any(u <= region.active for region in regions):
                return True
            turned[:] = turned or self.tangents(v, memo, ways)
            return any(grows(-1, w) < 0 and leads(u, w) for w in turned)

        def left(u: frozenset[int]) -> bool:
            several = regions or len(ways) > 1
            if descends(u) or (several and self.redundant(v, u, descends)):
                return True
            if self.p.minima_only and any(self.bends_down(u, v, w) for w in ways):
                return True
            along = (w for w in ways if loci and all(w[i] == 0 for i in loci[0].places))
            return bool(loci) and (not u or any(leads(u, w) for w in along))

        if all(map(left, self.p.open_sets(signs))):
            return True
        closer = [s or self.p.sign(v, row, memo, lo, hi) for row, s in enumerate(signs)]
        if closer != signs and all(map(left, self.p.open_sets(closer))):
            return True
        middle = [x.mid() for x in box]
        away = [x - c for x, c in zip(box, middle, strict=True)]
        near[:] = v, {}, self.p.values(middle), {}, away
        return bool(ways) and all(map(left, self.p.open_sets(closer)))

    def slope(
        self, row: int, w: list[arb], v: Any, memo: Any, middle: Any, there: Any, away: list[arb]
    ) -> arb:
        """Enclose ``dE w`` or ``df w`` on a box in mean value form, from its middle."""
        found, at = self.p.forms(v, row, memo, 2), self.p.forms(middle, row, there)
        if None in (found, at):
            return NAN
        bent = [ZERO] * self.p.n
        for (i, j), h in found[1].items():
            bent[j] += w[i] * h
        return dot([*at[0].values()], [w[i] for i in at[0]]) + dot(bent, away)

    def redundant(self, v: list[Any], u: frozenset[int], descends: Callable[..., bool]) -> bool:
        """Whether all largest sets of functions that can be independent have directions or regions.

        By Caratheodory's theorem this is enough where all functions are smooth.
        """
        p, memo = self.p, dict[int, Any]()
        top = len(p.free) - p.k
        if len(u) <= top or comb(len(u), top) > MOST_SETS:
            return False
        found = [p.forms(v, row, memo, 2) for row in (*u, *range(p.m, p.m + p.k + 1))]
        fine = None not in found and all(x.is_finite() for f in found for x in f[1].values())
        return fine and all(descends(frozenset(some)) for some in combinations(sorted(u), top))

    def bends_down(self, u: frozenset[int], v: list[Any], w: list[arb]) -> bool:
        """Whether no point of a box is a local minimum: a tangent vector has negative curvature.

        With ``L`` near the pseudoinverse of the gradients' transpose, multipliers solve
        ``(L G^T) lam = L dE``, and ``d = w + L^T y`` is tangent for ``(G L^T) y = -G w``.
        """
        p, memo = self.p, dict[int, Any]()
        found = [p.forms(v, row, memo, 2) for row in (*sorted(u), *range(p.m, p.m + p.k + 1))]
        if None in found:
            return False
        *rows, energy = [[g.get(i, ZERO) for i in p.free] for g, _ in found]
        d, lam = [w[i] for i in p.free], list[arb]()
        if rows:
            gradients, middle = arb_mat(rows), arb_mat(rows).mid()
            try:
                left = (middle * middle.transpose()).inv().mid() * middle
                form = left * gradients.transpose()
                lam = form.solve(left * column(energy)).entries()
                across = column(d)
                y = form.transpose().solve(-gradients * across)
            except ZeroDivisionError:
                return False
            d = (across + left.transpose() * y).entries()
        weights = [*(-x for x in lam), arb(1)]
        bent = [
            dot(weights, [h.get((i, j), ZERO) for _, h in found]) * d[a] * d[b]
            for a, i in enumerate(p.free)
            for b, j in enumerate(p.free)
        ]
        return sum(bent, ZERO) < 0

    def is_saddle(self, face: StoredRegion, way: list[float]) -> bool:
        """Whether negative curvature along all that may vanish at a point makes it no minimum."""
        u = frozenset[int]().union(*face.branches)
        return self.bends_down(u, self.p.values(face.point), [arb(x) for x in way])

    def tangents(self, v: list[Any], memo: dict[int, Any], ways: list[list[arb]]) -> list[Any]:
        """Return ``w + C y`` with ``dh (w + C y) = 0``, for all elements of the enclosed ``dh``."""
        found = [self.p.forms(v, row, memo) for row in range(self.p.m, self.p.m + self.p.k)]
        if None in found or not found:
            return [] if found else ways
        rows = arb_mat([[g.get(i, ZERO) for i in self.p.free] for g, _ in found])
        across, changed = rows.mid().transpose(), []
        for w in ways:
            try:
                y = (rows * across).solve(-rows * arb_mat([[w[i]] for i in self.p.free]))
            except ZeroDivisionError:
                return []
            change = dict(zip(self.p.free, (across * y).entries(), strict=True))
            changed.append([x + change.get(i, ZERO) for i, x in enumerate(w)])
        return changed

    def compare(self, face: Any, point: dict[str, Any]) -> None:
        need(face.index == point["index"], f"{face.name}: the index is {face.index}")

    def is_absent(self, number: int) -> bool:
        """Whether the point of a region is shown to be none that is listed."""
        face = self.regions[number]
        way = self.ways[number] if self.ways and self.p.minima_only else []
        return bool(face.outside or face.absent or (way and self.is_saddle(face, way)))

    def check_list(self, data: dict[str, Any]) -> None:
        """Check that all regions with points are listed, each point once; count the points.

        Of those that may be, the ones are counted as points, or not at all, that are decided here.
        """
        count, points = len(self.regions), data["points"]
        listed = places([point["region"] for point in points], count, "listed regions")
        open_ = places(data["open_points"], count, "open points")
        different([*listed, *open_], "a region is listed")
        claimed = list[Any]()
        for number, point in zip(listed, points, strict=True):
            face = self.regions[number]
            need(face.listable and not face.far, f"{face.name}: is none of the {self.kind}")
            self.compare(face, point)
            need(all(face.same(f) is False for f in claimed), f"{face.name}: is listed twice")
            claimed.append(face)
        named, self.points = list(claimed), list(claimed)
        for number in open_:
            face, alike = self.regions[number], [self.regions[number].same(f) for f in named]
            if self.is_absent(number) or True in alike:
                continue
            named.append(face)
            if face.listable and not face.far and None not in alike:
                self.points.append(face)
        for number, face in enumerate(self.regions):
            known = self.is_absent(number) or any(face.same(f) for f in named)
            need(known, f"{face.name}: is not listed")
        self.open = len(named) - len(self.points)

    def indices(self) -> Iterator[str]:
        """Yield how many of the points that are counted have an index.

        It is not that of the face where other functions may vanish, unless it is 0.
        """
        shown = [face.index if face.free or face.index == 0 else None for face in self.points]
        for index, number in sorted(Counter(shown).items(), key=str):
            yield f"{number} of {'undecided index' if index is None else f'index {index}'}"

    def energies(self) -> list[arb]:
        """Return the energies of the local minima that are counted."""
        minima = [self.p.values(face.point) for face in self.points if face.index == 0]
        return sorted((v[self.p.outputs[-1]] for v in minima), key=arb.mid)

    def distinct(self) -> list[StoredRegion]:
        """Return loci that are not beside the domain, of minima if only these are listed, once."""
        found = list[StoredRegion]()
        for place in self.loci:
            alike = [place.same(other) for other in found]
            need(None not in alike, f"{place.name}: may be another one")
            minimum = place.index == 0 or not self.p.minima_only
            if minimum and not place.outside and True not in alike:
                found.append(place)
        return found

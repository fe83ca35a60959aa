"""Bifurcation diagrams: arcs of equilibria over a parameter, and the events at which they end.

Let ``D_t = {f_i(q, t) >= 0, h_j(q, t) = 0}``.  An *equilibrium* is a point of ``D_t`` with ``dE =
sum lam_i df_i + sum mu_j dh_j``, ``lam_i >= 0``, and ``lam_i = 0`` where ``f_i > 0``.  Of a file
that is verified this is true, of the functions and the interval that it states:

1. Each *arc* is a curve ``(q, t)``, along which ``t`` grows, from the point of one event to that
   of another. Between them all its points are equilibria, at which the functions of the arc
   vanish with multipliers ``lam_i > 0``, all others are positive, the KKT matrix is regular and
   the Lagrangian's Hessian has as many negative eigenvalues along the face as is said. No two
   arcs have a point in common.
2. Each *event* is a point; no two are the same. In a neighbourhood of it, for ``t`` in the
   interval, all equilibria are on the arcs of the file that end there, or the point itself. At a
   *fold* two arcs of one face meet on one side, at a *corner limit* two of different faces; where
   a contact *opens* or *closes*, or one is *exchanged* for another, one arc ends and one begins;
   at a *branch* more than two arcs meet, as the four of a pitchfork; at *dependent* gradients, or
   where the set *vanishes* but for the point, one arc ends, as it does at an *end* of the interval.
3. If a box is stated, all equilibria in it, for all ``t`` of the interval, are on arcs or at
   events.

For 3 the box is divided.  A part holds no equilibrium if a function is negative on it, or an
equation not 0; or if some direction, tangent to the equations, increases all functions that may
vanish and decreases the energy.  Otherwise each set ``A`` of at most ``n`` of these functions,
less the number of equations, is looked at, on which an equilibrium may have positive multipliers
(Caratheodory): there is a direction for it, or all solutions of its equations in the part lie on
the curve of a tube.  Of a point of this curve with ``f >= 0``, ``mu >= 0`` and ``t`` in the
interval it is known that it is on the diagram: the curve has a point of the diagram, and what is
watched is positive or monotone on the tube, so that it is not negative on one piece of the curve;
there arcs end only where two of them meet.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations
from math import comb
from typing import Any

from flint import arb, arb_mat

from .arcs import StoredArc, Watched
from .balls import (
    BITS,
    NAN,
    ZERO,
    NotShownError,
    column,
    different,
    dot,
    fitted,
    hull,
    need,
    places,
    turn,
)
from .curves import StoredFace, StoredFamily, Tube
from .events import StoredEvent, StoredImage
from .problem import DIAGRAM, StoredProblem, StoredProgram
from .proof import MOST_SETS, StoredProof
from .rationals import decimals
from .statement import PART
from .symmetries import StoredSymmetry, TurnedAlgebra

MOST_IMAGES = 100  # symmetries
MOST_TOLD = 12  # events that are told one by one
NARROWINGS = 4  # of a box, towards a curve
SHRINKINGS = 24  # of a tube about an event, by halves


class StoredDiagram(StoredProof):
    """The diagram of a file."""

    kind = "equilibria"

    def __init__(self, data: dict[str, Any]) -> None:
        need(data["format"] == DIAGRAM, f"the format is not {DIAGRAM}")
        self.searched = data["domain"] is not None
        self.p: Any = (StoredProblem if self.searched else StoredProgram)(data)
        self.family = family = StoredFamily(self.p, data)
        need(all(isinstance(x, str) for x in data["functions"]), "names of functions are texts")
        algebra = TurnedAlgebra(self.p)
        need(len(data["symmetries"]) <= MOST_IMAGES, "these are too many symmetries")
        images = [StoredImage(family, record, algebra) for record in data["symmetries"]]
        count = len(data["events"])
        need(data["arcs"] and count, "there is no arc, or no event")
        different([(r["active"], r["points"]) for r in data["arcs"]], "an arc is stated")
        self.arcs = [StoredArc(family, r, f"arc {k}") for k, r in enumerate(data["arcs"])]
        ends: list[list[tuple[StoredArc, int]]] = [[] for _ in range(count)]
        for arc, record in zip(self.arcs, data["arcs"], strict=True):
            both = places(record["events"], count, f"{arc.name}: events")
            need(len(both) == 2, f"{arc.name}: events at both ends")
            for side, k in enumerate(both):
                ends[k].append((arc, side))
        self.events = [
            StoredEvent(family, some, images, f"event {k}") for k, some in enumerate(ends)
        ]
        for k, (event, record) in enumerate(zip(self.events, data["events"], strict=True)):
            need(record["kind"] == event.kind, f"event {k}: the kind is {event.kind}")
        for one, two in combinations(self.events, 2):
            need(self.apart(one.x, two.x), "two events are not shown to be different")
        self.indices_ = [arc.index() for arc in self.arcs]
        for arc, record, index in zip(self.arcs, data["arcs"], self.indices_, strict=True):
            fine = type(record["index"]) is int and record["index"] == index
            need(fine, f"{arc.name}: the index is {index}")
        if self.searched:
            self.prepare(data)

    def apart(self, x: Sequence[arb], y: Sequence[arb]) -> bool:
        """Whether two points are different, also after turns by periods."""
        for a, b, period in zip(x, y, self.p.periods, strict=True):
            if period is not None:
                share = (a - b) / period
                if not share.is_finite() or share.contains_integer():
                    continue
                return True
            if not a.overlaps(b):
                return True
        return False

    # ------------------------------------------------------------------------ boxes without others

    @property
    def axes(self) -> Sequence[int]:
        """The coordinates along which boxes are bisected."""
        return range(self.p.n)

    def prepare(self, data: dict[str, Any]) -> None:
        """Collect the tubes, those about events among them."""
        p, family = self.p, self.family
        need(data["fixed"] == [] and not p.minima_only, "a box has sides for all coordinates")
        ends = (p.lower[-1], p.upper[-1])
        need(ends == (family.low, family.high), "the box is searched over the whole interval")
        algebra = TurnedAlgebra(p)
        for i, name in enumerate(p.names):
            if p.periods[i] is not None:
                shifts = ["1" if j == i else "0" for j in range(p.n)]
                whole = {"order": [*range(p.n)], "signs": [1] * p.n, "shifts": shifts}
                none = {"weights": ["0x0p+0"] * p.n, "periods": data["periods"]}
                shift = StoredSymmetry(p, whole, none, algebra, f"period of {name}")
                need(shift.proved, f"the period of {name} is not shown by algebra")
        self.faces = dict[tuple[int, ...], StoredFace]()
        self.tubes = dict[tuple[int, ...], list[tuple[Any, list[float], list[float]]]]()
        about = (self.about(*curve) for event in self.events for curve in event.curves)
        forks = (event.pitchfork for event in self.events)
        for tube in (*(tube for arc in self.arcs for tube in arc.tubes), *about, *forks):
            if tube is not None:
                pairs = list(zip(tube.x, self.family.scales, strict=False))
                # a tube is tried for boxes that are not farther from it than it is long
                length = max(float(x.rad() / s) for x, s in pairs)
                lower = [float(x.lower() - length * s) for x, s in pairs]
                upper = [float(x.upper() + length * s) for x, s in pairs]
                self.tubes.setdefault(tube.face.active, []).append((tube, lower, upper))

    def about(self, face: StoredFace, x: list[arb], along: list[arb]) -> Tube | None:
        """Return the widest tube about an event on which all that is watched is monotone."""
        watched = Watched(self.family)
        for power in range(SHRINKINGS):
            try:
                tube = Tube.about(face, x, along, arb(2) ** -power)
                signs = watched.signs(tube)
            except NotShownError:
                continue
            if tube.contains(x) and -1 not in signs:
                return tube
        return None

    def shown(self, lo: list[float], hi: list[float], ways: list[list[arb]]) -> bool:
        """Whether all equilibria in a box are on the diagram."""
        p, box = self.p, hull(lo, hi)
        v, memo = p.values(box), dict[int, Any]()
        signs, near = p.signs(v), list[Any]()
        tangents = self.tangents(v, memo, ways)
        for sharp in (False, True):
            if sharp:
                signs = [s or p.sign(v, row, memo, lo, hi) for row, s in enumerate(signs)]
                middle = [x.mid() for x in box]
                away = [x - c for x, c in zip(box, middle, strict=True)]
                near = [v, {}, p.values(middle), {}, away] if tangents else []
            sets = p.open_sets(signs)
            if not sets:
                return True
            (u,) = sets
            grown = [self.grown(u, w, v, memo, near) for w in tangents]
            if any(u == some for some in grown):
                return True
        return self.covered(u, [some for some in grown if some is not None], box)

    def grown(
        self, u: frozenset[int], w: list[arb], v: list[Any], memo: Any, near: list[Any]
    ) -> frozenset[int] | None:
        """Return the functions that grow along a direction; None if the energy may not fall."""

        def rate(row: int) -> arb:
            if near:
                return self.slope(row, w, *near)
            found = self.p.forms(v, row, memo)
            return dot([*found[0].values()], [w[i] for i in found[0]]) if found else NAN

        return frozenset(i for i in u if rate(i) > 0) if rate(-1) < 0 else None

    def covered(self, u: frozenset[int], grown: list[frozenset[int]], box: list[arb]) -> bool:
        """Whether for each set of functions there is a direction, or a tube with all solutions."""
        top = min(len(u), self.family.n - self.p.k)
        if sum(comb(len(u), size) for size in range(top + 1)) > MOST_SETS:
            return False
        some = (a for size in range(top + 1) for a in combinations(sorted(u), size))
        left = [a for a in some if not any(other.issuperset(a) for other in grown)]
        if not all(a in self.tubes for a in left):
            return False
        rows = [*u, *range(self.p.m, self.p.m + self.p.k + 1)]
        try:
            _, _, found = self.family.forms(box, rows)
            slopes = {row: gradient for row, (_, gradient, _) in zip(rows, found, strict=True)}
            return all(self.on_curves(a, box, slopes) for a in left)
        except NotShownError:
            return False

    def on_curves(self, active: tuple[int, ...], box: list[arb], slopes: dict[int, Any]) -> bool:
        """Whether all solutions of the equations of a face in a box are on curves of tubes."""
        face = self.faces.setdefault(active, StoredFace(self.family, active))
        mu = self.multipliers(face, slopes)
        if mu is not None and not mu:
            return True
        near = sorted(self.near(active, box), key=lambda found: found[0]) if mu else []
        if not near:
            return False
        _, tube, x, *_ = next((some for some in near if isinstance(some[1], Tube)), near[0])
        left = tube.narrowed([*x, *(mu or ())], NARROWINGS)
        return not left or any(
            tube.covers([*self.turned(left, lower, upper), *left[self.p.n :]])
            for _, tube, _, lower, upper in near
        )

    def near(self, active: tuple[int, ...], box: list[arb]) -> Iterator[Any]:
        """Yield the tubes of a face that are near a box: the distance, the tube, the box there."""
        for k, (tube, lower, upper) in enumerate(self.tubes[active]):
            x = self.turned(box, lower, upper)
            if not any(y < a or y > b for y, a, b in zip(x, lower, upper, strict=True)):
                apart = zip(x, tube.centre, self.family.scales, strict=False)
                yield (
                    (max(float(abs(y - z).mid() / s) for y, z, s in apart), k),
                    tube,
                    x,
                    lower,
                    upper,
                )

    def turned(self, box: Sequence[arb], lower: list[float], upper: list[float]) -> list[arb]:
        """Return a box with whole turns added, to where it is nearest to another."""
        ends = zip(box, lower, upper, self.p.periods, strict=False)
        return [y + turn(y, a, b, period) for y, a, b, period in ends]

    @staticmethod
    def multipliers(face: StoredFace, slopes: dict[int, Any]) -> list[arb] | None:
        """Enclose multipliers of sum 1 in a box; empty if there are none, None if not bounded."""
        n, pairs = face.n, list(zip(face.signed, face.rows, strict=True))
        table = [[s * slopes[row].get(i, ZERO) for s, row in pairs] for i in range(n)]
        rows = arb_mat([*table, face.counted])
        right = column([*[ZERO] * n, arb(1)])
        unit = [ZERO.union(arb(1)) if c == 1 else None for c in face.counted]
        try:
            found = fitted(rows, right)
        except ZeroDivisionError:
            return None if None in unit else [x for x in unit if x is not None]
        pairs = list(zip(found, unit, strict=True))
        if any(b is not None and not a.overlaps(b) for a, b in pairs):
            return []
        mu = [a if b is None else a.intersection(b) for a, b in pairs]
        fits = zip((rows * column(mu)).entries(), right.entries(), strict=True)
        return mu if all(x.contains(y) for x, y in fits) else []

    # ------------------------------------------------------------------------------------- words

    def check_list(self, data: dict[str, Any]) -> None:
        if self.searched:
            need(data["open"] == 0, "a box is open")

    def said(self) -> Iterator[str]:
        """Yield the parts of the statement."""
        p, family = self.p, self.family
        yield f"equilibria over {p.names[-1]} from {family.low} to {family.high}"
        found = Counter(self.indices_)
        each = (f"{number} of index {index}" for index, number in sorted(found.items()))
        yield f"{len(self.arcs)} arcs ({', '.join(each)})"
        yield f"{len(self.events)} events ({', '.join(self.told())})"
        yield f"{family.n} coordinates, {p.m} inequalities, {p.k} equations"
        if self.searched:
            yield "and no other equilibria"
        else:
            yield "nothing is said of other curves"

    def told(self) -> Iterator[str]:
        """Yield events with bounds of the parameter, and the number of the ends of the interval."""
        t, kinds = self.family.n, Counter(event.kind for event in self.events)
        several = sum(kinds.values()) - kinds["end"]
        for event in self.events if several <= MOST_TOLD else ():
            if event.kind != "end":
                x = event.x[t] + PART * arb(2) ** -BITS  # wide enough to be printed
                low, high = decimals(x, x)
                yield f"{event.kind.replace('_', ' ')} between {low} and {high}"
        for kind, number in sorted(kinds.items()):
            if several > MOST_TOLD or kind == "end":
                yield f"{number} of the kind {kind.replace('_', ' ')}"

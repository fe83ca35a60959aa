"""Events at which arcs end: one point, and no other equilibria leave it.

Let ``(q, t)`` be the point and ``F`` the functions whose multipliers are positive there.

*Contacts.* Functions ``W`` vanish with multipliers 0, and all gradients of ``F + W`` and the
equations are independent.  Near the point multipliers are unique and nearly the same; an
equilibrium has positive ones on ``F + V`` for some ``V`` in ``W``.  For each ``V`` the equations
have one curve through the point, along which the multipliers of ``V`` and the functions of the
rest of ``W`` have derivatives other than zero: on a side on which all of them grow there are
equilibria, on others not.

*A corner with one function too many.* ``n + 1`` functions vanish, equations among them, whose
derivatives by ``q`` and ``t`` are independent.  Without any one ``l`` of them the gradients are
independent, with multipliers of which all are positive or one is negative.  An equilibrium nearby
has positive multipliers on independent gradients, which tend to multipliers without negative ones:
it is that of all functions but one, ``l``, and ``f_l`` grows on one side of its curve.

*Dependent gradients.* The energy's multiplier vanishes and those of ``A`` are positive.  As the
curve is regular and ``t''`` does not vanish, it has no velocity ``(0, 0, mu')``, whose
acceleration would be 0, and the multipliers are the only ones, up to their size.  So those of
equilibria nearby are nearly the same: they are on the curve, on the side where the energy's
multiplier is positive.

*A fold.* All signs are strict, ``t' = 0`` and ``t''`` does not vanish.  As before no velocity is
``(0, 0, mu')``, so that the multipliers are unique and equilibria nearby are on the curve; the two
arcs are its two sides.
"""

from collections.abc import Iterator, Sequence
from itertools import chain, combinations
from typing import Any

from flint import arb, arb_mat

from .algebra import total
from .arcs import StoredArc, Watched
from .balls import ZERO, NotShownError, dot, need, negatives_along, places
from .curves import StoredFace, StoredFamily, Tube, solved
from .pitchforks import StoredPitchfork
from .statement import zero_near
from .symmetries import TurnedAlgebra

REACHES = (14, 20, 26)  # of tubes about folds, as powers of 1/2
MOST_WEAK = 8  # functions that vanish at once

End = tuple[StoredArc, int]


class StoredEvent:
    """An event of a file: the ends of arcs that meet there."""

    def __init__(
        self, family: StoredFamily, ends: Sequence[End], images: Sequence["StoredImage"], name: str
    ) -> None:
        need(ends, f"{name}: no arc ends there")
        self.family, self.ends, self.images = family, list(ends), images
        self.watched = w = Watched(family)
        self.curves: list[tuple[StoredFace, list[arb], list[arb]]] = []
        self.pitchfork: StoredPitchfork | None = None
        zeros = frozenset[int]().union(*(arc.zeros[side] for arc, side in ends))
        try:
            if zeros in ({w.start}, {w.end}):
                self.x, self.kind = self.at_end(zeros == {w.end})
            elif zeros == {w.turn}:
                self.x, self.kind = self.fold()
            elif zeros == {w.energy, w.turn}:
                self.x, self.kind = self.dependent()
            elif not zeros:
                self.x, self.kind = self.branch()
            else:
                need(max(zeros) < w.m, "this checker does not know such an event")
                self.x, self.kind = self.contacts(sorted(zeros))
            t = self.x[family.n]
            inside = zeros in ({w.start}, {w.end}) or (t > w.low and t < w.high)
            need(inside, "the parameter is not inside its interval")
        except NotShownError as error:
            msg = f"{name}: {error}"
            raise NotShownError(msg) from None

    def only(self) -> End:
        need(len(self.ends) == 1, "more than one arc ends there")
        return self.ends[0]

    # ------------------------------------------------------------------------------ ends and folds

    def at_end(self, last: bool) -> tuple[list[arb], str]:
        """Show an end of the interval."""
        arc, side = self.only()
        need(side == int(last), "an arc begins at the start of the interval and ends at its end")
        value = self.watched.high if last else self.watched.low
        x = zero_near(arc.face.fixed(arc.face.n, value), arc.near(side))
        arc.close(side, x)
        return [*x[: arc.face.n], value], "end"

    def fold(self) -> tuple[list[arb], str]:
        """Show that two arcs are the two sides of a curve on which the parameter turns back."""
        need(len(self.ends) == 2, "two arcs meet at a fold")
        (one, side), (two, other) = self.ends
        fine = one is not two and side == other and one.face.active == two.face.active
        need(fine, "two arcs of one face, on one side, meet at a fold")
        tube = self.turning(one, side)
        values = self.watched.values(tube)
        need(all(x > 0 for x in values[: self.watched.turn]), "more vanishes than at a fold")
        onwards = []
        for arc, _ in self.ends:
            arc.close(side, tube.x)
            onwards.append(dot(tube.normal, arc.end(side).velocity_at(tube.x)))
        need(onwards[0] * onwards[1] < 0, "the two arcs are not shown to be two sides of the curve")
        return tube.x[: tube.face.d], "fold"

    def turning(self, arc: StoredArc, side: int) -> Tube:
        """Return a short tube on which the parameter's derivative vanishes once."""
        face = arc.face
        for first in REACHES:
            x = arc.near(side)
            along = face.kernel(x)
            try:
                for power in (first, 2 * first, 4 * first):
                    reach = arb(2) ** -power
                    tube = Tube.about(face, x, along, reach)
                    rate = tube.acceleration()[face.n]
                    there = tube.point()
                    now = tube.velocity_at(there)
                    need(rate > 0 or rate < 0, "the parameter is not shown to turn back once")
                    delta = -now[face.n] / rate
                    need(abs(delta) < reach, "the parameter is not shown to turn back")
                    moved = zip(there, tube.tangent, strict=True)
                    x = [(a + t * delta).mid() for a, t in moved]
            except NotShownError as error:
                reason = str(error)
                continue
            return tube
        raise NotShownError(reason)

    # -------------------------------------------------------------------------------- pitchforks

    def branch(self) -> tuple[list[arb], str]:
        """Show a branch point by one of the symmetries."""
        faces = {arc.face.active for arc, _ in self.ends}
        need(
            len(self.ends) == 4 and len(faces) == 1, "four arcs of one face meet at a branch point"
        )
        reason = NotShownError("no symmetry is given for a branch point")
        for g in self.images:
            try:
                self.pitchfork = StoredPitchfork(self.ends, g)
            except NotShownError as error:
                reason = error
            else:
                return self.pitchfork.centre[: self.family.p.n], "branch"
        raise reason

    # -------------------------------------------------------------------------- dependent gradients

    def dependent(self) -> tuple[list[arb], str]:
        """Show an event at which the energy's multiplier vanishes."""
        arc, side = self.only()
        face, n, d = arc.face, arc.face.n, arc.face.d
        x = zero_near(face.fixed(face.size - 1, ZERO), arc.near(side))
        self.check_open(x[:d], face.active)
        held = x[d : d + len(face.active)]
        need(all(y > 0 for y in held), "a multiplier may vanish with that of the energy")
        _, jacobian = face.at(x)
        rows = jacobian[n:-1]
        growth = sum((m * row[n] for m, row in zip(x[d:], rows, strict=False)), ZERO)
        need(growth > 0 or growth < 0, "the parameter's derivative is not shown to vanish there")
        arc.close(side, x)
        self.curves.append((face, x, face.kernel(x)))
        # One gradient depends on the others: the first, as its multiplier is not 0.
        form = [row[:n] for row in jacobian[:n]]
        found = negatives_along(form, [row[:n] for row in rows[1:]])
        need(found is not None, "whether the set shrinks to a point is not decided")
        return x[:d], "dependent" if found else "vanishes"

    def check_open(self, place: Sequence[arb], closed: Sequence[int]) -> None:
        """Check that all other functions are positive."""
        p = self.family.p
        v = p.values(place)
        others = (i for i in range(p.m) if i not in closed)
        need(all(v[p.outputs[i]] > 0 for i in others), "another function may vanish")

    # ------------------------------------------------------------------------------------ contacts

    def contacts(self, weak: list[int]) -> tuple[list[arb], str]:
        """Show an event at which multipliers vanish and functions do."""
        need(len(weak) <= MOST_WEAK, "too many functions vanish at once")
        full = sorted({*weak, *chain.from_iterable(arc.face.active for arc, _ in self.ends)})
        if len(full) + self.family.p.k > self.family.n:
            return self.corner(full)
        fine = all(arc.zeros[side] == {*weak} for arc, side in self.ends)
        need(fine, "not the same vanishes at the ends of all arcs")
        face = StoredFace(self.family, full)
        d, count = face.d, len(full)
        x = zero_near(face.fixed(d + full.index(weak[0]), ZERO), self.embedded(face, *self.ends[0]))
        self.check_open(x[:d], full)
        strong = [x[d + k] for k, i in enumerate(full) if i not in weak]
        need(all(y > 0 for y in (*strong, x[-1])), "more multipliers may vanish")
        self.check_independent(face, x)
        for other in weak[1:]:
            need(self.together(face, weak[0], other, x),
                 "no symmetry shows that several functions vanish at once")  # fmt: skip
        arms = list[End]()
        for some in chain.from_iterable(combinations(weak, r) for r in range(len(weak) + 1)):
            kept = [k for k, i in enumerate(full) if i not in weak or i in some]
            part = StoredFace(self.family, [full[k] for k in kept])
            at = [*x[:d], *(x[d + k] for k in kept), *x[d + count :]]
            arms += self.arm(part, at, weak)
        self.match(arms)
        return x[:d], kind(arms)

    def embedded(self, face: StoredFace, arc: StoredArc, side: int) -> list[arb]:
        """Return approximate unknowns on a larger face."""
        near, own, d = arc.near(side), arc.face.active, arc.face.d
        held = [near[d + own.index(i)] if i in own else ZERO for i in face.active]
        return [*near[:d], *held, *near[d + len(own) :]]

    @staticmethod
    def check_independent(face: StoredFace, x: Sequence[arb]) -> None:
        n = face.n
        rows = [row[:n] for row in face.at(x)[1][n:-1]]
        if rows:
            form = arb_mat(rows) * arb_mat(rows).mid().transpose()
            try:
                form.inv()
            except ZeroDivisionError:
                need(False, "gradients are not shown to be independent")

    def arm(self, face: StoredFace, x: list[arb], weak: Sequence[int]) -> Iterator[End]:
        """Yield the end of the arc that leaves along the curve of a face, if one does."""
        along = face.kernel(x)
        velocity = face.velocity(x, along)
        _, _, found = self.family.forms(x[: face.d], weak)
        rates = [
            velocity[face.d + face.active.index(i)] if i in face.active
            else sum((y * velocity[j] for j, y in gradient.items()), ZERO)
            for i, (_, gradient, _) in zip(weak, found, strict=True)
        ]  # fmt: skip
        need(all(y > 0 or y < 0 for y in rates), "a derivative may vanish")
        self.curves.append((face, x, along))
        if len({bool(y > 0) for y in rates}) == 1:
            yield self.closing(face, x, weak)

    def closing(self, face: StoredFace, x: list[arb], weak: Sequence[int]) -> End:
        """Return the only end of an arc at a point of the curve of a face, and close it."""
        fits = [
            (arc, side) for arc, side in self.ends
            if arc.face.active == face.active and arc.zeros[side] == {*weak}
            and arc.end(side).contains(x)
        ]  # fmt: skip
        need(len(fits) == 1, f"{len(fits)} arcs are where one leaves")
        ((arc, side),) = fits
        arc.close(side, x)
        return arc, side

    def match(self, arms: Sequence[End]) -> None:
        need(len(arms) == len(self.ends), f"{len(arms)} arcs leave, not {len(self.ends)}")

    def together(self, face: StoredFace, first: int, other: int, x: list[arb]) -> bool:
        """Whether a symmetry shows that two multipliers are the same at a point of a face.

        It takes the face to itself and keeps the parameter, of which the solution is a function
        that is unique nearby: where the image of the point is near, it is the point.
        """
        n, d, full = face.n, face.d, face.active
        if self.family.p.k:
            return False
        along = [u * int(i == n) for i, u in enumerate(face.units)]
        about = Tube.about(face, x, along, arb(2) ** -REACHES[1])
        for g in self.images:
            if g.functions[other] == first and {g.functions[i] for i in full} == {*full}:
                weights = self.family.weights
                same = all(shown_equal(weights[i], weights[g.functions[i]]) for i in full)
                mu = [x[d + full.index(g.functions[i])] for i in full]
                image = [s * x[i] for i, s in zip(g.order, g.signs, strict=True)]
                if (
                    same
                    and about.contains(x)
                    and about.contains([*image, *mu, *x[d + len(full) :]])
                ):
                    return True
        return False

    # --------------------------------------------------------------------- one function too many

    def corner(self, full: list[int]) -> tuple[list[arb], str]:
        """Show an event at which one function more vanishes than there are coordinates."""
        family, n = self.family, self.family.n
        rows = [*full, *range(family.p.m, family.energy)]
        need(len(rows) == n + 1, "several functions too many vanish")
        x = zero_near(self.vanishing(rows), self.ends[0][0].near(self.ends[0][1])[: n + 1])
        self.check_open(x, full)
        _, _, found = family.forms(x, [*rows, family.energy])
        pairs = zip([*rows, family.energy], found, strict=True)
        slopes = {
            r: [family.weights[r] * g.get(i, ZERO) for i in range(n)] for r, (_, g, _) in pairs
        }
        arms = list[End]()
        for gap in full:
            others = [r for r in rows if r != gap]
            lam = related([slopes[r] for r in others], slopes[family.energy])
            own = lam[: len(full) - 1]
            if all(y > 0 for y in own):
                share = 1 / (1 + sum(own, ZERO))
                face = StoredFace(family, [i for i in full if i != gap])
                at = [*x, *(y * share for y in lam), share]
                self.curves.append((face, at, face.kernel(at)))
                arms.append(self.closing(face, at, [gap]))
            else:
                need(any(y < 0 for y in own), "a multiplier of a corner may vanish")
        self.match(arms)
        if len(arms) > 1:
            return x, kind(arms)
        # A positive combination of all gradients is 0: the set is a point there.
        away = related([slopes[r] for r in rows[1:]], slopes[rows[0]])
        need(all(y < 0 for y in away[: len(full) - 1]), "the set is not shown to shrink to a point")
        return x, "vanishes"

    def vanishing(self, rows: Sequence[int]) -> Any:
        """Return the equations of a corner, for coordinates and parameter."""
        family, count = self.family, self.family.n + 1

        def equations(x: Sequence[arb]) -> tuple[list[arb], list[list[arb]]]:
            _, _, found = family.forms(x, rows)
            weights = [family.weights[row] for row in rows]
            pairs = list(zip(weights, found, strict=True))
            table = [[w * g.get(i, ZERO) for i in range(count)] for w, (_, g, _) in pairs]
            return [w * value for w, (value, _, _) in pairs], table

        return equations


class StoredImage:
    """A symmetry of a file: a signed permutation of coordinates that keeps energy and parameter.

    ``(g q)_i = signs_i q_{order_i}``, ``f_i(g q) = f_{functions_i}(q)`` and ``h_j(g q) = s h_k(q)``
    for the pairs ``(k, s)`` of ``equations``, shown by algebra; of functions with the number -1
    nothing is shown.
    """

    def __init__(
        self, family: StoredFamily, record: dict[str, Any], algebra: TurnedAlgebra
    ) -> None:
        p, n = family.p, family.n
        self.order = [*places(record["order"], n, "a symmetry"), n]
        self.signs = [*record["signs"], 1]
        self.functions = list(record["functions"])
        self.equations = [tuple(pair) for pair in record.get("equations", [])]
        taken = places([k for k in self.functions if k != -1], p.m, "a symmetry")
        kept = places([k for k, _ in self.equations], p.k, "a symmetry")
        signs = [*self.signs, *(s for _, s in self.equations)]
        fine = sorted(self.order) == [*range(p.n)] and len(self.functions) == p.m
        fine &= len({*taken}) == len(taken) and sorted(kept) == [*range(p.k)]
        fine &= all(type(s) is int and abs(s) == 1 for s in signs)
        need(fine and len(self.signs) == p.n, "a symmetry")
        self.periods, self.turns = [None] * p.n, ["0"] * p.n
        moved = algebra.at(self)
        same = [(row, k, 1) for row, k in enumerate(self.functions) if k >= 0]
        same += [(p.m + j, p.m + k, s) for j, (k, s) in enumerate(self.equations)]
        for row, other, sign in (*same, (family.energy, family.energy, 1)):
            one, two = moved.value(p.outputs[row]), algebra.value(p.outputs[other])
            known = isinstance(one, dict) and isinstance(two, dict)
            need(known and one == total({}, two, sign), "a symmetry is not shown by algebra")
        algebra.work = moved.work


def kind(arms: Sequence[End]) -> str:
    """Return the kind of an event of contacts, by the arcs that leave it."""
    need(len(arms) > 1, "what happens there is not decided")
    if len(arms) > 2:
        return "branch"
    if arms[0][1] == arms[1][1]:
        return "corner_limit"
    before, after = (len(arc.face.active) for arc, _ in sorted(arms, key=lambda arm: -arm[1]))
    return "exchange" if before == after else "opens" if before > after else "closes"


def related(rows: list[list[arb]], right: list[arb]) -> list[arb]:
    """Enclose the multiples of vectors, a basis, that add up to another one."""
    return solved([list(column) for column in zip(*rows, strict=True)], right)


def shown_equal(x: arb, y: arb) -> bool:
    return bool(x == y)

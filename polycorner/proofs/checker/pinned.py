"""Boxes around points that redundant functions hold to first order."""

from typing import Any

from flint import arb, arb_mat

from .balls import ZERO, dot, hull, need, sides, zero
from .faces import StoredRegion
from .problem import StoredProblem

NEAR = 2.0**-30  # reach of the box in which the point is sought


class StoredPin(StoredRegion):
    """A box without stationary points but one, at which the active functions vanish.

    The set is one intersection without equations.  For ``i`` of the active functions, the energy
    ``E`` and the coordinates ``j``, reach ``r_j``, let ``R_i`` bound half of ``|f_i''|`` over
    displacements within the reach.  Weights ``mu >= 0`` with ``sum mu_i df_i = dE + s t e_j`` at
    the point for all ``j`` and ``s = 1, -1``, ``df_i u > 0`` in the box, and
    ``t r_j > sum mu_i R_i + 2 R_E + max(R_i / df_i u) dE u`` leave no other stationary point.
    """

    def __init__(self, p: StoredProblem, record: dict[str, Any]) -> None:
        self.p, self.places, self.active = p, p.free, frozenset(record["active"])
        self.name, n, corner = f"region of {record['active']}", len(p.free), {*record["corner"]}
        plain = not p.k and not p.parameters
        need(plain and len(p.branches) == 1, f"{self.name}: not of one intersection")
        # A function that the set does not ask for may be negative in it, and hold nothing.
        fine = corner <= self.active and all(self.active <= b for b in p.branches)
        fine = fine and len(corner) == n
        need(fine, f"{self.name}: the functions")
        ends = sides(record, ("lower", "upper"), p.n)
        self.lower, self.upper = ([side[i] for i in p.free] for side in ends)
        sharp = sides(record, ("sharp_lower", "sharp_upper"), n + len(self.active))
        self.rows = [*sorted(self.active), p.m]
        self.limit()
        self.rows = sorted(corner)
        start = [x + arb(0, NEAR) * (1 + abs(x)) for x in hull(*sharp)[:n]]
        point = zero(self.vanishing, start)
        need(point, f"{self.name}: no single common zero is shown")
        self.rows = [*sorted(self.active), p.m]
        self.unknowns = [*(point or []), *self.shown(record, point or [])]
        self.placed(sharp, record, 0, frozenset(corner))
        need(self.active <= self.zeros, f"{self.name}: not all functions vanish")

    def shown(self, record: dict[str, Any], point: list[arb]) -> list[arb]:
        """Check the inequality; return positive multipliers."""
        n, count = len(self.places), len(self.active)
        box = hull(self.lower, self.upper)
        here, there = self.rows_at(point), self.rows_at(box)
        need(here and there, f"{self.name}: the functions are not smooth")
        steps, into, weights = (
            [arb(float.fromhex(x)) for x in record[name]] for name in ("steps", "into", "weights")
        )
        fine = len(steps) == 2 * n and len(into) == n and len(weights) == 2 * n * count
        need(fine and all(t > 0 for t in steps), f"{self.name}: the numbers")
        exact = self.exact(here[1], steps, arb_mat(2 * n, count, weights))
        reach = [(x - y).abs_upper() for x, y in zip(box, point, strict=True)]
        around = all(x.contains(y) for x, y in zip(box, point, strict=True))
        need(around, f"{self.name}: the box is elsewhere")
        pairs = [(i, j, a * b / 2) for i, a in enumerate(reach) for j, b in enumerate(reach)]
        *bends, bend = [sum((h[i][j].abs_upper() * r for i, j, r in pairs), ZERO) for h in there[2]]
        *grows, pull = [dot(g, into) for g in there[1]]
        need(all(x > 0 for x in grows), f"{self.name}: no direction increases all functions")
        most = pull.upper() if pull.upper() > 0 else ZERO
        lost = [r / x * most for r, x in zip(bends, grows, strict=True)]
        for k, (t, mu) in enumerate(zip(steps, exact, strict=True)):
            kept = t * reach[k % n] - dot(mu, bends) - 2 * bend
            need(all(x >= 0 for x in mu), f"{self.name}: a negative weight")
            need(all(kept > x for x in lost), f"{self.name}: not held in all of the box")
        total = [ZERO] * count
        for j in range(n):
            up, down = steps[j], steps[n + j]
            both = zip(total, exact[j], exact[n + j], strict=True)
            total = [m + (down * a + up * b) / ((up + down) * n) for m, a, b in both]
        return total

    def exact(self, slopes: list[list[arb]], steps: list[arb], weights: arb_mat) -> Any:
        """Return the weights with which the gradients add up exactly."""
        *rows, pull = slopes
        n, g = len(pull), arb_mat(rows)
        wanted = [list(pull) for _ in steps]
        for k, t in enumerate(steps):
            wanted[k][k % n] += t if k < n else -t
        try:
            change = (arb_mat(wanted) - weights * g) * (g.mid().transpose() * g).inv()
        except ZeroDivisionError:
            need(False, f"{self.name}: the gradients may be dependent")
        return (weights + change * g.mid().transpose()).tolist()

"""Entry points of the compiled tests of boxes, which are given the addresses of records."""

import numpy as np

from polycorner.formulas.intermediate import intermediate_code
from polycorner.formulas.records import RecordType, reader
from polycorner.proofs.lists import entries
from polycorner.proofs.lists.curvature import bent_down
from polycorner.proofs.lists.directions import compiled, one

directions_at, covered_at, carried_at, bent_at = (
    reader(RecordType(f"lists.{name}", getattr(entries, name).declared))
    for name in ("DIRECTIONS", "COVERED", "CARRIED", "BENT")
)


@compiled
def directions(call):
    """Find a direction for each item."""
    c = directions_at(call)
    items, m = c.masks.shape
    n, equations = c.scales.size, c.equations
    a, rho, rows = np.zeros((m + 1, n)), np.zeros(m + 1), np.zeros(m + 1, np.int64)
    basis, spread, w = np.zeros((equations, n)), np.zeros(n), np.zeros(m + 1)
    units = np.zeros(n)
    for item in range(items):
        lo, hi = c.low[c.boxes[item]], c.high[c.boxes[item]]
        for k in range(m + 1):
            w[k] = 0.0
        c.found[item] = one(
            lo, hi, c.masks[item], equations, c.scales, c.energy_sign,
            a, rho, rows, basis, c.v[item], spread, w, units,
        )  # fmt: skip
        count = 0
        for k in range(m):
            if c.masks[item, k]:
                c.weights[item, k] = w[count]
                count += 1
        c.weights[item, m] = w[count]


@compiled
def covered(call):
    """Whether each item lies inside one of some regions and asks for none but its functions."""
    c = covered_at(call)
    for item in range(c.boxes.size):
        lo, hi = c.lower[c.boxes[item]], c.upper[c.boxes[item]]
        for r in range(c.left.shape[0]):
            inside = True
            for j in range(lo.size):
                within = c.left[r, j] < lo[j] and hi[j] < c.right[r, j]
                if not within and c.left[r, j] < c.right[r, j]:
                    inside = False
                    break
            if inside:
                for k in range(c.masks.shape[1]):
                    if c.masks[item, k] and not c.active[r, k]:
                        inside = False
                        break
            if inside:
                c.found[item] = True
                break


@compiled
def carried(call):
    """Whether a motion carries each box into a domain and increases ``w . q`` on all of it."""
    c = carried_at(call)
    for box in range(c.lower.shape[0]):
        for g in range(c.orders.shape[0]):
            inside, growth = True, 0.0
            for j in range(c.weights.size):
                a = c.signs[g, j] * c.lower[box, c.orders[g, j]]
                b = c.signs[g, j] * c.upper[box, c.orders[g, j]]
                turn = c.shifts[g, j]
                if c.periods[j] < np.inf:
                    turn -= c.periods[j] * np.rint((0.5 * (a + b) + turn) / c.periods[j])
                if not (c.least[j] <= min(a, b) + turn and max(a, b) + turn <= c.most[j]):
                    inside = False
                    break
                slope = c.slopes[g, j]
                growth += slope * (c.lower[box, j] if slope > 0.0 else c.upper[box, j])
                growth += turn * c.weights[j]
            if inside and growth > c.margin:
                c.gone[box] = True
                break


@compiled
def bent(call):
    """Whether negative curvature shows that there is no local minimum, for each box."""
    c = bent_at(call)
    count, k, n = c.left.shape
    spread, lam, reach = np.zeros(n), np.zeros(k), np.zeros(k)
    for box in range(count):
        c.found[box] = bent_down(
            c.g_lo[box], c.g_hi[box], c.h_lo[box], c.h_hi[box], c.left[box], c.start[box],
            spread, lam, reach,
        )  # fmt: skip


def made() -> str:
    """Return the entry points as intermediate code."""
    functions = {"directions": directions, "covered": covered, "carried": carried, "bent": bent}
    return intermediate_code(functions, arguments=1)

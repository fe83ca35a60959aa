"""The inclusion that a step of discs obeys, block by block, in NumPy."""

import numpy as np


def response(work, b, side, i):
    """Return how the velocity of a body responds to impulses of the rows of a block, ``(2, K)``."""
    k, K = work.mid.inverse_mass.shape[1:]
    rows = work.block.jacobian[b][: max(1, work.block.rows[b]), side * K : side * K + k]
    padded = np.zeros((2, K))
    padded[: len(rows), :k] = work.body.awake[i] * rows @ work.mid.inverse_mass[i, :, :k]
    return padded


def square(work, b):
    """Return the largest eigenvalue of ``J M^-1 J'`` of a block."""
    k, K = work.mid.inverse_mass.shape[1:]
    rows, total = max(1, work.block.rows[b]), 0.0
    for side, i in enumerate(work.block.bodies[b]):
        if i >= 0:
            J = work.block.jacobian[b, :rows, side * K : side * K + k]
            total = total + J @ response(work, b, side, i)[:rows, :k].T
    return np.linalg.eigvalsh(total)[-1]


def residuals(work, blocks, mu):
    """Return how far impulses are from the inclusion, as speeds, and velocities from impulses."""
    v, bodies = work.velocity.free.copy(), work.block.bodies
    K = v.shape[1]
    for b in blocks:
        for side, i in enumerate(bodies[b]):
            if i >= 0:
                v[i] += work.block.impulse[b] @ response(work, b, side, i)
    found = []
    for b in blocks:
        p, norm, pressing = work.block.impulse[b, 0], square(work, b), work.block.pressing[b]
        u = work.block.offset[b, 0] + sum(
            work.block.jacobian[b, 0, side * K : side * K + K] @ v[i]
            for side, i in enumerate(bodies[b])
            if i >= 0
        )
        most = np.inf if pressing < 0 else mu * work.block.impulse[pressing, 0]
        least = 0.0 if pressing < 0 else -most
        found.append(norm * abs(p - np.clip(p - u / norm, least, most)))
    return np.array(found), v

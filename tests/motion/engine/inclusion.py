"""The inclusion that a step of discs obeys, block by block, in NumPy."""

import numpy as np


def response(work, b, side, i):
    """Return how the velocity of a body responds to impulses of the rows of a block, ``(2, K)``."""
    k, K = work.inverse_mass.shape[1:]
    rows = work.jacobian[b][: max(1, work.block_rows[b]), side * K : side * K + k]
    padded = np.zeros((2, K))
    padded[: len(rows), :k] = work.awake[i] * rows @ work.inverse_mass[i, :, :k]
    return padded


def square(work, b):
    """Return the largest eigenvalue of ``J M^-1 J'`` of a block."""
    k, K = work.inverse_mass.shape[1:]
    rows, total = max(1, work.block_rows[b]), 0.0
    for side, i in enumerate(work.block_bodies[b]):
        if i >= 0:
            J = work.jacobian[b, :rows, side * K : side * K + k]
            total = total + J @ response(work, b, side, i)[:rows, :k].T
    return np.linalg.eigvalsh(total)[-1]


def residuals(work, blocks, mu):
    """Return how far impulses are from the inclusion, as speeds, and velocities from impulses."""
    v, bodies = work.v_free.copy(), work.block_bodies
    K = v.shape[1]
    for b in blocks:
        for side, i in enumerate(bodies[b]):
            if i >= 0:
                v[i] += work.impulse[b] @ response(work, b, side, i)
    found = []
    for b in blocks:
        p, norm, pressing = work.impulse[b, 0], square(work, b), work.pressing[b]
        u = work.offset[b, 0] + sum(
            work.jacobian[b, 0, side * K : side * K + K] @ v[i]
            for side, i in enumerate(bodies[b])
            if i >= 0
        )
        most = np.inf if pressing < 0 else mu * work.impulse[pressing, 0]
        least = 0.0 if pressing < 0 else -most
        found.append(norm * abs(p - np.clip(p - u / norm, least, most)))
    return np.array(found), v

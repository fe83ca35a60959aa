"""The inclusion that a step of discs obeys, block by block, in NumPy."""

import numpy as np


def residuals(work, blocks, mu):
    """Return how far impulses are from the inclusion, as speeds, and velocities from impulses."""
    v, bodies = work.v_free.copy(), work.block_bodies
    K = v.shape[1]
    for b in blocks:
        for side, i in enumerate(bodies[b]):
            if i >= 0:
                v[i] += work.impulse[b] @ work.response[b][:, side * K : side * K + K]
    found = []
    for b in blocks:
        p, norm, pressing = work.impulse[b, 0], work.delassus[b, 4], work.pressing[b]
        u = work.offset[b, 0] + sum(
            work.jacobian[b, 0, side * K : side * K + K] @ v[i]
            for side, i in enumerate(bodies[b])
            if i >= 0
        )
        most = np.inf if pressing < 0 else mu * work.impulse[pressing, 0]
        least = 0.0 if pressing < 0 else -most
        found.append(norm * abs(p - np.clip(p - u / norm, least, most)))
    return np.array(found), v

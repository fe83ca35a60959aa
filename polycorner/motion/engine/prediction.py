"""Prediction of bodies before blocks are assembled: where they will be, and far from what."""

from polycorner.motion.engine.jit import NONE, compiled
from polycorner.motion.engine.rows import row_times


@compiled
def predict_body(model, state, work, i, h, limit):
    """Predict the next midpoint of a body, and note whether it is far from its surroundings.

    That is asked only where there may be crowds: most of their bodies are.
    """
    for c in range(model.dimension):
        work.q_next[i, c] = work.q_mid[i, c] + h * state.v[i, c]
    if model.crowd_sweeps > 0 and state.alive[i] and work.awake[i]:
        work.apart[i] = 1 if is_apart(model, state, work, i, h, limit) else 0


@compiled
def is_apart(model, state, work, i, h, limit):
    """Return whether a body has no block with its surroundings; then they press on it no more."""
    m = model.restitution.size
    for f in range(model.frictions):
        if model.pressing_gap[f] < 0 and work.load[i, f] > 0.0:
            return False
    for g in range(m):
        at = (i * m + g) * model.lanes
        before = row_times(model, work.gradient, at, work.v_old, i, NONE)
        free = row_times(model, work.gradient, at, work.v_free, i, NONE)
        close = work.gap[i, g] + h * min(before, free, 0.0) < limit
        if g >= model.unilateral or close or state.touches[i, g] != 0 or work.located[0]:
            return False
    for g in range(m):
        state.normal[i, g], state.pressed[i, g] = 0.0, 0.0
    for f in range(model.frictions):
        state.friction[i, f, 0], state.friction[i, f, 1] = 0.0, 0.0
        state.sticks[i, f] = 0
    return True

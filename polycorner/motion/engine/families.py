"""Families of contacts between bodies of two kinds, or of one."""

from polycorner.motion.engine.jit import compiled


@compiled
def family_of(model, i, j):
    """Return the family of contacts of two bodies, or -1."""
    return model.family[model.kind[i], model.kind[j]]


@compiled
def pair_inputs(model, family):
    """Return how many coordinates the gaps of a family read; their values follow these."""
    return model.first_read[family + 1] - model.first_read[family]

"""Kinds of bodies, and families of contacts between bodies of two kinds, or of one.

Where it is known when code is compiled that there is one kind, nothing is looked up.
"""

from polycorner.motion.engine.jit import ZERO, compiled


@compiled
def kind_of(model, i):
    """Return the kind of a body."""
    return ZERO if model.kinds == 1 else model.kind[i]


@compiled
def coordinates_of(model, i):
    """Return the number of coordinates of a body."""
    return model.dimension if model.kinds == 1 else model.coordinates[model.kind[i]]


@compiled
def family_of(model, i, j):
    """Return the family of contacts of two bodies, or -1."""
    return ZERO if model.kinds == 1 else model.family[model.kind[i], model.kind[j]]


@compiled
def pair_inputs(model, family):
    """Return how many coordinates the gaps of a family read; their values follow these."""
    return model.first_read[family + 1] - model.first_read[family]

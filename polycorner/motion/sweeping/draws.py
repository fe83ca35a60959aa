"""Random numbers that belong to a seed, a step, a body and a use (SplitMix64, [Steele])."""

import numpy as np

from polycorner.formulas.linking import linked

compiled = linked(error_model="numpy", _nrt=False)


@compiled
def mix(x):
    """Return the next number of the generator's sequence after ``x``, mixed."""
    x = np.uint64(x) + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@compiled
def key_of(seed, when, use):
    """Return a word of random bits."""
    return mix(np.uint64(seed) ^ mix(np.uint64(when) ^ mix(np.uint64(use))))


@compiled
def unit(key):
    """Return a number between 0 and 1 of random bits."""
    return (np.float64(key >> np.uint64(11)) + 0.5) / 9007199254740992.0


@compiled
def uniform(seed, when, use):
    """Return the number between 0 and 1 that belongs to a seed, a step and a use."""
    return unit(key_of(seed, when, use))


@compiled
def normal(seed, when, use):
    """Return the standard normal number that belongs to them."""
    key = key_of(seed, when, use)
    return np.sqrt(-2.0 * np.log(unit(key))) * np.cos(2.0 * np.pi * unit(mix(key)))

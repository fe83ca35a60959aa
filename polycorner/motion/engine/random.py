"""Random numbers and forces as functions of a seed, a time, a body and an index."""

import numpy as np

from polycorner.motion.engine.jit import compiled


@compiled
def mix(x):
    """Return a well-mixed 64-bit number: the finaliser of SplitMix64 ([Steele])."""
    x = np.uint64(x) + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@compiled
def gaussian(seed, when, body, which):
    """Return the standard normal number that belongs to a seed, a time, a body and an index."""
    key = mix(np.uint64(seed) ^ mix(np.uint64(when) ^ mix(np.uint64(body * 64 + which))))
    other = mix(key)
    unit = 1.0 / 9007199254740992.0
    first = (np.float64(key >> np.uint64(11)) + 0.5) * unit
    second = (np.float64(other >> np.uint64(11)) + 0.5) * unit
    return np.sqrt(-2.0 * np.log(first)) * np.cos(2.0 * np.pi * second)


@compiled
def held_integral(seed, held, begin, end, body, which):
    """Return the integral over time of ``xi_n``, which is constant on ``[n held, (n + 1) held)``.

    ``xi_n`` is the standard normal number that belongs to the seed, ``n``, the body and the index.
    Integrals over parts of an interval add up to that over the whole.
    """
    total = 0.0
    for n in range(np.int64(np.floor(begin / held)), np.int64(np.floor(end / held)) + 1):
        length = min(end, (n + 1) * held) - max(begin, n * held)
        if length > 0.0:
            total += length * gaussian(seed, n, body, which)
    return total

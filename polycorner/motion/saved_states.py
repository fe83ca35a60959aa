"""What the arrays of an engine's state may be, checked before compiled code follows them.

Many of them are indices, and compiled code does not look whether these are within its arrays.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from polycorner import forms
from polycorner.checks import refuse
from polycorner.motion.engine.arrays import CONTACTS, STEPS, State, declarations
from polycorner.motion.engine.driver import Engine
from polycorner.motion.engine.sizes import Sizes

FLAGS = ("sticks", "touches", "alive", "rests", "asleep", "watched")
NOW = {"rank", "body_of_rank"}  # not in states saved before bodies had ranks


def check_state(engine: Engine, arrays: Mapping[str, Any], steps: int) -> None:
    """Check the saved arrays of a state after so many steps.

    Raises
    ------
    TypeError, ValueError
        Naming the array.
    """
    bodies = engine.bodies
    sizes = Sizes.of(bodies, len(arrays["keys"]))
    N, last, pairs = sizes.N, np.iinfo(np.int64).max, sizes.N * sizes.N * sizes.G
    # Whole numbers that are neither flags nor, between two steps, free: lowest and highest.
    ranges = dict.fromkeys(FLAGS, (0, 1)) | {
        "rank": (0, N - 1),
        "body_of_rank": (0, N - 1),
        "check_due": (0, last),
        "booked_to": (0, steps + 1),
        "pair_flags": (0, 2 ** max(1, sizes.H) - 1),
        "cluster": (-1, -1),  # no body is within a step
        "counts": (0, last),
        "elapsed": (0.0, engine.dt),
    }
    for name, declared in declarations(State).items():
        if name in NOW - arrays.keys():
            continue
        kind = "f" if declared.kind is np.float64 else "i"
        least, most = ranges.get(name, (-np.inf, np.inf))
        forms.array(name, arrays[name], kind, declared.extents(sizes), least=least, most=most)
    if "rank" in arrays and (arrays["body_of_rank"][arrays["rank"]] != np.arange(N)).any():
        refuse("rank", "the inverse of body_of_rank", "another order")
    counts = arrays["counts"]
    if counts[STEPS] != steps:
        refuse("counts", f"{steps} steps, as were recorded", int(counts[STEPS]))
    if counts[CONTACTS] > sizes.C:
        refuse("counts", f"at most {sizes.C} contacts, for which there is room", counts[CONTACTS])
    keys = arrays["keys"][: counts[CONTACTS]]
    forms.array("keys", keys, "i", (-1,), least=0, most=pairs - 1)
    first, second = np.divmod(keys // max(1, sizes.G), N)
    if (np.diff(keys) <= 0).any() or (first >= second).any():
        refuse("keys", "ascending pairs of bodies", "others")

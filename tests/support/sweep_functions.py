"""Functions for parameter studies, where workers in other processes can load them."""

import os
import signal
import time
from pathlib import Path

import numpy as np


def mixed(a, b):
    """Return numbers, an array and a text; b = 2 has no answer where a is 1."""
    if (a, b) == (1, 2):
        msg = f"b: expected anything but 2;\n got {b}"
        raise ValueError(msg)
    row = np.arange(3) / (1 + a)
    return {"total": (a + 10 * b, "mm"), "odd": a % 2 == 1, "row": row, "name": f"{a}/{b}"}


def drawn(a, b, rng, pause=0.0, log=None):
    """Return random numbers, and note in a file that this was computed."""
    time.sleep(pause)
    if log is not None:
        with Path(log).open("a") as file:
            file.write(f"{a} {b}\n")
    return {"x": (rng.normal(), "mm"), "y": rng.normal(size=4)}


def deadly(a, b):
    """Kill the worker that computes one of the points."""
    if (a, b) == (1, 2):
        os.kill(os.getpid(), signal.SIGKILL)
    return {"x": a + b}

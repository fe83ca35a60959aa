"""Everything from eight threads at once: what one finds, bit for bit, and the process survives."""

import os
import subprocess
import sys
from pathlib import Path

import in_threads

from polycorner.formulas.cache import cache_folder

MIXED = " ".join(in_threads.ACTS)


def run(folder, *groups):
    """Let threads act in a process of their own, warnings being errors, and return what it said."""
    script = Path(in_threads.__file__)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-X", "faulthandler", str(script), str(folder), *groups],
        env=os.environ | {"MALLOC_PERTURB_": "165"},  # what is freed is overwritten
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout.splitlines(), done.stderr


def test_threads_find_what_one_finds_with_kernels_that_are_not_compiled_yet(tmp_path):
    # Half of the threads simulate: their tables are full of addresses of kernels.
    shared = cache_folder() / "kernels"
    own = tmp_path / "0" / "kernels"
    own.mkdir(parents=True)
    for file in shared.glob("[!p]*.o"):  # of algorithms, not of formulas
        (own / file.name).symlink_to(file)
    acts = "simulate minimise simulate prove simulate skeleton simulate minima"
    assert run(tmp_path, acts) == (0, [acts], "")


def test_threads_find_what_one_finds_where_nothing_is_compiled(tmp_path):
    groups = [MIXED, *in_threads.ACTS]
    assert run(tmp_path, *groups) == (0, groups, "")

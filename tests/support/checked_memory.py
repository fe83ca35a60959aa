"""Programs run with an allocator that ends them where an array was written beyond its ends."""

import os
import platform
import subprocess
import sys
from pathlib import Path

CHECKER = "libc_malloc_debug.so.0"  # of the C library of GNU, since version 2.34
CHECKING = {"MALLOC_CHECK_": "3", "MALLOC_PERTURB_": "165"}  # memory begins and ends as garbage


def run(module, *arguments):
    """Run a module of this folder in a process of its own; fail with what it says if it fails.

    Where the C library has no such allocator, the program is run all the same.
    """
    loaded = " ".join([os.environ.get("LD_PRELOAD", ""), *_checker()]).strip()
    preload = {"LD_PRELOAD": loaded} if loaded else {}
    done = subprocess.run(
        [sys.executable, str(Path(__file__).with_name(f"{module}.py")), *map(str, arguments)],
        env={**os.environ, **CHECKING, **preload},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def _checker():
    folders = "/lib64", "/usr/lib64", "/usr/lib", f"/usr/lib/{platform.machine()}-linux-gnu"
    return [CHECKER] if any(Path(folder, CHECKER).exists() for folder in folders) else []

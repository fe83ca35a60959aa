"""Saved proofs: what the checker says of them, and copies that say something else."""

import contextlib
import copy
import io
import json
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from types import MappingProxyType

import flint

from polycorner.proofs import checker
from polycorner.proofs.checker.__main__ import main


def verdict(path, *options):
    """Return whether the checker verifies a file, and the line it prints."""
    before, printed = flint.ctx.prec, io.StringIO()
    with contextlib.redirect_stdout(printed):
        code = main([str(path), *options])
    flint.ctx.prec = before
    line = printed.getvalue().strip()
    assert line.startswith("verified" if code == 0 else "NOT VERIFIED")
    return code == 0, line


def parts_of(path):
    """Return the parts of a file, byte by byte."""
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def described(path):
    """Return the description of the problem in a file."""
    return json.loads(parts_of(path)["problem.json"])


def write(path, parts):
    """Write a file of parts; return the path."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    return path


def rewritten(path, data, parts=MappingProxyType({})):
    """Write a file with a description, and other parts; return the path."""
    return write(path, {**parts, "problem.json": json.dumps(data)})


def changed(path, change):
    """Apply a function to the description of a problem in a file; return the path."""
    parts = parts_of(path)
    data = json.loads(parts["problem.json"])
    change(data)
    return rewritten(path, data, parts)


def with_value(data, path, value):
    """Return a description with another value at a place."""
    if not path:
        return value
    forged = copy.deepcopy(data)
    place = forged
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return forged


def said_alone(path, folder):
    """Return what a copy of the checker prints of a file where there is no polycorner."""
    shutil.copytree(Path(checker.__file__).parent, folder / "checker")
    script = (
        "import sys; sys.modules['polycorner'] = None; import runpy; sys.argv = ['checker', {!r}];"
    )
    run = script.format(str(path)) + "runpy.run_module('checker', run_name='__main__')"
    result = subprocess.run(
        [sys.executable, "-c", run],
        cwd=folder, env={}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return result.stdout.strip() or result.stderr

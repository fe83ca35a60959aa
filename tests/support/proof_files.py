"""Saved proofs: what the checker says of them, and copies that say something else."""

import contextlib
import io
import json
import zipfile

import flint

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


def changed(path, change):
    """Apply a function to the description of a problem in a file; return the path."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    data = json.loads(parts["problem.json"])
    change(data)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in (parts | {"problem.json": json.dumps(data)}).items():
            archive.writestr(name, content)
    return path

"""``polycorner atlas`` run in this process or in one of its own, and checks of its answers."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO

import numpy as np
import pytest

from polycorner.cli.main import main


def run(*arguments):
    """Run the command in this process; return its exit code, output and errors."""
    sys.argv = ["polycorner", "atlas", *arguments]
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err), pytest.raises(SystemExit) as stopped:
        main()
    return stopped.value.code, out.getvalue(), err.getvalue()


@cache
def answer(*arguments):
    """Return a whole answer; nothing but JSON is printed, and nothing else is said."""
    code, out, err = run(*arguments, "--json")
    assert (code, err) == (0, "")
    return json.loads(out)


def started(*arguments, **options):
    command = [sys.executable, "-m", "polycorner", "atlas", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options)


def plain(shown):
    """Return what a terminal shows without colours and cursor movements."""
    return re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", bytes(shown).decode(errors="ignore"))


def on_terminal(*arguments, interrupt_at=None):
    """Run with errors on a terminal; return the exit code, what is printed and what is shown."""
    pty = pytest.importorskip("pty")
    terminal, end = pty.openpty()
    process = started(*arguments, stderr=end, env=os.environ | {"TERM": "xterm"})
    os.close(end)
    shown = bytearray()

    def read():
        try:
            while part := os.read(terminal, 1024):
                shown.extend(part)
        except OSError:  # the other end is closed
            pass

    reader = threading.Thread(target=read)
    reader.start()
    if interrupt_at is not None:
        while process.poll() is None and not re.search(interrupt_at, plain(shown)):
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
    out, _ = process.communicate()
    reader.join()
    os.close(terminal)
    return process.returncode, out, plain(shown)


def same_atlas(found, atlas):
    """Check that printed corners, edges and faces are those of an atlas."""
    assert [c["active"] for c in found["corners"]] == [list(c.active) for c in atlas.corners]
    for printed, corner in zip(found["corners"], atlas.corners, strict=True):
        np.testing.assert_allclose(printed["point"], corner.point, atol=1e-12)
        assert printed["local_type"] == corner.local_type.name.lower()
        assert printed["chirality"] == corner.chirality
    for printed, edge in zip(found["edges"], atlas.edges, strict=True):
        assert printed["ends"] == list(edge.ends)
        assert printed["active"] == list(edge.active)
        assert printed["length"] == pytest.approx(edge.length, rel=1e-12)
    for printed, face in zip(found["faces"], atlas.faces, strict=True):
        assert printed["active"] == list(face.active)
        assert printed["boundary"] == [list(curve) for curve in face.boundary]


def fits_together(found):
    """Check that what vanishes along an edge vanishes at its ends, and on a face along its edges.

    Only for models without relabelling, where names are the same everywhere.
    """
    for edge in found["edges"]:
        assert edge["length"] > 0
        for end in edge["ends"]:
            assert end is None or set(edge["active"]) < set(found["corners"][end]["active"])
    for face in found["faces"]:
        for edge in (found["edges"][k] for curve in face["boundary"] for k in curve):
            assert set(face["active"]) < set(edge["active"])

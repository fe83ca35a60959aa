"""Files that are made to harm: refused in one line, within bounded time and memory."""

import io
import json
import os
import resource
import struct
import subprocess
import sys
import zipfile

import pytest
import sympy as sp
from proof_files import parts_of, verdict

from polycorner import Manifold, Polyhedron
from polycorner.proofs import stationary_points

SECONDS, BYTES = 30, 500 * 2**20  # of processor time, which a loaded machine does not lengthen
PLANE = Manifold.euclidean("x y")
x, y = PLANE.symbols


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """Return the parts of a saved list."""
    disc = Polyhedron(PLANE, {"disc": 1 - x**2 - y**2})
    found = stationary_points(disc, x**2 - y**2 + sp.Rational(1, 3) * y, box=[(-2, 2), (-2, 2)])
    path = found.save(tmp_path_factory.mktemp("hostile") / "list.zip")
    assert verdict(path)[0]
    return parts_of(path)


def packed(parts, method=zipfile.ZIP_DEFLATED):
    """Return an archive of parts, which may be repeated."""
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", method) as archive:
        for name, content in parts:
            archive.writestr(zipfile.ZipInfo(name), content, method)
    return memory.getvalue()


def limited():
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))


def refused(path):
    """Check a file in a process with limits; return the refusal."""
    done = subprocess.run(
        [sys.executable, "-m", "polycorner.proofs.checker", str(path)],
        preexec_fn=limited, capture_output=True, text=True, check=False,
    )  # fmt: skip
    line = done.stdout.strip()
    assert (done.returncode, "Traceback" in done.stderr) == (1, False), done.stderr[-500:]
    assert line.startswith("NOT VERIFIED: ")
    assert "\n" not in line
    assert len(line) < 1100
    return line


def lying(parts):
    """Return an archive whose directory says that a part is small; it unpacks to 256 MiB."""
    content = bytearray(packed({**parts, "tree.bin": bytes(1 << 28)}.items()))
    size = struct.pack("<I", 1 << 28)
    assert size in content
    return bytes(content.replace(size, struct.pack("<I", 1000)))


def with_problem(parts, **changes):
    data = json.loads(parts["problem.json"]) | changes
    return packed({**parts, "problem.json": json.dumps(data)}.items())


def chain(op, count, first="2"):
    """Return a program in which one operation is applied again and again to two equal numbers."""
    binary = op in {"pow", "mul"}
    nodes = [["const", first], *([op, i, i] if binary else [op, i] for i in range(count))]
    return {"nodes": [*nodes, ["var", 0]], "outputs": [count, count]}


WIDE = 20_000


def many_coordinates(parts):
    """Return a point in very many coordinates."""
    region = json.loads(parts["problem.json"])["regions"][0] | {"active": []}
    sides = {"lower": ["-0x1p+1"] * WIDE, "upper": ["0x1p+1"] * WIDE}
    region |= {"sharp_lower": sides["lower"], "sharp_upper": sides["upper"], **sides}
    changes = {"coordinates": [f"x{i}" for i in range(WIDE)], "periods": [None] * WIDE}
    changes |= {"domain": sides, "regions": [region], "weights": ["0x1p+0"] * WIDE}
    return with_problem(parts, **changes)


DIGITS = "9" * 10**7
HOSTILE = {
    "empty": lambda _: b"",
    "no parts": lambda _: packed([]),
    "a part twice": lambda parts: packed([*parts.items(), ("tree.bin", parts["tree.bin"])]),
    "another path": lambda parts: packed((f"/{name}", x) for name, x in parts.items()),
    "packed by bz2": lambda parts: packed(parts.items(), zipfile.ZIP_BZIP2),
    "packed by lzma": lambda parts: packed(parts.items(), zipfile.ZIP_LZMA),
    "a bomb": lambda parts: packed({**parts, "tree.bin": bytes(1 << 28)}.items()),
    "a bomb in a bomb": lambda parts: packed(
        {**parts, "problem.json": packed([("problem.json", bytes(1 << 24))])}.items()
    ),
    "sizes that lie": lying,
    "empty lists": lambda parts: packed(
        {
            **parts,
            "problem.json": b"[" + b"[]," * (1 << 22) + b"[]]",
            "x": os.urandom(1 << 17),
        }.items()
    ),
    "deep lists": lambda parts: packed({**parts, "problem.json": b"[" * 10**5}.items()),
    "deep records": lambda parts: packed({**parts, "problem.json": b'{"a":' * 10**5}.items()),
    "a long whole number": lambda parts: packed({**parts, "problem.json": DIGITS}.items()),
    "a large exponent": lambda parts: packed({**parts, "problem.json": "1e999999999"}.items()),
    "no number": lambda parts: packed({**parts, "problem.json": "NaN"}.items()),
    "entries twice": lambda parts: packed(
        {**parts, "problem.json": b'{"open": 1, ' + parts["problem.json"][1:]}.items()
    ),
    "a long constant": lambda parts: with_problem(parts, **chain("exp", 3, DIGITS)),
    "a constant with an exponent": lambda parts: with_problem(
        parts, **chain("exp", 3, "1e99999999")
    ),
    "towers of powers": lambda parts: with_problem(parts, **chain("pow", 200)),
    "towers of exponentials": lambda parts: with_problem(parts, **chain("exp", 2000)),
    "squares of squares": lambda parts: with_problem(parts, **chain("mul", 5000, "3/2")),
    "sines": lambda parts: with_problem(parts, **chain("sin", 10_000)),
    "a side far away": lambda parts: with_problem(
        parts, domain={"lower": ["-0x1p+99999999999"] * 2, "upper": ["0x1p+1"] * 2}
    ),
    "sides that are no numbers": lambda parts: with_problem(
        parts, domain={"lower": ["nan"] * 2, "upper": ["0x1p+1"] * 2}
    ),
    "many coordinates": many_coordinates,
    "many functions": lambda parts: with_problem(
        parts, inequalities=10**12, functions=["f"] * 10**5
    ),
    "bytes that are no numbers": lambda parts: packed(
        {**parts, "positions.bin": b"1234567"}.items()
    ),
    "places that are no numbers": lambda parts: packed(
        {
            **parts,
            "positions.bin": struct.pack("<d", float("nan")) * (len(parts["positions.bin"]) // 8),
        }.items()
    ),
}


@pytest.mark.filterwarnings("ignore:Duplicate name")
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_a_line(name, good, tmp_path):
    (tmp_path / "file.zip").write_bytes(HOSTILE[name](good))
    refused(tmp_path / "file.zip")


def test_what_is_no_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.zip")
    (tmp_path / "folder.zip").mkdir()
    (tmp_path / "round.zip").symlink_to(tmp_path / "round.zip")
    for name in ("pipe", "folder", "round", "missing"):
        refused(tmp_path / f"{name}.zip")


def test_a_truncated_file_is_refused(good, tmp_path):
    content = packed(good.items())
    for end in [*range(40), *range(40, len(content), 97), *range(len(content) - 40, len(content))]:
        (tmp_path / "short.zip").write_bytes(content[:end])
        fine, line = verdict(tmp_path / "short.zip")
        assert not fine, end
        assert "\n" not in line

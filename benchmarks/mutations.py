"""Mutations of the package, one at a time, and the tests that kill them.

``python benchmarks/mutations.py [WORD ...]`` breaks a copy of the package in fifty places, or in
those whose files or tests contain a word, and runs the tests of that room, except the slow ones,
until the first fails.  A mutation that survives shows what no test asserts.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from side_by_side import ROOT, write

# In brackets the tests that have to notice; then files, a text that occurs once, and another one.
MUTATIONS = """
[spaces dumbbells/test_pair_gaps.py]
spaces/factors.py: across < 0, -1.0 => across > 0, -1.0
spaces/distances.py: 0 < past_second, past_second < nn => 0 < past_second
spaces/embedding.py: np.sinc(angle / np.pi) * along => np.sinc(angle) * along
[polyhedra]
polyhedra/cones.py: slopes[p] * rays[q] - slopes => slopes[p] * rays[q] + slopes
polyhedra/nerves.py: if death < birth: => if death <= birth:
polyhedra/nerves.py: aim[n] - result.fun => aim[n] + result.fun
polyhedra/strata.py: dimension=polyhedron.dimension - r, => dimension=polyhedron.dimension,
[formulas/test_interval_kernels.py intervals]
formulas/operations.py: g.const(Fraction(1, 2)), g.div( => g.const(Fraction(1, 3)), g.div(
intervals/balls.py: down, up = lower // unit, -(-upper => down, up = lower // unit, (upper
formulas/interval_library.py: low = b.fsub(r.fold(ends, => low = b.fadd(r.fold(ends,
formulas/interval_library.py: ">=", r.call("floor", last) => ">", r.call("floor", last)
formulas/ranges.py: return near, math.nextafter(near, math.inf) => return near, near
formulas/ranges.py: known.values[0], known.keeps_signs => known.values[0], True
[formulas]
formulas/translate.py: g.node("le", t(e.args[1]), t(e.args[0])) => g.node("lt", t(e.args[0]), 0)
formulas/shapes.py: len(monomial) + power > 2 => len(monomial) + power > 3
[bodies]
bodies/waves.py: * (k**2 + 1) for k => * k**2 for k
bodies/masses.py: length**2 / 4 + 3 * r => length**2 / 4 + r
bodies/masses.py: about - amount * np.outer(away, away)) => about)
bodies/lattices.py: max(1.0, 2 * reach => max(1.0, reach
bodies/sizes.py: s - (1 - c) * moving => s - c * moving
bodies/congruences.py: return mirrors, round( => return mirrors, 0 * round(
[minimisation]
minimisation/conditions.py: x = 1.0 / m - np.einsum => x = 1.0 / m + np.einsum
minimisation/conditions.py: (values[:k] >= -small).all() => (values >= -small).all()
minimisation/conditions.py: target[i] = -side * np.inf => target[i] = side * np.inf
minimisation/sensitivities.py: if a.weak: => if len(a.weak) > 1:
minimisation/descent/sqp.py: energy + 1e-4 * factor => energy - 1e-4 * factor
[motion/test_forces.py motion/test_friction.py motion/test_impacts.py]
motion/lagrange.py: g.add(g.sub(rest[i], rise.get => g.sub(g.sub(rest[i], rise.get
motion/friction.py: (abs(p[..., 1]) <= top) => (abs(p[..., 1]) <= c)
motion/trajectory.py: total[0] - worked + lost => total[0] - worked - lost
[motion/test_rotations.py]
motion/rotations.py: / 2 + 2 * mean * => / 2 + mean *
[motion/engine motion/test_friction.py motion/test_textbook_friction.py]
motion/engine/sets.py: abs(x) <= b * top => abs(x) <= a * top
[skeletons/test_tips.py skeletons/test_degenerate_points.py skeletons/test_skeleton.py]
skeletons/indices.py: low & ~before => low & before
skeletons/vertex_figures.py: < 1 - tolerances.dependent => < 1
[sweeps/test_refusals.py sweeps/test_values.py files test_container.py cli dumbbells/cli]
sweeps/grid.py: np.isnan(array).any() => np.isnan(array).all()
files/skeletons.py: > active and operator.eq => >= active and operator.eq
container.py: if not stored or sum( => if stored and sum(
cli/search.py: b if a == corner else a for => a if a == corner else b for
[proofs/test_krawczyk.py proofs/test_verification.py proofs/test_exact.py proofs/test_invariance.py]
proofs/kkt.py: x.contains_interior(y) for => x.contains(y) for
proofs/definite.py: len(form) and all(pivot > 0 for pivot in found) => len(form)
proofs/polynomials.py: + sign * weight => + weight
[proofs/lists/test_forged_lists.py proofs/lists/test_checker.py proofs/lists/test_contraction.py]
proofs/checker/faces.py: all(x > 0 for x in found[: len(self.active)]) => True
proofs/lists/directions.py: UNIT * size - TINY => UNIT * size + 2 * TINY
[models/wells/test_escape.py models/disks/test_critical.py]
models/wells/escape.py: -near[:-1] / (far => near[:-1] / (far
models/disks/critical_points.py: bool(fewest < index or not => bool(not
[pictures/solids]
pictures/solids/edge_collapse.py: free | (lengths < DEFAULT.same) => free
[dumbbells/test_pair_energy.py dumbbells/test_drum_formulas.py dumbbells/test_symmetries.py]
dumbbells/formulas.py: sympy.sin(theta) / (2 * rho)) ** 2) => sympy.sin(theta) / rho) ** 2)
dumbbells/drum_formulas.py: sign * (r - t)) / 2 => sign * (r + t)) / 2
dumbbells/symmetries.py: [y1, -x1, 1, y2, -x2, 1] => [y1, -x1, 1, y2, x2, 1]
[dumbbells/statics/test_keel.py dumbbells/dynamics dumbbells/test_turning.py]
dumbbells/statics/keel.py: - phi * pull => + phi * pull
dumbbells/dynamics/dyads.py: 2 * self.drift.error => 3 * self.drift.error
"""
COPIED = ("polycorner", "tests", "benchmarks", "examples", "paper_checks", "docs", "pyproject.toml")
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)


def mutations() -> Iterator[tuple[str, list[str], str, str]]:
    """Yield file, paths of tests, text and replacement."""
    tests: list[str] = []
    for line in MUTATIONS.strip().splitlines():
        if line.startswith("["):
            tests = line.strip("[]").split()
        else:
            file, change = line.split(": ", 1)
            yield file, tests, *change.split(" => ")


def killer(folder: Path, file: str, tests: list[str], old: str, new: str) -> str:
    """Return the test that fails on a mutation, or an empty string."""
    path = folder / "polycorner" / file
    text = path.read_text()
    if text.count(old) != 1:
        msg = f"{file}: expected the text once; got it {text.count(old)} times: {old}"
        raise ValueError(msg)
    options = ("-x", "-q", "-n", "0", "-m", "not slow", "-p", "no:cacheprovider")
    command = [sys.executable, "-m", "pytest", *options, *[f"tests/{name}" for name in tests]]
    cache = Path(os.environ.get("POLYCORNER_CACHE_DIR", folder / ".cache"))
    own = {"PYTHONPATH": str(folder), "POLYCORNER_CACHE_DIR": str(folder / ".cache")}
    if cache.exists():  # nothing that a mutation compiles is kept
        shutil.copytree(cache, folder / ".cache")
    try:
        path.write_text(text.replace(old, new))
        run = subprocess.run(
            command, check=False, cwd=folder, env=os.environ | own, capture_output=True, text=True
        )
    finally:
        path.write_text(text)
        shutil.rmtree(folder / ".cache", ignore_errors=True)
    failed = FAILED.search(run.stdout)
    return failed[1] if failed else f"exit code {run.returncode}" if run.returncode else ""


def main() -> None:
    words, rows = sys.argv[1:], []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name in COPIED:
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            copy(ROOT / name, folder / name)
        for file, tests, old, new in mutations():
            if words and not any(word in part for word in words for part in (file, *tests)):
                continue
            start = time.perf_counter()
            by = killer(folder, file, tests, old, new)
            seconds = round(time.perf_counter() - start, 1)
            rows.append({"file": file, "text": old, "instead": new, "killed by": by, "s": seconds})
            print(f"{seconds:6.1f} s  {file}: {by or 'SURVIVED'}", flush=True)
            survived = [row["file"] for row in rows if not row["killed by"]]
            write("mutations", {"count": len(rows), "survived": survived, "mutations": rows})


if __name__ == "__main__":
    main()

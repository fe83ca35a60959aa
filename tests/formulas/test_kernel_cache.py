"""Machine code on disk: compiled once, then loaded; remade when spoilt; not a necessity."""

import gc
import os
import subprocess
import sys
import threading
import weakref
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from llvmlite.binding import ffi

import polycorner
from polycorner import Manifold, Polyhedron, SmoothFunction, minimise
from polycorner.formulas import kernels, machine_code, shapes
from polycorner.formulas.bundles import resolve
from polycorner.formulas.cache import cache_folder, cache_size, clear_cache, one_at_a_time
from polycorner.formulas.families import Family
from polycorner.minimisation import problem

ROOT = Path(polycorner.__file__).parents[1]
LINE = Manifold.euclidean("x")

KERNEL = """
import sympy
from polycorner.formulas.families import Family
from polycorner.formulas.machine_code import machine_code
from polycorner.minimisation import problem
x = sympy.Symbol("x", real=True)
kernel = Family.of({"f": sympy.sin(x) + x**2}, ("x",)).kernel
print(*(kernel.compiled(order).origin for order in range(3)))
"""
PAIR = """
import sys
from polycorner.dumbbells import DumbbellPair
for radius in (125.0, float("inf")):
    pair = DumbbellPair(16, 3, 1.5, radius)
    q = pair.nested("R")
    values = pair.polyhedron.evaluate(q, 1)[0]
    pair.polyhedron.evaluate([q] * 99, 1)
    energy = pair.energy.gradient(q)
    kernels = [pair.polyhedron.functions[0].family.kernel, pair.energy.family.kernel]
    print(*(kernel.compiled(1).origin for kernel in kernels))
    print(values.tobytes().hex(), energy.tobytes().hex())
print("sympy" in sys.modules)
"""
DROPPED = """
import gc, sympy
from polycorner import Manifold, SmoothFunction
M = Manifold.euclidean("x")
for k in range(12):
    f = SmoothFunction("f", sympy.sin(M.symbols[0]) + k, M)
    assert f.value([0.0]) == k
    del f
    gc.collect()
print("done")
"""


def process(script, cache):
    """Return what a fresh interpreter prints, warnings being errors."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        cwd=ROOT,
        env=os.environ | {"POLYCORNER_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split("\n")[:-1]


def made():
    """Return the same function, made anew, and where its machine code came from."""
    shapes.forget()
    f = SmoothFunction("f", sp.cos(3 * LINE.symbols[0]), LINE)
    return f, resolve(f)[0].kernel.compiled(0).origin


def test_a_second_process_loads_what_the_first_compiled(tmp_path):
    assert process(KERNEL, tmp_path) == ["compiled compiled compiled"]
    assert process(KERNEL, tmp_path) == ["loaded loaded loaded"]


def test_a_second_process_never_imports_sympy_for_the_dumbbells(tmp_path):
    first, again = process(PAIR, tmp_path), process(PAIR, tmp_path)
    assert [first[0], first[2], first[4]] == ["compiled compiled"] * 2 + ["True"]
    assert [again[0], again[2], again[4]] == ["loaded loaded"] * 2 + ["False"]
    assert first[1::2] == again[1::2], "the same code gives the same bits"


def test_kernels_may_be_forgotten_in_any_order(tmp_path):
    """Freeing one kernel must not pull the ground from under the others."""
    assert process(DROPPED, tmp_path) == ["done"]


def test_a_forgotten_kernel_leaves_the_others_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path))
    kept, _ = made()
    before = kept.value([0.5])
    other, _ = made()
    other.value([0.5])
    del other
    gc.collect()
    assert kept.value([0.5]) == before


def test_families_without_a_key_are_told_apart_by_their_formulas():
    x, y = sp.symbols("x y", real=True)
    families = [
        Family(("f",), ("x", "y"), (), lambda f=f: ({}, {"f": f})) for f in (x + y, x - y, x + y)
    ]
    sums = [f.kernel.over(np.array([[3.0, 2.0]]), 0, 0)[0].item() for f in families]
    assert sums == [5.0, 1.0, 5.0]
    assert families[0].kernel is families[2].kernel


def test_the_folder_can_be_chosen(tmp_path, monkeypatch):
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path / "deep" / "folder"))
    assert cache_folder() == tmp_path / "deep" / "folder"
    assert made()[1] == "compiled"
    assert len(list(cache_folder().rglob("*.*"))) == 1, "one file for one kernel, nothing left over"
    assert made()[1] == "loaded"


def test_without_a_choice_it_is_the_users_cache(monkeypatch):
    monkeypatch.delenv("POLYCORNER_CACHE_DIR", raising=False)
    assert "polycorner" in cache_folder().parts


@pytest.mark.parametrize(
    "spoil",
    [
        lambda _: b"",
        lambda code: code[:20],
        lambda code: code[:-1],
        lambda code: code + b"\0",
        lambda code: code[:100] + bytes([code[100] ^ 1]) + code[101:],
        lambda code: bytes(len(code)),
    ],
    ids=["empty", "stub", "cut", "longer", "one bit", "zeros"],
)
def test_a_spoilt_file_is_compiled_again(tmp_path, monkeypatch, spoil):
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path))
    f, _ = made()
    (file,) = tmp_path.rglob("*.o")
    code = file.read_bytes()
    file.write_bytes(spoil(code))
    again, origin = made()
    assert origin == "compiled"
    assert again.value([0.5]) == f.value([0.5])
    assert file.read_bytes() == code, "the file is mended"
    assert made()[1] == "loaded"


@pytest.mark.parametrize("below", ["", "kernels", "deep/kernels"])
def test_a_folder_that_cannot_be_made_costs_a_warning_only(tmp_path, monkeypatch, below):
    file = tmp_path / "file"
    file.write_text("not a folder")
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(file / below))
    with pytest.warns(RuntimeWarning, match="POLYCORNER_CACHE_DIR"):
        f, origin = made()
    assert origin == "compiled"
    assert f.value([0.5]) == pytest.approx(np.cos(1.5), abs=1e-15)
    assert list(tmp_path.iterdir()) == [file]


def test_one_waits_until_the_other_is_done(tmp_path, monkeypatch):
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path / "new"))
    done = []

    def later():
        with one_at_a_time("slow"):
            done.append("later")

    waiting = threading.Thread(target=later)
    with one_at_a_time("slow"):
        waiting.start()
        waiting.join(0.3)
        assert waiting.is_alive()
        with one_at_a_time("other"):
            done.append("first")
    waiting.join(30)
    assert done == ["first", "later"]


def test_a_mistake_lets_the_next_one_in(tmp_path, monkeypatch):
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path))
    with pytest.raises(KeyboardInterrupt), one_at_a_time("slow"):
        raise KeyboardInterrupt
    with one_at_a_time("slow"):
        assert list(tmp_path.iterdir()) == [tmp_path / "slow.lock"]


def test_where_the_folder_cannot_be_written_a_temporary_one_serves(tmp_path, monkeypatch):
    named = tmp_path / "file"
    named.write_text("")
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(named))
    with pytest.warns(RuntimeWarning, match="POLYCORNER_CACHE_DIR"):
        folder = cache_folder()
    assert folder != named
    assert cache_folder() == folder  # and no second warning
    _, first = made()
    _, second = made()
    assert (first, second) == ("compiled", "loaded")
    with one_at_a_time("slow"):
        assert named.read_text() == ""


def test_the_size_counts_what_clearing_deletes(tmp_path, monkeypatch):
    monkeypatch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path / "new"))
    assert cache_size() == (0, 0)
    made()
    files, size = cache_size()
    assert files == 1
    assert size > 1000
    assert clear_cache() == (files, size)
    assert cache_size() == (0, 0)
    assert made()[1] == "compiled"


def test_threads_that_ask_for_code_at_once_are_given_the_same(monkeypatch):
    make, found, threads = kernels.CompiledKernel, [], []

    def slow(kernel, order):
        if not threads:  # another thread asks while this one compiles
            threads.append(threading.Thread(target=lambda: found.append(kernel.compiled(order))))
            threads[0].start()
            threads[0].join(0.3)
        return make(kernel, order)

    monkeypatch.setattr(kernels, "CompiledKernel", slow)
    shapes.forget()
    kernel = Family.of({"f": sp.sin(sp.Symbol("x", real=True))}, ("x",)).kernel
    code = kernel.compiled(1)
    threads[0].join(30)
    assert found == [code]
    assert kernel.compiled(1) is code


def test_equal_formulas_of_threads_share_one_kernel(monkeypatch):
    make, found, threads = kernels.Kernel, [], []

    def shared():
        return shapes.shared_kernel("a key", lambda: None, 1, 0, 1)

    def slow(*arguments, **sizes):
        if not threads:
            threads.append(threading.Thread(target=lambda: found.append(shared())))
            threads[0].start()
            threads[0].join(0.3)
        return make(*arguments, **sizes)

    monkeypatch.setattr(kernels, "Kernel", slow)
    kernel = shared()
    threads[0].join(30)
    assert found == [kernel]
    assert shared() is kernel


def test_code_goes_with_its_polyhedron(monkeypatch):
    engines, load = weakref.WeakSet(), machine_code.load_code

    def noted(code, entries):
        engine, addresses = load(code, entries)
        engines.add(engine)
        return engine, addresses

    monkeypatch.setattr(machine_code, "load_code", noted)
    plane = Manifold.euclidean("x y")
    x, y = plane.symbols
    for k in range(3):
        bowl = Polyhedron(plane, {"bowl": y - sp.cosh(x + sp.Rational(k, 7)) ** (k + 2)})
        assert minimise(bowl, y + sp.sin(x) ** (k + 2), [0.1, 9.0]).verdict
        assert engines
        del bowl
        problem._posed.cache_clear()
        gc.collect()
        assert not engines


def test_compiling_leaves_nothing_behind(monkeypatch):
    counts = Counter()
    for name in ("buildPerModuleDefaultPipeline", "DisposeNewModulePassManger"):
        call = getattr(ffi.lib, f"LLVMPY_{name}")

        def counted(*arguments, call=call, name=name):
            counts[name] += 1
            return call(*arguments)

        monkeypatch.setitem(ffi.lib._fntab, f"LLVMPY_{name}", counted)
    for _ in range(3):
        assert machine_code.machine_code("define double @twice(double %x) { ret double %x }")
    gc.collect()
    assert [*counts.values()] == [3, 3]

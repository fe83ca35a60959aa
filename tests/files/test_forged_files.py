"""Forged files of every kind, digests that fit included: read, or refused in one sentence."""

import signal

import numpy as np
import pytest
from diagrams import leaning_well
from discs import DISCS, START
from forgeries import (
    Kept,
    forge_arrays,
    forge_dataset,
    forge_graph,
    forge_json,
    forge_list,
    forge_search,
    forge_sweep,
    forged,
    outcome,
)
from hypothesis import given
from hypothesis import strategies as st
from kept_files import motion
from landscape_values import double_well
from proof_files import verdict

from polycorner import Manifold, Polyhedron, files, minimise, simulate, skeleton
from polycorner.dumbbells import DumbbellDrum
from polycorner.dumbbells.dynamics import files as run_files
from polycorner.files import (
    branches,
    certificates,
    graphs,
    landscapes,
    samples,
    skeletons,
    trajectories,
)
from polycorner.measures import Weighting, sample
from polycorner.models import textbook
from polycorner.motion import Checkpoint, checkpoints
from polycorner.proofs import stationary_points
from polycorner.sweeps import open_results, sweep

M = Manifold.euclidean("x y")
X, Y = M.symbols
BOWL = Polyhedron(M, {"bowl": Y - X**2, "lid": 2 - Y})
RING = Polyhedron(M, {"out": 9 - X**2 - Y**2, "in": X**2 + Y**2 - 1, "cut": X + 2 - Y})
BALL = textbook.bouncing_ball(0.5)
GRID = {"a": ([0, 1, 2], "mm"), "b": [1, 2]}
DISC = Polyhedron(M, {"disc": 4 - X**2 - Y**2})


def certificate(folder):
    path = files.save_certificate(minimise(BOWL, X + Y, [1.0, 1.5]), folder / "certificate")
    return Kept(path, forge_json(certificates.KIND), files.load_certificate)


def atlas(folder, budget=100, kind="PCG64"):
    rng = np.random.Generator(getattr(np.random, kind)(7))
    found = skeleton(RING, [[0.0, 1.5], [2.5, 0.0]], budget=budget, rng=rng)

    def read(path):
        return files.load_skeleton(path).state.rng.random(2000)

    path = files.save_skeleton(found, folder / "atlas")
    return Kept(path, forge_json(skeletons.KIND), read)


def landscape(folder):
    def read(path):
        found = files.load_landscape(path)
        return found.merges, found.loops, [found.depth(k) for k in range(len(found.minima))]

    path = files.save_landscape(double_well(), folder / "landscape")
    return Kept(path, forge_json(landscapes.KIND), read)


def diagram(folder):
    def read(path):
        found = files.load_diagram(path)
        return [(c.point.tolist(), c.verdict) for c in found.at(0.25)], found.closed

    path = files.save_diagram(leaning_well(), folder / "diagram")
    return Kept(path, forge_json(branches.KIND), read)


def points(folder):
    found = sample(BOWL, [[0.0, 1.0]], 20, weighting=Weighting(energy=X), rng=1)
    path = files.save_sample(found, folder / "sample")
    return Kept(path, forge_arrays(samples.KIND), lambda path: str(files.load_sample(path).more(5)))


def unfinished(folder):
    return atlas(folder, 1, "MT19937")


def graph(folder):
    path = files.save_graph(skeleton(BOWL, [[0.0, 1.0]]), folder / "graph")
    return Kept(path, forge_graph(graphs.KIND), files.load_graph)


def trajectory(folder):
    path = files.save_trajectory(motion(BALL, 1, 1, "floor"), folder / "path.nc")
    return Kept(
        path, forge_dataset(trajectories.KIND), lambda path: str(files.load_trajectory(path, BALL))
    )


def run(folder):
    drum = DumbbellDrum(floor=True, top=60.0, tilt=0.5, spin=0.02)
    path = run_files.save_run(motion(drum, 1, 4, "floor1"), folder / "run.nc")
    return Kept(path, forge_dataset(run_files.KIND), lambda path: str(run_files.load_run(path)))


def checkpoint(folder):
    def go_on(path, t_end=0.3, stop=None):
        saving = Checkpoint(path, seconds=0.0)
        start = DISCS.state(START)
        return simulate(DISCS, start, t_end, 1e-3, every=20, checkpoint=saving, progress=stop)

    path = folder / "run"
    go_on(path, stop=lambda done, *_: done > 0.2 and signal.raise_signal(signal.SIGINT))
    return Kept(path, forge_arrays(checkpoints.KIND), go_on)


def total(a, b):
    return {"sum": a + b}


def table(folder):
    path = folder / "table"
    sweep(total, GRID, store=path)

    def read(path):
        open_results(path).load()
        sweep(total, GRID, store=path)

    return Kept(path, forge_sweep, read)


def proof(folder):
    found = stationary_points(DISC, energy=X**2 + Y**2, box=[(-3, 3), (-3, 3)])
    return Kept(found.save(folder / "list.zip"), forge_list, verdict)


def search(folder):
    def go_on(path, limit=200):
        box, energy = [(-3, 3), (-3, 3)], X**4 + Y**2 - X**2
        return stationary_points(DISC, energy=energy, box=box, store=path, max_boxes=limit)

    go_on(folder / "search", 20)
    return Kept(folder / "search", forge_search, go_on)


KINDS = [
    certificate,
    atlas,
    landscape,
    diagram,
    points,
    unfinished,
    graph,
    trajectory,
    run,
    checkpoint,
    table,
]
KINDS += [proof, search]


@pytest.fixture(scope="module", params=KINDS)
def kept(request, tmp_path_factory):
    return request.param(tmp_path_factory.mktemp("kept"))


@given(seed=st.integers(0, 10**6))
def test_a_forged_file_is_read_or_refused_in_one_sentence(kept, tmp_path_factory, seed):
    path = forged(kept, tmp_path_factory.mktemp("forged"), seed)
    assert outcome(kept, path) in ("read", "refused")

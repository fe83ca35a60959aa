"""Samples in files: read to the last bit, gone on with, and refused where points differ."""

from dataclasses import replace

import numpy as np
import pytest

from polycorner import Manifold, Polyhedron
from polycorner.files import load_sample, save_sample
from polycorner.measures import SampleOptions, Weighting, sample
from polycorner.models import SphereCluster

M = Manifold.euclidean("x y")
x, y = M.symbols
BOWL = Polyhedron(M, {"parabola": y - x**2, "lid": 2 - y})
CAP = Manifold.sphere("x y z")
DOME = Polyhedron(CAP, {"floor": CAP.symbols[2] - 0.2})
WEIGHTINGS = [
    Weighting(),
    Weighting(stickiness={"lid": 1 / 3}, gradients=False, energy=x + y / 3, temperature=0.7),
    Weighting(stickiness=0.1, stiffness=50.0),
]


def bowl(weighting, points=40):
    options = SampleOptions(step=0.7, every=3, discarded=10)
    starts = [[0.0, 1.0], [0.5, 2.0]]
    return sample(BOWL, starts, points, weighting=weighting, rng=1, options=options)


@pytest.mark.parametrize("weighting", WEIGHTINGS)
def test_a_sample_is_read_to_the_last_bit_and_gone_on_with(weighting, tmp_path):
    found = bowl(weighting)
    path = save_sample(found, tmp_path / "new" / "sample.npz")
    for read in (load_sample(path), load_sample(path, BOWL)):
        assert read.strata == found.strata
        assert read.sampler.options == found.sampler.options
        for one, other in ((read, found), (read.more(30), found.more(30))):
            np.testing.assert_array_equal(one.points, other.points)
            np.testing.assert_array_equal(one.positions, other.positions)
            np.testing.assert_array_equal(one.moves, other.moves)
            assert [s.stream for s in one.states] == [s.stream for s in other.states]
    assert save_sample(load_sample(path), tmp_path / "again").read_bytes() == path.read_bytes()


def test_spheres_and_clusters_are_kept(tmp_path):
    model = SphereCluster(5)
    cluster = sample(
        model.polyhedron, model.starts(), 20, contacts=(7, 9), keep=["1-2"], rng=3,
        options=SampleOptions(step=0.2, sideways=0.05),
    )  # fmt: skip
    for found in (cluster, sample(DOME, [[0.0, 0.6, 0.8]], 20, rng=3)):
        read = load_sample(save_sample(found, tmp_path / "s.npz"))
        np.testing.assert_array_equal(read.points, found.points)
        assert read.sampler.keep == found.sampler.keep
        assert read.sampler.contacts == found.sampler.contacts


def test_points_have_to_be_on_their_strata(tmp_path):
    found = bowl(Weighting())
    at = int(np.flatnonzero(found.contacts[0])[0])
    for place, words in (
        (found.points[0, at] + 1e-3, f"at point {at}: written as zero"),
        ((0.0, 3.0), f"'lid' at point {at}: written as"),
    ):
        moved = found.points.copy()
        moved[0, at] = place
        path = save_sample(replace(found, points=moved), tmp_path / "away.npz")
        with pytest.raises(ValueError, match=words):
            load_sample(path)


def test_other_polyhedra_and_files_are_refused(tmp_path):
    path = save_sample(bowl(Weighting()), tmp_path / "sample.npz")
    with pytest.raises(ValueError, match="functions: written parabola, lid, found lid"):
        load_sample(path, Polyhedron(M, {"lid": 2 - y}))
    with pytest.raises(ValueError, match="'lid' at point"):
        load_sample(path, Polyhedron(M, {"parabola": y - x**2, "lid": 1 - y}))
    content = path.read_bytes()
    path.write_bytes(content.replace(b"parabola", b"parabole"))
    with pytest.raises(ValueError, match="was changed after it was written"):
        load_sample(path)

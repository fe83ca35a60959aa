"""Jammed packings: no overlaps, balanced forces, isostaticity, and agreement with certificates."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from polycorner.minimisation import Verdict
from polycorner.minimisation.analysis import analyse_sparse
from polycorner.models import PeriodicPacking
from polycorner.tolerances import DEFAULT


@pytest.fixture(
    scope="module",
    params=[
        (PeriodicPacking.bidisperse(64), 1),
        (PeriodicPacking.bidisperse(200, box=3.0), 2),
        (PeriodicPacking.monodisperse(64), 3),
        (PeriodicPacking(np.random.default_rng(0).uniform(0.7, 1.3, 130)), 4),
    ],
    ids=["discs", "box", "spheres", "polydisperse"],
)
def jammed(request):
    packing, seed = request.param
    return packing.jam(seed)


def test_no_two_bodies_overlap(jammed):
    centres = jammed.centres % jammed.box
    radii = jammed.inflation * jammed.radii
    pairs = cKDTree(centres, boxsize=jammed.box).query_pairs(2.001 * radii.max())
    for i, j in pairs:
        between = centres[j] - centres[i]
        between -= jammed.box * np.round(between / jammed.box)
        overlap = radii[i] + radii[j] - np.linalg.norm(between)
        assert overlap <= 1e-12 * jammed.diameter


def test_forces_balance_on_every_body(jammed):
    total = np.zeros_like(jammed.centres)
    virial = 0.0
    for (i, j), force in zip(jammed.pairs, jammed.forces, strict=True):
        between = jammed.centres[j] - jammed.centres[i]
        between -= jammed.box * np.round(between / jammed.box)
        length = np.linalg.norm(between)
        touching = jammed.inflation * (jammed.radii[i] + jammed.radii[j])
        assert abs(length - touching) <= 1e-12 * jammed.diameter
        total[i] -= force * between / length
        total[j] += force * between / length
        virial += force * (jammed.radii[i] + jammed.radii[j])
    assert abs(total).max() <= 1e-10 * jammed.forces.mean()
    assert virial == pytest.approx(1.0, abs=1e-12)
    assert (jammed.forces > 0).all()


def test_a_packing_is_isostatic_with_one_state_of_self_stress(jammed):
    backbone = np.setdiff1d(np.arange(jammed.count), jammed.rattlers)
    d = jammed.dimension
    assert len(jammed.pairs) == d * (len(backbone) - 1) + 1 == jammed.isostatic_number
    rigidity = np.zeros((len(jammed.pairs), jammed.count, d))
    away = jammed.vectors / np.linalg.norm(jammed.vectors, axis=1)[:, None]
    for row, (i, j) in enumerate(jammed.pairs):
        rigidity[row, i] -= away[row]
        rigidity[row, j] += away[row]
    matrix = rigidity.reshape(len(jammed.pairs), -1)
    assert np.linalg.matrix_rank(matrix) == len(jammed.pairs) - 1
    stress = np.linalg.svd(matrix.T)[2][-1]
    parallel = abs(stress @ jammed.forces) / np.linalg.norm(jammed.forces)
    assert parallel == pytest.approx(1.0, abs=1e-9)


def test_every_body_is_held_by_enough_contacts_or_is_a_rattler(jammed):
    carrying = jammed.degrees[jammed.degrees > 0]
    assert carrying.min() >= jammed.dimension + 1
    assert jammed.verdict is (
        Verdict.MINIMUM_ALONG_LOCUS if len(jammed.rattlers) else Verdict.STRICT_MINIMUM
    )


def test_certify_finds_the_same_forces(jammed):
    certificate = jammed.certificate
    assert certificate.problem.is_sparse == (jammed.point.size > 250)
    found = analyse_sparse(certificate.problem, certificate.point, DEFAULT)
    assert found.verdict is jammed.verdict
    multipliers = found.named_multipliers
    forces = [multipliers[f"{i + 1}-{j + 1}"] for i, j in jammed.pairs]
    assert forces == pytest.approx(jammed.forces, rel=1e-7)
    assert found.signature == (len(jammed.pairs), 0, jammed.dimension * len(jammed.rattlers))
    assert certificate.residuals.worst < 1e-12


def test_gaps_left_open_are_positive(jammed):
    _, gaps = jammed.near_gaps(0.2)
    assert len(gaps)
    assert gaps.min() > 0


def test_small_packings_agree_with_full_matrices():
    jammed = PeriodicPacking.bidisperse(24).jam(5)
    dense = jammed.certificate
    assert not dense.problem.is_sparse
    sparse = analyse_sparse(dense.problem, dense.point, DEFAULT)
    assert sparse.verdict is dense.verdict
    assert sparse.names == dense.active
    assert sparse.independent == dense.licq
    expected = dense.multipliers
    for name, value in sparse.named_multipliers.items():
        assert value == pytest.approx(expected[name], abs=1e-11 * jammed.forces.mean())


def test_scale_and_translation_change_nothing_else():
    packing = PeriodicPacking.bidisperse(40)
    start = packing.soft_start(3)
    one = packing.jam(start)
    other = PeriodicPacking.bidisperse(40, box=7.0).jam(7.0 * start)
    assert other.density == pytest.approx(one.density, rel=1e-9)
    assert other.pairs.tolist() == one.pairs.tolist()
    assert other.forces == pytest.approx(one.forces, rel=1e-6)


def test_a_stopped_chain_says_so():
    packing = PeriodicPacking.monodisperse(64)
    jammed = packing.jam(packing.scattered(0), max_programmes=1)
    assert jammed.verdict is Verdict.NOT_CONVERGED
    assert jammed.residuals.overlap < 1e-9


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: PeriodicPacking([1.0, -1.0]), "radii"),
        (lambda: PeriodicPacking.monodisperse(4), "radii"),
        (lambda: PeriodicPacking.monodisperse(100, 4), "dimension"),
        (lambda: PeriodicPacking.bidisperse(100, box=0.0), "box"),
        (lambda: PeriodicPacking.bidisperse(100).jam([[0.0, 0.0]]), "start"),
        (lambda: PeriodicPacking.bidisperse(100).jam(1, max_programmes=0), "max_programmes"),
        (lambda: PeriodicPacking.bidisperse(100).soft_start(1, overlap=0.0), "overlap"),
    ],
)
def test_wrong_arguments(make, argument):
    with pytest.raises(ValueError, match=argument):
        make()


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: PeriodicPacking("ab"), "radii"),
        (lambda: PeriodicPacking.bidisperse(100).jam("abc"), "start"),
        (lambda: PeriodicPacking.bidisperse(100).jam([[0.0], [0.0, 1.0]]), "start"),
    ],
)
def test_what_is_no_numbers_is_named(make, argument):
    with pytest.raises(TypeError, match=f"^{argument}: expected "):
        make()

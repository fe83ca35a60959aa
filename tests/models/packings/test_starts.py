"""Soft starts: balanced forces, the overlap that was asked for, and the predicted jamming."""

import numpy as np
import pytest

from polycorner.models import PeriodicPacking
from polycorner.models.packings.periodic import decompressed, excess


def contacts(centres, radii, box):
    """Return vectors, distances and sums of radii of all pairs that overlap, by comparison."""
    i, j = np.triu_indices(len(centres), 1)
    between = centres[j] - centres[i]
    between -= box * np.round(between / box)
    distance = np.linalg.norm(between, axis=1)
    sums = radii[i] + radii[j]
    near = distance < sums
    return i[near], j[near], between[near], distance[near], sums[near]


def mean_overlap(centres, radii, box):
    """Return the mean overlap, and the largest force on a body over the mean force."""
    i, j, between, distance, sums = contacts(centres, radii, box)
    overlap = 1 - distance / sums
    force = (overlap / (sums * distance))[:, None] * between
    total = np.zeros_like(centres)
    np.add.at(total, j, force)
    np.subtract.at(total, i, force)
    return overlap.mean(), abs(total).max() / (overlap / sums).mean()


def best_balance(centres, radii, box):
    """Return overlap and unbalanced force at the inflation where the forces balance best."""
    inflation, width = inflation_at_contact(centres, radii, box), 3e-3
    inflations = inflation * (1 + np.linspace(1e-6, width, 201))
    for _ in range(3):
        best = min(inflations, key=lambda s: mean_overlap(centres, s * radii, box)[1])
        width /= 30
        inflations = best * (1 + np.linspace(-width, width, 61))
    return mean_overlap(centres, best * radii, box)


def inflation_at_contact(centres, radii, box):
    """Return the inflation at which the first two bodies touch, from all distances."""
    i, j = np.triu_indices(len(centres), 1)
    between = centres[j] - centres[i]
    between -= box * np.round(between / box)
    return (np.linalg.norm(between, axis=1) / (radii[i] + radii[j])).min()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("dimension", [2, 3])
def test_a_soft_start_is_balanced_and_overlaps_a_little(dimension, seed):
    """The forces balance at the inflation where the minimisation ended, and only there."""
    packing = PeriodicPacking.bidisperse(60, dimension)
    centres = packing.soft_start(seed, overlap=1e-4)
    overlap, unbalanced = best_balance(centres, packing.radii, packing.box)
    assert 1e-5 <= overlap <= 1.5e-4
    assert unbalanced < 0.02


@pytest.mark.parametrize("density", [0.6, 0.9])
def test_bodies_are_inflated_until_they_overlap_and_deflated_until_they_hardly_do(density):
    packing = PeriodicPacking.bidisperse(40)
    radii = packing.radii * np.sqrt(density / packing.density(1.0))
    centres = decompressed(packing.scattered(2), radii, packing.box, 5000, overlap=1e-4)
    jammed = packing.jam(centres)
    moved = jammed.centres - centres
    moved -= np.delete(moved, jammed.rattlers, axis=0).mean(axis=0)
    assert jammed.is_isostatic
    assert abs(np.delete(moved, jammed.rattlers, axis=0)).max() < 0.05 * jammed.diameter


def test_the_excess_inflation_of_a_ring_is_known_to_second_order():
    """In a ring of equal soft bodies every overlap is ``1 - s_J / s``, which is the excess."""
    true = np.array([1e-2, 1e-3, 1e-4])
    errors = [abs(excess(np.full(7, e)) - e) for e in true]
    assert np.diff(np.log10(errors)) == pytest.approx([-2, -2], abs=0.01)

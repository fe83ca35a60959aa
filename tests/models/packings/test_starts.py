"""Soft starts: balanced forces, the overlap that was asked for, and the predicted jamming."""

import numpy as np
import pytest

from polycorner.models import PeriodicPacking
from polycorner.models.packings.starts import decompressed, excess


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


def inflation_with(centres, radii, box, total):
    """Return the inflation at which the overlaps sum to a given value, by bisection."""
    low, high = 0.0, box / 4 / radii.max()
    for _ in range(60):
        middle = (low + high) / 2
        distance, sums = contacts(centres, middle * radii, box)[3:]
        low, high = (low, middle) if (1 - distance / sums).sum() > total else (middle, high)
    return low


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_soft_start_is_balanced_and_overlaps_a_little(dimension):
    """Near jamming ``N`` bodies have about ``d N`` contacts."""
    packing = PeriodicPacking.bidisperse(60, dimension)
    centres = packing.soft_start(1, overlap=1e-4)
    total = dimension * packing.count * 1e-4
    inflation = inflation_with(centres, packing.radii, packing.box, total)
    overlap, unbalanced = mean_overlap(centres, inflation * packing.radii, packing.box)
    assert overlap == pytest.approx(1e-4, rel=0.2)
    assert unbalanced < 0.2


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

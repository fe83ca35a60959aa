"""The picture of a critical configuration shows its disks, contacts and forces."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle

from polycorner.models.disks.disks import TorusDisks
from polycorner.pictures.disks import THICKEST, draw_critical
from polycorner.pictures.style import save


@pytest.fixture(scope="module")
def two_disks():
    model = TorusDisks(2, "hexagonal")
    return model, model.critical(np.random.default_rng(0))


def test_disks_and_their_images_touch_and_do_not_overlap(two_disks, tmp_path):
    model, configurations = two_disks
    figure = draw_critical(model, configurations)
    for axes, c in zip(figure.axes, configurations, strict=True):
        circles = [patch for patch in axes.patches if isinstance(patch, Circle)]
        assert {circle.radius for circle in circles} == {c.radius}
        centres = np.unique(np.round([circle.center for circle in circles], 9), axis=0)
        apart = np.linalg.norm(centres[:, None] - centres, axis=2)
        assert apart[apart > 0].min() == pytest.approx(2 * c.radius, abs=1e-8)
        assert f"index {c.index}" in axes.get_title()
    assert save(figure, tmp_path / "disks.png").stat().st_size > 10_000


def test_contacts_are_wide_by_force(two_disks):
    model, configurations = two_disks
    saddle = configurations[1]
    (axes,) = draw_critical(model, [saddle]).axes
    lines = [artist for artist in axes.collections if isinstance(artist, LineCollection)]
    # Each contact is drawn twice, faint everywhere and full in the cell.
    assert len(lines) == 2 * len(saddle.contacts)
    # The two forces are equal, so both have the full width.
    np.testing.assert_allclose([line.get_linewidths()[0] for line in lines], THICKEST)
    for line in lines:
        for start, end in line.get_segments():
            assert np.linalg.norm(end - start) == pytest.approx(2 * saddle.radius)

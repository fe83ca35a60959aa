"""The picture of a critical configuration shows its disks, contacts and forces."""

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.patches import Circle

from polycorner.models import PeriodicPacking
from polycorner.models.disks.disks import TorusDisks
from polycorner.pictures import draw_packing
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


# ---------------------------------------------------------------------------------- jammed packings


@pytest.fixture(scope="module")
def jammed():
    return PeriodicPacking.bidisperse(48).jam(2)


def drawn(figure, kind):
    (found,) = [c for c in figure.axes[0].collections if isinstance(c, kind)]
    return found


def test_bodies_are_drawn_with_their_diameters_and_all_images(jammed):
    bodies = drawn(draw_packing(jammed), EllipseCollection)
    widths = np.asarray(bodies.get_widths()).reshape(9, -1)
    np.testing.assert_allclose(widths, np.tile(2 * jammed.inflation * jammed.radii, (9, 1)))
    places = np.asarray(bodies.get_offsets()).reshape(9, -1, 2)
    assert np.ptp(places - places[0], axis=1).max() < 1e-12
    pale = bodies.get_facecolors()[: jammed.count].sum(axis=1)
    assert set(np.flatnonzero(pale == pale.max())) >= set(np.asarray(jammed.rattlers).tolist())


def test_lines_join_bodies_that_touch_and_are_wider_for_larger_forces(jammed):
    lines = drawn(draw_packing(jammed), LineCollection)
    segments = np.array(lines.get_segments()).reshape(9, -1, 2, 2)[4]
    lengths = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    sums = jammed.inflation * jammed.radii[jammed.pairs].sum(axis=1)
    np.testing.assert_allclose(lengths, sums, rtol=1e-9)
    widths = np.asarray(lines.get_linewidths()).reshape(9, -1)[0]
    order = np.argsort(jammed.forces)
    assert (np.diff(widths[order]) >= 0).all()


def test_spheres_are_refused():
    spheres = PeriodicPacking.monodisperse(60).jam(1)
    with pytest.raises(ValueError, match="packing: expected discs; got '60 spheres'"):
        draw_packing(spheres)

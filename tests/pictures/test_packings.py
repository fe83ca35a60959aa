"""Figures of packings: a disc for every body and its images, a line for every contact force."""

import numpy as np
import pytest
from matplotlib.collections import EllipseCollection, LineCollection

from polycorner.models import PeriodicPacking
from polycorner.pictures import draw_packing


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

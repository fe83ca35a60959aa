"""Barcodes: a bar for every class, between its birth and its death."""

import math

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from polycorner.pictures import draw_barcode
from polycorner.polyhedra import Bar, Nerve


def test_bars_go_from_birth_to_death():
    bars = (Bar(0, math.inf, -math.inf), Bar(0, 2.0, 1.0), Bar(1, 1.5, -math.inf))
    (axes,) = draw_barcode(Nerve(np.zeros(0), np.zeros(0), bars), "size").axes
    drawn = [c for c in axes.collections if isinstance(c, LineCollection)]
    ends = [segment[:, 0].tolist() for some in drawn for segment in some.get_segments()]
    left, right = axes.get_xlim()
    assert ends == [[left, right], [1.0, 2.0], [left, 1.5]]
    assert left < 1
    assert right > 2
    assert [line.get_xdata()[0] for line in axes.lines] == [2.0, 1.5, 1.0]


def test_what_is_refused():
    with pytest.raises(TypeError, match="nerve: expected a Nerve"):
        draw_barcode(1)

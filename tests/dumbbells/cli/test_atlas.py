"""The command ``polycorner atlas dyad``: the library's answer, which its points confirm."""

import math

import numpy as np
import pytest
from atlas_commands import answer, fits_together, same_atlas
from atlases import kept_atlas
from oracles import CONTACTS, gaps

from polycorner.dumbbells import DumbbellPair

ANSWER = {"components", "corners", "edges", "faces", "euler_characteristic", "complete"}
CORNER = {"name", "kind", "active", "rank", "dimension", "local_type", "chirality"}


pytestmark = pytest.mark.usefixtures("own_searches")


PAIRS = {
    ("--plane",): (DumbbellPair(16, 3, 1.5), 0.0),
    ("--heading", "20", "--drum", "60", "--length", "20"): (DumbbellPair(20, 3, 1.5, 60), 20.0),
}


@pytest.mark.parametrize("arguments", PAIRS, ids=" ".join)
def test_pair_is_the_librarys(arguments):
    pair, heading = PAIRS[arguments]
    found = answer("dyad", *arguments)
    atlas = kept_atlas(pair, math.radians(heading))
    assert set(found) >= ANSWER
    same_atlas(found, atlas.skeleton)
    assert [c["kind"] for c in found["corners"]] == list(map(atlas.kind, atlas.skeleton.corners))
    assert found["euler_characteristic"] == atlas.skeleton.euler_characteristic
    for key, counts in (
        ("components", atlas.components),
        ("components_ordered", atlas.components_ordered),
        ("components_unordered", atlas.components_unordered),
    ):
        assert found[key] == {str(dimension): n for dimension, n in counts.items()}
        assert list(found[key]) == ["3", "4", "5", "6"]
    assert found["parameters"]["heading_deg"] == heading
    assert found["parameters"]["length"] == pair.length


@pytest.mark.parametrize("arguments", PAIRS, ids=" ".join)
def test_pair_follows_from_its_own_points(arguments):
    """Gaps by minimisation and their differences say what is active, of which rank."""
    pair, heading = PAIRS[arguments]
    found = answer("dyad", *arguments)
    scales = np.array(pair.manifold.scales)
    for corner in found["corners"]:
        assert set(corner) >= CORNER
        q = np.array(corner["point"])
        apart = dict(zip(CONTACTS, gaps(pair, q), strict=True))
        assert {name for name, gap in apart.items() if gap < 1e-6} == set(corner["active"])
        assert min(apart.values()) > -1e-6
        steps = 1e-6 * np.diag(scales)
        slopes = (gaps(pair, q + steps) - gaps(pair, q - steps)) / 2e-6
        rows = [CONTACTS.index(name) for name in corner["active"]]
        assert np.linalg.matrix_rank(slopes[:, rows], tol=1e-3) == corner["rank"] == 3
        assert corner["dimension"] == 6 - corner["rank"]
        assert corner["chirality"] in ("R", "L")
        assert corner["kind"].endswith(corner["chirality"])
        if not pair.is_plane:
            mean = (q[2] + q[5]) / 2 - math.radians(heading)
            assert math.sin(mean) == pytest.approx(0, abs=1e-9)
    fits_together(found)

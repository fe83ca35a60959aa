"""Maps of minima against sampled lists and closed forms."""

from collections import Counter
from itertools import product

import numpy as np
import pytest
from crossings import crossing_clearance

from polycorner import minimise
from polycorner.branches import BranchKind
from polycorner.dumbbells import DumbbellPair, long_rod_length, minima_map, pair_minima
from polycorner.dumbbells.statics.minima import kind_of

NESTED = {"curvatures": [0.5, 1.95], "rods": (0.3, 0.95), "lengths": (2.3, 5.0), "starts": 60}
CROSSED = {"curvatures": [1.0], "rods": (0.35, 0.6), "lengths": (5.0, 8.0), "starts": 60}


@pytest.fixture(scope="module")
def nested():
    return minima_map(**NESTED)


@pytest.fixture(scope="module")
def crossed():
    return minima_map(**CROSSED)


def sampled(sheet, rod, length):
    """Return the numbers of minima by kind, from starts anywhere and the minima of all regions."""
    pair = DumbbellPair(length, 1.0, rod, length / sheet.curvature)
    found = [*pair_minima(pair, starts=150, rng=3, mirror=True)]
    for region in sheet.regions:
        found += [minimise(pair.polyhedron, pair.energy, one.point) for one in region.minima]
    energies = {(kind_of(one), round(one.energy, 6)) for one in found if one.is_minimum}
    return Counter(kind for kind, _ in energies)


def test_regions_have_the_minima_that_are_sampled_in_them(nested, crossed):
    """At places of a coarse grid that are not near a border."""
    for found in (nested, crossed):
        sheet = found.sheets[0]
        for place in product(np.linspace(*found.rods, 4)[1:3], np.linspace(*found.lengths, 4)[1:3]):
            if all(
                (abs(np.log(border.parameters / np.array(place))).max(axis=1) > 0.02).all()
                for border in sheet.borders
            ):
                rod, length = map(float, place)
                assert sheet.region(rod, length).kinds == sampled(sheet, rod, length)


def test_minima_change_where_a_border_is_crossed(nested, crossed):
    for found in (nested, crossed):
        sheet = found.sheets[0]
        assert sheet.borders
        for border in sheet.borders:
            k = len(border.parameters) // 2
            one, two = border.parameters[k : k + 2]
            way = np.log(two / one)
            aside = 0.01 * np.array([-way[1], way[0]]) / np.linalg.norm(way)
            places = [(one * np.exp(side * aside)).tolist() for side in (1, -1)]
            kinds = [sheet.region(*place).kinds for place in places]
            assert kinds[0] != kinds[1]
            assert kinds == [sampled(sheet, *place) for place in places]


def test_nested_kinds_change_on_their_closed_forms(nested):
    """A ball reaches a rod at a length, and the corner ends at ``1 + t = 2 sqrt(1 - 1/l^2)``."""
    borders = {border.kind: border.parameters for border in nested.sheets[0].borders}
    assert borders.keys() == {BranchKind.EXCHANGE, BranchKind.CORNER_LIMIT}
    rods, lengths = borders[BranchKind.EXCHANGE].T
    np.testing.assert_allclose(lengths, [long_rod_length(1.0, t) for t in rods], rtol=1e-3)
    rods, lengths = borders[BranchKind.CORNER_LIMIT].T
    np.testing.assert_allclose(1 + rods, 2 * np.sqrt(1 - 1 / lengths**2), rtol=1e-3)
    assert nested.kinds == ("G", "delta", "staggered")


def test_a_level_crossing_ends_where_it_has_no_room(crossed):
    (sheet,) = crossed.sheets
    (border,) = sheet.borders
    assert border.kind is BranchKind.VANISHES
    for rod, length in border.parameters.tolist():
        assert crossing_clearance(DumbbellPair(length, 1.0, rod, length)) == pytest.approx(
            0, abs=1e-3
        )
    assert {"crossed" in region.kinds for region in sheet.regions} == {True, False}


def test_examples_are_minima_of_their_kind(nested, crossed):
    for found in (nested, crossed):
        assert set(found.examples) == set(found.kinds)
        for kind, (pair, certificate) in found.examples.items():
            assert kind_of(certificate) == kind
            assert certificate.holds()
            assert pair.ball_radius == 1


def test_nothing_is_known_outside_and_where_nothing_fits(nested):
    some, none = nested.sheets
    assert some.region(0.2, 3.0) is None
    assert none.within is None
    assert none.region(0.5, 3.0) is None
    assert not none.regions
    assert nested.has("staggered").tolist() == [True, False]


def test_an_interruption_leaves_finished_sheets():
    def stop(done, _total, _note):
        if done == 1:
            raise KeyboardInterrupt

    found = minima_map(**NESTED | {"curvatures": [0.5]}, progress=stop)
    assert not found.sheets
    assert not found.kinds

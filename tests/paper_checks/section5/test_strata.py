"""Section 5: verdicts, wrong statements, and corners and contacts by independent methods."""

import itertools
import math

import numpy as np
import pytest

from paper_checks.framework.claims import Verdict
from paper_checks.section5 import counts as strata_counts
from paper_checks.section5 import dimensions as strata_dimensions
from paper_checks.section5 import local as strata_local
from paper_checks.section5 import motions as strata_motions
from paper_checks.section5 import pairs
from paper_checks.section5 import whole as strata_whole
from polycorner.dumbbells import DumbbellPair, long_rod_length

PLANE, DRUM = pairs.PLANE, pairs.DRUM
LENGTH, BALL, ROD = PLANE.length, PLANE.ball_radius, PLANE.rod_radius


# ------------------------------------------------------------------------- corners in closed form


def closed_form_corners():
    """Return, by contacts and hand, every parallel placement with a corner's shifts.

    A lies along the second axis; B is beside it at the distance ``r + t`` and shifted along it by
    ``l - s`` (one ball in the other's waist) or ``s`` (two balls on two balls), and either of them
    may be turned round.
    """
    p = BALL + ROD
    s = math.sqrt(4 * BALL**2 - p**2)
    found = {}
    shifts = ((LENGTH - s, "Delta"), (s, "E"))
    for (shift, letter), side, way, turn in itertools.product(
        shifts, (1, -1), (1, -1), (0, math.pi)
    ):
        q = np.array([0, 0, 0, side * p, way * shift, turn])
        gaps = dict(zip(PLANE.polyhedron.names, PLANE.polyhedron.values(q), strict=True))
        assert min(gaps.values()) > -1e-12
        touching = frozenset(name for name, gap in gaps.items() if abs(gap) < 1e-12)
        found[touching, "R" if side * way < 0 else "L"] = letter
    return found


def test_the_corners_are_those_of_the_closed_form():
    atlas = pairs.atlas(PLANE)
    expected = closed_form_corners()
    found = {
        (frozenset(corner.active), corner.chirality): atlas.kind(corner).split("_")[0]
        for corner in atlas.skeleton.corners
    }
    assert found == expected
    assert len(expected) == len(atlas.skeleton.corners)


def test_gradients_in_the_plane_are_those_of_the_model():
    """At every kind of place: differences of the model's gaps, up to sign and scale."""
    p = BALL + ROD
    s = math.sqrt(4 * BALL**2 - p**2)
    numbers = {"l": LENGTH, "r": BALL, "p": p, "s": s, "h": 7.0, "c": 0.9, "d": 0.2}
    side, rise = 2 * BALL * 0.9, 2 * BALL * math.sqrt(1 - 0.9**2)
    places = {
        ("A2b", "aB1"): (p, LENGTH - 7.0, 0.0),
        ("A2B1", "aB1"): (p, LENGTH - s, 0.2),
        ("A1B1", "A2B2"): (side, rise, 0.0),
        pairs.DELTA: (p, LENGTH - s, 0.0),
        pairs.E_CORNER: (p, s, 0.0),
    }
    for names, rows in strata_dimensions.plane_gradients().items():
        if len(names) == 1:
            continue

        def gaps(place, names=names):
            x, y, d = place
            half = LENGTH / 2
            q = np.array([0, half, 0, x + half * math.sin(d), y + half * math.cos(d), d])
            values = PLANE.polyhedron.values(q)
            return values[[PLANE.polyhedron.names.index(name) for name in names]]

        place = np.array(places[names])
        assert gaps(place) == pytest.approx(0, abs=1e-12)
        steps = 1e-6 * np.eye(3)
        slopes = np.array([(gaps(place + e) - gaps(place - e)) / 2e-6 for e in steps]).T
        exact = np.array(
            rows.subs({symbol: numbers[symbol.name] for symbol in rows.free_symbols}), dtype=float
        )
        for row, slope in zip(exact, slopes, strict=True):
            unit, other = row / np.linalg.norm(row), slope / np.linalg.norm(slope)
            assert abs(unit @ other) == pytest.approx(1, abs=1e-8)


# ------------------------------------------------------------------------------- helpers by oracles


def test_distances_to_a_line_by_search_along_it():
    rng = np.random.default_rng(2)
    for q in DRUM.placements(rng, 10):
        centres = DRUM.ball_centres(q)
        along = np.linspace(-40, 40, 400001)[:, None]
        for k, name in enumerate(("A1", "A2")):
            line = centres[2] + along * (centres[3] - centres[2]) / LENGTH
            least = np.linalg.norm(line - centres[k], axis=1).min()
            assert pairs.between(DRUM, q, name, "b") == pytest.approx(least, abs=1e-6)
            assert pairs.between(DRUM, q, "b", name) == pytest.approx(least, abs=1e-6)


def test_first_contacts_touch_once():
    for name, q in pairs.first_contacts():
        gaps = dict(zip(DRUM.polyhedron.names, DRUM.polyhedron.values(q), strict=True))
        assert abs(gaps.pop(name)) < 1e-12
        assert min(gaps.values()) > BALL / 4


def test_kinds_by_all_permutations():
    """Two sets of contacts are of one kind if a permutation of balls carries one to the other."""
    letters = ("A1", "A2", "B1", "B2")
    images = [
        dict(zip(letters, image, strict=True))
        for image in itertools.permutations(letters)
        if image[0][0] == image[1][0]
    ]
    rng = np.random.default_rng(4)
    strata_of_two = [frozenset(c) for c in itertools.combinations(pairs.CONTACTS, 2)]
    classes = pairs.kinds(strata_of_two)
    for one, other in itertools.combinations(strata_of_two, 2):
        if rng.random() < 0.3:
            alike = any(pairs.renamed(one, image) == other for image in images)
            assert alike == any({one, other} <= orbit for orbit in classes)


def test_crossing_by_solving_for_the_common_point():
    rng = np.random.default_rng(6)
    q = np.zeros((500, 6))
    q[:, 3:5] = rng.uniform(-12, 12, (500, 2))
    q[:, [2, 5]] = rng.uniform(-math.pi, math.pi, (500, 2))
    for point, told in zip(q, strata_whole.crossed(PLANE, q), strict=True):
        a1, a2, b1, b2 = PLANE.ball_centres(point)[:, :2]
        s, t = np.linalg.solve(np.column_stack([a2 - a1, b1 - b2]), b1 - a1)
        assert told == (0 < s < 1 and 0 < t < 1)


@pytest.mark.parametrize("rod", [0.1, 0.3, 0.6, 0.9])
def test_length_at_which_a_ball_touches_both_by_geometry(rod):
    assert strata_whole.touching_both_ends(rod) == pytest.approx(
        max(2.0, long_rod_length(1.0, rod)), abs=1e-8
    )


def test_a_turned_corner_of_the_plane_is_the_rotated_pair():
    corner = pairs.atlas(PLANE).skeleton.corners[0]
    middle = (corner.point[:2] + corner.point[3:5]) / 2
    turned = strata_motions.carried(PLANE, corner.point, corner.active, 90)
    start, end = (PLANE.ball_centres(q)[:, :2] for q in (corner.point, turned))
    quarter = np.array([[0.0, 1.0], [-1.0, 0.0]])
    assert end - middle == pytest.approx((start - middle) @ quarter.T, abs=1e-8)


# ------------------------------------------------------------------------------- wrong statements


@pytest.mark.parametrize(
    ("check", "statement", "verdict"),
    [
        (strata_local.ball_on_rod, ((2.0, 0.0),), Verdict.REFUTED),
        (strata_local.two_rods_touch, (("aB1", "A2B1"),), Verdict.REFUTED),
        (strata_local.delta_is, (pairs.E_CORNER,), Verdict.REFUTED),
        (strata_local.e_is, (pairs.E_CORNER[:3], 0), Verdict.REFUTED),
        (strata_local.e_is, (pairs.E_CORNER, 2), Verdict.REFUTED),
        (strata_dimensions.dimensions_are, ((6, 5, 3, 3),), Verdict.REFUTED),
        (strata_dimensions.lowest_dimension_is, (4,), Verdict.REFUTED),
        (strata_counts.kinds_are, ((2, 5, 4),), Verdict.HOLDS),
        (strata_counts.kinds_are, ((2, 3, 4),), Verdict.CORRECTED),
        (strata_counts.corners_fall_into, (("Delta_L", "Delta_R"),), Verdict.REFUTED),
        (strata_counts.components_are, (3, 4), Verdict.HOLDS),
        (strata_counts.components_are, (3, 2), Verdict.CORRECTED),
        (strata_counts.half_motions_are, ((4, 4),), Verdict.REFUTED),
        (strata_counts.mirror_stays_in_component, ("turn",), Verdict.REFUTED),
        (strata_motions.copies_of_m, (90,), Verdict.CORRECTED),
        (strata_motions.free_motions_are, (2,), Verdict.REFUTED),
        (strata_whole.inequalities_suffice, (pairs.CONTACTS[:-1],), Verdict.REFUTED),
    ],
)
def test_other_statements(check, statement, verdict):
    assert check(*statement).verdict is verdict


def test_an_atlas_without_a_corner_is_noticed(monkeypatch):
    pair = DumbbellPair(7, 3, 1.5)
    short = pairs.atlas(pair)
    monkeypatch.setattr(strata_counts, "atlas", lambda *_: short)
    assert strata_counts.corners_fall_into(pairs=(pair,)).verdict is Verdict.REFUTED
    assert strata_counts.kinds_are((2, 3, 2)).verdict is Verdict.CORRECTED

"""The atlas of the pair against its definition, independent counts, and the drum as a whole."""

import itertools
import math
from collections import Counter

import numpy as np
import oracles
import pytest
from atlases import kept_atlas

from polycorner import skeleton
from polycorner.dumbbells import DumbbellPair
from polycorner.dumbbells.statics.skeleton import PairAtlas, long_rod_length, pair_atlas

BALLS = ("A1", "A2", "B1", "B2")
CONTACTS = oracles.CONTACTS
LONG = DumbbellPair(16, 3, 1.5)
SHORT = DumbbellPair(7, 3, 1.5)
DRUM = DumbbellPair(16, 3, 1.5, 125)
HEADING = 0.3


@pytest.fixture(scope="module")
def long():
    return kept_atlas(LONG)


@pytest.fixture(scope="module")
def short():
    return kept_atlas(SHORT)


@pytest.fixture(scope="module")
def section():
    return kept_atlas(DRUM, HEADING)


@pytest.fixture(params=["long", "short", "section"])
def atlas(request):
    return request.getfixturevalue(request.param)


# ------------------------------------------------------------------------- the definition, slowly


def centres(pair, q):
    """Return A1, A2, B1, B2 in space: on the cylinder of radius ``R - r``, or in the plane."""
    return list(oracles.balls(pair, q))


def gaps(pair, q, names=CONTACTS):
    """Return gaps by name: distance of the two bodies' axes or centres less their radii."""
    found = dict(zip(CONTACTS, oracles.gaps(pair, q), strict=True))
    return {name: found[name] for name in names}


def slopes(pair, q, names):
    """Return finite differences of gaps, in units of the manifold's scales."""
    rows = []
    for k, scale in enumerate(pair.manifold.scale_array):
        step = 1e-5 * scale * np.eye(6)[k]
        ahead, behind = gaps(pair, q + step, names), gaps(pair, q - step, names)
        rows.append([(ahead[name] - behind[name]) / 2e-5 for name in names])
    return np.array(rows).T


def hand(pair, q):
    """Return the chirality from the definition, in the plane ``(R phi, eta)``."""
    if math.isinf(pair.drum_radius):
        at = [c[:2] for c in centres(pair, q)]
    else:
        rho = pair.drum_radius - pair.ball_radius
        first = math.atan2(*centres(pair, q)[0][[0, 2]] * np.array([1, -1]))
        at = [
            np.array([rho * math.remainder(math.atan2(c[0], -c[2]) - first, math.tau), c[1]])
            for c in centres(pair, q)
        ]
    i, j = max(
        itertools.product((0, 1), (2, 3)), key=lambda ij: np.linalg.norm(at[ij[1]] - at[ij[0]])
    )
    outer, inner = at[j] - at[i], at[5 - j] - at[1 - i]
    return "R" if outer[0] * inner[1] > outer[1] * inner[0] else "L"


class TestCornersByDefinition:
    def test_active_contacts_touch_and_all_others_are_apart(self, atlas):
        for corner in atlas.skeleton.corners:
            found = gaps(atlas.pair, corner.point)
            touching = {name for name, gap in found.items() if abs(gap) < 1e-9 * atlas.pair.length}
            assert touching == set(corner.active)
            assert min(found.values()) > -1e-9 * atlas.pair.length
            assert min(found[name] for name in CONTACTS if name not in touching) > 1e-2

    def test_contacts_and_motions_of_the_whole_pair_fix_the_corner(self, atlas):
        """Active gradients, the mean heading and the symmetry span all six directions."""
        for corner in atlas.skeleton.corners:
            rows = slopes(atlas.pair, corner.point, corner.active)
            if atlas.heading is not None:
                mean = np.array([0, 0, 1, 0, 0, 1.0]) * atlas.pair.manifold.scale_array
                rows = np.vstack([rows, mean])
            size = np.linalg.svd(rows / np.linalg.norm(rows, axis=1)[:, None], compute_uv=False)
            rank = int((size > 1e-6 * size[0]).sum())
            assert rank == corner.rank == 6 - (3 if atlas.pair.is_plane else 2)
            assert not corner.singular

    def test_corners_are_different_placements(self, atlas):
        points = [atlas.pair.symmetry.invariants(c.point) for c in atlas.skeleton.corners]
        for p, q in itertools.combinations(points, 2):
            assert abs(p - q).max() > 1e-2

    def test_chirality_is_that_of_the_definition(self, atlas):
        for corner in atlas.skeleton.corners:
            assert corner.chirality == hand(atlas.pair, corner.point)
            assert atlas.kind(corner).endswith(f"_{corner.chirality}")

    def test_kinds_count_contacts(self, atlas):
        letters = {"Delta": (1, 2), "E": (2, 2), "C300": (3, 0)}
        for corner in atlas.skeleton.corners:
            numbers = tuple(sum(len(name) == n for name in corner.active) for n in (4, 3))
            assert letters[atlas.kind(corner).split("_")[0]] == numbers

    def test_the_section_is_at_its_heading(self, section):
        for corner in section.skeleton.corners:
            mean = (corner.point[2] + corner.point[5]) / 2
            assert math.sin(mean - HEADING) == pytest.approx(0, abs=1e-9)


class TestEdgesByDefinition:
    def test_contacts_stay_closed_and_nothing_overlaps(self, atlas):
        for edge in atlas.skeleton.edges:
            for q in edge.polyline[1:-1]:
                found = gaps(atlas.pair, q)
                assert max(abs(found[name]) for name in edge.active) < 1e-8 * atlas.pair.length
                assert min(found.values()) > -1e-8 * atlas.pair.length
            others = [n for n in CONTACTS if n not in edge.active]
            inside = [min(gaps(atlas.pair, q, others).values()) for q in edge.polyline[2:-2]]
            assert min(inside) > 1e-6

    def test_they_end_in_corners_where_one_more_contact_closes(self, atlas):
        corners = atlas.skeleton.corners
        for edge in atlas.skeleton.edges:
            for end, q in zip(edge.ends, edge.polyline[[0, -1]], strict=True):
                assert set(edge.active) < set(corners[end].active)
                apart = atlas.pair.symmetry.separation(atlas.pair.manifold, q, corners[end].point)
                halves = [
                    atlas.pair.symmetry.separation(
                        atlas.pair.manifold, g.apply(q), corners[end].point
                    )
                    for g in atlas.pair.symmetry.elements
                ]
                assert min([apart, *halves]) < 1e-6

    def test_as_many_edges_leave_a_corner_as_its_cone_has_rays(self, atlas):
        """A cone in three dimensions with facets in general position has as many rays as facets."""
        ends = Counter(k for edge in atlas.skeleton.edges for k in edge.ends)
        for k, corner in enumerate(atlas.skeleton.corners):
            assert ends[k] == len(corner.edges) == len(corner.active)


class TestTopology:
    def test_the_boundary_has_euler_characteristic_zero(self, atlas):
        found = atlas.skeleton
        corners, edges, faces = len(found.corners), len(found.edges), len(found.faces)
        assert all(face.closed and len(face.boundary) == 1 for face in found.faces)
        assert corners - edges + faces == found.euler_characteristic == 0

    @pytest.mark.parametrize("heading", [math.pi / 4, 2.0])
    def test_on_other_sections_too(self, heading):
        found = pair_atlas(DumbbellPair(16, 3, 1.5, 40), heading=heading)
        assert found.skeleton.euler_characteristic == 0
        assert found.components == {3: 16, 4: 28, 5: 12, 6: 1}

    @pytest.mark.parametrize("pair", [LONG, SHORT], ids=["long", "short"])
    def test_the_boundary_is_a_torus_slice_by_slice(self, pair):
        """For every angle between the axes the forbidden places of B are a disc.

        Its boundary is one closed curve; over the circle of angles these make a torus.
        """
        from scipy.ndimage import label

        side = np.linspace(-1, 1, 161) * (pair.length + 3 * pair.ball_radius)
        x, y = np.meshgrid(side, side)
        for turn in np.linspace(0, math.pi, 13):
            q = np.zeros((*x.shape, 6))
            q[..., 3], q[..., 4], q[..., 5] = x, y, turn
            free = pair.polyhedron.contains(q)
            assert label(free, np.ones((3, 3)))[1] == label(~free, np.ones((3, 3)))[1] == 1
            assert all(side.all() for side in (free[0], free[-1], free[:, 0], free[:, -1]))

    def test_every_edge_lies_between_two_faces_that_share_its_contacts(self, atlas):
        for k, edge in enumerate(atlas.skeleton.edges):
            beside = [f for f in atlas.skeleton.faces if any(k in curve for curve in f.boundary)]
            assert len(beside) == 2
            assert set(edge.active) == set(beside[0].active) | set(beside[1].active)


# ----------------------------------------------------------------------------- independent counts

# Images of A1, A2, B1, B2 when balls, or balls and dumbbells, lose their labels.
WITHIN = [p + q for p in ((0, 1), (1, 0)) for q in ((2, 3), (3, 2))]
ALL = [*WITHIN, *(p[2:] + p[:2] for p in WITHIN)]


def same_up_to_motion(p, q):
    """Whether a rotation and a translation carry four points of the plane to four others."""
    p, q = (c - c.mean(axis=0) for c in (p, q))
    turn = np.angle(np.sum(np.conj(p @ [1, 1j]) * (q @ [1, 1j])))
    return abs(np.exp(1j * turn) * (p @ [1, 1j]) - q @ [1, 1j]).max() < 1e-6


def renamed(name, permutation):
    """Return a contact after its balls were permuted; a rod goes with its balls."""
    image = {BALLS[i]: BALLS[k] for i, k in enumerate(permutation)}
    image |= {"a": image["A1"][0].lower(), "b": image["B1"][0].lower()}
    return oracles.renamed(name, image)


class Classes:
    """Corners and edges of an atlas in the plane up to permutations, by matching ball centres."""

    def __init__(self, atlas, permutations):
        self.permutations = permutations
        self.found = atlas.skeleton
        self.places = [np.array(centres(atlas.pair, c.point))[:, :2] for c in self.found.corners]
        self.keys = [self.key(e.active, e.ends) for e in self.found.edges]

    @staticmethod
    def key(active, ends):
        return frozenset(active), tuple(sorted(ends))

    def image(self, k, permutation):
        """Return the one corner at which ball ``permutation[i]`` is where ball ``i`` was."""
        moved = np.empty((4, 2))
        moved[list(permutation)] = self.places[k]
        (found,) = (j for j, place in enumerate(self.places) if same_up_to_motion(moved, place))
        return found

    def corners(self):
        return {
            frozenset(self.image(k, p) for p in self.permutations) for k in range(len(self.places))
        }

    def edges(self):
        return {
            frozenset(
                self.key(
                    [renamed(name, p) for name in edge.active],
                    [self.image(k, p) for k in edge.ends],
                )
                for p in self.permutations
            )
            for edge in self.found.edges
        }

    def faces(self):
        of = {frozenset(self.keys[e] for e in face.boundary[0]): face for face in self.found.faces}
        assert len(of) == len(self.found.faces)

        def moved(boundary, p):
            return frozenset(
                self.key([renamed(n, p) for n in active], [self.image(k, p) for k in ends])
                for active, ends in boundary
            )

        assert all(moved(boundary, p) in of for boundary in of for p in self.permutations)
        return {frozenset(moved(boundary, p) for p in self.permutations) for boundary in of}


class TestCounts:
    @pytest.mark.parametrize(
        ("name", "labelled", "ordered", "unordered"),
        [
            ("long", (16, 28, 12), (4, 7, 3), (4, 5, 2)),
            ("short", (8, 12, 4), (2, 3, 1), (2, 2, 1)),
        ],
    )
    def test_up_to_relabelling(self, request, name, labelled, ordered, unordered):
        """Three counts of one atlas: nothing, the balls, or also the dumbbells unlabelled."""
        atlas = request.getfixturevalue(name)
        by_hand = {
            which: Classes(atlas, group) for which, group in (("balls", WITHIN), ("all", ALL))
        }
        counts = {
            which: (len(c.corners()), len(c.edges()), len(c.faces()))
            for which, c in by_hand.items()
        }
        found = atlas.skeleton
        assert (len(found.corners), len(found.edges), len(found.faces)) == labelled
        assert len(set(by_hand["all"].keys)) == labelled[1]
        assert counts == {"balls": ordered, "all": unordered}
        assert atlas.components == dict(zip((3, 4, 5, 6), (*labelled, 1), strict=True))
        assert atlas.components_ordered == dict(zip((3, 4, 5, 6), (*ordered, 1), strict=True))
        assert atlas.components_unordered == dict(zip((3, 4, 5, 6), (*unordered, 1), strict=True))

    def test_the_orbits_are_those_of_matching(self, long):
        by_hand = Classes(long, ALL)
        assert {frozenset(group) for group in long.unordered["corners"]} == by_hand.corners()
        edges = {frozenset(by_hand.keys[k] for k in group) for group in long.unordered["edges"]}
        assert edges == by_hand.edges()
        kinds = [long.kind(long.skeleton.corners[g[0]]) for g in long.unordered["corners"]]
        assert sorted(kinds) == ["Delta_L", "Delta_R", "E_L", "E_R"]

    def test_the_section_of_a_wide_drum_has_the_counts_of_the_plane(self, long, section):
        assert section.components == long.components
        assert section.components_unordered == long.components_unordered
        kinds = [Counter(a.kind(c) for c in a.skeleton.corners) for a in (long, section)]
        assert kinds[0] == kinds[1] == dict.fromkeys(("Delta_L", "Delta_R", "E_L", "E_R"), 4)

    def test_rods_that_are_too_short_are_never_touched(self, short):
        assert SHORT.length < long_rod_length(SHORT.ball_radius, SHORT.rod_radius)
        names = {name for c in short.skeleton.corners for name in c.active}
        assert names == {"A1B1", "A1B2", "A2B1", "A2B2"}
        for edge in short.skeleton.edges:
            near = [gaps(SHORT, q, CONTACTS[4:]) for q in edge.polyline]
            assert min(min(found.values()) for found in near) > 0.05


class TestMirror:
    @pytest.mark.parametrize("atlas", ["long", "short"], indirect=True)
    def test_the_mirror_image_of_the_atlas_is_the_atlas_with_hands_exchanged(self, atlas):
        found = atlas.skeleton
        places = [np.array(centres(atlas.pair, c.point))[:, :2] for c in found.corners]
        images = []
        for k, place in enumerate(places):
            mirrored = place * np.array([-1, 1])
            (image,) = (j for j, p in enumerate(places) if same_up_to_motion(mirrored, p))
            assert set(found.corners[image].active) == set(found.corners[k].active)
            assert {found.corners[image].chirality, found.corners[k].chirality} == {"R", "L"}
            images.append(image)
        assert sorted(images) == list(range(len(places)))
        keys = {Classes.key(e.active, e.ends): e for e in found.edges}
        for (active, ends), edge in keys.items():
            image = keys[Classes.key(active, [images[k] for k in ends])]
            assert image.length == pytest.approx(edge.length, rel=1e-2)


# ------------------------------------------------------------------------------ the drum as a whole


@pytest.fixture(scope="module")
def strata(section):
    """The three-contact strata of the drum: closed curves over the mean heading."""
    starts = [corner.point for corner in section.skeleton.corners]
    return skeleton(DRUM.polyhedron, starts, symmetry=DRUM.symmetry)


class TestStrataOfTheDrum:
    """Modulo rolling and shifting four dimensions are left, and no corner."""

    def test_every_corner_of_a_section_lies_on_a_closed_curve_of_its_own(self, section, strata):
        assert not strata.corners
        assert all(edge.is_closed for edge in strata.edges)
        on_section = Counter((c.active, c.chirality) for c in section.skeleton.corners)
        curves = Counter((e.active, hand(DRUM, e.polyline[0])) for e in strata.edges)
        assert curves == on_section
        assert len(strata.edges) == section.components[3] == 16

    def test_contacts_stay_closed_and_hands_the_same_along_a_curve(self, strata):
        for edge in strata.edges:
            for q in edge.polyline[::3]:
                found = gaps(DRUM, q)
                assert max(abs(found[name]) for name in edge.active) < 1e-8 * DRUM.length
                assert min(found.values()) > -1e-8 * DRUM.length
                assert hand(DRUM, q) == hand(DRUM, edge.polyline[0])

    def test_every_curve_meets_the_section_in_one_corner(self, section, strata):
        """Each curve goes around all mean headings, and meets the section in its corner only."""
        corners = section.skeleton.corners
        met = []
        for edge in strata.edges:
            mean = edge.polyline[:, [2, 5]].mean(axis=1) - HEADING
            assert abs(np.ptp(mean)) > math.pi - 1e-6
            steps = np.flatnonzero(np.diff(np.floor(mean / math.pi)))
            met.append({self.nearest(corners, edge, mean, k) for k in steps})
        assert all(len(found) == 1 for found in met)
        assert set().union(*met) == set(range(len(corners)))

    @staticmethod
    def nearest(corners, edge, mean, k):
        """Return the corner nearest to where a step of the curve crosses the section."""
        level = math.pi * max(math.floor(mean[k] / math.pi), math.floor(mean[k + 1] / math.pi))
        s = (level - mean[k]) / (mean[k + 1] - mean[k])
        q = edge.polyline[k] + s * (edge.polyline[k + 1] - edge.polyline[k])
        images = [q, *(g.apply(q) for g in DRUM.symmetry.elements)]
        apart = [
            min(DRUM.symmetry.separation(DRUM.manifold, p, c.point) for p in images)
            for c in corners
        ]
        best, second = sorted(apart)[:2]
        assert best < 0.1 < second
        return apart.index(best)


def test_the_atlas_is_that_of_its_pair(long):
    assert isinstance(long, PairAtlas)
    assert long.pair == LONG
    assert long.heading is None


def test_other_starts_give_the_same_counts_and_progress_is_told(short):
    told = []
    again = pair_atlas(SHORT, rng=5, progress=lambda *state: told.append(state))
    assert again.components == short.components
    assert told[-1] == (12, 12, "8 corners")
    assert all(later[0] >= state[0] for state, later in itertools.pairwise(told))

"""Every example runs and gives the number it is there for; so does the README."""

import math
import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize

from examples import (
    ex01_heading,
    ex02_own_polyhedron,
    ex03_ridge,
    ex04_tutorial,
    ex05_solid,
    ex06_disks,
    ex07_pinball,
    ex08_rods,
    ex09_spheres,
    ex10_critical_rod,
    ex11_keel,
    ex12_bouncing_ball,
    ex13_rolling,
    ex14_impact_and_stack,
    ex15_entrapment,
    ex16_dyad_climbs,
    ex17_turning,
    ex18_packing,
    ex19_all_equilibria,
    ex20_rigid_clusters,
    ex21_docking,
    ex22_sliding_squares,
    ex23_gripper,
    ex24_tippe_top,
    ex25_rods_jam,
    ex26_drum_in_space,
    ex27_hard_squares,
    ex28_heap_in_drum,
    ex29_cages,
    ex30_clusters_of_atoms,
    ex31_landscape,
    ex32_silo,
    ex33_snap_through,
    ex34_two_link_arm,
    ex35_slider_crank,
    ex36_nested_corner,
    ex37_sticky_clusters,
    ex38_pinball_pockets,
    ex39_paper_heading,
)
from polycorner import Verdict, minimise, stratum_at
from polycorner.dumbbells import DumbbellPair
from polycorner.minimisation import Mobility
from polycorner.models.disks.disks import TorusDisks
from polycorner.polyhedra import LocalType
from tests.support.divisions import divisions
from tests.support.hulls import distance

ROOT = Path(__file__).parents[1]


def test_every_example_has_a_test():
    files = {path.stem for path in (ROOT / "examples").glob("ex*.py")}
    assert files == {name for name in globals() if name.startswith("ex")}


def test_heading():
    result = ex01_heading.main()
    assert result.right == pytest.approx(-result.left, abs=1e-9)
    assert result.paper == pytest.approx(math.degrees(math.atan(3 / 16)))
    assert abs(result.right - result.plane) < 1e-3 < abs(result.right - result.paper)
    assert 1.9 < result.order < 2.1


def test_heading_figure(tmp_path):
    ex01_heading.draw(tmp_path / "heading.png")
    assert (tmp_path / "heading.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(("length", "hand", "sign"), [(16.0, "L", -1), (10.0, "R", 1)])
def test_the_papers_heading_follows_from_two_assumptions(length, hand, sign):
    """Against the closed forms of the plane, with p across and D along; see docs/heading.md."""
    row = ex39_paper_heading.row(length, hand)
    p, shift = 4.5, length - math.sqrt(36 - 4.5**2)
    expected = {
        "neither": math.atan2(2 * shift * p, shift**2 + length**2 - p**2) / 2,
        "across": math.atan2(2 * length * 6, 2 * length**2 - 36) / 2,
        "outer": math.atan(p / (shift + length)),
        "both": math.atan(3 / length),
    }
    assert {k: math.radians(x) for k, x in row.cases.items()} == pytest.approx(
        {k: sign * x for k, x in expected.items()}, abs=1e-10
    )
    assert row.formula == pytest.approx(row.cases["both"], abs=1e-9)
    assert row.single == pytest.approx(sign * math.degrees(math.asin(3 / length)))
    assert row.drum == pytest.approx(row.cases["neither"], abs=2e-3)
    assert [name for name, good in row.held.items() if good] == ["neither"]


def test_the_papers_heading_is_drawn(tmp_path):
    rows = [ex39_paper_heading.row(16.0, "R"), ex39_paper_heading.row(16.0, "L")]
    ex39_paper_heading.draw(rows, tmp_path / "paper.png")
    assert (tmp_path / "paper.png").read_bytes().startswith(b"\x89PNG")


def test_own_polyhedron():
    certificate = ex02_own_polyhedron.main()
    golden = ex02_own_polyhedron.GOLDEN
    np.testing.assert_allclose(certificate.point, [golden, golden**2], atol=1e-12)
    assert certificate.signature == (2, 0, 0)


def test_ridge():
    rest, corner = ex03_ridge.main()
    np.testing.assert_allclose(rest.point, [0.0, -2.0], atol=1e-12)
    assert rest.is_minimum
    assert not corner.is_minimum


def test_tutorial():
    result = ex04_tutorial.main()
    assert "".join(result.corners) == "ABCDEFG"
    assert result.atlas.euler_characteristic == 1
    assert all(c.local_type is LocalType.QUADRANT for c in result.corners.values())
    assert not ex04_tutorial.REGION.polyhedron.contains(result.middle)
    assert [name for name, c in result.heights.items() if c.is_minimum] == ["A", "B"]


def test_solid():
    result = ex05_solid.main()
    assert (result.euler_characteristic, result.allowed_components) == (0, 1)
    assert result.edge_error < 1e-12


def test_disks():
    found = ex06_disks.main()
    indices = [index for _, index in found[3, "hexagonal"]]
    signed = sum((-1) ** k * n for k, n in zip(indices, ex06_disks.COPIES, strict=True))
    assert signed == 2
    assert found[2, "square"][0][0] == pytest.approx(math.sqrt(2) / 4)


def test_packing():
    jammed = ex18_packing.main(128)
    assert jammed.is_isostatic
    assert jammed.residuals.worst < 1e-12


def test_all_equilibria(tmp_path):
    table, ladder = ex19_all_equilibria.main()
    assert table.complete
    assert ladder.complete
    assert {p.index for p in table} == {0, 1}
    assert sorted(p.index for p in ladder) == [0, 0, 0, 0, 1, 1, 1, 1]
    for draw, found in (
        (ex19_all_equilibria.draw_table, table),
        (ex19_all_equilibria.draw_ladder, ladder),
    ):
        assert draw(found, tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


def test_rigid_clusters(tmp_path):
    found = ex20_rigid_clusters.main()
    assert [graph.size() for graph, _ in found.clusters] == [12, 12]
    picture = ex20_rigid_clusters.draw(found, tmp_path / "clusters.png")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_clusters_of_atoms(tmp_path):
    found = ex30_clusters_of_atoms.main()
    assert found.depth(1)[1] == pytest.approx(0.2239, abs=1e-4)
    picture = ex30_clusters_of_atoms.draw(found, tmp_path / "atoms.png")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_sticky_clusters(tmp_path):
    measured, between = ex37_sticky_clusters.main()
    assert sorted(measured.probabilities) == pytest.approx([0.04, 0.96])
    assert between.passage_times([1])[1] == 0
    picture = ex37_sticky_clusters.draw(measured, tmp_path / "clusters.png")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_pinball_pockets(tmp_path):
    tree, shares = ex38_pinball_pockets.main(100)
    ends = [ex38_pinball_pockets.pocket(*m.q[-1, 0].tolist()) for m in tree if not m.splits]
    assert sorted(ends) == ["cup", "floor", "valley", "valley"]
    for found in shares.values():
        assert sum(p for p, _ in found.values()) == pytest.approx(1.0)
    # By symmetry of the first roof and of the roofs below it
    cup, error = shares[1e-3]["cup"]
    assert cup == pytest.approx(shares[1e-3]["floor"][0], abs=6 * error)
    picture = ex38_pinball_pockets.draw(tree, tmp_path / "ways.png")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_pinball():
    result = ex07_pinball.main()
    assert all(rest.is_minimum for group in result.rests.values() for rest in group)
    kinds = {result.entrapment(name) for name in result.rests}
    assert kinds == {"2 half-V", "half-V + U", "half-V + half-U", "half-V + free"}
    assert not any(c.is_minimum for c in result.concave)
    assert all(c.stratum.local_type is LocalType.UNION for c in result.concave)
    assert result.atlas.euler_characteristic == -7


def test_rods():
    result = ex08_rods.main()
    low, high = result.bracket
    assert low < result.closed_form < high
    assert high - low < 0.01


def test_spheres():
    result = ex09_spheres.main()
    assert [len(result.atlas.corners), len(result.atlas.edges)] == [2, 5]
    assert sorted(row.order for row in result.table) == [4, 48]


def test_critical_rod():
    result = ex10_critical_rod.main()
    assert result.newton == pytest.approx(result.closed_form, abs=1e-9)
    assert result.bisection == pytest.approx(result.closed_form, abs=1e-9)


def test_readme_code_runs_as_printed():
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    assert blocks
    scope: dict = {}
    for block in blocks:
        exec(block, scope)
    np.testing.assert_allclose(scope["c"].point, [-0.5, 0.25], atol=1e-12)


def test_keel():
    result = ex11_keel.main()
    level = ex11_keel.HEADINGS.index(0.0)
    assert result.turning.upper[level] == pytest.approx(math.atan(0.1))
    assert result.order == pytest.approx(2, abs=0.05)
    assert result.difference < 0.15
    assert list(result.turning.rolls) == [True] * 6 + [False]


@pytest.mark.slow
def test_entrapment():
    result = ex15_entrapment.main()
    for run, expected in zip(result.absorbing, result.expected, strict=True):
        assert run.mean == pytest.approx(expected, abs=5 * run.error + 0.1 * expected)
    assert result.expected == sorted(result.expected)
    assert result.elastic[2] < result.elastic[0] == pytest.approx(result.elastic[1], rel=0.02)


def test_a_dyad_climbs():
    result = ex16_dyad_climbs.main()
    for one, onset in zip(result.zigzags, result.onsets, strict=True):
        assert one.upper[0] == pytest.approx(onset, abs=1.1e-5)  # what the drum turns in a step
    right, left = result.pairs.climb_rates(after=10.0)  # over few zigzags, the last one cut
    assert right == pytest.approx(result.law, rel=0.25)
    assert left == pytest.approx(-result.law, rel=0.25)


def test_turning_on_the_sphere_and_in_space():
    result = ex17_turning.main()
    assert (len(result.parts.corners), len(result.parts.edges)) == (3, 4)
    assert sorted(len(c.active) for c in result.wells) == [1, 2, 2]
    assert result.flips == pytest.approx(result.period, rel=1e-5)
    assert result.drift < 1e-6


def test_a_bouncing_ball_comes_to_rest():
    result = ex12_bouncing_ball.main()
    assert result.lost == pytest.approx(1, abs=1e-9)
    assert result.impact < 1e-9
    assert abs(result.rest) < 10 * ex12_bouncing_ball.STEP
    assert 0.5 < result.order < 1.3


def test_rolling():
    result = ex13_rolling.main()
    assert result.rests == pytest.approx(result.expected, abs=2e-3)
    assert abs(result.slips[:4]).max() < 1e-9 < result.slips[4]
    assert result.period[0] == pytest.approx(result.period[1], rel=5e-3)


def test_impacts_and_stacks():
    result = ex14_impact_and_stack.main()
    assert result.touching == pytest.approx([-1 / 3, 2 / 3, 2 / 3])
    assert result.apart == pytest.approx([0, 0, 1], abs=1e-12)
    assert result.kept == pytest.approx(result.housner, abs=5e-3)
    assert result.moved == (0, 0)


@pytest.mark.parametrize(("first", "second"), [(2, 2), (3, 2), (3, 3), (4, 2), (4, 3)])
def test_docking(first, second):
    """As many dockings as divisions of rigid clusters; each edge joins two of them."""
    _, found = ex21_docking.main(first, second)
    assert len(found.corners) == divisions(first, second)
    assert not any(edge.is_closed for edge in found.edges)


def test_docking_figure(tmp_path):
    ex21_docking.draw(*ex21_docking.main(2, 2), tmp_path / "docking.png")
    assert (tmp_path / "docking.png").read_bytes().startswith(b"\x89PNG")


def test_sliding_squares():
    """All corners, by solving for every four functions, which are linear."""
    squares, found = ex22_sliding_squares.main(2)
    d = squares.polyhedron
    rows, offsets = d.gradients(np.zeros(4)), d.values(np.zeros(4))
    expected = set()
    for some in combinations(range(len(rows)), 4):
        if abs(np.linalg.det(rows[list(some)])) < 0.5:
            continue
        q = np.linalg.solve(rows[list(some)], -offsets[list(some)])
        if d.contains(q, tolerance=1e-9) and stratum_at(d, q).dimension == 0:
            expected.add(tuple(np.round(q, 6) + 0.0))
    assert {tuple(np.round(c.point, 6) + 0.0) for c in found.corners} == expected


@pytest.mark.slow
def test_three_sliding_squares_have_two_components():
    squares, found = ex22_sliding_squares.main(3)
    reached = {tuple(np.round(c.point, 6) + 0.0) for c in found.corners}
    exchanged = {q[2:4] + q[:2] + q[4:] for q in reached}
    turned = {q[2:] + q[:2] for q in reached}
    assert not reached & exchanged
    assert reached == turned
    assert all(squares.polyhedron.contains(q, tolerance=1e-5) for q in exchanged)
    assert ex27_hard_squares.main(3).betti(1 / 2.3)[0] == 2  # squares of size 1 in a box of 2.3


def test_hard_squares(tmp_path):
    found = ex27_hard_squares.main(3)
    assert found.critical == pytest.approx((1 / 2, 1 / 3), abs=1e-9)
    assert [found.betti(size) for size in found.critical] == [(2, 2), (1, 3, 2)]
    assert len(ex27_hard_squares.draw(3, found, tmp_path)) == 3
    for row in (2, 3):
        whole, point = ex27_hard_squares.balanced(3, row)
        assert whole.polyhedron.contains(point, tolerance=1e-12)


@pytest.mark.slow
def test_four_hard_squares():
    """24 points at first, and at last the Betti numbers of four points in the plane."""
    found = ex27_hard_squares.main(4)
    assert found.critical == pytest.approx((1 / 2, 1 / 3, 1 / 4), abs=1e-9)
    assert len(found.heights) == 110_976
    assert found.betti(found.critical[0]) == (24,)
    assert found.betti(found.critical[2]) == (1, 6, 11, 6)
    assert [found.euler_characteristic(size) for size in found.critical] == [24, 0, 0]


def test_gripper(tmp_path):
    grips = ex23_gripper.main()
    assert {name: held.mobility for name, (_, held) in grips.items()} == {
        "five fingers": Mobility.FIRST_ORDER,
        "three fingers": Mobility.SECOND_ORDER,
        "pinwheel": Mobility.MOBILE,
        "notched jaws": Mobility.FIRST_ORDER,
        "flat jaws": Mobility.MOBILE,
    }
    assert len(ex23_gripper.draw(grips, tmp_path)) == 5


def test_tippe_top():  # more in tests/bodies/test_tippe_top.py
    turned = ex24_tippe_top.spun(ex24_tippe_top.oiled(), 100, seconds=10)
    assert ex24_tippe_top.inclinations(turned)[-1] == pytest.approx(math.pi, abs=1e-2)


def test_rods_jam(tmp_path):
    found = ex25_rods_jam.main()
    for name, radius in ex25_rods_jam.KNOWN.items():
        assert found[name].radius == pytest.approx(radius, abs=1e-9)
    critical = TorusDisks(3, "square").critical(np.random.default_rng(0))
    assert found["three periodic discs"].radius == pytest.approx(max(c.radius for c in critical))
    for name, jam in found.items():
        locus = name.split()[1] == "periodic"
        expected = Verdict.MINIMUM_ALONG_LOCUS if locus else Verdict.STRICT_MINIMUM
        assert jam.certificate.verdict is expected
    assert len(ex25_rods_jam.draw(found, tmp_path)) == len(found)


def test_jammed_rods_cannot_grow():
    """No placement nearby has more room, by distances from their definition."""
    case = ex25_rods_jam.CASES["four rods"]
    jam = ex25_rods_jam.jammed(*case, 12)
    rng = np.random.default_rng(0)
    q, scale = jam.point, jam.rods.manifold.scale_array
    assert room(jam.rods, q) == pytest.approx(jam.radius, abs=1e-9)
    for size in (1e-3, 1e-2, 1e-1):
        for _ in range(100):
            assert room(jam.rods, q + size * scale * rng.standard_normal(len(q))) < jam.radius


def room(rods, q):
    """The radius that segments in a square may have: by their ends, and half their distances."""
    segments = [body.markers for body in rods.placed(q).values()]
    walls = min(min(ends.min(), 1 - ends.max()) for ends in segments)
    return min(walls, *(distance(a, b) / 2 for a, b in combinations(segments, 2)))


def test_in_space_dumbbells_roll_and_pairs_climb_as_in_the_developed_drum(tmp_path):
    found = ex26_drum_in_space.main()
    assert (found.onsets < found.rest + 0.01).all()  # degrees; beyond, nothing balances the weight
    assert (found.onsets > found.rest - 0.3).all()  # slip may solve a step that rest solves as well
    assert found.rest == pytest.approx(found.formula, rel=3 / 122)  # the order of r / R
    right, left = np.diff(found.pairs[[0, -1], :, :, 1].mean(axis=-1), axis=0)[0]
    assert right > 0.5
    assert left < -0.5
    assert found.lift < 0.01
    assert ex26_drum_in_space.draw(found, tmp_path / "drum.png").exists()


def test_a_heap_that_is_swept_obeys_the_balances_of_energy_and_angular_momentum(tmp_path):
    found = ex28_heap_in_drum.main(duration=0.4)
    assert found.path.effort.unconverged > 100  # steps of the heap are not solved
    assert found.energy < 1e-3
    assert found.momentum < 1e-3
    assert found.path.max_penetration < 0.02  # of a disc's radius
    assert ex28_heap_in_drum.draw(found, tmp_path / "heap.png").exists()
    assert ex28_heap_in_drum.film(found.path, tmp_path / "heap.gif").read_bytes()[:3] == b"GIF"


def test_cages():
    cages = ex29_cages.main()
    for name, cage in cages.items():
        assert cage.height - ex29_cages.NEAR <= cage.paving.lower <= cage.height, name
        assert cage.rest[1] < cage.height
    # A way out of the spikes, on which the square touches both of them until it lies on its side.
    way = ex29_cages.tipping()
    spikes = cages["spikes"]
    assert np.allclose(way[0], spikes.rest, atol=1e-6)
    assert spikes.arrangement.polyhedron.contains(way, tolerance=1e-9).all()
    assert spikes.height - 1e-6 <= way[:, 1].max() <= spikes.height + 1e-12


def test_a_ball_leaves_its_pocket_over_the_tip_of_a_wedge(tmp_path):
    found = ex31_landscape.main()
    assert found.complete
    assert found.minima[1].active == ("wedge1.ab", "wedge2.ab")
    tip = 2.4 + 3.2 / ex31_landscape.LEAN  # the corner (3.2, 2.4) of the second wedge
    way = found.barrier(1, 0)
    assert way.lower <= tip + 1e-12
    assert way.lower == pytest.approx(tip, rel=1e-12)
    assert way.upper == pytest.approx(tip, rel=1e-9)
    assert way.route.verified
    assert [path.stat().st_size > 10_000 for path in ex31_landscape.draw(found, tmp_path)]
    film = ex31_landscape.film(found, tmp_path / "way.gif", frames=3)
    assert film.read_bytes()[:3] == b"GIF"


def test_a_truss_snaps_through_and_back(tmp_path):
    """On the axis the load ``2 k y (L/sqrt(1 + y^2) - 1)`` has its maximum where it folds."""
    loop = ex33_snap_through.main()
    length = float(ex33_snap_through.LENGTH)
    y = np.sqrt(length ** (2 / 3) - 1)
    load = 2 * ex33_snap_through.STIFFNESS * y * (length / np.sqrt(1 + y**2) - 1)
    assert [jump.parameter for jump in loop.jumps] == pytest.approx([load, -load])
    assert loop.jumps[0].after == ("stop",)
    assert loop.closed
    assert loop.work == pytest.approx(loop.released, rel=1e-6)
    assert all(path.stat().st_size > 10_000 for path in ex33_snap_through.draw(loop, tmp_path))


def test_two_link_arm():
    """What motors did is kept as energy or lost; the hand pushes until the motors stop."""
    result = ex34_two_link_arm.main()
    assert result.path.converged
    assert result.path.audit < 1e-5
    tip = result.arm.placed(result.path.q[-1, 0])["lower"].parts[""].points[1]
    assert tip[1] == pytest.approx(0.06, abs=1e-4)  # the hand lies on the floor
    block = result.path.q[-1, 0, result.arm.manifold.names.index("xblock")]
    assert block - tip[0] == pytest.approx(0.06 + 0.15, abs=2e-3)
    assert result.moved > 0.6
    assert result.proved


def test_slider_crank():
    result = ex35_slider_crank.main()
    assert result.error < 1e-5
    assert result.path.audit < 1e-5
    assert np.ptp(result.piston) == pytest.approx(2 * ex35_slider_crank.CRANK, rel=1e-4)


def test_rough_walls_of_a_silo_bear_a_part_of_the_weight(tmp_path):
    found = ex32_silo.main()
    smooth, rough = (found.floor[name][-20:].mean() for name in ("smooth", "rough"))
    assert smooth == pytest.approx(1.0, abs=0.02)
    assert abs(rough - 1.0) > 0.02  # how much depends on how they came to lie
    for path in (found.smooth, found.rough):
        assert path.audit < 1e-3
        assert path.max_penetration < 0.02
    assert ex32_silo.draw(found, tmp_path / "silo.png").stat().st_size > 10_000


@pytest.fixture(scope="module")
def nested_corner():
    return ex36_nested_corner.main()


def test_a_nested_pair_ends_where_its_multipliers_do(nested_corner, tmp_path):
    """Against closed forms: ``r + t = 2 r sqrt(1 - r^2/l^2)``, and the height of a triangle."""
    found = nested_corner
    r, length = ex36_nested_corner.BALL, ex36_nested_corner.LENGTH
    critical = 2 * r * np.sqrt(1 - r**2 / length**2) - r
    (limit,) = [e for e in found.equal.events if e.kind.name == "CORNER_LIMIT"]
    assert limit.parameter == pytest.approx(critical, abs=1e-9)
    assert sorted(found.equal.arcs[k].active for k in limit.arcs) == [
        ("A2B1",), ("A2B1", "A2b", "aB1"),
    ]  # fmt: skip
    (curve,) = found.drums.curves
    np.testing.assert_allclose(curve.parameters[:, 0], critical, atol=1e-9)

    assert found.weights.closed
    (meeting,) = [m for m in found.weights.meetings if m.kind.name == "CONTACTS"]
    np.testing.assert_allclose(meeting.parameters, [critical, 1.0], atol=1e-8)
    assert len(meeting.curves) == 4
    # Exchanging the dumbbells inverts the ratio.
    for kind in ("OPENS", "CORNER_LIMIT"):
        curves = [c.parameters for c in found.weights.curves if c.kind.name == kind]
        (rod, ratio), (other, inverse) = (
            max(c[[0, -1]], key=lambda p: abs(p[1] - 1)) for c in curves
        )
        assert (other, 1 / inverse) == pytest.approx((rod, ratio), rel=1e-8)
    pair = DumbbellPair(length, r, ex36_nested_corner.ROD, ex36_nested_corner.DRUM)
    assert found.ratio == pytest.approx(1.728, abs=5e-4)
    for part, contacts in ((0.999, 3), (1.001, 2)):
        energy = ex36_nested_corner.weighed(pair, found.ratio * part)
        minimum = minimise(pair.polyhedron, energy, pair.nested("R"))
        assert len(minimum.found.strong_positions) == contacts

    short, end = [], []
    for curve in found.lengths.curves:
        (end if curve.active == ("A2B1",) else short).append(curve.parameters.T)
    for rod, long in short:
        np.testing.assert_allclose(long**2 / 4, 4 * r**2 - (r + rod) ** 2, rtol=1e-9)
    ((rod, long),) = end
    np.testing.assert_allclose(r + rod, 2 * r * np.sqrt(1 - r**2 / long**2), rtol=1e-9)
    for path in ex36_nested_corner.draw(found, tmp_path):
        assert path.stat().st_size > 10_000


class ParallelPair:
    """Two parallel dumbbells in a drum, each other's image in a half-turn about the vertical.

    A is at the azimuth ``phi`` and B at ``-phi``, ``eta`` further along the drum; all from
    positions in space.
    """

    LENGTH, BALL, ROD, RHO = 16.0, 3.0, 1.5, 122.0

    def balls(self, phi, eta, theta):
        turn = math.asin(self.LENGTH * math.sin(theta) / 2 / self.RHO)
        reach = self.LENGTH / 2 * math.cos(theta)
        return [
            np.array([self.RHO * math.sin(a), y, -self.RHO * math.cos(a)])
            for a, y in ((phi - turn, eta - reach), (phi + turn, eta + reach))
        ]

    def gap(self, contact, phi, theta, eta):
        a, b = self.balls(phi, 0.0, theta), self.balls(-phi, eta, theta)
        if contact == "balls":
            return np.linalg.norm(a[1] - b[0]) - 2 * self.BALL
        way = (b[1] - b[0]) / self.LENGTH
        foot = b[0] + (a[1] - b[0]) @ way * way
        return np.linalg.norm(a[1] - foot) - self.BALL - self.ROD

    def height(self, contact, theta, eta):
        """Return the height of the balls where a contact holds."""
        phi = optimize.brentq(lambda x: self.gap(contact, x, theta, eta), 0, 0.04, xtol=1e-15)
        balls = [*self.balls(phi, 0.0, theta), *self.balls(-phi, eta, theta)]
        return sum(ball[2] for ball in balls)

    def slopes(self, contact, theta, eta, h=1e-4):
        """Return the derivatives of the height by ``theta`` and ``eta``."""
        return [
            (self.height(contact, theta + h * i, eta + h * j)
             - self.height(contact, theta - h * i, eta - h * j)) / (2 * h)
            for i, j in ((1, 0), (0, 1))
        ]  # fmt: skip

    def tilt(self, contact, eta_of, lever, sign):
        """Return the tilt at which no other force acts, and the heading there.

        Lever is what a turn of the pair lifts its weight along the drum by.
        """

        def turning(theta):
            by_theta, by_eta = self.slopes(contact, theta, eta_of(theta))
            return by_theta + lever * math.sin(theta) * by_eta

        theta = optimize.brentq(turning, 0.08, 0.16)
        return math.atan(sign * self.slopes(contact, theta, eta_of(theta))[1] / 2), theta

    def corner(self, theta):
        """Return ``eta`` where both kinds of contacts hold."""

        def left(eta):
            phi = optimize.brentq(lambda x: self.gap("rods", x, theta, eta), 0, 0.04, xtol=1e-15)
            return self.gap("balls", phi, theta, eta)

        return optimize.brentq(left, 11.5, 13.5, xtol=1e-13)


def test_a_tilted_pair_ends_where_one_dumbbell_carries_the_other(nested_corner):
    """Against a pair of three coordinates, from its definition, and closed forms in the plane."""
    pair = ParallelPair()
    length, rho, p = pair.LENGTH, pair.RHO, pair.BALL + pair.ROD
    s = math.sqrt(4 * pair.BALL**2 - p**2)
    flat = length - s
    known = {}
    for held, lever in (("lower", 0.0), ("end", length)):
        opens, _ = pair.tilt("rods", pair.corner, lever, -1)
        folds = optimize.minimize_scalar(
            lambda eta, lever=lever: -pair.tilt("rods", lambda _: eta, lever, -1)[0],
            bounds=(8.5, 12.0), method="bounded",
        )  # fmt: skip
        known[held] = {"OPENS": opens, "FOLD": -folds.fun}
    known["upper"] = {"CORNER_LIMIT": pair.tilt("balls", pair.corner, 0.0, 1)[0]}
    for (held, hand), found in nested_corner.tilts.items():
        kinds = {e.kind.name: e for e in found.events if e.kind.name not in ("END", "UNDECIDED")}
        told = {kind: event.parameter for kind, event in kinds.items()}
        assert told == pytest.approx(known.get(held, {}), rel=1e-5)
        (stable,) = [arc for arc in found.arcs if arc.stable and "A2B1" in arc.active]
        assert {"A2B1", "A2b", "aB1"} <= {*stable.active}
        mirrored = nested_corner.tilts[held, "L" if hand == "R" else "R"]
        assert [e.parameter for e in mirrored.events] == pytest.approx(
            [e.parameter for e in found.events], rel=1e-9
        )
        if held == "each":
            assert np.ptp(stable.points, axis=0) == pytest.approx(0, abs=1e-9)
            force = 4 * np.sin(stable.parameters)
            np.testing.assert_allclose(stable.multipliers["support"], force, rtol=1e-9)
            assert stable.parameters[-1] == pytest.approx(math.pi / 2)

    def across(theta):
        return p * math.cos(theta) - flat * math.sin(theta)

    def turning(theta, pull):
        along = flat * math.cos(theta) + p * math.sin(theta)
        return -along * across(theta) + length**2 * math.sin(2 * theta) / 2 + pull * across(theta)

    def pushed(theta):
        return across(theta) * math.tan(theta)

    def pulled(theta):
        return across(theta) * (s - p * math.tan(theta)) / (p + s * math.tan(theta))

    leans = optimize.brentq(lambda x: turning(x, pushed(x)), 0.1, 0.2)
    hangs = optimize.brentq(lambda x: turning(x, -pulled(x)), 0.1, 0.2)
    plane = {
        "OPENS": (known["lower"], leans, pushed),
        "CORNER_LIMIT": (known["upper"], hangs, pulled),
    }
    for kind, (drum, theta, force) in plane.items():
        assert math.atan(force(theta) / (2 * rho)) == pytest.approx(drum[kind], rel=1e-3)

    # The numbers of docs/paper.md
    degrees = {
        "lower": {"OPENS": 0.0908, "FOLD": 0.0965}, "upper": {"CORNER_LIMIT": 0.4014},
        "end": {"OPENS": 0.0914, "FOLD": 0.0978},
    }  # fmt: skip
    for held, kinds in degrees.items():
        found = {kind: math.degrees(value) for kind, value in known[held].items()}
        assert found == pytest.approx(kinds, abs=5e-5)
    shares = [math.tan(known["lower"]["OPENS"]), math.tan(known["upper"]["CORNER_LIMIT"])]
    assert np.divide(shares, math.tan(math.radians(7))) == pytest.approx([0.013, 0.057], abs=5e-4)

    slide = nested_corner.slide
    assert slide.kind.name == "FOLD"
    assert {*slide.after} == {"A1B1", "A2B2", "A2b", "aB1", "A1"}
    assert slide.released > 0

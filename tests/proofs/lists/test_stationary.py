"""Complete lists of stationary points, against problems whose lists are known."""

import math
import pickle
import zipfile

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import AnyOf, Manifold, Polyhedron, Symmetry
from polycorner.minimisation.problem import pose
from polycorner.polyhedra.symmetry import Element
from polycorner.proofs import stationary_points
from polycorner.proofs.checker import __main__ as checker
from polycorner.proofs.lists.domains import domain
from polycorner.proofs.lists.members import OUT, judged
from polycorner.proofs.lists.search import StationarySearch

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
SIDES = [(-4.0, 4.0), (-4.0, 4.0)]


def sorted_points(found):
    return sorted(np.round([p.point for p in found], 9).tolist())


def negated(q):
    return -q


@pytest.fixture(scope="module")
def himmelblau():
    disc = Polyhedron(PLANE, {"disc": 36 - X**2 - Y**2})
    energy = (X**2 + Y - 11) ** 2 + (X + Y**2 - 7) ** 2
    return stationary_points(disc, energy, box=[(-6, 6), (-6, 6)])


def test_himmelblau_has_nine_stationary_points_in_the_disc(himmelblau):
    assert himmelblau.complete
    assert sorted(p.index for p in himmelblau) == [0, 0, 0, 0, 1, 1, 1, 1, 2]
    # Morse: on the disc, whose boundary the gradient leaves, minima - saddles + maxima = 1.
    assert sum((-1) ** p.index for p in himmelblau) == 1
    assert [3.0, 2.0] in sorted_points(himmelblau.minima)


def test_polynomial_systems_have_the_solutions_that_algebra_finds(himmelblau):
    energy = (X**2 + Y - 11) ** 2 + (X + Y**2 - 7) ** 2
    eliminated = sympy.resultant(energy.diff(X), energy.diff(Y), Y)
    real = sorted(
        float(root) for root in sympy.Poly(eliminated, X).nroots(30) if abs(sympy.im(root)) < 1e-20
    )
    assert np.allclose(sorted(p.point[0] for p in himmelblau), real, atol=1e-9)


def test_camel_has_six_minima_also_by_its_symmetry():
    square = Polyhedron(PLANE, {"a": 3 - X, "b": 3 + X, "c": 2 - Y, "d": 2 + Y})
    energy = (4 - sympy.Rational(21, 10) * X**2 + X**4 / 3) * X**2 + X * Y + (4 * Y**2 - 4) * Y**2
    box = [(-3.0, 3.0), (-2.0, 2.0)]
    whole = stationary_points(square, energy, box=box)
    half = stationary_points(
        square, energy, box=box, symmetry=Symmetry(elements=[Element(negated, {})])
    )
    assert whole.complete
    assert half.complete
    assert len(whole.minima) == len(half.minima) == 6
    assert sorted_points(whole) == sorted_points(half)
    assert len(whole) == 15
    assert half.tally.boxes < 0.7 * whole.tally.boxes


@st.composite
def discs(draw):
    """Disjoint discs, and a point outside of them."""
    count = draw(st.integers(1, 3))
    cells = draw(st.permutations([(i, j) for i in (-2, 0, 2) for j in (-2, 0, 2)]))
    numbers = st.integers(-30, 30).map(lambda k: sympy.Rational(k, 100))
    radii = st.integers(20, 60).map(lambda k: sympy.Rational(k, 100))
    holes = [(i + draw(numbers), j + draw(numbers), draw(radii)) for i, j in cells[:count]]
    i, j = cells[count]
    return holes, (i + draw(numbers), j + draw(numbers))


@settings(max_examples=8)
@given(discs())
def test_distance_from_a_point_rests_there_and_behind_each_disc(problem):
    holes, (a, b) = problem
    d = Polyhedron(PLANE, [(X - u) ** 2 + (Y - v) ** 2 - r**2 for u, v, r in holes])
    found = stationary_points(d, (X - a) ** 2 + (Y - b) ** 2, box=SIDES)
    behind = []
    for u, v, r in holes:
        way = np.array([float(u - a), float(v - b)])
        behind.append(np.array([float(u), float(v)]) + float(r) * way / np.linalg.norm(way))
    assert found.complete
    expected = sorted(np.round([[float(a), float(b)], *behind], 9).tolist())
    assert np.allclose(sorted_points(found), expected, atol=1e-8)
    assert [p.index for p in found if not p.active] == [0]
    assert all(p.index == 1 for p in found if p.active)


@settings(max_examples=8)
@given(st.lists(st.integers(1, 359), min_size=3, max_size=6, unique=True), st.integers(0, 359))
def test_projection_onto_a_polygon_is_unique(degrees, way):
    """The nearest point of a convex set is the only stationary point of the distance."""
    normals = [
        tuple(sympy.Rational(round(1000 * f(math.radians(g))), 1000) for f in (math.cos, math.sin))
        for g in degrees
    ]
    walls = [1 - u * X - v * Y for u, v in normals]
    frame = [3 - X, 3 + X, 3 - Y, 3 + Y]
    target = 2.5 * np.array([math.cos(math.radians(way)), math.sin(math.radians(way))])
    a, b = (sympy.Rational(round(1000 * t), 1000) for t in target)
    d = Polyhedron(PLANE, [*walls, *frame])
    found = stationary_points(d, (X - a) ** 2 + (Y - b) ** 2, box=SIDES)
    nearest = projected(
        np.array([[float(u), float(v)] for u, v in normals]), np.array([a, b], float)
    )
    assert len(found) <= 1
    if len(found):
        assert np.allclose(found.points[0].point, nearest, atol=1e-8)
    if found.complete:
        assert len(found) == 1
    else:
        assert np.any(np.all((found.undecided[:, 0] <= nearest + 1e-9)
                             & (found.undecided[:, 1] >= nearest - 1e-9), axis=1))  # fmt: skip


def projected(normals, point):
    """Return the point of {n.q <= 1, |q_i| <= 3} nearest to a point, by trying all faces."""
    rows = np.vstack([normals, np.eye(2) / 3, -np.eye(2) / 3])
    candidates = [point]
    for i, n in enumerate(rows):
        candidates.append(point + (1 - n @ point) * n / (n @ n))
        candidates += [
            np.linalg.solve(rows[[i, j]], [1, 1])
            for j in range(i)
            if abs(np.linalg.det(rows[[i, j]])) > 1e-9
        ]
    inside = [q for q in candidates if (rows @ q <= 1 + 1e-9).all()]
    return min(inside, key=lambda q: np.linalg.norm(q - point))


def test_kinks_of_a_union_are_no_places_of_rest():
    """Two discs that overlap: above their reentrant corners the height has two minima below."""
    union = Polyhedron(PLANE, [AnyOf(1 - X**2 - Y**2, 1 - (X - 1) ** 2 - Y**2)])
    found = stationary_points(union, Y, box=SIDES)
    assert found.complete
    assert sorted_points(found) == [[0.0, -1.0], [1.0, -1.0]]


def test_a_point_inside_another_branch_is_dropped():
    """The lowest point of the small disc lies inside the large one."""
    union = Polyhedron(PLANE, [AnyOf(4 - X**2 - Y**2, 1 - X**2 - (Y + 0.5) ** 2)])
    found = stationary_points(union, Y, box=SIDES)
    assert found.complete
    assert sorted_points(found) == [[0.0, -2.0]]


def test_equations_restrict_directions():
    circle = Polyhedron(PLANE, {"up": Y + sympy.Rational(1, 2)}, {"circle": 1 - X**2 - Y**2})
    found = stationary_points(circle, X + 2 * Y, box=SIDES)
    assert found.complete
    top = np.array([1.0, 2.0]) / math.sqrt(5)
    ends = [[-math.sqrt(0.75), -0.5], [math.sqrt(0.75), -0.5]]
    assert np.allclose(sorted_points(found), sorted([*ends, top.tolist()]), atol=1e-8)
    assert sorted(p.index for p in found) == [0, 0, 1]


def test_circles_need_no_sides_and_have_no_seam():
    torus = Manifold(("a", "b"), (math.tau, math.tau))
    a, b = torus.symbols
    found = stationary_points(
        Polyhedron(torus, {"all": 3 + sympy.cos(a)}), sympy.cos(a) + sympy.cos(2 * b), box={}
    )
    assert found.complete
    assert len(found) == 8  # 2 critical points of cos(a) times 4 of cos(2 b)
    assert sum((-1) ** p.index for p in found) == 0  # the Euler characteristic of the torus


def half_turned(q):
    return q + np.array([0, np.pi])


def mirrored(q):
    return q * [-1, 1]


@pytest.mark.parametrize("turned", [False, True])
def test_images_on_circles_hold_the_points(turned):
    """The points are multiples of pi/4 from a rational angle, which no double is."""
    tube = Manifold(("z", "t"), (math.inf, math.tau))
    z, t = tube.symbols
    for phase in (0, -3, sympy.Rational(-22, 7)):
        energy = sympy.cos(4 * (t - phase)) + (z**2 - 1) ** 2
        element = Element(half_turned if turned else mirrored, {})
        found = stationary_points(
            Polyhedron(tube, {"all": 3 + sympy.cos(4 * t)}), energy, box={"z": (-2, 2)},
            symmetry=Symmetry(elements=[element]),
        )  # fmt: skip
        assert found.complete
        assert len(found) == 24
        for p in found:
            low, high = (sympy.Rational(end[1]) for end in (p.lower, p.upper))
            step = sympy.pi / 4
            turns = round(float(((low + high) / 2 - phase) / step))
            assert low <= sympy.N(phase + turns * step, 60) <= high


def test_fixed_coordinates_are_a_quotient_by_a_translation():
    line = Manifold.euclidean("u v")
    u, v = line.symbols
    d = Polyhedron(line, {"apart": (v - u) ** 2 - 1})
    found = stationary_points(d, (v - u - 3) ** 2, box={"u": 0.0, "v": (-9, 9)})
    assert found.complete
    assert sorted_points(found) == [[0.0, -1.0], [0.0, 3.0]]
    with pytest.raises(ValueError, match="box"):
        stationary_points(d, (v - u - 3) ** 2 + u**2, box={"u": 0.0, "v": (-9, 9)})


def test_a_field_whose_orbits_miss_the_section_is_no_quotient():
    """Along (1 - x^2, 2 x y) nothing changes, but no orbit from |x| > 1 meets x = 0."""
    invariant = Y * (1 - X**2)
    d = Polyhedron(PLANE, {"all": 9 + invariant})
    field = Symmetry(fields=[{"x": 1 - X**2, "y": 2 * X * Y}])
    with pytest.raises(ValueError, match="box: expected an interval for x"):
        stationary_points(d, (invariant - 3) ** 2, box=[0.0, (-9, 9)], symmetry=field)


def test_rigid_motions_of_the_plane_are_factored_out_one_after_the_other():
    """The rotation moves the first point as well, until this is fixed by translations."""
    plane = Manifold(("a", "b", "t", "u", "v"), (math.inf, math.inf, math.tau) + (math.inf,) * 2)
    a, b, t, u, v = plane.symbols
    along = sympy.cos(t) * (u - a) + sympy.sin(t) * (v - b)
    across = sympy.cos(t) * (v - b) - sympy.sin(t) * (u - a)
    d = Polyhedron(plane, {"away": along**2 + across**2 - 1})
    energy = (along - 3) ** 2 + (across + sympy.Rational(1, 2)) ** 2
    moving = Symmetry(fields=[{"a": 1, "u": 1}, {"b": 1, "v": 1}])
    turning = Symmetry(fields=[{"a": -b, "b": a, "t": 1, "u": -v, "v": u}])
    box = {"a": 0.0, "b": 0.0, "t": 0.0, "u": (-5, 5), "v": (-5, 5)}
    found = stationary_points(d, energy, box=box, symmetry=turning)
    assert found.complete
    assert [3.0, -0.5] in [p.point[3:].round(9).tolist() for p in found.minima]
    with pytest.raises(ValueError, match="box: expected an interval for t"):
        stationary_points(d, energy, box=box, symmetry=moving)


def test_lists_are_values(himmelblau, tmp_path):
    again = pickle.loads(pickle.dumps(himmelblau))
    assert sorted_points(again) == sorted_points(himmelblau)
    files = [found.save(tmp_path / f"{k}.zip") for k, found in enumerate((himmelblau, again))]
    assert len({zipfile.ZipFile(file).read("problem.json") for file in files}) == 1
    assert not himmelblau.points[0].lower.flags.writeable


def test_certificates_of_a_list_are_made_with_its_tolerances():
    """Another function is 1e-6 away, and two gradients enclose an angle of about 1e-4."""
    parts = {"floor": Y, "ramp": Y + X / 10_000, "shelf": Y + sympy.Rational(1, 10**6)}
    found = stationary_points(Polyhedron(PLANE, parts), 2 * Y + X / 10_000, box=[(-1, 1), (-1, 1)])
    ((one,), (wide,)) = found.certificates(), found.certificates(tolerance=1e-5)
    assert (one.active, wide.active) == (("floor", "ramp"), ("floor", "ramp", "shelf"))
    (flat,) = found.certificates(rank_tolerance=1e-3)
    assert (one.licq, flat.licq) == (True, False)


def test_a_place_is_left_out_where_a_distance_is_zero():
    """The energy is stationary at the centre, which is outside; no root is analytic there."""
    across, along = sympy.sin(X) - sympy.sin(1) / 3, Y - sympy.sqrt(3) / 3
    d = Polyhedron(PLANE, {"away": sympy.sqrt(across**2 + along**2) - sympy.Rational(1, 4)})
    energy, centre = across**2 + 2 * along**2, [math.asin(math.sin(1) / 3), math.sqrt(3) / 3]
    box = [(-1.5, 1.5), (-4, 4)]
    search = StationarySearch(pose(d, energy), domain(PLANE, box), 1e-6)
    region = search.faces.region(np.array(centre), [])
    assert region is not None
    assert judged(search, region).place == OUT
    found = stationary_points(d, energy, box=box)
    assert found.complete
    at = np.array([[math.sin(p.point[0]) - math.sin(1) / 3, p.point[1] - centre[1]] for p in found])
    assert np.allclose(np.sort(4 * at, axis=0), np.sort([[-1, 0], [0, -1], [0, 1], [1, 0]], axis=0))


def test_loci_outside_the_box_are_not_listed():
    strip = Polyhedron(PLANE, {"right": X - 1, "left": 3 - X})
    found = stationary_points(strip, (Y**2 - 4) ** 2, box=[(-4, 4), (-1, 3)])
    assert found.complete
    assert sorted(round(p.lower["y"], 6) for p in found.loci) == [0.0, 2.0]
    assert "a point (x, y)" in str(found)


@pytest.mark.parametrize("reach", [0.25, 1e-9, 0, -1e-9, -0.25])
def test_loci_off_the_set_are_not_listed(reach):
    """The half-plane and the disc leave x <= 2 + reach, and the energy is stationary at x = 2."""
    end = sympy.Rational(2) + sympy.Rational(reach)
    d = Polyhedron(PLANE, {"left": 3 - X - Y, "disc": 9 - (X + 3 - end) ** 2 - Y**2})
    found = stationary_points(d, (X - 2) ** 2, box=SIDES, resolution=1e-3)
    assert found.complete or abs(reach) < 1e-6
    assert len(found.loci) == (reach >= 0)
    if reach > 0:
        assert d.contains(found.loci[0].sample)
    if reach == 0:
        assert found.loci[0].sample is None
        assert not found.complete
    if reach == -0.25:
        assert [p.active for p in found] == [("disc",)]


def test_a_set_without_inequalities_is_searched():
    circle = Polyhedron(PLANE, [], {"circle": 1 - X**2 - Y**2})
    found = stationary_points(circle, X, box=SIDES)
    assert found.complete
    assert sorted_points(found) == [[-1.0, 0.0], [1.0, 0.0]]
    assert sorted(p.index for p in found) == [0, 1]


def test_loci_along_coordinates_that_the_energy_does_not_read():
    d = Polyhedron(PLANE, {"right": X - 1, "left": 3 - X, "low": 2 - Y, "high": Y + 2})
    found = stationary_points(d, Y**2, box=SIDES)
    assert found.complete
    assert not found.points
    (locus,) = found.loci
    assert locus.is_minimum
    assert locus.lower["y"] <= 0 <= locus.upper["y"]
    assert locus.sample is not None
    assert d.contains(locus.sample)


def test_the_whole_set_is_a_locus_of_a_constant_energy(tmp_path):
    disc = Polyhedron(PLANE, {"disc": 1 - X**2 - Y**2})
    found = stationary_points(disc, sympy.Integer(1), box=SIDES)
    assert found.complete
    assert (len(found), len(found.loci)) == (0, 1)
    assert disc.contains(found.loci[0].sample)
    assert checker.main([str(found.save(tmp_path / "constant.zip"))]) == 0


@pytest.mark.parametrize(
    ("parts", "energy"),
    [
        ([2 - X, 2 + X, 2 - Y, 2 + Y], X**4 + Y**2),  # degenerate
        ([X, 2 - X, 2 - Y, 2 + Y], X**2 + Y**2),  # weakly active
        ([Y - X**2, 2 * X**2 - Y], Y),  # tangential contact: a cusp on either side
        ([2 - X, 2 + X, 2 - Y, 2 + Y], (X**2 - sympy.Rational(1, 10**18)) ** 2 + Y**2),
        ([2 - X, 2 + X, 2 - Y, 2 + Y], (X**2 + Y**2 - 1) ** 2),  # a circle of minima
    ],
)
def test_what_is_not_decided_is_returned(parts, energy):
    found = stationary_points(
        Polyhedron(PLANE, parts), energy, box=SIDES, resolution=1e-3, max_boxes=30_000
    )
    assert not found.complete
    rest = found.undecided
    at = [0.0, 0.0] if energy != (X**2 + Y**2 - 1) ** 2 else [0.6, 0.8]
    assert ((rest[:, 0] <= at) & (rest[:, 1] >= at)).all(axis=1).any()


def test_budget_leaves_boxes_undecided():
    d = Polyhedron(PLANE, {"disc": 9 - X**2 - Y**2})
    energy = sympy.cos(5 * X) + sympy.sin(7 * Y)
    found = stationary_points(d, energy, box=SIDES, max_boxes=3)
    assert not found.complete
    assert found.undecided_volume > 0
    assert "Not complete" in found.statement


@pytest.mark.parametrize(
    ("change", "kind", "name"),
    [
        ({"box": [(-1, 1)]}, ValueError, "box"),
        ({"box": {"x": (-1, 1)}}, ValueError, "box"),
        ({"box": {"x": (1, -1), "y": (0, 1)}}, ValueError, "box"),
        ({"box": {"x": (0, 1), "z": (0, 1)}}, ValueError, "box"),
        ({"box": 3.0}, TypeError, "box"),
        ({"box": [(0, math.inf), (0, 1)]}, ValueError, "box"),
        ({"box": [0.0, (0, 1)]}, ValueError, "box"),
        ({"resolution": 0.0}, ValueError, "resolution"),
        ({"max_boxes": 0}, ValueError, "max_boxes"),
        ({"max_seconds": -1}, ValueError, "max_seconds"),
        ({"progress": 1}, TypeError, "progress"),
        ({"symmetry": 1}, TypeError, "symmetry"),
        ({"symmetry": Symmetry(elements=[Element(negated, {})])}, ValueError, "symmetry"),
    ],
)
def test_bad_arguments_are_named(change, kind, name):
    d = Polyhedron(PLANE, {"disc": 1 - X**2 - Y**2})
    arguments = {"box": [(-1, 1), (-1, 1)], **change}
    with pytest.raises(kind, match=name):
        stationary_points(d, X + Y**2, **arguments)

"""Faces without edges, islands, handles and starts outside, against counts of cells of a grid."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_grids import grid_boundary_euler, grid_euler, grid_pieces, vertices
from skeleton_shapes import ball, counts, half_space, space, whole

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, skeleton
from polycorner.files import load_skeleton, save_skeleton
from polycorner.skeletons import Budget, Completeness, resume

TAU = math.tau
TORUS = Manifold(("p", "q"), periods=(TAU, TAU))
SPACE = Manifold.euclidean("x y z")
p, q = TORUS.symbols
x, y, z = SPACE.symbols

few = settings(max_examples=3)
seeds = st.integers(0, 99)


def box(manifold_dimension):
    n = manifold_dimension
    return [
        half_space(sign * np.eye(n)[i], 1, f"{'+' if sign > 0 else '-'}{i}")
        for i in range(n)
        for sign in (1, -1)
    ]


@st.composite
def disjoint(draw, n, most, radii=(0.05, 0.2)):
    """Return centres and radii of disjoint balls in ``|q| < 0.85``, well apart."""
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    found = []
    for _ in range(draw(st.integers(1, most))):
        for _ in range(200):
            c, r = rng.uniform(-0.85, 0.85, n), rng.uniform(*radii)
            clear = all(np.linalg.norm(c - d) > r + s + 0.05 for d, s in found)
            if clear and np.linalg.norm(c) + r < 0.9 and np.linalg.norm(c) > r + 0.05:
                found.append((c, r))
                break
    return found


def holes(balls):
    return [ball(tuple(c), r, f"hole{k}", inside=False) for k, (c, r) in enumerate(balls)]


def without(balls, step):
    axis = np.arange(-1.2, 1.2 + step, step)

    def inside(*coordinates):
        found = sum(u**2 for u in coordinates) <= 1
        for c, r in balls:
            found &= sum((u - a) ** 2 for u, a in zip(coordinates, c, strict=True)) >= r**2
        return found

    return vertices(inside, [axis] * len(balls[0][0]))


class TestIslandsInTheInterior:
    @given(disjoint(2, 5), seeds)
    @few
    def test_holes_in_a_disc_are_found_from_one_start(self, balls, seed):
        D = Polyhedron(space(2), AllOf(ball((0, 0), 1, "disc"), *holes(balls)))
        atlas = skeleton(D, [[0, 0]], rng=seed)
        k = len(balls)
        assert counts(atlas) == (0, 1 + k, 1)
        assert len(atlas.faces[0].boundary) == 1 + k
        assert atlas.euler_characteristic == grid_euler(without(balls, 0.01), (False, False))
        assert atlas.complete is Completeness.EXHAUSTED
        assert all(contact.met for contact in atlas.contacts.values())

    @given(disjoint(3, 3, (0.1, 0.25)), seeds)
    @few
    def test_voids_in_a_ball_and_in_a_cube_are_closed_faces(self, balls, seed):
        k = len(balls)
        D = Polyhedron(space(3), AllOf(ball((0, 0, 0), 1, "ball"), *holes(balls)))
        atlas = skeleton(D, [[0, 0, 0]], rng=seed)
        assert counts(atlas) == (0, 0, 1 + k)
        solid = without(balls, 0.03)
        assert atlas.euler_characteristic == grid_boundary_euler(solid, (False,) * 3) == 2 + 2 * k
        assert atlas.components[3] == grid_pieces(solid) == 1
        D = Polyhedron(space(3), AllOf(*box(3), *holes(balls)))
        atlas = skeleton(D, [[0, 0, 0]], rng=seed)
        assert whole(atlas) == ((8, 12, 6 + k), 2 + 2 * k)
        assert atlas.components[3] == 1

    def test_voids_that_a_start_meets_first_are_in_one_component_with_the_cube(self):
        voids = [((-0.082, 0.31, 0.443), 0.157), ((0.231, -0.365, -0.254), 0.199)]
        D = Polyhedron(space(3), AllOf(*box(3), *holes(voids)))
        atlas = skeleton(D, [[0, 0, 0]], rng=20)
        assert counts(atlas) == (8, 12, 8)
        assert atlas.components[3] == 1

    @pytest.mark.parametrize("radius", [0.1, 0.01, 0.001])
    def test_a_small_void_is_found_by_minimising_its_function(self, radius):
        D = Polyhedron(space(3), AllOf(*box(3), ball((0.3, 0.2, 0.1), radius, "v", inside=False)))
        atlas = skeleton(D, [[-0.5, 0.1, 0.2]])
        assert counts(atlas) == (8, 12, 7)
        assert [face.active for face in atlas.faces if not face.boundary] == [("v",)]

    @given(disjoint(2, 4), seeds)
    @few
    def test_each_of_several_discs_has_its_own_face(self, balls, seed):
        discs = [ball(tuple(c), r, f"disc{k}") for k, (c, r) in enumerate(balls)]
        D = Polyhedron(space(2), AnyOf(*discs))
        atlas = skeleton(D, [c for c, _ in balls], rng=seed)
        assert counts(atlas) == (0, len(balls), len(balls))
        assert atlas.euler_characteristic == len(balls)

    def test_the_answer_does_not_depend_on_the_start(self):
        balls = [((0.5, 0.0), 0.1), ((-0.3, 0.4), 0.15), ((0.0, -0.5), 0.05)]
        D = Polyhedron(space(2), AllOf(ball((0, 0), 1, "disc"), *holes(balls)))
        for start in ([[0, 0]], [[0.9, 0.1]], [[-0.9, 0], [0, 0.1]]):
            atlas = skeleton(D, start)
            assert (counts(atlas), atlas.euler_characteristic) == ((0, 4, 1), -2)

    def test_a_function_that_is_never_met_is_reported_with_its_least_value(self):
        D = Polyhedron(space(2), AllOf(ball((0, 0), 1, "disc"), half_space((3, 4), 10, "far")))
        atlas = skeleton(D, [[0.1, 0.2]])
        assert atlas.contacts["disc"].edges == 1
        assert atlas.contacts["disc"].least is None
        assert not atlas.contacts["far"].met
        assert atlas.contacts["far"].least == pytest.approx(10 - 5, abs=1e-6)
        assert "never met" in str(atlas)


class TestClosedSurfaces:
    @given(st.floats(0.2, 20), st.floats(0.2, 0.9), seeds)
    @few
    def test_balls_and_shells(self, radius, part, seed):
        D = Polyhedron(space(3), AllOf(ball((0, 0, 0), radius, "out")))
        atlas = skeleton(D, [[0.1 * radius, 0, 0]], rng=seed)
        assert (counts(atlas), atlas.euler_characteristic) == ((0, 0, 1), 2)
        assert atlas.faces[0].closed
        assert atlas.components == {0: 0, 1: 0, 2: 1, 3: 1}
        core = ball((0, 0, 0), part * radius, "in", inside=False)
        shell = Polyhedron(space(3), AllOf(ball((0, 0, 0), radius, "out"), core))
        atlas = skeleton(shell, [[(1 + part) / 2 * radius, 0, 0]], rng=seed)
        assert (counts(atlas), atlas.euler_characteristic) == ((0, 0, 2), 4)
        assert atlas.components[3] == 1

    @pytest.mark.parametrize("thickness", ["1/2", "4/5"])
    def test_a_solid_torus_has_one_face_with_a_handle(self, thickness):
        r = sp.Rational(thickness)
        D = Polyhedron(SPACE, {"t": r**2 - (sp.sqrt(x**2 + y**2) - 2) ** 2 - z**2})
        atlas = skeleton(D, [[2, 0.1, 0.1]])
        assert (counts(atlas), atlas.euler_characteristic) == ((0, 0, 1), 0)
        assert atlas.faces[0].euler_characteristic == 0

    def test_a_double_torus_has_two_handles(self):
        f = (x**2 * (1 - x**2) - y**2) ** 2 + z**2 - sp.Rational(1, 100)
        D = Polyhedron(SPACE, {"pretzel": -f})
        atlas = skeleton(D, [[0.7, 0.5, 0.0]])
        axes = [np.linspace(-1.4, 1.4, 113), np.linspace(-1, 1, 81), np.linspace(-0.5, 0.5, 41)]
        grid = vertices(lambda u, v, w: (u**2 * (1 - u**2) - v**2) ** 2 + w**2 <= 0.01, axes)
        assert counts(atlas) == (0, 0, 1)
        assert grid_boundary_euler(grid, (False,) * 3) == -2
        assert atlas.euler_characteristic in (None, -2)

    def test_a_sphere_in_four_dimensions_by_an_equation(self):
        M = Manifold.euclidean("a b c d")
        a, b, c, d = M.symbols
        D = Polyhedron(M, {"lid": 2 - d}, {"s": a**2 + b**2 + c**2 - 1, "h": d - a * b})
        atlas = skeleton(D, [[1, 0, 0, 0]])
        assert (counts(atlas), atlas.euler_characteristic) == ((0, 0, 1), 2)


class TestKissingSpheres:
    """Spheres that touch: their boundary is a chain of spheres, each point of contact a corner."""

    @given(st.lists(st.floats(0.3, 1.2), min_size=2, max_size=3), seeds)
    @few
    def test_a_chain_of_balls_outside_which_one_is(self, radii, seed):
        ends = np.concatenate([[0], 2 * np.cumsum(radii)])
        chain = [
            ball((float(end + r), 0, 0), r, f"ball{k}", inside=False)
            for k, (end, r) in enumerate(zip(ends[:-1], radii, strict=True))
        ]
        middle, wide = float(ends[-1]) / 2, float(ends[-1])
        D = Polyhedron(space(3), AllOf(*chain, ball((middle, 0, 0), wide, "room")))
        atlas = skeleton(D, [[middle, 0.9 * wide, 0]], rng=seed)
        assert counts(atlas) == (len(radii) - 1, 0, len(radii) + 1)
        assert sorted(c.point[0] for c in atlas.corners) == pytest.approx(ends[1:-1], abs=1e-6)
        assert atlas.euler_characteristic == 2 * (len(radii) + 1) - (len(radii) - 1)

    @pytest.mark.parametrize("radius", [0.2, 0.5, 0.9])
    def test_a_ball_that_touches_its_room_from_inside(self, radius):
        inner = ball((1 - radius, 0, 0), radius, "ball", inside=False)
        atlas = skeleton(
            Polyhedron(space(3), AllOf(ball((0, 0, 0), 1, "room"), inner)), [[-0.9, 0, 0]]
        )
        assert (counts(atlas), atlas.euler_characteristic) == ((1, 0, 2), 3)

    def test_three_balls_that_touch_each_other(self):
        centres = [(0, 0, 0), (2, 0, 0), (1, math.sqrt(3), 0)]
        balls = [ball(c, 1, f"ball{k}", inside=False) for k, c in enumerate(centres)]
        D = Polyhedron(space(3), AllOf(*balls, ball((1, 1, 0), 4, "room")))
        atlas = skeleton(D, [[1, 0.5, 2]])
        assert (counts(atlas), atlas.euler_characteristic) == ((3, 0, 4), 5)


class TestTorus:
    @given(st.floats(-1.9, 3).filter(lambda c: min(abs(c - k) for k in (-2, 0, 2)) > 0.1), seeds)
    @few
    def test_levels_of_a_sum_of_cosines_have_the_number_of_the_grid(self, level, seed):
        D = Polyhedron(TORUS, {"f": sp.cos(p) + sp.cos(q) + sp.Float(level)})
        atlas = skeleton(D, [[0.1, 0.2]], rng=seed)
        axis = np.linspace(0, TAU, 240, endpoint=False)
        grid = vertices(lambda u, v: np.cos(u) + np.cos(v) + level >= 0, [axis, axis])
        assert len(atlas.faces) == 1
        assert atlas.euler_characteristic == grid_euler(grid, (True, True))

    @pytest.mark.parametrize(("level", "number"), [(1.40625, -1), (-0.5780451025570352, 1)])
    def test_edges_that_pass_close_to_a_critical_point_of_a_height(self, level, number):
        D = Polyhedron(TORUS, {"f": sp.cos(p) + sp.cos(q) + sp.Float(level)})
        assert skeleton(D, [[0.1, 0.2]], rng=1).euler_characteristic == number

    @pytest.mark.parametrize("constant", [3, 2.5])
    def test_the_whole_torus_is_one_face(self, constant):
        atlas = skeleton(Polyhedron(TORUS, {"f": sp.cos(p) + sp.cos(q) + constant}), [[1, 1]])
        assert (counts(atlas), atlas.euler_characteristic) == ((0, 0, 1), 0)
        assert atlas.faces[0].active == ()
        assert atlas.contacts["f"].least == pytest.approx(constant - 2, abs=1e-6)

    @given(st.lists(st.tuples(st.floats(-3, 3), st.floats(-3, 3)), min_size=1, max_size=3), seeds)
    @few
    def test_holes_in_the_torus(self, centres, seed):
        def apart(a, b):
            return np.linalg.norm(np.mod(np.subtract(a, b) + math.pi, TAU) - math.pi)

        chosen = []
        for c in centres:
            if all(apart(c, d) > 1.4 for d in [*chosen, (0.0, 0.0)]):
                chosen.append(c)
        if not chosen:
            return
        parts = {
            f"h{k}": sp.Float(1.8) - sp.cos(p - a) - sp.cos(q - b)
            for k, (a, b) in enumerate(chosen)
        }
        atlas = skeleton(Polyhedron(TORUS, parts), [[0.0, 0.0]], rng=seed)
        assert counts(atlas) == (0, len(chosen), 1)
        assert atlas.euler_characteristic == -len(chosen)


class TestStartsOutside:
    @given(st.floats(0, TAU), st.floats(1.1, 50), seeds)
    @few
    def test_a_start_outside_is_moved_in_and_named(self, angle, far, seed):
        D = Polyhedron(space(2), AllOf(ball((0, 0), 1, "disc")))
        start = [far * math.cos(angle), far * math.sin(angle)]
        atlas = skeleton(D, [start], rng=seed)
        assert counts(atlas) == (0, 1, 1)
        (note,) = atlas.notes
        assert note.startswith("start 0 lies outside the polyhedron (disc = ")
        assert "moved in" in note

    def test_of_an_empty_set_every_start_is_named(self):
        D = Polyhedron(
            space(2), AllOf(half_space((1, 0), -1, "left"), half_space((-1, 0), -1, "r"))
        )
        atlas = skeleton(D, [[0, 0], [3, 0]])
        assert atlas.complete is Completeness.SEEDS
        assert [note.split(" lies")[0] for note in atlas.notes] == ["start 0", "start 1"]


class TestInterruptions:
    def test_a_search_in_small_steps_and_through_files_finds_the_same(self, tmp_path):
        voids = holes([((0.4, 0.0, 0.1), 0.2), ((-0.5, 0.1, 0.0), 0.15)])
        D = Polyhedron(space(3), AllOf(*box(3), *voids))
        whole = skeleton(D, [[0, 0, 0.7]])
        part = skeleton(D, [[0, 0, 0.7]], budget=Budget(edges=1))
        for k in range(60):
            if part.complete is not Completeness.BUDGET:
                break
            assert part.euler_characteristic is None
            if k % 7 == 0:
                part = load_skeleton(save_skeleton(part, tmp_path / "part.json"))
            part = resume(part, budget=Budget(edges=1))
        assert part.complete is whole.complete is Completeness.EXHAUSTED
        assert counts(part) == counts(whole) == (8, 12, 8)
        assert part.euler_characteristic == whole.euler_characteristic == 6
        assert dict(part.components) == dict(whole.components)

"""Passes that a search finds: published tables, floods of grids, products, and definitions."""

import itertools

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles_search import flooded
from scipy.optimize import minimize

from polycorner import AnyOf, Manifold, Polyhedron, Symmetry, certify
from polycorner.landscapes import search_landscape
from polycorner.landscapes.crossings import crossing_at, sides_of
from polycorner.landscapes.saddles import search_passes
from polycorner.minimisation.problem import pose
from polycorner.models import LennardJones
from polycorner.polyhedra import Element
from polycorner.tolerances import DEFAULT

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
X, Y, Z = SPACE.symbols
SQUARE = [(-2, 2), (-2, 2)]
FRAME = {"left": X + 2, "right": 2 - X, "floor": Y + 2, "lid": 2 - Y}

# The potential of [MB], whose stationary points are published with it.
MULLER_BROWN = ((-200, -1, 0, -10), (-100, -1, 0, -10), (-170, -6.5, 11, -6.5), (15, 0.7, 0.6, 0.7))
CENTRES = ((1, 0), (0, 0.5), (-0.5, 1.5), (-1, 1))
WINDOW = [(-1.5, 1.2), (-0.2, 2.0)]


def muller_brown():
    return sum(
        depth * sp.exp(a * (X - u) ** 2 + b * (X - u) * (Y - v) + c * (Y - v) ** 2)
        for (depth, a, b, c), (u, v) in zip(MULLER_BROWN, CENTRES, strict=True)
    )


def window(**walls):
    (a, b), (c, d) = WINDOW
    frame = {"left": X - sp.Rational(a), "right": sp.Rational(b) - X}
    return Polyhedron(PLANE, {**frame, "floor": Y - sp.Rational(c), "lid": d - Y, **walls})


def merge_heights(landscape):
    return sorted(m.energy[0] for m in landscape.merges)


def flood(polyhedron, energy, box, cells):
    """Return the heights at which components of sublevel sets of a grid merge, and their depths."""
    axes = [np.linspace(*pair, cells) for pair in box]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    heights = pose(polyhedron, energy).energy.value(points)
    heights = np.where(polyhedron.implicit(points) >= 0, heights, np.inf)
    return sorted(
        (float(heights[cell] + depth), float(depth))
        for cell, depth in flooded(heights)
        if np.isfinite(depth)
    )


def assert_flood_agrees(landscape, polyhedron, energy, box, *, cells, error):
    """Merges deeper than the error of a grid are those of the grid, which needs no theory."""
    depths = [landscape.minima[m.ended].energy[0] for m in landscape.merges]
    pairs = zip(landscape.merges, depths, strict=True)
    found = [m.energy[0] for m, low in pairs if m.energy[0] - low > 3 * error]
    seen = [height for height, depth in flood(polyhedron, energy, box, cells) if depth > 3 * error]
    assert sorted(found) == pytest.approx(seen, abs=error)


# ------------------------------------------------------------------------------------- published


def test_muller_brown_has_the_published_minima_and_saddles():
    found = search_landscape(window(), muller_brown(), box=WINDOW, starts=60)
    assert [m.energy[0] for m in found.minima] == pytest.approx(
        [-146.700, -108.167, -80.768], abs=1e-3
    )
    assert [p.energy[0] for p in found.passes] == pytest.approx([-72.249, -40.665], abs=1e-3)
    assert [{s.minimum for s in p.sides} for p in found.passes] == [{1, 2}, {0, 2}]
    assert not found.proved
    assert not found.complete


def test_a_wall_across_a_pass_moves_it():
    energy = muller_brown()
    D = window(pin=(X + 0.6) ** 2 + (Y - 0.5) ** 2 - sp.Rational(1, 25))
    found = search_landscape(D, energy, box=WINDOW, starts=80)
    assert_flood_agrees(found, D, energy, WINDOW, cells=500, error=0.6)
    assert ("pin",) in {p.active for p in found.passes}


# [DW]: minima, saddles of index 1.
STATIONARY = {5: (1, 2), 6: (2, 3), 7: (4, 12)}


@pytest.mark.parametrize(("count", "starts"), [(5, 40), (6, 60), (7, 240)])
def test_clusters_of_atoms_have_the_published_numbers_of_minima_and_saddles(count, starts):
    model, rng = LennardJones(count), np.random.default_rng(1)
    found = search_landscape(
        model.polyhedron,
        model.energy,
        starts=model.starts(rng, starts),
        symmetry=model.symmetry,
        rng=rng,
    )
    assert (len(found.minima), len(found.passes)) == STATIONARY[count]
    low = [m.energy[0] for m in found.minima]
    for p in found.passes:
        values, ways = np.linalg.eigh(second_differences(pair_energy, p.point))
        assert (values < -1e-2).sum() == 1
        assert (abs(values) < 1e-2).sum() == 6
        ends = [
            minimize(pair_energy, p.point + side * 0.02 * ways[:, 0], tol=1e-9).fun
            for side in (1, -1)
        ]
        assert sorted(ends) == pytest.approx(sorted(low[s.minimum] for s in p.sides), abs=1e-5)


def pair_energy(q):
    atoms = np.reshape(q, (-1, 3))
    pairs = itertools.combinations(atoms, 2)
    return sum(4 * (r**-12 - r**-6) for r in (np.linalg.norm(a - b) for a, b in pairs))


def second_differences(f, q, step=1e-4):
    moves = step * np.eye(len(q))
    return np.array(
        [
            [
                (f(q + u + v) - f(q + u - v) - f(q - u + v) + f(q - u - v)) / (4 * step**2)
                for u in moves
            ]
            for v in moves
        ]
    )


# -------------------------------------------------------------------------- floods and products


@given(st.integers(0, 10**6))
@settings(max_examples=6)
def test_wells_among_discs_and_triangles_merge_where_a_grid_is_flooded(seed):
    rng = np.random.default_rng(seed)
    wells = rng.uniform(-1.5, 1.5, (3, 2))
    depths = rng.uniform(0.5, 1.5, 3)
    energy = 0.05 * X + sum(
        -d * sp.exp(-2 * ((X - u) ** 2 + (Y - v) ** 2))
        for d, (u, v) in zip(depths, wells, strict=True)
    )
    parts = {"rim": 4 - X**2 - Y**2}
    u, v = rng.uniform(-1, 1, 2)
    parts["pin"] = (X - u) ** 2 + (Y - v) ** 2 - 0.09
    turn = rng.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * np.arange(3)
    u, v = rng.uniform(-1, 1, 2)
    sides = [(X - u) * np.cos(a) + (Y - v) * np.sin(a) - 0.15 for a in turn]
    parts["triangle"] = AnyOf(*sides)
    D = Polyhedron(PLANE, parts)
    found = search_landscape(D, energy, box=SQUARE, starts=80, rng=seed)
    assert_flood_agrees(found, D, energy, SQUARE, cells=400, error=0.02)


@given(st.integers(0, 10**6))
@settings(max_examples=4)
def test_sums_over_coordinates_have_the_passes_of_their_summands(seed):
    """A point is a pass where one summand has a maximum and the others a minimum."""
    rng = np.random.default_rng(seed)
    summands = rng.uniform([-0.2, -1.9], [0.2, -0.4], (rng.integers(2, 4), 2)).tolist()
    space = Manifold.euclidean([f"x{i}" for i in range(len(summands))])
    walls, energy, kinds = {}, 0, []
    for k, (x, (tilt, wall)) in enumerate(zip(space.symbols, summands, strict=True)):
        energy += (x**2 - 1) ** 2 + tilt * x
        walls[f"w{k}"], walls[f"e{k}"] = x - wall, 2 - x
        line = np.linspace(wall, 2, 100_001)
        height = (line**2 - 1) ** 2 + tilt * line
        up, down = np.append(np.diff(height) > 0, False), np.append(True, np.diff(height) > 0)
        inner = slice(1, -1)
        low = (height[1:-1] < height[:-2]) & (height[1:-1] <= height[2:])
        high = (height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])
        ends = [h for h, first in ((height[0], up[0]), (height[-1], not down[-1])) if first]
        kinds.append(([*height[inner][low], *ends], list(height[inner][high])))
    lows = [sum(c) for c in itertools.product(*(low for low, _ in kinds))]
    passes = [
        sum(c)
        for i in range(len(kinds))
        for c in itertools.product(*(kind[i == j] for j, kind in enumerate(kinds)))
    ]
    found = search_landscape(
        Polyhedron(space, walls), energy, box=[(w, 2) for _, w in summands], starts=100
    )
    assert sorted(m.energy[0] for m in found.minima) == pytest.approx(sorted(lows), abs=1e-6)
    assert sorted(p.energy[0] for p in found.passes) == pytest.approx(sorted(passes), abs=1e-6)
    assert len(found.merges) == len(lows) - 1


# ------------------------------------------------------------------------- contacts and branches


def test_the_tip_of_an_obstacle_is_a_pass_of_the_union():
    over = AnyOf(Y - X / 2 - sp.Rational(3, 10), Y + X - sp.Rational(2, 5))
    D = Polyhedron(PLANE, {"over": over, "floor": Y, "left": X + 3, "right": 3 - X})
    energy = Y + X**2 / 10 + 3 * X / 100
    found = search_landscape(D, energy, box=[(-3, 3), (0, 2)], starts=40)
    (tip,) = found.passes
    assert tip.kind == "tip"
    assert tip.point == pytest.approx([1 / 15, 1 / 3])
    assert {s.minimum for s in tip.sides} == {0, 1}
    assert merge_heights(found) == pytest.approx([1 / 3 + 1 / 2250 + 1 / 500])
    assert certify(D, energy, tip.point).is_minimum is False


@pytest.mark.parametrize(("coupling", "sides"), [(3, 3), (1, 0)])
def test_weak_contacts_make_three_sides_or_none(coupling, sides):
    """Below the corner of three walls lie its edges, joined on the walls or not."""
    D = Polyhedron(SPACE, {"a": X, "b": Y, "c": Z, "ball": 4 - X**2 - Y**2 - Z**2})
    energy = -(X**2) - Y**2 - Z**2 + coupling * (X * Y + Y * Z + Z * X)
    corner = certify(D, energy, [0.0, 0.0, 0.0])
    starts = sides_of(corner.problem, corner)
    assert len(starts) == sides
    if sides:
        assert sorted(int(abs(q).argmax()) for q in starts) == [0, 1, 2]
        found = search_landscape(D, energy, box=[(0, 2)] * 3, starts=60)
        heights = {round(p.energy[0], 9) for p in found.passes if len(p.sides) == 3}
        assert heights == {0}
        assert len(found.minima) == 3
        assert merge_heights(found) == pytest.approx([0, 0])


@pytest.mark.parametrize("weak", [1.0, -1.0])
def test_a_weak_contact_keeps_two_sides_unless_it_opens_downward(weak):
    """``y >= 0`` touches a saddle along ``x``: below, ``x`` changes sign around the wall or not."""
    D = Polyhedron(PLANE, {"wall": Y, **{k: FRAME[k] for k in ("left", "right", "lid")}})
    corner = certify(D, -(X**2) + weak * Y**2, [0.0, 0.0])
    assert len(sides_of(corner.problem, corner)) == (2 if weak > 0 else 0)


@pytest.mark.parametrize(("bends", "sides"), [((1, 2), 2), ((1, -1), 0), ((-1, -2), 0)])
def test_contacts_with_one_gradient_make_a_pass_where_all_let_down(bends, sides):
    walls = {f"w{k}": Y + bend * X**2 for k, bend in enumerate(bends)}
    D = Polyhedron(PLANE, {**walls, **FRAME})
    top = certify(D, Y, [0.0, 0.0])
    starts = sides_of(top.problem, top)
    assert len(starts) == sides
    for q in starts:
        assert D.contains(q, tolerance=1e-8)
        assert q[1] < 0
    assert len(starts) < 2 or starts[0][0] * starts[1][0] < 0


def test_a_negative_multiplier_makes_no_pass():
    D = Polyhedron(PLANE, {"wall": Y, **FRAME})
    assert crossing_at(pose(D, -Y - X**2), np.zeros(2), DEFAULT) is None


def test_sides_lie_in_the_set_and_below():
    D = Polyhedron(PLANE, {**FRAME, "pin": X**2 + Y**2 - 1})
    energy = (X**2 - 1) ** 2 + Y / 4
    problem = pose(D, energy)
    minima = [certify(D, energy, q) for q in ([1.0, -2.0], [-1.0, -2.0])]
    rng = np.random.default_rng(0)
    found = search_passes(problem, minima, starts=60, rng=rng)
    assert found
    for c in found:
        for q in sides_of(problem, c):
            assert D.contains(q, tolerance=1e-8)
            assert problem.energy.value(q) < c.energy


# ------------------------------------------------------------------------------------ landscapes


def quarter_turn(q):
    return np.array([-q[1], q[0]])


def turns(k):
    def apply(q):
        for _ in range(k):
            q = quarter_turn(q)
        return q

    return Element(apply, {})


def test_images_under_a_finite_group_are_listed_as_orbits():
    D = Polyhedron(PLANE, {"disc": 8 - X**2 - Y**2})
    energy = (X**2 - 1) ** 2 + (Y**2 - 1) ** 2
    group = Symmetry(elements=[turns(k) for k in (1, 2, 3)])
    plain, folded = (
        search_landscape(D, energy, box=SQUARE, starts=60, symmetry=s) for s in (None, group)
    )
    for one in (plain, folded):
        assert (len(one.minima), len(one.passes), len(one.merges)) == (4, 4, 3)
        for p in one.passes:
            for s in p.sides:
                assert s.route.vertices[0] == pytest.approx(p.point)
                assert s.route.vertices[-1] == pytest.approx(one.minima[s.minimum].point)
    assert {m.orbit for m in folded.minima} == {p.orbit for p in folded.passes} == {0}
    assert folded.barrier(0, 1).upper == pytest.approx(1.0)


def test_routes_fall_from_the_pass_inside_the_set():
    D = window(pin=(X + 0.6) ** 2 + (Y - 0.5) ** 2 - sp.Rational(1, 25))
    found = search_landscape(D, muller_brown(), box=WINDOW, starts=40)
    for p in found.passes:
        for s in p.sides:
            assert (np.diff(s.route.energies) <= 1e-6).all()
            assert s.route.top == pytest.approx(p.energy[0])
            assert D.contains(s.route.vertices, tolerance=1e-6).all()
            assert not s.verified


def test_nothing_above_a_cap_is_listed():
    found = search_landscape(window(), muller_brown(), box=WINDOW, starts=60, cap=-75)
    assert (len(found.minima), len(found.passes)) == (3, 0)
    found = search_landscape(window(), muller_brown(), box=WINDOW, starts=60, cap=-90)
    assert (len(found.minima), found.cap) == (2, -90)


def test_a_search_that_is_interrupted_returns_what_it_found():
    def stop(done, total, note):
        assert 0 < done <= total
        assert note
        raise KeyboardInterrupt

    found = search_landscape(window(), muller_brown(), box=WINDOW, starts=100, progress=stop)
    assert len(found.minima) == 3


def test_wrong_arguments_are_refused_by_name():
    D, energy = Polyhedron(PLANE, FRAME), X**2 + Y**2
    for name, wrong in (("cap", "high"), ("symmetry", "yes"), ("box", None), ("starts", 0)):
        with pytest.raises((TypeError, ValueError), match=name):
            search_landscape(D, energy, **{"box": SQUARE, name: wrong})

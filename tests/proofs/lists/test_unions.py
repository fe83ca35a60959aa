"""Branches with equations of their own: ``x >= 0`` and ``-x >= 0`` in one branch."""

import itertools

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction, minima
from polycorner.polyhedra.symmetry import Element, Symmetry
from polycorner.proofs import corners, stationary_points

SPACE = Manifold.euclidean("u v w")
U, V, W = SPACE.symbols
PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
LOW, HIGH = -1.0, 2.0  # of w
BOX = [(-3.0, 3.0), (-3.1, 3.2), (-3.3, 3.4)]


def complementary(spelling):
    """``0 <= u``, ``0 <= v``, ``u v = 0`` and ``LOW <= w <= HIGH``, stated in several ways."""
    either = {
        "opposites": AnyOf(AllOf(U, -U), AllOf(V, -V)),
        "multiples": AnyOf(AllOf(2 * U, -3 * U), AllOf(V, -V / 7)),
        "one side": AnyOf(-U, -V),
        "with more": AnyOf(AllOf(-U, V + W + 9), AllOf(-V, U + 9), AllOf(U, -U)),
    }[spelling]
    return Polyhedron(SPACE, {"u": U, "v": V, "c": either, "low": W - LOW, "high": HIGH - W})


def ways(q):
    """Return directions whose cone is the tangent cone of a branch, for each branch, by hand."""
    u, v, w = q
    along_w = ([[0, 0, 1]] if w < HIGH else []) + ([[0, 0, -1]] if w > LOW else [])
    along_u = [[1, 0, 0]] + ([[-1, 0, 0]] if u > 0 else [])
    along_v = [[0, 1, 0]] + ([[0, -1, 0]] if v > 0 else [])
    return (along_u if v == 0 else []) + (along_v if u == 0 else []) + along_w


centres = st.sampled_from([-1.5, -0.5, 0.5, 1.0, 1.5])


@settings(max_examples=10)
@given(
    st.sampled_from(["opposites", "multiples", "one side", "with more"]),
    st.tuples(*[st.tuples(st.sampled_from([-1, 1]), centres)] * 3),
)
def test_lists_of_complementary_coordinates_are_those_of_the_definition(spelling, terms):
    """Signs of a separable quadratic energy's derivative along rays; none of them vanishes."""
    symbols, d = (U, V, W), complementary(spelling)
    energy = sum(s * (x - c) ** 2 / 2 for (s, c), x in zip(terms, symbols, strict=True))
    expected = {}
    sides = [{0.0, terms[0][1]}, {0.0, terms[1][1]}, {LOW, HIGH, terms[2][1]}]
    for q in itertools.product(*sides):
        if min(q[:2]) < 0 or q[0] * q[1] != 0 or not LOW <= q[2] <= HIGH:
            continue
        slope = np.array([s * (x - c) for (s, c), x in zip(terms, q, strict=True)])
        if all(slope @ way >= 0 for way in ways(q)):
            bent = [s < 0 and x == c for (s, c), x in zip(terms, q, strict=True)]
            expected[q] = sum(bent)
    found = stationary_points(d, energy, box=BOX)
    assert found.complete
    got = {tuple((np.round(p.point, 6) + 0.0).tolist()): p for p in found}
    assert got.keys() == expected.keys()
    assert len(got) == len(found)
    for q, index in expected.items():
        assert got[q].is_minimum == (index == 0)
    lowest = stationary_points(d, energy, box=BOX, minima_only=True)
    assert lowest.complete
    assert len(lowest) == sum(index == 0 for index in expected.values())


@pytest.mark.parametrize("spelling", ["opposites", "one side"])
def test_minima_are_found_from_starts_in_a_set_without_interior(spelling):
    energy = (U - 1) ** 2 + (V - 2) ** 2 + (W - 1) ** 2
    found = minima(complementary(spelling), energy, box=BOX, starts=20, rng=0)
    ends = {tuple((np.round(m.point, 6) + 0.0).tolist()) for m in found}
    assert ends == {(0.0, 2.0, 1.0), (1.0, 0.0, 1.0)}


def test_a_point_that_descends_in_another_branch_is_not_listed():
    """The origin is a minimum of one ray, and the energy falls along the other."""
    d = Polyhedron(PLANE, [X, Y, AnyOf(AllOf(X, -X), AllOf(Y, -Y))])
    found = stationary_points(d, 3 * X - Y, box=[(-1, 3), (-1, 2)])
    assert found.complete
    assert len(found) == 0


def test_opposites_that_hold_everywhere_are_an_equation_and_its_multiples_hold():
    d = Polyhedron(PLANE, {"a": X, "b": -2 * X, "c": Y}, [3 * X])
    found = stationary_points(d, (X - 1) ** 2 + (Y - 1) ** 2, box=[(-1, 2), (-1, 2)])
    assert found.complete
    assert [p.point.round(9).tolist() for p in found] == [[0.0, 1.0]]
    (corner,) = corners(Polyhedron(PLANE, [X, -X, Y, -Y]), box=[(-1, 2), (-1, 2)])
    assert abs(corner.point).max() < 1e-9


def test_a_point_whose_place_in_another_branch_is_not_decided_is_open():
    """The origin is stationary in both lines, carried by different functions."""
    d = Polyhedron(PLANE, [AnyOf(AllOf(X, -X), AllOf(Y, -Y))])
    found = stationary_points(d, X**2 - Y**2, box=[(-1, 1.1), (-1, 1.2)])
    assert not found.complete
    assert not found.points
    assert all(abs(p.point).max() < 1e-6 for p in found.open_points)


def test_what_cannot_be_had_is_said(tmp_path):
    d, energy = complementary("opposites"), (U - 1) ** 2 + (V - 1) ** 2 + (W - 1) ** 2
    found = stationary_points(d, energy, box=BOX)
    with pytest.raises(ValueError, match=r"save: expected a list of one polyhedron"):
        found.save(tmp_path / "list.zip")
    swap = Symmetry(elements=[Element(lambda q: q[..., [1, 0, 2]], {})])
    square = [(-3.0, 3.0), (-3.0, 3.0), (-3.0, 3.0)]
    with pytest.raises(ValueError, match=r"symmetry: expected None, as branches"):
        stationary_points(d, energy, box=square, symmetry=swap)


def test_a_search_in_pieces_goes_on_where_it_stood(tmp_path):
    d, energy = complementary("opposites"), (U - 1) ** 2 + (V - 2) ** 2 - (W - 1) ** 2
    whole = stationary_points(d, energy, box=BOX)
    part = stationary_points(d, energy, box=BOX, max_boxes=10, store=tmp_path / "kept")
    assert not part.complete
    again = stationary_points(d, energy, box=BOX, store=tmp_path / "kept")
    assert again.complete
    assert [p.point.tolist() for p in again] == [p.point.tolist() for p in whole]


def test_lists_hold_for_all_values_of_a_parameter():
    """The minima on both axes are (p, 0) and (0, 2), for p from 0.9 to 1.1."""
    p = sympy.Symbol("p")
    energy = SmoothFunction("E", (X - p) ** 2 + (Y - 2) ** 2, PLANE, parameters={"p": 1.0})
    d = Polyhedron(PLANE, [X, Y, AnyOf(-X, -Y)])
    found = stationary_points(d, energy, box=[(-1, 3), (-1, 3)], parameters={"p": (0.9, 1.1)})
    assert found.complete
    assert str(found).count("2 isolated stationary points") == 1
    one, other = sorted(found, key=lambda point: point.upper[0])
    assert np.allclose([one.lower, one.upper], [[0, 2], [0, 2]], atol=1e-6)
    assert other.lower[0] <= 0.9
    assert other.upper[0] >= 1.1
    assert np.allclose([other.lower[1], other.upper[1]], 0, atol=1e-6)


@pytest.mark.parametrize(("centre", "listed"), [(2.0, True), (0.0, False)])
def test_a_locus_is_listed_where_it_misses_the_other_pieces(centre, listed):
    """A line along w, in a half-space, and the plane u = 0, which it meets or does not."""
    d = Polyhedron(SPACE, [AnyOf(U + 1 if centre == 0 else U - 1, AllOf(U, -U))])
    energy = (U - centre) ** 2 + (V - 1) ** 2
    found = stationary_points(d, energy, box=BOX, max_boxes=3000)
    assert not found.complete  # the plane has a line of equilibria
    lines = [(p.lower["u"], p.upper["u"]) for p in found.loci]
    boxes = found.undecided[:, :, 0]
    if listed:
        ((low, high),) = lines
        assert low <= centre <= high
    else:
        assert not lines
        assert ((boxes[:, 0] <= centre) & (centre <= boxes[:, 1])).any()

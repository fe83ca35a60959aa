"""Wrong arguments raise errors of one sentence that names the argument."""

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from polycorner import (
    Manifold,
    Polyhedron,
    SmoothFunction,
    Verdict,
    certify,
    minima,
    minimise,
    sensitivity,
    stationary_on,
)
from polycorner.minimisation import crossing, richness
from polycorner.polyhedra.symmetry import Element, Symmetry

M = Manifold.euclidean("x y")
x, y = M.symbols
D = Polyhedron(M, {"floor": y, "wall": x + 1})
E = x**2 + y
INSIDE = (0.5, 0.5)


def refused(argument, call, *kinds):
    """Call and return the message; it must be one line that starts with the argument's name."""
    with pytest.raises(kinds or (ValueError, TypeError)) as caught:
        call()
    message = str(caught.value)
    assert message.startswith(f"{argument}: "), message
    assert "\n" not in message
    return message


def minimised(**changes):
    arguments = {"polyhedron": D, "energy": E, "start": INSIDE} | changes
    return lambda: minimise(**arguments)


def certified(**changes):
    arguments = {"polyhedron": D, "energy": E, "q": INSIDE} | changes
    return lambda: certify(**arguments)


def on_face(**changes):
    arguments = {"polyhedron": D, "energy": E, "start": INSIDE, "active": ["floor"]} | changes
    return lambda: stationary_on(**arguments)


# What each verb calls its point.
VERBS = {"minimise": (minimised, "start"), "certify": (certified, "q"), "on": (on_face, "start")}
every_verb = pytest.mark.parametrize(("verb", "name"), VERBS.values(), ids=VERBS)
every_call = pytest.mark.parametrize("verb", [verb for verb, _ in VERBS.values()], ids=VERBS)


def test_the_same_calls_with_good_arguments_are_accepted():
    assert minimised()().verdict is Verdict.STRICT_MINIMUM
    assert certified(q=(0, 0))().verdict is Verdict.STRICT_MINIMUM
    assert on_face()().verdict is Verdict.STRICT_MINIMUM
    assert minimised(start={"x": 0.5, "y": 0.5})().is_minimum
    assert minimised(start=np.array([1, 2], dtype=np.float32))().is_minimum
    assert minimised(energy=sp.Integer(3))().verdict is Verdict.MINIMUM_ALONG_LOCUS
    assert minimised(energy=2)().verdict is Verdict.MINIMUM_ALONG_LOCUS


@every_verb
@given(
    position=st.integers(0, 1), bad=st.sampled_from([math.nan, math.inf, -math.inf]), data=st.data()
)
def test_a_point_that_is_not_finite(verb, name, position, bad, data):
    q = data.draw(st.lists(st.floats(-5, 5), min_size=2, max_size=2))
    q[position] = bad
    for given_as in (q, tuple(q), np.array(q), dict(zip("xy", q, strict=True))):
        message = refused(name, verb(**{name: given_as}), ValueError)
        assert str(bad) in message


@every_verb
@given(shape=st.lists(st.integers(0, 4), max_size=3).filter(lambda shape: shape != [2]))
def test_a_point_of_the_wrong_shape(verb, name, shape):
    message = refused(name, verb(**{name: np.zeros(shape)}), ValueError)
    assert str(tuple(shape)) in message


@every_verb
@pytest.mark.parametrize(
    "bad",
    [
        None,
        "ab",
        ["a", "b"],
        [1j, 0],
        [None, 1],
        [[1, 2], [3]],
        [True, False],
        pytest.param(object(), id="object"),
        {"x": "a", "y": 1},
        np.array(["2020", "2021"], dtype="M8[Y]"),
    ],
    ids=repr,
)
def test_a_point_of_the_wrong_kind(verb, name, bad):
    refused(name, verb(**{name: bad}))


@every_verb
@pytest.mark.parametrize(
    "bad", [{"x": 1.0}, {"x": 1.0, "z": 2.0}, {"x": 1.0, "y": 2.0, "z": 3.0}, {}]
)
def test_a_point_with_the_wrong_names(verb, name, bad):
    assert "x, y" in refused(name, verb(**{name: bad}), ValueError)


@every_call
@pytest.mark.parametrize("bad", [None, "D", [y], {"floor": y}, y, M, Polyhedron], ids=repr)
def test_a_polyhedron_of_the_wrong_type(verb, bad):
    message = refused("polyhedron", verb(polyhedron=bad), TypeError)
    assert type(bad).__name__ in message


@every_call
@pytest.mark.parametrize(
    "bad",
    ["x + y", None, [x], (x, y), {"E": x}, np.array([x, y]), sp.Matrix([x]), x > 0, True, len, D],
    ids=repr,
)
def test_an_energy_of_the_wrong_type(verb, bad):
    refused("energy", verb(energy=bad), TypeError)


@every_call
def test_an_energy_on_another_manifold(verb):
    other = Manifold.euclidean("u v")
    u, v = other.symbols
    message = refused("energy", verb(energy=SmoothFunction("E", u + v, other)), ValueError)
    assert "u, v" in message
    assert "x, y" in message
    scaled = Manifold.euclidean("x y", scale=2.0)
    refused("energy", verb(energy=SmoothFunction("E", x, scaled)), ValueError)


@every_call
def test_an_unknown_symbol_in_the_energy(verb):
    assert "w" in refused("energy", verb(energy=x + sp.Symbol("w")), ValueError)


@every_call
@pytest.mark.parametrize(
    "bad",
    [sp.gamma(x), sp.Function("f")(x), sp.I * x, sp.nan, sp.oo, sp.zoo, float("nan")],
    ids=repr,
)
def test_an_energy_that_cannot_be_compiled(verb, bad):
    refused("energy", verb(energy=bad))


@every_call
@pytest.mark.parametrize("argument", ["tolerance", "rank_tolerance"])
@given(bad=st.one_of(st.floats(max_value=0), st.floats(min_value=1), st.just(math.nan)))
def test_a_tolerance_out_of_range(verb, argument, bad):
    refused(argument, verb(**{argument: bad}), ValueError)


@every_call
@pytest.mark.parametrize("argument", ["tolerance", "rank_tolerance"])
@pytest.mark.parametrize("bad", [None, "1e-8", 1e-8j, [1e-8], True], ids=repr)
def test_a_tolerance_of_the_wrong_type(verb, argument, bad):
    refused(argument, verb(**{argument: bad}))


@given(st.text(max_size=8).filter(lambda method: method not in ("newton", "slsqp", "scp")))
def test_an_unknown_method(method):
    message = refused("method", minimised(method=method), ValueError)
    assert all(known in message for known in ("newton", "slsqp", "scp"))


@pytest.mark.parametrize("bad", [None, 3, ["newton"], {"newton"}, np.array(["newton"])], ids=repr)
def test_a_method_of_the_wrong_type(bad):
    refused("method", minimised(method=bad))


@pytest.mark.parametrize("bad", [0, -1, 2.5, "10", None, True, math.inf], ids=repr)
def test_a_limit_that_counts_nothing(bad):
    refused("max_iterations", minimised(max_iterations=bad))


def test_a_limit_may_be_any_whole_number():
    assert minimised(max_iterations=np.int64(50))().is_minimum


@pytest.mark.parametrize(
    "bad", [["roof"], ["floor", "roof"], ["Floor"], [""], [0], [None], None, 3, y, [y]], ids=repr
)
def test_an_unknown_face(bad):
    refused("active", on_face(active=bad))


def test_a_bare_string_is_no_list_of_faces():
    letters = Polyhedron(M, {"a": y, "b": x})
    with pytest.raises((TypeError, ValueError), match=r"^active: "):
        stationary_on(letters, E, INSIDE, active="ab")


@pytest.mark.parametrize("method", ["newton", "slsqp", "scp"])
@pytest.mark.parametrize("energy", [sp.log(x), 1 / x, sp.sqrt(x - 1)], ids=str)
def test_an_energy_that_is_not_finite_at_the_start(method, energy):
    start = (0.0, 0.5)
    refused("start", minimised(energy=energy, start=start, method=method), ValueError)


@pytest.mark.parametrize("energy", [sp.log(x), 1 / x, sp.sqrt(x - 1)], ids=str)
def test_an_energy_that_is_not_finite_at_the_point(energy):
    assert D.contains((0.0, 0.5))
    refused("q", certified(energy=energy, q=(0.0, 0.5)), ValueError)
    refused("start", on_face(energy=energy, start=(0.0, 0.5)), ValueError)


# ------------------------------------------------------------------------------ the other verbs

a, w = sp.symbols("a w")


def with_parameters(**values):
    """Return a minimum on a floor and a wall, whose levels are parameters."""
    given = {"a": 0.0, "wall": 0.0} | values
    floor = SmoothFunction("floor", y - a, M, parameters={"a": given["a"]})
    wall = SmoothFunction("wall", x - w, M, parameters={"w": given["wall"]})
    return minimise(Polyhedron(M, [floor, wall]), x + 2 * y, [2.0, 1.0])


def free_along_x():
    floor = SmoothFunction("floor", y - a, M, parameters={"a": 0.0})
    return sensitivity(minimise(Polyhedron(M, floor), y, [0.3, 1.0]), ["a"])


def same_name_twice():
    parts = [
        SmoothFunction("floor", y - a, M, parameters={"a": 0.0}),
        SmoothFunction("wall", x - a, M, parameters={"a": 1.0}),
    ]
    return minimise(Polyhedron(M, parts), x + 2 * y, [2.0, 1.0])


def searched(**changes):
    arguments = {"polyhedron": D, "energy": E, "starts": 5, "box": [(0, 1), (0, 1)]} | changes
    return lambda: minima(**arguments)


def turned():
    turn = Symmetry(tangents=lambda q: np.array([[-q[1], q[0]]]))
    return minima(D, y, starts=[[0.3, 0.2]], symmetry=turn)


def mirrored():
    mirror = Symmetry(elements=[Element(lambda q: -q, {})])
    return minima(D, y, starts=[[0.3, 0.2]], symmetry=mirror)


# call, exception, argument named
REFUSED = [
    (lambda: sensitivity(D), TypeError, "certificate"),
    (lambda: sensitivity(with_parameters(), ["length"]), ValueError, "parameters"),
    (lambda: sensitivity(with_parameters(), "a"), TypeError, "parameters"),
    (lambda: sensitivity(with_parameters(), {"a": 1.0}), TypeError, "parameters"),
    (lambda: sensitivity(with_parameters(), []), ValueError, "parameters"),
    (lambda: sensitivity(same_name_twice(), ["a"]), ValueError, "parameters"),
    (lambda: sensitivity(with_parameters(), ["a"]).predict({"w": 1}), ValueError, "changes"),
    (lambda: free_along_x().of("x"), ValueError, "quantity"),
    (lambda: free_along_x().of("z"), ValueError, "quantity"),
    (
        lambda: free_along_x().of(SmoothFunction("f", sp.Symbol("u"), Manifold.euclidean("u"))),
        ValueError,
        "quantity",
    ),
    (lambda: free_along_x().of(sp.Symbol("v")), ValueError, "quantity"),
    (lambda: crossing(with_parameters(), "roof", "a"), ValueError, "contact"),
    (lambda: crossing(with_parameters(), "floor", "b"), ValueError, "parameters"),
    (searched(polyhedron=3), TypeError, "polyhedron"),
    (searched(energy=[]), TypeError, "energy"),
    (searched(starts=0), ValueError, "starts"),
    (searched(starts=True), TypeError, "starts"),
    (searched(starts="ab", box=None), TypeError, "starts"),
    (searched(starts=[[1.0, 2, 3]], box=None), ValueError, "starts"),
    (searched(starts=np.zeros((0, 2)), box=None), ValueError, "starts"),
    (searched(starts=[[0, np.nan]], box=None), ValueError, "starts"),
    (searched(starts=[[1, 0], [-1, 0]], box=None, energy=sp.sqrt(x)), ValueError, "starts"),
    (searched(starts=[[0, 0]]), ValueError, "box"),
    (searched(box=None), ValueError, "box"),
    (searched(box=[(0, 1)]), ValueError, "box"),
    (searched(box=5), ValueError, "box"),
    (searched(box=[(0, 1), (1, 0)]), ValueError, "box"),
    (searched(box=[(0, 1), (0, np.inf)]), ValueError, "box"),
    (searched(box=[(-5, -4), (0, 1)]), ValueError, "box"),
    (searched(rng="a"), TypeError, "rng"),
    (searched(rng=-1), ValueError, "rng"),
    (searched(symmetry=3), TypeError, "symmetry"),
    (turned, ValueError, "symmetry"),
    (mirrored, ValueError, "symmetry"),
    (searched(progress=3), TypeError, "progress"),
    (searched(tolerance=2), ValueError, "tolerance"),
    (lambda: richness([3, 0]), ValueError, "counts"),
    (lambda: richness([-1]), ValueError, "counts"),
    (lambda: richness([1.5]), TypeError, "counts"),
    (lambda: richness([True]), TypeError, "counts"),
    (lambda: richness(["2"]), TypeError, "counts"),
]


@pytest.mark.parametrize(("call", "kind", "argument"), REFUSED)
def test_wrong_arguments_are_named(call, kind, argument):
    refused(argument, call, kind)


@pytest.mark.parametrize("starts", [2.5, -1.0, math.nan])
def test_a_number_of_starts_is_whole(starts):
    with pytest.raises(TypeError, match="starts: expected a whole number >= 1; got"):
        minima(D, E, starts=starts)

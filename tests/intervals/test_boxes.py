"""Compiled enclosures on boxes: containment of exact values, branches, observed orders."""

import ctypes
import math
import platform

import numpy as np
import pytest
import sympy as sp
from enclosing import BITS, inside, missed, point
from hypothesis import given
from hypothesis import strategies as st
from strategies import smooth_expressions

from polycorner import Manifold, SmoothFunction
from polycorner.dumbbells import DumbbellPair
from polycorner.formulas.families import Family
from polycorner.formulas.interval_kernels import best_rounding
from polycorner.intervals.balls import between, bounds, precision
from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Formulas
from polycorner.intervals.tapes import Box
from polycorner.models import SphereCluster, TorusDisks

pytestmark = pytest.mark.filterwarnings("ignore::polycorner.errors.NonsmoothWarning")

M2 = Manifold.euclidean("x y")
x, y = M2.symbols
KINDS = ["stepped"] if best_rounding() == "stepped" else ["stepped", "embedded"]
SIZES = {"length": 16, "ball_radius": 3, "rod_radius": 1.5}


def functions(*expressions, manifold=M2):
    return [SmoothFunction(f"f{k}", e, manifold) for k, e in enumerate(expressions)]


def compiled(*expressions, **options):
    return BoxFunctions(functions(*expressions), M2, **options)


def boxes(rng, count, reach):
    """Return boxes of many widths about points within ``reach`` of the origin."""
    reach = np.asarray(reach, dtype=float)
    middle = rng.uniform(-1, 1, (count, len(reach))) * reach
    half = reach * 10.0 ** rng.uniform(-17, 0, (count, 1))
    lo, hi = middle - half, middle + half
    hi[::5] = lo[::5]
    hi[1::5] = np.nextafter(lo[1::5], np.inf)
    return lo, hi


def pair(radius):
    model = DumbbellPair(**SIZES, drum_radius=radius)
    turn = 10 if radius == math.inf else 10 / radius
    return [*model.polyhedron.functions, model.energy], model.manifold, [turn, 10, 4] * 2


def cluster():
    model = SphereCluster(4)
    return [*model.polyhedron.functions], model.manifold, [1.5] * model.manifold.dimension


def torus():
    model = TorusDisks(3)
    n = model.manifold.dimension
    return [*model.polyhedron.functions, model.energy], model.manifold, [1.0] * n


MODELS = {
    "plane": lambda: pair(math.inf),
    "drum": lambda: pair(125.0),
    "spheres": cluster,
    "disks on a torus": torus,
}


@pytest.mark.parametrize(
    ("model", "kind"),
    [(model, kind) for model in MODELS for kind in KINDS],
)
def test_functions_of_the_library_lie_in_their_enclosures(model, kind):
    members, manifold, reach = MODELS[model]()
    rng = np.random.default_rng(3)
    lo, hi = boxes(rng, 40, reach)
    found = BoxFunctions(members, manifold, rounding=kind).hessians(lo, hi)
    assert not any(np.isnan(bound).any() for bound in found)
    assert np.isfinite(found[0]).mean() > 0.6
    assert missed(members, manifold, found, inside(rng, lo, hi)) == []


@given(smooth_expressions([x, y]), st.integers(0, 2**32 - 1))
def test_random_formulas_lie_in_their_enclosures(expression, seed):
    rng = np.random.default_rng(seed)
    lo, hi = boxes(rng, 4, [2, 2])
    members = functions(expression)
    found = BoxFunctions(members, M2, rounding=KINDS[seed % len(KINDS)]).hessians(lo, hi)
    assert not any(np.isnan(bound).any() for bound in found)
    assert missed(members, M2, found, inside(rng, lo, hi)) == []
    sharper = BoxFunctions(members, M2).mean_value_gradients(lo, hi)
    assert missed(members, M2, (*found[:2], *sharper), inside(rng, lo, hi)) == []


def test_small_boxes_are_enclosed_about_as_tightly_as_in_ball_arithmetic():
    members, manifold, reach = pair(125.0)
    rng = np.random.default_rng(5)
    middle = rng.uniform(-1, 1, (30, 6)) * reach
    lo, hi = middle - 1e-4 * np.array(reach), middle + 1e-4 * np.array(reach)
    low, high = BoxFunctions(members, manifold).values(lo, hi)
    formulas = Formulas(members, manifold)
    for i in range(len(lo)):
        with precision(BITS):
            box = Box([between(*side) for side in zip(lo[i], hi[i], strict=True)])
            for j, value in enumerate(formulas.values(box, range(len(members)))):
                if value.is_finite():
                    below, above = bounds(value)
                    assert high[i, j] - low[i, j] <= 1.001 * float(above - below) + 1e-12


BRANCHES = [
    sp.Min(x, y, x * y),
    sp.Max(sp.sin(x), y**2) - sp.Min(x, 0),
    sp.Abs(x - y) * sp.cos(x),
    sp.Piecewise((0, x <= 0), (1, x >= 1), (x, True)),
    sp.Piecewise((x**2, x < y), (x * y, True)),
    sp.Piecewise((1 / x, x > sp.Rational(1, 2)), (x + y, sp.And(y > 0, x < 0)), (2 * y, True)),
    sp.Piecewise((x, sp.Or(x < 0, sp.Not(y < 0))), (-x, True)),
]


@pytest.mark.parametrize("expression", BRANCHES, ids=str)
def test_branches_are_enclosed(expression):
    rng = np.random.default_rng(2)
    lo, hi = boxes(rng, 60, [1.5, 1.5])
    members = functions(expression)
    F = BoxFunctions(members, M2)
    assert missed(members, M2, F.hessians(lo, hi), inside(rng, lo, hi)) == []
    for form in ("mean_value", "monotone"):
        found = F.gradients(lo, hi, **{form: True})
        for _ in range(4):
            assert missed(members, M2, found[:2], inside(rng, lo, hi)) == []
    sharper = F.mean_value_gradients(lo, hi)
    for _ in range(4):
        assert missed(members, M2, (*found[:2], *sharper), inside(rng, lo, hi)) == []


def test_continuous_patterns_are_sharp_and_known_to_be_continuous():
    lo, hi = np.array([[-1.0, 2.0]]), np.array([[3.0, 4.0]])
    kinks = [sp.Min(x, y), sp.Max(x, y), sp.Abs(x), BRANCHES[3], -sp.Abs(x)]
    low, high = compiled(*kinks).values(lo, hi)
    assert low.tolist() == [[-1, 2, 0, 0, -3]]
    assert high.tolist() == [[3, 4, 3, 1, 0]]
    jump = sp.Piecewise((0, x < y), (1, True))
    F = compiled(*kinks, jump, sp.atan2(y - 3, x), 1 / x, sp.sqrt(y))
    assert F.continuous(lo, hi).tolist() == [[True] * 5 + [False] * 3 + [True]]
    apart = np.array([[0.5, 4.5]]), np.array([[1.0, 5.0]])
    assert F.continuous(*apart).all()
    assert F.values(*apart)[0][0, 5] == F.values(*apart)[1][0, 5] == 0


def test_mean_value_gradients_are_narrow_where_they_are_smooth_and_the_natural_ones_elsewhere():
    cubic, kink, line = (x - y) ** 3 - 3 * (x - y), sp.Abs(x) * y, sp.Integer(2) + y
    F = compiled(cubic, kink, line)
    lo, hi = np.array([[0.9, 0.1], [-1.0, 0.1]]), np.array([[1.1, 0.2], [2.0, 0.2]])
    *_, low, high = F.gradients(lo, hi)
    found, above = F.mean_value_gradients(lo, hi)
    assert (found >= low).all()
    assert (above <= high).all()
    # at the middle 3 u^2 - 3 with u = 0.85; on the box |6 u| <= 6, sides are 0.2 and 0.1
    assert above[0, 0, 0] - found[0, 0, 0] <= 6 * 0.3 + 1e-9
    assert found[1, 1].tolist() == low[1, 1].tolist()  # the kink is on this box
    assert above[1, 1].tolist() == high[1, 1].tolist()
    assert found[:, 2].tolist() == above[:, 2].tolist() == [[0, 1]] * 2
    assert compiled(sp.Integer(3)).mean_value_gradients(lo, hi)[0].tolist() == [[[0, 0]]] * 2


def test_mean_value_gradients_approach_the_range_with_the_square_of_the_width():
    f, middle, excess = sp.sin(3 * x * y) * x, np.array([[0.4, 0.7]]), []
    unit = np.stack(np.meshgrid(*[np.linspace(-1, 1, 41)] * 2), axis=-1).reshape(-1, 2)
    for width in (0.02, 0.01, 0.005):
        low, high = compiled(f).mean_value_gradients(middle - width, middle + width)
        slopes = functions(f)[0].gradient(middle + width * unit)
        excess.append(float((high - low - np.ptp(slopes, axis=0)).max()))
    assert excess[0] > 3 * excess[1] > 9 * excess[2] > 0


def test_gradients_where_no_branch_is_decided_contain_those_of_both_sides():
    lo, hi = np.full((1, 2), -1.0), np.full((1, 2), 2.0)
    *_, low, high = compiled(sp.Abs(x) + 2 * y, sp.Max(3 * x, y)).gradients(lo, hi)
    assert low.tolist() == [[[-1, 2], [0, 0]]]
    assert high.tolist() == [[[1, 2], [3, 1]]]


def test_what_is_undefined_has_infinite_bounds():
    F = compiled(sp.log(x), sp.sqrt(x - 1), 1 / (x * y), sp.exp(1000 * y), x + y)
    for lo, hi in [([-1, -1], [1, 1]), ([0, -(2.0**100)], [0.5, 2.0**100]), ([1, 1], [-1, -1])]:
        low, high = F.values([lo], [hi])
        assert np.all(low[:, :4] == -np.inf)
        assert np.all(high[:, :4] == np.inf)


def test_powers_are_enclosed_as_squares():
    lo, hi = np.array([[-1.0, -2.0]]), np.array([[2.0, 1.0]])
    low, high = compiled(x**2, x**4, x**2 + y**2).values(lo, hi)
    assert np.allclose(low, [[0, 0, 0]], rtol=0, atol=1e-300)
    assert np.allclose(high, [[4, 16, 8]])


def test_what_is_stationary_is_held_in_first_derivatives_only():
    """``f = t^2 - t x - t y`` is least over ``t`` at ``t = (x + y)/2``, where ``f_x = -t``."""
    t = sp.Symbol("t")
    written = {"f": t**2 - t * x - t * y}, ("x", "y"), (), {"t": (x + y) / 2}
    widths = []
    for held in ((), ("t",)):
        member = SmoothFunction.member(Family.of(*written, stationary=held), "f", M2)
        F = BoxFunctions([member], M2)
        *_, low, high = F.gradients([[0.0, 0.0]], [[1.0, 1.0]])
        assert np.all(low <= -1)
        assert np.all(high >= 0)
        widths.append((high - low).max())
        *_, below, above = F.hessians([[0.0, 0.0]], [[1.0, 1.0]])
        assert np.all(below <= -0.5)
        assert np.all(above >= -0.5)
    assert np.allclose(widths, [3, 1])


@pytest.mark.parametrize(("options", "order"), [({}, 1), ({"mean_value": True}, 2)])
def test_excess_width_falls_with_the_width_of_the_box(options, order):
    f = (x**2 + y) * sp.sin(x - y) / (2 + sp.cos(x))
    F, widths = compiled(f), 10.0 ** -np.arange(2.0, 5.0)
    excess = [excess_width(F, width, **options) for width in widths]
    slopes = np.diff(np.log(excess)) / np.diff(np.log(widths))
    assert np.all(slopes >= order - 0.15), slopes


def test_functions_with_monotone_enclosures_have_no_excess_width():
    f = (x**2 + y) * sp.exp(x - y / 4) / (3 - x)
    assert excess_width(compiled(f), 0.1, monotone=True) <= 1e-14


def excess_width(F, width, **options):
    """Return by how much an enclosure on a box about (0.3, 0.4) is wider than what it encloses."""
    q = np.array([0.3, 0.4])
    low, high = F.gradients([q - width], [q + width], **options)[:2]
    side = np.linspace(-width, width, 101)
    values = F.functions[0].value(np.stack(np.meshgrid(*(q[:, None] + side)), -1))
    return (high - low).item() - (values.max() - values.min())


@pytest.mark.parametrize("model", MODELS)
def test_forms_contain_values_and_are_never_wider(model):
    members, manifold, reach = MODELS[model]()
    rng = np.random.default_rng(11)
    lo, hi = boxes(rng, 60, reach)
    F = BoxFunctions(members, manifold)
    low, high = F.values(lo, hi)
    for form in ("mean_value", "monotone"):
        found = F.gradients(lo, hi, **{form: True})
        assert np.all(low <= found[0])
        assert np.all(found[1] <= high)
        assert missed(members, manifold, found[:2], inside(rng, lo, hi)) == []


def test_levels_agree_and_batches_of_any_length_do():
    members, manifold, reach = pair(math.inf)
    lo, hi = boxes(np.random.default_rng(1), 21, reach)
    F = BoxFunctions(members, manifold)
    values, gradients, hessians = F.values(lo, hi), F.gradients(lo, hi), F.hessians(lo, hi)
    assert all(map(np.array_equal, values, gradients[:2]))
    assert all(map(np.array_equal, gradients, hessians[:4]))
    assert all(np.array_equal(h, h.swapaxes(2, 3)) for h in hessians[4:])
    for count in (0, 1, 8, 9):
        part = F.gradients(lo[:count], hi[:count])
        assert all(map(np.array_equal, part, [g[:count] for g in gradients]))
    assert F.names == tuple(f.name for f in members)
    assert F.dimension == 6


def test_exact_constants_and_degenerate_boxes():
    tenth = SmoothFunction("f", sp.Symbol("a") * x + sp.pi, M2, parameters={"a": 0.1})
    q = np.array([[3.0, 0.0]])
    found = BoxFunctions([tenth], M2).values(q, q)
    with precision(BITS):
        (value,) = Formulas([tenth], M2).values(point(q[0]), [0])
        below, above = bounds(value)
    assert found[0].item() <= below <= above <= found[1].item()
    assert found[1].item() - found[0].item() < 1e-14


def test_wrong_arguments_are_refused():
    F = compiled(x)
    with pytest.raises(ValueError, match="lo, hi"):
        F.values(np.zeros(2), np.zeros(2))
    with pytest.raises(ValueError, match="lo, hi"):
        F.values(np.zeros((3, 1)), np.zeros((3, 1)))
    with pytest.raises(ValueError, match="mean_value, monotone"):
        F.gradients(np.zeros((1, 2)), np.zeros((1, 2)), mean_value=True, monotone=True)
    with pytest.raises(TypeError, match="manifold"):
        BoxFunctions([], "M")


@pytest.mark.skipif(platform.machine() != "x86_64", reason="rounding modes are numbered otherwise")
def test_another_rounding_mode_is_refused():
    F, library = compiled(x), ctypes.CDLL(None)
    for mode in (0x400, 0x800, 0xC00):
        library.fesetround(mode)
        try:
            with pytest.raises(RuntimeError, match="does not round to nearest"):
                F.values([[0.0, 0.0]], [[1.0, 1.0]])
        finally:
            library.fesetround(0)

"""Points that redundant functions hold to first order."""

import numpy as np
import pytest
import sympy
from hypothesis import settings
from proof_files import described, parts_of, rewritten
from scipy.optimize import nnls

from benchmarks.trials.falsified import verified
from benchmarks.trials.torus_discs import several_discs
from polycorner import Manifold, Polyhedron
from polycorner.proofs import stationary_points
from polycorner.proofs.lists.pinned import Pinned
from polycorner.proofs.lists.records import region_from

PLANE = Manifold.euclidean("x y")
X, Y = PLANE.symbols
FAN = Polyhedron(PLANE, [Y, Y - X, Y + X])
SIDES = [(-1, 1), (-1, 1)]


def pins(found, tmp_path):
    """The boxes around points that are held to first order, as saved."""
    regions = described(found.save(tmp_path / "list.zip"))["regions"]
    return [r for r in map(region_from, regions) if isinstance(r, Pinned)]


@pytest.mark.parametrize("bend", [1, 100, 10**5])
def test_a_box_ends_before_the_next_stationary_points(bend, tmp_path):
    """There is a saddle on each of two sides: along ``y = x`` the energy is ``x - bend x^2``."""
    found = stationary_points(FAN, Y - bend * X**2, box=SIDES)
    assert found.complete
    points = sorted((*p.point.tolist(), p.index) for p in found)
    far = 1 / (2 * bend)
    np.testing.assert_allclose(points, [(-far, far, 1), (0, 0, 0), (far, far, 1)], atol=1e-12)
    (pin,) = pins(found, tmp_path)
    assert len(pin.active) == 3
    assert 0.01 * far < pin.upper[0] < far
    assert not verified(tmp_path / "list.zip")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"lower": [-0.1, -0.1], "upper": [0.1, 0.1]}, "not held"),
        ({"into": [0.0, 0.0]}, "no direction"),
        ({"into": [2.0, 1.0]}, "no direction"),
        ({"steps": [1.01] * 4}, "a negative weight"),
        ({"steps": [-1.0] * 4}, "the numbers"),
        ({"weights": [1.0] * 4}, "the numbers"),
        ({"lower": [0.001, -0.001]}, "elsewhere"),
        ({"active": [0, 1, 2, 3]}, "active"),
        ({"corner": [0]}, "the functions"),
        ({"active": [0, 1], "weights": [0.5] * 8}, "region of"),
        ({"index": 1}, "the index is 0"),
        ({"sharp_lower": [0.1] * 5, "sharp_upper": [0.2] * 5}, "no single common zero"),
    ],
)
def test_falsified_boxes_are_refused(change, said, tmp_path):
    d = Polyhedron(PLANE, [Y, Y - X, Y + X, Y + 1])
    path = stationary_points(d, Y - 10 * X**2, box=SIDES).save(tmp_path / "list.zip")
    assert not verified(path)
    data = described(path)
    (region,) = (r for r in data["regions"] if "corner" in r)
    for name, value in change.items():
        numbers = isinstance(value, list) and isinstance(value[0], float)
        region[name] = [x.hex() for x in value] if numbers else value
    assert said in verified(rewritten(path, data, parts_of(path)))


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_origin_is_at_rest_where_its_contacts_carry_the_energy(dimension, tmp_path):
    """Random contacts at the origin, often more than one with the same few gradients.

    It is stationary if and only if the energy's gradient is a combination of theirs without
    negative weights.  In the boxes around points that are held, the energy decreases towards these
    from every point of the set.
    """
    M = Manifold.euclidean([f"x{i}" for i in range(dimension)])
    rng = np.random.default_rng(dimension)
    complete, held = set(), 0
    for _ in range(max(10, settings.default.max_examples // 50)):
        gradients = rng.integers(-2, 3, (dimension + rng.integers(1, 4), dimension))
        gradients[:, -1] = rng.integers(1, 3, len(gradients))  # they all increase along the last
        weights = rng.integers(0, 3, len(gradients)) * rng.integers(0, 2, len(gradients))
        force = weights @ gradients if rng.random() < 0.7 else rng.integers(-1, 3, dimension)
        bends = rng.integers(-1, 2, (len(gradients) + 1, dimension, dimension))
        q = np.array(M.symbols)
        f = [g @ q + q @ h @ q for g, h in zip(gradients, bends, strict=False)]
        d, energy = Polyhedron(M, f), force @ q + q @ bends[-1] @ q
        if not force.any():
            continue
        box = [(-0.25, 0.25)] * dimension
        found = stationary_points(d, energy, box=box, resolution=1e-3, max_boxes=1500)
        rests = nnls(gradients.T.astype(float), force.astype(float))[1] < 1e-9
        listed = [p for p in found if abs(p.point).max() < 1e-9]
        assert rests or not listed
        if found.complete:
            assert len(listed) == rests
            complete.add(rests)
        for pin in pins(found, tmp_path):
            held += 1
            p = 0.5 * (pin.sharp_lower + pin.sharp_upper)[:dimension]
            x = rng.uniform(pin.lower, pin.upper, (2000, dimension))
            inside = x[np.all([f.value(x) >= 0 for f in d.functions], axis=0)]
            assert len(inside)
            assert np.all(np.sum(d_energy(energy, M, inside) * (p - inside), axis=1) < 0)
            assert not verified(tmp_path / "list.zip")
    assert complete == {True, False}
    assert held > 2


def d_energy(energy, manifold, x):
    """The gradient of an energy at some points."""
    slopes = [sympy.lambdify([manifold.symbols], sympy.diff(energy, u)) for u in manifold.symbols]
    return np.array([[float(slope(point)) for slope in slopes] for point in x]).reshape(x.shape)


def test_threads_and_interruptions_change_nothing(tmp_path):
    """Two discs on the square torus: four contacts hold the densest placement."""
    d, energy, box = several_discs(2, "square", (0.2, 0.6))

    def saved(name, **options):
        found = stationary_points(d, energy, box=box, **options)
        return found, found.save(tmp_path / name).read_bytes()

    whole, proof = saved("whole.zip")
    assert whole.complete
    assert len(pins(whole, tmp_path)) == 1
    assert saved("threads.zip", workers=2)[1] == proof
    store = tmp_path / "store"
    part, _ = saved("part.zip", store=store, max_boxes=whole.tally.boxes // 2)
    assert not part.complete
    assert len(pins(part, tmp_path)) == 1
    assert saved("resumed.zip", store=store)[1] == proof

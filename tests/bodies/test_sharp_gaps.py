"""The compiled gaps and slips of sharp hulls, against distances and motions from definitions."""

import ctypes
from functools import cache

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from polycorner.bodies import Arrangement, HalfSpace, polygon, polytope
from tests.support.hulls import margin

SEEDS = range(4)
D = (2, 3)


@cache
def several(d, seed):
    """Two bodies like a random hull, far above a floor, with friction."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((6, d)) * rng.uniform(0.5, 1.5, d)
    points = points[ConvexHull(points).vertices]
    # The origin inside, but not at the centre.
    body = (polygon if d == 2 else polytope)(points - points.mean(axis=0) * 0.8 - points[0] * 0.2)
    low = {"floor": HalfSpace(np.eye(d)[-1], -100 * np.eye(d)[-1])}
    a = Arrangement({"A": body}, low, orientations="all")
    return a, a.system(count=2, friction=0.3)


def placed(a, rng, *away):
    """Two placements, the second so many sizes away, or a number of sizes in a range."""
    d, way = a.dimension, rng.normal(size=a.dimension)
    way *= rng.uniform(*away) * a.named["A"].size / np.linalg.norm(way)
    turns = [rng.uniform(0, 6) if d == 2 else Rotation.random(random_state=rng) for _ in range(2)]
    return np.array([a.point({"A": (k * way, turn)}) for k, turn in enumerate(turns)])


def apart(a, q):
    """The distance of two bodies, or minus the radius of the largest ball in both."""
    one, two = (a.placed(x)["A"].parts[""] for x in q)
    return margin(one, two)


class Contacts:
    """What the kernels say of two bodies."""

    def __init__(self, system):
        contacts = system.bodies.contacts
        self.gaps, self.names = contacts.gaps.kernel, contacts.gaps.names
        numbers, entries = [*contacts.parameters], contacts.slips
        self.table = len(numbers)
        for _, _, values in entries:
            numbers += values
        self.slip = entries[0][0].kernel
        self.numbers = np.array(numbers)

    def values(self, q):
        return self.gaps.at(q.ravel(), self.numbers.ctypes.data)[0]

    def gradients(self, q):
        """Gaps, infinite where there is no contact, and gradients."""
        return self.called(self.gaps.compiled(1), q, 0, len(self.names), q.size)

    def slips(self, q, v, g):
        at, d = np.concatenate([q.ravel(), v.ravel()]), q.shape[1]
        entry, rows = self.table + 2 * g, 2 if d == 7 else 1
        return self.called(self.slip.compiled(1), at, entry, rows, at.size)

    def called(self, code, at, first, rows, columns, told=None):
        """What a kernel writes, which is told numbers and may keep some there."""
        f, J = np.zeros(rows), np.zeros((rows, columns))
        call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 5)(code.point)
        at = np.ascontiguousarray(at, dtype=np.float64).ravel()
        further = None if told is None else told.ctypes.data
        numbers = self.numbers[first:].ctypes.data
        call(at.ctypes.data, numbers, f.ctypes.data, J.ctypes.data, further)
        return f, J


@pytest.mark.parametrize("d", D)
def test_what_kernels_leave_out_changes_nothing_else(d):
    a, system = several(d, 1)
    contacts, rng, kept = Contacts(system), np.random.default_rng(5), np.zeros(64)
    parted = []
    for _ in range(20):
        q = placed(a, rng, 0.6, 1.6)
        v = rng.standard_normal(q.shape)
        values, (gaps, slopes) = contacts.values(q), contacts.gradients(q)
        size, many = q.size, len(contacts.names)
        limit, wanted = np.array([np.median(gaps)]), (rng.random(many) < 0.3).astype(float)
        below = gaps < limit[0]
        few, rows = contacts.called(contacts.gaps.compiled(1), q, 0, many, size, limit)
        np.testing.assert_array_equal(few, gaps)
        np.testing.assert_array_equal(rows[below], slopes[below])
        assert not rows[~below].any()
        some, _ = contacts.called(contacts.gaps.compiled(0), q, 0, many, size, wanted)
        np.testing.assert_array_equal(some[wanted > 0], values[wanted > 0])
        parted.append(min(values))
        # Contacts of the same two hulls, and then of others, keep what they have in common.
        both, code = np.concatenate([q.ravel(), v.ravel()]), contacts.slip.compiled(1)
        for g in rng.integers(0, many, 4):
            entry, rates = contacts.table + 2 * g, 2 if d == 3 else 1
            alone = contacts.called(code, both, entry, rates, both.size)
            after = contacts.called(code, both, entry, rates, both.size, kept)
            for one, other in zip(alone, after, strict=True):
                np.testing.assert_array_equal(one, other)
    assert min(parted) < 0 < max(parted)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("d", D)
def test_a_gap_is_negative_where_hulls_overlap_and_only_there(d, seed):
    """Where they are near, the least one is a bound of the distance."""
    rng = np.random.default_rng(seed)
    a, system = several(d, seed)
    contacts, signs = Contacts(system), set()
    for _ in range(30):
        q = placed(a, rng, 0.3, 2.1)
        least, far = contacts.values(q).min(), apart(a, q)
        assert (least > 0) == (far > 0)
        assert least <= far + 1e-9 or not 0 < far < 0.1
        signs.add(far > 0)
    assert signs == {True, False}


def touching(a, rng):
    """Two placements that nearly touch, brought together along the line between them."""
    q = placed(a, rng, 2.1, 2.1)
    d, out = a.dimension, q.copy()
    low, high = 0.0, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        out[1, :d] = middle * q[1, :d]
        low, high = (low, middle) if apart(a, out) > 1e-6 else (middle, high)
    out[1, :d] = high * q[1, :d]
    return out


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("d", D)
def test_where_hulls_touch_the_gap_is_the_distance_to_first_order(d, seed):
    rng = np.random.default_rng(seed)
    a, system = several(d, seed)
    contacts = Contacts(system)
    for _ in range(3):
        q = touching(a, rng)
        values, gradients = contacts.gradients(q)
        g = int(values.argmin())
        assert values[g] == pytest.approx(apart(a, q), abs=1e-7)

        for v in rng.standard_normal((3, *q.shape)):
            if d == 3:
                v[:, 3:] -= np.einsum("bi,bi->b", v[:, 3:], q[:, 3:])[:, None] * q[:, 3:]
            opens = float(gradients[g] @ v.ravel())
            moved = q + 1e-5 * np.sign(opens) * v
            moved = np.array([a.manifold.placed(x) for x in moved])
            assert apart(a, moved) - apart(a, q) == pytest.approx(1e-5 * abs(opens), abs=3e-8)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("d", D)
def test_the_slip_is_the_velocity_of_points_that_touch_across_the_normal(d, seed):
    """Differences of the places of two points, each carried by its body."""
    rng = np.random.default_rng(seed)
    a, system = several(d, seed)
    contacts = Contacts(system)
    q = touching(a, rng)
    values, gradients = contacts.gradients(q)
    g, v = int(values.argmin()), rng.standard_normal(q.shape)
    if d == 3:
        v[:, 3:] -= np.einsum("bi,bi->b", v[:, 3:], q[:, 3:])[:, None] * q[:, 3:]
    normal = gradients[g, q.shape[1] : q.shape[1] + d]
    slip, rows = contacts.slips(q, v, g)
    assert slip == pytest.approx(rows[:, q.size :] @ v.ravel())
    directions = rows[:, q.size + q.shape[1] : q.size + q.shape[1] + d]
    assert directions @ directions.T == pytest.approx(np.eye(d - 1), abs=1e-12)
    assert directions @ normal == pytest.approx(np.zeros(d - 1), abs=1e-12)

    def carried(body, point, t):
        x = a.manifold.placed(q[body] + t * v[body])
        here, there = (a.placed(p)["A"].parts[""].points for p in (q[body], x))
        # A point of the body by its weights on the vertices of a simplex.
        some = [0, *np.argsort(np.linalg.norm(here - here[0], axis=1))[-d:]]
        if abs(np.linalg.det(np.column_stack([here[some], np.ones(d + 1)]))) < 1e-9:
            return None
        weights = np.linalg.solve(np.vstack([here[some].T, np.ones(d + 1)]), [*point, 1.0])
        return weights @ there[some]

    names = contacts.names[g].split("-")
    if "v" not in names[0]:
        return
    body, vertex = int(names[0][1]) - 1, int(names[0].partition(".v")[2]) - 1
    point = a.placed(q[body])["A"].parts[""].points[vertex]
    places = [[carried(body, point, t) for t in (1e-6, -1e-6)] for body in (0, 1)]
    speeds = [(after - before) / 2e-6 for after, before in places]
    assert slip == pytest.approx(directions @ (speeds[1] - speeds[0]), abs=1e-6)

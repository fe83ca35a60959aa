"""First-order motion: oracles are closed forms, and the sweeping process written from its
definition, one projection by a general solver in each step."""

import math
from itertools import combinations, pairwise

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize, nnls

from polycorner import Drift, Manifold, Polyhedron, simulate, velocities
from polycorner.motion import (
    Checkpoint,
    ContactFamily,
    EventKind,
    Noise,
    Solver,
    pair_coordinates,
    step,
    time_symbol,
)

PLANE, LINE = Manifold.euclidean("x y"), Manifold.euclidean("s")
X, Y = PLANE.symbols
VX, VY = velocities(PLANE)
(S,) = LINE.symbols
TIME = time_symbol()
(X1, Y1), (X2, Y2) = pair_coordinates(PLANE)
CLOSE = 1e-7


def disc(radius=1.0):
    return Polyhedron(PLANE, {"disc": X**2 + Y**2 - radius**2})


def discs(radius):
    gap = sp.sqrt((X2 - X1) ** 2 + (Y2 - Y1) ** 2) - 2 * radius
    return ContactFamily({"apart": gap}, 2 * radius, ["x", "y"])


def funnel(door):
    """Walls at 45 degrees before a corridor; a point is the centre of a disc."""
    s = 1 / math.sqrt(2)
    return Polyhedron(PLANE, {"up": (door - X - Y) * s, "down": (door - X + Y) * s})


# ------------------------------------------------------------------------- the projection identity


@settings(max_examples=8, deadline=None)
@given(
    st.lists(st.floats(-1, 1), min_size=9, max_size=9),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3),
    st.lists(st.floats(0.2, 3.0), min_size=3, max_size=3),
)
def test_what_is_admitted_is_a_projection_onto_the_tangent_cone(rows, wished, mobility):
    """Moreau: u - v is normal to the cone, so that |u|^2 = |v|^2 + |u - v|^2, and v is in it."""
    M = Manifold.euclidean("a b c")
    J, u, B = np.reshape(rows, (3, 3)), np.array(wished), np.diag(mobility)
    if min(np.linalg.norm(J, axis=1)) < 0.1:
        return
    J /= np.linalg.norm(J, axis=1)[:, None]
    D = Polyhedron(M, [sum(float(x) * q for x, q in zip(row, M.symbols, strict=True)) for row in J])
    drift = Drift(
        D,
        dict(zip(M.names, wished, strict=True)),
        mobility=dict(zip(M.names, mobility, strict=True)),
    )
    path = simulate(drift, drift.state(np.zeros(3)), 1e-3, 1e-3)
    v, G = path.v[0, 0], np.linalg.inv(B)
    assert (J @ v).min() >= -CLOSE
    size = u @ G @ u
    assert abs(v @ G @ v + (u - v) @ G @ (u - v) - size) <= CLOSE * max(1.0, size)
    # The polar cone by non-negative least squares: u - v = -B J' lam, lam >= 0.
    root = np.sqrt(np.diag(G))
    _, left = nnls(-(root[:, None] * (B @ J.T)), root * (u - v))
    assert left <= 1e-6


def test_the_identity_holds_along_a_motion_around_corners_and_curves():
    D = Polyhedron(PLANE, {"disc": X**2 + Y**2 - 1, "wall": 1.5 - X, "floor": Y + 1.2})
    drift = Drift(D, {"x": 1 + sp.sin(TIME), "y": -sp.Rational(1, 2) * sp.cos(3 * TIME)})
    path = simulate(drift, drift.state([-1.0, 0.3]), 4.0, 0.01)
    touched = 0
    for time, q, v, touching in zip(
        path.times, path.q[:, 0], path.v[:, 0], path.touching, strict=True
    ):
        u = drift.wished(q, time)
        assert abs(v @ v + (u - v) @ (u - v) - u @ u) < 1e-9
        values, gradients = D.evaluate(q)
        pushed = np.zeros(2)
        for _, name, force in touching:
            i = D.names.index(name)
            assert abs(values[i]) < 1e-6
            assert force >= 0
            assert gradients[i] @ v >= -1e-9
            pushed += force * gradients[i]
            touched += 1
        assert np.allclose(v - u, pushed, atol=1e-9)
    assert touched > 100


# --------------------------------------------------------------------------------- closed forms


def angle_on_the_disc(start, duration):
    """Sliding on the unit circle under u = (1, 0): theta' = -sin(theta)."""
    return 2 * math.atan(math.tan(start / 2) * math.exp(-duration))


def orders(errors):
    return [math.log2(a / b) for a, b in pairwise(errors)]


def test_sliding_on_a_curve_is_of_second_order_and_stays_on_it():
    drift, errors = Drift(disc(), {"x": 1}), []
    for n in (10, 20, 40, 80):
        path = simulate(drift, drift.state([math.cos(2.5), math.sin(2.5)]), 0.6, 0.6 / n)
        x, y = path.q[-1, 0]
        errors.append(abs(math.atan2(y, x) - angle_on_the_disc(2.5, 0.6)))
        assert abs(math.hypot(x, y) - 1) < 1e-9
    assert all(1.9 < order < 2.1 for order in orders(errors))


def test_a_contact_opens_where_its_force_vanishes_and_closes_where_the_gap_does():
    drift = Drift(disc(), {"x": 1})
    path = simulate(drift, drift.state([-2.0, math.sin(2.5)]), 4.0, 0.002)
    made, lost = path.events
    begin = 2.0 + math.cos(2.5)
    assert (made.kind, lost.kind) == (EventKind.MADE, EventKind.LOST)
    assert made.time == pytest.approx(begin, abs=1e-4)
    # tan(theta / 2) = 1 at the top of the disc, where the force vanishes
    assert lost.time == pytest.approx(begin + math.log(math.tan(1.25)), abs=1e-4)


def test_a_mobility_turns_what_walls_do():
    """The push is along B times the normal: at a floor y >= 0 along (b12, b22)."""
    B = np.array([[2.0, 0.6], [0.6, 1.0]])
    drift = Drift(Polyhedron(PLANE, {"floor": Y}), {"x": 1, "y": -1}, mobility=B)
    path = simulate(drift, drift.state([0.0, 0.0]), 1.0, 0.1)
    assert path.q[-1, 0] == pytest.approx([1.0 + 0.6, 0.0], abs=CLOSE)


def test_a_gradient_flow_is_of_second_order_with_a_mobility_that_turns_with_a_rod():
    """A rod sinks: its centre drifts sideways as B(phi) of an inclined rod says."""
    M = Manifold.euclidean("x y phi")
    _x, y, phi = M.symbols
    c, s = sp.cos(phi), sp.sin(phi)
    B = sp.Matrix([[2 * c**2 + s**2, c * s, 0], [c * s, 2 * s**2 + c**2, 0], [0, 0, 1]])
    drift = Drift(Polyhedron(M, {}), {"phi": sp.S(1) / 2}, potential=y, mobility=B.tolist())
    errors = []
    for n in (8, 16, 32):
        path = simulate(drift, drift.state([0, 0, 0.2]), 1.0, 1 / n)
        # x' = -cos(phi) sin(phi), phi = 0.2 + t / 2
        exact = (math.cos(2 * 0.7) - math.cos(2 * 0.2)) / 2
        errors.append(abs(path.q[-1, 0, 0] - exact))
    assert all(1.9 < order < 2.1 for order in orders(errors))


def test_energy_goes_into_drag():
    """What the wish works and the potential loses is dissipated, but for the square of the step."""
    D = Polyhedron(PLANE, {"floor": Y - X**2 / 4})
    drift, audits = Drift(D, {"x": 0.3}, potential=5 * Y + X**2), []
    for n in (50, 100, 200):
        path = simulate(drift, drift.state([-1.0, 0.25]), 2.0, 2.0 / n)
        audits.append(path.audit)
    assert all(1.8 < order < 2.2 for order in orders(audits))
    given = path.work["velocity"][-1] + path.potential[0] - path.potential[-1]
    assert given == pytest.approx(path.dissipated["drag"][-1], rel=1e-3)


def test_equations_are_followed():
    """On the circle a gradient flow is theta' = -sin(theta), whatever the mobility's size."""
    D = Polyhedron(PLANE, {}, {"wire": X**2 + Y**2 - 1})
    drift = Drift(D, potential=-X)
    path = simulate(drift, drift.state([math.cos(2.5), math.sin(2.5)]), 1.0, 0.01)
    x, y = path.q[-1, 0]
    assert math.atan2(y, x) == pytest.approx(angle_on_the_disc(2.5, 1.0), abs=1e-5)
    assert [name for _, name, _ in path.touching[-1]] == ["wire"]


def test_unit_vectors_flow_on_the_sphere():
    M = Manifold.sphere("u")
    z = M.symbols[2]
    drift = Drift(Polyhedron(M, {}), potential=z)
    path = simulate(drift, drift.state([math.sin(0.5), 0.0, math.cos(0.5)]), 2.0, 0.01)
    # polar angle: theta' = sin(theta)
    exact = 2 * math.atan(math.tan(0.25) * math.exp(2.0))
    assert math.acos(path.q[-1, 0, 2]) == pytest.approx(exact, abs=1e-4)


# ---------------------------------------------------------------------------------------- limits


def test_limits_bound_the_velocity_where_they_say():
    """A speed limit that depends on the place: x' = min(2, 1 + x), reached when x = 1."""
    drift = Drift(Polyhedron(PLANE, {}), {"x": 2, "y": 1}, limits={"speed": 1 + X - VX})
    errors = []
    for n in (20, 40, 80):
        path = simulate(drift, drift.state([0.0, 0.0]), 0.5, 0.5 / n)
        errors.append(abs(path.q[-1, 0, 0] - (math.exp(0.5) - 1)))
        assert path.q[-1, 0, 1] == pytest.approx(0.5)
    assert all(1.8 < order < 2.2 for order in orders(errors))


def test_a_ratchet_goes_one_way():
    drift = Drift(
        Polyhedron(LINE, {}), {"s": sp.cos(TIME)}, limits={"ratchet": velocities(LINE)[0]}
    )
    path = simulate(drift, drift.state([0.0]), 2 * math.pi, 2 * math.pi / 400)
    assert path.q[-1, 0, 0] == pytest.approx(2.0, abs=1e-3)
    assert path.v.min() >= -1e-9


def test_limits_and_contacts_are_one_projection():
    """v in {v_y >= 0, v_x + v_y <= 1} nearest to (2, -1): the corner (1, 0)."""
    D = Polyhedron(PLANE, {"floor": Y})
    drift = Drift(D, {"x": 2, "y": -1}, limits={"limit": 1 - VX - VY})
    path = simulate(drift, drift.state([0.0, 0.0]), 1.0, 0.1)
    assert path.v[0, 0] == pytest.approx([1.0, 0.0], abs=CLOSE)
    assert path.q[-1, 0] == pytest.approx([1.0, 0.0], abs=CLOSE)


def test_what_contacts_and_limits_do_not_admit_fails():
    drift = Drift(
        Polyhedron(LINE, {"wall": 1 - S}), {"s": 1}, limits={"go": velocities(LINE)[0] - 1}
    )
    path = simulate(drift, drift.state([1.0]), 0.2, 0.1)
    assert {e.kind for e in path.events} >= {EventKind.FAILED}
    assert not path.converged


# ----------------------------------------------------------------------------------- many discs


def swept(q, wish, admitted, h):
    """Return the nearest placement to q + h wish, by a general solver from the definition."""
    target = (q + h * wish(q)).ravel()
    found = minimize(
        lambda z: ((z - target) ** 2).sum(),
        target,
        jac=lambda z: 2 * (z - target),
        constraints=[{"type": "ineq", "fun": admitted}],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 200},
    )
    return found.x.reshape(q.shape)


def admitted_discs(radius, walls):
    def gaps(z):
        q = z.reshape(-1, 2)
        pairs = [np.linalg.norm(a - b) - 2 * radius for a, b in combinations(q, 2)]
        return np.array([*pairs, *(w for p in q for w in walls(p))])

    return gaps


def test_two_discs_at_a_door_stop_as_an_arch():
    """Symmetric discs press each other and both walls of a funnel that is too narrow for two."""
    drift = Drift(funnel(0.3), {"x": 1}, count=2, between=discs(0.25))
    path = simulate(drift, drift.state([[-1.5, 0.3], [-1.5, -0.3]]), 3.0, 0.01)
    # between two walls at 45 degrees, y = 0.25, and x + y = 0.3
    assert path.q[-1].ravel() == pytest.approx([0.05, 0.25, 0.05, -0.25], abs=1e-6)
    assert path.rests[-1].all()
    forces = {name: force for _, name, force in path.touching[-1]}
    # of each disc: wish (1, 0) = wall (1, 1) / sqrt(2) f + the other disc (0, -1) p
    assert forces["apart"] == pytest.approx(1.0, abs=1e-5)
    assert forces["up"] == pytest.approx(math.sqrt(2), abs=1e-5)


def test_discs_at_a_door_move_as_the_nearest_placements_do():
    """Projections from the definition are of first order, and tend to the same motion."""
    radius, door = 0.2, 0.5
    walls = lambda p: ((door - p[0] - p[1]) / math.sqrt(2), (door - p[0] + p[1]) / math.sqrt(2))  # noqa: E731
    start = np.array([[-1.2, 0.5], [-1.1, 0.0], [-1.25, -0.45], [-1.7, 0.2], [-1.7, -0.25]])
    drift = Drift(funnel(door), {"x": 1, "y": -Y}, count=5, between=discs(radius))

    def wish(q):
        return np.column_stack([np.ones(len(q)), -q[:, 1]])

    away = []
    for h in (0.02, 0.01):
        q, gaps = start.copy(), admitted_discs(radius, walls)
        for _ in range(round(1.0 / h)):
            q = swept(q, wish, gaps, h)
        path = simulate(drift, drift.state(start), 1.0, 0.01)
        away.append(abs(path.q[-1] - q).max())
    assert away[0] < 0.02
    assert away[1] < 0.7 * away[0]


def crowd(n, radius, seed):
    side = math.ceil(math.sqrt(n))
    at = np.array([(i, j) for i in range(side) for j in range(side)][:n], dtype=np.float64)
    rng = np.random.default_rng(seed)
    q = 2.3 * radius * (at - [0, side / 2]) + rng.uniform(-0.1, 0.1, (n, 2)) * radius
    return q * [-1, 1] - [side * 1.6 * radius + 0.3, 0]


def test_one_step_of_a_crowd_is_the_projection_of_its_wish():
    """Thirty discs that press: one step by another solver, of the linearised programme."""
    cvxpy = pytest.importorskip("cvxpy")
    radius, h = 0.2, 0.01
    drift = Drift(funnel(0.6), {"x": 1, "y": -Y}, count=30, between=discs(radius))
    path = simulate(drift, drift.state(crowd(30, radius, 0)), 2.0, h, every=1)
    assert path.converged
    q, end = path.q[-2], path.q[-1]
    pairs = [
        (i, j) for i, j in combinations(range(30), 2) if np.linalg.norm(q[i] - q[j]) < 3 * radius
    ]
    assert sum(len(touch[0]) == 2 for touch in path.touching[-1]) > 20
    middle, d = (q + end) / 2, cvxpy.Variable((30, 2))
    wish = h * np.column_stack([np.ones(30), -middle[:, 1]])
    rows = []
    for i, j in pairs:
        n = (middle[j] - middle[i]) / np.linalg.norm(middle[j] - middle[i])
        gap = np.linalg.norm(end[j] - end[i]) - 2 * radius - n @ ((end - q)[j] - (end - q)[i])
        rows.append(gap + n @ (d[j] - d[i]) >= 0)
    rows += [0.6 - (q + d)[:, 0] - sign * (q + d)[:, 1] >= 0 for sign in (1, -1)]
    cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(d - wish)), rows).solve(solver="CLARABEL")
    assert np.abs(d.value - (end - q)).max() < 1e-6


def test_a_motion_does_not_depend_on_the_unit_of_length():
    small = Manifold("x y", scales=[1e-3, 1e-3])
    s = 1 / math.sqrt(2)
    walls = Polyhedron(small, {"up": (6e-4 - X - Y) * s, "down": (6e-4 - X + Y) * s})
    gap = sp.sqrt((X2 - X1) ** 2 + (Y2 - Y1) ** 2) - 4e-4
    apart = ContactFamily({"apart": gap}, 0.4, ["x", "y"])
    one = Drift(funnel(0.6), {"x": 1, "y": -Y}, count=9, between=discs(0.2))
    two = Drift(walls, {"x": 1e-3, "y": -Y}, count=9, between=apart)
    start = crowd(9, 0.2, 2)
    ends = [
        simulate(drift, drift.state(size * start), 1.5, 0.01).q[-1] / size
        for drift, size in ((one, 1.0), (two, 1e-3))
    ]
    assert np.abs(ends[0] - ends[1]).max() < 1e-5


def test_bodies_of_an_arrangement_drift_and_are_drawn():
    from polycorner.bodies import Arrangement, HalfSpace, capsule
    from polycorner.bodies import disc as round_body
    from polycorner.pictures import film

    walls = {"up": HalfSpace([-1, -1], [0.6, 0]), "down": HalfSpace([-1, 1], [0.6, 0])}
    people = Arrangement({"person": round_body(0.2)}, walls)
    system = people.system(count=2)
    x, y = system.manifold.symbols
    drift = Drift(
        system.polyhedron, {x.name: 1, y.name: -y}, count=2, between=system.between,
        scene=system.scene,
    )  # fmt: skip
    path = simulate(drift, drift.state([[-1.5, 0.3], [-1.5, -0.3]]), 3.0, 0.01)
    assert path.q[-1, 0, 1] == pytest.approx(0.2, abs=1e-5)
    assert {row.between for row in path.contacts(-1)} >= {("person 1", "up")}
    assert film(people, path) is not None
    rods = Arrangement(
        {"rod": capsule([-0.3, 0], [0.3, 0], 0.1)}, {"floor": HalfSpace([0, 1], [0, 0])}
    )
    one = rods.system(count=2)
    _, height, _ = one.manifold.names
    sinks = Drift(one.polyhedron, {height: -1}, count=2, between=one.between, noise=1e-4)
    path = simulate(sinks, sinks.state([[0, 1, 0.3], [0.1, 1.6, 0.2]]), 2.0, 0.01)
    assert path.converged
    assert path.q[-1, :, 1].max() < 1.0
    assert one.polyhedron.values(path.q[-1]).min() > -1e-5


def test_nothing_overlaps_in_a_crowd_and_who_passes_leaves():
    radius = 0.2
    drift = Drift(
        funnel(0.6), {"x": 1, "y": -2 * Y}, count=25, between=discs(radius), exits={"x": 0.2}
    )
    path = simulate(drift, drift.state(crowd(25, radius, 1)), 5.0, 0.02)
    assert path.converged
    assert path.max_penetration < 1e-6
    left = path.of_kind(EventKind.EXIT)
    assert len(left) == 25 - path.present[-1].sum() > 0
    for q, here in zip(path.q, path.present, strict=True):
        some = q[here]
        far = np.linalg.norm(some[:, None] - some, axis=2) + 9 * np.eye(len(some))
        assert far.min() > 2 * radius - 1e-5


def test_bodies_meet_across_the_border_of_a_period():
    M = Manifold("x y", periods=[10.0, math.inf])
    _, y = M.symbols
    across = (10 / sp.pi * sp.sin(sp.pi * (X2 - X1) / 10)) ** 2 + (Y2 - Y1) ** 2
    apart = ContactFamily({"apart": sp.sqrt(across) - 1}, 1.7, ["x", "y"])
    drift = Drift(Polyhedron(M, {}), {"x": 1 - 10 * y}, count=2, between=apart)
    path = simulate(drift, drift.state([[9.0, 0.0], [1.0, 0.1]]), 1.2, 0.01)
    chord = math.sqrt(1 - 0.1**2)
    made = path.of_kind(EventKind.MADE)[0]
    assert made.time == pytest.approx(
        2 - 10 / math.pi * math.asin(math.pi * chord / 10), abs=0.01**2
    )


# ------------------------------------------------------------------------- runs, files, refusals


def test_a_run_goes_on_bit_for_bit():
    drift = Drift(funnel(0.6), {"x": 1, "y": -Y}, count=9, between=discs(0.2))
    start = drift.state(crowd(9, 0.2, 2))
    whole = simulate(drift, start, 1.0, 0.01, every=10)
    half = simulate(drift, start, 0.5, 0.01, every=10)
    rest = simulate(drift, half.last, 1.0, 0.01, every=10)
    assert (rest.q == whole.q[5:]).all()
    assert list(half.events + rest.events) == list(whole.events)


def test_an_interrupted_run_is_resumed(tmp_path):
    class StopError(Exception):
        pass

    def stop(done, *_):
        if done > 0.4:
            raise StopError

    drift = Drift(funnel(0.6), {"x": 1, "y": -Y}, count=9, between=discs(0.2), noise=1e-4)
    start, noise = drift.state(crowd(9, 0.2, 2)), Noise(seed=5)
    whole = simulate(drift, start, 1.0, 0.01, every=10, noise=noise)
    saves = Checkpoint(tmp_path / "run", seconds=0)
    with pytest.raises(StopError):
        simulate(drift, start, 1.0, 0.01, every=10, noise=noise, checkpoint=saves, progress=stop)
    found = simulate(drift, start, 1.0, 0.01, every=10, noise=noise, checkpoint=saves)
    assert (found.q == whole.q).all()
    assert (found.v == whole.v).all()
    with pytest.raises(ValueError, match="noise"):
        simulate(drift, start, 1.0, 0.01, every=10, checkpoint=saves)


def test_files_and_datasets_have_the_motion(tmp_path):
    from polycorner.files import load_trajectory, save_trajectory

    drift = Drift(funnel(0.6), {"x": 1, "y": -Y}, count=4, between=discs(0.2), exits={"x": 0.0})
    path = simulate(drift, drift.state(crowd(4, 0.2, 2)), 2.0, 0.01)
    found = load_trajectory(save_trajectory(path, tmp_path / "crowd.nc"), drift)
    assert (found.q == path.q).all()
    assert list(found.events) == list(path.events)
    assert {*path.work} == {"velocity", "noise", "left"}
    assert [*path.dissipated] == ["drag"]
    other = Drift(funnel(0.6), {"x": 2, "y": -Y}, count=4, between=discs(0.2), exits={"x": 0.0})
    with pytest.raises(ValueError, match="velocity"):
        load_trajectory(tmp_path / "crowd.nc", other)


def test_a_step_is_the_first_of_a_run():
    drift = Drift(disc(), {"x": 1})
    start = drift.state([-1.0, 0.1])
    one, path = step(drift, start, 0.01), simulate(drift, start, 0.02, 0.01)
    assert one.q.tolist() == path.q[1, 0].tolist()
    assert one.v.tolist() == path.v[1, 0].tolist()


def test_a_body_rests_in_a_corner_and_moves_again():
    D = Polyhedron(LINE, {"wall": 1 - S})
    drift = Drift(D, {"s": sp.cos(TIME)})
    path = simulate(drift, drift.state([0.5]), 4.0, 0.01)
    kinds = [e.kind for e in path.events]
    assert kinds[:2] == [EventKind.MADE, EventKind.REST]
    assert {*kinds[2:]} == {EventKind.MOTION, EventKind.LOST}
    assert path.events[0].time == pytest.approx(math.asin(0.5), abs=1e-3)
    assert path.of_kind(EventKind.LOST)[0].time == pytest.approx(math.pi / 2, abs=0.01)
    assert path.q[-1, 0, 0] == pytest.approx(math.sin(4.0) - 1 + 1, abs=1e-3)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"velocity": {"z": 1}}, "velocity by coordinates of the polyhedron: "),
        (
            {"velocity": {"x": VX}},
            "velocity: expected a formula in time, x, y for 'x'; got 'x_dot'",
        ),
        ({"noise": -1}, "noise: "),
        ({"limits": {"l": 1 - VX**2}}, "limits: expected a formula that is affine in velocities"),
        ({"limits": {"floor": 1 - VX}}, "limits: expected names of their own"),
        ({"mobility": [[1, 2], [2, 1]]}, "mobility: expected a positive definite matrix"),
        ({"mobility": [[1, 2]]}, "mobility: expected a mapping by coordinate, or 2 rows"),
        ({"mobility": [[1, 0.5], [0, 1]]}, "mobility: expected a symmetric matrix"),
        ({"count": 0}, "count: "),
        ({"exits": {"x": 1, "y": 2}}, "exits: expected one coordinate"),
        ({"potential": "x"}, "potential: "),
    ],
)
def test_bad_input_gets_a_sentence(given, sentence):
    with pytest.raises((TypeError, ValueError)) as told:
        Drift(Polyhedron(PLANE, {"floor": Y}), **given)
    assert sentence in str(told.value)
    assert "\n" not in str(told.value)


def test_bad_states_and_runs_get_a_sentence():
    drift = Drift(Polyhedron(PLANE, {"floor": Y}), potential=100 * Y**2)
    with pytest.raises(ValueError, match="floor"):
        drift.state([0.0, -1.0])
    with pytest.raises(ValueError, match="v: expected none"):
        drift.state([0.0, 1.0], [1.0, 0.0])
    with pytest.raises(ValueError, match=r"dt: expected at most 0\.01 s, beyond which the motion"):
        simulate(drift, drift.state([0.0, 1.0]), 1.0, 0.1)
    with pytest.raises(TypeError, match="noise: expected a seed alone"):
        simulate(drift, drift.state([0.0, 1.0]), 1.0, 1e-3, noise=Noise(kicks={"x": 1.0}))
    with pytest.raises(ValueError, match="solver: expected tolerance, sweeps and options alone"):
        simulate(drift, drift.state([0.0, 1.0]), 1.0, 1e-3, solver=Solver(threads=2))


def test_what_is_not_finite_is_told():
    from polycorner.errors import SolverError

    drift = Drift(Polyhedron(LINE, {}), {"s": 1 / (1 - S)})
    with pytest.raises(SolverError, match="wished velocity"):
        simulate(drift, drift.state([1.0]), 1.0, 0.1)


def test_it_prints():
    drift = Drift(Polyhedron(PLANE, {"floor": Y}), {"x": 1}, noise=0.1)
    assert repr(drift) == "Drift(1 body; 2 coordinates; 1 contact)"
    assert "velocity" in str(drift)
    assert drift.solver == Solver()

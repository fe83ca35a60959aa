"""Viable speeds before slower zones, against braking by definition, and drives along them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polycorner import Manifold, Polyhedron, System, simulate, skeleton, stratum_at, velocities
from polycorner.motion import EventKind, SpeedZones
from polycorner.polyhedra import LocalType

LINE = Manifold.euclidean("x")
(X,), (V,) = LINE.symbols, velocities(LINE)
ROAD = SpeedZones(30.0, {"town": (100.0, 200.0, 14.0)})


def can_brake(x, v, top, zones, a):
    """Whether braking from a state keeps all limits: the lowest of all speeds, at every place."""
    if not 0 <= v <= top:
        return False
    for begin, end, c in zones:
        if x >= end:
            continue
        place = max(x, begin)
        if v**2 - 2 * a * (place - x) > c**2:
            return False
    return True


zones_given = st.lists(
    st.tuples(st.floats(0, 90), st.floats(1, 50), st.floats(1, 20)), min_size=1, max_size=3
)


@given(zones_given, st.floats(0.5, 5), st.floats(0, 120), st.floats(0, 22))
def test_viable_states_are_those_from_which_braking_keeps_the_limits(drawn, a, x, v):
    zones = [(begin, begin + length, c) for begin, length, c in drawn]
    road = SpeedZones(20.0, {f"z{i}": zone for i, zone in enumerate(zones)})
    inside = bool(road.viable(a).contains([x, v]))
    assert inside == can_brake(x, v, 20.0, zones, a)
    if inside:
        assert road.allowed.contains([x, v])


def test_corners_of_the_viable_set():
    viable = ROAD.viable(5.0)
    corners = skeleton(viable, [[10.0, 29.0], [150.0, 10.0]], extent=1e4).corners
    found = {tuple(c.point.round(9).tolist()): c.local_type for c in corners}
    assert found == {
        (29.6, 30.0): LocalType.QUADRANT,  # 100 - (30^2 - 14^2) / (2 5)
        (100.0, 14.0): LocalType.UNION,
        (200.0, 14.0): LocalType.UNION,
        (200.0, 30.0): LocalType.QUADRANT,
    }
    assert stratum_at(viable, [50.0, np.sqrt(14**2 + 2 * 5 * 50)]).dimension == 1


def drive(limits, start, t_end, dt, throttle=5.0):
    road = Polyhedron(LINE, {"far": X + 1000})
    car = System(road, V**2 / 2, forces={"x": throttle + 0 * X}, limits=limits)
    return simulate(car, car.state(*start), t_end, dt, every=1)


def test_at_full_throttle_a_drive_stays_in_the_viable_set_and_brakes_as_hard_as_allowed():
    path = drive(ROAD.limits(5.0), ([0.0], [20.0]), 15.0, 0.01)
    states = np.concatenate([path.q[:, 0], path.v[:, 0]], axis=1)
    assert ROAD.viable(5.0).contains(states, tolerance=1e-9).all()
    assert np.diff(path.v[:, 0, 0]).min() / 0.01 == pytest.approx(-5.0, abs=1e-6)
    assert path.q[-1].item() > 200
    assert path.audit < 1e-12


def test_without_the_parabola_the_drive_jumps():
    path = drive(ROAD.limits(), ([0.0], [20.0]), 10.0, 0.01)
    # 30 m/s after 2 s and 50 m, and 14 m/s at once 50 m farther on.
    assert np.diff(path.v[:, 0, 0]).min() == pytest.approx(-16.0)
    assert path.q[-1].item() == pytest.approx(100 + 14 * (8 - 50 / 30), abs=1e-6)


def test_the_quickest_way_to_a_place_is_bang_bang():
    """Up at ``a``, along the limit ``c``, down at ``-a`` to 1 m/s: c / a + ... in closed form."""
    c, a, goal, slow = 10.0, 2.0, 100.0, 1.0
    road = SpeedZones(c, {"goal": (goal, goal + 10, slow)})
    times = np.array([c / a, 0, (c - slow) / a])
    up, down = c**2 / (2 * a), (c**2 - slow**2) / (2 * a)
    times[1] = (goal - up - down) / c

    def place(t):
        first, second, third = (
            np.minimum(t, np.cumsum(times)[:, None]) - np.append(0, np.cumsum(times)[:-1])[:, None]
        )
        first, second, third = (np.maximum(part, 0) for part in (first, second, third))
        last = np.maximum(t - times.sum(), 0)
        x = a * first**2 / 2 + c * second + c * third - a * third**2 / 2
        return x + slow * last

    worst = []
    for k in range(5):
        path = drive(road.limits(a), ([0.0], [0.0]), 20.0, 0.16 / 2**k, throttle=a)
        worst.append(np.abs(path.q[:, 0, 0] - place(path.times)).max())
        assert [e.kind for e in path.events[:1]] == [EventKind.ACTED]
    assert worst[-1] < 1e-4
    assert np.log2(worst[0] / worst[-1]) / 4 > 1.8


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((0.0, {}), "top: expected"),
        (
            (1.0, {"a": (1, 0, 1)}),
            "zones: expected a begin before the end and a limit up to top, 1,",
        ),
        ((1.0, {"a": (0, 1, 2)}), "zones: expected a begin before the end"),
        ((1.0, {"a": (0, 1)}), "zones: expected begin, end and limit of 'a'"),
        ((1.0, {}, Manifold.euclidean("x y")), "manifold: expected one coordinate"),
    ],
)
def test_what_are_no_zones_is_refused(arguments, told):
    with pytest.raises(ValueError, match=told):
        SpeedZones(*arguments)


def test_brakes_have_to_brake():
    with pytest.raises(ValueError, match="braking"):
        ROAD.viable(0.0)

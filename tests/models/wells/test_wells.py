"""U, half-U and half-V wells: their labels, and how they capture a mass that nothing shakes."""

import math
from itertools import islice

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from polycorner import Entrapment, certify
from polycorner.models.wells.wells import KINDS, Well

HALF = (Entrapment.HALF_U, Entrapment.HALF_V)
numbers = st.floats(0.2, 5.0)


@st.composite
def walled(draw):
    """Return wells with a slope, a stiffness or both, with friction or without."""
    slope = draw(st.sampled_from([0.0, draw(numbers)]))
    stiffness = draw(numbers) if slope == 0 else draw(st.sampled_from([0.0, draw(numbers)]))
    friction = draw(st.sampled_from([0.0, 0.3, 0.9])) * draw(numbers)
    return Well(slope, stiffness, rim=1e6, mass=draw(numbers), friction=friction)


# ------------------------------------------------------------------------------------------- labels


@pytest.mark.parametrize("kind", KINDS)
def test_a_well_is_what_its_certificate_says(kind):
    well = Well.of_depth(kind, 2.5, rim=1.7)
    certificate = certify(well.polyhedron, well.energy, [0.0])
    assert well.kind is kind
    assert list(certificate.entrapment.values()) == [kind]
    assert certificate.signature == ((1, 0, 0) if kind is Entrapment.HALF_V else (0, 1, 0))


@given(walled(), st.floats(0.0, 3.0))
def test_energy_at_a_place_is_the_work_against_the_force(well, x):
    nodes, weights = np.polynomial.legendre.leggauss(4)
    force = well.slope + well.stiffness * x * (1 + nodes) / 2
    assert well.potential(x) == pytest.approx(x / 2 * weights @ force, abs=1e-12)
    (symbol,) = well.manifold.symbols
    assert float(well.energy.subs(symbol, x)) == pytest.approx(well.potential(x), abs=1e-12)


@given(st.sampled_from(KINDS), numbers, numbers)
def test_depth_is_the_energy_at_the_rim(kind, depth, rim):
    well = Well.of_depth(kind, depth, rim)
    assert well.depth == pytest.approx(depth)
    ends = [rim] if well.wall else [rim, -rim]
    assert well.potential(np.array(ends)) == pytest.approx([depth] * len(ends))
    assert well.polyhedron.values(np.array(ends)[:, None]).min(axis=1) == pytest.approx(
        0, abs=1e-12
    )


def test_starts_lie_in_the_well():
    for kind in KINDS:
        well = Well.of_depth(kind, 1.0, rim=0.5)
        starts = well.starts(np.random.default_rng(0), 1000)
        assert starts.shape == (1000, 1)
        assert np.asarray(well.polyhedron.contains(starts)).all()
        assert starts.mean() == pytest.approx(0.25 if well.wall else 0.0, abs=0.04)


# ------------------------------------------------------------------------------------------ flights


def integrated(well, speed):
    """Follow one flight numerically: up until it stops, and down until it stops or is back."""

    def turning(_, state):
        return state[1]

    def back(_, state):
        return state[0]

    turning.terminal = back.terminal = True
    total, place = 0.0, 0.0
    for sign in (1.0, -1.0):
        if sign < 0 and well.slope + well.stiffness * place <= well.friction:
            return total, 0.0, place
        turning.direction, back.direction = -sign, -1.0

        def motion(_, state, sign=sign):
            pull = well.slope + well.stiffness * state[0] + sign * well.friction
            return [state[1], -pull / well.mass]

        events = [turning] if sign > 0 else [back, turning]
        start = [place, speed if sign > 0 else 0.0]
        run = solve_ivp(motion, (0, 1e4), start, events=events, rtol=1e-11, atol=1e-13)
        total += run.t[-1]
        place, speed = run.y[:, -1]
    return total, abs(speed), max(place, 0.0)


@given(walled(), numbers)
def test_a_flight_is_what_integration_gives(well, speed):
    flight = well.flight(speed)
    assume(
        well.friction == 0
        or abs(well.slope + well.stiffness * flight.height - well.friction) > 1e-3
    )
    duration, back, place = integrated(well, speed)
    assert flight.duration == pytest.approx(duration, rel=1e-6)
    assert flight.speed**2 == pytest.approx(back**2, abs=1e-6)
    assert flight.place == pytest.approx(place, abs=1e-6)


@given(walled(), numbers)
def test_friction_takes_its_force_times_the_way(well, speed):
    flight = well.flight(speed)
    way = 2 * flight.height - flight.place
    lost = well.mass * (speed**2 - flight.speed**2) / 2 - well.potential(flight.place)
    assert lost == pytest.approx(well.friction * way, abs=1e-9)


def test_flights_end_where_the_mass_stays():
    stuck = Well(0.0, 1.0, friction=0.1, restitution=0.5)
    flights = list(stuck.flights(0.9))
    assert [flight.place for flight in flights[:-1]] == [0.0] * (len(flights) - 1)
    assert 0 < flights[-1].place <= 0.1
    assert len(list(islice(Well(1.0, 0.0, restitution=0.5).flights(1.0), 50))) == 50


# ------------------------------------------------------------------------------------------ capture


@given(numbers, numbers, st.floats(0.0, 0.95), st.floats(0.1, 1.0))
def test_half_v_is_at_rest_in_finite_time(depth, mass, restitution, speed):
    """Flights of ``2 m v / f`` are a geometric series."""
    well = Well.of_depth(Entrapment.HALF_V, depth, rim=10.0, mass=mass, restitution=restitution)
    assume(speed**2 * mass < 2 * depth)
    time, place = well.capture(speed)
    assert time == pytest.approx(2 * mass * speed / (well.slope * (1 - restitution)), rel=1e-12)
    assert place == 0.0


@given(numbers, numbers, st.floats(0.05, 0.95))
def test_half_u_loses_a_share_in_equal_times_and_never_rests(depth, mass, restitution):
    well = Well.of_depth(Entrapment.HALF_U, depth, mass=mass, restitution=restitution)
    speed = 0.9 * math.sqrt(2 * depth / mass)
    flights = list(islice(well.flights(speed), 6))
    times = [flight.duration for flight in flights]
    assert times == pytest.approx([math.pi / well.frequency] * 6)
    shares = np.array([f.speed for f in flights[1:]]) / [f.speed for f in flights[:-1]]
    assert shares == pytest.approx(restitution)
    assert math.isinf(well.capture(speed)[0])


def test_absorbing_walls_take_one_flight():
    """Then half-V is first only if the energy is below ``(pi / 4)^2`` of the depth."""
    first, second = (Well.of_depth(kind, 3.0, rim=2.0, mass=0.7) for kind in HALF)
    turning = math.pi / 4 * math.sqrt(2 * 3.0 / 0.7)
    assert first.capture(1.0) == (pytest.approx(math.pi / first.frequency), 0.0)
    for factor in (0.3, 0.999, 1.001, 1.25):
        sooner = second.capture(factor * turning)[0] < first.capture(factor * turning)[0]
        assert sooner == (factor < 1)


@given(st.floats(0.05, 0.45), st.floats(0.2, 1.0))
def test_friction_leaves_u_beside_the_bottom(friction, reach):
    """Each swing ends ``2 F / k`` nearer, until it ends within ``F / k``."""
    well = Well.of_depth(Entrapment.U, 0.5, friction=friction)
    speed = math.sqrt(reach**2 + 2 * friction * reach)  # up to the height `reach`
    ends = [reach]
    while ends[-1] > friction:
        ends.append(abs(ends[-1] - 2 * friction))
    assume(abs(ends[-1] - friction) > 1e-6)
    swings = len(ends) - 1
    time, place = well.capture(speed)
    assert place == pytest.approx(ends[-1], abs=1e-9)
    rise = well.flight(speed).duration if swings == 0 else math.atan2(speed, friction)
    assert time == pytest.approx(rise + swings * math.pi, rel=1e-6)


def test_friction_does_not_keep_half_v_from_its_wall():
    """As long as it is weaker than the slope; stronger, it holds the mass where it is."""
    for friction, expected in ((0.9, 0.0), (1.1, 1 / (2 * 2.1))):
        well = Well(1.0, 0.0, friction=friction, restitution=0.7)
        assert well.capture(1.0)[1] == pytest.approx(expected, abs=1e-12)


def test_without_losses_nothing_is_captured():
    for well in (Well.of_depth(Entrapment.U, 1.0), Well(1.0, 0.0, restitution=1.0)):
        time, place = well.capture(0.5)
        assert math.isinf(time)
        assert math.isnan(place)
    assert Well.of_depth(Entrapment.U, 1.0).capture(0.0) == (0.0, 0.0)


@given(st.sampled_from(KINDS), numbers, numbers, st.floats(0.1, 1.0), st.floats(0.0, 0.4))
def test_capture_speed_brings_it_back_to_the_rim_with_nothing_left(kind, depth, mass, e, loss):
    well = Well.of_depth(kind, depth, 2.0, mass=mass, restitution=e, friction=loss * depth / 2)
    inward = well.capture_speed()
    energy = mass * inward**2 / 2 + depth - well.friction * well.rim
    outward = well.kept * math.sqrt(2 * energy / mass)
    assert well.flight(outward).height == pytest.approx(well.rim, rel=1e-9)


def test_what_an_absorbing_wall_keeps_does_not_depend_on_speed():
    for kind in HALF:
        assert math.isinf(Well.of_depth(kind, 1.0).capture_speed())
        a, b = (Well.of_depth(kind, 1.0, restitution=e).capture_speed() for e in (0.3, 0.6))
        assert a > b
    assert Well.of_depth(Entrapment.U, 1.0).capture_speed() == 0.0


# ---------------------------------------------------------------------------------------- arguments


@pytest.mark.parametrize(
    ("call", "argument", "kind"),
    [
        (lambda: Well(slope=0.0, stiffness=0.0), "slope, stiffness", ValueError),
        (lambda: Well(1.0, 0.0, wall=False), "slope", ValueError),
        (lambda: Well(1.0, 0.0, rim=0.0), "rim", ValueError),
        (lambda: Well(1.0, 0.0, drag=-1.0), "drag", ValueError),
        (lambda: Well(1.0, 0.0, restitution=1.5), "restitution", ValueError),
        (lambda: Well(math.nan, 0.0), "slope", ValueError),
        (lambda: Well(1.0, 0.0, mass="heavy"), "mass", TypeError),
        (lambda: Well.of_depth(Entrapment.FREE, 1.0), "kind", ValueError),
        (lambda: Well(1.0, 0.0, drag=2.0).capture(0.1), "drag", ValueError),
        (lambda: Well(1.0, 0.0).capture(2.0), "speed", ValueError),
        (lambda: Well(1.0, 0.0).capture(-1.0), "speed", ValueError),
    ],
)
def test_the_error_names_the_argument(call, argument, kind):
    with pytest.raises(kind, match=rf"^{argument}: expected [^\n]+; [^\n]+$"):
        call()

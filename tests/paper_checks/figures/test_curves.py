"""Curves and pairs in the paper's figures against independent formulas."""

import math

import numpy as np
import oracles
import pytest
from drawn_curves import lines
from matplotlib.colors import to_rgb

from paper_checks import figures
from paper_checks.figures import FIGURES
from paper_checks.figures import style as look

# -------------------------------------------------------------------------------------- the drum


def test_places_on_the_drum_have_the_coordinates_of_the_paper():
    rng = np.random.default_rng(1)
    phi, eta = rng.uniform(-1.5, 1.5, 50), rng.uniform(0, 300, 50)
    x, y, z = np.moveaxis(figures.drum.laboratory(phi, eta), -1, 0)
    a, R = math.radians(7), 125
    # section 2: phi = -arctan(x / (-y sin a + z cos a)), eta = y cos a + z sin a
    assert -np.arctan(x / (-y * np.sin(a) + z * np.cos(a))) == pytest.approx(phi)
    assert y * np.cos(a) + z * np.sin(a) == pytest.approx(eta)
    assert z == pytest.approx(eta * np.sin(a) - R * np.cos(a) * np.cos(phi))


def test_flow_lines_are_where_the_field_points(drawn):
    a, rho = math.radians(7), 122
    for axes in drawn("flow_lines").axes:
        found = lines(axes, look.GRAVITY)
        assert len(found) > 20
        for line in found:
            shown = line[np.isfinite(line).all(axis=1)]
            phi, eta = np.radians(shown[:, 0]), shown[:, 1]
            slope = np.diff(phi) / np.diff(eta)
            field = np.sin((phi[1:] + phi[:-1]) / 2) / (rho * math.tan(a))
            assert slope == pytest.approx(field, rel=1e-3)


@pytest.mark.parametrize("sign", [1, -1])
def test_zigzags_are_carried_along_latitudes_and_roll_across_their_axis(sign, drawn):
    a, rho, theta = math.radians(7), 122, math.radians(sign * 12)
    (path,) = lines(drawn("flow_lines").axes[1], figures.flow.COLOURS[sign])
    phi, eta = np.radians(path[:, 0]), path[:, 1]
    assert np.diff(eta)[::2] == pytest.approx(0)
    assert np.diff(eta)[1::2] == pytest.approx(-math.tan(theta) * rho * np.diff(phi)[1::2])
    assert sign * (eta[-1] - eta[0]) > 15
    # they start to roll where the pull across the axis is 0.1 of the load
    upper = phi[1::2]
    pull = math.cos(a) * np.sin(upper) * math.cos(theta) - math.sin(a) * math.sin(theta)
    assert pull == pytest.approx(0.1 * math.cos(a) * np.cos(upper))


# --------------------------------------------------------------------------------------- headings


def least_heading(length, r=3.0, t=1.5):
    """Return the heading of least energy of the pair at its corner in the plane, by search."""
    from scipy.optimize import minimize_scalar

    p = r + t
    along = length - math.sqrt(4 * r**2 - p**2)

    def energy(theta):
        axis = np.array([math.sin(theta), math.cos(theta)])
        second = along * axis + p * np.array([-axis[1], axis[0]])
        balls = [m + e * length / 2 * axis for m in (0 * axis, second) for e in (-1, 1)]
        across = np.array(balls)[:, 0]
        return float(((across - across.mean()) ** 2).sum())

    return math.degrees(minimize_scalar(energy, bounds=(0, 0.7), method="bounded").x)


def test_headings_are_those_of_least_energy(drawn):
    upper, lower = drawn("heading_length").axes
    expected = np.array([least_heading(length) for length in figures.headings.LENGTHS])
    for colour, sign in ((look.RIGHT[0], 1), (look.LEFT[0], -1)):
        (curve,) = lines(upper, colour)
        assert curve[:, 0] == pytest.approx(figures.headings.LENGTHS)
        assert curve[:, 1] == pytest.approx(sign * expected, abs=5e-4)
    circles = np.concatenate(lines(upper, "white"))
    shown = [least_heading(length) for length in circles[:, 0]]
    assert abs(circles[:, 1]) == pytest.approx(shown, abs=1e-4)
    for curve, sign in zip(lines(upper, look.PAPER), (1, -1), strict=True):
        assert np.tan(np.radians(curve[:, 1])) == pytest.approx(sign * 3 / curve[:, 0])
    (rest,) = lines(lower, look.RIGHT[0])
    assert np.abs(rest[:, 1]).max() < 0.5  # thousandths of a degree
    assert "7.943°" in FIGURES["heading_length"].caption


def test_what_was_observed_is_marked(drawn):
    bars = drawn("heading_length").axes[0].containers
    assert sorted(bar.lines[0].get_xydata()[0].tolist() for bar in bars) == [[16, -15], [16, 15]]


# ------------------------------------------------------------------------------------------ pairs


def touching(q):
    """Return which balls touch balls or rods, from distances of points and segments."""
    found = oracles.gaps(look.PLANE, q)[:8]
    assert min(found) > -1e-6
    return {name for name, gap in zip(oracles.CONTACTS, found, strict=False) if gap < 1e-6}


@pytest.mark.parametrize(
    ("kinds", "count", "contacts"),
    [
        (figures.pairs.corners, 4, {3, 4}),
        (figures.pairs.edges, 5, {2}),
        (figures.pairs.faces, 2, {1}),
        (lambda: [figures.pairs.apart()], 1, {0}),
    ],
)
def test_pairs_on_faces_touch_as_they_say(kinds, count, contacts):
    found = kinds()
    assert len(found) == count
    assert {len(kind.contacts) for kind in found} == contacts
    for kind in found:
        assert touching(kind.q) == set(kind.contacts)


def test_corners_have_the_hands_of_their_names():
    names = [kind.name for kind in figures.pairs.corners()]
    assert names == [r"$\Delta_R$", r"$\Delta_L$", r"$\mathcal{E}_R$", r"$\mathcal{E}_L$"]
    for kind in figures.pairs.corners():
        assert look.PLANE.chirality(kind.q) == kind.hand == kind.name[-2]


def test_counts_obey_euler():
    for k in range(3):
        corners, edges, faces = (figures.pairs.counts(dimension)[k] for dimension in (3, 4, 5))
        if k:  # up to relabelling some faces are folded
            assert corners - edges + faces == 0


def test_every_kind_is_drawn(drawn):
    panels = [axes for part in drawn("faces").subfigs for axes in part.axes]
    panels += [a for part in drawn("faces").subfigs for sub in part.subfigs for a in sub.axes]
    assert len(panels) == 4 + 5 + 2 + 1


@pytest.mark.parametrize("hand", ["R", "L"])
def test_pairs_near_the_minimiser_are_dyads_of_its_hand(hand):
    found = figures.pairs.near(hand)
    assert len(found) == figures.pairs.NEAR_COUNT
    for q in found:
        assert look.PAIR.polyhedron.contains(q)
        assert look.PAIR.chirality(q) == hand


@pytest.mark.parametrize(("kind", "count"), [("Delta_R", 3), ("E_R", 4)])
def test_motions_out_of_corners_keep_two_contacts(kind, count):
    ways = figures.solid.out_of(kind)
    assert len({name for name, _ in ways}) == len(ways) == count
    for name, way in ways:
        middle = touching(way[len(way) // 2])
        assert len(middle) == 2
        assert figures.solid.motion(tuple(middle)) == name
        assert middle < touching(way[0])


def test_the_solid_has_its_corners_and_motions(drawn):
    (axes,) = [a for part in drawn("solid").subfigs for a in part.axes if hasattr(a, "zaxis")]
    texts = [text.get_text().strip() for text in axes.texts]
    assert sorted(text for text in texts if text) == sorted(
        2 * [kind.name for kind in figures.pairs.corners()]
    )
    shown = {to_rgb(line.get_color()) for line in axes.lines}
    assert {to_rgb(colour) for colour, _ in figures.solid.COLOURS.values()} <= shown


# ----------------------------------------------------------------------------------------- keel


def torque_towards_larger_headings(phi, theta, friction, kappa=1e-4):
    """Return the torque on a short dumbbell that slides as the force points, from its two balls."""
    alpha, rho = math.radians(7), 1.0
    half = kappa * rho

    def height(heading):
        turn = np.arcsin(half * np.sin(heading) * np.array([-1, 1]) / rho)
        return -(rho * np.cos(phi + turn)).sum()

    step = 1e-4
    gravity = -math.cos(alpha) * (height(theta + step) - height(theta - step)) / (2 * step)
    force = np.array([-math.cos(alpha) * math.sin(phi), -math.sin(alpha)])
    against = -force / np.hypot(*force)
    turning = half * np.array([math.cos(theta), -math.sin(theta)])
    turn = math.asin(half * math.sin(theta) / rho)
    loads = [math.cos(alpha) * math.cos(phi + e * turn) for e in (-1, 1)]
    rubbing = sum(
        e * turning @ (friction * n * against) for e, n in zip((-1, 1), loads, strict=True)
    )
    return gravity + rubbing


def test_headings_grow_where_the_torque_points_outwards():
    rng, tried = np.random.default_rng(2), set()
    for phi in rng.uniform(-85, 85, 40):
        for theta in (*rng.uniform(-90, 90, 3), *rng.uniform(86, 89.9, 3)):
            torque = torque_towards_larger_headings(math.radians(phi), math.radians(theta), 0.2)
            if abs(torque) > 1e-12:
                grows = bool(figures.rest.growing(phi, theta))
                assert grows == (torque * theta > 0)
                tried.add(grows)
    assert tried == {True, False}


def held(phi, theta, rolling, sliding):
    """Return whether friction can hold a short dumbbell: a disc cut by a strip."""
    alpha = math.radians(7)
    force = np.array([-math.cos(alpha) * math.sin(phi), -math.sin(alpha)])
    force /= math.cos(alpha) * math.cos(phi)
    across = force @ [-math.cos(theta), math.sin(theta)]
    return abs(across) <= rolling and np.hypot(*force) <= sliding


@pytest.mark.parametrize(
    ("panel", "rolling", "sliding"),
    [
        (0, 0.1, 0.3),
        (1, 0.1, 0.1 / math.sin(math.radians(8))),
        (2, 0.2, 0.2 / math.sin(math.radians(20))),
    ],
)
def test_the_eastern_boundary_is_where_carrying_lets_go(panel, rolling, sliding, drawn):
    axes = drawn("rest_regions").axes[panel]
    from polycorner.dumbbells.pictures.experiments import NEGATIVE, POSITIVE

    for colour, sign in ((POSITIVE, 1), (NEGATIVE, -1)):
        (curve,) = lines(axes, colour)
        curve = np.radians(curve[np.isfinite(curve).all(axis=1)])
        assert (sign * curve[:, 1] >= 0).all()
        for phi, theta in curve[5:-5:20]:
            assert held(phi - 1e-7, theta, rolling, sliding)
            assert not held(phi + 1e-7, theta, rolling, sliding)


# ------------------------------------------------------------------------------- regions and wells


def test_the_region_has_seven_corners_and_sides(drawn):
    (axes,) = drawn("tutorial").axes
    assert {text.get_text() for text in axes.texts} >= {f"${letter}$" for letter in "ABCDEFG"}
    assert len(lines(axes, look.RIGHT[0])) == 7
    assert set(figures.regions.inward()) == {"AB", "DE", "GA"}
    assert set(figures.regions.straight()) == {"BC", "EF"}


def followed(slope, stiffness, wall, dt=2e-4):
    """Return times and positions of a mass released at 0.9, by small steps."""
    x, v, n = 0.9, 0.0, round(16 / dt)
    places = np.empty(n)
    for k in range(n):
        places[k] = x
        force = -math.copysign(slope, x) - stiffness * x
        if v == 0 and abs(force) <= 0.04:
            continue
        pushed = v + dt * (force - 0.04 * (math.copysign(1, v) if v else -math.copysign(1, -force)))
        if v * pushed < 0 and abs(force) <= 0.04:
            pushed = 0.0
        x, v = x + dt * pushed, pushed
        if wall and x < 0:
            x, v = 0.0, -0.6 * v
            if abs(v) < 5 * dt:
                v = 0.0
                if slope:
                    places[k:] = 0.0
                    break
    return dt * np.arange(n), places


@pytest.mark.parametrize("panel", range(3))
def test_masses_move_as_small_steps_say(panel, drawn):
    slope, stiffness, wall = ((0, 2, False), (0, 2, True), (1, 0, True))[panel]
    axes = drawn("entrapment").axes[3 + panel]
    (curve,) = lines(axes, figures.entrapment.COLOURS[panel])
    times, places = followed(slope, stiffness, wall)
    assert np.interp(curve[:, 0], times, places) == pytest.approx(curve[:, 1], abs=5e-3)


def test_only_half_v_presses_at_the_bottom():
    forces = [figures.entrapment.force(well, 0.0) for well in figures.entrapment.WELLS]
    assert forces == [0, 0, -1]

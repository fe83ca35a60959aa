"""Walls out of round, against points and normals of their curves."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from polycorner import simulate
from polycorner.bodies import Arrangement, Cylinder, capsule, disc, sphere
from polycorner.pictures import draw_arrangement

WAVES = {2: (0.3, 0.4), 3: (-0.05, -1.0)}
WALL = Cylinder(10.0, waves=WAVES)


def radius(azimuth, order=0):
    """The radius that the centre of a disc of radius 1 reaches, or a derivative of it."""
    turn = order * np.pi / 2  # each derivative advances the phase of a cosine
    waves = (a * k**order * np.cos(k * azimuth + p + turn) for k, (a, p) in WAVES.items())
    return (9.0 if order == 0 else 0.0) + sum(waves)


def curve(azimuth):
    return radius(azimuth) * np.array([np.cos(azimuth), np.sin(azimuth)])


@pytest.mark.parametrize("azimuth", [0.3, 2.0, -2.5, 3.1])
def test_a_gap_is_the_distance_next_to_the_wall(azimuth):
    a = Arrangement({"A": disc(1.0)}, {"wall": WALL})
    tangent = curve(azimuth + 1e-6) - curve(azimuth - 1e-6)
    inward = np.array([-tangent[1], tangent[0]]) / np.linalg.norm(tangent)
    assert a.polyhedron.values(curve(azimuth)) == pytest.approx([0.0], abs=1e-12)
    steps = np.array([1e-3, -1e-3])[:, None]
    assert a.polyhedron.values(curve(azimuth) + steps * inward).ravel() == pytest.approx(
        steps.ravel(), abs=1e-6
    )


def test_a_cylinder_has_its_azimuths_about_its_axis():
    """From the direction of x, right-handed about the axis; lengthwise nothing changes."""
    a = Arrangement({"A": sphere(1.0)}, {"wall": Cylinder(10.0, axis=[0, -2, 0], waves=WAVES)})
    for azimuth in (0.3, 2.0, -2.5):
        x, z = curve(azimuth)
        assert a.polyhedron.values(np.array([x, 7.0, z])) == pytest.approx([0.0], abs=1e-12)
    along = Cylinder(10.0, axis=[1, 0, 0], waves=WAVES)
    a = Arrangement({"A": sphere(1.0)}, {"wall": along})
    y, z = curve(0.7)
    assert a.polyhedron.values(np.array([-3.0, y, z])) == pytest.approx([0.0], abs=1e-12)


def test_a_smooth_disc_slides_along_the_curve():
    """Against a bead on the curve, ``L = (r^2 + r'^2) phi'^2 / 2 - g r sin phi``."""
    a = Arrangement({"A": disc(1.0)}, {"wall": WALL})
    system = a.system(gravity=[0.0, -10.0])
    start = -0.5

    def bead(_, y):
        phi, rate = y
        r, r1, r2 = (radius(phi, k) for k in range(3))
        pull = -10 * (r1 * np.sin(phi) + r * np.cos(phi))
        return rate, (pull - (r * r1 + r1 * r2) * rate**2) / (r**2 + r1**2)

    path = simulate(system, system.state(curve(start)), 2.0, 2.5e-4, every=400)
    exact = solve_ivp(bead, (0, 2), [start, 0.0], t_eval=path.times, rtol=1e-10, atol=1e-12).y[0]
    x, y = path.q[:, 0].T
    assert np.ptp(exact) > 1.0
    assert np.arctan2(y, x) == pytest.approx(exact, abs=1e-6)


def test_a_disc_that_rolls_turns_by_the_length_of_the_curve():
    """The wall's curve is ``r`` outside that of the centre: ``theta' r = -v``."""
    a = Arrangement({"A": disc(1.0)}, {"wall": WALL}, orientations="all")
    system = a.system(gravity=[0.0, -10.0], friction=1.0)
    path = simulate(system, system.state([*curve(-1.0), 0.0]), 1.0, 1e-3, every=10)
    length = np.linalg.norm(np.diff(path.q[:, 0, :2], axis=0), axis=1).sum()  # clockwise
    assert length > 1.0
    assert path.q[-1, 0, 2] == pytest.approx(length, abs=1e-4)
    assert path.max_penetration < 1e-5


def test_a_wall_out_of_round_does_not_turn_onto_itself():
    a = Arrangement({"A": disc(1.0)}, {"wall": WALL}, orientations="all")
    assert a.symmetry.fields == [{"thetaA": 1}]  # the disc alone
    pipe = Cylinder(10.0, axis=[0, 0, 1], waves={2: (0.3, 0.0)})
    b = Arrangement({"A": sphere(1.0), "B": sphere(1.0)}, {"wall": pipe})
    assert len(b.symmetry.fields) == 1  # along the axis
    assert len(b.full_symmetry.elements) == len(b.symmetry.elements)


def test_a_picture_shows_the_waves():
    a = Arrangement({"A": disc(1.0)}, {"wall": WALL})
    figure = draw_arrangement(a, a.point({"A": [0.0, 0.0]}))
    _, wall, *_ = figure.axes[0].patches
    x, y = wall.get_xy()[:-1].T
    assert np.hypot(x, y) == pytest.approx(radius(np.arctan2(y, x)) + 1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Cylinder(10.0, waves={2: (2.5, 0.0)}), "waves: expected amplitudes a_k"),
        (lambda: Cylinder(10.0, waves={0: (0.1, 0.0)}), "waves: expected a whole number >= 1"),
        (lambda: Cylinder(10.0, waves={2: 0.1}), "waves: expected an amplitude and a phase"),
        (lambda: Cylinder(10.0, waves={2: (0.1, "x")}), "waves: expected a finite number"),
        (lambda: Cylinder(10.0, waves=0.1), "waves: expected a mapping"),
        (lambda: Cylinder(10.0, spin=1.0, waves=WAVES), "waves: expected a circle or cylinder"),
        (lambda: Cylinder(9.0, point=np.ones(3), waves=WAVES), "waves: expected a circle or cyl"),
        (
            lambda: Arrangement({"A": capsule([-1, 0], [1, 0], 8.5)}, {"w": WALL}).polyhedron,
            "walls: expected a radius of 'w' above that of 'A' plus 2 for its waves",
        ),
    ],
)
def test_waves_are_checked(make, said):
    with pytest.raises((TypeError, ValueError), match=said):
        make()

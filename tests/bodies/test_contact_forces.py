"""Forces at contacts: where they act, that they balance, and Coulomb's law."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from polycorner import simulate
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    box,
    capsule,
    compound,
    disc,
    polygon,
    polytope,
    sphere,
)
from polycorner.motion import contact_forces, velocities
from polycorner.motion.formulation import moment

G = 10.0
SQUARE = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.1)
SIMPLEX = [[-1, -1, -1], [1.5, 0, 0], [0, 1.5, 0], [0, 0, 1.5]]
RNG = np.random.default_rng(5)


def in_plane():
    ground = HalfSpace([-0.2, 1], [0, -9])
    return Arrangement(
        {
            "A": compound({"a": SQUARE, "b": disc(0.5, at=[2, 0])}),
            "B": capsule([-1, 0], [1, 0.5], 0.3),
            "C": disc(0.7),
        },
        {"ground": ground, "ring": Cylinder(12.0, point=[1, 0], waves={2: (0.3, 0.4)})},
        {"post": polygon([[0, 0], [1, 0], [0, 1]], 0.2).moved([5, 5])},
        orientations="all",
    )


def in_space():
    pipe = Cylinder(9.0, axis=[1, 2, 2], point=[0, 1, 0])
    return Arrangement(
        {"A": polytope(SIMPLEX, 0.2), "B": capsule([-1, 0, 0], [1, 0, 1], 0.3), "C": sphere(0.6)},
        {
            "floor": HalfSpace([0, 0.3, 1], [0, 0, -8]),
            "pipe": pipe,
            "ball": Cylinder(9.0, point=[0] * 3),
        },
        {"bar": capsule([4, 0, 0], [4, 3, 1], 0.5)},
        orientations="all",
    )


def in_channel():
    return Arrangement(
        {"A": capsule([-1, 0], [1, 0.5], 0.3), "B": disc(0.7, at=[0.2, 0])},
        {"floor": HalfSpace([0, 1], [0, -8])},
        period=[9.0, None],
        orientations="all",
    )


def anywhere(a):
    """Placements far apart, so that all distances are those of hulls."""
    d, placed = a.dimension, {}
    for k, name in enumerate(a.bodies):
        turn = RNG.uniform(-3, 3) if d == 2 else Rotation.random(rng=RNG)
        placed[name] = ([*(RNG.normal(size=d) + 3 * (k - 1))], turn)
    return a.point(placed)


@pytest.mark.parametrize("made", [in_plane, in_space, in_channel])
def test_directions_are_those_of_gaps_and_slips(made):
    """The gradient of a gap by the position of a body is the normal; a slip's by its velocity, the
    tangent; those by its rotation have the lever of the point."""
    a = made()
    system = a.system(friction=0.3)
    d, n = a.dimension, a.manifold.size
    at = {p.name: p.at for p in a.placements}
    for _ in range(4):
        q = anywhere(a)
        gradients = dict(
            zip(system.contacts, system.polyhedron.bundle.evaluate(q, 1)[1], strict=False)
        )
        slips = moment(system.formulation, system.parameters, q, np.zeros(n)).slip_matrix
        rows = dict(
            zip((f.load for f in system.friction), slips.reshape(-1, d - 1, n), strict=True)
        )
        for contact in system.contacts:
            site = system.scene.site((0,), contact, q[None])
            names = [(site.one, 1.0)] + [(site.two, -1.0)] * (site.two in at)
            for name, sign in names if site.one in at else names[1:]:
                place = at[name]
                where = slice(place.start, place.start + d)
                if contact.endswith(("-ring", "-pipe", "-ball")):
                    normal = gradients[contact][where] / np.linalg.norm(gradients[contact][where])
                    close = 2.0 if contact.endswith("-ring") else 1e-9  # far from a wave
                else:
                    normal, close = gradients[contact][where], 1e-9
                np.testing.assert_allclose(sign * normal, site.normal, atol=close)
                tangents = sign * rows[contact][:, where]
                np.testing.assert_allclose(tangents, site.tangents, atol=1e-9)
                if d == 2:
                    lever = site.point - q[where]
                    turns = sign * rows[contact][:, place.start + 2]
                    if name == site.one:  # the other one may be an image
                        arms = [lever[0] * t[1] - lever[1] * t[0] for t in site.tangents]
                        np.testing.assert_allclose(turns, arms, atol=1e-9)


def wrench(path, index, name):
    """The force on a body and its torque about the origin of space, from all contacts."""
    found = contact_forces(path, index)
    force, torque = np.zeros(found.points.shape[1]), 0.0
    for point, f, t, (one, two) in zip(
        found.points, found.forces, found.torques, found.between, strict=True
    ):
        sign = 1.0 if name == one else -1.0 if name == two else 0.0
        force = force + sign * f
        lever = np.cross(point, f) if len(point) == 3 else point[0] * f[1] - point[1] * f[0]
        torque = torque + sign * (lever + t)
    return force, torque


def moved(a, masses, pull, **laws):
    return a.system(gravity=pull, masses=masses, **laws)


def run(a, placed, pull, duration=0.3, dt=1e-3, moving=None, **laws):
    system = a.system(gravity=pull, **laws)
    q = a.point(placed)
    v = a.velocity(q, moving or {})
    return simulate(system, system.state(q, v), duration, dt, every=1)


def masses_of(a):
    from polycorner.bodies import mass_of

    return {name: mass_of(body, 1.0) for name, body in a.bodies.items()}


def check_coulomb(path, mu):
    for index in range(len(path)):
        for row in path.contacts(index):
            slides = [x for kind, p in row.friction.items() if kind != "rolling" for x in p]
            assert np.linalg.norm(slides) <= mu * row.normal * (1 + 1e-6) + 1e-9
            along = row.force - row.normal * row.direction
            assert np.linalg.norm(along) == pytest.approx(np.linalg.norm(slides), abs=1e-9)


def check_newton(path, a, pull, tolerance):
    """Mass times acceleration is weight plus contact forces; the same of the turn in the plane."""
    masses, d = masses_of(a), a.dimension
    for index in range(2, len(path)):
        h = path.times[index] - path.times[index - 1]
        for p in a.placements:
            mass = masses[p.name]
            v, before = (path.v[k, 0, p.at] for k in (index, index - 1))
            force, torque = wrench(path, index, p.name)
            gained = mass.mass * (v - before)[:d] / h
            np.testing.assert_allclose(gained, force + mass.mass * np.array(pull), atol=tolerance)
            if d == 2:
                x = path.q[index, 0, p.at][:2]
                about = torque - (x[0] * force[1] - x[1] * force[0])
                assert mass.inertia * (v - before)[2] / h == pytest.approx(about, abs=tolerance)


@pytest.mark.parametrize(("mu", "slips"), [(0.5, False), (0.2, True)])
def test_a_block_on_a_slope(mu, slips):
    a = Arrangement({"block": SQUARE}, {"slope": HalfSpace([0, 1], [0, 0])})
    pull = [3.0, -G]
    path = run(a, {"block": [0, 1.1]}, pull, friction=mu)
    m = masses_of(a)["block"].mass
    for index in range(len(path)):  # from the first instant on
        assert {row.between for row in path.contacts(index)} == {("block", "slope")}
        force, _ = wrench(path, index, "block")
        np.testing.assert_allclose(force, [-(mu * G if slips else 3.0) * m, G * m], rtol=1e-6)
    check_coulomb(path, mu)
    check_newton(path, a, pull, 1e-5)


def test_a_stack_bears_what_is_above():
    floor = {"floor": HalfSpace([0, 1], [0, 0])}
    a = Arrangement({f"D{k}": disc(0.5 + 0.1 * k) for k in range(3)}, floor, orientations="all")
    heights = [0.5, 1.6, 2.9]
    path = run(a, {f"D{k}": [0, y] for k, y in enumerate(heights)}, [0, -G], 0.05, friction=0.5)
    m = {name: mass.mass for name, mass in masses_of(a).items()}
    for index in (0, -1):
        rows = {row.contact: row for row in path.contacts(index)}
        weights = [sum(m[f"D{i}"] for i in range(k, 3)) * G for k in range(3)]
        assert rows["D0-floor"].normal == pytest.approx(weights[0], rel=1e-6)
        assert rows["D0-D1"].normal == pytest.approx(weights[1], rel=1e-6)
        assert rows["D1-D2"].normal == pytest.approx(weights[2], rel=1e-6)
        np.testing.assert_allclose(rows["D0-D1"].point, [0, 1.0], atol=1e-6)
        np.testing.assert_allclose(rows["D0-D1"].force, [0, -weights[1]], atol=1e-4)  # on D0


def test_a_disc_that_rolls_down():
    a = Arrangement({"D": disc(0.5)}, {"slope": HalfSpace([0, 1], [0, 0])}, orientations="all")
    pull = [3.0, -G]
    path = run(a, {"D": [0, 0.5]}, pull, friction=0.5, rolling=0.1)
    m = masses_of(a)["D"].mass
    for index in (0, 10, -1):
        (row,) = path.contacts(index)
        # The torque that resists is mu r N; the disc rolls on with what is left.
        assert float(row.torque) == pytest.approx(0.1 * 0.5 * G * m, rel=1e-5)
        assert row.force[0] == pytest.approx(-m * (3.0 + 2 * 0.1 * G) / 3, rel=1e-5)
    check_coulomb(path, 0.5)
    check_newton(path, a, pull, 1e-5)


def test_a_pile_of_three():
    a = Arrangement(
        {"L": disc(1.0), "R": disc(1.0), "T": disc(1.0)},
        {"floor": HalfSpace([0, 1], [0, 0])},
        orientations="all",
    )
    placed = {"L": [-1.001, 1], "R": [1.001, 1], "T": [0.1, 2.85]}
    path = run(a, placed, [0, -G], 0.6, friction=0.4, moving={"T": [0.5, 0]})
    assert "3 bodies" in repr(path)
    assert "3, with 9 coordinates: L, R, T" in str(path)
    assert any(len(path.contacts(index)) >= 3 for index in range(len(path)))
    check_coulomb(path, 0.4)
    quiet = [e.time for e in path.events if e.kind.name in {"MADE", "IMPACT", "LOST"}]
    masses = masses_of(a)
    for index in range(2, len(path)):
        t, h = path.times[index], path.times[index] - path.times[index - 1]
        if any(t - 3 * h < event < t + 2 * h for event in quiet):
            continue  # a step with an impact, or in parts
        for p in a.placements:
            m = masses[p.name].mass
            force, _ = wrench(path, index, p.name)
            gained = m * (path.v[index, 0, p.at] - path.v[index - 1, 0, p.at])[:2] / h
            np.testing.assert_allclose(gained, force + m * np.array([0, -G]), atol=0.2)
    total = sum(mass.mass for mass in masses.values()) * G
    assert sum(row.normal for row in path.contacts(0) if "floor" in row.between) > 0
    assert total > 0


def test_repeated_discs_are_called_by_number():
    a = Arrangement({"disc": disc(1.0)}, box([-5, 0], [5, 9]), orientations="all")
    system = a.system(gravity=[0, -G], friction=0.5, count=2)
    path = simulate(system, system.state([[0, 1, 0], [0, 3, 0]]), 0.05, 1e-3, every=1)
    for index in (0, -1):
        rows = {row.between: row for row in path.contacts(index)}
        assert set(rows) == {("disc 1", "bottom"), ("disc 1", "disc 2")}
        assert rows["disc 1", "bottom"].normal == pytest.approx(2 * np.pi * G, rel=1e-3)
        np.testing.assert_allclose(rows["disc 1", "disc 2"].force, [0, -np.pi * G], atol=0.05)
        np.testing.assert_allclose(rows["disc 1", "disc 2"].point, [0, 2], atol=1e-6)
    with pytest.raises(ValueError, match=r"bodies 'disc 1' and 'disc 2' overlap by 0\.5"):
        system.state([[0, 1, 0], [0, 2.5, 0]])
    with pytest.raises(ValueError, match=r"body 'disc 2' and wall 'bottom' overlap by 0\.5"):
        system.state([[0, 1, 0], [4, 0.5, 0]])


def test_listed_and_repeated_give_the_same_forces():
    walls = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}
    one = Arrangement({"S": sphere(1.0)}, walls, orientations="all")
    two = Arrangement({"A": sphere(1.0), "B": sphere(1.0)}, walls, orientations="all")
    starts = [[0, 0, 1, 1, 0, 0, 0], [0, 1.2, 2.6, 1, 0, 0, 0]]
    paths = []
    for system in (
        one.system(gravity=[1, 0, -G], friction=0.3, count=2),
        two.system(gravity=[1, 0, -G], friction=0.3),
    ):
        start = np.array(starts) if system.count == 2 else np.concatenate(starts)
        paths.append(simulate(system, system.state(start), 0.05, 1e-3, every=1))
    for index in (0, 20, -1):
        first, second = (contact_forces(path, index) for path in paths)
        renamed = [
            tuple({"S 1": "A", "S 2": "B"}.get(x, x) for x in pair) for pair in first.between
        ]
        order = [second.between.index(pair) for pair in renamed]
        np.testing.assert_allclose(first.points, second.points[order], atol=1e-4)
        np.testing.assert_allclose(first.forces, second.forces[order], rtol=1e-2, atol=0.05)
        assert first.torques.shape == second.torques.shape == (len(renamed), 3)


def test_an_unnamed_body_is_a_number():
    a = Arrangement([disc(1.0)], box([-5, 0], [5, 9]))
    system = a.system(count=3)
    with pytest.raises(ValueError, match="bodies '1' and '3' overlap"):
        system.state([[0, 1], [3, 1], [0, 2]])


def test_a_contact_that_opens_at_once_has_no_force():
    a = Arrangement({"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])})
    path = run(a, {"D": [0, 1]}, [0, -G], 0.01, moving={"D": [0, 1]})
    assert path.touching[0] == (((0,), "D-floor", 0.0),)
    assert not path.touching[1]


def test_nothing_touches_at_first_what_is_apart():
    a = Arrangement({"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])})
    path = run(a, {"D": [0, 1 + 1e-5]}, [0, -G], 0.02, 1e-2)
    assert path.touching[0] == ()
    assert path.touching[-1]


def test_an_instant_is_a_number_or_a_time():
    a = Arrangement({"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])})
    path = run(a, {"D": [0, 1]}, [0, -G], 0.02, 1e-2)
    assert [r.normal for r in path.contacts(1)] == [r.normal for r in path.contacts(0.015)]
    with pytest.raises(IndexError):
        path.contacts(7)
    with pytest.raises(ValueError, match=r"when: expected a time from 0 to 0\.02"):
        path.contacts(0.5)


def test_records_do_not_depend_on_how_often_they_are_made():
    a = Arrangement(
        {"L": disc(1.0), "R": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all"
    )
    system = a.system(gravity=[1.0, -G], friction=0.2)
    start = system.state(a.point({"L": [0, 1], "R": [1.5, 3]}))
    often, seldom = (simulate(system, start, 0.2, 1e-3, every=k) for k in (1, 50))
    assert often.touching[::50] == seldom.touching
    for k in range(len(seldom)):
        one, other = often.contacts(50 * k), seldom.contacts(k)
        assert [(r.contact, r.normal, dict(r.friction)) for r in one] == [
            (r.contact, r.normal, dict(r.friction)) for r in other
        ]
    assert all(a <= b for a, b in pairwise(often.friction.whole[:, 0].tolist()))


def test_files_keep_friction_and_old_ones_load_without(tmp_path):
    import xarray as xr

    from polycorner.files import load_trajectory, save_trajectory
    from polycorner.files.trajectories import _read, trajectory_dataset

    a = Arrangement({"D": disc(1.0)}, {"floor": HalfSpace([0, 1], [0, 0])}, orientations="all")
    system = a.system(gravity=[1.0, -G], friction=0.5, rolling=0.01, count=2)
    start = system.state([[0, 1, 0], [2, 1, 0]])
    path = simulate(system, start, 0.05, 1e-3, every=10)
    again = load_trajectory(save_trajectory(path, tmp_path / "path.nc"), system)
    for index in range(len(path)):
        one, other = (contact_forces(some, index) for some in (path, again))
        assert one.between == other.between
        np.testing.assert_array_equal(one.forces, other.forces)
        np.testing.assert_array_equal(one.torques, other.torques)
    content = trajectory_dataset(path)
    assert isinstance(content, xr.Dataset)
    old = _read(content.drop_vars([n for n in content if n.startswith("rub_")]), system)
    assert old.touching == path.touching
    assert not any(row.friction for row in old.contacts(-1))


def test_systems_without_a_scene_have_no_places(tmp_path):
    from polycorner import Friction, Manifold, Polyhedron, System
    from polycorner.files import load_trajectory, save_trajectory
    from polycorner.motion import Interval

    M = Manifold.euclidean("x y")
    (x, y), (vx, vy) = M.symbols, velocities(M)
    rub = Friction("rubs", vx, Interval(0.5), "floor")
    system = System(Polyhedron(M, {"floor": y}), (vx**2 + vy**2) / 2, G * y - 2 * x, friction=[rub])
    path = simulate(system, system.state([0.0, 0.0]), 0.1, 1e-2)
    (row,) = path.contacts(-1)
    assert (row.contact, row.between, row.point) == ("floor", (), None)
    assert row.normal == pytest.approx(G)
    assert row.friction["sliding"] == pytest.approx((-2.0,))
    assert contact_forces(path, -1).points.shape == (0, 0)
    again = load_trajectory(save_trajectory(path, tmp_path / "path.nc"), system)
    assert again.touching == path.touching
    assert [dict(r.friction) for r in again.contacts(-1)] == [dict(row.friction)]

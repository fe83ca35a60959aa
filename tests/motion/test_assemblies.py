"""Many bodies of several kinds: alike kinds are one, single ones a list, each has its own laws."""

import os

import numpy as np
import pytest
import sympy

from polycorner import Manifold, Polyhedron, System, velocities
from polycorner.bodies import Arrangement, HalfSpace, capsule, disc, sphere
from polycorner.files import load_trajectory, save_trajectory
from polycorner.motion import (
    Assembly,
    Checkpoint,
    ContactFamily,
    EventKind,
    Noise,
    Solver,
    pair_coordinates,
    simulate,
)
from polycorner.motion.simulation import start

BOX = {
    "floor": HalfSpace([0, 1], [0, 0]),
    "left": HalfSpace([1, 0], [0, 0]),
    "right": HalfSpace([-1, 0], [12, 0]),
}
GRAVITY = [0.0, -10.0]


def rows(count, radius, *, low=0.0, across=12.0, seed=0):
    """Return placements in rows from a height on, nearly touching."""
    wide, rng = 2.1 * radius, np.random.default_rng(seed)
    each = int((across - 0.2) / wide)
    places = np.array(
        [(0.1 + wide * (i % each + 0.5), wide * (i // each + 0.5)) for i in range(count)]
    )
    places += [0.0, low] + rng.uniform(-0.04, 0.04, (count, 2)) * radius
    return np.column_stack([places, np.zeros(count)])


def alike(places, walls):
    """Return discs as one kind, and as three with the same body, with the same start."""
    count = len(places)
    laws = {"gravity": GRAVITY, "friction": 0.4, "restitution": 0.3}
    one = Arrangement({"A": disc(1.0)}, walls, orientations="all").system(count=count, **laws)
    names = {name: disc(1.0) for name in ("A", "B", "C")}
    counts = {"A": 2, "B": count - 3, "C": 1}
    three = Arrangement(names, walls, orientations="all").system(count=counts, **laws)
    starts = {"A": places[:2], "B": places[2:-1], "C": places[-1:]}
    return (one, one.state(places)), (three, three.state(starts))


def test_kinds_that_are_alike_are_one_kind():
    """Bit for bit, though every pair of kinds has contacts and kernels of its own."""
    (one, first), (three, second) = alike(rows(13, 1.0), BOX)
    single = simulate(one, first, 1.0, 2e-3)
    several = simulate(three, second, 1.0, 2e-3)
    assert len(single.of_kind(EventKind.IMPACT)) > 20
    for name in ("q", "v"):
        together = [getattr(several[kind], name) for kind in ("A", "B", "C")]
        np.testing.assert_array_equal(np.concatenate(together, axis=1), getattr(single, name))
    np.testing.assert_array_equal(several.rests, single.rests)
    for name in ("kinetic", "potential"):
        np.testing.assert_array_equal(getattr(several, name), getattr(single, name))
    assert {c: e.tolist() for c, e in several.dissipated.items()} == {
        c: e.tolist() for c, e in single.dissipated.items()
    }
    told = [[(e.time, e.kind, e.bodies) for e in path.events] for path in (single, several)]
    assert told[0] == told[1]
    assert [[(b, f) for b, _, f in some] for some in single.touching] == [
        [(b, f) for b, _, f in some] for some in several.touching
    ]


def test_crowds_of_alike_kinds_are_one_crowd():
    lattice = [(1.5 + 2.01 * i + j % 2, 1.01 + 1.75 * j, 0.0) for j in range(22) for i in range(22)]
    tray = BOX | {"right": HalfSpace([-1, 0], [46, 0])}
    (one, first), (three, second) = alike(np.array(lattice), tray)
    solver = Solver(tolerance=1e-4, crowd_sweeps=6)
    single = simulate(one, first, 0.3, 5e-3, solver=solver)
    several = simulate(three, second, 0.3, 5e-3, solver=solver)
    assert single.effort.unconverged > 0
    np.testing.assert_array_equal(several.q[-1], single.q[-1].ravel())


def scene():
    """Return rods, discs and pegs of different numbers of coordinates, that settle in a box."""
    bodies = {"rod": capsule([-0.8, 0], [0.8, 0], 0.3), "disc": disc(0.6), "peg": disc(0.4)}
    return Arrangement(bodies, BOX), {"rod": 1, "disc": 1, "peg": 1}


STARTS = {"rod": [3.0, 0.4, 0.05], "disc": [3.2, 1.8], "peg": [2.2, 1.6]}


def test_single_bodies_of_several_kinds_move_as_if_they_were_listed():
    arrangement, counts = scene()
    listed = arrangement.system(gravity=GRAVITY)
    kinds = arrangement.system(gravity=GRAVITY, count=counts)
    begin = np.concatenate([*STARTS.values()])
    solver = Solver()
    first = simulate(listed, listed.state(begin), 0.8, 1e-3, solver=solver)
    second = simulate(
        kinds, kinds.state({k: [q] for k, q in STARTS.items()}), 0.8, 1e-3, solver=solver
    )
    assert len(first.of_kind(EventKind.MADE)) == len(second.of_kind(EventKind.MADE)) > 3
    # In steps with an impact the list is one body, and all of it takes the step in parts.
    alike = np.abs(second.q - first.q[:, 0]).max(axis=1) < 1e-9
    assert alike.sum() > 0.98 * len(alike)
    np.testing.assert_allclose(second.q[-1], first.q[-1, 0], atol=1e-9)
    assert second.kinetic[-1] == pytest.approx(first.kinetic[-1])


@pytest.fixture(scope="module")
def mixture():
    """Return rods and discs of two sizes that fell into a box, and their system."""
    bodies = {"rod": capsule([-0.8, 0], [0.8, 0], 0.3), "large": disc(0.6), "small": disc(0.3)}
    counts = {"rod": 4, "large": 6, "small": 12}
    mu = {("large", "small"): 0.2, "small": 0.1, ("large", "large"): 0.5, ("rod", "small"): 0.3}
    mu |= {("rod", "large"): 0.4, "small-floor": 0.6, "large-floor": (0.5, 0.3)}
    arrangement = Arrangement(bodies, BOX, orientations="all")
    system = arrangement.system(
        gravity=GRAVITY, friction=mu, count=counts, restitution={"small": 0.5}
    )
    flat = np.column_stack([rows(4, 1.3)[:, :2] * [1, 0.3] + [0, 0.1], np.zeros(4)])
    begin = {"rod": flat, "large": rows(6, 0.6, low=1.5), "small": rows(12, 0.3, low=3.0, seed=1)}
    return system, simulate(system, system.state(begin), 1.5, 2e-3)


def test_a_mixture_keeps_its_books(mixture):
    system, path = mixture
    assert abs(path.audit) < 1e-3
    assert path.max_penetration < 2e-2
    assert path.kinetic[-1] < 0.1 * path.kinetic.max()
    kinetic, potential = system.energies(system.state(path.q[-1], path.v[-1]))
    assert kinetic == pytest.approx(path.kinetic[-1])
    assert potential == pytest.approx(path.potential[-1])


def test_no_pair_of_a_mixture_overlaps(mixture):
    """By the distances of segments and centres, sampled."""
    _, path = mixture
    along = np.linspace(-0.8, 0.8, 81)
    cores, radii = [], []
    for x, y, a in path["rod"].q[-1]:
        cores.append(np.column_stack([x + along * np.cos(a), y + along * np.sin(a)]))
        radii.append(0.3)
    for name, radius in (("large", 0.6), ("small", 0.3)):
        cores += [q[None, :2] for q in path[name].q[-1]]
        radii += [radius] * len(path[name].q[-1])
    gaps = [
        np.linalg.norm(cores[i][:, None] - cores[j][None], axis=2).min() - radii[i] - radii[j]
        for i in range(len(cores))
        for j in range(i)
    ]
    assert min(gaps) > -5e-3
    assert sum(gap < 5e-3 for gap in gaps) > 15


def test_bodies_have_the_names_of_their_kinds(mixture):
    system, path = mixture
    assert path.bodies[:5] == ("rod 1", "rod 2", "rod 3", "rod 4", "large 1")
    assert path["small"].q.shape == (len(path), 12, 3)
    assert path["small"].rests.shape == path["small"].present.shape == (len(path), 12)
    np.testing.assert_array_equal(system.split(path.q)["large"], path["large"].q)
    for bodies, contact, _ in path.touching[-1]:
        kinds = [path.bodies[i].split()[0] for i in bodies]
        assert all(kind in contact for kind in kinds)
    assert repr(system) == "Assembly(4 rod, 6 large, 12 small)"
    text = str(path)
    assert "4 rod, with 3 coordinates each; 6 large" in text
    with pytest.raises(ValueError, match="kind: expected names among rod, large, small; got tiny"):
        path["tiny"]


def test_a_mixture_in_a_file_is_the_same(mixture, tmp_path):
    system, path = mixture
    saved = save_trajectory(path, tmp_path / "mixture.nc")
    loaded = load_trajectory(saved, system)
    for name in ("q", "v", "rests", "present", "kinetic"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(path, name))
    assert loaded.events == path.events
    assert loaded.touching == path.touching
    fewer = Assembly(system.kinds, system.count | {"rod": 3}, system.between)
    with pytest.raises(ValueError, match="is of another system: count"):
        load_trajectory(saved, fewer)


def test_forces_obey_the_laws_of_their_pairs(mixture):
    """Static coefficients limit what rubs: a kind without friction on a wall dissipates nothing."""
    system, _ = mixture
    families = {pair: family.friction for pair, family in system.between.items()}
    limits = {pair: [law.static.upper for law in laws] for pair, laws in families.items()}
    assert limits["large", "small"] == [0.2]
    assert limits["small", "small"] == [0.1]
    assert limits["rod", "rod"] == []
    assert [f.name for f in system.kinds["rod"].friction] == []
    assert {f.name: f.static.upper for f in system.kinds["small"].friction} == {
        "small-floor slips": 0.6,
        "small-left slips": 0.1,
        "small-right slips": 0.1,
    }
    assert system.kinds["small"].restitutions.tolist() == [0.5] * 3
    assert system.between["small", "small"].restitution == 0.5
    with pytest.raises(ValueError, match="restitution: expected a value for a-b"):
        Arrangement({"a": disc(1), "b": disc(2)}, BOX, orientations="all").system(
            count={"a": 1, "b": 1}, restitution={"a": 0.1, "b": 0.2}
        )
    with pytest.raises(ValueError, match="friction: expected names among a, floor"):
        Arrangement({"a": disc(1), "b": disc(2)}, BOX, orientations="all").system(
            count={"a": 1, "b": 1}, friction={"c": 0.1}
        )


def test_a_run_of_kinds_goes_on_from_its_checkpoint(tmp_path):
    arrangement, _ = scene()
    system = arrangement.system(gravity=GRAVITY, count={"rod": 2, "disc": 2, "peg": 2})
    shifted = {k: [q, [q[0] + 4.0, *q[1:]]] for k, q in STARTS.items()}
    begin, noise = system.state(shifted), Noise(kicks={"xpeg": 0.1, "thetarod": 0.1}, seed=4)
    whole = simulate(system, begin, 0.4, 1e-3, every=20, noise=noise)

    def stop(done, *_):
        if done > 0.2:
            raise KeyboardInterrupt

    saved = Checkpoint(tmp_path, seconds=0.0)
    with pytest.raises(KeyboardInterrupt):
        simulate(system, begin, 0.4, 1e-3, every=20, noise=noise, progress=stop, checkpoint=saved)
    resumed = simulate(system, begin, 0.4, 1e-3, every=20, noise=noise, checkpoint=saved)
    np.testing.assert_array_equal(resumed.q, whole.q)
    assert resumed.events == whole.events
    assert resumed.touching == whole.touching


def line(mass, coordinate="x"):
    M = Manifold.euclidean(coordinate)
    (x,), (v,) = M.symbols, velocities(M)
    return System(Polyhedron(M, {"left": x + 50, "right": 50 - x}), mass * v**2 / 2)


def test_masses_of_two_kinds_exchange_momentum():
    """Elastic impacts on a line, one by one: the closed form of Newton's law."""
    heavy, light = line(3.0), line(1.0, "y")
    (one,), (two,) = pair_coordinates(heavy.manifold, light.manifold)
    meet = ContactFamily({"meet": sympy.Abs(two - one) - 1}, 1.0, ["x", "y"], restitution=1.0)
    pair = Assembly(
        {"heavy": heavy, "light": light}, {"heavy": 1, "light": 2}, {("heavy", "light"): meet}
    )
    begin = pair.state({"heavy": [[0.0]], "light": [[3.0], [-40.0]]}, {"heavy": [[2.0]]})
    path = simulate(pair, begin, 2.0, 1e-2)
    assert path.v[-1].tolist() == pytest.approx([1.0, 3.0, 0.0])
    assert [e.bodies for e in path.events] == [(0, 1)]


def test_bodies_of_a_kind_leave_at_its_limit():
    heavy = line(3.0)
    light = System(line(1.0, "y").polyhedron, line(1.0, "y").kinetic, exits={"y": 1.0})
    system = Assembly({"heavy": heavy, "light": light}, {"heavy": 2, "light": 2})
    begin = system.state([0.0, 2.0, 0.5, -5.0], [5.0, 0.0, 1.0, 1.0])
    path = simulate(system, begin, 1.0, 1e-2)
    assert path["heavy"].present.all()
    assert path["light"].present[-1].tolist() == [False, True]
    assert [(e.bodies, e.kind) for e in path.events] == [((2,), EventKind.EXIT)]


def test_spheres_and_rods_in_space_keep_their_books():
    """Bodies of three and of six coordinates, of which these have an equation."""
    room = {"floor": HalfSpace([0, 0, 1], [0, 0, 0]), "side": HalfSpace([1, 0, 0], [0, 0, 0])}
    bodies = {"ball": sphere(0.5), "rod": capsule([-0.5, 0, 0], [0.5, 0, 0], 0.3)}
    system = Arrangement(bodies, room).system(
        gravity=[0, 0, -10], count={"ball": 3, "rod": 2}, restitution=1.0
    )
    balls = [[1, 1, 0.6], [2.2, 1, 0.6], [1, 2.2, 1.7]]
    rods = [[1.6, 1.0, 1.6, 1, 0, 0], [1.2, 2.2, 3.0, 0, 1, 0]]
    path = simulate(system, system.state({"ball": balls, "rod": rods}), 0.5, 5e-4)
    assert [kind.dimension for kind in system.bodies.kinds] == [3, 6]
    assert any(len(e.bodies) == 2 for e in path.of_kind(EventKind.IMPACT))
    np.testing.assert_allclose(np.linalg.norm(path["rod"].q[..., 3:], axis=2), 1.0, atol=1e-9)
    energy = path.kinetic + path.potential
    assert np.ptp(energy) < 1e-3 * path.kinetic.max()


def test_kinds_in_a_periodic_box_keep_energy_and_momentum():
    gas = Arrangement({"a": disc(0.5), "b": disc(0.3)}, period=[4.0, 4.0])
    system = gas.system(count={"a": 4, "b": 5}, restitution=1.0)
    rng = np.random.default_rng(0)
    places = np.array([(0.6 + 1.3 * i, 0.6 + 1.3 * j) for i in range(3) for j in range(3)])
    path = simulate(system, system.state(places.ravel(), rng.normal(size=18)), 3.0, 1e-3)
    masses = np.pi * np.repeat([0.25, 0.09], [4, 5])
    momentum = np.einsum("i,tik->tk", masses, path.v.reshape(len(path), 9, 2))
    assert len(path.of_kind(EventKind.IMPACT)) > 10
    np.testing.assert_allclose(momentum, momentum[[0]].repeat(len(path), 0), atol=1e-12)
    np.testing.assert_allclose(path.kinetic, path.kinetic[0], rtol=1e-12)


def test_towers_in_space_are_neighbours_of_what_is_near():
    """Of two columns of balls each has the one above and the one below as neighbours."""
    floor = {"floor": HalfSpace([0, 0, 1], [0, 0, 0])}
    system = Arrangement({"a": sphere(0.5), "b": sphere(0.5)}, floor).system(
        gravity=[0, 0, -10], count={"a": 6, "b": 6}
    )
    tower = np.array([(0.0, 0.0, 0.5 + i) for i in range(6)])
    engine = start(system, system.state({"a": tower, "b": tower + np.array([3.0, 0, 0])}), 1e-3)
    engine.advance(1)
    listed = engine.work.neighbours.pairs[: engine.work.neighbours.status[0]]
    assert sorted(map(tuple, listed.tolist())) == [(i, i + 1) for i in range(11) if i != 5]


def test_what_does_not_fit_is_refused_with_its_size(monkeypatch):
    listed = Arrangement({name: disc(1) for name in "ABCDEFGH"})
    many = Arrangement({"A": disc(1), "B": disc(2)}, BOX).system(count={"A": 200, "B": 2})
    state = many.state(np.concatenate([rows(200, 1.0)[:, :2].ravel(), [3, 90, 8, 90]]))
    monkeypatch.setattr(os, "sysconf", lambda _: 2**8)
    with pytest.raises(
        ValueError, match=r"bodies: .* the dense system of 16 coordinates and 28 gaps"
    ):
        listed.system()
    with pytest.raises(ValueError, match=r"count: .* the steps of 202 bodies with 606 gaps"):
        simulate(many, state, 1.0, 1e-3)


def test_bad_assemblies_are_refused():
    a, b = line(1.0), line(2.0)
    with pytest.raises(ValueError, match="count: expected a number for every kind, 'b' included"):
        Assembly({"a": a, "b": b}, {"a": 1})
    with pytest.raises(TypeError, match="scene: expected"):
        Assembly({"a": a}, {"a": 1}, scene=1j)
    with pytest.raises(ValueError, match="count: expected names among a, b; got c"):
        Assembly({"a": a, "b": b}, {"a": 1, "c": 1})
    system = Assembly({"a": a, "b": b}, {"a": 1, "b": 2})
    with pytest.raises(ValueError, match="q: expected placements of every kind, 'b' included"):
        system.state({"a": [[0.0]]})
    with pytest.raises(ValueError, match=r"q of 'b': expected shape \(2, 1\)"):
        system.state({"a": [[0.0]], "b": [[0.0]]})
    with pytest.raises(ValueError, match=r"contact 'right' of body 'b 2' overlaps by 10$"):
        system.state({"a": [[0.0]], "b": [[0.0], [60.0]]})
    apart = ContactFamily(
        {"meet": sympy.Abs(sympy.Symbol("x2", real=True) - sympy.Symbol("x1", real=True)) - 1}, 1.0
    )
    with pytest.raises(ValueError, match="between: expected pairs in the order of the kinds, a, b"):
        Assembly({"a": a, "b": b}, {"a": 1, "b": 2}, {("b", "a"): apart})
    touching = Assembly({"a": a, "b": b}, {"a": 1, "b": 2}, {("a", "b"): apart})
    overlap = r"bodies 'a 1' and 'b 2' overlap by 0\.5 at contact 'meet'"
    with pytest.raises(ValueError, match=overlap):
        touching.state({"a": [[0.0]], "b": [[5.0], [0.5]]})

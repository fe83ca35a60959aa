"""Attraction at the contacts of bodies, by name: its energy from distances, and what it holds."""

import math
from itertools import product

import numpy as np
import pytest

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, Hinge, capsule, disc, polygon
from polycorner.motion import Attraction

G = 9.81
CEILING = {"ceiling": HalfSpace([0, -1], [0, 0])}
GLUE = Attraction(force=2.0, range=0.3)
SQUARE = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def energy(gap, glue):
    """By quadrature of the force, on a grid finer than its corner at the range."""
    at = np.linspace(gap, glue.range, 20001) if gap < glue.range else np.zeros(2)
    pull = glue.force * np.clip(1 - np.maximum(at, 0) / glue.range, 0, 1)
    return -float(np.sum((pull[1:] + pull[:-1]) / 2 * np.diff(at)))


def ends(q, half=1.0):
    along = half * np.array([math.cos(q[2]), math.sin(q[2])])
    return q[:2] - along, q[:2] + along


def apart(point, a, b):
    share = np.clip((point - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return float(np.linalg.norm(point - a - share * (b - a)))


def test_the_potential_is_that_of_the_distances_of_all_contacts():
    bar = capsule([-1, 0], [1, 0], 0.1)
    a = Arrangement({"A": bar, "B": bar}, {"floor": HalfSpace([0, 1], [0, 0])})
    wide = Attraction(force=1.0, range=0.5)
    laws = {("A", "B"): GLUE, "floor": wide, "B.v2-floor": GLUE}
    system = a.system(gravity=[0, -G], density=0.0, masses={"A": 1, "B": 1}, attraction=laws)
    q = np.array([0.0, 0.35, 0.1, 0.4, 0.75, -0.05])
    one, two = ends(q[:3]), ends(q[3:])
    gaps = [apart(p, *two) - 0.2 for p in one] + [apart(p, *one) - 0.2 for p in two]
    heights = {f"{n}.v{k}": p[1] - 0.1 for n, e in zip("AB", (one, two), strict=True)
               for k, p in enumerate(e, 1)}  # fmt: skip
    expected = sum(energy(g, GLUE) for g in gaps) + G * (q[1] + q[4])
    expected += sum(energy(h, GLUE if n == "B.v2" else wide) for n, h in heights.items())
    assert min(gaps) < 0.3 < max(heights.values())
    assert system.energies(system.state(q))[1] == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize(
    "named", [GLUE, *({n: GLUE} for n in ("ceiling", "D", "D-ceiling", ("ceiling", "D")))]
)
@pytest.mark.parametrize("count", [1, 2, {"D": 2}])
def test_discs_hang_from_a_ceiling_under_any_name_of_the_contact(named, count):
    share = 0.75
    a = Arrangement({"D": disc(1.0)}, CEILING, orientations="all")
    weight = share * GLUE.force
    system = a.system(gravity=[0, -G], masses={"D": weight / G}, attraction=named, count=count)
    places = np.array([[0.0, -1.0, 0.0], [9.0, -1.0, 0.0]])
    q = {"D": places} if isinstance(count, dict) else places[:count]
    path = simulate(system, system.state(q), 0.2, 1e-2)
    assert abs(path.v).max() < 1e-12
    forces = [force for _, _, force in path.touching[-1]]
    assert forces == pytest.approx([GLUE.force - weight] * len(forces))


def test_repeated_bodies_are_pulled_as_listed_ones():
    """The work of what pulls repeated ones is what listed ones lose of their potential."""
    a, b = Arrangement({"D": disc(1.0)}), Arrangement({"A": disc(1.0), "B": disc(1.0)})
    repeated = a.system(count=2, attraction={"between": GLUE})
    listed = b.system(attraction={"A-B": GLUE})
    q, v = np.array([[0.0, 0.0], [2.2, 0.1]]), np.array([[0.0, 0.3], [0.2, 0.0]])
    paths = [
        simulate(repeated, repeated.state(q, v), 1.0, 1e-3),
        simulate(listed, listed.state(q.ravel(), v.ravel()), 1.0, 1e-3),
    ]
    np.testing.assert_allclose(paths[0].q.reshape(len(paths[0].q), -1), paths[1].q[:, 0], atol=2e-6)
    lost = paths[1].potential[0] - paths[1].potential
    assert np.ptp(lost) > 0.03
    np.testing.assert_allclose(paths[0].work["attraction"], lost, atol=1e-5)


def test_kinds_attract_each_other_by_pairs():
    """Of three kinds on a line, pulled apart, those that attract each other stay together."""
    bodies = {"A": disc(1.0), "B": disc(1.0), "C": disc(1.0)}
    a = Arrangement(bodies)
    system = a.system(
        count=dict.fromkeys(bodies, 1),
        attraction={("B", "A"): GLUE},
        forces={"A": [-1.5, 0], "C": [0.5, 0]},
    )
    places = {name: [[2.0 * k, 0]] for k, name in enumerate(bodies)}
    path = simulate(system, system.state(places), 0.2, 1e-3)
    (((pair, contact, force),),) = (path.touching[-1],)
    m = math.pi
    assert (pair, contact) == ((0, 1), "A1-B2")
    assert force == pytest.approx(GLUE.force - 0.75)  # half of 1.5 moves B
    assert path["C"].q[-1, 0, 0] == pytest.approx(4 + 0.25 * 0.2**2 / m)


def test_what_is_named_is_checked():
    a = Arrangement(
        {"A": disc(1.0), "S": SQUARE, "T": SQUARE},
        CEILING,
        joints={"pin": Hinge("world", "A", limits=(-1, 1))},
    )
    with pytest.raises(TypeError, match="attraction: expected an Attraction; got float"):
        a.system(attraction=2.0)
    for name in ("A-floor", "pin", "pin.max"):
        with pytest.raises(ValueError, match="attraction: expected names among"):
            a.system(attraction={name: GLUE})
    for laws, count in product((GLUE, {("S", "T"): GLUE}), (1, {"A": 1, "S": 1, "T": 1})):
        with pytest.raises(NotImplementedError, match="attraction: expected none between sharp"):
            a.system(attraction=laws, count=count)
    sharp = a.system(attraction={"S-ceiling": GLUE})
    assert {s.name for s in sharp.potential.free_symbols} == {"yS", "thetaS"}

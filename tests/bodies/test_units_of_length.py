"""A motion does not depend on the unit in which lengths are written."""

import numpy as np
import pytest

from polycorner import simulate
from polycorner.bodies import Arrangement, HalfSpace, Hinge, capsule, disc, polygon

BOX = np.array([[-0.5, -0.3], [0.5, -0.3], [0.5, 0.3], [-0.5, 0.3]])


def walls(unit, right=3.0):
    return {
        "floor": HalfSpace([0, 1], [0, 0]),
        "wall": HalfSpace([-1, 0], [right * unit, 0]),
    }


def a_box_that_tumbles(unit):
    a = Arrangement({"A": polygon(BOX * unit, 0.02 * unit)}, walls(unit), orientations="all")
    q = a.point({"A": ([0, unit], 0.4)})
    v = a.velocity(q, {"A": ([2 * unit, 0], 1.0)})
    return a, q, v, {"friction": 0.4, "restitution": 0.3}


def discs_that_pile_up(unit):
    bodies = {name: disc(r * unit) for name, r in zip("ABC", (0.5, 0.4, 0.3), strict=True)}
    a = Arrangement(bodies, walls(unit), orientations="all")
    at = {"A": [0, 0.6], "B": [1, 0.7], "C": [0.55, 1.6]}
    q = a.point({name: (np.array(x) * unit, 0.0) for name, x in at.items()})
    v = a.velocity(q, {"C": ([0.3 * unit, 0], 1.0)})
    return a, q, v, {"friction": 0.4, "restitution": 0.2}


def two_bars_that_hang(unit):
    bar = capsule([-unit, 0], [unit, 0], 0.1 * unit)
    joints = {
        "nail": Hinge("world", "A", at=[0, 3 * unit], on=[-unit, 0]),
        "elbow": Hinge("A", "B", at=[unit, 0], on=[-unit, 0], limits=(-2.5, 1.0)),
    }
    a = Arrangement({"A": bar, "B": bar}, walls(unit, 9.0), joints=joints)
    q = a.point(joints={"nail": 0.9, "elbow": -1.0})
    return a, q, a.velocity(q), {"friction": 0.3, "restitution": {"elbow": 0.5}}


@pytest.mark.parametrize("made", [a_box_that_tumbles, discs_that_pile_up, two_bars_that_hang])
def test_metres_centimetres_and_millimetres_give_one_motion(made):
    found = []
    for unit in (1.0, 100.0, 1000.0):
        a, q, v, laws = made(unit)
        system = a.system(gravity=[0, -9.81 * unit], **laws)
        path = simulate(system, system.state(q, v), 1.0, 1e-3, every=10)
        sizes = [1.0 if name.startswith("theta") else unit for name in a.manifold.names]
        found.append(((path.q[:, 0] / sizes), [(e.kind, e.contact) for e in path.events]))
    for places, events in found[1:]:
        assert places == pytest.approx(found[0][0], abs=2e-9)
        assert events == found[0][1]

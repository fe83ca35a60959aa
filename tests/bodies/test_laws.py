"""Coefficients by the names of what touches."""

from itertools import combinations

import numpy as np
import pytest

from polycorner.bodies import Arrangement, HalfSpace, capsule, disc, polygon
from polycorner.bodies.laws import Meeting, laws_of

ROD, STONE = capsule([-1, 0], [1, 0], 0.5), polygon([[0, 0], [2, 0], [1, 1.5]], 0.2)
WALLS = {"floor": HalfSpace([0, 1], [0, 0]), "wet wall": HalfSpace([1, 0], [-9, 0])}
THREE = Arrangement(
    {"A": disc(1), "B": ROD}, WALLS, {"post": disc(1, at=[0, -3])}, orientations="all"
)
MEETINGS = [
    Meeting("A-B", "A", "B"),
    Meeting("B.v1-floor", "B", "floor"),
    Meeting("B.v2-floor", "B", "floor"),
    Meeting("A-floor", "A", "floor"),
    Meeting("post-A", "post", "A"),
    Meeting("A-A", "A", "A", repeated=True),
    Meeting("B-B", "B", "B", repeated=True),
]
KEYS = [
    "A-B",
    ("B", "A"),
    "floor-B",
    "B.v2-floor",
    "floor",
    "post",
    "A",
    "B",
    "between",
    ("A", "A"),
]


def is_told(key, m):
    """How specific a name is about a contact, counted from 0; None if it is about another."""
    pair = key if isinstance(key, tuple) else tuple(key.split("-"))
    if key == m.contact:
        return 0
    if len(pair) == 2 and sorted(pair) == sorted([m.one, m.two]):
        return 1
    if key == "between" and m.repeated:
        return 2
    if key in {m.one, m.two}:
        return 4 if key in "AB" else 3
    return None


def of_definition(given, m):
    """The values of the most specific names, of which there should be one at most."""
    told = [(is_told(key, m), value) for key, value in given.items() if is_told(key, m) is not None]
    best = min((rank for rank, _ in told), default=None)
    return {value for rank, value in told if rank == best}


def test_the_most_specific_name_holds():
    count = 0
    for keys in (some for n in (1, 2, 3, 4) for some in combinations(KEYS, n)):
        given = {key: 0.1 * k for k, key in enumerate(keys, 1)}
        if {"A-B", ("B", "A")} <= set(keys):
            continue  # one value for the pair
        expected = {m.contact: of_definition(given, m) for m in MEETINGS}
        if any(len(values) > 1 for values in expected.values()):
            with pytest.raises(ValueError, match="a value for A-B, as those of 'A' and 'B' differ"):
                laws_of(given, 0, 0, MEETINGS, "AB")
            continue
        found = laws_of(given, given, given, MEETINGS, "AB")
        told = {contact: values.pop() for contact, values in expected.items() if values}
        assert found.restitution == told
        assert found.friction == found.rolling == {name: (mu, mu) for name, mu in told.items()}
        count += 1
    assert count > 100


def test_bodies_that_agree_need_no_pair():
    found = laws_of({"A": 0.3, "B": (0.3, 0.3)}, 0, 0, MEETINGS, "AB").friction
    assert found == dict.fromkeys((m.contact for m in MEETINGS), (0.3, 0.3))


def test_one_value_is_for_all():
    found = laws_of((0.3, 0.2), 0.1, 1, MEETINGS, "AB")
    assert [{*law.values()} for law in found] == [{(0.3, 0.2)}, {(0.1, 0.1)}, {1.0}, set()]
    assert all(len(law) == len(MEETINGS) for law in found if law)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"flor": 0.3},
            r"friction: expected names among A, B, floor, .*; got flor \(did you mean f",
        ),
        ({"A-flor": 0.3}, r"did you mean A-floor\?"),
        ({("A", "sky"): 0.3}, r"got \('A', 'sky'\)"),
        ({("A",): 0.3}, r"got \('A',\)"),
        ({("A", "B", "floor"): 0.3}, "got "),
        ({3: 0.3}, "got 3"),
        ({("post", "floor"): 0.3}, "got "),  # neither moves
        ({"A-B": 0.3, ("B", "A"): 0.2}, "one value for A-B"),
        ({"floor": -0.3}, "a coefficient >= 0"),
        ({"floor": (0.3, 0.4)}, "a smaller dynamic one"),
        ({"floor": "ice"}, "a coefficient >= 0"),
    ],
)
def test_what_no_contact_has_is_refused(given, message):
    with pytest.raises((ValueError, TypeError), match=message):
        laws_of(given, 0, 0, MEETINGS, "AB")


def test_without_repeated_bodies_nothing_is_between():
    with pytest.raises(ValueError, match=r"restitution: expected names among A, B.*got between"):
        laws_of(0, 0, {"between": 0.3}, [Meeting("A-B", "A", "B")], "AB")


def test_a_system_has_the_coefficients_of_its_walls():
    given = {"floor": 0.5, ("A", "post"): 0.25, "wet wall": (0.2, 0.1), "B-wet wall": 0}
    system = THREE.system(friction=given, restitution={"floor": 0.5, "B": 0.25})
    held = {f.load: (f.static.upper, f.moving.upper) for f in system.friction}
    assert held == {
        "A-floor": (0.5, 0.5),
        "B.v1-floor": (0.5, 0.5),
        "B.v2-floor": (0.5, 0.5),
        "A-post": (0.25, 0.25),
        "A-wet wall": (0.2, 0.1),
    }
    bounces = dict(zip(system.contacts, system.restitutions, strict=True))
    assert {bounces[f"B.v{k}-floor"] for k in (1, 2)} == {0.5}
    assert bounces["A-B"] == 0.25
    assert bounces["A-post"] == 0


@pytest.mark.parametrize("key", ["between", "S-S", ("S", "S"), "S"])
def test_repeated_bodies_are_a_pair_of_their_kind(key):
    stones = Arrangement({"S": STONE}, WALLS, orientations="all")
    system = stones.system(friction={key: 0.3}, restitution={key: 0.5}, count=2)
    assert [law.static.upper for law in system.between.friction] == [0.3]
    assert system.between.restitution == 0.5
    assert len(system.friction) == (6 if key == "S" else 0)


def test_images_belong_to_the_pair():
    rods = Arrangement([capsule([-0.5, 0], [0.5, 0], 0.1)] * 2, period=[1.5, 4.0])
    system = rods.system(restitution={("1", "2"): 0.5})
    names = dict(zip(system.contacts, system.restitutions, strict=True))
    assert {name for name, e in names.items() if e == 0} == {
        name
        for name in names
        if {part.split(".")[0].split("[")[0] for part in name.split("-")} != {*"12"}
    }
    assert np.count_nonzero(system.restitutions) > 4

"""What values look like in a shell and in a notebook: they fit a screen, however large they are."""

import math
import re
from html.parser import HTMLParser

import pytest

from polycorner import Manifold, Polyhedron, simulate
from polycorner.bodies import (
    Arrangement,
    Cylinder,
    HalfSpace,
    box,
    capsule,
    compound,
    disc,
    polygon,
)
from polycorner.models import CirclesIn, LennardJones, PeriodicPacking, SphereCluster, TorusDisks
from polycorner.proofs import corners, stationary_points

SQUARE = polygon([[-1, -1], [1, -1], [1, 1], [-1, 1]], 0.1)
STONE = compound({"a": SQUARE, "b": disc(0.5, at=[2, 0]), "c": capsule([0, 0], [0, 2], 0.2)})
PLANE = Manifold.euclidean("x y")
BOWL = Polyhedron(PLANE, {"disc": 4 - sum(c**2 for c in PLANE.symbols), "half": PLANE.symbols[1]})
LINES, COLUMNS, LINE = 50, 130, 450


def crowd(count):
    walls = box([-90, -90], [90, 90]) | {
        "ring": Cylinder(99.0),
        "slope": HalfSpace([1, 1], [-200, 0]),
    }
    return Arrangement(
        {f"S{k}": STONE for k in range(count)}, walls, {"post": SQUARE.moved([9, 9])}
    )


def motion():
    a = Arrangement({f"D{k}": disc(1) for k in range(5)}, box([0, 0], [99, 9]), orientations="all")
    system = a.system(gravity=[0, -10], friction=0.3)
    return simulate(
        system, system.state(a.point({f"D{k}": [3 * k + 2, 1] for k in range(5)})), 0.01, 1e-3
    )


LARGE = {
    "manifold": lambda: Manifold.euclidean([f"coordinate_{k}" for k in range(500)]),
    "placements": lambda: crowd(3).polyhedron,
    "arrangement": lambda: crowd(40),
    "system": lambda: crowd(2).system(friction=0.3, rolling=0),
    "repeated": lambda: Arrangement({"S": STONE}, box([0, 0], [9, 9])).system(
        friction=0.3, count=3
    ),
    "motion": motion,
    "body": lambda: STONE,
    "packing": lambda: PeriodicPacking([1.0] * 500, 3, 99.0),
    "circles": lambda: CirclesIn("square", 90),
    "disks": lambda: TorusDisks(5),
    "cluster": lambda: SphereCluster(9),
    "atoms": lambda: LennardJones(6),
    "stationary points": lambda: stationary_points(BOWL, sum(PLANE.symbols), box=[(-3, 3)] * 2),
    "corners": lambda: corners(BOWL, box=[(-3, 3)] * 2),
}


@pytest.fixture(scope="module", params=sorted(LARGE))
def large(request):
    return LARGE[request.param]()


def test_a_value_fits_one_line_and_one_screen(large):
    assert len(repr(large)) <= LINE
    assert "\n" not in repr(large)
    lines = str(large).splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= COLUMNS or lines == [repr(large)]


class Balanced(HTMLParser):
    """Counts elements, each of which has to be closed, and rows."""

    def __init__(self):
        super().__init__()
        self.open, self.rows = [], 0

    def handle_starttag(self, tag, _):
        self.open.append(tag)
        self.rows += tag == "tr"

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_a_notebook_shows_tables(large):
    if not hasattr(large, "_repr_html_"):
        pytest.skip("a short value")
    seen = Balanced()
    seen.feed(large._repr_html_())
    assert not seen.open
    assert 0 < seen.rows <= LINES


def test_what_a_proved_list_says_is_its_representation():
    """A generated one, with all fields, does not hide the one that is written."""
    for name in ("stationary points", "corners"):
        assert re.match(r"\w+List\(Proved: .* exactly \d", repr(LARGE[name]()))


def test_few_coordinates_are_written_as_they_are_made():
    M = Manifold.euclidean("x y") * Manifold(("phi",), (math.tau,), (1.0,))
    assert eval(repr(M), {"Manifold": Manifold, "inf": math.inf}) == M
    D = Polyhedron(M, {"left": M.symbols[0]})
    assert repr(D) == "Polyhedron(['x', 'y', 'phi']: ['left'] >= 0)"


def test_representations_name_what_there_is():
    a = Arrangement({"stone": STONE}, {"floor": HalfSpace([0, 2], [0, 3])}, orientations="all")
    assert repr(a) == "Arrangement(bodies stone; walls floor)"
    assert "y >= 3" in str(a)
    assert "3 parts" in str(a)
    system = a.system(friction=(0.3, 0.2), restitution=0.5, gravity=[0, -10])
    assert repr(system).startswith(
        "System(1 body stone; 3 coordinates; 7 contacts; 7 laws of friction"
    )
    assert "sliding Interval(lower=-0.3, upper=0.3), then Interval(lower=-0.2" in str(system)
    assert "0.5" in str(system)

"""Landscapes in files: read to the last bit, and refused where functions differ."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from kept_files import rewritten
from landscape_values import DISC, WELLS, X, Y, a_pass, double_well, minimum, tree

from polycorner import AnyOf, Manifold, Polyhedron
from polycorner.files import load_landscape, save_landscape
from polycorner.files.landscapes import KIND
from polycorner.landscapes import Landscape, Side
from polycorner.minimisation.problem import pose

SPHERE = Manifold.sphere("u")
U = SPHERE.symbols
PLAIN = Landscape(WELLS, (), (), proved=False, cap=-inf, notes=("nothing was found",))


def everything():
    """Return a landscape with all kinds of minima and passes, and numbers of all sizes."""
    energy = WELLS.energy.value
    third = (1 / 3, np.nextafter(0.5, 1))
    at, over = float(energy(third)), float(energy((0, 0)))
    minima = (
        minimum(third, (at, np.nextafter(at, inf)), active=("rim", "x > 0")),
        minimum(third, at, kind="locus", orbit=-3),
    )
    sides = double_well().passes[0].sides
    passes = [
        a_pass((0, 0), over, (side, Side(None)), kind=kind, orbit=k)
        for k, (kind, side) in enumerate(
            zip(("saddle", "tip", "locus"), (*sides, Side(1)), strict=True)
        )
    ]
    passes.append(a_pass((0, 0), over, (0, -1), kind="exit", index=None))
    passes.append(a_pass((0, 0), (-inf, inf), (), kind="undecided", index=None))
    return Landscape(WELLS, minima, tuple(passes), True, 1e300, True, ("one", "two"))


def same(one, other):
    for key in ("proved", "cap", "region", "notes"):
        assert getattr(one, key) == getattr(other, key)
    for kind in ("minima", "passes"):
        for a, b in zip(getattr(one, kind), getattr(other, kind), strict=True):
            np.testing.assert_array_equal(a.point, b.point)
            fields = (
                "energy",
                "active",
                "kind",
                "orbit",
                *(("index",) if kind == "passes" else ()),
            )
            assert [getattr(a, f) for f in fields] == [getattr(b, f) for f in fields]
            for s, t in zip(getattr(a, "sides", ()), getattr(b, "sides", ()), strict=True):
                assert s.minimum == t.minimum
                assert (s.route is None) == (t.route is None)
                if s.route is not None:
                    np.testing.assert_array_equal(s.route.vertices, t.route.vertices)
                    np.testing.assert_array_equal(s.route.energies, t.route.energies)
                    assert (s.route.top, s.route.verified) == (t.route.top, t.route.verified)


@pytest.mark.parametrize("found", [double_well(), everything(), PLAIN])
def test_a_landscape_is_read_to_the_last_bit(found, tmp_path):
    path = save_landscape(found, tmp_path / "landscape.json")
    read = load_landscape(path)
    same(read, found)
    assert read.problem.polyhedron.names == found.problem.polyhedron.names
    assert save_landscape(read, tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_what_is_asked_of_it_is_the_same(tmp_path):
    found = double_well()
    read = load_landscape(save_landscape(found, tmp_path / "l.json"))
    one, other = found.barrier(0, 1), read.barrier(0, 1)
    assert (one.lower, one.upper, one.rise, one.proved) == (
        *(other.lower, other.upper, other.rise, other.proved),
    )
    np.testing.assert_array_equal(one.route.vertices, other.route.vertices)
    assert str(read) == str(found)


def test_spheres_and_unions_are_read(tmp_path):
    either = Polyhedron(SPHERE, [AnyOf(U[0], U[1])])
    low = minimum((0.6, 0.0, -0.8), (-0.8, -0.8), active=(either.names[1],))
    found = Landscape(pose(either, U[2]), (low,), (), True)
    same(load_landscape(save_landscape(found, tmp_path / "l.json")), found)


def test_ones_own_problem_may_be_passed(tmp_path):
    path = save_landscape(double_well(), tmp_path / "l.json")
    for arguments in ((DISC,), (DISC, WELLS.energy), (None, WELLS.energy)):
        same(load_landscape(path, *arguments), double_well())


WIDER = Polyhedron(DISC.manifold, {"rim": 17 - X**2 - Y**2, "post": DISC.functions[1].expression})


@pytest.mark.parametrize(
    ("polyhedron", "energy", "what"),
    [
        (None, WELLS.energy.expression + X / 1000, r"'energy' at minima\[0\]"),
        (Polyhedron(DISC.manifold, {"rim": 17 - X**2 - Y**2}), None, "functions: written rim"),
        (WIDER, None, r"'rim' at minima\[0\]: written 14\.9\d*, found 15\.9"),
    ],
)
def test_another_problem_is_refused(polyhedron, energy, what, tmp_path):
    path = save_landscape(double_well(), tmp_path / "l.json")
    with pytest.raises(ValueError, match=rf"^path: .*l\.json is of another .*: {what}"):
        load_landscape(path, polyhedron, energy)


DAMAGES = [
    (lambda c: c.pop("minima"), "minima"),
    (lambda c: c["minima"][0].update(point=[0.0]), r"minima\[0\].point"),
    (lambda c: c["minima"][0].update(energy=[1.0, 0.0]), r"minima\[0\].energy"),
    (lambda c: c["minima"][0].update(energy=["nan", 0.0]), r"minima\[0\].energy"),
    (lambda c: c["minima"][0].update(energy=[5.0, 6.0]), r"energy of minima\[0\]"),
    (lambda c: c["minima"][0].update(kind="well"), r"minima\[0\].kind"),
    (lambda c: c["minima"][0].update(active=[7]), r"minima\[0\].active\[0\]"),
    (lambda c: c["minima"][0].update(orbit=0.5), r"minima\[0\].orbit"),
    (lambda c: c["passes"][0].update(index=0.5), r"passes\[0\].index"),
    (lambda c: c["passes"][0]["sides"][0].update(minimum=2), r"passes\[0\].sides\[0\].minimum"),
    (lambda c: c["passes"][0]["sides"][0].update(minimum=-1), "region"),
    (lambda c: c["passes"][0]["sides"][0]["route"].update(verified=1), "verified"),
    (lambda c: c["passes"][0]["sides"][0]["route"].update(top=0.5), "top of a route"),
    (lambda c: c["passes"][0]["sides"][0]["route"].update(vertices=[]), "vertices"),
    (lambda c: c["passes"][0]["sides"][0]["route"]["energies"].pop(), "vertices"),
    (lambda c: c["passes"][0]["sides"][1]["route"]["vertices"][3].reverse(), "along a route"),
    (lambda c: c.update(proved="yes"), "proved"),
    (lambda c: c.update(problem=[]), "problem"),
]


@pytest.mark.parametrize(("damage", "place"), DAMAGES)
def test_each_number_is_checked(damage, place, tmp_path):
    path = save_landscape(double_well(), tmp_path / "l.json")
    rewritten(KIND, path, damage)
    with pytest.raises(ValueError, match=rf"^path: [^\n]*l\.json[^\n]*{place}[^\n]*$"):
        load_landscape(path)


def test_another_file_is_refused(tmp_path):
    path = save_landscape(tree([], []), tmp_path / "l.json")
    path.write_text(path.read_text().replace('"cap": ', '"cap": 1'))
    with pytest.raises(ValueError, match="was changed after it was written"):
        load_landscape(path)


@pytest.mark.parametrize("euler", [None, -1])
def test_the_euler_characteristic_is_kept(euler, tmp_path):
    kept = save_landscape(replace(double_well(), euler=euler), tmp_path / "l.json")
    assert load_landscape(kept).euler == euler

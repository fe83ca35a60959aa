"""Every claim about a critical configuration is checked from the definition."""

import copy
import json
import math
import pickle
from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest
from disk_oracles import (
    SEARCHED,
    contact_distance,
    contact_vector,
    differenced,
    found,
    labelled_copies,
    least_distance,
    plane,
)
from scipy.optimize import linprog

from polycorner import Verdict, certify, stratum_at
from polycorner.models.disks.configurations import described
from polycorner.models.disks.critical import CriticalSearch
from polycorner.models.disks.disks import TorusDisks

EACH = [
    pytest.param(*searched, k, id=f"{searched[0]}-{searched[1]}-{k}")
    for searched, number in SEARCHED.items()
    for k in range(number)
]


@pytest.mark.parametrize(("count", "lattice"), SEARCHED.keys())
def test_how_many_there_are(count, lattice):
    assert len(found(count, lattice)) == SEARCHED[count, lattice]


@pytest.mark.parametrize(
    ("lattice", "expected"),
    [
        # Two disks: tau is the distance of x_2 - x_1 from the lattice.  It is critical at the
        # circumcentres of the Delaunay cells (maxima) and the midpoints of their edges (saddles).
        ("square", [(math.sqrt(2) / 4, 0), (1 / 4, 1)]),
        ("hexagonal", [(1 / (2 * math.sqrt(3)), 0), (1 / 4, 1)]),
    ],
)
def test_two_disks_in_closed_form(lattice, expected):
    configurations = found(2, lattice)
    assert [c.index for c in configurations] == [index for _, index in expected]
    radii = [c.radius for c in configurations]
    np.testing.assert_allclose(radii, [radius for radius, _ in expected], atol=1e-12)


@pytest.mark.parametrize(
    ("count", "expected"),
    [
        # Radius, index and rattlers from the database of [HDC], whose radii have 6 to 15 digits.
        (2, [(0.288675134594813, 0, 0), (0.25, 1, 0)]),
        (3, [(0.288675134594813, 0, 0), (0.25, 1, 0), (0.166666666666667, 2, 0)]),
        (
            4,
            [
                (0.25, 0, 0),
                (0.217709804308227, 1, 0),
                (0.217129038747392, 2, 0),
                (0.216506350946272, 3, 0),
                (0.183012017908369, 1, 0),
                (0.178410153240889, 2, 0),
                (0.166666666666667, 2, 1),
                (0.125, 3, 0),
            ],
        ),
    ],
)
def test_hexagonal_torus_against_the_literature(count, expected):
    configurations = found(count, "hexagonal")
    ours = [(c.index, len(c.rattlers)) for c in configurations]
    assert ours == [(index, rattlers) for _, index, rattlers in expected]
    radii = [c.radius for c in configurations]
    np.testing.assert_allclose(radii, [radius for radius, _, _ in expected], atol=1.5e-6)


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_nothing_overlaps_and_all_contacts_are_named(count, lattice, k):
    c = found(count, lattice)[k]
    assert least_distance(c.point[:-1], lattice) == pytest.approx(2 * c.radius, abs=1e-12)
    assert c.point[-1] == c.radius
    points = plane(c.point[:-1], lattice)
    touching = set()
    for i, j in combinations(range(count), 2):
        for p, q in product(range(-3, 4), repeat=2):
            name = f"{i + 1}-{j + 1}({p},{q})"
            apart = np.linalg.norm(contact_vector(name, points, lattice)[2])
            if apart < 2 * c.radius + 1e-9:
                touching.add(name)
    assert set(c.contacts) == set(c.stress) == touching


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_forces_balance_on_every_disk(count, lattice, k):
    c = found(count, lattice)[k]
    points = plane(c.point[:-1], lattice)
    total = np.zeros_like(points)
    for name, force in c.stress.items():
        i, j, vector = contact_vector(name, points, lattice)
        unit = vector / np.linalg.norm(vector)
        total[i] -= force * unit
        total[j] += force * unit
    np.testing.assert_allclose(total, 0, atol=1e-12)
    assert min(c.stress.values()) >= 0
    assert sum(c.stress.values()) == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_no_motion_opens_all_contacts_at_once(count, lattice, k):
    """A linear programme on differences of the distances: the fastest common growth is zero."""
    c = found(count, lattice)[k]
    x = plane(c.point[:-1], lattice).ravel()
    rows = [differenced(lambda y, n=n: contact_distance(n, y, lattice), x) for n in c.contacts]
    cost = np.zeros(len(x) + 1)
    cost[-1] = -1
    limits = np.hstack([-np.array(rows), np.ones((len(rows), 1))])
    bounds = [(-1, 1)] * len(x) + [(None, None)]
    best = linprog(cost, A_ub=limits, b_ub=np.zeros(len(rows)), bounds=bounds)
    assert -best.fun == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_index_and_nullity_from_differences(count, lattice, k):
    c = found(count, lattice)[k]
    x = plane(c.point[:-1], lattice).ravel()
    loaded = {name: force for name, force in c.stress.items() if force > 0}

    def lagrangian(y):
        return sum(force * contact_distance(name, y, lattice) for name, force in loaded.items())

    rows = [differenced(lambda y, n=n: contact_distance(n, y, lattice), x) for n in loaded]
    rows += [np.tile(axis, count) for axis in np.eye(2)]
    _, singular, right = np.linalg.svd(np.array(rows))
    free = right[(singular > 1e-5).sum() :].T
    hessian = differenced(lambda y: differenced(lagrangian, y, 1e-3), x, 1e-3)
    curvature = np.linalg.eigvalsh(free.T @ hessian @ free)
    assert (curvature > 1e-3).sum() == c.index
    assert (abs(curvature) < 1e-3).sum() == c.nullity
    assert c.nullity == 2 * (len(c.components) - 1)


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_the_certificate_of_the_largest_radius_agrees(count, lattice, k):
    """Multipliers of ``-r`` are half the stress; index 0 is a maximum, others are saddles.

    Where multipliers are many, the certificate may leave a saddle undecided.
    """
    c, model = found(count, lattice)[k], TorusDisks(count, lattice)
    certificate = certify(model.polyhedron, model.energy, c.point)
    if c.index == 0:
        assert certificate.verdict is Verdict.MINIMUM_ALONG_LOCUS
    else:
        left_open = {Verdict.UNDECIDED} if c.stresses > 1 else set()
        assert certificate.verdict in {Verdict.SADDLE} | left_open
    if c.stresses == 1:
        for name, force in c.stress.items():
            assert 2 * certificate.multipliers[name] == pytest.approx(force, abs=1e-9)


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_the_face_has_the_dimension_that_index_and_nullity_say(count, lattice, k):
    c, model = found(count, lattice)[k], TorusDisks(count, lattice)
    face = stratum_at(model.polyhedron, c.point)
    assert set(face.active) == set(c.contacts)
    assert not c.idle
    assert face.dimension == c.index + c.nullity + 2


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_components_move_freely_and_alone(count, lattice, k):
    c, model = found(count, lattice)[k], TorusDisks(count, lattice)
    rng = np.random.default_rng(3)
    for part in c.components if c.nullity else ():
        moved = c.point.copy()
        moved[:-1].reshape(-1, 2)[[i - 1 for i in part]] += 1e-4 * rng.normal(size=2)
        assert model.radius(moved) == pytest.approx(c.radius, abs=1e-12)


@pytest.mark.parametrize(("count", "lattice", "k"), EACH)
def test_copies_are_recognised(count, lattice, k):
    """A turned, moved and relabelled copy, judged from nothing, is the same configuration."""
    c, model = found(count, lattice)[k], TorusDisks(count, lattice)
    rng = np.random.default_rng(k)
    for _ in range(3):
        centres = c.point[:-1].reshape(-1, 2)[rng.permutation(count)]
        copy = described(model, (centres @ rng.choice(model.point_group).T + rng.random(2)).ravel())
        assert model.same(c, copy)
        assert (copy.index, copy.nullity) == (c.index, c.nullity)
        assert copy.degenerate == c.degenerate
        assert sorted(copy.stress.values()) == pytest.approx(sorted(c.stress.values()), abs=1e-8)


@pytest.mark.parametrize(("count", "lattice"), SEARCHED.keys())
def test_configurations_are_distinct(count, lattice):
    model = TorusDisks(count, lattice)
    for one, other in combinations(found(count, lattice), 2):
        assert not model.same(one, other)


def test_equal_radii_do_not_make_configurations_equal():
    """On the square torus three disks have radius 1/4 in a row with a rattler, and in an L."""
    quarter = [c for c in found(3, "square") if abs(c.radius - 0.25) < 1e-9]
    assert [(c.index, c.nullity, c.stresses, c.degenerate) for c in quarter] == [
        (1, 2, 1, False),
        (2, 0, 2, True),
    ]
    model = TorusDisks(3)
    alike = replace(quarter[0], index=2, nullity=0, stresses=2, components=((1, 2, 3),))
    assert not model.same(alike, quarter[1])


def test_radii_tell_configurations_apart():
    model, c = TorusDisks(3), found(3, "square")[0]
    assert not model.same(c, replace(c, radius=c.radius + 1e-5))
    assert model.same(c, replace(c, radius=c.radius + 1e-5), tolerance=1e-4)


@pytest.mark.parametrize(("count", "lattice"), list(SEARCHED)[:-1])
def test_another_seed_finds_the_same(count, lattice):
    model = TorusDisks(count, lattice)
    ones, others = found(count, lattice), found(count, lattice, seed=1)
    assert len(ones) == len(others)
    for one in ones:
        assert sum(model.same(one, other) for other in others) == 1


@pytest.mark.parametrize(
    ("count", "lattice"), [(2, "square"), (2, "hexagonal"), (3, "hexagonal"), (4, "hexagonal")]
)
def test_indices_add_up_to_the_euler_characteristic(count, lattice):
    """Labelled critical points modulo translations, with signs, count the space of all points.

    That space is the configurations of n - 1 points on the torus without the origin, of Euler
    characteristic ``(-1)^(n-1) (n-1)!``: each further point leaves one less.  The only family
    here, four disks with three in a row, has an annulus of places for the rattler: it counts 0.
    """
    isolated = [c for c in found(count, lattice) if c.nullity == 0]
    assert not any(c.degenerate for c in isolated)
    total = sum((-1) ** c.index * labelled_copies(c, lattice) for c in isolated)
    assert total == (-1) ** (count - 1) * math.factorial(count - 1)


def test_rattlers_are_put_where_there_is_room():
    """Two disks in a row on the square torus leave room for two more of radius 1/4."""
    model = TorusDisks(4)
    centres = np.array([-0.25, -0.25, 0.25, -0.25, 0.0, 0.26, 0.5, 0.24])
    c = described(model, centres)
    assert (c.radius, c.index, c.nullity, c.degenerate) == (0.25, 1, 4, False)
    assert c.rattlers == (3, 4)
    assert model.same(c, described(model, np.append(centres[:-1], 0.23)))
    assert described(model, np.append(centres[:-2], [0.4, 0.24])) is None


def test_one_disk_touches_its_own_image():
    (c,) = TorusDisks(1, "hexagonal").critical(np.random.default_rng(0))
    assert (c.radius, c.index, c.contacts, c.stress) == (0.5, 0, ("own",), {"own": 1.0})
    assert stratum_at(TorusDisks(1, "hexagonal").polyhedron, c.point).active == ("own",)


def test_progress_is_told():
    told = []
    TorusDisks(2).critical(np.random.default_rng(0), starts=20, progress=lambda *a: told.append(a))
    assert told[0] == (1, None, "2 critical configurations")
    assert [done for done, *_ in told] == list(range(1, len(told) + 1))


class TestResuming:
    """A search that is saved after every round, read back and copied ends as the one in one go."""

    @staticmethod
    def rounds(model, keep, starts=None):
        search = model.critical_search(0, starts=starts)
        while not search.complete:
            search = keep(search.advanced())
        return search.configurations

    @pytest.mark.parametrize(
        "keep",
        [
            lambda search: CriticalSearch.restored(
                search.model, json.loads(json.dumps(search.record))
            ),
            lambda search: pickle.loads(pickle.dumps(search)),
            copy.deepcopy,
        ],
        ids=["record", "pickle", "copy"],
    )
    def test_the_same_configurations_are_found(self, keep):
        whole = TorusDisks(3).critical(0, starts=40)
        again = self.rounds(TorusDisks(3), keep, starts=40)
        assert [(c.index, c.nullity, c.contacts, c.hits) for c in again] == [
            (c.index, c.nullity, c.contacts, c.hits) for c in whole
        ]
        for one, other in zip(again, whole, strict=True):
            np.testing.assert_allclose(one.point, other.point, atol=1e-12)

    def test_a_round_leaves_the_search_it_started_from_as_it_was(self):
        search = TorusDisks(2).critical_search(0, starts=20)
        before = search.record
        first, second = search.advanced(), search.advanced()
        assert search.record == before
        assert first.record == second.record

    def test_a_record_whose_numbers_were_changed_is_refused(self):
        record = TorusDisks(2).critical_search(0, starts=20).advanced().record
        record["stage"][0]["centres"][0] += 0.01
        with pytest.raises(ValueError, match="not critical"):
            CriticalSearch.restored(TorusDisks(2), record)

    def test_one_disk_needs_no_round(self):
        search = TorusDisks(1).critical_search()
        assert search.complete
        assert search.advanced() is search
        assert len(search.configurations) == 1

    def test_configurations_are_read_only(self):
        (c,) = TorusDisks(1).critical()
        with pytest.raises(ValueError, match="read-only"):
            c.point[0] = 0.0

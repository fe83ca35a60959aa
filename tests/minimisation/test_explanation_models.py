"""Explanations on the models: names and numbers against independent computations."""

import re

import numpy as np
import pytest
from explanations import NUMBER, direction, figures, opening_rates, sentence
from oracles import CONTACTS, balls, gaps
from polynomials import linear

from polycorner import certify, minimise
from polycorner.dumbbells import DumbbellPair
from polycorner.models import Pinball, Tutorial


def test_every_corner_of_the_tutorial_region():
    """Pulled to each side in turn: multipliers from the two walls' normals."""
    region = Tutorial()
    D = region.polyhedron
    for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False) + 0.1:
        pull = np.array([np.cos(angle), np.sin(angle)])
        energy = linear(region.manifold, pull, 0.0, "energy")
        for point in region.corners().values():
            c = certify(D, energy, point)
            held = [D.names.index(name) for name in c.active]
            lam = np.linalg.solve(D.gradients(point)[held].T, pull)
            text = c.explain()
            negative = {D.names[i]: -value for i, value in zip(held, lam, strict=True) if value < 0}
            assert opening_rates(text) == pytest.approx(negative, rel=1e-5)
            assert text.startswith("Not a minimum" if negative else "Strict local minimum")


def test_corners_of_the_pinball_board():
    board = Pinball()
    for point in board.corners():
        c = certify(board.polyhedron, board.energy, point)
        text = c.explain()
        meet = len(c.stratum.pieces)
        assert ("branches of the union meet" in text) == (meet > 1)
        for piece in c.stratum.pieces:
            assert ", ".join(piece) in text
        fall = [
            line for line in text.splitlines() if line.startswith("The energy decreases fastest")
        ]
        assert bool(fall) == (not c.is_minimum)
        for line in fall:
            way = direction(line, board.manifold)
            lower = point + 1e-3 * way
            assert board.energy.value(lower) < board.energy.value(point)
            assert board.polyhedron.contains(lower, tolerance=2e-6)


def slopes(f, q, step=1e-5):
    """Return central differences of ``f`` along every coordinate, one column each."""
    sides = step * np.eye(len(q))
    return np.stack([(f(q + d) - f(q - d)) / (2 * step) for d in sides], axis=-1)


def from_outside(pair, q, names):
    """Return multipliers of contacts by least squares, from the definition of the gaps."""
    rows = slopes(lambda p: gaps(pair, p), q)[[CONTACTS.index(name) for name in names]]
    pull = slopes(lambda p: balls(pair, p)[:, 2].sum(), q)
    return dict(zip(names, np.linalg.lstsq(rows.T, pull, rcond=None)[0], strict=True))


@pytest.mark.parametrize("rod", [1.5, 2.85, 2.93, 2.96])
def test_the_pair_below_and_beyond_the_critical_rod(rod):
    """The critical rod radius is 2 r sqrt(1 - r^2/l^2) - r = 2.8936 mm."""
    from polycorner.dumbbells import dyad_minima

    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=rod, drum_radius=125)
    c = dyad_minima(pair)[0].certificate
    text = c.explain(unit="mm")
    lam = from_outside(pair, c.point, c.active)
    assert c.active == ("A2B1", "A2b", "aB1")
    if rod < 2.8936:
        assert text.startswith("Local minimum, attained along a locus")
        for name, value in lam.items():
            (told,) = re.findall(rf"{NUMBER} d\({name}\)", text)
            assert float(told) == pytest.approx(value, rel=1e-4)
        assert "free: eta1+eta2." in text
    else:
        negative = {name: -value for name, value in lam.items() if value < 0}
        assert negative
        assert opening_rates(text) == pytest.approx(negative, rel=1e-3)
        assert "per mm: its multiplier is negative" in text


def test_a_pair_near_its_corner_and_one_that_overlaps():
    pair = DumbbellPair(length=16, ball_radius=3, rod_radius=1.5, drum_radius=125)
    c = minimise(pair.polyhedron, pair.energy, pair.nested("R"))
    apart = c.point + np.array([0.01, 0, 0, 0, 0, 0])
    text = certify(pair.polyhedron, pair.energy, apart).explain()
    assert "in the interior of the polyhedron" in text
    pull = slopes(lambda p: balls(pair, p)[:, 2].sum(), apart)
    (rate,) = figures(sentence(text, "decreases fastest"), "at the rate")
    assert rate == pytest.approx(np.linalg.norm(pull * pair.manifold.scales), rel=1e-4)
    inside = c.point + np.array([0, -0.5, 0, 0, 0.5, 0])
    depth = gaps(pair, inside)
    away = depth / np.linalg.norm(
        slopes(lambda p: gaps(pair, p), inside) * pair.manifold.scales, axis=1
    )
    text = certify(pair.polyhedron, pair.energy, inside).explain(unit="mm")
    worst = int(away.argmin())
    (told,) = re.findall(rf"the inequality {CONTACTS[worst]}: its function is {NUMBER} mm", text)
    assert float(told) == pytest.approx(depth[worst], rel=1e-4)

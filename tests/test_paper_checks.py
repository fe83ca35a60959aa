"""Every check runs, and each can fail: a perturbed claim gets another verdict."""

import math
from dataclasses import replace

import numpy as np
import pytest

from paper_checks import CLAIMS, Outcome, energetics

OUTCOMES = {
    "E2": Outcome.HOLDS,
    "E3": Outcome.HOLDS,
    "E4": Outcome.CORRECTED,
    "E5": Outcome.HOLDS,
    "E6": Outcome.CORRECTED,
    "E9": Outcome.REFUTED,
    "L7": Outcome.REFUTED,
}
THICK = replace(energetics.EXPERIMENT, rod_radius=2.95)


@pytest.mark.parametrize("claim", CLAIMS, ids=lambda claim: claim.id)
def test_outcome(claim):
    finding = claim.check()
    assert finding.outcome is OUTCOMES[claim.id]
    assert finding.evidence
    assert all(math.isfinite(figure) for figure in finding.figures.values())


def test_thick_rods_refute_that_the_corners_are_minima():
    assert energetics.corners_are_minima(THICK).outcome is Outcome.REFUTED


def test_a_pair_that_is_not_balanced_is_noticed(monkeypatch):
    def tilted(pair):
        first, *rest = energetics_minima(pair)
        moved = first.point + np.array([1e-6, 0, 0, 0, 0, 1e-6])
        certificate = replace(first.certificate, point=moved)
        return (replace(first, certificate=certificate), *rest)

    energetics_minima = energetics.dyad_minima
    monkeypatch.setattr(energetics, "dyad_minima", tilted)
    assert energetics.pair_is_balanced_and_parallel().outcome is Outcome.REFUTED


def test_the_right_heading_holds_and_a_wrong_one_is_corrected():
    def plane(pair):
        return math.degrees(pair.plane_corner()[0])

    far = replace(energetics.EXPERIMENT, drum_radius=2000.0)
    assert energetics.heading_is(plane, far).outcome is Outcome.HOLDS
    assert energetics.heading_is(lambda pair: plane(pair) + 0.1, far).outcome is Outcome.CORRECTED


def test_the_slope_vanishes_at_the_global_minimum(monkeypatch):
    *_, ends = energetics.dyad_minima(energetics.EXPERIMENT)
    monkeypatch.setattr(energetics, "dyad_minima", lambda _: (ends,))
    assert energetics.energy_slopes_at_the_corner().outcome is Outcome.REFUTED


def test_the_right_signature_holds():
    assert energetics.signature_is((3, 2, 1)).outcome is Outcome.HOLDS
    assert energetics.signature_is((2, 3, 1)).outcome is Outcome.CORRECTED


def test_thin_rods_alone_would_not_refute():
    assert energetics.corner_is_a_minimum_for((0.1, 0.5)).outcome is Outcome.HOLDS


def test_an_energy_that_does_not_weigh_rods_at_their_middle_would_turn_the_pair(monkeypatch):
    def off_centre(pair):
        first, *rest = true_minima(pair)
        turned = first.point + 1e-6 * pair.rod_weight * np.array([0, 0, 1, 0, 0, 1])
        return (replace(first, certificate=replace(first.certificate, point=turned)), *rest)

    true_minima = energetics.dyad_minima
    monkeypatch.setattr(energetics, "dyad_minima", off_centre)
    assert energetics.rod_weight_turns_the_pair().outcome is Outcome.HOLDS

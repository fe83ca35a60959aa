"""The study of kinds of noise: closed forms, mirror images, and direct calls."""

import math
from dataclasses import replace

import numpy as np
import pytest

from polycorner.dumbbells import DumbbellDrum, OutOfRound, Shaking, UnevenFriction, Wobble
from polycorner.dumbbells.dynamics.dyads import follow_dyads
from polycorner.dumbbells.studies import driven
from polycorner.dumbbells.studies.driven import KINDS, PAIRS, disturbed, kicks_of
from polycorner.motion.formulation import moment
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import simulate

# A strength and a scale of each kind that moves pairs within seconds.
USUAL = {
    "kicks": (30.0, 0.01),
    "chatter": (0.4, 0.01),
    "shaking across": (3000.0, 0.05),
    "shaking along": (1000.0, 0.03),
    "shaking up": (3000.0, 0.05),
    "out of round": (5.0, 8.0),
    "wobble": (3.0, 0.0),
    "uneven friction": (0.3, 5.0),
}
MIRRORED = {k: USUAL[k] for k in ("shaking across", "shaking up", "out of round")}


def results(kind, strength, scale, **given):
    rng = np.random.default_rng(4)
    found = driven(kind, strength, scale, rng=rng, **({"duration": 2.0} | given))
    return {name: value[0] if isinstance(value, tuple) else value for name, value in found.items()}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_the_same_results_with_units(kind):
    found = driven(kind, *USUAL[kind], rng=np.random.default_rng(4), duration=0.4)
    units = {name: value[1] for name, value in found.items() if isinstance(value, tuple)}
    means = {"single_rate": "1/s", "single_kept": "1", "single_climb_rate": "mm/s"}
    means |= {"single_carried": "deg", "single_highest": "deg"}
    for hand in ("right", "left"):
        for name in ("heading", "early", "late", "drift", "spread", "carried", "highest"):
            means[f"{name}_{hand}"] = "deg"
        means |= {f"shift_{hand}": "mm", f"climb_rate_{hand}": "mm/s"}
        means[f"relaxation_{hand}"] = "s"
        assert found[f"samples_{hand}"] >= PAIRS
        assert found[f"held_{hand}"] == PAIRS
        assert 0 <= found[f"corner_{hand}"] <= 1
        assert found[f"settled_{hand}"] in {True, False}
    whole = ("spread", "relaxation", "highest", "single_highest")
    errors = {f"{n}_error": unit for n, unit in means.items() if not n.startswith(whole)}
    assert units == means | errors
    assert found["missed"] < 0.1


def test_kinds_are_imperfections_and_noise_of_the_stated_strength():
    drum = DumbbellDrum()

    def made(kind):
        return disturbed(drum, kind, *USUAL[kind], 5)

    band = pytest.approx((0.05 / 0.03, 0.5 / 0.03))
    along, quiet = made("shaking along")
    assert (along.shaking.rms, along.shaking.band) == ((0.0, 1000.0, 0.0), band)
    assert quiet == Noise(seed=5)
    assert made("shaking across")[0].shaking == Shaking((3000.0, 0, 0), (1.0, 10.0), 5)
    assert made("shaking up")[0].shaking == Shaking((0, 0, 3000.0), (1.0, 10.0), 5)
    assert made("out of round")[0] == replace(drum, out_of_round=OutOfRound({8: 5.0}))
    assert made("wobble")[0] == replace(drum, wobble=Wobble(math.radians(3.0)))
    uneven = replace(drum, uneven_friction=UnevenFriction(0.3, 5.0, 5))
    assert made("uneven friction") == (uneven, quiet)
    assert made("chatter") == (drum, Noise(chatter=0.4, correlation_time=0.01, seed=5))


def test_kicks_over_masses_are_the_diffusions_of_velocities():
    drum = DumbbellDrum(length=12.0)
    body, theta = drum.bodies.body, 0.3
    q = np.array([0.0, 0.0, theta, 0.0])
    mass = moment(body.formulation, body.parameters, q, np.zeros(4)).mass
    kicks = kicks_of(drum, 25.0)
    sizes = np.array([kicks["phi"], kicks["eta"], kicks["theta"]])
    rates = np.linalg.solve(mass, np.diag([*sizes, 0.0]))[:3, :3]
    expected = np.diag([25.0 / drum.centre_radius, 25.0, 2 * 25.0 / 12.0])
    assert rates == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("scale", [0.0, 0.004])
def test_velocities_of_dumbbells_without_friction_diffuse_by_the_strength(scale):
    count, time = 1500, 0.008
    none = (0.0, 0.0)
    drum = DumbbellDrum(tilt=0.0, spin=0.0, sliding=none, rolling=none, count=count)
    drum, noise = disturbed(drum, "kicks", 25.0, scale, 3)
    q = np.zeros((count, 3))
    q[:, 1] = 1e3 * np.arange(count)
    v = simulate(drum, drum.state(q), time, 1e-3, noise=noise).v[-1]
    speeds = np.stack([drum.centre_radius * v[:, 0], v[:, 1], drum.length / 2 * v[:, 2]])
    found = (speeds**2).mean(axis=1) / time
    assert found == pytest.approx(np.full(3, 25.0**2), rel=4 * math.sqrt(2 / count))


@pytest.mark.parametrize("kind", MIRRORED)
def test_in_a_level_drum_left_handed_pairs_are_mirror_images(kind):
    found = results(kind, *MIRRORED[kind], tilt=0.0, spin=0.05, duration=4.0)
    assert abs(found["climb_rate_right"]) > 1e-3
    for name, sign in {"heading": -1, "climb_rate": -1, "shift": 1}.items():
        # Shaken across, nested pairs come apart and close at two contacts at once: rounding decides
        # at which first, and from there on the mirror image is another draw of the same motion.
        error = found[f"{name}_right_error"] if kind == "shaking across" else 1e-7
        assert found[f"{name}_left"] == pytest.approx(sign * found[f"{name}_right"], abs=error)


def test_pairs_that_are_shaken_gently_stay_mirror_images():
    level = DumbbellDrum(tilt=0.0, spin=0.05)
    drum, noise = disturbed(level, "shaking across", 300.0, 0.05, 4)
    paths = follow_dyads(drum, [("R", 0.1), ("L", -0.1)], 0.3, noise=noise, dt=1e-3)
    heading, azimuth = paths.heading, paths.trajectory.q[:, :, 0]
    assert np.ptp(azimuth) > 0.01
    assert heading[:, 1] == pytest.approx(-heading[:, 0], abs=1e-8)


def test_pairs_are_those_that_dyads_follow():
    found = results("out of round", 0.5, 2.0, duration=6.0, spin=0.05, dt=0.002)
    drum = DumbbellDrum(spin=0.05, restitution=1e-6, out_of_round=OutOfRound({2: 0.5}))
    starts = [("R", math.radians(angle)) for angle in np.linspace(-8.0, 14.0, PAIRS)]
    paths = follow_dyads(drum, starts, 6.0)
    late = np.degrees(paths.heading[paths.times >= 3.0])
    assert found["heading_right"] == pytest.approx(late.mean(), abs=1e-4)
    last = late[len(late) // 2 :].mean(axis=0)
    assert found["spread_right"] == pytest.approx(last.std(ddof=1), abs=1e-6)
    assert found["climb_rate_right"] == pytest.approx(paths.climb_rates(after=3.0).mean(), abs=1e-4)
    assert found["single_kept"] == pytest.approx(1.0, abs=1e-6)
    assert found["relaxation_right"] == math.inf


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"kind": "chater"}, r"kind: expected 'kicks', .* \(did you mean chatter\?\)"),
        ({"strength": -1.0}, "strength: expected a number >= 0"),
        ({"scale": -1.0}, "scale: expected a number >= 0 in s"),
        ({"kind": "chatter", "scale": 0.0}, "scale: expected a number > 0"),
        ({"kind": "out of round", "scale": 1.5}, "scale: expected a whole number"),
        ({"kind": "shaking up", "scale": 0.001}, "dt: expected"),
        ({"tilt": math.nan}, "tilt: expected"),
        ({"duration": 0.0}, "duration: expected"),
    ],
)
def test_what_is_wrong_is_named(wrong, words):
    given = {"kind": "kicks", "strength": 1.0, "scale": 0.01, "duration": 0.1}
    with pytest.raises((TypeError, ValueError), match=words):
        driven(**(given | wrong), rng=np.random.default_rng(1))

"""Section 2: verdicts, wrong statements, and the cylinder turned into place by a matrix."""

import math

import numpy as np
import pytest

from paper_checks.framework.claims import Verdict
from paper_checks.section2 import cylinder, geometry, heading_angle
from polycorner.dumbbells import DumbbellPair

TILT, RADIUS = math.radians(7), 125.0
RNG = np.random.default_rng(3)
PLACES = RNG.uniform([-1.5, 0], [1.5, 300], (40, 2))


# ------------------------------------------------------------------------- the cylinder, by matrix


def on_level_drum(phi, eta):
    """Return points of a horizontal drum along the second axis, 0 at its lowest line."""
    return np.stack([RADIUS * np.sin(phi), eta + 0 * phi, -RADIUS * np.cos(phi)], axis=-1)


def lifted(points):
    """Tilt the drum about the first axis, its far end upwards."""
    c, s = math.cos(TILT), math.sin(TILT)
    return points @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T


def number(expression, **values):
    return cylinder.at_sample(expression, alpha=TILT, R=RADIUS, **values)


def test_the_embedding_is_a_level_drum_tilted():
    for phi, eta in PLACES:
        found = [number(entry, phi=phi, eta=eta) for entry in cylinder.surface()]
        assert found == pytest.approx(lifted(on_level_drum(phi, eta)), abs=1e-9)


def test_printed_height_and_coordinates_at_points_in_space():
    for phi, eta in PLACES:
        x, y, z = lifted(on_level_drum(phi, eta))
        assert number(cylinder.formula(geometry.HEIGHT), phi=phi, eta=eta) == pytest.approx(z)
        place = {cylinder.symbols()[k]: v for k, v in (("x", x), ("y", y), ("z", z))}
        assert number(cylinder.formula(geometry.AZIMUTH).subs(place)) == pytest.approx(phi)
        assert number(cylinder.formula(geometry.ALTITUDE).subs(place)) == pytest.approx(eta)


def test_the_printed_field_falls_fastest():
    """The field points where the height, differentiated along unit vectors, falls fastest."""
    for phi, eta in PLACES[:10]:
        along = [number(cylinder.formula(c), phi=phi, eta=eta) for c in geometry.FIELD]
        pull = np.array([RADIUS * along[0], along[1]])
        angles = np.linspace(0, 2 * math.pi, 721)
        step = 1e-4
        ends = on_level_drum(phi + step * np.cos(angles) / RADIUS, eta + step * np.sin(angles))
        falls = (lifted(on_level_drum(phi, eta))[2] - lifted(ends)[:, 2]) / step
        steepest = angles[falls.argmax()]
        assert falls.max() == pytest.approx(np.hypot(*pull), abs=1e-5)
        turn = math.remainder(steepest - math.atan2(pull[1], pull[0]), math.tau)
        assert abs(turn) < 0.01


def test_flow_lines_by_small_steps_downhill():
    """Midpoint steps along the printed slope approach the closed form with the second order."""
    start, drop = 1.2, 40.0
    slope = cylinder.formula(geometry.FLOW)
    exact = 2 * math.atan(math.tan(start / 2) * math.exp(-drop / (RADIUS * math.tan(TILT))))

    def walked(steps):
        phi = start
        for _ in range(steps):
            middle = phi - drop / steps / 2 * number(slope, phi=phi)
            phi -= drop / steps * number(slope, phi=middle)
        return phi

    coarse, fine = abs(walked(40) - exact), abs(walked(80) - exact)
    assert math.log2(coarse / fine) == pytest.approx(2, abs=0.1)


def test_ball_centres_are_those_of_the_model():
    pair = DumbbellPair(16, 3, 1.5, 125)
    q = np.array([0.4, 10.0, 0.7, 0, 0, 0])
    found = np.array(
        [
            [
                float(cylinder.at_sample(e, phi=q[0], eta=q[1], theta=q[2], alpha=0.0))
                for e in centre
            ]
            for centre in cylinder.ball_centres()
        ]
    )
    assert found == pytest.approx(pair.ball_centres(q)[:2], abs=1e-9)


# ------------------------------------------------------------------------------- wrong statements


@pytest.mark.parametrize(
    ("check", "statement", "verdict"),
    [
        (
            geometry.coordinates_are,
            ("atan2(x, y*sin(alpha) - z*cos(alpha))",),
            Verdict.HOLDS,
        ),
        (geometry.coordinates_are, (geometry.AZIMUTH, "y*cos(alpha)"), Verdict.REFUTED),
        (geometry.metric_is, (("1", "0", "1"),), Verdict.REFUTED),
        (geometry.geodesics_are, ("a*sin(phi) + b*eta",), Verdict.REFUTED),
        (geometry.geodesics_are, ("a*phi - 3*b*eta",), Verdict.HOLDS),
        (geometry.lowest_line_is, ("pi/2",), Verdict.REFUTED),
        (geometry.height_is, ("eta*sin(alpha) - R*cos(phi)",), Verdict.REFUTED),
        (geometry.field_is, (("cos(alpha)*sin(phi)/R", "-sin(alpha)"),), Verdict.REFUTED),
        (geometry.flow_lines_are, ("-sin(phi)/(R*tan(alpha))",), Verdict.REFUTED),
        (geometry.flow_lines_are, ("sin(phi)/(R*sin(alpha))",), Verdict.REFUTED),
        (geometry.flow_crosses_level_curves_at, (89.0,), Verdict.REFUTED),
        (geometry.rotation_moves_to, (("phi - omega*t", "eta"),), Verdict.HOLDS),
        (geometry.rotation_moves_to, (("phi + omega*t", "eta + omega*t"),), Verdict.REFUTED),
        (heading_angle.heading_has_period, ("2*pi",), Verdict.REFUTED),
        (heading_angle.positions_have, (2,), Verdict.REFUTED),
        (heading_angle.rolling_climbs, ("-rho*sin(theta)",), Verdict.REFUTED),
        (heading_angle.tilt_is_a_force, ("cos(alpha)", "tan(alpha)"), Verdict.CORRECTED),
    ],
)
def test_other_statements(check, statement, verdict):
    assert check(*statement).verdict is verdict

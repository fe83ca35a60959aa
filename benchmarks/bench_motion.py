"""Dumbbells in the rotating drum: speed, memory and physics of polycorner and MuJoCo.

The same drum, sizes, friction and starts, at steps of a millisecond, one thread.  MuJoCo's cost is
given for the model as `mjcf` writes it, for a drum of half as many boxes (faster, coarser), and
for rolling resistance in a joint (three dimensions a contact, not six).
"""

import math
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from mjcf import GRAVITY, DrumScene
from mujoco_drum import MujocoDrum
from side_by_side import interleave, peak, print_table, ratio, write

from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.dumbbells.dynamics.starts import scatter
from polycorner.motion.engine.arrays import PENETRATION
from polycorner.motion.noise import Noise
from polycorner.motion.simulation import start

ROUNDS = 5
DYAD = 2
COUNTS = {DYAD: 2.0, 15: 0.5, 60: 0.25, 240: 0.1}  # dumbbells: seconds of motion in a round
# number of dumbbells and chatter: seconds of motion
PILES = {(15, 0.0): 24.0, (60, 0.0): 24.0, (240, 0.0): 12.0, (60, 0.3): 6.0}
STARTS, SPACE = 4, 4.0  # number of starts of each pile; mm of the drum's length for each dumbbell
SETTLE = 0.5  # seconds of motion before the timing starts
SIZES = {"length": 16.0, "ball_radius": 3.0, "rod_radius": 1.5}
DRUM = {"drum_radius": 125.0, "drum_length": 600.0}
OURS = "polycorner"
THEIRS: dict[str, dict[str, Any]] = {
    "MuJoCo": {},
    "MuJoCo, 360 boxes": {"segments": 360},
    "MuJoCo, rolling in a joint": {"rolling": "joint"},
}

Task = Callable[[], object]


def ours(count: int, seconds: float) -> Task:
    """Return the task that advances `count` settled dumbbells by `seconds` with polycorner.

    Static coefficients equal the dynamic ones, as MuJoCo has only one.
    """
    scene = DrumScene(**SIZES, **DRUM, count=count)
    drum = DumbbellDrum(
        **SIZES,
        drum_radius=DRUM["drum_radius"],
        count=count,
        tilt=scene.tilt,
        spin=scene.spin,
        sliding=(scene.mu_slide, scene.mu_slide),
        rolling=(scene.mu_roll, scene.mu_roll),
        rubbing=(scene.mu_contact, scene.mu_contact),
        ball_mass=scene.ball_mass,
    )
    engine = start(drum, drum.state(placements(count)), scene.dt)
    engine.advance(round(SETTLE / scene.dt))
    return partial(engine.advance, round(seconds / scene.dt))


def theirs(count: int, seconds: float, **changes: Any) -> Task:
    """Return the task that advances `count` settled dumbbells by `seconds` in MuJoCo."""
    drum = MujocoDrum(DrumScene(**SIZES, **DRUM, count=count, **changes))
    drum.set_placements(placements(count))
    drum.step(round(SETTLE / drum.scene.dt))
    return partial(drum.step, round(seconds / drum.scene.dt))


def placements(count: int) -> np.ndarray:
    """Return placements: a right-handed dyad about to roll, or rows not quite parallel."""
    if count == DYAD:
        pair = DumbbellPair(**SIZES, drum_radius=DRUM["drum_radius"])
        dyad = pair.nested("R", clearance=0.02).reshape(2, 3)
        dyad += [0.1, 150.0 - dyad[:, 1].mean(), 0.0]
        return dyad
    rows = DrumScene(**SIZES, **DRUM, count=count).rows()
    rows[:, 2] = np.random.default_rng(3).uniform(-0.03, 0.03, count)
    return rows


def engines(count: int, seconds: float) -> dict[str, Task]:
    """Return every engine's task, polycorner's first."""
    tasks: dict[str, Task] = {OURS: ours(count, seconds)}
    if find_spec("mujoco") is None:
        print("MuJoCo is left out: it is not installed; `pip install '.[bench]'`.")
    else:
        tasks |= {name: theirs(count, seconds, **changes) for name, changes in THEIRS.items()}
    return tasks


def speed() -> dict[str, Any]:
    """Time all engines side by side for each number of dumbbells."""
    figures: dict[str, Any] = {}
    for count, seconds in COUNTS.items():
        times = interleave(engines(count, seconds), ROUNDS)
        for name, taken in times.items():
            step = statistics.median(taken) / seconds * 1e-3
            figures.setdefault(name, {})[str(count)] = {
                "us a step": round(1e6 * step, 1),
                "us a step, at least": round(1e6 * min(taken) / seconds * 1e-3, 1),
                "steps a second": round(1 / step),
                "time over ours": round(ratio(taken, times[OURS]), 2) if OURS in times else None,
                "MiB": memory(name, count),
            }
    for key in ("us a step", "us a step, at least", "steps a second", "time over ours", "MiB"):
        rows = [[name, *(row[str(n)][key] for n in COUNTS)] for name, row in figures.items()]
        print_table(f"Dumbbells, {key}", ["", "dyad", *map(str, list(COUNTS)[1:])], rows)
    return figures


def memory(name: str, count: int) -> float:
    """Return the peak memory of a fresh process that moves dumbbells with one engine, in MiB."""
    call = f"ours({count}, 0.05)" if name == OURS else f"theirs({count}, 0.05, **{THEIRS[name]})"
    return peak(f"import bench_motion; bench_motion.{call}()")


def piles() -> dict[str, Any]:
    """Time polycorner alone on scattered dumbbells, carried up and sliding down, four starts.

    They have the experiment's coefficients, start at rest and have the same density for any number;
    with and without chatter of the loads.
    """
    figures: dict[str, Any] = {}
    for (count, chatter), seconds in PILES.items():
        drum = DumbbellDrum(**SIZES, drum_radius=DRUM["drum_radius"], count=count, floor=True)
        taken, efforts, overlap = 0.0, [], 0.0
        for seed in range(STARTS):
            rng = np.random.default_rng(seed)
            placed = scatter(drum, rng, width=0.35, height=SPACE * count, tries=1000)
            engine = start(drum, drum.state(placed), 1e-3, noise=Noise(chatter=chatter, seed=3))
            engine.advance(10)
            begun = time.process_time()
            engine.advance(round(seconds / 1e-3))
            taken += time.process_time() - begun
            efforts.append(engine.effort)
            overlap = max(overlap, float(engine.motion.sums[PENETRATION]))
        missed = sum(e.unconverged for e in efforts) / sum(e.islands for e in efforts)
        figures[f"{count}, chatter {chatter}, {seconds:g} s"] = {
            "times real time": round(STARTS * seconds / taken, 2),
            "us a step": round(1e3 * taken / (STARTS * seconds), 1),
            "islands missed, %": round(100 * missed, 2),
            "worst residual": float(f"{max(e.residual for e in efforts):.1e}"),
            "overlap, mm": round(overlap, 4),
        }
    keys = list(next(iter(figures.values())))
    print_table("Piles", ["", *keys], [[n, *row.values()] for n, row in figures.items()])
    return figures


def creep(**changes: Any) -> float:
    """Return the creep along the drum of a dumbbell carried at rest, in mm/s; exactly it is 0."""
    drum = MujocoDrum(DrumScene(**SIZES, **DRUM, mu_roll=0.2, **changes))
    drum.set_placements([[0.0, 150.0, 0.0]])
    drum.step(500)
    before = drum.placements()
    drum.step(5000)
    return float((drum.placements() - before)[0, 1] / 5)


def drift(heading: float, **changes: Any) -> tuple[float, float]:
    """Return the angle between path and rolling direction in degrees, as measured and by the law.

    A dumbbell rolls on the incline where in a common cone of sliding and rolling it would neither
    gain nor lose speed; there the law of normal slip gives
    ``cot(theta) / (1 + (mu_slide / mu_roll)^2)`` for the angle's tangent.
    """
    mu_slide, mu_roll, theta, speed = 0.3, 0.1, math.radians(heading), 20.0
    slope = 1 / math.sqrt(1 / mu_slide**2 + math.sin(theta) ** 2 / mu_roll**2)
    scene = DrumScene(
        **SIZES, spin=0.0, tilt=math.atan(slope), mu_slide=mu_slide, mu_roll=mu_roll, **changes
    )
    drum = MujocoDrum(scene)
    drum.set_placements([[0.0, 0.0, theta]])
    drum.step(100)
    across = np.array([-math.cos(theta), math.sin(theta)])
    drum.data.qvel[:2] -= speed * across
    drum.data.qvel[4 if scene.rolling == "cone" else 5] += speed / scene.ball_radius
    before = drum.placements()[0, :2]
    drum.step(200)
    moved = drum.placements()[0, :2] - before
    angle = math.atan(moved @ [math.sin(theta), math.cos(theta)] / (moved @ across))
    expected = math.atan(1 / math.tan(theta) / (1 + (mu_slide / mu_roll) ** 2))
    return math.degrees(angle), math.degrees(expected) if scene.rolling == "cone" else 0.0


def climb(rows: Any, **changes: Any) -> dict[str, float]:
    """Return measures of the motion of dumbbells in 40 s after 20 s, as simulated and by the law.

    Mean speed along the drum, headings, mean azimuth and the median zigzag of the azimuth.
    """
    placed = np.atleast_2d(np.asarray(rows, dtype=float))
    drum = MujocoDrum(DrumScene(**SIZES, **DRUM, count=len(placed), **changes))
    drum.set_placements(placed)
    stride = round(0.01 / drum.scene.dt)
    drum.step(2000 * stride)
    track = []
    for _ in range(4000):
        drum.step(stride)
        track.append(drum.placements())
    places = np.array(track)
    phi, eta, theta = (places[:, :, k].mean(axis=1) for k in range(3))
    azimuth, rate = law(float(theta.mean()), drum.scene)
    return {
        "mm/s": round(float(eta[-1] - eta[0]) / 40, 3),
        "law": round(rate, 3),
        "heading, 20 s": round(math.degrees(theta[0]), 2),
        "heading, 60 s": round(math.degrees(theta[-1]), 2),
        "azimuth": round(math.degrees(phi.mean()), 2),
        "law, azimuth": round(azimuth, 2),
        "zigzag": round(swing(np.degrees(phi)), 2),
    }


def law(theta: float, scene: DrumScene) -> tuple[float, float]:
    """Return the azimuth of steady rolling of a dumbbell in the drum, and its climbing speed.

    It rolls where the pull reaches the limit of friction: for sliding and rolling in one cone the
    ellipse ``(f_s / mu_s)^2 + f_r^2 (1 / mu_s^2 + 1 / mu_r^2) = 1``, else ``f_r = mu_r``.  There it
    moves at the angle of normal slip to its rolling direction, and stays while the drum turns.
    Azimuth in degrees, speed along the drum in mm/s.
    """
    from scipy.optimize import brentq  # here, so that memory is that of the engines

    steep, s, c = math.tan(scene.tilt), math.sin(theta), math.cos(theta)
    mu_s, mu_r, cone = scene.mu_slide, scene.mu_roll, scene.rolling == "cone"

    def pull(phi: float) -> tuple[float, float]:
        down, across = steep / math.cos(phi), math.tan(phi)
        return across * s + down * c, across * c - down * s

    def excess(phi: float) -> float:
        f_s, f_r = pull(phi)
        ellipse = (f_s / mu_s) ** 2 + f_r**2 * (1 / mu_s**2 + 1 / mu_r**2)
        return ellipse - 1 if cone else f_r / mu_r - 1

    phi = brentq(excess, math.atan(steep * math.tan(theta)), 0.5)
    f_s, f_r = pull(phi)
    off = math.atan(f_s / f_r / (1 + (mu_s / mu_r) ** 2)) if cone else 0.0
    rho = scene.drum_radius - scene.ball_radius
    return math.degrees(phi), rho * scene.spin * math.tan(theta - off)


def swing(azimuth: np.ndarray) -> float:
    """Return the median zigzag in degrees of those above a twentieth, 0 if there are none."""
    rising = np.diff(azimuth) > 0
    turns = azimuth[1:-1][rising[1:] != rising[:-1]]
    heights = abs(np.diff(turns))
    heights = heights[heights > 0.05]
    return float(np.median(heights)) if len(heights) else 0.0


def behaviour() -> dict[str, Any]:
    """Print MuJoCo's motion of a dumbbell at rest, one that rolls, and dyads."""
    settings: dict[str, dict[str, Any]] = {
        "impratio 1": {"impratio": 1.0},
        "impratio 10": {"impratio": 10.0},
        "impratio 100": {},
        "impratio 100, NoSlip": {"noslip_iterations": 5},
        "rolling in a joint": {"rolling": "joint"},
    }
    creeps = {name: creep(**changes) for name, changes in settings.items()}
    print_table("Creep at rest, mm/s", ["", "mm/s"], [(n, f"{v:.5f}") for n, v in creeps.items()])

    drifts: dict[str, dict[str, float]] = {}
    for name, changes in settings.items():
        for heading in (30, 45, 60):
            angle, expected = drift(heading, **changes)
            drifts[f"{name}, heading {heading}"] = {
                "measured": round(angle, 2),
                "law": round(expected, 2),
            }
    rows = [(name, *pair.values()) for name, pair in drifts.items()]
    print_table("Rolling on an incline, degrees off course", ["", "measured", "law"], rows)

    single = [0.1, 150.0]
    climbs = {
        "dyad": climb(placements(DYAD)),
        "dyad, NoSlip": climb(placements(DYAD), noslip_iterations=5),
        "dyad, 360 boxes": climb(placements(DYAD), segments=360),
        "dyad, steps of 0.5 ms": climb(placements(DYAD), dt=5e-4),
        "dyad, mu_roll 0.05": climb(placements(DYAD), mu_roll=0.05),
        "dyad, mu_slide 0.5": climb(placements(DYAD), mu_slide=0.5),
        "dyad, rolling in a joint": climb(placements(DYAD), rolling="joint"),
        "dyad, in a joint, mu_roll 0.05": climb(placements(DYAD), rolling="joint", mu_roll=0.05),
    }
    for heading in (8, 0, -8):
        rows = [[*single, math.radians(heading)]]
        climbs[f"single, {heading}"] = climb(rows)
        climbs[f"single, {heading}, rolling in a joint"] = climb(rows, rolling="joint")
    rows = [(name, *row.values()) for name, row in climbs.items()]
    print_table("In the drum", ["", *climbs["dyad"]], rows)
    return {"creep": creeps, "drift": drifts, "drum": climbs}


def main() -> None:
    figures: dict[str, Any] = {"gravity": GRAVITY, "dt": 1e-3, "speed": speed(), "piles": piles()}
    if find_spec("mujoco") is not None and "--speed" not in sys.argv:
        import mujoco

        figures |= {"mujoco": mujoco.__version__, "behaviour": behaviour()}
    write("motion", figures)


if __name__ == "__main__":
    main()

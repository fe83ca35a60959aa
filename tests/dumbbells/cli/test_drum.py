"""The command ``polycorner drum``: what it prints and writes, and how it is stopped and resumed."""

import json
import math
import signal
import subprocess
import sys
import time

import commands
import numpy as np
import pytest

from polycorner.dumbbells import OutOfRound, Shaking, UnevenFriction, Wobble
from polycorner.dumbbells.cli.drum import _parameters
from polycorner.dumbbells.drum import DumbbellDrum
from polycorner.dumbbells.dynamics.files import load_run
from polycorner.dumbbells.pictures import movies
from polycorner.motion import Checkpoint, simulate
from polycorner.motion.checkpoints import STATE

SHORT = ("--duration", "0.5", "--dt", "0.005")
ANSWER = {
    "parameters",
    "finished",
    "time",
    "chirality",
    "heading_deg",
    "climb_rate",
    "turning_azimuth_deg",
    "held",
    "exits",
    "max_penetration",
    "energy_audit",
    "steps_per_second",
    "converged",
    "effort",
    "convergence",
}


@pytest.fixture(autouse=True)
def unsaved(tmp_path, monkeypatch):
    """Keep runs without ``--out`` away from those of other tests; the engine stays compiled."""
    folder = tmp_path / "unsaved"
    monkeypatch.setattr("polycorner.dumbbells.cli.drum._cached", lambda name: folder / name)
    return folder


def run(capsys, *arguments):
    return commands.run(capsys, "drum", *arguments)


def answer(capsys, *arguments):
    return commands.answer(capsys, "drum", *arguments)


def test_a_single_dumbbell_climbs_with_its_heading(capsys):
    found = answer(capsys, "--heading", "12", "--duration", "30")
    assert set(found) == ANSWER
    assert found["finished"]
    assert found["converged"]
    assert found["time"] == pytest.approx(30)
    assert found["heading_deg"]["initial"] == pytest.approx(12)
    assert found["climb_rate"] > 0
    assert found["held"] is found["chirality"] is None
    assert set(found["exits"]) == {"right", "left", "single"}
    turns = found["turning_azimuth_deg"]
    assert turns["bottom"] < turns["top"]
    assert found["effort"]["steps"] == 30000
    down = answer(capsys, "--heading", "-12", "--duration", "30")
    assert down["climb_rate"] < 0


@pytest.mark.parametrize(("hand", "sign"), [("R", 1), ("L", -1)])
def test_a_pair_holds_and_moves_by_its_chirality(capsys, hand, sign):
    found = answer(capsys, "--pair", hand, "--duration", "30")
    assert found["held"] is True
    assert found["chirality"] == hand
    assert sign * found["climb_rate"] > 0
    assert sign * found["heading_deg"]["mean"] == pytest.approx(7.94, abs=0.5)
    assert found["parameters"]["count"] == 2


def test_the_heading_of_a_pair_is_its_mean(capsys):
    found = answer(capsys, "--pair", "L", "--heading", "5", *SHORT)
    assert found["heading_deg"]["initial"] == pytest.approx(5)
    assert found["chirality"] == "L"


def test_a_dumbbell_that_passes_the_top_has_left(capsys):
    found = answer(capsys, "--start", "5.5", "10", "10", "--top", "10.2", "--duration", "20")
    assert found["exits"] == {"right": 0, "left": 0, "single": 1}


def test_one_seed_one_bunch(capsys):
    chosen = ("--count", "4", "--noise", "0.3", *SHORT)
    first, again, other = (answer(capsys, *chosen, "--seed", seed) for seed in ("1", "1", "2"))
    for found in (first, again, other):
        found.pop("steps_per_second")
    assert first == again
    assert first["heading_deg"] != other["heading_deg"]


def test_files_are_written(capsys, tmp_path):
    out = tmp_path / "deep" / "out"
    code, said, err = run(capsys, "--pair", "R", *SHORT, "--out", str(out), "--movie")
    assert (code, err) == (0, "")
    movie = f"drum{movies.movie_suffix()}"
    names = {"drum.json", "trajectory.nc", "history.png", "drum.png", movie}
    assert {entry.name for entry in out.iterdir()} == names | {"drum-state"}
    assert all(f"wrote {out / name}" in said for name in names)
    path = load_run(out / "trajectory.nc")
    told = json.loads((out / "drum.json").read_text())
    assert path.effort.steps == told["effort"]["steps"] == 100
    assert path.system.tilt == math.radians(7)


def test_a_movie_with_a_name_needs_no_folder(capsys, tmp_path):
    code, said, _ = run(capsys, *SHORT, "--movie", str(tmp_path / "mine.gif"))
    assert code == 0
    assert f"wrote {tmp_path / 'mine.gif'}" in said
    assert (tmp_path / "mine.gif").stat().st_size > 1000


def test_imperfections_are_those_of_the_options(capsys, tmp_path):
    chosen = ["--shake", "30", "0", "20", "--wobble", "0.5"]
    for harmonic, amplitude in ((2, 0.4), (1, 0.1), (5, 0.02)):
        chosen += ["--out-of-round", str(harmonic), str(amplitude)]
    more = ("--uneven-friction", "0.2", "6", "--kicks", "30", "0.3", "0", "0", "--seed", "5")
    found = answer(capsys, "--pair", "R", *SHORT, *chosen, *more, "--out", str(tmp_path))
    assert found["parameters"]["wobble_deg"] == 0.5
    path = load_run(tmp_path / "trajectory.nc")
    assert path.system.shaking == Shaking((30.0, 0.0, 20.0), (1.0, 15.0), seed=5)
    assert path.system.out_of_round == OutOfRound({1: 0.1, 2: 0.4, 5: 0.02})
    assert path.system.wobble == Wobble(math.radians(0.5))
    assert path.system.uneven_friction == UnevenFriction(0.2, 6.0, seed=5)
    assert path.noise.kicks == {"phi": 30.0, "eta": 0.3, "theta": 0.0, "psi": 0.0}
    assert path.noise.kick_time == 0.01


def test_the_table_is_for_people(capsys):
    code, out, err = run(capsys, "--pair", "R", *SHORT)
    assert (code, err) == (0, "")
    for words in ("held together", "climb rate", "energy audit", "100,"):
        assert words in out


# ------------------------------------------------------------------------------------------- config


def test_a_file_describes_a_run_and_options_override_it(capsys, tmp_path):
    file = tmp_path / "run.toml"
    file.write_text(
        'pair = "R"\nheading = 6\nnoise = 0.1\nmu-slide = [0.4, 0.3]\nmu_roll = [0.05, 0.05]\n'
        "duration = 0.5\nseed = 7\nlength = 18\n"
    )
    found = answer(capsys, "--config", str(file), "--noise", "0.2")
    told = found["parameters"]
    assert (told["noise"], told["seed"], told["length"]) == (0.2, 7, 18.0)
    assert (told["mu_slide"], told["mu_roll"]) == ([0.4, 0.3], [0.05, 0.05])
    assert found["heading_deg"]["initial"] == pytest.approx(6)


def test_a_file_can_place_dumbbells(capsys, tmp_path):
    file = tmp_path / "run.toml"
    file.write_text("start = [[0, 10, 5], [0.0, 60, -3]]\nduration = 0.5\n")
    found = answer(capsys, "--config", str(file))
    assert found["parameters"]["count"] == 2
    assert found["heading_deg"]["initial"] == pytest.approx(1)


WRONG_FILES = {
    "omega = 1": "omega",
    "count = 1.5": "count",
    "count = true": "count",
    'pair = "X"': "pair",
    "heading = 'ten'": "heading",
    "mu_slide = 0.3": "mu_slide",
    "mu_slide = [0.3, 0.2, 0.1]": "mu_slide",
    "start = [[0, 10]]": "start",
    "tilt = '7'": "tilt",
    "this is no TOML": "not a TOML file",
}


@pytest.mark.parametrize("text", WRONG_FILES)
def test_mistakes_in_a_file_get_one_line(capsys, tmp_path, text):
    file = tmp_path / "run.toml"
    file.write_text(text)
    code, out, err = run(capsys, "--config", str(file))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"polycorner: --config: {file}")
    assert WRONG_FILES[text] in err


WRONG = [
    ("--start", "0", "0", "0", "--start", "0", "10", "0"),  # overlap
    ("--start", "95", "0", "0"),
    ("--start", "0", "0", "0", "--pair", "R"),
    ("--dt", "0.01"),
    ("--dt", "-1"),
    ("--mu-slide", "0.2", "0.3"),
    ("--mu-roll", "-0.1", "-0.2"),
    ("--mu-contact", "-1"),
    ("--tilt", "90"),
    ("--tilt", "nan"),
    ("--count", "0"),
    ("--count", "3", "--pair", "R"),
    ("--count", "100000000"),
    ("--pair", "X"),
    ("--heading", "nan"),
    ("--heading", "1", "--heading", "2", "--pair", "R"),
    ("--rod", "3"),
    ("--ball", "nan"),
    ("--length", "5"),
    ("--drum", "inf"),
    ("--top", "-3"),
    ("--noise", "-1"),
    ("--shake", "1", "-1", "0"),
    ("--shake", "1", "1", "1", "--shake-band", "3", "2"),
    ("--out-of-round", "1.5", "0.1"),
    ("--out-of-round", "40", "9"),
    ("--wobble", "-1"),
    ("--wobble", "85"),
    ("--uneven-friction", "-0.1", "5"),
    ("--uneven-friction", "0.1", "1e-9"),
    ("--kicks", "1", "1", "1", "-1"),
    ("--kick-time", "1e-12", "--kicks", "1", "1", "1", "1"),
    ("--spin", "nan"),
    ("--seed", "-1"),
    ("--duration", "inf"),
    ("--movie",),
    ("--movie", "film.avi"),
    ("--config", "no-such-file.toml"),
    ("--out", "README.md"),
    ("--no-such-option",),
]


@pytest.mark.parametrize("words", WRONG, ids=" ".join)
def test_every_mistake_gets_one_line(capsys, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "README.md").write_text("")
    code, out, err = run(capsys, *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"polycorner: {words[0]}:") or words[0] in err
    assert [entry.name for entry in tmp_path.iterdir()] == ["README.md"]


def test_overlaps_and_steps_are_told_with_numbers(capsys):
    _, _, err = run(capsys, *WRONG[0])
    assert "numbers 1 and 2 overlap by 4.5 mm" in err
    _, _, err = run(capsys, *WRONG[3])
    assert "expected at most 0.00553 s" in err


def test_mp4_without_the_extra_names_it(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(movies, "can_encode", lambda: False)
    code, out, err = run(capsys, *SHORT, "--movie", str(tmp_path / "film.mp4"))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "polycorner[movies]" in err
    code, said, _ = run(capsys, *SHORT, "--movie", "--out", str(tmp_path))
    assert code == 0
    assert "drum.gif" in said


# ------------------------------------------------------------------------------------------- resume

LONG = ("--count", "6", "--noise", "0.3", "--duration", "90", "--json")

SAVING = """
from polycorner.cli.main import main
from polycorner.motion.checkpoints import Checkpoint

Checkpoint.__init__.__defaults__ = (0.1, *Checkpoint.__init__.__defaults__[1:])  # seconds
main()
"""


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_stopped_run_goes_on(capsys, tmp_path, how):
    """Ctrl-C is answered with what was done; a killed process leaves its last saving."""
    out = tmp_path / "out"
    command = [sys.executable, "-c", SAVING, "drum", *LONG, "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not (out / "drum-state" / "state.npz").exists():
        time.sleep(0.001)
    process.send_signal(how)
    said, err = process.communicate()
    assert process.returncode == (130 if how is signal.SIGINT else -how)
    if how is signal.SIGINT:
        assert json.loads(said)["finished"] is False
        assert "--resume continues it" in err
        assert not load_run(out / "trajectory.nc").finished
    code, said, _ = run(capsys, *LONG, "--out", str(out), "--resume")
    assert code == 0
    code, other, _ = run(capsys, *LONG, "--out", str(tmp_path / "whole"))
    assert code == 0
    one, two = (load_run(at / "trajectory.nc") for at in (out, tmp_path / "whole"))
    np.testing.assert_array_equal(one.q, two.q)
    assert one.events == two.events
    mine, theirs = json.loads(said), json.loads(other)
    for found in (mine, theirs):
        found.pop("steps_per_second")
    assert mine == theirs


def unfinished(folder):
    """Leave a run that Ctrl-C stopped, of options that are SHORT but for --tilt 7."""

    def interrupt(*_):
        signal.raise_signal(signal.SIGINT)

    drum = DumbbellDrum(tilt=0.2)
    state = drum.state([[0.0, 0.0, math.radians(10)]])
    checkpoint = Checkpoint(folder / "drum-state")
    path = simulate(drum, state, 0.5, 5e-3, progress=interrupt, checkpoint=checkpoint)
    assert not path.finished
    return {entry: entry.read_bytes() for entry in (folder / "drum-state").iterdir()}


@pytest.mark.parametrize("resume", [(), ("--resume",)])
def test_an_unfinished_run_of_other_options_is_neither_resumed_nor_deleted(
    capsys, tmp_path, resume
):
    kept = unfinished(tmp_path)
    code, out, err = run(capsys, *SHORT, "--out", str(tmp_path), *resume)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("polycorner: --out: expected tilt = 0.2 as in the unfinished run in")
    assert {entry: entry.read_bytes() for entry in kept} == kept


def test_a_finished_run_is_finished(capsys, tmp_path):
    """Resumed, it gives the same answer at once; without --resume it gives way to a new run."""
    arguments = (*SHORT, "--noise", "0.2", "--out", str(tmp_path), "--json")
    code, first, _ = run(capsys, *arguments)
    assert code == 0
    written = (tmp_path / "drum-state" / STATE).stat().st_mtime_ns
    code, again, _ = run(capsys, *arguments, "--resume")
    assert code == 0
    told, same = json.loads(first), json.loads(again)
    for found in (told, same):
        found.pop("steps_per_second")
    assert told == same
    code, _, _ = run(capsys, *SHORT, "--out", str(tmp_path))
    assert code == 0
    assert (tmp_path / "drum-state" / STATE).stat().st_mtime_ns > written


def test_without_anything_to_resume_a_run_starts(capsys):
    code, _, err = run(capsys, *SHORT, "--resume")
    assert code == 0
    assert "nothing to resume" in err


def test_options_in_degrees_have_keys_that_say_so():
    values = {"tilt": 7.0, "heading": (5.0,), "start": ((0.0, 10.0, 5.0),), "spin": 0.01}
    told = _parameters(values)
    assert told["tilt_deg"] == 7.0
    assert told["heading_deg"] == (5.0,)
    assert told["start"] == [{"azimuth_deg": 0.0, "eta": 10.0, "heading_deg": 5.0}]
    assert _parameters(values | {"start": None})["start"] == []

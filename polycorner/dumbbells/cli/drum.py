"""``polycorner drum``: motion of dumbbells in a slowly rotating, tilted drum."""

import hashlib
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli import (
    command,
    deliver,
    examples,
    fail,
    prepare,
    remark,
    shown,
    timed,
    unfinished,
    working,
    write_answer,
    writing,
)
from polycorner.dumbbells.cli.drum_options import (
    drum_options,
    imperfection_options,
    imperfections,
    noise_of,
    without_hidden,
)

if TYPE_CHECKING:
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.motion import Checkpoint, Noise, State, Trajectory
    from polycorner.toolkit import Sheet

EPILOG = (
    examples(
        "drum --heading 10 --out out",
        "drum --pair R --noise 0.2 --duration 120 --json",
        "drum --count 60 --noise 0.3 --top 400 --duration 1200 --out out --movie",
    )
    + """
A single dumbbell or a pair starts on the lowest line at eta = 0, far from bottom and top; a bunch
(--count without --heading or --start) lies at the bottom of the drum.

Ctrl-C ends a run, keeps it and reports what was done (exit code 130); the same command with
--resume continues it, also after the process was killed.
"""
)
STATE = "drum-state"  # folder of the saved run in that of --out
INTERVAL = 0.1  # s between records, or less in a short run
FRAMES = 1000  # records of a short run
# Options by the library's names of what they set.
NAMES = {
    "count": "count",
    "length": "length",
    "ball_radius": "ball",
    "rod_radius": "rod",
    "drum_radius": "drum",
    "top": "top",
    "tilt": "tilt",
    "spin": "spin",
    "sliding": "mu_slide",
    "rolling": "mu_roll",
    "rubbing": "mu_contact",
    "chatter": "noise",
    "shaking": "shake",
    "out_of_round": "out_of_round",
    "wobble": "wobble",
    "uneven_friction": "uneven_friction",
    "correlation_length": "uneven_friction",
    "kicks": "kicks",
    "kick_time": "kick_time",
    "duration": "duration",
    "dt": "dt",
    "seed": "seed",
    "heading": "heading",
    "headings": "heading",
    "q": "start",
    "t_end": "duration",
    "checkpoint": "out",
    "movie": "movie",
}


@command(epilog=EPILOG)
@drum_options
@imperfection_options
def drum(resume: bool, movie: str | None, as_json: bool, out: Path | None, **options: Any) -> None:
    """Simulate dumbbells in a slowly rotating, tilted drum."""
    values = without_hidden(options)
    film = _film(movie, out)
    prepare(out)
    with _named_options():
        model, noise, state = _described(values)
        checkpoint = _checkpoint(model, state, values, noise, out, resume=resume)
        run = _run(model, noise, state, values, checkpoint)
        answer = drum_answer(run, values)
    _finish(run, answer, out, film, checkpoint, as_json=as_json)


@contextmanager
def _named_options() -> Iterator[None]:
    """Turn the library's errors into one line that begins with the option."""
    try:
        yield
    except (ValueError, TypeError) as error:
        name, colon, rest = str(error).partition(":")
        if not colon or name not in NAMES:
            raise
        fail(f"--{NAMES[name].replace('_', '-')}:{rest}")


# ------------------------------------------------------------------------------------- the problem


def _described(values: dict[str, Any]) -> "tuple[DumbbellDrum, Noise, State]":
    """Return the drum, the noise and the state that the options describe."""
    import numpy as np

    _check_angles(values)
    count = _count(values)
    in_bunch = count > 1 and not (values["pair"] or values["heading"] or values["start"])
    from polycorner.dumbbells.drum import DumbbellDrum
    from polycorner.dumbbells.dynamics import starts as drum_starts

    model = DumbbellDrum(
        length=values["length"],
        ball_radius=values["ball"],
        rod_radius=values["rod"],
        drum_radius=values["drum"],
        count=count,
        tilt=math.radians(values["tilt"]),
        spin=values["spin"],
        sliding=values["mu_slide"],
        rolling=values["mu_roll"],
        rubbing=(values["mu_contact"], values["mu_contact"]),
        floor=in_bunch,
        top=math.inf if values["top"] is None else values["top"],
        **imperfections(values),
    )
    headings = [math.radians(h) for h in values["heading"] or ()]
    if values["start"]:
        q = np.array(values["start"]) * [math.radians(1), 1.0, math.radians(1)]
    elif values["pair"]:
        q = drum_starts.nested_pair(
            model, values["pair"], heading=headings[0] if headings else None
        )
    elif in_bunch:
        q = drum_starts.bunch(model, np.random.default_rng(values["seed"]))
    else:
        q = drum_starts.isolated(model, headings or [math.radians(10)])
    return model, noise_of(values), model.state(q)


def _check_angles(values: dict[str, Any]) -> None:
    if not -90 < values["tilt"] < 90:
        fail(f"--tilt: expected an angle between -90 and 90 degrees; got {values['tilt']:g}")
    wobble = values["wobble"]
    if wobble is not None and not 0 <= wobble < 90 - abs(values["tilt"]):
        fail(
            "--wobble: expected an angle of at least 0 degrees, with which the tilt remains below "
            f"90; got {wobble:g}"
        )
    for heading in values["heading"] or ():
        if not math.isfinite(heading):
            fail(f"--heading: expected an angle in degrees; got {heading:g}")
    if values["start"] and (values["pair"] or values["heading"]):
        fail("--start: expected no --pair and no --heading beside it; got both")
    for azimuth, eta, heading in values["start"] or ():
        if not (abs(azimuth) < 90 and math.isfinite(eta) and math.isfinite(heading)):
            fail(
                "--start: expected an azimuth between -90 and 90 degrees, eta in mm and a heading; "
                f"got {azimuth:g} {eta:g} {heading:g}"
            )
    if values["pair"] and len(values["heading"] or ()) > 1:
        fail(f"--heading: expected one, the mean heading of the pair; got {len(values['heading'])}")


def _count(values: dict[str, Any]) -> int:
    """Return the number of dumbbells."""
    placed = 2 if values["pair"] else len(values["start"] or values["heading"] or ())
    count = values["count"]
    if count is None:
        return placed or 1
    if placed and count != placed:
        how = "--pair is two" if values["pair"] else f"{placed} are placed"
        fail(f"--count: expected none, or {placed} as {how}; got {count}")
    return int(count)


# ------------------------------------------------------------------------------------------ the run


def _checkpoint(
    model: "DumbbellDrum", state: "State", values: dict[str, Any], noise: "Noise",
    out: Path | None, *, resume: bool,
) -> "Checkpoint":  # fmt: skip
    """Return where the run is saved: in the folder of --out, or else in the cache."""
    from polycorner.motion import Checkpoint

    if out is not None:
        return Checkpoint(out / STATE, resume=resume)
    start = hashlib.sha256(state.q.tobytes()).hexdigest()[:16]
    told = repr((model, noise, values["duration"], values["dt"], start))
    name = hashlib.sha256(told.encode()).hexdigest()[:16]
    return Checkpoint(_cached(f"drum-{name}"), resume=resume)


def _cached(name: str) -> Path:
    """Return a folder in the cache."""
    from polycorner.toolkit import cache_folder

    return cache_folder() / name


def _run(
    model: "DumbbellDrum", noise: "Noise", state: "State", values: dict[str, Any],
    checkpoint: "Checkpoint",
) -> "Trajectory":  # fmt: skip
    from polycorner.motion import simulate

    seconds, dt, folder = values["duration"], values["dt"], Path(checkpoint.folder)
    if checkpoint.resume and not folder.exists():
        remark(f"nothing to resume in {folder}; the run starts from the beginning")
    every = None  # until the numbers are checked by the simulation itself
    if 0 <= seconds < math.inf and 0 < dt < math.inf:
        every = max(1, round(min(INTERVAL, seconds / FRAMES) / dt))
    with writing(folder), working("simulating", "s") as progress:
        return simulate(
            model,
            state,
            seconds,
            dt,
            every=every,
            noise=noise,
            progress=progress,
            checkpoint=checkpoint,
        )


# --------------------------------------------------------------------------------------- the answer


def _film(movie: str | None, out: Path | None) -> Path | None:
    """Return the file of the movie, after checking that it can be written."""
    if movie is None:
        return None
    if movie == "" and out is None:
        fail("--movie: expected a file name or --out beside it; got neither")
    from polycorner.toolkit import check_movie, movie_suffix

    if movie == "" and out is not None:
        return out / f"drum{movie_suffix()}"
    with _named_options():
        check_movie(movie)
    return Path(movie)


def _finish(
    run: "Trajectory", answer: dict[str, Any], out: Path | None, film: Path | None,
    checkpoint: "Checkpoint", *, as_json: bool,
) -> None:  # fmt: skip
    """Print the answer, write the files, and end the process if the run was stopped."""

    def write(_: Path) -> Iterator[Path]:
        if out is not None:
            yield from _write(run, answer, out)
        if film is not None:
            yield _write_film(run, film)

    deliver(answer, lambda: shown(drum_sheet(answer)), write, as_json=as_json, out=out or film)
    if not run.finished:
        unfinished(Path(checkpoint.folder))
        raise click.exceptions.Exit(130)
    if out is None:  # beside its results a finished run stays, so that --resume finds it finished
        checkpoint.clear()


def _write(run: "Trajectory", answer: dict[str, Any], out: Path) -> list[Path]:
    from polycorner.dumbbells.dynamics.files import save_run
    from polycorner.dumbbells.pictures import drum as pictures
    from polycorner.pictures import save

    with writing(out), timed("drawing and writing"):
        return [
            write_answer(answer, out, "drum.json"),
            save_run(run, out / "trajectory.nc"),
            save(pictures.draw_history(run), out / "history.png"),
            save(pictures.draw_drum(run), out / "drum.png"),
        ]


def _write_film(run: "Trajectory", film: Path) -> Path:
    from polycorner.dumbbells.pictures.movies import write_movie

    with writing(film, "--movie"), working("filming", "pictures") as progress:
        return write_movie(run, film, progress=lambda done, total: progress(done, total, ""))


# ------------------------------------------------------------------------------------------ answers


def drum_answer(path: "Trajectory", values: dict[str, Any]) -> dict[str, Any]:
    """Return the answer as JSON."""
    import numpy as np

    from polycorner.dumbbells.dynamics import pairs as drum_pairs

    heading = np.degrees(drum_pairs.mean_heading(path))
    heading = heading[np.isfinite(heading)]
    top, bottom = (math.degrees(x) for x in drum_pairs.turning_azimuths(path))
    two = path.q.shape[1] == 2
    return {
        "parameters": _parameters(values) | {"count": path.q.shape[1]},
        "finished": path.finished,
        "time": float(path.times[-1]),
        "chirality": drum_pairs.handedness(path) if two else None,
        "heading_deg": {
            "initial": _upright(float(heading[0])),
            "final": _upright(float(heading[-1])),
            "mean": _upright(float(heading.mean())),
            "std": float(heading.std()),
        },
        "climb_rate": drum_pairs.climb_rate(path),
        "turning_azimuth_deg": {"top": top, "bottom": bottom},
        "held": drum_pairs.held(path) if two else None,
        "exits": drum_pairs.exits(path),
        "max_penetration": path.max_penetration,
        "energy_audit": path.audit,
        "steps_per_second": path.steps_per_second,
        "converged": path.converged,
        "convergence": path.convergence,
        "effort": {
            name: getattr(path.effort, name)
            for name in ("steps", "islands", "sweeps", "newton_steps", "unconverged", "residual")
        },
    }


def _parameters(values: dict[str, Any]) -> dict[str, Any]:
    """Return the options, those in degrees under keys that end in ``_deg``."""
    told = {f"{k}_deg" if k in ("tilt", "heading", "wobble") else k: v for k, v in values.items()}
    names = ("azimuth_deg", "eta", "heading_deg")
    return told | {"start": [dict(zip(names, s, strict=True)) for s in values["start"] or ()]}


def _upright(degrees: float) -> float:
    """Return a heading in (-90, 90]."""
    return degrees - 180 * math.ceil(degrees / 180 - 0.5)


def drum_sheet(answer: dict[str, Any]) -> "Sheet":
    """Return the answer as a table for people."""
    from polycorner.toolkit import Sheet, facts

    return Sheet("", (facts(_rows(answer)),))


def _rows(answer: dict[str, Any]) -> Iterator[tuple[str, str]]:
    heading, turns, exits = (answer[k] for k in ("heading_deg", "turning_azimuth_deg", "exits"))
    yield "time", f"{answer['time']:g} s{'' if answer['finished'] else ', unfinished'}"
    if answer["chirality"]:
        held = "held together" if answer["held"] else "came apart"
        yield "pair", f"{answer['chirality']}, {held}"
    ends = f"{heading['initial']:.3f}° to {heading['final']:.3f}°"
    yield "heading", f"{ends}, mean {heading['mean']:.3f}°, deviation {heading['std']:.3f}°"
    yield "climb rate", f"{answer['climb_rate']:.4g} mm/s"
    shown = (
        f"{side} {turns[side]:.3f}°" for side in ("bottom", "top") if not math.isnan(turns[side])
    )
    yield "turning azimuth", ", ".join(shown) or "no turn"
    if answer["parameters"]["top"] is not None:
        yield "left", ", ".join(f"{number} {kind}" for kind, number in exits.items())
    yield "deepest overlap", f"{answer['max_penetration']:.3g} mm"
    yield "energy audit", f"{answer['energy_audit']:.3g}"
    effort = answer["effort"]
    yield "steps", f"{effort['steps']}, {answer['steps_per_second']:.0f} per second"
    yield "solver", answer["convergence"]

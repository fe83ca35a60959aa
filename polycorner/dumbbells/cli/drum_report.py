"""Answers of ``polycorner drum`` as JSON and as a table."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from polycorner.motion import Trajectory
    from polycorner.toolkit import Sheet


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

"""Messages of the live page: slider names with numbers in their ranges, or a button's name."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from polycorner.dumbbells.pair import DumbbellPair

PLACES = (
    ("lateral", "along the wall (mm)"),
    ("axial", "along the drum (mm)"),
    ("heading", "heading (degrees)"),
)
SHAPE = (
    ("length", "length l (mm)"),
    ("ball_radius", "ball radius r (mm)"),
    ("rod_radius", "rod radius t (mm)"),
    ("drum_radius", "drum radius R (mm)"),
)
BUTTONS = (
    ("fall", "Let it fall"),
    ("right", "Right-handed"),
    ("left", "Left-handed"),
    ("plane", "In the plane"),
    ("drum", "In the drum"),
)
MESSAGE = 512  # most bytes of a message; all sliders together need fewer


class UnknownMessageError(ValueError):
    """A message that the page never sends."""


@dataclass(frozen=True)
class SliderRange:
    """A number that the page may set: name, label, range and step."""

    name: str
    label: str
    low: float
    high: float
    step: float


def sliders_for(pair: DumbbellPair, radius: float) -> dict[str, SliderRange]:
    """Return the sliders of a pair by name, their ranges a few times its own lengths.

    Parameters
    ----------
    pair : DumbbellPair
    radius : float
        Of the drum, in mm, also if the pair starts in the plane.
    """
    reach = float(math.ceil(2 * (pair.length + 2 * pair.ball_radius)))
    fine = _fine(pair.ball_radius)
    limits = {"lateral": reach, "axial": reach, "heading": 180.0}
    found = [
        SliderRange(name, label, -limits[kind], limits[kind], 0.25 if kind == "heading" else fine)
        for body in "AB"
        for kind, label in PLACES
        for name in (f"{kind}_{body}",)
    ]
    r, shape = pair.ball_radius, dict(SHAPE)
    for name, low, high in (
        ("length", r, 3 * pair.length),
        ("ball_radius", r / 4, 3 * r),
        ("rod_radius", min(r / 20, pair.rod_radius), 3 * r),
        ("drum_radius", min(2 * r, radius), 4 * radius),
    ):
        found.append(SliderRange(name, shape[name], _round(low, fine), _round(high, fine), fine))
    return {slider.name: slider for slider in found}


def _fine(ball_radius: float) -> float:
    """Return a round step of about a fiftieth of a ball radius."""
    return float(10.0 ** math.floor(math.log10(ball_radius / 10)))


def _round(value: float, step: float) -> float:
    return max(step, round(value / step) * step)


def coordinates() -> list[str]:
    """Return the names of the sliders of the six coordinates, in their order."""
    return [f"{kind}_{body}" for body in "AB" for kind, _ in PLACES]


def hello(sliders: Mapping[str, SliderRange]) -> dict[str, Any]:
    """Return the groups of sliders and the buttons of the page, for JSON."""
    groups = [
        [f"Dumbbell {body}", [vars(sliders[f"{kind}_{body}"]) for kind, _ in PLACES]]
        for body in "AB"
    ]
    groups.append(["Shape", [vars(sliders[name]) for name, _ in SHAPE]])
    return {"groups": groups, "buttons": [list(button) for button in BUTTONS]}


def parsed(message: str, sliders: Mapping[str, SliderRange]) -> dict[str, float] | str:
    """Return slider values, or the name of a button, from a message of the page.

    Raises
    ------
    UnknownMessageError
        For all other messages, names and numbers.
    """
    try:
        content = json.loads(message)
    except (ValueError, RecursionError) as error:
        msg = "expected JSON: slider names with numbers, or the name of a button"
        raise UnknownMessageError(msg) from error
    if isinstance(content, str) and content in dict(BUTTONS):
        return content
    if not isinstance(content, dict) or not content:
        msg = "expected slider names with numbers, or the name of a button"
        raise UnknownMessageError(msg)
    return {name: _checked(name, value, sliders) for name, value in content.items()}


def _checked(name: str, value: object, sliders: Mapping[str, SliderRange]) -> float:
    slider = sliders.get(name)
    if slider is None:
        msg = "expected the name of a slider; got another one"
        raise UnknownMessageError(msg)
    # Integers of any size compare, but may not convert to float; nan is in no range.
    real = value if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    if slider.low <= real <= slider.high:
        return float(real)
    msg = f"{name}: expected a number from {slider.low:g} to {slider.high:g}"
    raise UnknownMessageError(msg)

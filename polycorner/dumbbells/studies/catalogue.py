"""The studies that the command line knows by name: function, units, study file, figure."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from polycorner.dumbbells.studies.bunches import bunch
from polycorner.dumbbells.studies.driven import driven
from polycorner.dumbbells.studies.functions import climbing, heading
from polycorner.dumbbells.studies.turning import turning
from polycorner.sweeps import NamedStudy

FOLDER = Path(__file__).parent
LENGTHS = dict.fromkeys(("length", "ball_radius", "rod_radius", "drum_radius"), "mm")
DRUM = LENGTHS | {"tilt": "deg", "spin": "rad/s", "duration": "s", "dt": "s", "noise": "1"}


def _named(function: Callable[..., Mapping[str, Any]], units: Mapping[str, str]) -> NamedStudy:
    name = function.__name__

    def figure(found: Any) -> Any:
        from polycorner.dumbbells.pictures.studies import draw_study  # not in workers

        return draw_study(name, found)

    return NamedStudy(function, units, FOLDER / f"{name}.toml", figure)


STUDIES: Mapping[str, NamedStudy] = {
    "heading": _named(heading, LENGTHS),
    "climbing": _named(climbing, DRUM),
    "bunch": _named(bunch, DRUM | {"top": "mm", "kick_time": "s"}),
    "driven": _named(driven, DRUM),
    "turning": _named(turning, DRUM | {"heading": "deg"}),
}

"""Options that describe a pair of dumbbells."""

from typing import TYPE_CHECKING, Any

from polycorner.cli import Command, added, naming, option, tell

if TYPE_CHECKING:
    from polycorner.dumbbells import DumbbellPair

GROUP = "Dumbbells and drum"
# option, the model's parameter, default (the paper's dyads), help
PARAMETERS = (
    ("length", "length", 16.0, "Distance of a dumbbell's ball centres, mm."),
    ("ball", "ball_radius", 3.0, "Radius of the balls, mm."),
    ("rod", "rod_radius", 1.5, "Radius of the rods, mm."),
    ("drum", "drum_radius", 125.0, "Radius of the drum, mm; inf for the plane."),
    ("rod_weight", "rod_weight", 0.0, "Weight of a rod, in weights of a ball."),
)


def pair_options(function: Command) -> Command:
    """Add the options that describe a pair of dumbbells."""
    every = (
        option(_flag(name), type=float, default=default, help=words, group=GROUP)
        for name, _, default, words in PARAMETERS
    )
    return added(function, *every)


def _flag(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def chosen_pair(values: dict[str, float]) -> "DumbbellPair":
    """Return the pair that the options describe."""
    tell("pair: " + ", ".join(f"{name} = {value:g}" for name, value in values.items()))
    from polycorner.dumbbells import DumbbellPair

    with naming({field: _flag(name) for name, field, _, _ in PARAMETERS}):
        return DumbbellPair(**{field: values[name] for name, field, _, _ in PARAMETERS})


def parameters(pair: "DumbbellPair") -> dict[str, Any]:
    """Return the parameters of a pair under the names of the options."""
    values: dict[str, Any] = {name: getattr(pair, field) for name, field, _, _ in PARAMETERS}
    values["drum"] = "inf" if pair.is_plane else pair.drum_radius
    return values

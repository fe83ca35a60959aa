"""``polycorner branches dyad``: the equilibria of two dumbbells as one of their sizes varies."""

from pathlib import Path
from typing import Any

import click

from polycorner.cli import (
    Asked,
    Vary,
    branch_options,
    command,
    examples,
    fail,
    followed,
    from_file,
    given,
    prepare,
    report_branches,
    working,
)
from polycorner.dumbbells.cli.options import chosen_pair, pair_options, parameters

# By option, the parameters of the formulas and their rates; rho is that of the drum less the ball.
RATES = {
    "length": {"l": 1.0},
    "ball": {"r": 1.0, "rho": -1.0},
    "rod": {"t": 1.0},
    "drum": {"R": 1.0, "rho": 1.0},
    "rod_weight": {"w": 1.0},
}


@command(
    epilog=examples(
        "branches dyad --vary rod=2:2.95 --json", "branches dyad --vary length=8:20 --out out"
    ),
)
@pair_options
@branch_options
def dyad(
    vary: Vary, asked: Asked, limits: dict[str, Any], as_json: bool, out: Path | None,
    **options: float,
) -> None:  # fmt: skip
    """Follow the right-handed dyad while length, ball, rod, drum or rod-weight varies.

    It begins at the pair's own size, or at LOW if that is not given.  Lengths are in mm; angles of
    points are in radians.
    """
    name = vary.name.replace("-", "_")
    if name not in RATES:
        known = ", ".join(key.replace("_", "-") for key in RATES)
        fail(f"--vary: expected one of {known}; got {vary.name!r}")
    value, flag = options[name], f"--{name.replace('_', '-')}"
    if not vary.low <= value <= vary.high:
        if given(name) or from_file(name):
            fail(f"{flag}: expected a value from {vary.low:g} to {vary.high:g}; got {value:g}")
        value = vary.low
    for end in (vary.low, vary.high):
        try:
            chosen_pair(options | {name: end})
        except click.UsageError as error:
            if not error.message.startswith(f"{flag}:"):
                raise
            fail(f"--vary: {error.message.removeprefix('--')}")
    pair = chosen_pair(options | {name: value})
    prepare(out)
    with working("following equilibria", "arcs") as progress:
        import numpy as np

        from polycorner.dumbbells.statics.minima import dyad_corner, energy_symmetry

        corner, symmetry = dyad_corner(pair, "R").certificate, energy_symmetry(pair)
        varied = corner.problem.parameter_values.keys() & RATES[name].keys()
        rates = {symbol: RATES[name][symbol] for symbol in sorted(varied)}
        interval = vary.low - value, vary.high - value
        limits |= {"symmetry": symmetry, "progress": progress}
        found = followed([corner], rates, interval, **limits).named(name, value)

    def heading(q: "np.ndarray") -> float:
        return float(np.degrees(pair.heading(q)[0]))

    report_branches(
        "dyad", parameters(pair), found, asked=asked, as_json=as_json, out=out, symmetry=symmetry,
        height=heading, label="heading of dumbbell A (degrees)",
    )  # fmt: skip

"""Options of ``polycorner drum``."""

from typing import Any

import click

from polycorner.cli import Command, from_file, given, option, output_options, seed_option

PLACING = "Dumbbells"
DRUM = "Drum"
CONTACT = "Friction"
RUN = "Simulation"
# What places the dumbbells: --pair or --start on the command line replaces all of it.
PLACEMENTS = ("pair", "heading", "start", "count")


def drum_options(function: Command) -> Command:
    """Add the options that describe a run and its answer."""
    number = click.FLOAT
    for add in reversed(
        (
            option(
                "--count", type=click.IntRange(1, 5000), group=PLACING,
                help="Number of dumbbells.  [default: 1, or as many as are placed]",
            ),
            option(
                "--pair", type=click.Choice(["R", "L"]), group=PLACING,
                help="Start as a right- or left-handed nested pair.",
            ),
            option(
                "--heading", type=number, multiple=True, group=PLACING,
                help="Initial heading, degrees; repeat for several.",
            ),
            option(
                "--start", type=number, nargs=3, multiple=True, metavar="DEG MM DEG",
                group=PLACING, help="Azimuth, eta and heading of a dumbbell; repeat for several.",
            ),
            option(
                "--length", type=number, default=16.0, group=PLACING,
                help="Distance of a dumbbell's ball centres, mm.",
            ),
            option(
                "--ball", type=number, default=3.0, group=PLACING, help="Radius of the balls, mm."
            ),
            option(
                "--rod", type=number, default=1.5, group=PLACING, help="Radius of the rods, mm."
            ),
            option(
                "--drum", type=number, default=125.0, group=DRUM, help="Radius of the drum, mm."
            ),
            option(
                "--top", type=number, group=DRUM,
                help="Length of the drum, mm; dumbbells beyond it leave.  [default: endless]",
            ),
            option(
                "--tilt", type=number, default=7.0, group=DRUM,
                help="Tilt of the drum's axis, degrees.",
            ),
            option(
                "--spin", type=number, default=0.01, group=DRUM,
                help="Angular speed of the drum, rad/s.",
            ),
            option(
                "--mu-slide", type=number, nargs=2, default=(0.3, 0.2), group=CONTACT,
                metavar="STATIC DYNAMIC", help="Coefficients of sliding friction.",
            ),
            option(
                "--mu-roll", type=number, nargs=2, default=(0.1, 0.06), group=CONTACT,
                metavar="STATIC DYNAMIC", help="Coefficients of rolling friction.",
            ),
            option(
                "--mu-contact", type=number, default=0.3, group=CONTACT,
                help="Coefficient of friction between dumbbells.",
            ),
            option(
                "--noise", type=number, default=0.0, group=RUN,
                help="Relative amplitude of the random loads.",
            ),
            option(
                "--duration", type=number, default=60.0, group=RUN, help="Simulated time, s."
            ),
            option("--dt", type=number, default=1e-3, group=RUN, help="Time step, s."),
            seed_option("the noise, the imperfections and the bunch", group=RUN),
            option(
                "--resume", is_flag=True, group=RUN,
                help="Continue a run that was stopped or killed.",
            ),
            option(
                "--movie", is_flag=False, flag_value="", metavar="[FILE]", group="Output",
                help="Movie, .mp4 or .gif; without a name it goes into the folder of --out.",
            ),
            output_options,
        )
    ):  # fmt: skip
        function = add(function)
    return function


def without_hidden(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values without placements of a file that the command line replaces."""
    if not (given("pair") or given("start")):
        return values
    return values | {name: None for name in PLACEMENTS if from_file(name)}

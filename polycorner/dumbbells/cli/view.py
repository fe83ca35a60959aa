"""``polycorner view``: a page to play with in the browser, served on this machine only."""

import importlib.util
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.common import fail, patience, writing
from polycorner.cli.manner import Command, manner, manner_options, remark
from polycorner.dumbbells.cli.options import chosen_pair, pair_settings

if TYPE_CHECKING:
    from tornado.web import Application

PORT = 8760
HOST = "127.0.0.1"
WORDS = "getting ready (the first run on a machine compiles for about 20 seconds)"
EXAMPLES = {
    "dyad": "polycorner view dyad --rod 1 --drum inf --port 9000 --no-browser",
    "atlas": "polycorner view atlas --drum inf --out atlas.html",
    "trajectory": "polycorner view trajectory out/trajectory.nc",
}


def _epilog(*names: str) -> str:
    lines = "\n".join(f"  {EXAMPLES[name]}" for name in names)
    return f"\b\nExamples:\n{lines}\nCtrl-C ends the server (exit code 0)."


class _Group(click.Group):
    """A group whose first subcommand is meant where none is named."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args or (args[0].startswith("-") and args[0] not in ctx.help_option_names):
            args = ["dyad", *args]
        return super().parse_args(ctx, args)


@click.group(cls=_Group, epilog=_epilog(*EXAMPLES))
def view() -> None:
    """Show a pair, its atlas or a recorded motion on a page in the browser; default dyad."""


def serving_options(command: Command) -> Command:
    """Add ``--port``, ``--host``, ``--no-browser``, ``--quiet`` and ``--verbose``."""
    for option in (
        click.option("--no-browser", is_flag=True, help="Print the address and open nothing."),
        click.option("--host", default=HOST, help=f"Address to listen on. [{HOST}]"),
        click.option(
            "--port", type=click.IntRange(0, 65535), default=PORT,
            help=f"Port; 0 is any that is free. [{PORT}]",
        ),
    ):  # fmt: skip
        command = option(command)
    return manner_options(command)


out_option = click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write this file instead, .html or .glb, and serve nothing.",
)


@view.command(epilog=_epilog("dyad"))
@pair_settings
@serving_options
def dyad(port: int, host: str, no_browser: bool, **options: float | None) -> None:
    """Sliders for two dumbbells, and what the library says of them at once."""
    pair = chosen_pair(None, options)
    _serve(lambda: _viewer().live_application(pair, host), host, port, browser=not no_browser)


@view.command(epilog=_epilog("atlas"))
@pair_settings
@click.option("--heading", type=float, default=0.0, help="Mean heading in the drum, degrees. [0]")
@out_option
@serving_options
def atlas(
    heading: float, out: Path | None, port: int, host: str,
    no_browser: bool, **options: float | None,
) -> None:  # fmt: skip
    """Show the forbidden solid of two dumbbells with its edges and corners."""
    pair = chosen_pair(None, options)
    if not math.isfinite(heading):
        fail(f"--heading: expected an angle in degrees; got {heading:g}")
    with patience(WORDS):
        from polycorner.dumbbells.pictures import scenes
        from polycorner.dumbbells.statics.skeleton import pair_atlas
        from polycorner.dumbbells.viewer import page as scene_page

        found = pair_atlas(pair, heading=math.radians(heading))
    _deliver(
        lambda: scene_page.atlas_page(found), lambda: scenes.atlas_scene(found),
        out, host, port, browser=not no_browser,
    )  # fmt: skip


@view.command(epilog=_epilog("trajectory"))
@click.argument("file", type=click.Path(path_type=Path))
@out_option
@serving_options
def trajectory(file: Path, out: Path | None, port: int, host: str, no_browser: bool) -> None:
    """Play a motion in the drum that ``polycorner drum --out`` wrote."""
    from polycorner.dumbbells.dynamics.files import load_run

    try:
        run = load_run(file)
    except (OSError, ValueError, KeyError) as error:
        fail(f"FILE: expected a trajectory as of polycorner drum --out; got {file} ({error})")
    from polycorner.dumbbells.pictures import film as scene_film
    from polycorner.dumbbells.pictures import scenes
    from polycorner.dumbbells.viewer import page as scene_page

    _deliver(
        lambda: scene_page.film_page(scene_film.run_film(run)),
        lambda: scenes.drum_scene(run.drum, run.trajectory.q[-1]),
        out, host, port, browser=not no_browser,
    )  # fmt: skip


def _deliver(
    page: Callable[[], str], scene: Callable[[], Any], out: Path | None, host: str, port: int,
    *, browser: bool,
) -> None:  # fmt: skip
    """Write a page or a scene, or serve the page."""
    if out is None:
        _serve(lambda: _viewer().page_application(page(), host), host, port, browser=browser)
        return
    from polycorner.dumbbells.pictures import scenes
    from polycorner.dumbbells.viewer import page as scene_page

    suffix = out.suffix.lower()
    if suffix not in (".html", ".glb"):
        fail(f"--out: expected a file name that ends in .html or .glb; got {out}")
    with writing(out):
        if suffix == ".html":
            scene_page.write_page(page(), out)
        else:
            scenes.write_scene(scene(), out)
    if not manner().quiet:
        click.echo(f"wrote {out}")


def _viewer() -> Any:
    """Return the pages that are served, whose library is an extra."""
    from polycorner.dumbbells.viewer import applications

    return applications


def _serve(made: "Callable[[], Application]", host: str, port: int, *, browser: bool) -> None:
    """Take the port, get the pages ready, and serve until Ctrl-C."""
    if importlib.util.find_spec("tornado") is None:
        fail("expected tornado to be installed, as by pip install 'polycorner[view]'; got none")
    from polycorner.dumbbells.viewer import server as viewer_server

    def ready(address: str) -> None:
        click.echo(f"{address}   (Ctrl-C ends)")
        if host not in (HOST, "localhost", "::1"):
            remark(f"others on the network can reach {host}")
        if browser:
            click.launch(address)

    try:
        listener = viewer_server.bound(host, port)
    except viewer_server.PortTakenError as error:
        fail(f"--port: {error.strerror}")
    except OSError as error:
        fail(f"--host: {host} cannot be listened on ({error.strerror or error})")
    with listener:
        with patience(WORDS):
            application = made()
        viewer_server.serve(application, listener, ready)

"""``polycorner view``: pages for the browser, served on this machine only."""

import importlib.util
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli import (
    Command,
    GroupedCommand,
    added,
    config_option,
    examples,
    fail,
    option,
    remark,
    verbosity,
    verbosity_options,
    working,
    writing,
)
from polycorner.dumbbells.cli.options import GROUP, chosen_pair, pair_options

if TYPE_CHECKING:
    from tornado.web import Application

PORT = 8760
HOST = "127.0.0.1"
WORDS = "preparing the page"
EXAMPLES = {
    "dyad": "view dyad --rod 1 --drum inf --port 9000 --no-browser",
    "atlas": "view atlas --drum inf --out atlas.html",
    "trajectory": "view trajectory out/trajectory.nc",
}


def _epilog(*names: str) -> str:
    return examples(*(EXAMPLES[name] for name in names)) + "Ctrl-C ends the server (exit code 0)."


class _DyadByDefault(click.Group):
    """A group whose subcommand is ``dyad`` unless one is named."""

    command_class = GroupedCommand

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        if not args or (args[0].startswith("-") and args[0] not in ctx.help_option_names):
            args = ["dyad", *args]
        return super().parse_args(ctx, args)


@click.group(cls=_DyadByDefault, epilog=_epilog(*EXAMPLES))
def view() -> None:
    """Show a pair, its atlas or a recorded motion in the browser; dyad by default."""


def serving_options(function: Command) -> Command:
    """Add ``--port``, ``--host``, ``--no-browser`` and the general options."""
    return added(
        function,
        option(
            "--port", type=click.IntRange(0, 65535), default=PORT, group="Server",
            help="Port; 0 for any that is free.",
        ),
        option("--host", default=HOST, group="Server", help="Address to listen on."),
        option(
            "--no-browser", is_flag=True, group="Server", help="Print the address, open nothing."
        ),
        config_option,
        verbosity_options,
    )  # fmt: skip


out_option = option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    group="Output",
    help="Write this file, .html or .glb, and serve nothing.",
)


@view.command(epilog=_epilog("dyad"))
@pair_options
@serving_options
def dyad(port: int, host: str, no_browser: bool, **options: float) -> None:
    """Show two dumbbells with sliders: energy, gaps, headings and descents."""
    pair = chosen_pair(options)
    _serve(lambda: _viewer().live_application(pair, host), host, port, browser=not no_browser)


@view.command(epilog=_epilog("atlas"))
@pair_options
@option(
    "--heading", type=float, default=0.0, help="Mean heading in the drum, degrees.", group=GROUP
)
@out_option
@serving_options
def atlas(
    heading: float, out: Path | None, port: int, host: str,
    no_browser: bool, **options: float,
) -> None:  # fmt: skip
    """Show the solid of overlapping placements with its edges and corners."""
    pair = chosen_pair(options)
    if not math.isfinite(heading):
        fail(f"--heading: expected an angle in degrees; got {heading:g}")
    with working(WORDS):
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
    """Play a motion in the drum, FILE being written by polycorner drum --out."""
    from polycorner.dumbbells.drum import drum_of
    from polycorner.dumbbells.dynamics.files import load_run

    try:
        run = load_run(file)
    except (OSError, ValueError, KeyError) as error:
        fail(f"FILE: expected a trajectory written by polycorner drum --out; got {file} ({error})")
    from polycorner.dumbbells.pictures import film as scene_film
    from polycorner.dumbbells.pictures import scenes
    from polycorner.dumbbells.viewer import page as scene_page

    _deliver(
        lambda: scene_page.film_page(scene_film.run_film(run)),
        lambda: scenes.drum_scene(drum_of(run), run.q[-1]),
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
    if not verbosity().quiet:
        click.echo(f"wrote {out}")


def _viewer() -> Any:
    """Return the module of the pages, which needs an extra."""
    from polycorner.dumbbells.viewer import applications

    return applications


def _serve(make: "Callable[[], Application]", host: str, port: int, *, browser: bool) -> None:
    """Bind the port, prepare the pages and serve them until Ctrl-C."""
    if importlib.util.find_spec("tornado") is None:
        from polycorner.toolkit import missing_extra

        fail(str(missing_extra("tornado", "view")))
    from polycorner.dumbbells.viewer import server as viewer_server

    def ready(address: str) -> None:
        click.echo(f"{address}   (Ctrl-C ends)")
        if host not in (HOST, "localhost", "::1"):
            remark(f"{host} can be reached from the network")
        if browser:
            click.launch(address)

    try:
        listener = viewer_server.bound(host, port)
    except viewer_server.PortTakenError as error:
        fail(f"--port: {error.strerror}")
    except ValueError:
        fail(f"--host: {host} is not the name of a machine")
    except OSError as error:
        fail(f"--host: {host} cannot be listened on ({error.strerror or error})")
    with listener:
        with working(WORDS):
            application = make()
        viewer_server.serve(application, listener, ready)

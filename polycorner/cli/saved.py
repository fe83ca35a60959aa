"""What ``polycorner view`` does with a motion or a skeleton in a file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from polycorner.cli.output import fail, working, writing

FILMS, OTHERS = (".html", ".gif", ".mp4"), (".glb", ".gsd", ".xyz")


def view_motion(file: Path, out: Path | None) -> None:
    """Write the film of a motion in a file, or the motion for other programs, and show a page."""
    path = out or Path(file.stem).with_suffix(".html")
    if path.suffix.lower() not in FILMS + OTHERS:
        fail(f"--out: expected a file name that ends in {', '.join(FILMS + OTHERS)}; got {path}")
    with working("drawing"):
        from polycorner.files.trajectories import saved_poses
        from polycorner.pictures.exports import write_poses
        from polycorner.pictures.motion_films import film_of

        poses = _loaded(file, saved_poses)
        _written(path, lambda: (
            film_of(poses, title=file.stem).save(Path(path)) if path.suffix.lower() in FILMS
            else write_poses(poses, path)
        ))  # fmt: skip
    _told(path, out)


def view_skeleton(file: Path, out: Path | None) -> None:
    """Write the picture of a skeleton of the plane, or a page of any other, and show it."""
    with working("drawing"):
        from polycorner.atomic import write_atomically
        from polycorner.files import load_skeleton
        from polycorner.pictures import draw_region, save, skeleton_page

        found = _loaded(file, load_skeleton)
        d = found.polyhedron
        flat = d.manifold.size == 2 and not d.equations and not d.manifold.circles
        path = out or Path(file.stem).with_suffix(".png" if flat else ".html")
        if flat and path.suffix.lower() != ".html":
            _written(path, lambda: save(draw_region(found), path))
        else:
            page = skeleton_page(found)
            _written(path, lambda: write_atomically(path, page, suffix=".html"))
    _told(path, out)


def _loaded(file: Path, load: Callable[[Path], Any]) -> Any:
    try:
        return load(file)
    except (ValueError, TypeError) as error:
        fail(str(error).replace("path: ", "FILE: ", 1))
    except OSError as error:
        fail(f"{error.filename or file} cannot be read ({error.strerror or error})")


def _written(path: Path, write: Callable[[], object]) -> None:
    try:
        with writing(path):
            write()
    except (ValueError, ImportError) as error:
        fail(f"--out: {str(error).removeprefix('path: ')}")


def _told(path: Path, out: Path | None) -> None:
    click.echo(f"wrote {path}")
    if out is None:
        click.launch(str(path))

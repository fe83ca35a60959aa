"""What ``polycorner view`` does with a motion or a skeleton in a file."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.output import fail, working, writing

if TYPE_CHECKING:
    from polycorner.files import ProblemFile
    from polycorner.polyhedra.polyhedron import Polyhedron

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

        poses = loaded(file, saved_poses)
        _finish(path, out, lambda: (
            film_of(poses, title=file.stem).save(Path(path)) if path.suffix.lower() in FILMS
            else write_poses(poses, path)
        ))  # fmt: skip


def view_skeleton(file: Path, out: Path | None) -> None:
    """Write the picture of a skeleton of the plane, or a page of any other, and show it."""
    with working("drawing"):
        from polycorner.atomic import write_atomically
        from polycorner.files import load_skeleton
        from polycorner.pictures import draw_region, save, skeleton_page

        found = loaded(file, load_skeleton)
        flat = is_flat(found.polyhedron)
        path = out or Path(file.stem).with_suffix(".png" if flat else ".html")
        if flat and path.suffix.lower() != ".html":
            _finish(path, out, lambda: save(draw_region(found), path))
        else:
            page = skeleton_page(found)
            _finish(path, out, lambda: write_atomically(path, page, suffix=".html"))


def view_problem(
    file: Path, problem: "ProblemFile", points: Any, rng: Any, out: Path | None
) -> None:
    """Write the picture of a problem in the plane, and show it; ``points`` are those of starts."""
    with working("drawing"):
        from polycorner import skeleton
        from polycorner.pictures import draw_region, save

        found = skeleton(problem.polyhedron, points, rng=rng)
        figure = draw_region(found, minima=[*problem.points.items()])
        path = out or Path(file.stem).with_suffix(".png")
        _finish(path, out, lambda: save(figure, path))


def is_flat(polyhedron: "Polyhedron") -> bool:
    """Whether a polyhedron is a region of a plane."""
    manifold = polyhedron.manifold
    return manifold.size == 2 and not polyhedron.equations and not manifold.circles


def loaded(file: Path, load: Callable[[Path], Any]) -> Any:
    """Return what is in a file, or end the command with what is wrong in it."""
    try:
        return load(file)
    except (ValueError, TypeError) as error:
        fail(str(error).replace("path: ", "FILE: ", 1))
    except OSError as error:
        fail(f"{error.filename or file} cannot be read ({error.strerror or error})")


def _finish(path: Path, out: Path | None, write: Callable[[], object]) -> None:
    """Write a file, name it, and show it where the command line did not name it."""
    try:
        with writing(path):
            write()
    except (ValueError, ImportError) as error:
        fail(f"--out: {str(error).removeprefix('path: ')}")
    click.echo(f"wrote {path}")
    if out is None:
        click.launch(str(path))

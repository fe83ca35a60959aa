"""Problems as TOML files: a polyhedron, an energy and points, by hand or by the library."""

import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polycorner.atomic import write_atomically
from polycorner.checks import about, refuse
from polycorner.container import FileError, one_sentence
from polycorner.files.formulas import DEEPEST
from polycorner.files.problem_numbers import MOST_BYTES, limited
from polycorner.files.problem_reading import Range, Reader
from polycorner.files.problem_writing import problem_text
from polycorner.formulas.functions import SmoothFunction
from polycorner.kinds import checked
from polycorner.polyhedra.polyhedron import Polyhedron
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

if TYPE_CHECKING:
    import sympy


@dataclass(frozen=True, eq=False)
class ProblemFile(Checked):
    """The contents of a problem file.

    Attributes
    ----------
    polyhedron : Polyhedron
    energy : SmoothFunction or None
        What is minimised: the negative of what the file maximises.
    maximised : bool
        Whether the file states the negative of the energy.
    points : mapping from str to (n,) array
        Points by name, vectors of spheres and rotations as they are written.
    exact : mapping from str to tuple of str
        The same numbers as the file writes them, with all digits: decimals or fractions.
    box : tuple of (float, float) or None
        Where random points are sought, for each coordinate; None for a whole circle or sphere.
    title : str
    """

    polyhedron: Polyhedron
    energy: SmoothFunction | None = None
    maximised: bool = False
    points: Mapping[str, Array] = field(default_factory=dict)
    exact: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    box: tuple[Range | None, ...] = ()
    title: str = ""


@checked
def load_problem(path: str | os.PathLike[str]) -> ProblemFile:
    """Read a problem from a TOML file; nothing in it is executed.

    ::

        title = "Three equal circles in the unit square"
        coordinates = ["(x[i], y[i]) for i in 1..3", "r"]
        energy.maximise = "r"

        [inequalities]
        "wall[i] for i in 1..3" = "r <= x[i] <= 1 - r"
        "floor[i] for i in 1..3" = "r <= y[i] <= 1 - r"
        "gap[i,j] for i in 1..3 for j in i+1..3" = "(x[i]-x[j])**2 + (y[i]-y[j])**2 - 4*r**2"

        [points]
        table = { file = "circles.csv", then = ["0.2543330950302498"] }

    :doc:`/problems` describes all keys.

    Parameters
    ----------
    path : path
        Tables of points that the file names are read from its folder, or from folders in it.

    Raises
    ------
    ValueError
        Naming file, line and key, what was expected and what came.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "bowl.toml"
    >>> _ = path.write_text('''
    ... coordinates = ["x", "y"]
    ... energy.minimise = "x + y"
    ... inequalities.bowl = "y >= x**2"
    ... points.start = [0, "1/3"]
    ... ''')
    >>> problem = load_problem(path)
    >>> problem.polyhedron.names, problem.points["start"].round(2).tolist()
    (('bowl',), [0.0, 0.33])
    """
    file = Path(path)
    content = limited(file)

    def refusal(why: str) -> ValueError:
        return FileError(f"{file}{_line(content.decode(errors='replace'), why)}: {why}")

    with one_sentence(refusal):
        try:
            entries = tomllib.loads(content.decode(), parse_float=Decimal)
        except (ValueError, RecursionError) as error:
            msg = f"expected a TOML file that can be read; got {error}"
            raise ValueError(msg) from error
        reader = Reader(entries, file.parent)
        energy, maximised = reader.energy()
        points = dict(reader.points())
        return ProblemFile(
            reader.polyhedron(),
            energy,
            maximised,
            {name: np.array([float(Fraction(x)) for x in row]) for name, row in points.items()},
            points,
            tuple(reader.box),
            reader.title,
        )


@checked
def save_problem(
    path: str | os.PathLike[str],
    polyhedron: Polyhedron,
    energy: "SmoothFunction | sympy.Expr | None" = None,
    points: Mapping[str, Any] | None = None,
    *,
    box: Sequence[Range | None] = (),
    title: str = "",
) -> Path:
    """Write a polyhedron, an energy on it and points as a file that :func:`load_problem` reads.

    The file contains formulas with all definitions written out and no Python functions:
    annotations are left out.  Parameters of one name with several values get a number.

    Parameters
    ----------
    path : path
        Ends in ``.toml`` where commands are to read it.
    polyhedron : Polyhedron
    energy : SmoothFunction or sympy.Expr, optional
        To be minimised.
    points : mapping from str to sequence, optional
        Points by name: numbers with all their bits, or decimals and fractions as text.
    box : sequence of (float, float) or None, optional
        Where random points are sought, for each coordinate.
    title : str, optional

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        For names that stand for families in such a file, formulas beyond what is read, and points
        with another number of coordinates.
    OSError
        If it cannot be written.
    """
    if energy is not None and not isinstance(energy, SmoothFunction):
        energy = SmoothFunction("energy", energy, polyhedron.manifold)
    with about("polyhedron"):
        try:
            text = "\n".join(problem_text(polyhedron, energy, points or {}, tuple(box), title))
        except RecursionError:
            refuse("formulas", f"at most {DEEPEST} operations in each other", "deeper ones")
        if len(text.encode()) > MOST_BYTES:
            refuse("formulas", f"at most {MOST_BYTES} bytes", len(text.encode()))
        reader = Reader(tomllib.loads(text, parse_float=Decimal), Path())
        reader.polyhedron(), reader.energy(), [*reader.points()]  # it is read, here or never
    return write_atomically(path, text)


def _line(text: str, why: str) -> str:
    """Return the line of the key that a sentence begins with, where it stands there once."""
    if (written := re.search(r"\(at line (\d+)", why)) is not None:
        return f", line {written[1]}"
    place = why.split(": ", maxsplit=1)[0].partition(".")
    key = place[2] or place[0].partition("[")[0]
    pattern = rf"^\s*(?:[\w.]+\.)?[\"']?{re.escape(key)}[\"']?\s*="
    while key and "." in key and not re.search(pattern, text, re.MULTILINE):
        key = key.rpartition(".")[0]
        pattern = rf"^\s*(?:[\w.]+\.)?[\"']?{re.escape(key)}[\"']?\s*="
    found = [text.count("\n", 0, m.end()) + 1 for m in re.finditer(pattern, text, re.MULTILINE)]
    return f", line {found[0]}" if len(found) == 1 else ""

"""Commands on a problem in a file: ``polycorner prove FILE.toml``, and so on."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from polycorner.cli.atlas import STARTS, planar, skeletal
from polycorner.cli.branches import WORDS as FOLLOWING
from polycorner.cli.branches import Asked, Vary, branch_options, followed, report_branches
from polycorner.cli.landscape import (
    FLAGS,
    Telling,
    landscape_options,
    report_landscape,
    searched,
)
from polycorner.cli.landscape import WORDS as PASSES
from polycorner.cli.minima import WORDS, report_minima, start_options
from polycorner.cli.options import (
    command,
    digits_option,
    examples,
    option,
    output_options,
    read_interval,
    seed_option,
)
from polycorner.cli.output import (
    deliver,
    fail,
    prepare,
    save_proof,
    shown,
    working,
    write_answer,
)
from polycorner.cli.saved import is_flat, loaded, view_motion, view_problem, view_skeleton
from polycorner.cli.search import Begin, search_options

if TYPE_CHECKING:
    from polycorner.files import ProblemFile
    from polycorner.formulas.functions import SmoothFunction
    from polycorner.minimisation import Certificate
    from polycorner.printing import Sheet
    from polycorner.proofs import Proof

DRAWN = 20  # times as many random points, of which those in the set are taken first
FILE = "examples/problems/circles_in_square.toml"


def with_problem(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the argument FILE, and pass the problem in it."""
    return click.argument("file", metavar="FILE", type=click.Path(path_type=Path))(function)


def read(file: Path) -> "ProblemFile":
    """Return a problem, or end the command with what is wrong in its file."""
    from polycorner.files import load_problem

    problem: ProblemFile = loaded(file, load_problem)
    return problem


def _read_posed(file: Path) -> "tuple[ProblemFile, SmoothFunction]":
    """Return a problem and its energy, or end the command."""
    problem = read(file)
    if problem.energy is None:
        fail(f"{file}: energy: expected minimise or maximise; got none")
    return problem, problem.energy


# ------------------------------------------------------------------------------------------- prove


@command(epilog=examples(f"prove {FILE}", f"prove {FILE} --point quincunx --digits 100 --out out"))
@with_problem
@option(
    "--point",
    "chosen",
    multiple=True,
    metavar="NAME",
    group="Proof",
    help="Points of the file; repeat for several. [all]",
)
@digits_option
@option(
    "--box",
    "boxes",
    multiple=True,
    metavar="NAME=LOW:HIGH",
    group="Proof",
    help="Prove it for all values of a parameter in an interval; repeat for several.",
)
@option("--minimise", is_flag=True, group="Proof", help="Descend from the points first.")
@output_options
def prove(
    file: Path, chosen: tuple[str, ...], digits: int, boxes: tuple[str, ...], minimise: bool,
    as_json: bool, out: Path | None,
) -> None:  # fmt: skip
    """Prove that there are local minima at the points of FILE, and enclose them.

    First it is said whether the coordinates as they are written lie in the set.
    """
    problem, energy = _read_posed(file)
    names = _chosen(problem, chosen, file)
    sides = dict(_interval(problem, written) for written in boxes)
    prepare(out)
    rows, sheets, written = [], [], []
    for name in names:
        with working(f"proving {name}") as progress:
            given, proof = _judged(problem, energy, name, digits, sides, minimise, progress)
        rows.append({"point": name, "given": given, **_answer(problem, proof)})
        sheets.append(_sheet(name, given, problem, proof))
        if out is not None and proof.proved:
            saved = save_proof(proof, out / f"{name}.zip", rows[-1])
            if saved:
                rows[-1]["file"] = str(saved[0])
            written += saved
    answer = {"problem": str(file), "title": problem.title, "proofs": rows}

    deliver(
        answer,
        lambda: "\n\n".join(map(shown, sheets)),
        lambda folder: [*written, write_answer(answer, folder, "proofs.json")],
        as_json=as_json,
        out=out,
    )


def membership(problem: "ProblemFile", name: str) -> dict[str, Any]:
    """Return whether the coordinates of a point, as the file writes them, lie in the set.

    ``inside`` is null where that is not decided; ``violated`` has values, as texts, by name.
    """
    from polycorner import exact_point

    found = exact_point(problem.polyhedron, problem.exact[name], problem.energy)
    violated = {v.name: list(v.value) for v in found.violations}
    energy = None if found.energy is None else list(found.energy)
    return {"inside": found.inside, "violated": violated, "near": energy}


def _chosen(problem: "ProblemFile", chosen: Sequence[str], file: Path) -> list[str]:
    from polycorner.errors import nearest

    if not problem.points:
        fail(f"{file}: points: expected at least one; polycorner minima {file} searches for some")
    for name in chosen:
        if name not in problem.points:
            known = ", ".join(problem.points)
            fail(f"--point: expected one of {known}; got {nearest(name, problem.points)}")
    return list(dict.fromkeys(chosen or problem.points))


def _interval(problem: "ProblemFile", written: str) -> tuple[str, tuple[float, float]]:
    name, *ends = read_interval("--box", written, "t=0.9:1.1")
    _check_parameter(problem, "--box", name, written)
    return name, (ends[0], ends[1])


def _check_parameter(problem: "ProblemFile", flag: str, name: str, written: str) -> None:
    """End the command where no function of a problem has a parameter."""
    functions = [*problem.polyhedron.functions, *problem.polyhedron.stated, problem.energy]
    known = {p for f in functions if f is not None for p in f.family.parameters}
    if name not in known:
        words = ", ".join(sorted(known)) or "none: parameters that vary are decimals in the file"
        fail(f"{flag}: expected NAME=LOW:HIGH with one of the parameters {words}; got {written!r}")


def _judged(
    problem: "ProblemFile", energy: "SmoothFunction", name: str, digits: int,
    sides: dict[str, Any], minimise: bool, progress: Any,
) -> "tuple[dict[str, Any], Proof]":  # fmt: skip
    """Return what is said of the coordinates as written, and of the point near them."""
    import polycorner as pc

    find: Callable[..., Certificate] = pc.minimise if minimise else pc.certify
    try:
        given = membership(problem, name)
        found = find(problem.polyhedron, energy, problem.points[name])
        return given, pc.prove(found, digits=digits, parameters=sides or None, progress=progress)
    except ValueError as error:
        fail(f"point {name}: {error}")


def _answer(problem: "ProblemFile", proof: "Proof") -> dict[str, Any]:
    energy = proof.enclosures.get("energy")
    answer: dict[str, Any] = {
        "verdict": proof.certificate.verdict.value,
        "proved": proof.proved,
        "statement": proof.statement,
        "conditions": {name: str(status) for name, status in proof.conditions.items()},
        "reasons": dict(proof.reasons),
        "active": list(proof.active),
        "modulo": list(proof.symmetry),
        "digits": proof.digits,
        "enclosures": {name: list(sides) for name, sides in proof.enclosures.items()},
        "rattlers": {name: list(sides) for name, sides in proof.room.items()},
        "alone": {name: list(sides) for name, sides in proof.box.items()},
    }
    if problem.maximised and energy is not None:  # the bounds of the negative, exchanged
        answer["maximum"] = [_negative(energy[1]), _negative(energy[0])]
    if proof.parameters:
        answer["box"] = {name: list(sides) for name, sides in proof.parameters.items()}
        answer["proved_fraction"] = proof.proved_fraction
        answer["cells"] = len(proof.cells)
    return answer


def _negative(decimals: str) -> str:
    return decimals.removeprefix("-") if decimals.startswith("-") else f"-{decimals}"


def _sheet(name: str, given: dict[str, Any], problem: "ProblemFile", proof: "Proof") -> "Sheet":
    from polycorner.printing import Sheet, Table

    words = {
        True: "the coordinates as written lie in the set",
        False: "the coordinates as written lie outside the set",
        None: "whether the coordinates as written lie in the set is not decided",
    }[given["inside"]]
    parts: list[Any] = [f"{words}."]
    rows = tuple((n, value[0], value[-1]) for n, value in given["violated"].items())
    if rows:
        parts.append(Table(("violated as written", "from", "to"), rows, (1, 2)))
    answer = _answer(problem, proof)
    if "maximum" in answer:
        parts.append("The energy is the negative of what is maximised, which lies between "
                     f"{answer['maximum'][0]} and {answer['maximum'][1]}.")  # fmt: skip
    room = tuple((n, low, high) for n, (low, high) in answer["rattlers"].items())
    if room:
        parts.append(Table(("free to move", "from", "to"), room, (1, 2)))
    return Sheet(name, (*parts, *proof.sheet.parts))


# ----------------------------------------------------------------------------------- atlas, minima


@command(epilog=examples(f"atlas {FILE} --budget 100", "atlas region.toml --out out"))
@with_problem
@search_options
def atlas(file: Path, begin: Begin) -> None:
    """List corners, edges and faces of the set in FILE.

    The search descends from the points of the file and from random ones.
    """
    problem = read(file)
    search = begin(file.stem, {"file": str(file.resolve())})

    d = problem.polyhedron
    found = partial(inner_starts, problem)
    (planar if is_flat(d) else skeletal)(search, d, found)


@command(epilog=examples(f"minima {FILE} --starts 100"))
@with_problem
@start_options
def minima(file: Path, starts: int, seed: int, as_json: bool, out: Path | None) -> None:
    """Find the local minima of the problem in FILE, from its points and random ones."""
    problem, energy = _read_posed(file)
    prepare(out)
    with working(WORDS, "starts") as progress:
        import numpy as np

        from polycorner.minimisation import minima as search

        points = _starts(problem, np.random.default_rng(seed), starts)
        try:
            found = search(problem.polyhedron, energy, starts=points, progress=progress)
        except ValueError as error:
            fail(f"{file}: {error}")
    numbers = {id(c): str(k) for k, c in enumerate(found)}

    def described(certificate: "Certificate") -> dict[str, Any]:
        return {"name": numbers[id(certificate)]}

    about = {"file": str(file)}
    report_minima(file.stem, about, found, described, energy.unit, as_json=as_json, out=out)


def inner_starts(problem: "ProblemFile", rng: Any) -> Any:
    """Return the points of a file and random ones, those in the set first, ``(k, n)``."""
    import numpy as np

    given = len(problem.points)
    found = _starts(problem, rng, given + DRAWN * STARTS)
    outside = ~problem.polyhedron.contains(found[given:])
    order = np.argsort(outside, kind="stable")[: max(STARTS - given, 0)]
    return np.vstack([found[:given], found[given:][order]])


def _starts(problem: "ProblemFile", rng: Any, count: int) -> Any:
    """Return the points of a file and random ones, ``(k, n)``, in its box.

    Where a line has none, they lie about the points of the file, within two units of its scale.
    """
    import numpy as np

    manifold = problem.polyhedron.manifold
    given = np.array([*problem.points.values()]).reshape(-1, manifold.size)
    centres = given if len(given) else np.zeros((1, manifold.size))
    more = max(count - len(given), 0)
    found = np.empty((more, manifold.size))
    for i, (side, period) in enumerate(zip(problem.box, manifold.periods, strict=True)):
        reach = 2 * manifold.scales[i]
        low, high = centres[:, i].min() - reach, centres[:, i].max() + reach
        if np.isfinite(period):
            low, high = 0.0, period
        found[:, i] = rng.uniform(*(side or (low, high)), more)
    if manifold.factors:
        found = manifold.factors.scattered(found, rng)
    return manifold.onto(np.vstack([given, found]))


# --------------------------------------------------------------------------------------- landscape


@command(epilog=examples("landscape region.toml --cap 2", f"landscape {FILE} --starts 100"))
@with_problem
@option(
    "--starts",
    type=click.IntRange(min=1),
    group="Search",
    help="Search from so many starts, which proves nothing. [complete lists]",
)
@seed_option("the starts")
@landscape_options
def landscape(
    file: Path, starts: int | None, seed: int, limits: dict[str, Any], as_json: bool,
    out: Path | None,
) -> None:  # fmt: skip
    """Tell over which passes the minima of the problem in FILE are left, and how high these are.

    With proof, if the file gives each coordinate on a line a box and there are no spheres and
    rotations; or as found by searches from --starts.
    """
    problem, energy = _read_posed(file)
    if starts is None:
        limits["box"] = _boxes(problem, file)
    elif unused := limits.keys() - {"cap"}:
        flags = ", ".join(sorted(FLAGS[name] for name in unused))
        fail(f"--starts: expected no {flags} beside it, which are of complete lists; got both")
    prepare(out)
    with working(PASSES, "boxes" if starts is None else "starts") as progress:
        if starts is not None:
            import numpy as np

            rng = np.random.default_rng(seed)
            limits |= {"starts": _starts(problem, rng, starts), "rng": rng}
        found = searched(problem.polyhedron, energy, progress=progress, **limits)
    telling = Telling(unit=energy.unit)
    report_landscape(file.stem, {"file": str(file)}, found, telling, as_json=as_json, out=out)


def _boxes(problem: "ProblemFile", file: Path) -> dict[str, Any]:
    """Return the boxes of all coordinates on lines, or end the command where one is missing."""
    manifold = problem.polyhedron.manifold
    circles = {manifold.names[i] for i in manifold.circles}
    box = {n: b for n, b in zip(manifold.names, problem.box, strict=True) if n not in circles}
    missing = [name for name, sides in box.items() if sides is None]
    if missing:
        fail(f"{file}: coordinates: expected a box of {', '.join(missing)}, in which passes are"
             " listed, or --starts; got none")  # fmt: skip
    return box


# ---------------------------------------------------------------------------------------- branches


@command(epilog=examples("branches truss.toml --vary load=0:1.5", "branches truss.toml --help"))
@with_problem
@option(
    "--point",
    "chosen",
    multiple=True,
    metavar="NAME",
    group="Parameter",
    help="Points of the file from whose minima it begins; repeat for several. [all]",
)
@option(
    "--of",
    default="energy",
    metavar="NAME",
    group="Output",
    help="Coordinate that the figure shows over the parameter, or energy.",
)
@branch_options
def branches(
    file: Path, chosen: tuple[str, ...], of: str, vary: Vary, asked: Asked, limits: dict[str, Any],
    as_json: bool, out: Path | None,
) -> None:  # fmt: skip
    """Follow the equilibria of the problem in FILE while a parameter of it varies.

    Parameters that vary are decimals in the file; their values there are those at which it begins,
    in the minima below the points of the file.
    """
    problem, energy = _read_posed(file)
    names = _chosen(problem, chosen, file)
    _check_parameter(problem, "--vary", vary.name, f"{vary.name}={vary.low:g}:{vary.high:g}")
    if of not in ("energy", *problem.polyhedron.manifold.names):
        known = ", ".join(problem.polyhedron.manifold.names)
        fail(f"--of: expected energy, or one of the coordinates {known}; got {of}")
    prepare(out)
    with working(FOLLOWING, "arcs") as progress:
        from polycorner import minimise

        d, starts = problem.polyhedron, []
        for name in names:
            try:
                starts.append(minimise(d, energy, problem.points[name]))
            except ValueError as error:
                fail(f"point {name}: {error}")
        value = min(starts[0].problem.parameter_values[vary.name])
        if not vary.low <= value <= vary.high:
            fail(f"--vary: expected an interval that contains {value:g}, the value in {file}; got"
                 f" {vary.low:g}:{vary.high:g}")  # fmt: skip
        found = followed(starts, vary.name, vary[1:], progress=progress, **limits)
    about = {"file": str(file)}
    box = None if None in problem.box else dict(zip(d.manifold.names, problem.box, strict=True))
    report_branches(
        file.stem, about, found, asked=asked, as_json=as_json, out=out, box=box, height=of
    )


# -------------------------------------------------------------------------------------------- view


@command(epilog=examples("view region.toml --out region.png", "view motion.nc --out motion.gif"))
@with_problem
@option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    group="Output",
    help="Write the picture into this file, and open nothing.",
)
@seed_option("the random points")
def view(file: Path, out: Path | None, seed: int) -> None:
    """Show what is in FILE: a region, a motion of bodies or a skeleton.

    A problem, .toml, is a region of the plane, with its corners and points; for other sets, see
    polycorner atlas.  A motion, .nc, was written by save_trajectory with its arrangement: it is a
    page that plays, or with --out an image (.gif, .mp4) or for other programs (.glb, .gsd, .xyz).
    A skeleton, .json, was written by save_skeleton.
    """
    if file.suffix.lower() == ".nc":
        view_motion(file, out)
        return
    if file.suffix.lower() == ".json":
        view_skeleton(file, out)
        return
    problem = read(file)
    if not is_flat(problem.polyhedron):
        fail(f"{file}: expected two coordinates on lines and no equations; polycorner atlas {file}"
             " lists corners, edges and faces")  # fmt: skip
    import numpy as np

    rng = np.random.default_rng(seed)
    view_problem(file, problem, inner_starts(problem, rng), rng, out)

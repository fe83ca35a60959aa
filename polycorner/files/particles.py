"""Positions of particles, from XYZ and GSD files, and molecules as bodies.

Van der Waals radii are those of the tables of ASE, the Atomic Simulation Environment: of [Alvarez],
or of [Bondi] and others.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner import checks
from polycorner.bodies.arrangement import Arrangement
from polycorner.bodies.shapes import Body, Part
from polycorner.checks import missing_extra, refuse
from polycorner.files.safe_paths import MIB, content, name_of
from polycorner.kinds import checked
from polycorner.spaces.manifold import Array
from polycorner.values import Checked

TABLES = ("alvarez", "bondi")
PROPERTIES = re.compile(r"Properties=\"?([\w:]+)")
PLAIN = "species:S:1:pos:R:3"  # columns of a file that does not tell them


@dataclass(frozen=True, eq=False)
class Particles(Checked):
    """Positions of ``N`` particles in ``T`` frames.

    Attributes
    ----------
    kinds : tuple of str
        The kind of each particle: in molecules the chemical symbol.
    positions : (T, N, 3) array
    orientations : (T, N, 4) array, optional
        Unit quaternions ``w x y z``.
    radii : (N,) array, optional
        In the first frame.

    Raises
    ------
    ValueError
        For arrays of other shapes, numbers that are not finite, quaternions that are zero, and
        radii that are not positive.
    """

    kinds: tuple[str, ...]
    positions: Array
    orientations: Array | None = None
    radii: Array | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        count = len(self.kinds)
        frames = len(self.positions) if self.positions.ndim == 3 else 1
        shapes = {
            "positions": (frames, count, 3), "orientations": (frames, count, 4), "radii": (count,)
        }  # fmt: skip
        for name, shape in shapes.items():
            given = getattr(self, name)
            if given is not None and given.shape != shape:
                refuse(name, f"shape {shape} for {count} kinds in {frames} frames", given.shape)
            if given is not None and not np.isfinite(given).all():
                refuse(name, "finite numbers", given)
        if self.orientations is not None and not np.abs(self.orientations).max(axis=2).all():
            refuse("orientations", "quaternions that are not zero", self.orientations)
        if self.radii is not None and not (self.radii > 0).all():
            refuse("radii", "numbers > 0", self.radii)

    def points(self, arrangement: Arrangement) -> Array:
        """Return the points ``(T, M)`` of an arrangement with the particles as its bodies.

        They are the bodies in their order, and their positions the origins; in the plane the third
        coordinate is left out, and bodies turn about it.

        Raises
        ------
        ValueError
            For another number of bodies.
        """
        checks.instance("arrangement", arrangement, Arrangement)
        names, d = [*arrangement.named], arrangement.dimension
        if len(names) != len(self.kinds):
            refuse("arrangement", f"{len(self.kinds)} bodies, one for each particle", len(names))
        found = []
        for t, frame in enumerate(self.positions):
            placed: dict[str, Any] = {n: x[:d] for n, x in zip(names, frame, strict=True)}
            if self.orientations is not None:
                for k, name in enumerate(names):
                    turn = Rotation.from_quat(self.orientations[t, k], scalar_first=True)
                    turned: Any = turn if d == 3 else float(turn.as_rotvec()[2])
                    if arrangement.placements[k].frame.turns:
                        placed[name] = (frame[k, :d], turned)
            found.append(arrangement.point(placed))
        return np.array(found)


@checked
def read_particles(path: str | os.PathLike[str], *, megabytes: float = 100.0) -> Particles:
    r"""Read the positions of particles from an XYZ or GSD file, which its suffix tells.

    Parameters
    ----------
    path : path
        Of an XYZ file of one frame or several, also an extended one with ``Properties``, of which
        species, positions and radii are read; or a GSD file (extra ``gsd``), with types,
        positions, orientations and diameters.
    megabytes : float, optional
        The most of the file and of its positions, in MiB.

    Raises
    ------
    ValueError
        With the number of the line, or the frame, that is not understood.
    ImportError
        Naming the extra that reads GSD.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "water.xyz"
    >>> _ = path.write_text("3\nwater\nO 0 0 0.117\nH 0 0.757 -0.471\nH 0 -0.757 -0.471\n")
    >>> water = read_particles(path)
    >>> water.kinds, water.positions.shape
    (('O', 'H', 'H'), (1, 3, 3))
    """
    megabytes = checks.real("megabytes", megabytes, above=0)
    about, suffix = f"path: {name_of(path)}", Path(path).suffix.lower()
    if suffix == ".xyz":
        return _xyz(about, content(about, path, megabytes))
    if suffix != ".gsd":
        refuse("path", "a file name that ends in .xyz or .gsd", os.fspath(path))
    content(about, path, megabytes)
    return _gsd(about, path, megabytes)


def _xyz(about: str, data: bytes) -> Particles:
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        msg = f"{about}: expected text in UTF-8; got other bytes ({error.reason})"
        raise ValueError(msg) from error
    frames: list[list[list[float]]] = []
    kinds: tuple[str, ...] = ()
    radii: list[float] = []
    start = 0
    while start < len(lines) and any(line.strip() for line in lines[start:]):
        count, columns = _head(about, lines, start, len(kinds) or None)
        names, frame, sizes = [], [], []
        for number, line in enumerate(lines[start + 2 : start + 2 + count], start + 3):
            place, words = f"{about}: line {number}", line.split()
            if len(words) < max(columns.values()) + 1:
                refuse(place, f"at least {max(columns.values()) + 1} words", line)
            names.append(words[columns["species"]])
            frame.append([_number(place, words[columns["pos"] + k]) for k in range(3)])
            if "radius" in columns:
                sizes.append(_number(place, words[columns["radius"]]))
                if sizes[-1] <= 0:
                    refuse(place, "a radius > 0", sizes[-1])
        if kinds and tuple(names) != kinds:
            refuse(f"{about}: line {start + 3}", "the particles of the first frame", names[:5])
        kinds, radii = tuple(names), radii or sizes
        frames.append(frame)
        start += 2 + count
    if not frames:
        refuse(about, "a number of particles, a comment, and a line for each", "nothing")
    return Particles(kinds, np.array(frames), radii=np.array(radii) if radii else None)


def _head(
    about: str, lines: list[str], start: int, known: int | None
) -> tuple[int, dict[str, int]]:
    """Return the count of a frame, and the first column of each property that is read."""
    word, left = lines[start].strip(), max(len(lines) - start - 2, 0)
    place = f"{about}: line {start + 1}"
    if not (word.isascii() and word.isdecimal()) or not word.strip("0"):
        refuse(place, "the number of particles", word)
    if len(word) > len(str(left)) + 1 or int(word) > left:
        refuse(place, f"at most {left} particles, for the lines after the comment", word)
    if known not in {None, int(word)}:
        refuse(place, f"{known} particles, as in the first frame", word)
    found = PROPERTIES.search(lines[start + 1])
    fields = (found.group(1) if found else PLAIN).split(":")
    columns: dict[str, int] = {}
    at = 0
    for name, sort, width in zip(fields[::3], fields[1::3], fields[2::3], strict=False):
        needed = {"species": "S1", "pos": "R3", "radius": "R1"}.get(name, sort + width)
        if not re.fullmatch(r"[1-9]\d?", width, re.ASCII) or sort + width != needed:
            refuse(f"{about}: line {start + 2}", f"{name}:{needed[0]}:{needed[1:]}", fields)
        columns[name] = at
        at += int(width)
    if not {"species", "pos"} <= columns.keys():
        refuse(f"{about}: line {start + 2}", "species and pos among the Properties", fields)
    wide = {"species": 0, "pos": 2, "radius": 0}
    read = {n: c for n, c in columns.items() if n in wide}
    return int(word), read | {"": max(c + wide[n] for n, c in read.items())}


def _number(place: str, word: str) -> float:
    try:
        found = float(word) if "_" not in word else np.nan
    except ValueError:
        found = np.nan
    if not np.isfinite(found):
        refuse(place, "finite numbers", word)
    return float(found)


def _gsd(about: str, path: str | os.PathLike[str], megabytes: float) -> Particles:
    try:
        import gsd.fl
    except ImportError:
        missing = missing_extra("gsd", "gsd")
        raise missing from None
    try:
        with gsd.fl.open(os.fspath(path), "r") as file:
            return _frames(about, file, megabytes)
    except ValueError:
        raise
    except Exception as error:
        reason = checks.shortened(str(error) or type(error).__name__, checks.LONGEST_REASON)
        msg = f"{about}: expected a GSD file; got {reason}"
        raise ValueError(msg) from error


def _frames(about: str, file: Any, megabytes: float) -> Particles:
    """Return what a GSD file has; what a frame has not is that of the first one."""

    def chunk(frame: int, name: str) -> Any:
        for k in (frame, 0):
            if file.chunk_exists(k, f"particles/{name}"):
                return file.read_chunk(k, f"particles/{name}")
        return None

    if file.nframes == 0:
        refuse(about, "at least one frame", 0)
    first = chunk(0, "position")
    if first is None or first.ndim != 2 or first.shape[1] != 3:
        refuse(f"{about}: frame 0", "positions (N, 3)", None if first is None else first.shape)
    count = len(first)
    if 8 * 7 * file.nframes * count > megabytes * MIB:
        refuse(about, f"positions of at most {megabytes:g} MiB", f"{file.nframes} frames")

    def every(name: str, width: int) -> Array:
        found = []
        for k in range(file.nframes):
            given = np.asarray(chunk(k, name), dtype=np.float64)
            if given.shape != (count, width) or not np.isfinite(given).all():
                expected = f"finite numbers of shape {(count, width)}"
                refuse(f"{about}: frame {k}: {name}", expected, given.shape)
            found.append(given)
        return np.array(found)

    positions = every("position", 3)
    turned = None if chunk(0, "orientation") is None else every("orientation", 4)
    wide, types, numbers = (chunk(0, name) for name in ("diameter", "types", "typeid"))
    names = ["A"] if types is None else [_text(row) for row in np.atleast_2d(types)]
    ids = np.zeros(count, np.int64) if numbers is None else np.asarray(numbers, np.int64)
    if ids.shape != (count,) or ids.min() < 0 or ids.max() >= len(names):
        refuse(f"{about}: frame 0: typeid", f"{count} numbers of the types {names}", ids)
    radii = None if wide is None else np.asarray(wide, np.float64) / 2
    with checks.about(about):
        return Particles(tuple(names[k] for k in ids), positions, turned, radii)


def _text(row: Any) -> str:
    return bytes(np.asarray(row, np.uint8)).rstrip(b"\0").decode("utf-8", "replace")


@checked
def molecule(
    particles: Particles,
    *,
    radii: Literal["alvarez", "bondi"] | Mapping[str, float] = "alvarez",
    scale: float = 1.0,
    frame: int = 0,
) -> Body:
    """Return a molecule as a compound of balls, called ``O1``, ``H2``, ``H3``.

    Parameters
    ----------
    particles : Particles
        With chemical symbols as kinds (:func:`read_particles`), positions in angstroms.
    radii : {"alvarez", "bondi"} or mapping from str to float, optional
        Van der Waals radii in angstroms: a table (extra ``molecules``), or by symbol.
    scale : float, optional
        Length of an angstrom in the unit of the arrangement; default 1.
    frame : int, optional
        Default the first one.

    Raises
    ------
    ValueError
        For a symbol without a radius.
    ImportError
        Naming the extra that has the tables.

    Examples
    --------
    >>> pair = Particles(("H", "H"), np.array([[[0, 0, 0], [0.74, 0, 0]]]))
    >>> hydrogen = molecule(pair, radii={"H": 1.2})
    >>> list(hydrogen.parts), hydrogen.size
    (['H1', 'H2'], 1.94)
    """
    scale = checks.real("scale", scale, above=0)
    count = len(particles.positions)
    frame = checks.whole("frame", frame, least=-count, most=count - 1)
    known = _table(radii) if isinstance(radii, str) else dict(radii)
    parts = {}
    for k, symbol in enumerate(particles.kinds, 1):
        if symbol not in known:
            refuse("radii", f"a radius of {symbol!r} as well", [*known][:5])
        radius = checks.real("radii", known[symbol], above=0)
        place = scale * np.asarray(particles.positions[frame][k - 1], dtype=np.float64)
        parts[f"{symbol}{k}"] = Part(place[None], scale * radius)
    return Body(parts)


def _table(name: str) -> dict[str, float]:
    """Return the radii of a table by symbol."""
    checks.choice("radii", name, TABLES)
    try:
        from ase.data import chemical_symbols, vdw, vdw_alvarez
    except ImportError:
        missing = missing_extra("ase", "molecules")
        raise missing from None
    table = vdw_alvarez.vdw_radii if name == "alvarez" else vdw.vdw_radii
    return {s: float(r) for s, r in zip(chemical_symbols, table, strict=False) if r > 0}

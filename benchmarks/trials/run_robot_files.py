"""Which URDF files of others are read, and what the rest is refused for.

    python -m benchmarks.trials.run_robot_files FOLDER...

Each folder holds the URDF files and meshes of one package, such as an unpacked wheel.  A file is
read as it is, and if its inertias are refused with the nearest ones.  Meshes become capsules.
``package://`` paths are looked for in the folder above the package of that name.
"""

import argparse
import re
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from benchmarks.side_by_side import print_table
from polycorner.files import read_urdf

REASONS = {
    "inertia": r"inertia: expected",
    "mesh format": r"mesh.*expected a file name that ends in",
    "mesh missing": r"mesh: expected a file in",
    "mesh elsewhere": r"mesh: expected the path",
    "mesh damaged": r"mesh",
    "joint type": r"expected the type",
    "joint limit": r"expected an element <limit>|expected a limit above",
    "tree": r"joints: ",
    "xacro": r"xacro",
    "not XML": r"expected XML",
}
COLUMNS = ("files", "joints", "read", "with nearest inertia", *REASONS, "other")


def folder_of(file: Path, top: Path) -> Path:
    """Return the folder that has the packages that a file names, or all of them."""
    named = re.search(r'package://([^/"]+)/', file.read_text(errors="replace"))
    if named:
        for above in file.parents:
            if (above / named[1]).is_dir():
                return above
            if above == top:
                break
    return top


def outcomes(top: Path) -> Iterator[str]:
    """Yield for each file of a package what becomes of it."""
    for file in sorted(top.rglob("*.urdf")):
        yield "files"
        if b"<joint" in file.read_bytes():
            yield "joints"
        found = outcome(file, folder_of(file, top), "file")
        if found == "inertia":
            found = outcome(file, folder_of(file, top), "nearest")
            found = "with nearest inertia" if found == "read" else found
        yield found


def outcome(file: Path, folder: Path, inertias: str) -> str:
    """Return whether a file is read, or for what it is refused."""
    try:
        read_urdf(file, folder=folder, inertias=inertias)
    except (ValueError, OSError) as error:
        found = (name for name, words in REASONS.items() if re.search(words, str(error)))
        return next(found, "other")
    return "read"


def main() -> None:
    """Print a table with a row for each package."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    warnings.simplefilter("ignore")
    rows = []
    for top in parser.parse_args().folders:
        counted = Counter(outcomes(top.resolve()))
        rows.append([top.name, *(counted[name] for name in COLUMNS)])
    print_table("URDF files", ["package", *COLUMNS], rows)


if __name__ == "__main__":
    main()

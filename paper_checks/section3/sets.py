"""The table of all sets of friction and noise, judged by all observations, in a file."""

import argparse
from pathlib import Path

from paper_checks.section3.together import table
from polycorner.toolkit import write_atomically


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="a folder, for together.md")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    write_atomically(folder / "together.md", table())


if __name__ == "__main__":
    main()

"""The table of all sets of friction and noise, judged by all observations, in a file."""

import argparse
from pathlib import Path

from paper_checks.section3.together import table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="a folder, for together.md")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "together.md").write_text(table(), encoding="utf-8")


if __name__ == "__main__":
    main()

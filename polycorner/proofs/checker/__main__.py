"""Command that checks a file."""

import argparse
import sys
from collections.abc import Sequence

from .verdict import judged


def positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


positive.__name__ = "positive whole number"  # argparse names the type in its message


def main(arguments: Sequence[str] | None = None) -> int:
    about = "Check a saved proof: of a minimum, a list of stationary points, or a diagram."
    parser = argparse.ArgumentParser(prog="checker", description=about)
    parser.add_argument(
        "file", help="a file written by Proof.save, StationaryList.save or BranchProof.save"
    )
    parser.add_argument(
        "--sample", type=positive, metavar="K", help="check K leaves drawn at random, not all"
    )
    parser.add_argument(
        "--jobs", type=positive, default=1, metavar="J", help="processes; 1 by default"
    )
    given = parser.parse_args(arguments)
    verified, line = judged(given.file, given.sample, given.jobs)
    print(line)
    return 0 if verified else 1


if __name__ == "__main__":
    sys.exit(main())

"""Command that checks a file."""

import argparse
import sys
from collections.abc import Sequence

from .balls import NotShownError
from .verdict import check


def positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise ValueError
    return value


positive.__name__ = "positive whole number"  # argparse names the type in its message


def main(arguments: Sequence[str] | None = None) -> int:
    about = "Check a saved list of stationary points and its proof."
    parser = argparse.ArgumentParser(prog="checker", description=about)
    parser.add_argument("file", help="a file written by StationaryList.save")
    parser.add_argument(
        "--sample", type=positive, metavar="K", help="check K leaves drawn at random, not all"
    )
    parser.add_argument(
        "--jobs", type=positive, default=1, metavar="J", help="processes; 1 by default"
    )
    given = parser.parse_args(arguments)
    try:
        print(check(given.file, given.sample, given.jobs))
    except NotShownError as error:
        print(f"NOT VERIFIED: {error}")
        return 1
    except OSError as error:
        print(f"NOT VERIFIED: the file cannot be read: {error}")
        return 1
    except Exception as error:  # whatever goes wrong, nothing is verified
        print(f"NOT VERIFIED: the file is malformed: {error!r}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

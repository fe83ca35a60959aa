"""``python -m paper_checks``: the same as ``polycorner paper``."""

import sys

from polycorner.cli.main import main

if __name__ == "__main__":
    main(["paper", *sys.argv[1:]])

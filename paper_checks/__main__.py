"""``python -m paper_checks``: the same as ``polycorner paper``."""

import runpy
import sys

if __name__ == "__main__":
    sys.argv.insert(1, "paper")
    runpy.run_module("polycorner", run_name="__main__")

"""Write which tests of a run took long: ``durations.py report.xml durations.json``."""

import json
import sys
from pathlib import Path
from xml.etree import ElementTree as ET

LEAST = 1.0  # s, from which a test is written


def identity(case):
    """Return pytest's name of a case: its file, classes and name."""
    parts = case.get("classname").split(".")
    for k in range(len(parts), 0, -1):
        file = Path("/".join(parts[:k]) + ".py")
        if file.exists():
            return "::".join([file.as_posix(), *parts[k:], case.get("name")])
    return case.get("name")


def main(report, kept):
    cases = ET.parse(report).iter("testcase")
    seconds = {identity(case): float(case.get("time")) for case in cases}
    long = {name: round(taken, 1) for name, taken in seconds.items() if taken >= LEAST}
    Path(kept).write_text(json.dumps(dict(sorted(long.items())), indent=0) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Start-up time of the package, its command line and a dyad from the cache.

All times are those of fresh interpreters, in interleaved rounds.  The time of the import is given
beyond that of `import numpy`, and the latter beyond that of a bare interpreter.
"""

import statistics
import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from side_by_side import Times, difference, fresh, interleave, print_table, write

ROUNDS, COMMAND_ROUNDS = 15, 5
IMPORTS = {
    "bare interpreter": "pass",
    "import numpy": "import numpy",
    "import polycorner": "import numpy, polycorner",
    "minimise and DumbbellPair": "from polycorner import minimise; "
    "from polycorner.dumbbells import DumbbellPair",
}
COMMANDS = {
    "polycorner --help": ("--help",),
    "polycorner dyad, second run": ("dyad",),
}


def imports(folder: Path) -> Times:
    """Time the imports."""
    tasks = {name: partial(fresh, "-c", code, folder=folder) for name, code in IMPORTS.items()}
    return interleave(tasks, ROUNDS)


def commands(folder: Path) -> Times:
    """Time the command line as far as it exists; the first run of each command is discarded."""
    if find_spec("polycorner.__main__") is None:
        print("The command line is left out: polycorner has no __main__ yet.")
        return {}
    tasks: dict[str, Callable[[], object]] = {}
    for name, arguments in COMMANDS.items():
        task = partial(fresh, "-m", "polycorner", *arguments, folder=folder)
        try:
            task()
        except subprocess.CalledProcessError as error:
            print(f"{name} is left out: it ended with status {error.returncode}.")
        else:
            tasks[name] = task
    return interleave(tasks, COMMAND_ROUNDS)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        start, ran = imports(Path(folder)), commands(Path(folder))
    numpy, bare = start["import numpy"], start["bare interpreter"]
    added = {
        "numpy over a bare interpreter": difference(numpy, bare),
        "polycorner over numpy": difference(start["import polycorner"], numpy),
        "minimise and DumbbellPair over numpy": difference(
            start["minimise and DumbbellPair"], numpy
        ),
    }
    whole = {name: statistics.median(times) for name, times in {**start, **ran}.items()}
    figures = {name: round(1e3 * taken, 1) for name, taken in {**whole, **added}.items()}
    print_table("Fresh interpreters", ["", "ms"], list(figures.items()))
    write("import", {"ms": figures})


if __name__ == "__main__":
    main()

"""Start-up time of the package, its command line and a dyad from the cache, and without a cache.

All times are those of fresh interpreters, in interleaved rounds.  The time of the import is given
beyond that of `import numpy`, and the latter beyond that of a bare interpreter.  First answers with
an empty cache are in seconds of processor time, imports and compilation included.
"""

import os
import statistics
import subprocess
import sys
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


FIRST = {
    "first minimise": """
from polycorner import Manifold, Polyhedron, minimise
M = Manifold.euclidean("x y")
x, y = M.symbols
assert minimise(Polyhedron(M, {"bowl": y - x**2}), x + y, [1.0, 1.5]).is_minimum
""",
    "first step of a bouncing ball": """
from polycorner.models.textbook import bouncing_ball
from polycorner.motion import step
ball = bouncing_ball()
step(ball, ball.state([1.0]), 1e-3)
""",
    "first step of a dyad": """
from polycorner.dumbbells import DumbbellDrum, DumbbellPair
from polycorner.motion import step
sizes = {"length": 16.0, "ball_radius": 3.0, "rod_radius": 1.5, "drum_radius": 125.0}
nested = DumbbellPair(**sizes).nested("R", clearance=0.02).reshape(2, 3) + [0.1, 150.0, 0.0]
drum = DumbbellDrum(**sizes, count=2)
step(drum, drum.state(nested), 1e-3)
""",
}
EMPTY_ROUNDS = 3


def first_answers() -> dict[str, float]:
    """Return the median processor time of first answers with an empty cache, in s."""
    times: Times = {name: [] for name in FIRST}
    for _ in range(EMPTY_ROUNDS):
        for name, code in FIRST.items():
            with tempfile.TemporaryDirectory() as cache:
                before = os.times()
                environment = os.environ | {"POLYCORNER_CACHE_DIR": cache}
                command = [sys.executable, "-W", "ignore", "-c", code]
                subprocess.run(command, check=True, env=environment, capture_output=True)
                after = os.times()
            spent = after.children_user - before.children_user
            times[name].append(spent + after.children_system - before.children_system)
    return {name: round(statistics.median(spent), 1) for name, spent in times.items()}


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
    answers = first_answers()
    print_table("Empty cache", ["", "s of processor time"], list(answers.items()))
    write("import", {"ms": figures, "empty cache, s of processor time": answers})


if __name__ == "__main__":
    main()

"""Tiers of tests from what they cost: processor time, recorded by ``make costs``.

``tests/costs.json`` has two entries, ``seconds``, the processor time of each test that took long
enough to matter (its own and that of the processes it started), and ``processes``, the tests that
started any.  A test that is not in the file is new or cheap.
"""

import json
import resource
import signal
import sys
from collections import Counter
from multiprocessing import util
from pathlib import Path

import pytest

FILE = Path(__file__).parents[1] / "costs.json"
LEAST = 0.05  # s, below which a test is not written
QUICK = 0.08  # s, up to which `make test` runs a test
CHEAP = 2.0  # s, up to which it runs the cheapest test of a file that has no quick one
SLOW = 0.7  # s, from which only `make thorough` runs a test
LONG = 5.0  # s, up to which `make wider` runs the cheapest test of a file all the same
STARTS = ("subprocess.Popen", "os.fork", "os.posix_spawn")  # events of sys.audit


def processor_seconds() -> tuple[float, float]:
    """Return the processor time of this process and of those it started and waited for, in s."""
    own, others = (resource.getrusage(w) for w in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return own.ru_utime + own.ru_stime, others.ru_utime + others.ru_stime


def allow_processor_seconds(total: int) -> None:
    """Have this process, and each that it starts, told when it has used so much, in s."""
    resource.setrlimit(resource.RLIMIT_CPU, (total, resource.getrlimit(resource.RLIMIT_CPU)[1]))


class Cut(BaseException):
    """A test has used what it may; Hypothesis does not look for a smaller example of this."""


class Recorder:
    """Measures each test where it runs, and writes the costs where the reports arrive.

    A test that uses ``cap`` seconds is cut: it fails, and its cost is a lower bound.
    """

    def __init__(self, path: Path, cap: int | None = None):
        self.path = path
        self.cap = cap
        self.cut = False
        self.seconds: Counter[str] = Counter()
        self.run: set[str] = set()
        self.processes: set[str] = set()
        self.started = 0
        self.last = (0.0, 0.0)
        sys.addaudithook(self._hear)
        self.spawn = util.spawnv_passfds  # of which no event tells
        util.spawnv_passfds = self._spawn

    def _hear(self, event: str, arguments: tuple[object, ...]) -> None:
        if event in STARTS and "ldconfig" not in str(arguments[:1]):  # ctypes looks for a library
            self.started += 1

    def _spawn(self, *arguments):
        self.started += 1
        return self.spawn(*arguments)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logstart(self):
        self.started, self.last, self.cut = 0, processor_seconds(), False
        if self.cap is not None:
            signal.signal(signal.SIGXCPU, self._cut)
            allow_processor_seconds(int(self.last[0]) + 1 + self.cap)

    def _cut(self, *_):
        allow_processor_seconds(resource.RLIM_INFINITY)  # for what remains to be torn down
        self.cut = True
        raise Cut

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self):
        report = yield
        now = processor_seconds()
        own, others = now[0] - self.last[0], now[1] - self.last[1]
        # A process that an earlier test started may be waited for in this one.
        report.cost = (own + (others if self.started else 0.0), self.started > 0)
        report.cut = self.cut
        self.last = now
        return report

    def pytest_runtest_logreport(self, report):
        seconds, processes = report.cost
        self.seconds[report.nodeid] += seconds
        if report.cut or (report.when == "call" and not report.skipped):
            self.run.add(report.nodeid)
        if processes:
            self.processes.add(report.nodeid)

    def pytest_sessionfinish(self, session):
        options = session.config.option
        if not hasattr(session.config, "workerinput"):
            self.write(keep=bool(options.keyword or options.markexpr or options.file_or_dir))

    def write(self, *, keep: bool) -> None:
        """Replace the records of the tests that ran; keep the others if some were chosen."""
        seconds, processes = read(self.path) if keep else ({}, set())
        for name in self.run:
            seconds.pop(name, None)
            if self.seconds[name] >= LEAST:
                seconds[name] = float(f"{self.seconds[name]:.2g}")
        processes = (processes - self.run) | (self.processes & self.run)
        costs = {"seconds": dict(sorted(seconds.items())), "processes": sorted(processes)}
        self.path.write_text(json.dumps(costs, indent=0) + "\n")


def read(path: Path = FILE) -> tuple[dict[str, float], set[str]]:
    """Return what tests cost, in s, and which start processes."""
    if not path.exists():
        return {}, set()
    costs = json.loads(path.read_text())
    return costs["seconds"], set(costs["processes"])


def is_page(item) -> bool:
    """Tell a page of the documentation, whose examples are tests."""
    return item.path.suffix == ".md"


def needs_browser(item) -> bool:
    """Tell a test that opens a page in a browser, also where there is none."""
    return "tab" in getattr(item, "fixturenames", ())


def assign_tiers(items) -> None:
    """Mark each test ``slow`` or ``quick`` or neither, by what it cost when it was recorded."""
    seconds, processes = read()
    costs = {item: seconds.get(item.nodeid, 0.0) for item in items}
    inside = [
        item
        for item in items
        if not (item.nodeid in processes or is_page(item) or needs_browser(item))
    ]
    cheapest, cheapest_inside = cheapest_of_files(costs, items), cheapest_of_files(costs, inside)
    for item, cost in costs.items():
        if cost >= (LONG if item in cheapest else SLOW):
            item.add_marker("slow")
    for item in inside:
        marked = item.get_closest_marker("slow")
        if not marked and costs[item] <= (CHEAP if item in cheapest_inside else QUICK):
            item.add_marker("quick")


def cheapest_of_files(costs, items):
    """Return the cheapest test of each file."""
    found = {}
    for item in items:
        other = found.setdefault(item.path, item)
        if costs[item] < costs[other]:
            found[item.path] = item
    return set(found.values())

"""Shared configuration: a silent plotting back end, the amount of generated input, a browser.

``HYPOTHESIS_PROFILE=thorough`` asks for more examples than the default profile ``fast``, and
``--disturbed 1`` runs the tests on linear algebra with other last bits (`linear_algebra`).
"""

import os
import signal
from pathlib import Path

import chromium
import costs
import matplotlib as mpl
import pytest
from hypothesis import HealthCheck, settings
from linear_algebra import Disturbed

from polycorner.formulas.cache import cache_folder

mpl.use("Agg")
HERE = Path(__file__).parent
collect_ignore = ["support/disturbed"]  # which is run by other processes

# A shell starts background jobs with Ctrl-C ignored; tests that send it need it to interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The first call of a kernel compiles it, so a deadline would measure the compiler.
settings.register_profile(
    "fast",
    max_examples=15,
    deadline=None,
    derandomize=bool(os.environ.get("CI")),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("brief", settings.get_profile("fast"), max_examples=8)
settings.register_profile(
    "thorough",
    max_examples=1000,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fast"))


def pytest_addoption(parser):
    parser.addoption(
        "--disturbed",
        type=int,
        metavar="SEED",
        help="round linear algebra as another processor might",
    )
    parser.addoption(
        "--costs", action="store_true", help="record what tests cost, from which tiers are made"
    )
    parser.addoption(
        "--costs-cap",
        type=int,
        metavar="SECONDS",
        help="with --costs, cut a test that has used so much processor time",
    )


def pytest_configure(config):
    if config.getoption("--costs"):
        config.pluginmanager.register(costs.Recorder(costs.FILE, config.getoption("--costs-cap")))
    seed = config.getoption("--disturbed")
    if seed is not None:
        Disturbed.install_once(seed)
        here = HERE / "support"  # for processes that tests start
        paths = [str(here / "disturbed"), str(here), os.environ.get("PYTHONPATH", "")]
        os.environ["POLYCORNER_DISTURBED"] = str(seed)
        os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, paths))


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items):
    costs.assign_tiers(items)


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    """An empty page in a browser, for the tests of one file."""
    profile = tmp_path_factory.mktemp("profile")
    with chromium.page(chromium.needed(), profile, graphics=True) as opened:
        yield opened


@pytest.fixture(scope="module")
def kernels_elsewhere(tmp_path_factory):
    """Keep what is compiled in one module in a folder of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path_factory.mktemp("kernels")))
        yield


@pytest.fixture(scope="module")
def own_searches(tmp_path_factory):
    """Keep the unfinished searches of one module in a cache of its own; share what is compiled."""
    own = tmp_path_factory.mktemp("cache")
    shared = cache_folder() / "kernels"
    shared.mkdir(mode=0o700, exist_ok=True)
    (own / "kernels").symlink_to(shared, target_is_directory=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("POLYCORNER_CACHE_DIR", str(own))
        yield

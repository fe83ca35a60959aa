"""Every public name refuses what it cannot mean, in a sentence that names the argument.

``tests/support/api_calls.py`` holds one small valid call of everything public.  One argument after
the other is replaced by values that nobody means, and the call has to succeed or to raise
ValueError, TypeError or an exception of the package that names the argument, soon.
"""

import random

import api_fuzz
import matplotlib.pyplot as plt
import pytest
from hypothesis import settings

PUBLIC = api_fuzz.public()
CALLS = {name: value for name, value in PUBLIC.items() if name not in api_fuzz.EXEMPT}
QUICK = sorted(set(CALLS) - api_fuzz.SLOW)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some of the values are names of files
    yield
    plt.close("all")


def test_every_public_name_has_a_call_or_a_reason():
    assert api_fuzz.EXEMPT.keys() <= PUBLIC.keys()
    assert set(CALLS) == {n for n in CALLS if n in api_fuzz.RECIPES or n in api_fuzz.VALUES}


def judged(names, each):
    """Return the calls that go wrong, of ``each`` hostile values for every argument."""
    rng, wrong = random.Random(0), []
    for name in names:
        for argument in api_fuzz.arguments(api_fuzz.target(name, CALLS[name])[0]):
            if (name, argument) in api_fuzz.OPEN:
                continue
            for label in rng.sample(sorted(api_fuzz.HOSTILE), each):
                found, details = api_fuzz.outcome(name, CALLS[name], argument, label)
                if found not in ("succeeded", "refused"):
                    wrong.append(f"{name}({argument}={label}) {found}: {details}")
    return wrong


def test_hostile_values_are_refused_by_name():
    each = 1 if settings.default.max_examples < 100 else len(api_fuzz.HOSTILE)
    assert not judged(QUICK, each)


def test_hostile_values_of_slow_calls_are_refused_by_name():
    assert not judged(sorted(set(CALLS) & api_fuzz.SLOW), 1)

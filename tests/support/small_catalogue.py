"""Claims for tests of how checks are run: good ones, one that raises, one whose process dies."""

import os
import time
from functools import partial

from paper_checks.framework.claims import Claim, Finding, Means, Verdict


def found(verdict=Verdict.HOLDS, correction=""):
    return Finding(verdict, r"It is $\theta_s = \frac{1}{2}$.", {"half": 0.5}, correction)


def breaks():
    msg = "no\nsuch thing"
    raise ValueError(msg)


def dies():
    os._exit(3)


def sleeps():
    time.sleep(600)
    return found()


def claim(name, check, section="2", means=Means.NUMERICAL, **options):
    statement = f"statement {name} with $x_1 \\ge 0$"
    return Claim(name, section, "somewhere", statement, means, check, None, **options)


CLAIMS = (
    claim("A1", found),
    claim("A2", breaks),
    claim("A3a", dies),
    claim("A3b", partial(found, Verdict.CORRECTED, r"It is $\alpha < 1$ & more"), "C"),
    claim("A4", lambda: found(Verdict.REFUTED), "C"),  # cannot be sent to another process
    claim("A5", partial(found, Verdict.REFUTED), "C", Means.SIMULATION),
    claim("B1", partial(found, Verdict.HOLDS_UNDER, "for small $x$"), "C", figure="tutorial"),
    claim("B2", lambda: None, "C"),
    claim("S1", sleeps, "C", slow=True),
)

"""The compiled steps of first-order motion, as functions of arrays.

``python -m polycorner.motion.sweeping.intermediate`` writes their intermediate code; ``make
intermediate`` does this after any of their sources was changed.
"""

from polycorner.formulas.shipped import Shipped


def _make() -> str:
    from polycorner.motion.sweeping.stepping import made

    return made()


SHIPPED = Shipped(
    package="polycorner.motion.sweeping",
    file="sweeping.ll.xz",
    make=_make,
    names=("advance", "admit"),
    arguments=5,
    results=3,
    what="the steps of first-order motion",
    seconds=30,
    without=("driver.py", "intermediate.py"),
)

if __name__ == "__main__":
    SHIPPED.write()

"""The compiled chain, as a function of arrays.

``python -m polycorner.measures.chain.intermediate`` writes its intermediate code; ``make
intermediate`` does this after it was changed.
"""

from polycorner.formulas.shipped import Shipped


def _make() -> str:
    from polycorner.measures.chain.moves import made

    return made()


SHIPPED = Shipped(
    package="polycorner.measures.chain",
    file="chain.ll.xz",
    make=_make,
    names=("run",),
    arguments=2,
    results=1,
    what="the sampling of strata",
    seconds=10,
    without=("intermediate.py",),
)

if __name__ == "__main__":
    SHIPPED.write()

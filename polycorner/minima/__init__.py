"""An energy on a polyhedron: where it rests, why, how often, and whether that is proved.

The room has the name of its verb: ``polycorner.minima(D, E, ...)`` calls
:func:`polycorner.minima.search.minima`.
"""

import sys
from types import ModuleType
from typing import Any


class _Verb(ModuleType):
    """The room itself, called like the function it is named after."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Find minima; see :func:`polycorner.minima.search.minima`."""
        from polycorner.minima.search import minima

        return minima(*arguments, **options)


sys.modules[__name__].__class__ = _Verb

"""Building blocks shared by the folders of Numba code: calls by address and the key of a cache.

Numba's disk cache notices a change only in the file of the cached function itself.  Its key holds
the contents of the function's closure, however, so an entry point that *reads* the digest of its
folder's sources is compiled again whenever any of these files changes::

    def compiled(sources):
        @njit(cache=True)
        def entry(problem, u):
            sources  # read, so that it becomes a closure cell
            ...

        return entry


    entry = compiled(sources_digest(__package__))

Only entry points are cached; what they call is linked into them, see
:func:`polycorner.formulas.linking.linked`.
"""

import logging
from typing import Any

from numba import config, types
from numba.core import cgutils, event
from numba.extending import intrinsic

from polycorner.formulas import linking
from polycorner.formulas.cache import cache_folder

LOG = logging.getLogger("polycorner.compilation")

# What packages are, and how long they are compiled, in s of processor time.
LONG = {
    "polycorner.minimisation.descent": ("the search for minima", 15),
    "polycorner.motion.engine": ("the engine of motion", 30),
}

if not config.CACHE_DIR:  # what is cached after this import goes to the one cache folder
    config.CACHE_DIR = str(cache_folder() / "numba")


# Numba has no types, so its classes are Any to mypy.
class Announcement(event.Listener):  # type: ignore[misc]
    """Logs once for each package that its code is compiled, the cache not holding it.

    It is a warning, which Python shows without being asked to: the user waits.
    """

    def __init__(self) -> None:
        self.announced: set[str] = set()

    def on_start(self, event: Any) -> None:
        """Log the package of the function that is compiled, unless that was done before."""
        package = event.data["dispatcher"].py_func.__module__.rpartition(".")[0]
        if package.startswith("polycorner.") and package not in self.announced:
            self.announced.add(package)
            what, seconds = LONG.get(package, (package, 1))
            LOG.warning("compiling %s, once on this machine: about %d s", what, seconds)

    def on_end(self, event: Any) -> None:
        """Give functions that were linked their environments."""
        linking.set_environments(event.data["dispatcher"].targetctx.codegen())


event.register("numba:compile", Announcement())


@intrinsic
def call_kernel(_: Any, address: Any, q: Any, p: Any, f: Any, J: Any, H: Any) -> Any:
    """Call ``void point(q, p, f, J, H)`` at an address, all arguments being addresses."""
    signature = types.void(*([types.int64] * 6))

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pointer = cgutils.voidptr_t
        kind = cgutils.ir.FunctionType(cgutils.ir.VoidType(), [pointer] * 5)
        function = builder.inttoptr(values[0], kind.as_pointer())
        builder.call(function, [builder.inttoptr(v, pointer) for v in values[1:]])
        return context.get_dummy_value()

    return signature, generate


@intrinsic
def never_inline(_: Any) -> Any:
    """Mark the calling function as never inlined, which shortens compilation."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), generate

"""Functions that Numba compiles only to link them into others.

Numba optimises every function together with all that it calls and turns it into machine code, also
if only other compiled functions call it: a leaf at depth eight is optimised eight times.  Functions
decorated by :func:`linked` stay as they are until they are linked into a function that Python
calls, which is optimised once.
"""

import ctypes
from collections.abc import Iterable
from typing import Any

from llvmlite.binding import Linkage, parse_assembly
from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.runtime import rtsys

# Returns a null pointer without an exception: where Python calls a linked function all the same, it
# raises a SystemError.
NO_CODE = ctypes.cast(ctypes.pythonapi.PyErr_Occurred, ctypes.c_void_p).value or 0


def linked(**options: Any) -> Any:
    """Return Numba's decorator for functions that only other compiled functions call."""
    return njit(
        no_cpython_wrapper=True, no_cfunc_wrapper=True, pipeline_class=LinkedCompiler, **options
    )


def whole_module(
    functions: Iterable[Any], arguments: tuple[Any, ...], memory: str
) -> tuple[Any, list[str]]:
    """Return linked functions, with all that they call, as one module, and their names there.

    They can be called from outside by these names, all others cannot.  ``memory`` is intermediate
    code of what Numba allocates arrays with.
    """
    module, names = parse_assembly(memory), []
    for function in functions:
        function.compile(arguments)
        overload = function.overloads[arguments]
        names.append(overload.fndesc.llvm_func_name)
        whole = overload.library.whole_module()
        whole.get_function(names[-1]).linkage = Linkage.external  # others, if they are called
        module.link_in(whole)
    for part in (*module.functions, *module.global_variables):
        if not part.is_declaration:
            part.linkage = Linkage.external if part.name in names else Linkage.internal
    return module, names


# Numba has no types, so its classes are Any to mypy.
class LinkedCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's compiler, with a library of our own."""

    def define_pipelines(self) -> list[Any]:
        """Return Numba's pipeline."""
        state = self.state
        state.library = LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        return [DefaultPassBuilder.define_nopython_pipeline(state)]


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Code of a function that is linked into others, but neither optimised nor emitted alone."""

    _shared_module: Any  # with all that it calls, once it was asked for

    @property
    def codegen(self) -> Any:
        """The code generator."""
        return _Codegen(self._codegen)

    def finalize(self) -> None:
        """Make the code ready to be linked."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"  # may be linked several times
        self._finalized = True

    def get_pointer_to_function(self, _: str) -> int:
        """Return the address of a function for Python that does nothing; see ``NO_CODE``."""
        self._ensure_finalized()
        return NO_CODE

    def whole_module(self) -> Any:
        """Return the code with all that it calls."""
        return self._get_module_for_linking().clone()

    def _get_module_for_linking(self) -> Any:
        self._ensure_finalized()
        whole = self._shared_module
        if whole is None:
            self._shared_module = whole = self._final_module.clone()
            for library in list(self._called({}))[1:]:
                own = isinstance(library, LinkedLibrary)
                module = library._final_module if own else library._get_module_for_linking()
                whole.link_in(module, preserve=True)
        return whole

    def _called(self, known: dict[Any, None]) -> dict[Any, None]:
        """Add this library and all that it calls, directly or not, to those known.

        Numba's allocation of arrays is not among them: who links the whole adds it, or another.
        """
        known[self] = None
        for library in self._linking_libraries:
            if library not in known and library is not rtsys.library:
                known[library] = None
                if isinstance(library, LinkedLibrary):
                    library._called(known)
        return known


class _Codegen:
    """A code generator that sets no environments: only machine code has them."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""

"""Functions that Numba compiles only to link them into others.

Numba optimises every function together with all that it calls and turns it into machine code, also
if only other compiled functions call it: a leaf at depth eight is optimised eight times.  Functions
decorated by :func:`linked` stay as they are until they are linked into a function that Python
calls, which is optimised once.
"""

import ctypes
from typing import Any

from llvmlite.binding import Linkage
from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder

# Returns a null pointer without an exception: where Python calls a linked function all the same, it
# raises a SystemError.
NO_CODE = ctypes.cast(ctypes.pythonapi.PyErr_Occurred, ctypes.c_void_p).value or 0


def linked(**options: Any) -> Any:
    """Return Numba's decorator for functions that only other compiled functions call."""
    return njit(
        no_cpython_wrapper=True, no_cfunc_wrapper=True, pipeline_class=LinkedCompiler, **options
    )


def whole_module(function: Any, arguments: tuple[Any, ...]) -> tuple[Any, str]:
    """Return a linked function, with all that it calls, as a module of its own, and its name there.

    The function can be called from outside by the name, all others cannot.
    """
    function.compile(arguments)
    overload = function.overloads[arguments]
    module: Any = overload.library.whole_module()
    name: str = overload.fndesc.llvm_func_name
    for part in (*module.functions, *module.global_variables):
        if not part.is_declaration:
            part.linkage = Linkage.external if part.name == name else Linkage.internal
    return module, name


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
        """The code generator, which waits for the machine code before it sets environments."""
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
        """Add this library and all that it calls, directly or not, to those known."""
        known[self] = None
        for library in self._linking_libraries:
            if library not in known:
                known[library] = None
                if isinstance(library, LinkedLibrary):
                    library._called(known)
        return known


_environments: dict[str, Any] = {}  # of linked functions, until there is machine code of them


class _Codegen:
    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        _environments[name] = environment


def set_environments(codegen: Any) -> None:
    """Give linked functions that have become machine code their environments."""
    for name, environment in list(_environments.items()):
        if codegen._engine.is_symbol_defined(name):
            codegen.set_env(name, environment)
            del _environments[name]

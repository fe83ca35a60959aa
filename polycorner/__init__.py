"""Curvilinear polyhedra: faces and corners, minima of energies on them, and motion with contact."""

import warnings
from typing import Any

import lazy_loader

__version__ = "0.1.0"
_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Return a public name, or say what is called nearly like it."""
    try:
        return _attribute(name)
    except AttributeError as error:
        from polycorner.errors import not_here

        message = not_here(name, __all__)
        raise (AttributeError(message, name=name) if message else error) from None


# Infinite and undefined numbers are outcomes here, and looked at; NumPy need not tell a user of
# them, in whatever thread.  pytest sets this filter aside, so that the tests see where they arise.
warnings.filterwarnings(
    "ignore",
    r"(divide by zero|overflow|underflow|invalid value) encountered",
    RuntimeWarning,
    r"polycorner\.",
)

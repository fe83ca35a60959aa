"""Curvilinear polyhedra: faces and corners, minima of energies on them, and motion with contact."""

import warnings

import lazy_loader

__version__ = "0.1.0"
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

# Infinite and undefined numbers are outcomes here, and looked at; NumPy need not tell a user of
# them, in whatever thread.  pytest sets this filter aside, so that the tests see where they arise.
warnings.filterwarnings(
    "ignore",
    r"(divide by zero|overflow|underflow|invalid value) encountered",
    RuntimeWarning,
    r"polycorner\.",
)

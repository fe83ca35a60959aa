"""Minima of energies on polyhedra, their certificates and their dependence on parameters."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

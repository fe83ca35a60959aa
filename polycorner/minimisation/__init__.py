"""Minima of an energy on a polyhedron: where they are, why they are minima, how they move."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

"""Figures of regions, solids, clusters, disks and proofs; never imported by the core."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

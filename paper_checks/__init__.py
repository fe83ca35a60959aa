"""The statements of [GMBN], each restated and checked; ``CLAIMS`` in the order of its sections."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

"""Sets carved out by smooth inequalities joined by and/or, and the face a point lies on."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

from .manifold import Manifold

__all__ = [
    "Manifold",
]

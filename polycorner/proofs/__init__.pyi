from .proof import Proof, prove

__all__ = [
    "Proof",
    "prove",
]

"""Worked systems, one file each; the core never imports them."""

from polycorner.models.dumbbells import DumbbellPair

__all__ = ["DumbbellPair"]

"""Worked systems, one file each; the core never imports them."""

from polycorner.models.dumbbell_formulas import plane_heading_formula
from polycorner.models.dumbbells import DumbbellPair

__all__ = ["DumbbellPair", "plane_heading_formula"]

"""Questions answered for a model as a whole."""

from polycorner.studies.dyad import DyadMinimum, dyad_minima, heading_curve, paper_heading

__all__ = ["DyadMinimum", "dyad_minima", "heading_curve", "paper_heading"]

"""Questions answered for a model as a whole, and results in files."""

from polycorner.studies.dyad import DyadMinimum, dyad_minima, heading_curve, paper_heading
from polycorner.studies.files import load_atlas, save_atlas
from polycorner.studies.pair_atlas import PairAtlas, long_rod_length, pair_atlas

__all__ = [
    "DyadMinimum",
    "PairAtlas",
    "dyad_minima",
    "heading_curve",
    "load_atlas",
    "long_rod_length",
    "pair_atlas",
    "paper_heading",
    "save_atlas",
]

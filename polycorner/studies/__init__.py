"""Questions answered for a model as a whole, and results in files."""

from polycorner.studies.critical import (
    critical_length,
    critical_rod_radius,
    plane_critical_formula,
)
from polycorner.studies.dyad import DyadMinimum, dyad_minima, heading_curve, paper_heading
from polycorner.studies.files import (
    load_atlas,
    load_certificate,
    load_trajectory,
    save_atlas,
    save_certificate,
    save_graph,
    save_trajectory,
    skeleton_graph,
)
from polycorner.studies.pair_atlas import PairAtlas, long_rod_length, pair_atlas
from polycorner.studies.pair_map import PairMap, pair_map
from polycorner.studies.pair_minima import MinimaMap, minima_map, pair_minima
from polycorner.studies.sensitivity import ErrorBar, heading_error_bar, pair_sensitivity
from polycorner.studies.sweeps import Axis, SweepError, open_results, sweep

__all__ = [
    "Axis",
    "DyadMinimum",
    "ErrorBar",
    "MinimaMap",
    "PairAtlas",
    "PairMap",
    "SweepError",
    "critical_length",
    "critical_rod_radius",
    "dyad_minima",
    "heading_curve",
    "heading_error_bar",
    "load_atlas",
    "load_certificate",
    "load_trajectory",
    "long_rod_length",
    "minima_map",
    "open_results",
    "pair_atlas",
    "pair_map",
    "pair_minima",
    "pair_sensitivity",
    "paper_heading",
    "plane_critical_formula",
    "save_atlas",
    "save_certificate",
    "save_graph",
    "save_trajectory",
    "skeleton_graph",
    "sweep",
]

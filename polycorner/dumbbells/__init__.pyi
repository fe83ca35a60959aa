from .drum import DumbbellDrum
from .formulas import plane_heading_formula
from .imperfections import OutOfRound, Shaking, UnevenFriction, Wobble
from .pair import DumbbellPair
from .rigid import RigidDumbbells
from .statics.critical import critical_length, critical_rod_radius, plane_critical_formula
from .statics.depths import PairLandscape, pair_landscape, plane_depth_formula
from .statics.error_bars import ErrorBar, heading_error_bar, pair_sensitivity
from .statics.keel import Keel, RestRegion
from .statics.meetings import meeting_basins, meetings, placement_basins
from .statics.minima import DyadMinimum, dyad_minima, heading_curve, pair_minima, paper_heading
from .statics.minima_map import MinimaMap, minima_map
from .statics.relative import RelativePlacements
from .statics.skeleton import PairAtlas, long_rod_length, pair_atlas
from .statics.skeleton_map import PairMap, pair_map

__all__ = [
    "DumbbellDrum",
    "DumbbellPair",
    "DyadMinimum",
    "ErrorBar",
    "Keel",
    "MinimaMap",
    "OutOfRound",
    "PairAtlas",
    "PairLandscape",
    "PairMap",
    "RelativePlacements",
    "RestRegion",
    "RigidDumbbells",
    "Shaking",
    "UnevenFriction",
    "Wobble",
    "critical_length",
    "critical_rod_radius",
    "dyad_minima",
    "heading_curve",
    "heading_error_bar",
    "long_rod_length",
    "meeting_basins",
    "meetings",
    "minima_map",
    "pair_atlas",
    "pair_landscape",
    "pair_map",
    "pair_minima",
    "pair_sensitivity",
    "paper_heading",
    "placement_basins",
    "plane_critical_formula",
    "plane_depth_formula",
    "plane_heading_formula",
]

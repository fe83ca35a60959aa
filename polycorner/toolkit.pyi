from . import checks
from .atomic import replace_atomically, write_atomically
from .bodies.placed import SOURCES, Feature, placed_gaps, placed_stationary
from .bodies.waves import wave_depth, waves
from .checks import (
    about,
    choice,
    flag,
    instance,
    mapping,
    missing_extra,
    real,
    reals,
    refuse,
    whole,
)
from .container import BINARY, FileKind
from .errors import nearest
from .files.motions import (
    MotionUnits,
    column,
    load_dataset,
    motion_attributes,
    motion_coordinates,
    motion_data,
    read_motion,
    save_dataset,
)
from .formulas.bundles import Call
from .formulas.cache import cache_folder, source_key
from .formulas.functions import with_numbers
from .intervals.boxes import BoxFunctions
from .kinds import check_fields, checked
from .landscapes.steepest import steepest
from .minimisation.problem import pose
from .motion.bodies import FrictionContact, IdenticalBodies, MovingBody, PairContacts, PairLaw
from .motion.formulation import TIME, Formulation, Laws
from .motion.random_functions import check_band, field_modes, signal_modes
from .motion.simulation import LONGEST, SHORTEST_STEP
from .motion.trajectory import Touch
from .pictures.films import RATE, Picture, check_movie, movie_suffix, write_frames
from .pictures.pages import html_page, packed, packed_contacts, page_file, three_script
from .pictures.solids.charts import Chart, Gaps
from .pictures.solids.grids import FEWEST_CELLS, Function
from .pictures.solids.meshes import painted
from .pictures.style import BODIES, SHADES, bridged
from .polyhedra.cones import rank
from .polyhedra.faces import project, projected
from .polyhedra.quotients import Quotient
from .printing import Printed, Sheet, Table, facts, number
from .progress import Progress, silent
from .skeletons.orbits import Orbits, orbits
from .spaces.arguments import finite, scalar
from .spaces.distances import dot, minus, norm
from .spaces.manifold import Array
from .tolerances import DEFAULT, TOLERANCE
from .values import Checked, Value, cached_property
from .workers import serve

__all__ = [
    "BINARY",
    "BODIES",
    "DEFAULT",
    "FEWEST_CELLS",
    "LONGEST",
    "RATE",
    "SHADES",
    "SHORTEST_STEP",
    "SOURCES",
    "TIME",
    "TOLERANCE",
    "Array",
    "BoxFunctions",
    "Call",
    "Chart",
    "Checked",
    "Feature",
    "FileKind",
    "Formulation",
    "FrictionContact",
    "Function",
    "Gaps",
    "IdenticalBodies",
    "Laws",
    "MotionUnits",
    "MovingBody",
    "Orbits",
    "PairContacts",
    "PairLaw",
    "Picture",
    "Printed",
    "Progress",
    "Quotient",
    "Sheet",
    "Table",
    "Touch",
    "Value",
    "about",
    "bridged",
    "cache_folder",
    "cached_property",
    "check_band",
    "check_fields",
    "check_movie",
    "checked",
    "checks",
    "choice",
    "column",
    "dot",
    "facts",
    "field_modes",
    "finite",
    "flag",
    "html_page",
    "instance",
    "load_dataset",
    "mapping",
    "minus",
    "missing_extra",
    "motion_attributes",
    "motion_coordinates",
    "motion_data",
    "movie_suffix",
    "nearest",
    "norm",
    "number",
    "orbits",
    "packed",
    "packed_contacts",
    "page_file",
    "painted",
    "placed_gaps",
    "placed_stationary",
    "pose",
    "project",
    "projected",
    "rank",
    "read_motion",
    "real",
    "reals",
    "refuse",
    "replace_atomically",
    "save_dataset",
    "scalar",
    "serve",
    "signal_modes",
    "silent",
    "source_key",
    "steepest",
    "three_script",
    "wave_depth",
    "waves",
    "whole",
    "with_numbers",
    "write_atomically",
    "write_frames",
]

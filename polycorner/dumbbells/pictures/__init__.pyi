from .bifurcation import draw_bifurcation, draw_critical
from .drum import DrumView, draw_drum, draw_history
from .dyads import draw_heading, draw_pair
from .experiments import draw_climbing, draw_exits, draw_keel, draw_steady_headings
from .film import Film, pair_film, run_film
from .minima_map import draw_kinds, draw_minima_map, draw_pair_map
from .motion_strips import draw_motions, draw_relative
from .movies import write_movie
from .placements import forbidden_solid, relative_coordinates, relative_placements
from .relabelling import draw_atlas
from .scenes import atlas_scene, drum_scene, glb, pair_scene, write_scene
from .solid import SolidFacts, relative_corners, relative_curves, solid_facts, write_solid
from .studies import draw_study
from .wells import draw_meetings, draw_wells

__all__ = [
    "DrumView",
    "Film",
    "SolidFacts",
    "atlas_scene",
    "draw_atlas",
    "draw_bifurcation",
    "draw_climbing",
    "draw_critical",
    "draw_drum",
    "draw_exits",
    "draw_heading",
    "draw_history",
    "draw_keel",
    "draw_kinds",
    "draw_meetings",
    "draw_minima_map",
    "draw_motions",
    "draw_pair",
    "draw_pair_map",
    "draw_relative",
    "draw_steady_headings",
    "draw_study",
    "draw_wells",
    "drum_scene",
    "forbidden_solid",
    "glb",
    "pair_film",
    "pair_scene",
    "relative_coordinates",
    "relative_corners",
    "relative_curves",
    "relative_placements",
    "run_film",
    "solid_facts",
    "write_movie",
    "write_scene",
    "write_solid",
]

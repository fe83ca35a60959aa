from .arrangements import draw_arrangement
from .branches import draw_branches, draw_cells, draw_event_map
from .clusters import draw_clusters
from .disks import draw_critical, draw_packing
from .exports import save_motion
from .landscape_maps import draw_landscape_map, film_route
from .landscapes import draw_barcode, draw_landscape
from .motion_films import MotionFilm, draw_motion, film
from .motion_pages import skeleton_page
from .regions import draw_region
from .solids import (
    Isosurface,
    SharpSurface,
    View,
    components_of_complement,
    draw_solid,
    isosurface,
    place_solid,
    sharp_surface,
    visible,
    write_mesh,
)
from .style import save

__all__ = [
    "Isosurface",
    "MotionFilm",
    "SharpSurface",
    "View",
    "components_of_complement",
    "draw_arrangement",
    "draw_barcode",
    "draw_branches",
    "draw_cells",
    "draw_clusters",
    "draw_critical",
    "draw_event_map",
    "draw_landscape",
    "draw_landscape_map",
    "draw_motion",
    "draw_packing",
    "draw_region",
    "draw_solid",
    "film",
    "film_route",
    "isosurface",
    "place_solid",
    "save",
    "save_motion",
    "sharp_surface",
    "skeleton_page",
    "visible",
    "write_mesh",
]

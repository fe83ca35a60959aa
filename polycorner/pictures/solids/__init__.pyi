from .meshes import Isosurface, components_of_complement, isosurface, write_mesh
from .rendering import View, draw_solid, place_solid, visible
from .sharp_surfaces import SharpSurface, sharp_surface

__all__ = [
    "Isosurface",
    "SharpSurface",
    "View",
    "components_of_complement",
    "draw_solid",
    "isosurface",
    "place_solid",
    "sharp_surface",
    "visible",
    "write_mesh",
]

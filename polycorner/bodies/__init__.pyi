from .arrangement import Arrangement
from .shapes import Body, Part, capsule, compound, disc, polygon, polytope, sphere
from .walls import Cylinder, HalfSpace, box

__all__ = [
    "Arrangement",
    "Body",
    "Cylinder",
    "HalfSpace",
    "Part",
    "box",
    "capsule",
    "compound",
    "disc",
    "polygon",
    "polytope",
    "sphere",
]

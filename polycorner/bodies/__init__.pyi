from .arrangement import Arrangement
from .masses import Mass, mass_of
from .shapes import Body, Part, capsule, compound, disc, polygon, polytope, sphere
from .sizes import scaled, thinned
from .walls import Cylinder, HalfSpace, box

__all__ = [
    "Arrangement",
    "Body",
    "Cylinder",
    "HalfSpace",
    "Mass",
    "Part",
    "box",
    "capsule",
    "compound",
    "disc",
    "mass_of",
    "polygon",
    "polytope",
    "scaled",
    "sphere",
    "thinned",
]

from .arrangement import Arrangement
from .joints import Ball, Fixed, Gear, Hinge, Joint, Planar, Rail, Slider
from .masses import Mass, mass_of
from .shapes import Body, Part, capsule, compound, disc, polygon, polytope, sphere
from .sizes import scaled, thinned
from .walls import Cylinder, HalfSpace, box

__all__ = [
    "Arrangement",
    "Ball",
    "Body",
    "Cylinder",
    "Fixed",
    "Gear",
    "HalfSpace",
    "Hinge",
    "Joint",
    "Mass",
    "Part",
    "Planar",
    "Rail",
    "Slider",
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

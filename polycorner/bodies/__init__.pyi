from .arrangement import Arrangement
from .drives import Damper, Motor, Prescribed, Spring
from .joints import Ball, Fixed, Gear, Hinge, Joint, Planar, Rail, Slider
from .links import RobotJoint, RobotLink
from .masses import Mass, mass_of
from .posed import posed
from .robots import Robot
from .shapes import Body, Part, capsule, compound, disc, polygon, polytope, sphere
from .sizes import scaled, thinned
from .walls import Cylinder, HalfSpace, box

__all__ = [
    "Arrangement",
    "Ball",
    "Body",
    "Cylinder",
    "Damper",
    "Fixed",
    "Gear",
    "HalfSpace",
    "Hinge",
    "Joint",
    "Mass",
    "Motor",
    "Part",
    "Planar",
    "Prescribed",
    "Rail",
    "Robot",
    "RobotJoint",
    "RobotLink",
    "Slider",
    "Spring",
    "box",
    "capsule",
    "compound",
    "disc",
    "mass_of",
    "polygon",
    "polytope",
    "posed",
    "scaled",
    "sphere",
    "thinned",
]

from .branches import load_diagram, save_diagram
from .certificates import load_certificate, save_certificate
from .graphs import load_graph, save_graph, skeleton_graph
from .landscapes import load_landscape, save_landscape
from .meshes import MeshOptions, Solid, read_mesh
from .particles import Particles, molecule, read_particles
from .problems import ProblemFile, load_problem, save_problem
from .samples import load_sample, save_sample
from .skeletons import load_skeleton, save_skeleton
from .trajectories import load_trajectory, save_trajectory
from .urdf import read_urdf

__all__ = [
    "MeshOptions",
    "Particles",
    "ProblemFile",
    "Solid",
    "load_certificate",
    "load_diagram",
    "load_graph",
    "load_landscape",
    "load_problem",
    "load_sample",
    "load_skeleton",
    "load_trajectory",
    "molecule",
    "read_mesh",
    "read_particles",
    "read_urdf",
    "save_certificate",
    "save_diagram",
    "save_graph",
    "save_landscape",
    "save_problem",
    "save_sample",
    "save_skeleton",
    "save_trajectory",
    "skeleton_graph",
]

from .certificates import load_certificate, save_certificate
from .graphs import save_graph, skeleton_graph
from .skeletons import load_atlas, save_atlas
from .trajectories import load_trajectory, save_trajectory

__all__ = [
    "load_atlas",
    "load_certificate",
    "load_trajectory",
    "save_atlas",
    "save_certificate",
    "save_graph",
    "save_trajectory",
    "skeleton_graph",
]

"""Saving and loading what was computed: every file is re-checked when it is loaded.

Certificates and atlases are JSON, motions NetCDF, graphs GraphML.  A file appears whole or not at
all, has a version, and is refused with one sentence if it was changed, is newer than this package,
or is not what is computed from the polyhedron or the system at hand.
"""

from polycorner.studies.atlas_files import load_atlas, save_atlas
from polycorner.studies.certificate_files import load_certificate, save_certificate
from polycorner.studies.graph_files import save_graph, skeleton_graph
from polycorner.studies.trajectory_files import load_trajectory, save_trajectory

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

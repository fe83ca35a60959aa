"""The page of the API: public names in groups, by what a reader wants to do.

The groups name every public name of the packages once; otherwise there is no page.  What
applications are built with is listed by the module that it is from.
"""

import ast
from collections import defaultdict
from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from docs.extensions.homes import ROOMS

PAGE = "api.rst"
HEAD = """\
API
===

Public names, by what they are for.  Every name is shown under the package from which it is
imported.

"""
DOORS = ("polycorner.toolkit", "polycorner.cli", "polycorner.models.wells")
TOOLS = """\
Build an application
--------------------

What ``polycorner.dumbbells`` is built with, beside the names above: an application imports nothing
else.  Commands are added by entry points (:doc:`cli`).

"""


class Group(NamedTuple):
    """Names that serve one purpose."""

    title: str
    purpose: str
    names: dict[str, str]  # by package, without ``polycorner.``


GROUPS = (
    Group(
        "Describe a set",
        "Coordinates, smooth functions, inequalities joined by *and* and *or*, symmetries.",
        {
            "": "Manifold SmoothFunction Polyhedron AllOf AnyOf Symmetry",
            "polyhedra": "Element",
            "formulas": "Family",
        },
    ),
    Group(
        "Describe a point of it",
        "Which functions vanish there, and what the set looks like nearby.",
        {"": "Stratum stratum_at", "polyhedra": "LocalType"},
    ),
    Group(
        "Minimise",
        "Minima of an energy from one start or many, and how many were missed.",
        {
            "": "minimise minima stationary_on Minima",
            "minimisation": "Problem Richness richness",
        },
    ),
    Group(
        "Certify",
        "Conditions of first and second order at a point, and what holds it there.",
        {
            "": "certify Certificate Verdict Entrapment",
            "minimisation": "Condition Residuals Immobility Mobility immobility",
        },
    ),
    Group(
        "Vary parameters",
        "How a minimum moves with its parameters, and where it ends.",
        {"": "sensitivity Sensitivity", "minimisation": "Crossing crossing"},
    ),
    Group(
        "Follow equilibria",
        "Equilibria over a parameter, with the events at which they change, begin and end.",
        {
            "branches": "branches Diagram Arc BranchEvent BranchKind hysteresis Hysteresis Leg "
            "Jump event_curves EventMap EventCurve MeetingPoint MeetingKind "
            "prove_branches BranchProof BranchProofOptions",
        },
    ),
    Group(
        "Weigh strata",
        "How often corners, edges and faces are seen; points of them; rates between corners.",
        {
            "measures": "measure Weighting StrataMeasures sample SampleOptions StrataSample "
            "Estimate face_weights FaceWeights rates TransitionRates volume Volume",
        },
    ),
    Group(
        "Prove and list",
        "Theorems in ball arithmetic: of points, minima, all stationary points, all corners.",
        {
            "": "exact_point Membership prove Proof",
            "proofs": "Violation ParameterCell Status StationaryList StationaryLocus "
            "StationaryPoint stationary_points CornerList CornerPoint corners",
        },
    ),
    Group(
        "Chart a landscape",
        "How deep minima are, over which passes they are left, shares of basins.",
        {
            "landscapes": "landscape search_landscape Landscape Minimum Pass Side Merge Barrier "
            "Route paved_barrier Paving basins Basins minimum_of",
        },
    ),
    Group(
        "Trace a skeleton",
        "Corners, edges and faces of a set, and how they are joined.",
        {
            "": "skeleton Skeleton",
            "skeletons": "Corner Edge Face Contact End Budget Completeness resume traced "
            "examine_faces",
            "polyhedra": "WalkOptions",
        },
    ),
    Group(
        "Find the topology of a union",
        "Homology of unions of flat pieces, above every height.",
        {"polyhedra": "Nerve Bar nerve"},
    ),
    Group(
        "Build bodies",
        "Rigid bodies in the plane and in space, walls, and sets of placements without overlap.",
        {
            "bodies": "Arrangement Body Part disc sphere capsule polygon polytope compound "
            "HalfSpace Cylinder box Mass mass_of scaled thinned Robot RobotLink RobotJoint posed",
        },
    ),
    Group(
        "Join bodies",
        "Joints between bodies, or with space, as equations and limits of placements.",
        {"bodies": "Joint Hinge Slider Ball Fixed Rail Planar Gear"},
    ),
    Group(
        "Drive bodies",
        "Springs, dampers, motors and prescribed motions.",
        {"bodies": "Spring Damper Motor Prescribed"},
    ),
    Group(
        "Simulate motion",
        "Bodies with contacts, impacts and friction: a system, a start, a trajectory.",
        {
            "": "System Drift State simulate Trajectory",
            "motion": "Assembly MotionOfKind step Event EventKind Split Checkpoint Solver "
            "MotionOptions MechanicalSystem Accelerations Consistency accelerations ContactForce "
            "ContactForces contact_forces",
        },
    ),
    Group(
        "Write equations of motion",
        "Velocities, times and contacts of bodies as symbols in formulas.",
        {
            "": "velocities",
            "motion": "Attraction ContactFamily Tie SpeedZones motions pair_coordinates "
            "pair_velocities time_symbol angular_velocity rotational_energy",
        },
    ),
    Group(
        "Add friction and noise",
        "Laws of friction with their convex sets, random forces and surfaces.",
        {
            "": "Friction",
            "motion": "PairFriction ConvexSet Disc CutDisc Ellipse Interval ConvexPolygon Noise "
            "random_field random_signal",
        },
    ),
    Group(
        "Use a model",
        "Sets and energies that are ready-made.",
        {
            "models": "Tutorial Pinball SphereCluster LennardJones TorusDisks "
            "CriticalConfiguration CriticalSearch PeriodicPacking JammedPacking CirclesIn "
            "SpheresInCube PointsOnSphere "
            "basin_hopping BasinHopping read_coordinates CoordinateTable",
        },
    ),
    Group(
        "Save and load",
        "Problems, certificates, skeletons, landscapes, diagrams, graphs, trajectories, samples.",
        {
            "files": "ProblemFile save_problem load_problem save_certificate load_certificate "
            "save_skeleton load_skeleton save_trajectory load_trajectory skeleton_graph "
            "save_graph load_graph save_landscape load_landscape save_diagram load_diagram "
            "save_sample load_sample",
        },
    ),
    Group(
        "Read what other programs write",
        "Bodies from meshes, robots from URDF files, particles and molecules.",
        {"files": "read_mesh Solid MeshOptions read_urdf read_particles Particles molecule"},
    ),
    Group(
        "Run a parameter study",
        "A function on a grid, on any number of workers, in a store that grows.",
        {
            "sweeps": "sweep Grid Axis StudyFile NamedStudy read_study open_results SweepError",
        },
    ),
    Group(
        "Draw",
        "Figures of sets, bodies and results.",
        {
            "pictures": "draw_region draw_arrangement draw_clusters draw_motion draw_packing "
            "draw_critical draw_cells draw_barcode draw_branches draw_event_map draw_landscape "
            "draw_landscape_map film MotionFilm film_route skeleton_page save save_motion",
        },
    ),
    Group(
        "Draw solids",
        "Surfaces in three coordinates: sharp edges, meshes, views.",
        {
            "pictures": "sharp_surface SharpSurface isosurface Isosurface "
            "components_of_complement draw_solid place_solid View visible write_mesh",
        },
    ),
    Group(
        "Dumbbells: rest",
        "Two dumbbells in a drum: their minima, headings and skeleton.",
        {
            "dumbbells": "DumbbellPair dyad_minima DyadMinimum pair_minima pair_atlas PairAtlas "
            "RelativePlacements minima_map MinimaMap pair_map PairMap meetings meeting_basins "
            "placement_basins pair_landscape PairLandscape",
        },
    ),
    Group(
        "Dumbbells: headings and critical sizes",
        "Formulas and curves to compare with experiments, with their errors.",
        {
            "dumbbells": "heading_curve paper_heading plane_heading_formula heading_error_bar "
            "ErrorBar pair_sensitivity critical_length critical_rod_radius long_rod_length "
            "plane_critical_formula plane_depth_formula",
        },
    ),
    Group(
        "Dumbbells: motion",
        "Dumbbells in a drum that turns, shakes, or is imperfect.",
        {
            "dumbbells": "DumbbellDrum RigidDumbbells Keel RestRegion Shaking Wobble OutOfRound "
            "UnevenFriction",
        },
    ),
    Group(
        "Dumbbells: figures of rest",
        "Pairs, skeletons, headings, maps of minima.",
        {
            "dumbbells.pictures": "draw_pair draw_heading draw_bifurcation draw_critical "
            "draw_kinds draw_minima_map draw_pair_map draw_relative draw_atlas draw_motions "
            "draw_wells draw_meetings",
        },
    ),
    Group(
        "Dumbbells: figures of motion",
        "Histories, films and scenes of the drum, and of studies.",
        {
            "dumbbells.pictures": "draw_drum draw_history draw_keel draw_climbing draw_exits "
            "draw_steady_headings draw_study DrumView Film pair_film run_film write_movie",
        },
    ),
    Group(
        "Dumbbells: solids and scenes",
        "The forbidden placements as a solid; scenes for other programs.",
        {
            "dumbbells.pictures": "forbidden_solid SolidFacts solid_facts write_solid "
            "relative_placements relative_coordinates relative_corners relative_curves "
            "pair_scene drum_scene atlas_scene write_scene glb",
        },
    ),
    Group(
        "Dumbbells: pages",
        "Pages to play with, from a server or as files.",
        {
            "dumbbells.viewer": "serve live_application page_application bound PortTakenError "
            "write_page atlas_page film_page descent Descent",
        },
    ),
    Group(
        "Errors",
        "What is raised beside ValueError and TypeError.",
        {"": "PolycornerError SolverError NonsmoothWarning"},
    ),
)


def page() -> str:
    """Return the page as reStructuredText, or raise ValueError for names missing in it."""
    root, *rooms = ({(room, name) for name in import_module(room).__all__} for room in ROOMS)
    common = {name for _, name in root}
    expected = sorted(root | {(r, n) for names in rooms for r, n in names if n not in common})
    grouped = sorted((p, n) for group in GROUPS for p, names in _packages(group) for n in names)
    if grouped != expected:
        faults = {*grouped} ^ {*expected} or {row for row in grouped if grouped.count(row) > 1}
        msg = f"GROUPS: expected every public name once; see {sorted(faults)}"
        raise ValueError(msg)
    return "\n".join([HEAD, *map(_section, GROUPS), *_tools()])


def _packages(group: Group) -> Iterator[tuple[str, list[str]]]:
    """Yield the packages of a group and their names in it."""
    for short, names in group.names.items():
        yield f"polycorner.{short}".rstrip("."), names.split()


def _section(group: Group) -> str:
    lines = [group.title, "-" * len(group.title), "", group.purpose, ""]
    for package, names in _packages(group):
        lines += [f".. currentmodule:: {package}", "", ".. autosummary::"]
        lines += ["   :toctree: generated", "", *(f"   {name}" for name in names), ""]
    return "\n".join(lines)


def _tools() -> Iterator[str]:
    """Yield the names of each door, by the modules that they are from."""
    yield TOOLS
    for door in DOORS:
        by_module: dict[str, list[str]] = defaultdict(list)
        stub = Path(import_module(door).__file__ or "").with_suffix(".pyi")
        for module, name in _imports(stub):
            by_module[module].append(f"``{name}``")
        yield f"From ``{door}``:\n"
        for module, names in by_module.items():
            package = door if stub.stem == "__init__" else door.rpartition(".")[0]
            purpose = (import_module(package + module).__doc__ or "").split("\n")[0]
            yield f"- {purpose.partition(';')[0]}\n  {', '.join(names)}"
        yield ""


def _imports(stub: Path) -> Iterable[tuple[str, str]]:
    for node in ast.parse(stub.read_text()).body:
        if isinstance(node, ast.ImportFrom):
            where = f".{node.module}" if node.module else ""
            yield from ((where or f".{a.name}", a.name) for a in node.names)


def write(app: Any, _config: Any) -> None:
    """Write the page before Sphinx looks for its sources."""
    file = Path(app.srcdir) / PAGE
    text = page()
    if not file.exists() or file.read_text() != text:
        file.write_text(text)


def setup(app: Any) -> dict[str, bool]:
    """Write the page once the configuration is read."""
    app.connect("config-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

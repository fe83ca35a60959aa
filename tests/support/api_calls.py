"""One small valid call of everything public: what is called, and with which arguments.

The arguments of a dataclass are the fields of the value in ``VALUES``, on which the methods of a
class are called as well.
"""

import api_samples as of
import numpy as np

import polycorner
from polycorner import (
    bodies,
    dumbbells,
    minimisation,
    models,
    motion,
    pictures,
    polyhedra,
    skeletons,
    sweeps,
)
from polycorner.dumbbells import pictures as drum_pictures

ORIGIN = [0.0, 0.0]

# One value of every public class.
VALUES = {
    "Accelerations": lambda: motion.accelerations(of.system(), of.state()),
    "AllOf": lambda: polyhedra.AllOf(of.X, of.Y),
    "AnyOf": lambda: polyhedra.AnyOf(of.X, of.Y),
    "Arrangement": of.arrangement,
    "Axis": lambda: sweeps.Axis([1.0, 2.0], "mm"),
    "Bar": lambda: of.nerve().bars[0],
    "Body": of.hexagon,
    "Budget": lambda: skeletons.Budget(10, 5.0),
    "Certificate": of.certificate,
    "Checkpoint": lambda: motion.Checkpoint(of.new("checkpoints")),
    "Condition": lambda: minimisation.Condition("holds", True, 0.5),
    "Contact": lambda: of.skeleton().contacts["left"],
    "ContactFamily": of.contact_family,
    "ConvexPolygon": lambda: motion.ConvexPolygon([[-1, -1], [1, -1], [1, 1], [-1, 1]]),
    "Corner": lambda: of.skeleton().corners[0],
    "CornerList": of.corner_list,
    "CornerPoint": lambda: of.corner_list().points[0],
    "CriticalConfiguration": lambda: of.critical()[0],
    "CriticalSearch": lambda: of.disks().critical_search(0, starts=3),
    "Crossing": lambda: minimisation.crossing(of.certificate(), "left", "a"),
    "CutDisc": lambda: motion.CutDisc(0.3, 0.1),
    "Cylinder": lambda: bodies.Cylinder(3.0),
    "Descent": lambda: dumbbells.viewer.descent(of.square(), of.energy(), [0.5, 0.5]),
    "Disc": lambda: motion.Disc(0.3),
    "DrumView": lambda: drum_pictures.DrumView(of.run()),
    "DumbbellDrum": of.drum,
    "DumbbellPair": of.pair,
    "DyadMinimum": lambda: dumbbells.dyad_minima(of.pair())[0],
    "Edge": lambda: of.skeleton().edges[0],
    "Element": of.element,
    "Ellipse": lambda: motion.Ellipse(0.3, 0.2),
    "ErrorBar": lambda: dumbbells.heading_error_bar(of.pair(), {"length": 0.1}),
    "Event": lambda: motion.Event(0.5, motion.EventKind.IMPACT, (0,), "bottom", 1.0),
    "Face": lambda: skeletons.Face(("left",), ((0, 1),), True),
    "Family": lambda: of.energy().family,
    "Film": of.film,
    "Friction": of.friction,
    "Grid": lambda: sweeps.Grid.of({"size": [1.0, 2.0]}),
    "HalfSpace": lambda: bodies.HalfSpace([0.0, 1.0], ORIGIN),
    "Immobility": lambda: minimisation.immobility(of.square(), ORIGIN),
    "Interval": lambda: motion.Interval(lower=-0.3, upper=0.3),
    "Isosurface": of.isosurface,
    "JammedPacking": of.packing,
    "Keel": lambda: dumbbells.Keel(0.12, 0.1, 0.3, 0.06, 0.2),
    "Manifold": lambda: of.M,
    "Mass": lambda: bodies.mass_of(of.hexagon()),
    "Minima": of.minima,
    "MinimaMap": of.minima_map,
    "MotionOptions": motion.MotionOptions,
    "NamedStudy": lambda: sweeps.NamedStudy(of.study, {"size": "mm"}, of.study_file(), len),
    "Nerve": of.nerve,
    "Noise": lambda: motion.Noise(0.2, kicks={"x": 0.1}, kick_time=0.1),
    "OutOfRound": lambda: dumbbells.OutOfRound({2: 0.1}, {2: 0.0}),
    "PairAtlas": of.atlas,
    "PairFriction": of.pair_friction,
    "PairMap": of.pair_map,
    "ParameterCell": lambda: of.cell().cells[0],
    "Part": lambda: of.hexagon().parts[""],
    "PeriodicPacking": lambda: models.PeriodicPacking.bidisperse(24),
    "Pinball": models.Pinball,
    "Polyhedron": of.square,
    "Problem": lambda: of.certificate().problem,
    "Proof": of.proof,
    "RelativePlacements": lambda: dumbbells.RelativePlacements(of.pair()),
    "Residuals": lambda: minimisation.Residuals(0.0, 0.0, 0.0),
    "RestRegion": lambda: dumbbells.RestRegion(0.12, 0.1, 0.3),
    "Richness": lambda: minimisation.richness([1, 2, 2]),
    "RigidDumbbells": lambda: dumbbells.RigidDumbbells(of.drum()),
    "Sensitivity": lambda: polycorner.sensitivity(of.certificate()),
    "Shaking": lambda: dumbbells.Shaking((0.1, 0.1, 0.1), (1.0, 5.0)),
    "SharpSurface": of.sharp_surface,
    "Skeleton": of.skeleton,
    "SmoothFunction": of.energy,
    "SolidFacts": lambda: drum_pictures.SolidFacts(1.0, 1.0, 2, True, 4, 0, 0.0, 0.0, 0.0, 4),
    "Solver": motion.Solver,
    "SphereCluster": of.spheres,
    "State": of.state,
    "StationaryList": of.stationary_list,
    "StationaryLocus": of.locus,
    "StationaryPoint": lambda: of.stationary_list().points[0],
    "Stratum": lambda: polycorner.stratum_at(of.square(), ORIGIN),
    "StudyFile": lambda: sweeps.StudyFile("a", of.study, VALUES["Grid"](), {}, 1, False),
    "SweepError": lambda: sweeps.SweepError("it stopped"),
    "Symmetry": of.symmetry,
    "System": of.system,
    "TorusDisks": of.disks,
    "Trajectory": of.trajectory,
    "Tutorial": models.Tutorial,
    "UnevenFriction": lambda: dumbbells.UnevenFriction(0.1, 5.0),
    "View": pictures.View,
    "WalkOptions": polyhedra.WalkOptions,
    "Wobble": lambda: dumbbells.Wobble(0.01),
}

# What a method is called on, where it is not the value of its class.
OTHERS = {
    "Manifold.matrix": lambda: polycorner.Manifold.rotation("a"),
    "Manifold.vector": lambda: polycorner.Manifold.sphere("u"),
}

# Arguments of functions, methods, and constructors of classes that are no dataclasses.
Q = {"q": [0.25, 0.5]}
PQ = {"p": [0.5, 0.5], "q": [0.25, 0.5]}
SQUARE = np.array([0.25, 0.5])
BETWEEN = {"p": SQUARE, "q": SQUARE}
ON = {"manifold": of.M}
FORCE = {"p": [0.1, 0.1]}
SLIP = {"s": [0.1, 0.1]}
SETS = ("ConvexPolygon", "CutDisc", "Disc", "Ellipse", "Interval")
ALIKE = (  # arguments, and what takes them
    (
        Q,
        """Manifold.frame Manifold.point Manifold.points Manifold.wrap Polyhedron.contains
        Polyhedron.equation_values Polyhedron.evaluate Polyhedron.gradients Polyhedron.hessians
        Polyhedron.implicit Polyhedron.values SmoothFunction.gradient SmoothFunction.hessian
        SmoothFunction.value System.state""",
    ),
    (PQ, "Manifold.chord Manifold.difference Manifold.distance"),
    (
        {},
        """Arrangement.system Body.moved Certificate.explain Certificate.holds CornerList.skeleton
        JammedPacking.near_gaps Manifold.matrix Manifold.vector Nerve.betti
        Nerve.euler_characteristic PeriodicPacking.scattered StationaryList.certificates
        TorusDisks.critical_search Tutorial.sides""",
    ),
)

CALLS = {
    **{name: given.copy for given, names in ALIKE for name in names.split()},
    # minimisation
    "certify": lambda: {"polyhedron": of.square(), "energy": of.energy(), "q": ORIGIN},
    "minima": lambda: {
        "polyhedron": of.square(),
        "energy": of.energy(),
        "starts": 2,
        "box": of.UNIT,
        "rng": 0,
    },
    "minimise": lambda: {"polyhedron": of.square(), "energy": of.energy(), "start": [0.5, 0.5]},
    "stationary_on": lambda: {
        "polyhedron": of.square(),
        "energy": of.energy(),
        "start": [0.5, 0.5],
        "active": ["left", "bottom"],
    },
    "sensitivity": lambda: {"certificate": of.certificate()},
    "minimisation.crossing": lambda: {
        "certificate": of.certificate(),
        "contact": "left",
        "parameter": "a",
    },
    "minimisation.immobility": lambda: {"polyhedron": of.square(), "q": ORIGIN},
    "minimisation.richness": lambda: {"counts": [1, 2, 2]},
    "Sensitivity.function": lambda: {"quantity": of.energy()},
    "Sensitivity.of": lambda: {"quantity": of.energy()},
    "Sensitivity.predict": lambda: {"changes": {"a": 0.1}},
    # polyhedra
    "AllOf": lambda: {"parts": of.X},
    "AnyOf": lambda: {"parts": of.X},
    "Polyhedron": lambda: {"manifold": of.M, "parts": {"left": of.X}},
    "stratum_at": lambda: {"polyhedron": of.square(), "q": ORIGIN},
    "polyhedra.nerve": lambda: {"polyhedron": of.square(), "height": of.Y},
    # functions and spaces
    "SmoothFunction": lambda: {
        "name": "f",
        "expression": of.X + of.STRETCH,
        "manifold": of.M,
        "parameters": {"a": 1.0},
    },
    "SmoothFunction.renamed": lambda: {"name": "g"},
    "SmoothFunction.member": lambda: {
        "family": of.energy().family,
        "name": "energy",
        "manifold": of.M,
        "parameters": [2.0],
    },
    "SmoothFunction.quantity": lambda: {"name": "f", "expression": of.X, "manifold": of.M},
    "SmoothFunction.sum": lambda: {"name": "f", "terms": [of.energy(), of.energy()]},
    "Family.of": lambda: {"expressions": {"f": of.X}, "variables": ("x", "y")},
    "Family.expression": lambda: {"name": "energy"},
    "Family.evaluate": lambda: {"points": np.zeros((2, 2)), "parameters": np.ones(1), "order": 1},
    "Symmetry.directions": lambda: ON | {"q": SQUARE},
    "Symmetry.displacement": lambda: ON | BETWEEN,
    "Symmetry.possible": lambda: ON | {"p": SQUARE, "points": SQUARE[None], "tolerance": 1e-6},
    "Symmetry.relabellings": lambda: ON | BETWEEN | {"tolerance": 1e-6},
    "Symmetry.separation": lambda: ON | BETWEEN,
    "Symmetry.separations": lambda: ON | {"p": SQUARE, "points": SQUARE[None]},
    "Solver.crowd": lambda: {"crowd_sweeps": 5},
    "Manifold.euclidean": lambda: {"names": "x y"},
    "Manifold.sphere": lambda: {"names": "u"},
    "Manifold.rotation": lambda: {"names": "a"},
    "Manifold.shift": lambda: Q | {"v": [0.1, 0.1]},
    # proofs
    "prove": lambda: {"certificate": of.certificate(), "digits": 8},
    "proofs.corners": lambda: {"polyhedron": of.square(), "box": of.UNIT},
    "proofs.stationary_points": lambda: {
        "polyhedron": of.square(),
        "energy": of.energy(),
        "box": of.UNIT,
    },
    "Proof.enclose": lambda: {"expression": of.X + of.Y},
    "CornerList.save": lambda: {"path": of.new("corners.zip")},
    "StationaryList.save": lambda: {"path": of.new("points.zip")},
    # skeletons
    "skeleton": lambda: {"polyhedron": of.square(), "starts": [[0.5, 0.5]]},
    "skeletons.examine_faces": lambda: {"skeleton": of.skeleton()},
    "skeletons.resume": lambda: {"skeleton": of.skeleton()},
    "skeletons.traced": lambda: {"skeleton": of.skeleton(), "edge": of.skeleton().edges[0]},
    # motion
    "velocities": lambda: {"manifold": of.M},
    "simulate": lambda: {"system": of.system(), "state": of.state(), "t_end": 0.01, "dt": 0.001},
    "motion.accelerations": lambda: {"system": of.system(), "state": of.state()},
    "motion.angular_velocity": lambda: {"manifold": polycorner.Manifold.rotation("a")},
    "motion.motions": lambda: {"manifold": of.M},
    "motion.pair_coordinates": lambda: {"manifold": of.M},
    "motion.pair_velocities": lambda: {"manifold": of.M},
    "motion.random_field": lambda: {
        "x": of.X,
        "y": of.Y,
        "rms": 0.1,
        "correlation_length": 1.0,
        "modes": 4,
    },
    "motion.random_signal": lambda: {
        "time": motion.time_symbol(),
        "rms": 0.1,
        "band": (1.0, 2.0),
        "modes": 4,
    },
    "motion.rotational_energy": lambda: {
        "manifold": polycorner.Manifold.rotation("a"),
        "inertia": [1.0, 1.0, 1.0],
    },
    "motion.step": lambda: {"system": of.system(), "state": of.state(), "dt": 0.001},
    "ConvexPolygon": lambda: {"vertices": [[-1, -1], [1, -1], [1, 1], [-1, 1]]},
    "Interval": lambda: {"lower": -0.3, "upper": 0.3},
    **{f"{kind}.contains": lambda: FORCE for kind in SETS},
    **{f"{kind}.covers": lambda: {"inner": motion.Disc(0.01)} for kind in SETS},
    **{f"{kind}.gauge": lambda: FORCE for kind in SETS},
    **{f"{kind}.project": lambda: FORCE for kind in SETS},
    **{f"{kind}.support": lambda: SLIP for kind in SETS},
    **{f"{kind}.within": lambda: {"other": motion.Disc(9.0)} for kind in SETS},
    **{f"Interval.{name}": lambda: {"p": [0.1]} for name in ("contains", "gauge", "project")},
    "Interval.support": lambda: {"s": [0.1]},
    "Interval.covers": lambda: {"inner": motion.Interval(0.1)},
    "Interval.within": lambda: {"other": motion.Interval(0.5)},
    "System.check_placement": lambda: {"q": np.array([[0.25, 0.5]])},
    "System.energies": lambda: {"state": of.state()},
    "System.largest_step": lambda: {"state": of.state()},
    "System.sticks": lambda: {"q": of.state().q, "v": of.state().v},
    "Trajectory.at": lambda: {"time": 0.005},
    "Trajectory.of_kind": lambda: {"kind": motion.EventKind.IMPACT},
    "Trajectory.stratum": lambda: {"index": 0},
    # bodies
    "bodies.box": lambda: {"low": [-1.0, -1.0], "high": [1.0, 1.0]},
    "bodies.capsule": lambda: {"start": [0.0, 0.0], "end": [1.0, 0.0], "radius": 0.5},
    "bodies.compound": lambda: {"bodies": [bodies.disc(1.0), bodies.disc(0.5)]},
    "bodies.disc": lambda: {"radius": 1.0},
    "bodies.mass_of": lambda: {"body": of.hexagon()},
    "bodies.polygon": lambda: {"vertices": [[0, 0], [1, 0], [0, 1]]},
    "bodies.polytope": lambda: {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]},
    "bodies.scaled": lambda: {"arrangement": of.arrangement()},
    "bodies.sphere": lambda: {"radius": 1.0},
    "bodies.thinned": lambda: {"arrangement": of.arrangement()},
    "Arrangement.placed": lambda: {"q": [0.0, 0.0, 3.0, 0.0]},
    "Arrangement.point": lambda: {"placed": {"a": [0.0, 0.0], "b": [3.0, 0.0]}},
    "Arrangement.velocity": lambda: {"q": [0.0, 0.0, 3.0, 0.0], "moving": {"a": [1.0, 0.0]}},
    "Body.same": lambda: {"other": of.hexagon()},
    # models
    "PeriodicPacking.bidisperse": lambda: {"count": 24},
    "PeriodicPacking.monodisperse": lambda: {"count": 64},
    "PeriodicPacking.density": lambda: {"inflation": 1.0},
    "PeriodicPacking.jam": lambda: {"start": 0, "max_programmes": 2},
    "PeriodicPacking.soft_start": lambda: {"iterations": 5},
    "Pinball.starts": lambda: {"rng": 0, "count": 2},
    "SphereCluster.contacts": lambda: {"q": of.tetrahedron()},
    "SphereCluster.distances": lambda: {"q": of.tetrahedron()},
    "TorusDisks.centres": lambda: {"q": of.critical()[0].point},
    "TorusDisks.critical": lambda: {"starts": 2},
    "TorusDisks.fewer": lambda: {"count": 1},
    "TorusDisks.radius": lambda: {"q": of.critical()[0].point},
    "TorusDisks.same": lambda: {"first": of.critical()[0], "second": of.critical()[0]},
    "TorusDisks.segment": lambda: {
        "q": of.critical()[0].point,
        "contact": of.critical()[0].contacts[0],
    },
    "TorusDisks.starts": lambda: {"rng": np.random.default_rng(0), "count": 2},
    "Tutorial.starts": lambda: {"rng": 0, "count": 2},
    # files
    "files.load_certificate": lambda: {"path": of.kept("certificate")},
    "files.load_graph": lambda: {"path": of.kept("graph")},
    "files.load_skeleton": lambda: {"path": of.kept("skeleton")},
    "files.load_trajectory": lambda: {"path": of.kept("trajectory"), "system": of.system()},
    "files.save_certificate": lambda: {"certificate": of.certificate(), "path": of.new("c.nc")},
    "files.save_graph": lambda: {"skeleton": of.skeleton(), "path": of.new("g.graphml")},
    "files.save_skeleton": lambda: {"skeleton": of.skeleton(), "path": of.new("s.nc")},
    "files.save_trajectory": lambda: {"trajectory": of.trajectory(), "path": of.new("t.nc")},
    "files.skeleton_graph": lambda: {"skeleton": of.skeleton()},
    # sweeps
    "Grid.of": lambda: {"grid": {"size": [1.0, 2.0]}},
    "Grid.point": lambda: {"number": 0},
    "SweepError": lambda: {"message": "it stopped"},
    "sweeps.open_results": lambda: {"path": of.stored()},
    "sweeps.read_study": lambda: {
        "path": of.study_file(),
        "named": {"area": VALUES["NamedStudy"]()},
    },
    "sweeps.sweep": lambda: {"function": of.study, "grid": {"size": [1.0, 2.0]}},
}

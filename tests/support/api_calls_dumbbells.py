"""One small valid call of what is public in dumbbells and pictures."""

import api_samples as of
import numpy as np
from landscape_values import double_well

from polycorner import dumbbells, pictures
from polycorner.dumbbells.dynamics.bunch import BunchRun


def placed():
    return of.pair().nested("R")


def of_pair():
    return {"q": placed()}


THETA = {"theta": 0.3}
BAND = {"phi": 0.1, "theta": 0.3}
DRIVEN = {"strength": 0.1, "scale": 1.0}


DUMBBELLS = {
    "DumbbellDrum.check_placement": lambda: {"q": np.array(of.PLACED)},
    "DumbbellDrum.largest_step": lambda: {"state": of.drum().state(of.PLACED)},
    "DumbbellDrum.placed": lambda: {"q": of.PLACED},
    "DumbbellDrum.state": lambda: {"q": of.PLACED},
    **{
        f"DumbbellPair.{name}": of_pair
        for name in (
            *("ball_centres", "canonical", "chirality", "developed", "heading", "mirror"),
            *("relative", "swap"),
        )
    },
    "DumbbellPair.half_turn": lambda: of_pair() | {"which": "A"},
    "DumbbellPair.end_to_end": dict,
    "DumbbellPair.nested": lambda: {"chirality": "R"},
    "DumbbellPair.placements": lambda: {"rng": np.random.default_rng(0), "count": 2},
    "DumbbellPair.section": dict,
    "DumbbellPair.side_by_side": dict,
    "Keel.turning": lambda: THETA,
    "MinimaMap.has": lambda: {"kind": of.minima_map().kinds[0]},
    "PairAtlas.kind": lambda: {"corner": of.atlas().skeleton.corners[0]},
    "PairLandscape.height": lambda: {"energy": (1.0, 2.0)},
    "RelativePlacements.energy_at": lambda: {"height": 0.1},
    "RelativePlacements.height": lambda: {"energy": 6.0},
    "RelativePlacements.placement": lambda: {"q": [20.0, 0.0, 0.1, 0.0]},
    "RestRegion.azimuths": lambda: THETA,
    "RestRegion.contains": lambda: BAND,
    "RestRegion.eastern_boundary": lambda: THETA,
    "RestRegion.margin": lambda: BAND,
    "RestRegion.rolls_back": lambda: THETA,
    "RigidDumbbells.lifts": lambda: {"q": of.lying().q},
    "RigidDumbbells.placements": lambda: {"q": of.lying().q},
    "RigidDumbbells.seen": lambda: {"q": of.lying().q},
    "RigidDumbbells.state": lambda: {"q": of.PLACED},
    "dumbbells.critical_length": lambda: {"pair": of.pair()},
    "dumbbells.critical_rod_radius": lambda: {"pair": of.pair()},
    "dumbbells.dyad_minima": lambda: {"pair": of.pair()},
    "dumbbells.heading_curve": lambda: {"pair": of.pair(), "lengths": [16.0, 20.0]},
    "dumbbells.heading_error_bar": lambda: {"pair": of.pair(), "tolerances": {"length": 0.1}},
    "dumbbells.long_rod_length": lambda: {"ball_radius": 3.0, "rod_radius": 1.5},
    "dumbbells.meeting_basins": lambda: {"pair": of.pair(), "starts": 2},
    "dumbbells.meetings": lambda: {"pair": of.pair(), "offsets": [0.0], "headings": [0.1]},
    "dumbbells.minima_map": lambda: {
        "curvatures": [1.95],
        "rods": [0.4, 0.5],
        "lengths": [4.0, 6.0],
        "starts": 2,
    },
    "dumbbells.pair_atlas": lambda: {"pair": of.pair(), "budget": 1},
    "dumbbells.pair_map": lambda: {"lengths": [4.0], "rods": [0.5]},
    "dumbbells.pair_minima": lambda: {"pair": of.pair(), "starts": 2},
    "dumbbells.pair_sensitivity": lambda: {"pair": of.pair()},
    "dumbbells.paper_heading": lambda: {"pair": of.pair()},
    "dumbbells.pair_landscape": lambda: {"pair": of.pair(), "max_seconds": 0.01},
    "dumbbells.plane_critical_formula": dict,
    # studies
    "studies.bunch": lambda: {"start": 0, "count": 2, "duration": 0.1},
    "studies.climbing": lambda: {
        "noise": 0.1,
        "tilt": 7.0,
        "rng": np.random.default_rng(0),
        "pairs": 1,
        "duration": 0.1,
    },
    "studies.driven": lambda: {
        "kind": "chatter",
        **DRIVEN,
        "rng": np.random.default_rng(0),
        "duration": 0.1,
    },
    "studies.heading": lambda: {"length": 16.0, "rod_radius": 1.5},
    "studies.turning": lambda: {
        "heading": 0.0,
        "kind": "chatter",
        **DRIVEN,
        "rng": np.random.default_rng(0),
        "duration": 0.1,
        "after": 0.0,
    },
    # pictures of dumbbells
    "DrumView": lambda: {"run": of.run()},
    "DrumView.show": dict,
    "dumbbells.pictures.atlas_scene": lambda: {"atlas": of.atlas(), "resolution": 16},
    "dumbbells.pictures.draw_atlas": lambda: {"atlas": of.atlas()},
    "dumbbells.pictures.draw_bifurcation": lambda: {"pair": of.pair()},
    "dumbbells.pictures.draw_climbing": lambda: {"zigzags": [], "drum": of.steady().drum},
    "dumbbells.pictures.draw_critical": lambda: {"ball_radius": 3.0},
    "dumbbells.placement_basins": lambda: {"pair": of.pair(), "starts": 2},
    "dumbbells.pictures.draw_drum": lambda: {"run": of.run()},
    "dumbbells.pictures.draw_exits": lambda: {"runs": {"a": BunchRun(of.run())}},
    "dumbbells.pictures.draw_heading": lambda: {
        "pair": of.pair(),
        "lengths": [12.0, 16.0],
        "rods": [1.0],
    },
    "dumbbells.pictures.draw_history": lambda: {"run": of.run()},
    "dumbbells.pictures.draw_keel": lambda: {"keel": of.keel()},
    "dumbbells.pictures.draw_kinds": lambda: {"found": of.minima_map()},
    "dumbbells.pictures.draw_meetings": lambda: {
        "pair": of.pair(),
        "found": dumbbells.meeting_basins(of.pair(), 2),
    },
    "dumbbells.pictures.draw_minima_map": lambda: {"found": of.minima_map()},
    "dumbbells.pictures.draw_motions": lambda: {"atlas": of.atlas()},
    "dumbbells.pictures.draw_pair": lambda: {"entry": of.dyad()},
    "dumbbells.pictures.draw_pair_map": lambda: {"found": of.pair_map()},
    "dumbbells.pictures.draw_steady_headings": lambda: {"found": [of.steady()]},
    "dumbbells.pictures.draw_study": lambda: {"study": "other", "found": of.study_results()},
    "dumbbells.pictures.draw_wells": lambda: {"comparison": of.comparison(), "pair": of.pair()},
    "dumbbells.pictures.drum_scene": lambda: {"drum": of.drum(), "q": of.PLACED},
    "dumbbells.pictures.forbidden_solid": lambda: {"pair": of.plane_pair(), "resolution": 16},
    "dumbbells.pictures.glb": lambda: {"scene": of.scene()},
    "dumbbells.pictures.pair_film": lambda: {"pair": of.pair(), "q": [placed()] * 2},
    "dumbbells.pictures.pair_scene": lambda: {"pair": of.pair(), "q": placed()},
    "dumbbells.pictures.relative_coordinates": lambda: {"pair": of.pair(), "q": placed()},
    "dumbbells.pictures.relative_corners": lambda: {"atlas": of.atlas(), "period": 6.28},
    "dumbbells.pictures.relative_curves": lambda: {"atlas": of.atlas(), "period": 6.28},
    "dumbbells.pictures.relative_placements": lambda: {
        "pair": of.plane_pair(),
        "points": [20.0, 0.0, 0.1],
    },
    "dumbbells.pictures.run_film": lambda: {"run": of.run()},
    "dumbbells.pictures.solid_facts": lambda: {"solid": of.solid(), "atlas": of.atlas()},
    "dumbbells.pictures.write_movie": lambda: {
        "run": of.run(),
        "path": of.new("movie.gif"),
        "frames": 1,
    },
    "dumbbells.pictures.draw_relative": lambda: {"model": dumbbells.RelativePlacements(of.pair())},
    "dumbbells.pictures.write_scene": lambda: {"scene": of.scene(), "path": of.new("scene.glb")},
    "dumbbells.pictures.write_solid": lambda: {
        "atlas": of.atlas(),
        "folder": of.folder(),
        "resolution": 16,
    },
    # viewer
    "viewer.atlas_page": lambda: {"atlas": of.atlas(), "resolution": 16},
    "viewer.bound": lambda: {"host": "127.0.0.1", "port": 0},
    "viewer.descent": lambda: {
        "polyhedron": of.square(),
        "energy": of.energy(),
        "start": [0.5, 0.5],
    },
    "viewer.film_page": lambda: {"film": of.film()},
    "viewer.live_application": lambda: {"pair": of.pair(), "host": "127.0.0.1"},
    "viewer.page_application": lambda: {"page": "<p>", "host": "127.0.0.1"},
    "viewer.write_page": lambda: {"page": "<p>", "path": of.new("page.html")},
    # pictures
    "pictures.components_of_complement": lambda: {"surface": of.isosurface()},
    "pictures.draw_arrangement": lambda: {
        "arrangement": of.arrangement(),
        "points": [[0.0, 0.0, 3.0, 0.0]],
    },
    "pictures.draw_barcode": lambda: {"nerve": of.nerve()},
    "pictures.draw_branches": lambda: {"diagram": of.diagram()},
    "pictures.draw_event_map": lambda: {"found": of.event_map()},
    "pictures.draw_cells": lambda: {"proof": of.cell()},
    "pictures.draw_clusters": lambda: {"model": of.spheres(), "points": [of.tetrahedron()]},
    "pictures.draw_critical": lambda: {"model": of.disks(), "configurations": of.critical()},
    "pictures.draw_landscape": lambda: {"landscape": double_well()},
    "pictures.draw_landscape_map": lambda: {
        "landscape": double_well(),
        "bounds": (-2.0, 2.0, -2.0, 2.0),
        "resolution": 20,
    },
    "pictures.draw_motion": lambda: {
        "model": of.spheres(),
        "polyline": [of.tetrahedron()] * 6,
        "frames": 2,
    },
    "pictures.draw_packing": lambda: {"packing": of.packing()},
    "pictures.draw_region": lambda: {
        "polyhedron": of.square(),
        "bounds": (-1.0, 2.0, -1.0, 2.0),
        "resolution": 20,
    },
    "pictures.draw_solid": lambda: {"mesh": of.isosurface().mesh},
    "pictures.film": lambda: {
        "arrangement": of.arrangement(),
        "motion": [[0.0, 0.0, 3.0, 0.0]],
        "size": 40,
    },
    "MotionFilm.save": lambda: {"path": of.new("film.gif")},
    "pictures.film_route": lambda: {
        "landscape": double_well(),
        "route": double_well().passes[0].sides[0].route,
        "path": of.new("route.gif"),
        "pictures": lambda axes, point: axes.plot(*point, "o"),
        "frames": 2,
    },
    "pictures.isosurface": lambda: {"function": of.ball, "bounds": of.AROUND, "resolution": 8},
    "pictures.place_solid": lambda: {
        "axes": of.axes(),
        "mesh": of.isosurface().mesh,
        "curves": [],
        "marks": [],
        "palette": {},
    },
    "pictures.save": lambda: {"figure": of.figure(), "path": of.new("figure.png")},
    "pictures.save_motion": lambda: {
        "arrangement": of.arrangement(),
        "motion": [[0.0, 0.0, 3.0, 0.0]],
        "path": of.new("motion.xyz"),
    },
    "pictures.sharp_surface": lambda: {"gaps": of.gaps, "bounds": of.AROUND, "resolution": 8},
    "pictures.skeleton_page": lambda: {"found": of.skeleton()},
    "pictures.visible": lambda: {
        "mesh": of.isosurface().mesh,
        "points": [[0.0, 0.0, 2.0]],
        "view": pictures.View(),
    },
    "pictures.write_mesh": lambda: {"mesh": of.isosurface().mesh, "path": of.new("mesh.ply")},
    "SharpSurface.corner_error": lambda: {"corners": [[0.0, 0.0, 0.0]]},
}

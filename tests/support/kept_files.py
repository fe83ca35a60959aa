"""Comparison of what was loaded with what was saved; files that someone changed."""

import numpy as np

from polycorner.motion import Event, EventKind, Trajectory
from polycorner.motion.engine.driver import Effort


def motion(system, bodies, coordinates, contact, *, instants=9, seed=0):
    """Return a trajectory of random numbers, which no motion has and any file keeps."""
    rng = np.random.default_rng(seed)

    def numbers(*shape):
        return rng.normal(size=(instants, *shape))

    return Trajectory(
        system=system,
        dt=1e-3,
        times=np.arange(instants) * 0.1,
        q=numbers(bodies, coordinates),
        v=numbers(bodies, coordinates),
        rests=numbers(bodies) > 0,
        present=numbers(bodies) > -1,
        touching=tuple((((0,), contact, float(x)),) if x > 0 else () for x in numbers()),
        kinetic=numbers(),
        potential=numbers(),
        dissipated={cause: numbers() for cause in ("impact", "sliding")},
        work={"force": numbers()},
        events=(
            Event(0.25, EventKind.IMPACT, (0,), contact, 1.5),
            Event(0.4, EventKind.REST, (0,), "", 0.0),
        ),
        max_penetration=1e-7,
        effort=Effort(*range(5), residual=1e-12),
        t_end=0.1 * (instants - 1),
    )


def same_certificate(one, other):
    """Check that two certificates say the same, to the last bit."""
    np.testing.assert_array_equal(one.point, other.point)
    assert one.verdict is other.verdict
    assert one.multipliers == other.multipliers
    assert one.signature == other.signature
    assert one.entrapment == other.entrapment
    assert one.residuals == other.residuals
    for name in ("tolerance", "rank_tolerance", "method", "iterations", "search"):
        assert getattr(one, name) == getattr(other, name)


def same_atlas(one, other):
    """Check that two atlases agree bit for bit."""
    assert one.complete is other.complete
    assert one.components == other.components
    assert one.notes == other.notes
    for left, right in zip(one.corners, other.corners, strict=True):
        np.testing.assert_array_equal(left.point, right.point)
        assert (left.stratum, left.edges) == (right.stratum, right.edges)
    for left, right in zip(one.edges, other.edges, strict=True):
        np.testing.assert_array_equal(left.polyline, right.polyline)
        assert (left.active, left.ends, left.kinds) == (right.active, right.ends, right.kinds)
        assert left.length == right.length
    assert one.faces == other.faces


def same_motion(one, other):
    """Check that two trajectories agree bit for bit in all that is recorded."""
    for name in ("times", "q", "v", "rests", "present", "kinetic", "potential"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), strict=True)
    for name in ("whole", "forces"):
        left, right = (getattr(some.friction, name) for some in (one, other))
        np.testing.assert_array_equal(left, right, strict=True)
    for name in ("dissipated", "work"):
        left, right = getattr(one, name), getattr(other, name)
        assert list(left) == list(right)
        for cause in left:
            np.testing.assert_array_equal(left[cause], right[cause], strict=True)
    for name in (
        "touching",
        "events",
        "effort",
        "dt",
        "max_penetration",
        "noise",
        "every",
        "t_end",
    ):
        assert getattr(one, name) == getattr(other, name)


def rewritten(kind, path, change):
    """Change the entries of a JSON file and give it the digest of the new content."""
    entries = kind.load_json(path)
    change(entries)
    kind.save_json(path, entries)


def same_graph(one, other):
    """Check that two graphs have the same nodes, edges and attributes."""
    assert one.graph.items() >= other.graph.items()
    assert dict(one.nodes(data=True)) == dict(other.nodes(data=True))
    assert sorted(map(repr, one.edges(data=True))) == sorted(map(repr, other.edges(data=True)))

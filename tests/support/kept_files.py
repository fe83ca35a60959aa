"""What was loaded is what was saved; and files changed by someone who makes the digest anew."""

import json

import numpy as np

from polycorner.files import container as sealed


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
        assert (left.length, left.branches) == (right.length, right.branches)
    assert one.faces == other.faces


def same_motion(one, other):
    """Check that two trajectories agree bit for bit in all that is recorded."""
    for name in ("times", "q", "v", "rests", "present", "kinetic", "potential"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), strict=True)
    for name in ("dissipated", "work"):
        left, right = getattr(one, name), getattr(other, name)
        assert list(left) == list(right)
        for cause in left:
            np.testing.assert_array_equal(left[cause], right[cause], strict=True)
    for name in ("touching", "events", "effort", "dt", "max_penetration"):
        assert getattr(one, name) == getattr(other, name)


def same_run(one, other):
    """Check that two runs in the drum agree bit for bit."""
    same_motion(one.trajectory, other.trajectory)
    for name in ("drum", "noise", "duration", "every", "steps_per_second"):
        assert getattr(one, name) == getattr(other, name)


def resealed(path, change):
    """Change the entries of a JSON file and give it the digest of what is then in it."""
    entries = json.loads(path.read_text())
    change(entries)
    entries[sealed.DIGEST] = sealed._digest(entries)
    path.write_text(json.dumps(entries))


def written(data, path):
    """Write a dataset as it is, with the digest of what is then in it."""
    path.write_bytes(sealed.sealed(bytes(data.to_netcdf(engine="h5netcdf"))))
    return path

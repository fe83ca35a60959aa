"""Curvatures that are the same beside a point as at it."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polycorner.minimisation.conditions import Curvature, Multipliers
from polycorner.minimisation.constancy import without
from polycorner.minimisation.findings import Local
from polycorner.spaces.manifold import Array

FAINT = 1e-3  # curvature, relative to the largest, up to which one is looked at
FARTHEST = 0.01  # scale units up to which Newton's step says how far a degenerate point may be


def steady(
    local: Local,
    active: tuple[int, ...],
    gradients: Array,
    multipliers: Multipliers,
    curvature: Curvature,
    nearly: float,
) -> Curvature:
    """Count as flat what bends up here and not as much a little further on.

    Near an inflection of any order the curvature is positive on one side, however small: a search
    ends beside it.  Looked at are the direction that bends most and those that bend much less, but
    more than ``nearly``, up to which all are flat.
    """
    values, vectors = curvature.values, curvature.vectors
    if not len(values) or values[-1] <= 0:
        return curvature
    tried = (values > nearly) & (values <= FAINT * values[-1])
    tried[-1] = True
    level = _changes(local, active, gradients, multipliers, curvature, tried)
    if not level.any():
        return curvature
    flat = without(np.hstack([curvature.flat, vectors[:, level]]), np.zeros((len(vectors), 0)))
    return replace(curvature, flat=flat)


def is_steady(
    local: Local,
    active: tuple[int, ...],
    gradients: Array,
    multipliers: Multipliers,
    curvature: Curvature,
    *,
    least: float,
) -> bool:
    """Whether the largest curvature and those beyond ``least`` are as much a little further on."""
    sizes = abs(curvature.values)
    if not sizes.any():
        return True
    tried = (sizes > least) | (sizes == sizes.max())
    return not _changes(local, active, gradients, multipliers, curvature, tried).any()


def _changes(
    local: Local,
    active: tuple[int, ...],
    gradients: Array,
    multipliers: Multipliers,
    curvature: Curvature,
    tried: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Return the mask of the directions tried in which the curvature changes beside the point.

    At the distance ``h`` from where curvature and slope vanish together as ``h^(p - 2)`` and
    ``h^(p - 1)``, Newton's step has the length ``h / (p - 1)``.
    """
    values, ways = curvature.values[tried], curvature.vectors[:, tried].T
    numbers = [*active, *local.sections]
    with np.errstate(all="ignore"):
        sizes = np.maximum(np.sqrt((gradients * gradients).sum(axis=1)), 1e-300)
        left = local.gradients[-1] - (multipliers.values / sizes) @ gradients
        newton = np.nan_to_num(abs(ways @ left) / abs(values))
        reach = local.tolerances.difference * (1 + abs(local.point / local.problem.scales).max())
        ahead = ways * np.clip(2 * newton, reach, max(reach, FARTHEST))[:, None]
        points = local.point + np.vstack([ahead, -ahead]) * local.problem.scales
        hessians = local.problem.evaluate(points, 2)[2]
        both = np.vstack([ways, ways])[:, :, None]
        bends = (both.transpose(0, 2, 1)[:, None] @ hessians @ both[:, None])[:, :, 0, 0]
        moved = bends[:, -1] - bends[:, numbers] @ (multipliers.values / sizes)
        changed = abs(moved.reshape(2, -1) - values) > 0.5 * abs(values)
    level = np.zeros(len(tried), dtype=np.bool_)
    level[tried] = changed.any(axis=0)
    return level

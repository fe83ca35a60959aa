"""Films of rigid dumbbells in the drum, for pages to play and to turn."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from polycorner.dumbbells.dynamics.bunch import BunchInSpaceRun
from polycorner.dumbbells.pictures.film import (
    FRAMES,
    LEFT,
    RIGHT,
    SINGLE,
    Film,
    Words,
    motion_film,
)
from polycorner.dumbbells.pictures.movies import chosen_frames
from polycorner.toolkit import Array


def film_in_space(
    run: BunchInSpaceRun, *, frames: int = FRAMES, title: str = "Rigid dumbbells in the drum"
) -> Film:
    """Return a motion of rigid dumbbells as a film of at most ``frames`` of its instants.

    Dumbbells have the colours of their dyads, as in
    :func:`~polycorner.dumbbells.pictures.film.run_film`; contacts are not drawn.
    """
    path, drum = run.trajectory, run.drum
    chosen = chosen_frames(len(path), frames)
    centres = ball_centres(run, chosen)
    dyads = [run.dyads(k) for k in chosen]
    hands = [[sum(hand == sign for *_, hand in found) for sign in (1, -1)] for found in dyads]
    film = motion_film(
        title,
        drum,
        path,
        chosen,
        centres,
        [_roles(found, drum.count) for found in dyads],
        [{} for _ in chosen],
        [Words("", f"{r} right-handed, {left} left-handed dyads") for r, left in hands],
    )
    energies = {
        "Kinetic energy in the drum's axes (nJ)": path.kinetic[chosen],
        "Energy of the weight (nJ)": run.weight_energy[chosen],
    }
    return replace(film, energies=energies)


def ball_centres(run: BunchInSpaceRun, chosen: list[int]) -> Array:
    """Return the centres of both balls at the ``T`` chosen instants, ``(T, N, 2, 3)``, in mm.

    The axis of the drum is ``y``, its lowest line at ``x = 0, z = -R``; balls of dumbbells that
    have left are NaN.
    """
    q = run.rigid.seen(run.trajectory.q[chosen], run.times[chosen, None])
    turns = Rotation.from_quat(q[..., 3:].reshape(-1, 4), scalar_first=True)
    rod = turns.apply([0.0, run.drum.length / 2, 0.0]).reshape(*q.shape[:-1], 3)
    centres = q[..., None, :3] + np.stack([-rod, rod], axis=-2)
    centres[~run.present[chosen]] = np.nan
    return np.asarray(centres)


def _roles(dyads: list[tuple[int, int, int]], count: int) -> list[int]:
    roles = [SINGLE] * count
    for i, j, hand in dyads:
        roles[i] = roles[j] = RIGHT if hand > 0 else LEFT
    return roles

"""Dumbbells in the turning drum moved by MuJoCo, to compare engines ([MuJoCo]).

MuJoCo comes with the extra ``bench``: ``pip install '.[bench]'``.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from mjcf import DrumScene, mjcf
from numpy.typing import ArrayLike

from polycorner import checks
from polycorner.spaces.manifold import Array

AXIS, UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class MujocoDrum:
    """A scene in motion: MuJoCo's model and data, placements in the library's coordinates.

    Placements are rows ``(phi, eta, theta, psi)``, in the plane ``(x, y, theta, psi)``.  ``psi``
    is the angle of the dumbbell about its own axis, from the drum's inward normal; it grows when
    the dumbbell rolls towards ``u_r = (-cos theta, sin theta)``.

    The dumbbells first lie in the scene's
    :meth:`~mjcf.DrumScene.rows`.

    Raises
    ------
    ImportError
        When first used, if MuJoCo is missing.
    """

    scene: DrumScene

    @cached_property
    def model(self) -> Any:
        """The ``mujoco.MjModel``."""
        return load_mujoco().MjModel.from_xml_string(mjcf(self.scene))

    @cached_property
    def data(self) -> Any:
        """The ``mujoco.MjData``: time, positions, velocities and contacts now."""
        data = load_mujoco().MjData(self.model)
        _place(self.scene, data, self.scene.rows())
        return data

    def step(self, count: int = 1) -> None:
        """Advance by ``count`` time steps."""
        load_mujoco().mj_step(self.model, self.data, count)

    def placements(self) -> Array:
        """Return the placements of the dumbbells, ``(count, 4)``; angles lie in ``[-pi, pi]``."""
        load_mujoco().mj_kinematics(self.model, self.data)  # poses are otherwise a step behind
        middle = self.data.xpos[-self.scene.count :]
        turns = self.data.xmat[-self.scene.count :].reshape(-1, 3, 3)
        plane = self.scene.pair.is_plane
        phi = np.zeros(len(middle)) if plane else np.arctan2(middle[:, 0], -middle[:, 2])
        lateral, normal = _directions(phi)
        axis, mark = turns[:, :, 1], turns[:, :, 2]
        theta = np.arctan2(_dot(axis, lateral), axis[:, 1])
        psi = _angle_about(axis, mark, normal)
        return np.stack([middle[:, 0] if plane else phi, middle[:, 1], theta, psi], axis=-1)

    def set_placements(self, placements: ArrayLike) -> None:
        """Place the dumbbells at rest on the drum, which turns at full speed.

        Parameters
        ----------
        placements : (count, 3) or (count, 4) array_like
            ``phi, eta, theta`` and, unless it is to be 0, ``psi``.

        Raises
        ------
        ValueError
            If the shape does not fit.
        """
        rows = np.asarray(placements, dtype=float)
        count = self.scene.count
        if rows.shape not in ((count, 3), (count, 4)):
            msg = f"placements: expected shape ({count}, 3) or ({count}, 4); got {rows.shape}"
            raise ValueError(msg)
        _place(self.scene, self.data, rows)


def _place(scene: DrumScene, data: Any, rows: Array) -> None:
    """Write placements, and the velocities of turning with the drum, into MuJoCo's data."""
    psi = rows[:, 3:] if rows.shape[1] > 3 else np.zeros((len(rows), 1))
    sine, cosine = np.sin(rows[:, 2:3]), np.cos(rows[:, 2:3])
    plane = scene.pair.is_plane
    lateral, normal = _directions(np.zeros(len(rows)) if plane else rows[:, 0])
    axis = sine * lateral + cosine * AXIS
    mark = np.cos(psi) * normal - np.sin(psi) * np.cross(axis, normal)
    turns = np.stack([np.cross(axis, mark), axis, mark], axis=-1)
    if plane:
        foot = rows[:, :1] * lateral + scene.ball_radius * normal
    else:
        foot = -np.sqrt(scene.pair.centre_radius**2 - (scene.length * sine / 2) ** 2) * normal
    middle = foot + rows[:, 1:2] * AXIS
    spin = np.zeros(3) if plane else -scene.spin * AXIS
    angles, rates = (_as_free if scene.rolling == "cone" else _as_joints)(turns, spin)
    positions = np.hstack([middle, angles]).ravel()
    velocities = np.hstack([np.cross(spin, middle), rates]).ravel()
    data.qvel[:] = scene.spin
    data.qpos[-len(positions) :], data.qvel[-len(velocities) :] = positions, velocities


def _as_free(turns: Array, spin: Array) -> tuple[Array, Array]:
    """Return quaternions ``(w, x, y, z)``, and angular velocities in the bodies' own frames."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(turns).as_quat(), 1, axis=-1), spin @ turns


def _as_joints(turns: Array, spin: Array) -> tuple[Array, Array]:
    """Return the angles of the hinges about z, x and the own axis, and their rates."""
    axis = turns[:, :, 1]
    up = np.broadcast_to(UP, axis.shape)
    yaw, pitch = -np.arctan2(axis[:, 0], axis[:, 1]), np.arcsin(axis[:, 2])
    level = np.stack([np.cos(yaw), np.sin(yaw), np.zeros(len(axis))], axis=-1)
    hinges = np.stack([up, level, axis], axis=-1)
    rates = np.linalg.solve(hinges, np.broadcast_to(spin[:, None], (len(axis), 3, 1)))
    own = _angle_about(axis, up, turns[:, :, 2])
    return np.stack([yaw, pitch, own], axis=-1), rates[:, :, 0]


def _directions(phi: Array) -> tuple[Array, Array]:
    """Return the unit vectors of growing azimuth and the inward normals, ``(n, 3)`` each."""
    sine, cosine, zero = np.sin(phi), np.cos(phi), np.zeros_like(phi)
    return np.stack([cosine, zero, sine], axis=-1), np.stack([-sine, zero, cosine], axis=-1)


def _angle_about(axis: Array, start: Array, end: Array) -> Array:
    """Return the angles about ``axis`` from ``start`` to ``end``, seen along ``axis``."""
    across = start - axis * _dot(axis, start)[:, None]
    angle: Array = np.arctan2(_dot(np.cross(axis, start), end), _dot(across, end))
    return angle


def _dot(u: Array, v: Array) -> Array:
    product: Array = (u * v).sum(axis=-1)
    return product


def load_mujoco() -> Any:
    """Return MuJoCo's module, or raise ImportError naming the extra."""
    try:
        import mujoco
    except ImportError as exc:
        missing = checks.missing_extra("MuJoCo", "bench")
        raise missing from exc
    return mujoco

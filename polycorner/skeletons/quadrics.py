"""Common zeros of ``k - 1`` quadratic forms of ``k`` variables, ``k`` at most 3.

On the projective line a form has two zeros, none, or a double one where it is semidefinite.  Two
conics that do not touch meet in up to four points.  Three conics of their pencil are degenerate;
where real points are common to all of it, one of these three consists of two real lines, and the
points are the zeros of another conic on them.
"""

import math

import numpy as np

from polycorner.polyhedra.cones import null_space
from polycorner.spaces.manifold import Array

# Members of the pencil of two conics, of which the least degenerate one is taken.
ANGLES = (0.3, 1.1, 1.9, 2.7)


def common_zeros(forms: Array, limit: float) -> list[Array] | None:
    """Return the common zeros of quadratic forms, up to their signs.

    Parameters
    ----------
    forms : (k - 1, k, k) array
        Symmetric matrices, of the order of 1.
    limit : float
        Size of a form or of its eigenvalues, and distance of roots, that count as zero.

    Returns
    -------
    list of (k,) arrays, or None
        Unit vectors; None if a zero is not isolated or not simple, or ``k`` above 3.
    """
    k = forms.shape[-1]
    if k > 3:
        return None
    if k == 1:
        return [np.ones(1)]
    return _on_line(forms[0], limit) if k == 2 else _of_conics(forms[0], forms[1], limit)


def _on_line(form: Array, limit: float) -> list[Array] | None:
    values, axes = np.linalg.eigh(form)
    if abs(values).min() <= limit:
        return None
    if values[0] * values[1] > 0:
        return []
    low, high = math.sqrt(-values[0]), math.sqrt(values[1])
    lines = [high * axes[:, 0] + sign * low * axes[:, 1] for sign in (1, -1)]
    return [line / np.linalg.norm(line) for line in lines]


def _of_conics(first: Array, second: Array, limit: float) -> list[Array] | None:
    pencil = [
        (math.cos(a) * first + math.sin(a) * second, math.cos(a) * second - math.sin(a) * first)
        for a in ANGLES
    ]
    regular, other = max(pencil, key=lambda both: abs(np.linalg.det(both[0])))
    if abs(np.linalg.det(regular)) <= limit:
        return None
    roots = np.linalg.eigvals(-np.linalg.solve(regular, other))
    apart = abs(roots[:, None] - roots[None]) + np.eye(3)
    if apart.min() <= limit * max(1.0, abs(roots).max()):
        return None
    found = []
    real = [x.real for x in roots if abs(x.imag) <= limit]
    for line in _lines([other + x * regular for x in real], limit):
        zeros = _on_line(line.T @ regular @ line, limit)
        if zeros is None:
            return None
        found += [line @ zero for zero in zeros]
    return found


def _lines(conics: list[Array], limit: float) -> list[Array]:
    """Return the lines, as planes ``(3, 2)``, of the clearest of the conics that has real ones."""
    clearest, found = limit, []
    for conic in conics:
        values, axes = np.linalg.eigh(conic)
        if min(-values[0], values[2]) > clearest:
            clearest = min(-values[0], values[2])
            normals = (
                math.sqrt(values[2]) * axes[:, 2] + sign * math.sqrt(-values[0]) * axes[:, 0]
                for sign in (1, -1)
            )
            found = [null_space(normal[None], limit) for normal in normals]
    return found

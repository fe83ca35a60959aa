"""Sets of admissible friction forces: membership, projection and barrier."""

import numpy as np

from polycorner.motion.engine.jit import compiled

INTERVAL, DISC, ELLIPSE, CUT_DISC, POLYGON = 0, 1, 2, 3, 4  # as in ConvexSet.code


@compiled
def contains(model, shape, x, y, load, slack):
    """Return whether ``(x, y)`` lies in ``load`` times a set, up to a relative slack."""
    kind = model.set_kinds[shape]
    a, b = model.set_sizes[shape, 0], model.set_sizes[shape, 1]
    # Relative to the load, so that the same slack does for all sets.
    top = load * (1.0 + slack)
    if kind == INTERVAL:
        return a * top <= x <= b * top
    if kind == DISC:
        return x * x + y * y <= (a * top) ** 2
    if kind == ELLIPSE:
        return (x / a) ** 2 + (y / b) ** 2 <= top * top
    if kind == CUT_DISC:
        return x * x + y * y <= (a * top) ** 2 and abs(x) <= b * top
    first, last = model.first_vertex[shape], model.first_vertex[shape + 1]
    for i in range(first, last):
        j = i + 1 if i + 1 < last else first
        ax, ay = model.vertices[i, 0], model.vertices[i, 1]
        ex, ey = model.vertices[j, 0] - ax, model.vertices[j, 1] - ay
        if ex * (y - ay * top) - ey * (x - ax * top) < 0.0:
            return False
    return True


@compiled
def project(model, shape, x, y, load, out):
    """Project ``(x, y)`` onto ``load`` times a set; out: the point and its derivative by rows."""
    kind = model.set_kinds[shape]
    a, b = model.set_sizes[shape, 0], model.set_sizes[shape, 1]
    out[0], out[1], out[2], out[3], out[4], out[5] = x, y, 1.0, 0.0, 0.0, 1.0
    # Without load friction is zero, whatever it is told.
    if load <= 0.0:
        for a in range(6):
            out[a] = 0.0
        return
    if contains(model, shape, x, y, load, 0.0):
        return
    if kind == INTERVAL:
        out[0], out[1] = min(max(x, a * load), b * load), 0.0
        out[2], out[5] = 0.0, 0.0
    elif kind == DISC:
        project_disc(x, y, a * load, out)
    elif kind == ELLIPSE:
        project_ellipse(x, y, a * load, b * load, out)
    elif kind == CUT_DISC:
        width, radius = b * load, a * load
        xc = min(max(x, -width), width)
        if xc * xc + y * y <= radius * radius:
            out[0], out[1] = xc, y
            out[2] = 0.0
            return
        project_disc(x, y, radius, out)
        if abs(out[0]) > width:
            high = np.sqrt(max(0.0, radius * radius - width * width))
            out[0] = width if x > 0.0 else -width
            out[1] = high if y > 0.0 else -high
            out[2], out[3], out[4], out[5] = 0.0, 0.0, 0.0, 0.0
    else:
        project_polygon(model, shape, x, y, load, out)


@compiled
def project_disc(x, y, radius, out):
    """Project a point outside a disc onto it."""
    inverse = 1.0 / np.sqrt(x * x + y * y)
    ux, uy, f = x * inverse, y * inverse, radius * inverse
    out[0], out[1] = radius * ux, radius * uy
    out[2], out[3] = f * uy * uy, -f * ux * uy
    out[4], out[5] = out[3], f * ux * ux


@compiled
def project_ellipse(x, y, a, b, out):
    """Project a point outside an ellipse onto it, by Newton's method for the multiplier ``t``.

    The point is ``(a^2 x / (a^2 + t), b^2 y / (b^2 + t))``, where ``t > 0`` is the root of a convex
    decreasing function; started at zero, the iterates increase to it.
    """
    aa, bb = a * a, b * b
    t = 0.0
    for _ in range(60):
        fx, fy = a * x / (t + aa), b * y / (t + bb)
        value = fx * fx + fy * fy - 1.0
        slope = -2.0 * (fx * fx / (t + aa) + fy * fy / (t + bb))
        change = -value / slope
        t += change
        if abs(change) <= 1e-15 * (t + min(aa, bb)):
            break
    sx, sy = aa / (t + aa), bb / (t + bb)
    out[0], out[1] = sx * x, sy * y
    fx, fy = a * x / (t + aa), b * y / (t + bb)
    slope = -2.0 * (fx * fx / (t + aa) + fy * fy / (t + bb))
    tx = -2.0 * fx * a / (t + aa) / slope
    ty = -2.0 * fy * b / (t + bb) / slope
    gx, gy = -sx * x / (t + aa), -sy * y / (t + bb)
    out[2], out[3] = sx + gx * tx, gx * ty
    out[4], out[5] = gy * tx, sy + gy * ty


@compiled
def project_polygon(model, shape, x, y, load, out):
    """Project a point outside a polygon onto its nearest edge or vertex."""
    best = np.inf
    first, last = model.first_vertex[shape], model.first_vertex[shape + 1]
    for i in range(first, last):
        j = i + 1 if i + 1 < last else first
        ax, ay = load * model.vertices[i, 0], load * model.vertices[i, 1]
        ex, ey = load * model.vertices[j, 0] - ax, load * model.vertices[j, 1] - ay
        along = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)
        cut = min(max(along, 0.0), 1.0)
        px, py = ax + cut * ex, ay + cut * ey
        far = (x - px) ** 2 + (y - py) ** 2
        if far < best:
            best = far
            out[0], out[1] = px, py
            out[2], out[3], out[4], out[5] = 0.0, 0.0, 0.0, 0.0
            if 0.0 < along < 1.0:
                square = ex * ex + ey * ey
                out[2], out[3] = ex * ex / square, ex * ey / square
                out[4], out[5] = out[3], ey * ey / square


@compiled
def add_linear_barrier(c0, c1, c2, load, x, y, out):
    """Add the barrier ``-log(c0 load + c1 x + c2 y)`` to a gradient and a Hessian."""
    f = 1.0 / (c0 * load + c1 * x + c2 * y)
    c0, c1, c2 = c0 * f, c1 * f, c2 * f
    out[0], out[1], out[2] = out[0] - c0, out[1] - c1, out[2] - c2
    out[3], out[4], out[5] = out[3] + c0 * c0, out[4] + c0 * c1, out[5] + c0 * c2
    out[6], out[7], out[8] = out[6] + c1 * c1, out[7] + c1 * c2, out[8] + c2 * c2


@compiled
def add_quadratic_barrier(a, b, load, x, y, out):
    """Add the barrier ``-log(load^2 - (x / a)^2 - (y / b)^2)`` to a gradient and a Hessian."""
    e, f = 1.0 / (a * a), 1.0 / (b * b)
    g = 2.0 / (load * load - e * x * x - f * y * y)
    c0, c1, c2 = -g * load, g * e * x, g * f * y
    out[0], out[1], out[2] = out[0] + c0, out[1] + c1, out[2] + c2
    out[3], out[4], out[5] = out[3] + c0 * c0 - g, out[4] + c0 * c1, out[5] + c0 * c2
    out[6], out[7], out[8] = out[6] + c1 * c1 + g * e, out[7] + c1 * c2, out[8] + c2 * c2 + g * f


@compiled
def barrier(model, shape, load, x, y, out):
    """Differentiate the logarithmic barrier of the cone over a set, in load, x and y.

    out: the gradient, then the upper triangle of the Hessian, row by row.
    """
    for a in range(9):
        out[a] = 0.0
    kind = model.set_kinds[shape]
    a, b = model.set_sizes[shape, 0], model.set_sizes[shape, 1]
    if kind == INTERVAL:
        add_linear_barrier(-a, 1.0, 0.0, load, x, y, out)
        add_linear_barrier(b, -1.0, 0.0, load, x, y, out)
        # Nothing acts across an interval: the one keeps the Hessian definite, with zero gradient
        # there.
        out[8] = 1.0
    elif kind == DISC:
        add_quadratic_barrier(a, a, load, x, y, out)
    elif kind == ELLIPSE:
        add_quadratic_barrier(a, b, load, x, y, out)
    elif kind == CUT_DISC:
        add_quadratic_barrier(a, a, load, x, y, out)
        add_linear_barrier(b, 1.0, 0.0, load, x, y, out)
        add_linear_barrier(b, -1.0, 0.0, load, x, y, out)
    else:
        first, last = model.first_vertex[shape], model.first_vertex[shape + 1]
        for i in range(first, last):
            j = i + 1 if i + 1 < last else first
            ax, ay = model.vertices[i, 0], model.vertices[i, 1]
            ex, ey = model.vertices[j, 0] - ax, model.vertices[j, 1] - ay
            add_linear_barrier(ey * ax - ex * ay, -ey, ex, load, x, y, out)

"""A union of two half-planes: its corner is locally concave and splits what falls on it.

Outside the quadrant ``x < 0, y < 0`` the energy ``(x + 1)^2 + (y + 2)^2`` has two minima, one on
each side of the corner.  At the corner itself each side shows a way down, so it is no minimum,
and a descent ends on the side that is lower from where it came.
"""

from polycorner import AnyOf, Certificate, Manifold, Polyhedron, certify, minimise


def main() -> tuple[Certificate, Certificate]:
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    outside = Polyhedron(M, AnyOf(x, y))
    energy = (x + 1) ** 2 + (y + 2) ** 2
    return minimise(outside, energy, [2.0, 0.5]), certify(outside, energy, [0.0, 0.0])


if __name__ == "__main__":
    for certificate in main():
        print(certificate, end="\n\n")

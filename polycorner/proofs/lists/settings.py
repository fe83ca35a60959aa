"""The unchanging part of a search: problem, domain, symmetries, and their evaluators."""

from dataclasses import dataclass, field

import numpy as np

from polycorner.intervals.boxes import BoxFunctions
from polycorner.intervals.enclosures import Formulas
from polycorner.minimisation.problem import Problem
from polycorner.proofs.lists.acceptance import Faces
from polycorner.proofs.lists.branches import Mask, conjunctions
from polycorner.proofs.lists.domains import Domain
from polycorner.proofs.lists.images import Motion, weights
from polycorner.proofs.lists.loci import read_coordinates
from polycorner.proofs.lists.vertices import Vertices
from polycorner.spaces.manifold import Array


@dataclass
class Setting:
    """What does not change during a search.

    Attributes
    ----------
    problem : Problem
    domain : Domain
    resolution : float
        Largest side, in scale units, of boxes that are not bisected.
    motions : tuple of Motion
        Symmetries.
    maps : tuple of tuple of int
        Where they take inequalities.
    minima_only : bool
        Whether only local minima are searched.
    functions : BoxFunctions
        Inequalities, equations, energy.
    faces : Faces
    vertices : Vertices
    conj : (c, m) array of bool
        The set as a union of intersections.
    reads : tuple of int
        Free coordinates that the energy depends on.
    weights : (n,) array
        Of orbits, points with the largest ``weights . q`` are searched.
    """

    problem: Problem
    domain: Domain
    resolution: float
    motions: tuple[Motion, ...] = ()
    maps: tuple[tuple[int, ...], ...] = ()
    minima_only: bool = False
    functions: BoxFunctions = field(init=False)
    faces: Faces = field(init=False)
    vertices: Vertices = field(init=False)
    conj: Mask = field(init=False)
    reads: tuple[int, ...] = field(init=False)
    weights: Array = field(init=False)

    def __post_init__(self) -> None:
        manifold = self.problem.polyhedron.manifold
        self.functions = BoxFunctions(self.problem.functions, manifold)
        formulas = Formulas(self.problem.functions, manifold)
        free = self.domain.free
        held = self.domain.held
        self.faces = Faces(formulas, self.problem.inequalities, free, self.problem.scales, held)
        vertices = formulas, self.problem.inequalities, self.equations, free, self.problem.scales
        self.vertices = Vertices(*vertices)
        self.conj = conjunctions(self.problem.polyhedron)
        self.reads = read_coordinates(formulas, free)
        self.weights = weights(self.domain)

    @property
    def branches(self) -> tuple[tuple[int, ...], ...]:
        """The set as a union of intersections: the functions of each."""
        return tuple(tuple(np.flatnonzero(branch).tolist()) for branch in self.conj)

    @property
    def equations(self) -> int:
        """The number of equations."""
        return self.problem.rows - 1 - self.problem.inequalities

    @property
    def may_have_loci(self) -> bool:
        """Whether the energy does not depend on some free coordinate."""
        return self.reads != self.domain.free

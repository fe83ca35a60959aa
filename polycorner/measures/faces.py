"""Two-dimensional faces by chains that move between them and the edges, whose weights are known."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from polycorner import checks
from polycorner.kinds import checked
from polycorner.measures.estimates import Estimate, ratio_of_means
from polycorner.measures.sampling import STEPS, SampleOptions, StrataSample, sample
from polycorner.measures.strata import StrataMeasures, skeleton_quotient
from polycorner.printing import Printed, Sheet, listed, names, number
from polycorner.progress import Progress, silent
from polycorner.values import Checked

PILOT = 20  # part of the points with which the stickiness of the chain is chosen


@dataclass(frozen=True, eq=False)
class FaceWeights(Checked, Printed):
    """What the two-dimensional faces of a skeleton weigh, without stickiness.

    Attributes
    ----------
    total : Estimate
        All of them together.
    by_contacts : mapping from tuple of str to Estimate
        Faces with the same contacts, up to the finite group; empty where neither its elements nor
        :attr:`Symmetry.canonical <polycorner.Symmetry>` are given.
    by_face : tuple of Estimate or None
        Of every face of the skeleton; None where others have the same contacts, and where it was
        not met.
    """

    total: Estimate
    by_contacts: Mapping[tuple[str, ...], Estimate]
    by_face: tuple[Estimate | None, ...] = ()

    def __repr__(self) -> str:
        """Return the sum."""
        return f"FaceWeights({self.total})"

    def _sheet(self) -> Sheet:
        found = sorted(self.by_contacts.items(), key=lambda item: -item[1].value)
        rows = ((names(some) or "-", number(e.value, 6), f"{e.error:.1g}") for some, e in found)
        table = listed("Faces", ("contacts", "weight", "error"), rows, len(found), (1, 2))
        return Sheet(f"All faces weigh {self.total}", (table,) if found else ())


@checked
def face_weights(
    measures: StrataMeasures,
    *,
    points: int = 10_000,
    rng: np.random.Generator | int | None = None,
    options: SampleOptions = STEPS,
    executor: Any = None,
    progress: Progress = silent,
) -> FaceWeights:
    """Weigh the faces beside the edges of a skeleton, by Monte Carlo.

    Chains begin on four edges and move on edges and faces; shares of faces over that of edges,
    times the weight of the edges, are the weights.  Their stickiness is chosen by a
    pilot so that edges and faces are met as often.  Faces have to be bounded: of discs in the
    plane some have one disc less in contact, which is then anywhere.

    Parameters
    ----------
    measures : StrataMeasures
        All of whose edges have a weight.
    points : int, optional
        Points of every chain.
    rng : Generator or int, optional
        Random numbers, or a seed.
    options : SampleOptions, optional
        Steps of the chains.
    executor, progress : optional
        As for :func:`sample`.

    Raises
    ------
    TypeError, ValueError
        Where edges were declined or not weighed, or their numbers of contacts differ.

    Examples
    --------
    >>> from polycorner import Manifold, Polyhedron, skeleton
    >>> from polycorner.measures import Weighting, measure
    >>> M = Manifold.euclidean("x y")
    >>> x, y = M.symbols
    >>> atlas = skeleton(Polyhedron(M, {"parabola": y - x**2, "lid": 2 - y}), [[0.0, 1.0]])
    >>> found = face_weights(measure(atlas, weighting=Weighting(gradients=False)), rng=1)
    >>> abs(found.total.value - 8 * 2**0.5 / 3) < 4 * found.total.error
    True
    """
    checks.whole("points", points, least=PILOT, most=checks.MOST)
    edges, generator = measures.skeleton.edges, checks.generator("rng", rng)
    counts = {len(edge.active) for edge in edges}
    if np.isnan(measures.edges).any() or len(counts) != 1:
        expected = "edges with weights, of one number of contacts"
        checks.refuse("measures", expected, measures)
    (count,) = counts
    if not count:
        checks.refuse("measures", "edges with contacts", measures)
    chosen = np.linspace(0, len(edges) - 1, 4).round().astype(int)
    starts = np.array([edges[k].polyline[len(edges[k].polyline) // 2] for k in chosen])

    def sampled(stickiness: float, length: int, told: Progress) -> StrataSample:
        return sample(
            measures.skeleton.polyhedron, starts, length, contacts=(count - 1, count),
            weighting=replace(measures.weighting, stickiness=stickiness), rng=generator,
            options=options, executor=executor, progress=told,
        )  # fmt: skip

    balanced = sampled(1.0, points // PILOT, silent).ratio(count - 1, count).value or 1.0
    found = sampled(balanced, points, progress)
    known = float(measures.edges.sum())
    on_edges = found.contacts == count

    def weight(strata: list[int]) -> Estimate:
        e = ratio_of_means(np.isin(found.positions, strata), on_edges)
        return Estimate(e.value * balanced * known, e.error * balanced * known, e.effective)

    faces = [k for k, some in enumerate(found.strata) if len(some) < count]
    told = skeleton_quotient(measures.skeleton).symmetry.representative
    groups: dict[tuple[str, ...], list[int]] = {}
    for k in faces:
        contacts = told(found.strata[k])
        if contacts is not None:
            groups.setdefault(contacts, []).append(k)
    by_contacts = {some: weight(strata) for some, strata in groups.items()}
    kinds = [told(face.active) for face in measures.skeleton.faces]
    by_face = [
        by_contacts.get(kind) if kind is not None and kinds.count(kind) == 1 else None
        for kind in kinds
    ]
    return FaceWeights(weight(faces), by_contacts, tuple(by_face))

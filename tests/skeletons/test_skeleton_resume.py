"""A skeleton that ran out of budget or was interrupted goes on to the same end."""

import numpy as np
import pytest
import sympy as sp
from skeleton_shapes import ball, counts, identical, isomorphic, polytope, space

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, skeleton
from polycorner.polyhedra import quotients
from polycorner.skeletons import Budget, Completeness, resume

PLANE, SPACE = Manifold.euclidean("x y"), Manifold.euclidean("x y z")
x, y, z = SPACE.symbols
TRIANGLE = polytope([[-1, 0], [0, -1], [1, 1]], [0, 0, 1])
CUBE = polytope(np.vstack([np.eye(3), -np.eye(3)]), np.ones(6))
START = ((0.1, 0.2, 0.3),)


class Interrupter:
    """Raises ``KeyboardInterrupt`` at a given call."""

    def __init__(self, when):
        self.left = when

    def __call__(self, *_):
        self.left -= 1
        if self.left == 0:
            raise KeyboardInterrupt


def interrupted_evaluation(monkeypatch, when, *arguments, **options):
    """Return a skeleton that was interrupted in the middle of a given evaluation, and the count."""
    alarm, evaluated = Interrupter(when), quotients.evaluated

    def wrapped(polyhedron, q):
        alarm()
        return evaluated(polyhedron, q)

    with monkeypatch.context() as patch:
        patch.setattr(quotients, "evaluated", wrapped)
        try:
            return skeleton(*arguments, **options), when - alarm.left
        except KeyboardInterrupt:
            pytest.fail(f"the interruption at evaluation {when} lost what was found")


@pytest.fixture(scope="module")
def whole():
    return skeleton(CUBE, START)


class TestResume:
    @pytest.mark.parametrize("budget", [1, 2, 5, 8, 11])
    def test_a_skeleton_that_ran_out_of_budget_goes_on_to_the_same_end(self, whole, budget):
        part = skeleton(CUBE, START, budget=budget)
        assert part.complete is Completeness.BUDGET
        assert len(part.edges) == budget
        assert part.euler_characteristic is None
        corners, edges = part.corners, part.edges
        assert identical(resume(part), whole)
        assert (part.corners, part.edges) == (corners, edges)
        assert part.complete is Completeness.BUDGET

    def test_it_may_go_on_one_edge_at_a_time(self, whole):
        atlas = skeleton(CUBE, START, budget=1)
        for count in range(2, 12):
            atlas = resume(atlas, budget=1)
            assert len(atlas.edges) == count
        assert identical(resume(atlas), whole)

    def test_a_skeleton_may_be_taken_up_twice(self, whole):
        part = skeleton(CUBE, START, budget=4)
        first, second = resume(part), resume(part)
        assert identical(first, whole)
        assert identical(second, whole)

    def test_a_finished_skeleton_stays_as_it_is(self, whole):
        assert identical(resume(whole), whole)

    @pytest.mark.parametrize("when", [1, 2, 5, 9, 14, 20, 28])
    def test_an_interruption_loses_nothing(self, whole, when):
        part = skeleton(CUBE, START, progress=Interrupter(when))
        assert part.complete is Completeness.INTERRUPTED
        again = resume(part)
        assert again.complete is Completeness.EXHAUSTED
        assert isomorphic(again, whole)

    def test_an_interruption_in_the_middle_of_a_walk_loses_nothing(self, whole, monkeypatch):
        _, total = interrupted_evaluation(monkeypatch, 10**9, CUBE, START)
        for when in np.linspace(1, total - 1, 8).astype(int):
            part, _ = interrupted_evaluation(monkeypatch, when, CUBE, START)
            assert part.complete is Completeness.INTERRUPTED
            assert isomorphic(resume(part), whole)

    def test_closed_edges_and_faces_survive_an_interruption(self, monkeypatch):
        D = Polyhedron(
            space(2), AllOf(ball((0, 0), 1, "rim"), ball((0, 0), 0.5, "hole", inside=False))
        )
        whole = skeleton(D, [[0.7, 0]])
        _, total = interrupted_evaluation(monkeypatch, 10**9, D, [[0.7, 0]])
        for when in np.linspace(1, total - 1, 6).astype(int):
            part, _ = interrupted_evaluation(monkeypatch, when, D, [[0.7, 0]])
            assert part.complete is Completeness.INTERRUPTED
            assert isomorphic(resume(part), whole)

    def test_an_interruption_before_anything_was_found(self):
        part = skeleton(CUBE, START, progress=Interrupter(1))
        assert part.complete is Completeness.INTERRUPTED
        parts = {"left": x, "base": y, "lid": 1 - x - y, "log": sp.log(x + 2)}
        undefined = Polyhedron(PLANE, parts)
        again = skeleton(undefined, [[-5, -1], [0.2, 0.2]], progress=Interrupter(1))
        assert again.complete is Completeness.INTERRUPTED
        assert counts(again) == (0, 0, 0)
        assert counts(resume(again)) == (3, 3, 1)

    def test_it_may_be_interrupted_again(self, whole):
        part = skeleton(CUBE, START, progress=Interrupter(3))
        for _ in range(3):
            part = resume(part, progress=Interrupter(2))
            assert part.complete is Completeness.INTERRUPTED
        assert isomorphic(resume(part), whole)

    def test_a_union_goes_on_as_well(self):
        D = Polyhedron(PLANE, AllOf(x, y, 2 - x, 2 - y, AnyOf(1 - x, 1 - y)))
        whole = skeleton(D, [[0.3, 0.4]])
        assert identical(resume(skeleton(D, [[0.3, 0.4]], budget=3)), whole)

    def test_other_errors_of_the_callback_are_not_swallowed(self):
        def fail(*_):
            raise ZeroDivisionError

        with pytest.raises(ZeroDivisionError):
            skeleton(CUBE, START, progress=fail)


class TestBudget:
    """Every phase is bounded; pieces, however small, end as the whole."""

    @staticmethod
    def finished(part, budget):
        for _ in range(100):
            before = part.state
            part = resume(part, budget=budget)
            assert len(part.state.tried) <= len(before.tried) + 1
            assert len(before.starts) - len(part.state.starts) <= 1
            if part.complete is not Completeness.BUDGET:
                return part
        return pytest.fail("a search in pieces comes to no end")

    def test_a_moment_is_enough_for_one_piece_of_work(self, whole):
        moment = Budget(seconds=1e-9)
        part = skeleton(CUBE, START, budget=moment)
        assert part.complete is Completeness.BUDGET
        assert identical(self.finished(part, moment), whole)

    def test_crossings_are_counted_as_edges_are(self, whole):
        part = skeleton(CUBE, START, budget=12)
        assert (len(part.edges), len(part.state.tried)) == (12, 12)
        assert part.complete is Completeness.BUDGET
        assert part.euler_note == "the search is not finished"
        assert identical(self.finished(part, 1), whole)

    def test_starts_that_lead_nowhere_are_counted(self):
        part = skeleton(TRIANGLE, [[-1, -1]] * 50 + [[0.2, 0.2]], budget=20)
        assert len(part.state.starts) == 31
        assert len(part.notes) == 20
        assert counts(resume(part)) == (3, 3, 1)

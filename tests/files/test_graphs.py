"""The graph of an atlas, as other programs read it."""

import json
import math

import networkx as nx
import numpy as np
import pytest
from kept_files import same_graph

from polycorner import Manifold, Polyhedron, skeleton
from polycorner.dumbbells import DumbbellPair
from polycorner.files import load_graph, save_graph
from polycorner.files.graphs import KIND
from polycorner.models import Pinball, Tutorial
from polycorner.skeletons import End

M = Manifold.euclidean("x y")
X, Y = M.symbols


def read(atlas, tmp_path):
    """Return the graph as another program reads it."""
    path = save_graph(atlas, tmp_path / "new" / "atlas.graphml")
    graph = nx.read_graphml(path, force_multigraph=True)
    same_graph(load_graph(path), graph)
    return graph


def test_the_tutorial_is_a_ring_of_seven(tmp_path):
    region = Tutorial()
    graph = read(skeleton(region.polyhedron, [[0.0, 0.0]]), tmp_path)
    assert nx.is_isomorphic(graph, nx.cycle_graph(7))
    corners = region.corners()
    for letter, point in corners.items():
        (node,) = [
            about
            for _, about in graph.nodes(data=True)
            if math.dist((about["x"], about["y"]), point) < 1e-9
        ]
        assert set.intersection(*map(set, json.loads(node["active"]))) == {letter}
        assert (node["kind"], node["dimension"], node["rank"]) == ("corner", 0, 2)
        assert node["local_type"] == "QUADRANT"
        assert not node["singular"]
    sides = region.sides(2001)
    for *_, edge in graph.edges(data=True):
        (name,) = json.loads(edge["active"])
        chords = np.linalg.norm(np.diff(sides[name], axis=0), axis=1)
        assert edge["length"] == pytest.approx(chords.sum(), rel=1e-2)
        assert (edge["from_kind"], edge["to_kind"]) == ("corner", "corner")


def test_pins_are_loops_and_edges_may_be_parallel(tmp_path):
    board = Pinball()
    atlas = skeleton(board.polyhedron, board.starts(np.random.default_rng(0), 6))
    graph = read(atlas, tmp_path)
    closed = [edge for edge in atlas.edges if edge.is_closed]
    loops = [about for a, b, about in graph.edges(data=True) if a == b]
    assert len(loops) == len(closed) > 0
    assert {about["from_kind"] for about in loops} == {"closed"}
    assert len(graph.edges) == len(atlas.edges)
    assert len(graph.nodes) == len(atlas.corners) + len(closed)
    assert max(graph.number_of_edges(a, b) for a, b in graph.edges()) == 2


def test_open_ends_have_nodes_of_their_own(tmp_path):
    wedge = Polyhedron(M, {"a": Y - X, "b": Y + X})
    graph = read(skeleton(wedge, [[0.0, 1.0]], extent=5.0), tmp_path)
    kinds = sorted(about["kind"] for _, about in graph.nodes(data=True))
    assert kinds == ["corner", "infinity", "infinity"]
    for _, about in graph.nodes(data=True):
        away = math.hypot(about["x"], about["y"])
        assert away < 1e-9 if about["kind"] == "corner" else away >= 5
    line = read(skeleton(Polyhedron(M, {"half": Y}), [[0.0, 1.0]], extent=5.0), tmp_path)
    assert len(line.nodes) == 2
    assert [End[about["to_kind"].upper()] for *_, about in line.edges(data=True)] == [End.INFINITY]


def test_a_pair_has_units_and_chirality(tmp_path):
    pair = DumbbellPair(16, 3, 1.5)
    atlas = skeleton(pair.polyhedron, [pair.nested("R")], symmetry=pair.symmetry, budget=3)
    graph = read(atlas, tmp_path)
    for name in pair.manifold.names:
        assert graph.graph[f"{name}_units"] == ("rad" if "theta" in name else "mm")
    for k, corner in enumerate(atlas.corners):
        node = graph.nodes[str(k)]
        assert node.get("chirality") == corner.chirality
        assert [node[name] for name in pair.manifold.names] == corner.point.tolist()
    assert {node["chirality"] for _, node in graph.nodes(data=True)} == {"R", "L"}


def test_coordinates_may_be_called_as_they_like(tmp_path):
    space = Manifold(("rank", "kind"), units=("mm", ""))
    x, y = space.symbols
    box = {"a": x, "b": y, "c": 1 - x, "d": 2 - y}
    graph = read(skeleton(Polyhedron(space, box), [[0.5, 0.5]]), tmp_path)
    places = sorted((about["rank_"], about["kind_"]) for _, about in graph.nodes(data=True))
    np.testing.assert_allclose(places, [(0, 0), (0, 2), (1, 0), (1, 2)], atol=1e-9)
    assert graph.graph["rank__units"] == "mm"
    assert graph.graph["kind__units"] == "not stated"


def test_something_else_is_refused(tmp_path):
    with pytest.raises(TypeError, match=r"^skeleton: expected a Skeleton; got str"):
        save_graph("atlas", tmp_path / "a.graphml")


@pytest.fixture
def wedge(tmp_path):
    found = skeleton(Polyhedron(M, {"a": Y - X, "b": Y + X}), [[0.0, 1.0]], extent=5.0)
    return save_graph(found, tmp_path / "wedge.graphml")


HOSTILE = [
    lambda text: text.replace("<graphml", '<!DOCTYPE g [<!ENTITY x "y">]><graphml', 1),
    lambda text: text.replace("corner", "&x;", 1),
    lambda text: text.replace("<graph ", "<a>" * 100_000 + "<graph ", 1),
    lambda text: text.replace("QUADRANT", "\x00", 1),
    lambda text: text[: len(text) // 2],
    lambda _: "",
    lambda _: "not XML",
    lambda text: text.replace(">corner<", ">nobody<", 1),
    lambda text: text.replace("QUADRANT", "NOTHING", 1),
    lambda text: text.replace(">2</data>", ">1e5000</data>", 1),
    lambda text: text.replace(">2</data>", f">{'9' * 5000}</data>", 1),
    lambda text: text.replace(">2</data>", ">-1</data>", 1),
    lambda text: text.replace('["a"]', "[" * 100_000, 1),
    lambda text: text.replace('attr.type="long"', 'attr.type="code"', 1),
]


@pytest.mark.parametrize("k", range(len(HOSTILE)))
def test_a_hostile_file_is_refused_in_one_sentence_that_names_it(wedge, k):
    text = KIND.load(wedge).decode()
    changed = HOSTILE[k](text)
    assert changed != text
    KIND.save(wedge, changed.encode())
    with pytest.raises(
        ValueError, match=r"^path: expected a graph that save_graph wrote; "
    ) as told:
        load_graph(wedge)
    assert f"{wedge} is damaged" in str(told.value)
    assert "\n" not in str(told.value)

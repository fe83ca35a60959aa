"""Problems as files: by hand, by the library and back, and a sentence for every mistake."""

import math
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
import strategies
import sympy
from hypothesis import given
from hypothesis import strategies as st

from polycorner import AllOf, AnyOf, Manifold, Polyhedron, SmoothFunction
from polycorner.bodies import Arrangement, box, polygon
from polycorner.files import load_problem, save_problem
from polycorner.models import Pinball, SphereCluster, Tutorial

CIRCLES = """
title = "circles"
coordinates = [{ names = "(x[i], y[i]) for i in 1..n", box = [0, 1] }, "r"]
energy.maximise = "r"
[parameters]
n = 4
[inequalities]
"wall[i] for i in 1..n" = "r <= x[i] <= 1 - r"
"floor[i] for i in 1..n" = "r <= y[i] <= 1 - r"
"gap[i,j] for i in 1..n for j in i+1..n" = "(x[i]-x[j])**2 + (y[i]-y[j])**2 >= 4*r**2"
[points]
rows = [[0.25, 0.25], [0.75, 0.25], [0.25, "3/4"], [0.75, 0.75], ["0.250000000000000000001"]]
"""
SMALL = 'coordinates = ["x", "y"]\ninequalities.f = "x + y"\n'


@pytest.fixture
def written(tmp_path):
    """Return a function that reads a problem of a given text."""

    def read(text):
        path = tmp_path / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return load_problem(path)

    return read


def test_circles_by_hand_are_those_of_the_definition(written):
    problem = written(CIRCLES)
    names = problem.polyhedron.manifold.names
    assert names == ("x1", "y1", "x2", "y2", "x3", "y3", "x4", "y4", "r")
    assert problem.maximised
    assert problem.box == ((0.0, 1.0),) * 8 + (None,)
    rng = np.random.default_rng(0)
    for q in rng.uniform(-1, 1, (20, 9)):
        centres, r = q[:8].reshape(4, 2), q[8]
        expected = {}
        for word, k in (("wall", 0), ("floor", 1)):
            for i, centre in enumerate(centres, 1):
                expected[f"{word}[{i}].1"] = centre[k] - r
                expected[f"{word}[{i}].2"] = 1 - r - centre[k]
        for i, j in combinations(range(4), 2):
            apart = math.dist(centres[i], centres[j])
            expected[f"gap[{i + 1},{j + 1}]"] = apart**2 - 4 * r**2
        found = dict(zip(problem.polyhedron.names, problem.polyhedron.values(q), strict=True))
        assert found == pytest.approx(expected)
        assert problem.energy.value(q) == -r


def test_all_digits_of_a_point_are_kept(written):
    problem = written(CIRCLES)
    assert Fraction(problem.exact["rows"][-1]) == Fraction(1, 4) + Fraction(1, 10**21)
    assert problem.exact["rows"][5] == "3/4"
    assert problem.points["rows"].tolist() == [0.25, 0.25, 0.75, 0.25, 0.25, 0.75, 0.75, 0.75, 0.25]


def test_parameters_are_numbers_that_may_vary_or_exact_ones(written):
    problem = written(
        'coordinates = ["x"]\nparameters = { t = 0.1, third = "1/3", n = 2 }\n'
        'inequalities.f = "third*x**n - t"\nequations.h = "sin(x) == t"\n'
    )
    (f,) = problem.polyhedron.functions
    x, t = sympy.Symbol("x", real=True), sympy.Symbol("t", real=True)
    assert f.expression == x**2 / 3 - t
    assert f.parameter_values == {"t": 0.1}
    assert problem.polyhedron.stated[0].value([0.5]) == pytest.approx(0.1 - math.sin(0.5))
    assert problem.energy is None


def test_sums_spheres_and_circles(written):
    problem = written(
        'coordinates = [{ sphere = "(x[i], y[i], z[i]) for i in 1..3" },'
        '{ names = "turn", period = "2*pi", scale = 0.5 }, { rotation = "a, b, c, d" }]\n'
        'energy.minimise = "sum(1/sqrt((x[i]-x[j])**2 + (y[i]-y[j])**2 + (z[i]-z[j])**2)'
        ' for i in 1..3 for j in i+1..3) + cos(turn) + sum(i for i in 2..1)"\n'
        'equations.up = "a == 0"'
    )
    manifold = problem.polyhedron.manifold
    assert manifold.spheres == tuple(tuple(f"{u}{i}" for u in "xyz") for i in (1, 2, 3))
    assert manifold.rotations == (("a", "b", "c", "d"),)
    assert manifold.periods[9:11] == (2 * math.pi, math.inf)
    q = manifold.onto(np.random.default_rng(1).normal(size=14))
    points = q[:9].reshape(3, 3)
    coulomb = sum(1 / math.dist(p, o) for p, o in combinations(points, 2))
    assert problem.energy.value(q) == pytest.approx(coulomb + math.cos(q[9]))


def test_unions_by_names_and_by_families(written):
    problem = written(
        'coordinates = ["x", "y"]\n'
        'tree = { any = ["left", { all = ["low[i] for i in 1..2"] }] }\n'
        '[inequalities]\nabove = "y >= 0"\nleft = "x <= -1"\n"low[i] for i in 1..2" = "i*x >= i"'
    )
    inside = {(-2, 1): True, (0, 1): False, (2, 1): True, (2, -1): False}
    for q, expected in inside.items():
        assert problem.polyhedron.contains(np.array(q, float)) is expected


@pytest.mark.parametrize(
    ("table", "options", "expected"),
    [
        ("1 2\n3 4\n", "", [1, 2, 3, 4]),
        ("# title\nindex, x, y\n1, 0.5, -1e-3\n2,3,4\n", ", columns = [2, 3]", [0.5, -1e-3, 3, 4]),
        ("1 2 3\n", ', then = ["1/4"]', [1, 2, 3, 0.25]),
    ],
)
def test_a_table_of_coordinates(written, tmp_path, table, options, expected):
    (tmp_path / "table.csv").write_text(table)
    problem = written(
        'coordinates = ["a, b, c, d"]\ninequalities.f = "a"\n'.replace('"a, b', '"(a, b').replace(
            'd"', 'd)"'
        )
        + f'points.p = {{ file = "table.csv"{options} }}'
    )
    assert problem.points["p"].tolist() == expected


@pytest.mark.parametrize("polyhedron", [Tutorial().polyhedron, SphereCluster(4).polyhedron])
def test_what_the_library_writes_it_reads(tmp_path, polyhedron):
    read = load_problem(save_problem(tmp_path / "a.toml", polyhedron)).polyhedron
    same(read, polyhedron)


def test_bodies_come_back_with_their_unions(tmp_path):
    square = polygon([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    squares = Arrangement([square] * 2, box([0, 0], [2.3, 2.3]), orientations="none").polyhedron
    assert squares.is_union
    read = load_problem(save_problem(tmp_path / "a.toml", squares)).polyhedron
    q = np.random.default_rng(0).uniform(0, 2.3, (200, 4))
    np.testing.assert_allclose(read.values(q), squares.values(q), atol=1e-14)
    same(read, squares)


def test_a_formula_alone_is_minimised(tmp_path):
    short, long = tmp_path / "a.toml", tmp_path / "b.toml"
    short.write_text(SMALL + 'energy = "x"')
    long.write_text(SMALL + 'energy.minimise = "x"')
    energies = [load_problem(file).energy.expression for file in (short, long)]
    assert energies[0] == energies[1]
    assert not load_problem(short).maximised


def test_an_energy_and_points_come_back(tmp_path):
    board = Pinball()
    rng = np.random.default_rng(0)
    points = {"a": board.starts(rng, 1)[0], "b": [Fraction(1, 3), "0.1"]}
    box = [(0.0, 1.0), None]
    path = save_problem(
        tmp_path / "b.toml", board.polyhedron, board.energy, points, box=box, title='"\\\x01 \u00e9'
    )
    read = load_problem(path)
    same(read.polyhedron, board.polyhedron)
    assert read.energy.expression == board.energy.expression
    assert read.points["a"].tolist() == points["a"].tolist()
    assert read.exact["b"] == ("1/3", "0.1")
    assert (read.box, read.title) == (tuple(box), '"\\\x01 \u00e9')
    again = save_problem(
        tmp_path / "c.toml",
        read.polyhedron,
        read.energy,
        read.exact,
        box=read.box,
        title=read.title,
    )
    assert again.read_text() == path.read_text()


def same(one, other):
    """Two polyhedra have the same functions, by formula, and are joined in the same way."""
    assert one.manifold == other.manifold
    assert one.names == other.names
    assert [h.name for h in one.stated] == [h.name for h in other.stated]
    rows = np.random.default_rng(1).normal(size=(50, len(one.names)))
    np.testing.assert_array_equal(one.implicit_of(rows), other.implicit_of(rows))
    for f, g in zip((*one.functions, *one.stated), (*other.functions, *other.stated), strict=True):
        assert with_values(f) == with_values(g)
        assert f.unit == g.unit


def with_values(f):
    """Return a formula with exact numbers in place of parameters, as they are in memory."""
    numbers = {p: sympy.Rational(*x.as_integer_ratio()) for p, x in f.parameter_values.items()}
    return f.expression.xreplace(
        {s: numbers[s.name] for s in f.expression.free_symbols if s.name in numbers}
    )


@st.composite
def polyhedra(draw):
    """Return polyhedra with parameters of equal names, units, unions, circles and equations."""
    manifold = draw(strategies.manifolds(3))
    count = draw(st.integers(1, 4))
    functions = []
    for k in range(count):
        q = manifold.symbols[draw(st.integers(0, manifold.dimension - 1))]
        period = manifold.periods[manifold.positions[q.name]]
        term = q**2 if math.isinf(period) else sympy.cos(q * 2 * sympy.pi / sympy.Float(period))
        p = sympy.Symbol("p", real=True)
        functions.append(
            SmoothFunction(
                draw(st.sampled_from(["f", "gap", "a b", "1-2|c", "\u00fc", "x=y"])) + str(k),
                sympy.Rational(draw(st.integers(-3, 3)), 3) + p * term,
                manifold,
                parameters={"p": draw(strategies.reals())},
                unit=draw(st.sampled_from(["", "mm"])),
            )
        )
    tree = strategies.group(draw(strategies.trees(count)), functions)
    return Polyhedron(manifold, tree)


@given(polyhedra())
def test_generated_polyhedra_come_back(tmp_path_factory, polyhedron):
    folder = tmp_path_factory.mktemp("generated")
    same(load_problem(save_problem(folder / "a.toml", polyhedron)).polyhedron, polyhedron)


def test_parameters_with_the_names_of_coordinates_stay_apart(tmp_path):
    M = Manifold.euclidean("x y")
    family_x = sympy.Symbol("u", real=True)
    f = SmoothFunction(
        "f", family_x - sympy.Symbol("x", real=True), M, parameters={"x": 0.25},
        variables=["u"], reads=["x"],
    )  # fmt: skip
    read = load_problem(save_problem(tmp_path / "a.toml", Polyhedron(M, f))).polyhedron
    assert read.values([1.0, 0.0]).tolist() == [0.75]


def test_large_energies_are_sums_and_come_back(tmp_path):
    M = Manifold.euclidean([f"x{k}" for k in range(60)])
    terms = [SmoothFunction(f"e{k}", x**2 / 2, M) for k, x in enumerate(M.symbols)]
    energy = SmoothFunction.sum("E", terms)
    read = load_problem(
        save_problem(tmp_path / "a.toml", Polyhedron(M, M.symbols[0]), energy)
    ).energy
    assert read.name == "E"
    assert len(read.terms) == 60
    assert read.value(np.arange(60.0)) == energy.value(np.arange(60.0))


# ---------------------------------------------------------------------------------------- mistakes


MISTAKES = {
    "nothing": ("", "coordinates"),
    "no TOML": ("title = 1\ncoordinates = [,]", "line 2"),
    "unknown key": (SMALL + 'energies = "x"', "energies"),
    "misspelt": ('cordinates = ["x"]', "did you mean coordinates?"),
    "format": ("format = 2\n" + SMALL, "format: expected 1; got 2"),
    "title": ("title = 3\n" + SMALL, "title"),
    "coordinates": ('coordinates = "x"', "coordinates"),
    "coordinate": ("coordinates = [3]", "coordinates[0]"),
    "twice": ('coordinates = ["x", "x"]\ninequalities.f = "x"', "distinct"),
    "identifier": ('coordinates = ["x y"]', "coordinates[0].names"),
    "call": ('coordinates = ["x()"]', "coordinates[0].names"),
    "import": ('coordinates = ["__import__(\'os\')"]', "coordinates[0].names"),
    "coordinate key": ('coordinates = [{ names = "x", colour = 1 }]', "colour"),
    "period": ('coordinates = [{ names = "x", period = -1 }]', "period"),
    "period formula": ('coordinates = [{ names = "x", period = "open(1)" }]', "period"),
    "scale": ('coordinates = [{ names = "x", scale = true }]', "scale"),
    "infinite scale": ('coordinates = [{ names = "x", scale = inf }]', "scale"),
    "unit": ('coordinates = [{ names = "x", unit = 3 }]', "unit"),
    "box": ('coordinates = [{ names = "x", box = [1, 0] }]', "box"),
    "box of a circle": ('coordinates = [{ names = "x", period = 1, box = [0, 1] }]', "box"),
    "sphere": ('coordinates = [{ sphere = "(x)" }]', "spheres"),
    "rotation": ('coordinates = [{ rotation = "(x, y)" }]', "rotations"),
    "no kind": ("coordinates = [{ scale = 1.0 }]", "one of names, sphere, rotation"),
    "range": ('coordinates = ["x[i] for i in 1..n"]', "a whole number"),
    "long range": ('coordinates = ["x[i] for i in 1..999999999"]', "a whole number"),
    "many": ('coordinates = ["x[i,j] for i in 1..9999 for j in 1..9999"]', "parts"),
    "other loop": ('coordinates = ["x[i] for i in [1, 2]"]', "for i in a..b"),
    "condition": ('coordinates = ["x[i] for i in 1..2 if i"]', "for i in a..b"),
    "parameter": (SMALL + "parameters.p = [1]", "parameters.p"),
    "infinite parameter": (SMALL + "parameters.p = inf", "parameters.p"),
    "parameter formula": (SMALL + 'parameters.p = "x"', "parameters.p"),
    "parameter's name": (SMALL + "parameters.x = 1", "parameters.x"),
    "constant's name": (SMALL + "parameters.pi = 3", "parameters.pi"),
    "formula": (SMALL + 'inequalities.g = "x +"', "line 3: inequalities.g"),
    "unknown symbol": (SMALL + 'inequalities.g = "z"', "inequalities.g"),
    "attribute": (SMALL + 'inequalities.g = "x.__class__"', "inequalities.g"),
    "import in a formula": (SMALL + 'inequalities.g = "__import__(\'os\').getcwd()"', "line 3"),
    "lambda": (SMALL + 'inequalities.g = "(lambda: x)()"', "inequalities.g"),
    "walrus": (SMALL + 'inequalities.g = "(x := 1)"', "inequalities.g"),
    "text": (SMALL + "inequalities.g = \"'x'\"", "inequalities.g"),
    "formula's kind": (SMALL + "inequalities.g = 3", "inequalities.g"),
    "formula's key": (SMALL + 'inequalities.g = { formula = "x", color = "r" }', "color"),
    "strict": (SMALL + 'inequalities.g = "x < 1"', "<= or >="),
    "no equation": (SMALL + 'equations.g = "x <= 1"', "=="),
    "index": (SMALL + 'inequalities."g[i] for i in 1..2" = "x[i]"', "x1"),
    "same name": (SMALL + 'inequalities."g[0*i] for i in 1..2" = "x"', "g[0]"),
    "huge power": (SMALL + 'inequalities.g = "2**10**9"', "inequalities.g"),
    "huge exponent": (SMALL + 'inequalities.g = "x**1e400"', "inequalities.g"),
    "deep": (SMALL + f'inequalities.g = "{"sin(" * 5000}x{")" * 5000}"', "inequalities.g"),
    "long": (SMALL + f'inequalities.g = "{"x+" * 600_000}x"', "1000000 characters"),
    "huge sum": (SMALL + 'inequalities.g = "sum(x for i in 1..9999 for j in 1..9999)"', "parts"),
    "deep table": (SMALL + "points.p = " + "[" * 5000 + "]" * 5000, "TOML"),
    "periodic": (
        'coordinates = [{ names = "x", period = 1 }]\ninequalities.f = "x"',
        "the period 1",
    ),
    "energy": (SMALL + "energy = 3", "energy"),
    "two energies": (SMALL + 'energy = { minimise = "x", maximise = "x" }', "energy"),
    "energy's formula": (SMALL + 'energy.minimise = "foo(x)"', "energy.minimise"),
    "energy's key": (SMALL + 'energy.minimize = "x"', "did you mean minimise?"),
    "tree": (SMALL + 'tree = ["f"]', "tree"),
    "tree's name": (SMALL + 'tree = { any = ["g"] }', "tree.any[0]"),
    "empty": (SMALL + "tree = { any = [] }", "tree.any"),
    "two words": (SMALL + 'tree = { any = ["f"], all = ["f"] }', "tree"),
    "point": (SMALL + "points.p = [1]", "points.p: expected 2 numbers"),
    "point's number": (SMALL + 'points.p = [1, "one"]', "points.p"),
    "point's truth": (SMALL + "points.p = [1, true]", "points.p"),
    "no finite point": (SMALL + "points.p = [1, nan]", "points.p"),
    "huge point": (SMALL + 'points.p = [1, "1e9999"]', "points.p"),
    "huge decimal": (SMALL + "points.p = [1, 1e999999999]", "points.p"),
    "zero": (SMALL + 'points.p = [1, "1/0"]', "points.p"),
    "point's name": (SMALL + 'points."../p" = [1, 2]', "points: expected names"),
    "outside": (SMALL + 'points.p = { file = "../secret" }', "in the folder"),
    "absolute": (SMALL + 'points.p = { file = "/etc/passwd" }', "in the folder"),
    "columns": (SMALL + 'points.p = { file = "good.csv", columns = [0] }', "columns"),
    "column": (SMALL + 'points.p = { file = "good.csv", columns = [3] }', "line 1 of good.csv"),
    "ragged": (SMALL + 'points.p = { file = "ragged.csv" }', "line 2 of ragged.csv"),
    "words": (SMALL + 'points.p = { file = "words.csv" }', "line 2 of words.csv"),
    "too few": (SMALL + 'points.p = { file = "few.csv" }', "1 numbers"),
    "table's key": (SMALL + 'points.p = { file = "good.csv", sep = "," }', "sep"),
}  # fmt: skip


@pytest.mark.parametrize("what", MISTAKES)
def test_a_mistake_is_one_sentence(written, tmp_path, what):
    for name, table in {"good": "1 2", "ragged": "1 2\n3", "words": "1 2\n3 x", "few": "1"}.items():
        (tmp_path / f"{name}.csv").write_text(table)
    text, expected = MISTAKES[what]
    with pytest.raises(ValueError, match=r"problem\.toml") as refused:
        written(text)
    said = str(refused.value)
    assert expected in said
    assert "\n" not in said
    assert len(said) < 600


def test_a_file_beyond_the_limit_is_not_read(tmp_path):
    path = tmp_path / "large.toml"
    path.write_bytes(b"# \n" * 2_000_000)
    with pytest.raises(ValueError, match="bytes"):
        load_problem(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match="expected a TOML file"):
        load_problem(path)
    with pytest.raises(OSError, match="nowhere"):
        load_problem(tmp_path / "nowhere.toml")


def test_a_link_out_of_the_folder_is_not_followed(tmp_path):
    inside = tmp_path / "in"
    inside.mkdir()
    (tmp_path / "table").write_text("1 2")
    (inside / "link").symlink_to(tmp_path / "table")
    (inside / "p.toml").write_text(SMALL + 'points.p = { file = "link" }')
    with pytest.raises(ValueError, match="in the folder"):
        load_problem(inside / "p.toml")


def test_what_cannot_be_read_back_is_not_written(tmp_path):
    M = Manifold.euclidean("x y")
    x, y = M.symbols
    path = tmp_path / "a.toml"
    family = Polyhedron(M, {"f[i] for i in 1..2": x})
    with pytest.raises(ValueError, match="families"):
        save_problem(path, family)
    with pytest.raises(ValueError, match=r"points\.p"):
        save_problem(path, Polyhedron(M, x), points={"p": [1.0]})
    with pytest.raises(ValueError, match="box"):
        save_problem(path, Polyhedron(M, AllOf(x, AnyOf(x, y))), box=[None])
    deep = x
    for _ in range(120):
        deep = sympy.sin(deep + y)
    with pytest.raises(ValueError, match="polyhedron: "):
        save_problem(path, Polyhedron(M, {"deep": deep}))
    assert not path.exists()

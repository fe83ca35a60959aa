"""The documentation agrees with the code: names exist, links resolve, numbers hold."""

import math
import re
from importlib import import_module
from pathlib import Path

import pytest

import polycorner
from docs.extensions import api, homes, links, mathml, rooms
from polycorner import minimise
from polycorner.dumbbells import DumbbellPair

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
ROOMS = [import_module(room) for room in homes.ROOMS]


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.__name__)
def test_every_public_name_is_a_term_of_the_notation(room):
    words = set(re.findall(r"\w+", (DOCS / "notation.md").read_text()))
    if "pictures" not in room.__name__ and "viewer" not in room.__name__:
        assert set(room.__all__) <= words


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.__name__)
def test_the_api_shows_every_public_name_under_one_package(room):
    text = api.page()
    assert all(len(re.findall(rf"^   {name}$", text, re.M)) >= 1 for name in room.__all__)
    named = re.findall(r"currentmodule:: (\S+)|^   (\w+)$", text, re.M)
    package = ""
    for module, name in named:
        package = module or package
        if name:
            assert hasattr(import_module(package), name), (package, name)


@pytest.mark.parametrize("others", [{}, {"": "Manifold Manifold"}, {"": "Polytope"}])
def test_the_api_has_every_public_name_once(monkeypatch, others):
    first, *rest = api.GROUPS
    names = first.names | {"": f"{first.names['']} {others['']}"} if others else {}
    monkeypatch.setattr(api, "GROUPS", (first._replace(names=names), *rest))
    with pytest.raises(ValueError, match="every public name once"):
        api.page()


@pytest.mark.parametrize("file", sorted((DOCS / "inventories").glob("*.txt")), ids=lambda f: f.stem)
def test_names_of_other_projects_exist(file):
    head, *entries = file.read_text().splitlines()
    assert head == "# Sphinx inventory version 1"
    listed = [line.split() for line in entries if not line.startswith("#")]
    assert listed
    for name, kind, _ in listed:
        found = homes.found(name)
        assert found is not None, name
        assert isinstance(found, type) == (kind == "class"), name


def test_cited_keys_have_a_source():
    keys = set(re.findall(r"^\| \d+ \| \[(\w+)\] \|", (DOCS / "references.md").read_text(), re.M))
    text = "".join(page.read_text() for page in DOCS.glob("*.md"))
    cited = [
        key
        for label in re.findall(r"\{ref\}`([^`<]+)<references>`", text)
        for key in re.findall(r"\[(\w+)\]", label)
    ]
    assert len(keys) > 30
    assert cited
    assert set(cited) <= keys


def test_citation_is_the_same_for_people_and_machines():
    cff = (ROOT / "CITATION.cff").read_text()
    page = (DOCS / "cite.md").read_text()
    for title in re.findall(r'title: "(.*)"', cff):
        assert f"{{{title}}}" in page
    for family, given in re.findall(r'family-names: (\w+)\n +given-names: "?([^"\n]*)"?', cff):
        assert f"{family}, {given}" in page
    assert re.search(r"eprint +=.*1605\.04438", page)
    assert "arXiv:1605.04438" in cff
    assert f"{{{polycorner.__version__}}}" in page


def test_headings_that_the_readme_states():
    stated = re.findall(r"(\d+\.\d+)\s+degrees", (ROOT / "README.md").read_text())
    pair = DumbbellPair(16, 3, 1.5, drum_radius=125)
    rest = minimise(pair.polyhedron, pair.energy, pair.nested("R"))
    computed = math.degrees(pair.heading(rest.point)[0])
    assert stated == [f"{computed:.2f}", f"{math.degrees(math.atan(3 / 16)):.2f}"]


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md"], ids=lambda f: f.name
)
def test_links_of_pages_outside_the_site(page):
    found = [a for a in re.findall(r"\]\(([^)]+)\)", page.read_text()) if "://" not in a]
    assert [a for a in found if not (ROOT / a).is_file()] == []


# ---------------------------------------------------------------------------- what builds the site


def test_broken_links_are_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="b.html#there">b</a><a href="#here">a</a>'
    )
    (tmp_path / "b.html").write_text('<p id="there"><a href="https://example.org">x</a>')
    assert list(links.broken(tmp_path)) == []
    (tmp_path / "c.html").write_text(
        '<a href="gone.html">1</a><a href="a.html#gone">2</a>'
        '<img src="../x.png"><a href="#no">3</a>'
    )
    links.page.cache_clear()
    faults = "\n".join(links.broken(tmp_path))
    assert faults.count("c.html: the link") == 4
    for fault in ("leads to no file", "leads to no place", "leaves the site"):
        assert fault in faults


def test_formulas_are_typeset_and_keep_their_tex():
    written = mathml.typeset(r"\lambda_i \ge 0")
    assert '<math alttext="\\lambda_i \\ge 0">' in written
    assert "<msub>" in written
    with pytest.raises(ValueError, match="formula"):
        mathml.typeset(r"\nosuchcommand x")


@pytest.mark.parametrize(
    ("target", "name"),
    [
        ("polycorner.skeletons.search.skeleton", "polycorner.skeleton"),
        ("polycorner.dumbbells.drum.DumbbellDrum", "polycorner.dumbbells.DumbbellDrum"),
        ("polycorner.dumbbells.dynamics.pairs.left_as", None),
        ("polycorner.skeletons.search.missing", None),
    ],
)
def test_public_names(target, name):
    assert homes.public_name(target) == name


def test_the_figure_of_the_architecture_has_every_room_with_its_lines(tmp_path):
    shown = [room for layer in rooms.layers() for room in layer]
    package = ROOT / "polycorner"
    there = {p.stem for p in package.glob("[!_]*") if p.suffix == ".py" or p.is_dir()}
    assert sorted(shown) == sorted(there | {"__main__"})
    source = [p for p in package.rglob("*.py") if p.parent != package or p.stem in shown]
    count = sum(len(p.read_text().splitlines()) for p in source)
    assert sum(rooms.lines(room) for room in shown) == count
    rooms.draw().savefig(tmp_path / "rooms.svg")

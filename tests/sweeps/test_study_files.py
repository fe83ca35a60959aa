"""Studies in TOML files: their contents, and mistakes in them."""

import numpy as np
import pytest

from polycorner.dumbbells.studies import STUDIES, bunch, climbing, driven, heading, turning
from polycorner.sweeps import read_study, sweep


def written(tmp_path, text):
    file = tmp_path / "study.toml"
    file.write_text(text)
    return file


def test_files_of_the_package_are_studies():
    studies = {name: read_study(study.file, STUDIES) for name, study in STUDIES.items()}
    assert {name: plan.function for name, plan in studies.items()} == {
        "heading": heading, "climbing": climbing, "bunch": bunch, "driven": driven,
        "turning": turning,
    }  # fmt: skip
    assert studies["heading"].grid.axes["length"].unit == "mm"
    assert (studies["climbing"].seed, studies["climbing"].random) == (1, True)
    assert not studies["heading"].random


def test_axes_are_lists_or_ranges(tmp_path):
    plan = read_study(
        written(
            tmp_path,
            'study = "sweep_functions:mixed"\n[axes]\n'
            'a = {start = 1, stop = 100, count = 3, spacing = "logarithmic", unit = "mm"}\n'
            "b = [2, 3]",
        )
    )
    np.testing.assert_allclose(plan.grid.axes["a"].values, [1, 10, 100])
    assert plan.grid.axes["a"].unit == "mm"
    found = sweep(plan.function, plan.grid, fixed=plan.fixed)
    assert found["total"].shape == (3, 2)


MISTAKES = {
    'studdy = "heading"': r"expected study, seed, axes, fixed; got studdy \(did you mean study\?\)",
    'study = "haeding"': r"study: expected heading, climbing, .*; got haeding \(did",
    "study = 3": (
        "study: expected heading, climbing, bunch, driven, turning or module:function; got 3"
    ),
    'study = "no_such_module:f"': "study: expected module:function that can be imported",
    'study = "math:no_such"': "study: expected module:function that can be imported",
    'study = "heading"': "axes: expected a table",
    'study = "heading"\naxes = 3': "axes: expected a dict; got int",
    'study = "heading"\n[axes]\nlenght = [1]\nrod_radius = [1]': r"axes: .* got lenght \(did you",
    'study = "heading"\n[axes]\nlength = [1]': "axes: .* rod_radius is missing",
    'study = "heading"\n[axes]\nlength = {start = 1, stop = 2, cuont = 3}': (
        r"axes.length: expected values, .* got cuont \(did you mean count\?\)"
    ),
    'study = "heading"\n[axes]\nlength = {start = 1, stop = 2}': "axes.length: expected values, or",
    'study = "heading"\n[axes]\nlength = {values = [1], count = 2}': "axes.length: .* got both",
    'study = "heading"\n[axes]\nlength = {start = "a", stop = 2, count = 2}': "start: expected",
    'study = "heading"\n[axes]\nlength = {start = 1, stop = 2, count = 0}': "count: expected",
    'study = "heading"\n[axes]\nlength = {start = 1, stop = 2, count = 2, spacing = ""}': "spacing",
    'study = "heading"\n[axes]\nlength = []': "axes.length: values: expected",
    'study = "heading"\n[axes]\nlength = 3': "axes.length: values: expected",
    'study = "heading"\n[axes]\nlength = {values = [1], unit = 3}': "axes.length: unit: expected",
    'study = "heading"\n[axes]\nlength = [9]\nrod_radius = [1]\n[fixed]\nbal = 1': "fixed: .*bal",
    'study = "climbing"\nseed = -1\n[axes]\nnoise = [1]\ntilt = [1]': "seed: expected",
    "study = ": "is no TOML file that can be read",
    f"x = {'[' * 9999}": "is no TOML file that can be read: .*recursion",
    f"x = {'9' * 5000}": "is no TOML file that can be read: .*digits",
    'study = "heading"\n[axes]\nlength = {start = 1, stop = 2, count = 1e12}': "count: expected",
    'study = "heading"\n[axes]\nlength = {start = 1, stop = 2, count = 1000000000000}': (
        "axes.length: count: expected a whole number >= 1 and <= 1e.08; got 10"
    ),
    f'study = "heading"\n[axes]\nlength = {{start = 1, stop = 0x{"f" * 5000}, count = 2}}': (
        "axes.length: stop: expected a finite number in the range of doubles; got a number"
    ),
    f'study = "heading"\n[axes]\nlength = [{"9" * 400}]': "axes.length: values: expected",
}


@pytest.mark.parametrize(("text", "words"), MISTAKES.items(), ids=range(len(MISTAKES)))
def test_mistakes_name_file_and_field(tmp_path, text, words):
    with pytest.raises(ValueError, match=f"study.toml.*{words}"):
        read_study(written(tmp_path, text), STUDIES)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ValueError, match=r"none\.toml cannot be read"):
        read_study(tmp_path / "none.toml")

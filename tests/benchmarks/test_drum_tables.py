"""Tables of the drum's studies against counts from single calls."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from drum_tables import main, parts_of_variance, pooled

from polycorner.dumbbells.studies import bunch
from polycorner.dumbbells.studies.catalogue import STUDIES
from polycorner.sweeps import read_study, sweep

FOLDER = Path(__file__).parents[2] / "benchmarks" / "drum"
GIVEN = {"count": 12, "duration": 0.2, "top": 60.0, "tilt": -20.0, "rubbing": 0.1}


def rows(text):
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.toml")), ids=lambda f: f.stem)
def test_studies_are_read_and_name_their_own_folder(file):
    assert read_study(file, STUDIES).study in ("bunch", "driven")
    text = file.read_text(encoding="utf-8")
    assert f"benchmarks/drum/{file.name} --out out/drum/{file.stem} --resume" in text


def test_bunches_are_told_by_sets_of_parameters(tmp_path):
    axes = {"start": [0, 1, 3], "sliding": [0.15, 0.3]}
    sweep(bunch, axes, fixed=GIVEN, store=str(tmp_path / "small" / "sweep.zarr"))
    main(["small", "--stores", str(tmp_path), "--out", str(tmp_path / "tables")])
    text = (tmp_path / "tables" / "small.md").read_text(encoding="utf-8")
    assert text.startswith("6 of 6 starts")
    head, _, *lines = rows(text)[:4]
    assert [line[0] for line in lines] == ["0.15", "0.3"]
    single = {s: [bunch(start, sliding=s, **GIVEN) for start in (0, 1, 3)] for s in (0.15, 0.3)}
    for line in lines:
        at, some = dict(zip(head, line, strict=True)), single[float(line[0])]
        left = [one["left"] for one in some]
        assert at["starts"] == "3"
        assert at["left, start by start"] == ", ".join(map(str, left))
        kinds = [sum(one[f"left_{k}"] for one in some) for k in ("right", "left", "single")]
        assert at["R, L, none"] == ", ".join(map(str, kinds))
        assert at["mean"].startswith(f"{np.mean(left):.1f}")
    kept = json.loads((tmp_path / "tables" / "small.json").read_text(encoding="utf-8"))["runs"]
    assert [run["left"] for run in kept] == [
        one["left"] for pair in zip(*single.values(), strict=True) for one in pair
    ]
    times = [e["time"] for run in kept for e in run["exits"]]
    assert times
    assert max(times) <= 0.2
    assert all(len(run["heap_at"]) == 20 for run in kept)

    head, _, *lines = rows(text)[-5:]
    assert head[:2] == ["start", "left, mean of 2 sets"]
    for start, line in zip((0, 1, 3), lines, strict=True):
        both = [single[s][(0, 1, 3).index(start)]["left"] for s in (0.15, 0.3)]
        assert line[0] == str(start)
        assert line[1].startswith(f"{np.mean(both):.1f}")


def test_parts_of_a_variance():
    """Of sums of a row's and a column's number all, of their products none."""
    rows, columns = np.array([1.0, -1.0, 3.0, -3.0]), np.array([2.0, -2.0])
    one, other = parts_of_variance(7 + rows[:, None] + columns)
    assert [one, other] == pytest.approx([5 / 9, 4 / 9])
    assert parts_of_variance(rows[:, None] * columns) == pytest.approx((0, 0))


def test_correlations_are_within_sets():
    """Two sets that differ in level, in each of which more of one is less of the other."""
    one = [{"heap_at": [k], "left": 10 - k} for k in range(4)]
    other = [{"heap_at": [k + 100], "left": 110 - k} for k in range(4)]
    assert pooled([one, other], "heap_at") == pytest.approx(-1.0)
    assert np.isnan(pooled([[{"heap_at": [1], "left": 2}] * 3], "heap_at"))


def test_pairs_have_a_row_for_each_point(tmp_path):
    from polycorner.dumbbells.studies import driven

    fixed = {"kind": "kicks", "scale": 0.003, "duration": 0.2, "dt": 0.001}
    store = tmp_path / "few" / "sweep.zarr"
    found = sweep(driven, {"strength": [20.0, 40.0]}, fixed=fixed, rng=1, store=str(store))
    main(["few", "--stores", str(tmp_path), "--out", str(tmp_path)])
    head, _, *lines = rows((tmp_path / "few.md").read_text(encoding="utf-8"))
    assert [line[head.index("strength")] for line in lines] == ["20", "40"]
    for k, line in enumerate(lines):
        heading, error = (float(found[f"heading_left{e}"][k]) for e in ("", "_error"))
        assert line[head.index("heading L")] == f"−{-heading:.2f} ± {error:.2f}°"
        assert float(line[head.index("kept")]) == round(float(found["single_kept"][k]), 2)


def test_attraction_and_scatter_have_a_row_for_each_point(tmp_path):
    from polycorner.dumbbells.studies import driven

    fixed = {"kind": "kicks", "strength": 0.0, "scale": 0.003, "duration": 16.0, "dt": 0.002}
    axes, store = {"cohesion": [0.0, 0.1], "scatter": [0.3]}, tmp_path / "glue" / "sweep.zarr"
    found = sweep(driven, axes, fixed=fixed, rng=1, store=str(store))
    main(["glue", "--stores", str(tmp_path), "--out", str(tmp_path)])
    head, _, *lines = rows((tmp_path / "glue.md").read_text(encoding="utf-8"))
    assert [line[head.index("cohesion")] for line in lines] == ["0", "0.1"]
    for k, line in enumerate(lines):
        highest = float(found["highest_right"][k, 0])
        assert line[head.index("highest R")] == f"{highest:.1f}°"


def test_a_study_that_was_not_computed_is_named(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["nothing", "--stores", str(tmp_path), "--out", str(tmp_path)])
    assert "nothing/sweep.zarr" in capsys.readouterr().err


def test_what_the_page_says_of_the_grid_is_in_its_file():
    docs = FOLDER.parents[1] / "docs"
    found = json.loads((docs / "tables" / "friction.json").read_text(encoding="utf-8"))["runs"]
    told = " ".join((docs / "drum_results.md").read_text(encoding="utf-8").split())

    def means(*axes):
        sets = {}
        for run in found:
            sets.setdefault(tuple(run[a] for a in axes), []).append(run["left"])
        return {key: float(np.mean(left)) for key, left in sets.items()}

    hands = [[e["as"] for e in run["exits"]] for run in found]
    right, left = (sum(h.count(k) for h in hands) for k in ("R", "L"))
    every, number = means("sliding_ratio", "rolling", "rubbing", "sliding"), sum(map(len, hands))
    assert len(every) * 10 == len(found) == 320
    assert f"{min(every.values()):.1f} to {max(every.values()):.1f} leave" in told
    paper = (docs / "paper.md").read_text(encoding="utf-8")
    assert f"no mean of ten starts is above {max(every.values()):.1f}" in paper
    assert sum(run["left"] >= 40 for run in found) == 2
    assert "Two of 320 bunches lose forty or more" in told
    assert f"are a third of the {number:,} that leave, left-handed ones another" in told
    assert [right / number, left / number] == pytest.approx([1 / 3, 1 / 3], abs=0.02)
    assert f"a majority in {sum(2 * h.count('R') > len(h) for h in hands)} bunches" in told
    sliding, rubbing = means("sliding"), means("rubbing")
    others = [n for (value,), n in sliding.items() if value > 0.5]
    least, most = f"{min(others):.1f}", f"{max(others):.1f}"
    assert f"of 0.3, {sliding[0.3,]:.1f} leave in the mean, else {least} to {most}" in told
    assert f"of 0.05 {rubbing[0.05,]:.1f}, with 0.3 {rubbing[0.3,]:.1f}" in told
    ratios = means("sliding_ratio", "sliding")
    low, high = (round(n) for (_, value), n in sorted(ratios.items()) if value < 0.5)
    assert f"({low} leave in the mean of the grid, and {high} with a dynamic" in paper


def test_what_the_page_says_of_those_that_leave_is_in_its_files():
    docs = FOLDER.parents[1] / "docs"
    told = " ".join((docs / "drum_results.md").read_text(encoding="utf-8").split())
    files = [docs / "tables" / f"{name}.json" for name in ("captions", "steps")]
    several = [json.loads(file.read_text(encoding="utf-8"))["runs"] for file in files]
    several[1] = [run for run in several[1] if run["dt"] == 0.004]
    exits = [[e for run in runs for e in run["exits"]] for runs in several]
    headings = [[e["heading"] for e in some] for some in exits]
    count, middle = sum(map(len, exits)), [round(float(np.median(h))) for h in headings]
    assert min(map(min, headings)) > 0
    assert f"All {count} have positive headings, {middle[0]} and {middle[1]}°" in told
    times = [np.array([e["time"] for e in run["exits"]]) for runs in several for run in runs]
    together = sum(int((abs(t - one) <= 1).sum() > 2) for t in times for one in t)
    assert "more than one in five leaves within a second of two others" in told
    assert together / count > 0.2
    early = np.mean([one <= 300 for t in times for one in t])
    assert early == pytest.approx(2 / 3, abs=0.02)
    space = rows((docs / "tables" / "space.md").read_text(encoding="utf-8"))[-6:]
    numbers = [cell.replace(",", "").split() for cell in (row[4] for row in space)]
    left, right, other = (sum(int(cell[k]) for cell in numbers) for k in (0, 1, 3))
    assert f"{right} of {left} in right-handed dyads, {other} in left-handed ones" in told


def test_what_the_page_says_of_noise_and_of_steps_is_in_its_files():
    docs = FOLDER.parents[1] / "docs"
    told = " ".join((docs / "drum_results.md").read_text(encoding="utf-8").split())
    noisy = json.loads((docs / "tables" / "captions_noise.json").read_text(encoding="utf-8"))
    runs = {}
    for run in noisy["runs"]:
        runs.setdefault((run["kicks"] > 0, run["strength"] > 0), []).append(run)
    left = {key: np.array([run["left"] for run in some]) for key, some in runs.items()}
    assert {len(some) for some in left.values()} == {5}
    for noise in set(left) - {(False, False)}:
        differences = left[noise] - left[False, False]  # from the same starts
        mean, error = differences.mean(), differences.std(ddof=1) / math.sqrt(5)
        if noise == (True, False):
            assert f"kicks alone let {-mean:.1f} ± {error:.1f} fewer leave" in told
        else:
            assert abs(mean) < 2 * error

    def in_dyads(noise):
        exits = [e for run in runs[noise] for e in run["exits"]]
        middle = round(float(np.median([e["heading"] for e in exits])))
        return sum(e["as"] in "RL" for e in exits), len(exits), middle

    both, none = in_dyads((True, True)), in_dyads((False, False))
    assert f"{both[0]} of {both[1]} leave in dyads" in told
    assert f"headings of {both[2]}° in the median; without noise" in told
    assert f"without noise {none[0]} of {none[1]}, at {none[2]}°" in told

    steps = json.loads((docs / "tables" / "steps.json").read_text(encoding="utf-8"))["runs"]
    half = {run["start"]: run["left"] for run in steps if run["dt"] == 0.002}
    whole = {run["start"]: run["left"] for run in steps if run["dt"] == 0.004}
    most = max(whole, key=whole.__getitem__)
    values = np.array([*half.values()])
    assert f"{values.mean():.1f} ± {values.std(ddof=1) / math.sqrt(10):.1f} in half" in told
    assert f"One start loses {whole[most]}, or {half[most]} in half the step" in told

"""Mistakes that only these commands know: a line, and the words that its one sentence holds.

Values of a wrong kind are tried for all options of all commands in ``tests/cli``.
"""

import commands
import pytest

MISTAKES = {
    "atlas dyad --plane --drum 80": "--plane: expected no --drum beside it; got 80",
    "atlas dyad --plane --length 5": "--length",
    "atlas dyad --plane --heading 5": "--heading: expected an angle in degrees, for a pair in",
    "atlas dyad --heading inf": "--heading",
    "atlas dyad --drum 10": "--length",
    "dyad --ball -3": "--ball",
    "dyad --ball 0": "--ball",
    "dyad --rod 3": "--rod",
    "dyad --rod inf": "--rod",
    "dyad --length 5": "--length",
    "dyad --length inf": "--length: expected a finite number",
    "dyad --drum 10": "--length",
    "dyad --drum -1": "--drum",
    "dyad --rod-weight -1": "--rod-weight",
    "minima dyad --starts 0": "--starts",
    "minima dyad --ball 0": "--ball",
    "paper --section 9": "--section: expected one of 2, 3, 4, 5, 6, 7, 8, A, B, C; got 9",
    "paper X1": "ID: expected a claim that --list shows; got X1",
    "paper e4": "got e4 (did you mean E4?)",
    "paper figures": "figures: expected --out DIR, the folder they go to; got none",
    "paper figures solids": "got solids (did you mean solid?)",
    "paper --workers 0": "--workers",
    "prove --digits 0": "--digits",
    "prove --digits 1e9": "--digits",
    "prove --box t": "--box: expected two numbers",
    "prove --box t=1.4": "--box: expected two numbers",
    "prove --box t=2:1": "--box",
    "prove --box t=1.4:1.6 --box t=1.5:1.6": "--box: expected one for t; got another one",
    "prove --box r=1:2": "--box: expected t or l",
    "prove --minimum H": "--minimum",
    "prove --rod 5": "--rod",
    "view --port 70000": "--port",
    "view --length 2": "--length",
    "view --host 203.0.113.9 --no-browser": "--host: 203.0.113.9 cannot be listened on",
    "view atlas --heading nan": "--heading: expected an angle in degrees; got nan",
    "view trajectory nowhere.nc": "FILE: expected a trajectory written by polycorner drum --out",
    "view atlas --length 7 --drum inf --out a.obj": "--out: expected a file",
    "view dyda": "dyda",
}


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_is_one_sentence(capsys, monkeypatch, tmp_path, line):
    monkeypatch.chdir(tmp_path)
    code, out, err = commands.run(capsys, *line.split())
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("polycorner: ")
    assert MISTAKES[line] in err

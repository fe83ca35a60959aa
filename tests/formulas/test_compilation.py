"""Functions that are only linked into others, and the digest of their sources."""

import pytest

from polycorner.formulas.cache import sources_digest
from polycorner.formulas.linking import linked


def test_python_cannot_call_what_is_only_linked():
    twice = linked()(lambda x: 2 * x)
    with pytest.raises(SystemError):
        twice(5)


def test_the_digest_depends_on_names_and_bytes(tmp_path, monkeypatch):
    folder = tmp_path / "leaves"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "leaf.py").write_text("LEAF = 1")
    monkeypatch.syspath_prepend(str(tmp_path))
    digests = [sources_digest("leaves")]
    (folder / "leaf.py").write_text("LEAF = 2")
    digests.append(sources_digest("leaves"))
    (folder / "leaf.py").rename(folder / "twig.py")
    digests.append(sources_digest("leaves"))
    (folder / "other.py").touch()
    digests.append(sources_digest("leaves"))
    assert len(set(digests)) == 4
    assert sources_digest("leaves", without=("other.py",)) == digests[2]
    assert sources_digest("leaves", only=("__init__.py", "twig.py")) == digests[2]


def test_only_packages_have_a_digest():
    with pytest.raises(ValueError, match="package: expected the name of an importable package"):
        sources_digest("json.decoder")

"""Kernels of generated expressions are kept away from the user's cache."""

import pytest


@pytest.fixture(scope="module")
def kernels_elsewhere(tmp_path_factory):
    """Keep what is compiled in one module in a folder of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("POLYCORNER_CACHE_DIR", str(tmp_path_factory.mktemp("kernels")))
        yield

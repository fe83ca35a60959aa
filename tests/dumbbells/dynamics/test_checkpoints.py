"""Checkpoints of another version; what else they do is tested with the runs they are of."""

import numpy as np
import pytest

from polycorner.dumbbells.dynamics.checkpoints import FORMAT, STATE, Checkpoint


def test_a_newer_checkpoint_is_refused_naming_both_versions(tmp_path):
    book = Checkpoint(tmp_path, {"count": 1})
    np.savez(tmp_path / STATE, format=np.array(FORMAT + 1), key=np.array(book.key))
    told = rf"^checkpoint: expected version {FORMAT}; .* has version {FORMAT + 1}$"
    with pytest.raises(ValueError, match=told):
        book.restore(None)

"""What Python runs first in processes of tests that are run with ``--disturbed``."""

import os
import sys


class Late:
    """Disturbs linear algebra once NumPy is there, and loads nothing in a process without it."""

    def find_spec(self, name, *_):
        if name.startswith("polycorner.") and hasattr(sys.modules.get("numpy"), "linalg"):
            sys.meta_path.remove(self)
            from linear_algebra import Disturbed

            Disturbed.install_once(int(os.environ["POLYCORNER_DISTURBED"]))


sys.meta_path.insert(0, Late())

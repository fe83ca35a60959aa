"""What Python runs first in processes of tests that are run with ``--disturbed``."""

import os

from linear_algebra import Disturbed

Disturbed(int(os.environ["POLYCORNER_DISTURBED"])).install()

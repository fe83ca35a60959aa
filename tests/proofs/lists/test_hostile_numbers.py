"""Whatever they are given, compiled tests of boxes and compiled formulas keep to their arrays."""

import checked_memory
import pytest


@pytest.mark.parametrize("kind", ["boxes", "formulas"])
def test_no_number_leads_out_of_an_array(kind):
    checked_memory.run("hostile_numbers", kind, 1, 30)

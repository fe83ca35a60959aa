"""How the stages of the descent are compiled."""

from polycorner.formulas.linking import linked

compiled = linked(error_model="numpy")

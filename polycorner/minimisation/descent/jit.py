"""Compilation options of the stages of the descent."""

from polycorner.formulas.linking import linked

compiled = linked(error_model="numpy")

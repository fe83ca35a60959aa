"""The compiled engine of motion."""

"""Dumbbells in the rotating drum: single ones, dyads and bunches."""

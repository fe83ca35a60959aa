"""Sparse linear algebra for polyhedra with thousands of coordinates and functions."""

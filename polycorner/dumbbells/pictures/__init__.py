"""Figures and three-dimensional models of dumbbells."""

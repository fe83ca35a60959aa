"""Minima, skeletons and sensitivities of a pair of dumbbells, and the keel of one."""

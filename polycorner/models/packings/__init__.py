"""Jammed packings of discs and spheres."""

"""An energy on a polyhedron: where it rests, and why."""

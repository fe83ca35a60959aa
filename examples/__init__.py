"""Examples, each a module with a ``main`` that returns what it shows."""

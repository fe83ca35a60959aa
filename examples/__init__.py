"""Examples: modules with a ``main`` that returns the result."""

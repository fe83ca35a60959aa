"""Claims, running them, and reports on them."""

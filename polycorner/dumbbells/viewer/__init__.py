"""Interactive pages in the browser."""

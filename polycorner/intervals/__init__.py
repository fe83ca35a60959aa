"""Ball arithmetic: enclosures of values and derivatives over boxes."""

"""Everything one looks at; never imported by the core."""

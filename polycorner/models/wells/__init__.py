"""Potential wells on a line: U, half-U and half-V."""

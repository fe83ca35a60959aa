"""Smooth functions on products of lines and circles."""

"""Sphinx extensions of the site: formulas, API page, pictures of the gallery, link checks."""

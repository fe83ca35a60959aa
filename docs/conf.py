"""Sphinx configuration: `make docs` builds the site, with warnings as errors."""

from importlib.metadata import version as installed_version

project = "polycorner"
author = "The polycorner developers"
copyright = author
version = release = installed_version("polycorner")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
    "myst_parser",
    "sphinx_copybutton",
]
exclude_patterns = ["_build", "paper_table.md"]  # the table is part of paper.md

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings state types and shapes
numpydoc_show_class_members = False  # autodoc lists the members already

copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True

html_theme = "pydata_sphinx_theme"
html_title = "polycorner"
html_theme_options = {"show_toc_level": 2, "show_prev_next": True}
html_show_sourcelink = False
html_copy_source = False

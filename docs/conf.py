"""Sphinx configuration: `make docs` builds the site, with warnings as errors and no network."""

import sys
import warnings
from importlib import import_module
from importlib.metadata import version as installed_version
from pathlib import Path

from numpydoc.xref import DEFAULT_LINKS

# The gallery's workers are replaced when their memory has grown, which is as well.
warnings.filterwarnings("ignore", message="A worker stopped while some jobs were given")

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))  # for `docs.extensions`
ROOMS = import_module("docs.extensions.homes").ROOMS

project = "polycorner"
author = "The polycorner developers"
copyright = author
version = release = installed_version("polycorner")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "numpydoc",
    "myst_parser",
    "sphinx_copybutton",
    "sphinx_gallery.gen_gallery",
    "docs.extensions.api",
    "docs.extensions.homes",
    "docs.extensions.links",
    "docs.extensions.mathml",
    "docs.extensions.rooms",
    "docs.extensions.tidy",
]
exclude_patterns = [
    "_build",
    "paper_table.md",  # a part of paper.md
    "tables",  # parts of drum_results.md
    "generated/gallery/*.zip",
    "generated/backreferences/*",
    "templates",
]
templates_path = ["templates"]

myst_enable_extensions = ["amsmath", "attrs_inline", "deflist", "dollarmath"]
myst_heading_anchors = 3

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings state types and shapes
numpydoc_show_class_members = False  # autodoc lists the members already
numpydoc_xref_param_type = True  # types in docstrings are links ...
numpydoc_xref_ignore = "all"  # ... where they are among these
numpydoc_xref_aliases = {name: name for name in DEFAULT_LINKS} | {
    "array": "numpy.ndarray",
    "Generator": "numpy.random.Generator",
    "sympy.Expr": "sympy.core.expr.Expr",
    "Figure": "matplotlib.figure.Figure",
    "MultiGraph": "networkx.MultiGraph",
    "trimesh.Trimesh": "trimesh.base.Trimesh",
    "Dataset": "xarray.Dataset",
    "callable": "collections.abc.Callable",
    "iterable": "collections.abc.Iterable",
    "mapping": "collections.abc.Mapping",
    "sequence": "collections.abc.Sequence",
    "Fraction": "fractions.Fraction",
    "Path": "pathlib.Path",
}
numpydoc_xref_aliases |= {
    name: f"{room}.{name}"
    for room in reversed(ROOMS)
    for name in import_module(room).__all__
    if name[0].isupper()
}
nitpicky = True  # a name that is set as a link leads to its description ...
nitpick_ignore = [
    ("py:attr", "exits"),  # a field without a default is no attribute of its class
    ("py:func", "solve_step"),  # stands in a table of summaries
]

# Where other projects describe their names: their address, and a list of those that are used here.
_DOCUMENTED_AT = {
    "python": "https://docs.python.org/3",
    "numpy": "https://numpy.org/doc/stable",
    "scipy": "https://docs.scipy.org/doc/scipy",
    "matplotlib": "https://matplotlib.org/stable",
    "networkx": "https://networkx.org/documentation/stable",
    "sympy": "https://docs.sympy.org/latest",
    "trimesh": "https://trimesh.org",
    "xarray": "https://docs.xarray.dev/en/stable",
}
intersphinx_mapping = {
    name: (address, str(HERE / "inventories" / f"{name}.txt"))
    for name, address in _DOCUMENTED_AT.items()
}

sphinx_gallery_conf = {
    "examples_dirs": ["../examples"],
    "gallery_dirs": ["generated/gallery"],
    "backreferences_dir": "generated/backreferences",
    "doc_module": ("polycorner",),
    "filename_pattern": r"ex\d\d_",
    "ignore_pattern": r"__init__\.py",
    "within_subsection_order": "FileNameSortKey",
    "nested_sections": False,
    "image_scrapers": ("docs.extensions.gallery.pictures",),
    "reset_argv": "docs.extensions.gallery.arguments",
    "reset_modules": (),
    "capture_repr": (),
    "notebook_extensions": set(),
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 10_000,  # never: it says more about the machine
    "thumbnail_size": (480, 336),
    "parallel": 2,
}

copybutton_prompt_text = r"\$ |>>> |\.\.\. "
copybutton_prompt_is_regexp = True

html_theme = "pydata_sphinx_theme"
html_title = "polycorner"
html_theme_options = {"show_toc_level": 2, "show_prev_next": True}
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_show_sourcelink = False
html_copy_source = False
html_show_search_summary = False  # a page opened from disk may not read another

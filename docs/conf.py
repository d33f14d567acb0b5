"""Sphinx settings; `python docs/build.py` builds everything, offline."""

from mpmbench import __version__

project = "mpmbench"
author = "the mpmbench developers"
version = release = __version__
extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_heading_anchors = 3
# Formulas stay as TeX in the page where no network is: nothing is loaded from elsewhere.
mathjax_path = "mathjax-is-not-loaded.js"
exclude_patterns = ["_build"]
html_theme = "pydata_sphinx_theme"
html_title = f"mpmbench {version}"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False}
html_sidebars = {"index": []}
numpydoc_show_class_members = False
autodoc_typehints = "none"
suppress_warnings = ["myst.xref_missing"]  # links of included reports to files beside them

"""Sphinx settings; `python docs/build.py` builds everything, offline."""

import sys
from pathlib import Path

from mpmbench import __version__

sys.path.insert(0, str(Path(__file__).parent))  # formulas.py

project = "mpmbench"
author = "the mpmbench developers"
version = release = __version__
extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "formulas"]
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_dmath_double_inline = True
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "pydata_sphinx_theme"
html_title = f"mpmbench {version}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False}
WITHOUT_SIDEBAR = ("index", "gallery", "tutorial", "trust", "reports/which_method/README")
html_sidebars = {name: [] for name in WITHOUT_SIDEBAR}
numpydoc_show_class_members = False
autodoc_typehints = "none"

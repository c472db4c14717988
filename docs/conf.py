"""How the documentation is built: sphinx-build -W -n -b html docs docs/_build"""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "_extensions"))

project = "ballplate"
author = copyright = "The ballplate authors"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "console_examples",
    "generated_pages",
    "limit_tables",
    "mathml",
    "study_rules",
]
exclude_patterns = ["_build", "_extensions"]
nitpicky = True
# Types in signatures are those of NumPy, pandas and Python, whose pages are not at hand.
nitpick_ignore_regex = [("py:.*", ".*")]

# In docstrings, single backticks are code.
default_role = "code"
autodoc_typehints_format = "short"
autodoc_default_options = {"undoc-members": False}

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = "ballplate"
html_math_renderer = "mathml"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_theme_options = {
    "top_of_page_buttons": [],
    "light_css_variables": {"code-font-size": "0.75rem"},
    "dark_css_variables": {"code-font-size": "0.75rem"},
}
# Two hyphens are the beginning of an option, not a dash.
smartquotes = False

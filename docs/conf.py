"""How the documentation is built: sphinx-build -W -n -b html docs docs/_build"""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
# The source tree itself, so that pages tell of this version and not of one that happens to be installed.
sys.path[:0] = [str(HERE / "_extensions"), str(HERE.parent)]

project = "ballplate"
author = copyright = "The ballplate authors"
extensions = ["myst_parser", "console_examples", "generated_pages", "mathml"]
exclude_patterns = ["_build", "_extensions"]
nitpicky = True

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

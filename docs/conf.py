"""Sphinx's settings for the site that `make docs` builds (docs/build_site.py assembles its source)."""

from wristctl.version import __version__

project = "wristctl"
author = "the wristctl authors"
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "numpydoc",
    "sphinx_design",
    "sphinx_copybutton",
]
root_doc = "docs/index"
source_suffix = {".md": "markdown"}
exclude_patterns = ["experiments/**", "wristctl/**", "tests/**", "benchmarks/**"]  # linked files, no pages

myst_enable_extensions = ["colon_fence", "dollarmath", "strikethrough"]
myst_heading_anchors = 4
# Code fences of the README say what they show; these have no lexer of their own.
suppress_warnings = ["misc.highlighting_failure", "myst.strikethrough"]  # it is for HTML alone, as this site is

autodoc_typehints = "signature"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
autosummary_generate = False  # numpydoc brings it along
default_role = "code"  # docstrings put code between single backticks
nitpicky = False

html_theme = "pydata_sphinx_theme"
html_title = "wristctl"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_context = {"default_mode": "auto"}  # light or dark, as the reader's system is
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "navbar_align": "left",
    "header_links_before_dropdown": 8,
    "navigation_with_keys": True,
    "show_prev_next": True,
    "show_nav_level": 1,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}
copyright = "the wristctl authors, MIT licence"
copybutton_prompt_text = "$ "
copybutton_only_copy_prompt_lines = True

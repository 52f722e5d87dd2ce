"""The documentation as a site: `make docs` builds it with Sphinx and MyST."""

from importlib.metadata import version as installed

project = "Regraft"
author = "The Regraft developers"
release = version = installed("regraft")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 4
html_theme = "furo"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_typehints = "description"
nitpicky = False
# Links to files of the project that are no pages, whose existence the tests check; examples with "..." in them.
suppress_warnings = ["myst.xref_missing", "misc.highlighting_failure"]

"""Configuration of Sphinx. `make docs` gathers the sources of the site (make_site.py) and builds it with this."""

from __future__ import annotations

import os
from importlib.metadata import version as version_of

GITHUB, UNPUBLISHED = "https://github.com/", "_owner_/codesign-bench"
REPOSITORY = os.environ.get("REPOSITORY") or f"{GITHUB}{UNPUBLISHED}"
"""Where the project is published; the workflow that publishes the site sets it. The notebooks name the same address,
and get this one when the site is built. `_owner_` can be nobody's name on GitHub: write the owner's here and there."""

project = "codesign-bench"
author = "The codesign-bench authors"
copyright = "the codesign-bench authors"
release = version_of("codesign-bench")
html_title = f"{project} {release}"

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]

# Notebooks are run at every build, so their outputs are those of this version.
nb_execution_mode = "force"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
# The libraries that our adapters extend need not be installed, and their own docstrings are not ours to show.
autodoc_mock_imports = ["stable_baselines3", "tensordict", "torchrl"]
# Types of arrays keep their names; their shapes are in the docstrings.
autodoc_type_aliases = {name: name for name in ("Booleans", "Floats", "Frame", "Singles", "Slots", "Array")}
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True
toc_object_entries = False
# Words such as "source" in a docstring are names in several modules; they are not meant as links.
suppress_warnings = ["ref.python"]
default_role = "code"

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#1c5fa8", "color-brand-content": "#1c5fa8"},
    "dark_css_variables": {"color-brand-primary": "#7db4ee", "color-brand-content": "#7db4ee"},
}
pygments_style, pygments_dark_style = "a11y-high-contrast-light", "a11y-high-contrast-dark"

linkcheck_ignore = [rf".*{UNPUBLISHED}.*"]
linkcheck_retries = 3

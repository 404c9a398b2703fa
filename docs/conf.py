"""Sphinx's configuration. The build needs no network: no intersphinx, no fonts, no scripts from elsewhere."""

import os
import sys
from importlib.metadata import version as installed
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE / "_ext")]

project = "sealtwin"
author = "The sealtwin developers"
project_copyright = author
version = release = installed("sealtwin")

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml", "reference"]
exclude_patterns = ["_build", "_ext", "paper"]

EXAMPLES = HERE.parent / "examples"
HAS_GALLERY = any(EXAMPLES.glob("plot_*.py"))
# They take up to 20 s each: 'make docs-gallery' runs them.
RUNS_EXAMPLES = os.environ.get("GALLERY") == "1"
if HAS_GALLERY:
    extensions.append("sphinx_gallery.gen_gallery")
    sphinx_gallery_conf = {
        "examples_dirs": [str(EXAMPLES)],
        "gallery_dirs": ["gallery"],
        "filename_pattern": r"/plot_",
        "within_subsection_order": "FileNameSortKey",
        "plot_gallery": RUNS_EXAMPLES,
        "reset_modules": ("matplotlib", "gallery_hooks.name_file"),
        "download_all_examples": False,
        "show_signature": False,
        "write_computation_times": False,
    }

myst_enable_extensions = ["attrs_block", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# "--format" is an option, and no dash.
smartquotes = False

autodoc_typehints = "description"
autodoc_member_order = "bysource"
autodoc_typehints_description_target = "documented"
toc_object_entries_show_parents = "hide"

html_theme = "pydata_sphinx_theme"
html_math_renderer = "mathml"
html_static_path = ["_static"]
# An example that was not run has no picture of its own.
html_css_files = ["site.css", *([] if RUNS_EXAMPLES else ["no-thumbnails.css"])]
html_title = "sealtwin"
html_show_sourcelink = False
html_copy_source = False
# Pages without pages below them have nothing to show in a sidebar.
html_sidebars = {"tutorial": [], "accuracy": [], "figures": [], "validation": []}
html_theme_options = {
    "logo": {"text": "sealtwin"},
    "header_links_before_dropdown": 7,
    "show_prev_next": True,
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "navbar_persistent": ["search-button"],
}


def leave_out_gallery(app: Sphinx, page: str, source: list[str]) -> None:
    if page == "index":
        source[0] = source[0].replace("Examples <gallery/index>\n", "")


def setup(app: Sphinx) -> None:
    if not HAS_GALLERY:
        app.connect("source-read", leave_out_gallery)

"""Configuration of Sphinx. Importing this module generates the pages that describe the code."""

import gc
import os
import re
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
# The worked example of each block runs once, so optimised compilation would take longer than it saves.
os.environ.setdefault("ARMBLOCKS_EFFORT", "little")
# Most objects live until the end. By default, garbage collection takes a seventh of the processor time.
gc.set_threshold(100_000, 10, 1000)

from code_breaks import break_code_in_tables  # noqa: E402
from generated_pages import write_generated_pages  # noqa: E402
from name_links import link_names  # noqa: E402
from reference_signatures import ALIASES, readable_signature, shorten_annotations  # noqa: E402
from theme_pictures import show_by_theme  # noqa: E402

from armblocks.pictures.style import PALETTE, Tone  # noqa: E402

project = "armblocks"
author = "The armblocks developers"
copyright = "The armblocks developers"

extensions = ["myst_parser", "sphinx.ext.autodoc"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "armblocks"
pygments_dark_style = "github-dark"
html_theme_options = {
    f"{theme}_css_variables": {
        name: PALETTE[Tone.ACCENT].of(theme)
        for name in (
            "color-brand-primary",
            "color-brand-content",
            "color-brand-visited",
        )
    }
    for theme in ("light", "dark")
}
html_show_sourcelink = False
html_copy_source = False
html_domain_indices = False  # modules are described on the pages of their classes
html_show_search_summary = (
    False  # browsers do not fetch summaries for pages on the disk
)
html_static_path = ["reference/static"]
html_css_files = ["pictures.css"]

smartquotes = False  # formulas contain straight quotes and double minus signs
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist"]
# No formulas in TeX: pages with them load MathJax from the network.
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = ALIASES
autodoc_default_options = {"members": True}
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 110
add_module_names = False


OPTION = re.compile(r'<span class="pre">(--[\w-]+)</span>')

navigation_of_folder = {}
"""The navigation of the pages outside the table of contents, for each folder."""


def share_navigation(app, pagename, templatename, context, doctree):
    """Create the navigation of the pages of all blocks once: the links in it are the same for a folder."""
    if "orphan" in app.env.metadata.get(pagename, {}):
        folder, create = pagename.rpartition("/")[0], context["toctree"]

        def navigation(**options):
            key = folder, *sorted(options.items())
            if key not in navigation_of_folder:
                navigation_of_folder[key] = create(**options)
            return navigation_of_folder[key]

        context["toctree"] = navigation


def mark_options(app, pagename, templatename, context, doctree):
    """Mark the options of commands in the text; browsers would break a line between their hyphens."""
    if "body" in context:
        context["body"] = OPTION.sub(
            r'<span class="pre option">\1</span>', context["body"]
        )


def setup(app):
    """Connect the functions of this folder to the events of Sphinx, which calls this function."""
    shorten_annotations()
    app.connect("autodoc-process-signature", readable_signature)
    app.connect("source-read", link_names)
    app.connect("source-read", show_by_theme)
    app.connect(
        "html-page-context", share_navigation, priority=100
    )  # before the theme reads it
    app.connect("html-page-context", mark_options)
    app.connect("html-page-context", break_code_in_tables)


# Called before Sphinx searches for sources and static files.
write_generated_pages(HERE / "reference")

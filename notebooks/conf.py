"""Sphinx: pages and notebooks. Build with ``sphinx-build -W notebooks build/docs``."""

import re
import sys
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from _pages import HERE, lead_to_pages, make_pages  # noqa: E402

import ikns  # noqa: E402

make_pages()

project = "ikns"
author = "The ikns developers"
release = ikns.__version__
extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "_mathml",
]
exclude_patterns = ["paper/**", "recordings/**", "**.ipynb_checkpoints"]
root_doc = "index"

# Notebooks hold their outputs, and the tests execute them.
nb_execution_mode = "off"
myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "dollarmath"]
myst_heading_anchors = 4

autodoc_typehints = "none"
autodoc_member_order = "bysource"
toc_object_entries = False  # each page has a table of its names
numpydoc_show_class_members = False
numpydoc_validation_checks: set[str] = set()

html_theme = "furo"
html_title = f"ikns {release}"
html_theme_options = {"navigation_with_keys": True}
html_math_renderer = "mathml"
html_static_path = ["generated/pages.css"]
html_css_files = ["pages.css"]
# Nobody looks for what the search and the tables of names find.
html_use_index = html_domain_indices = html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
smartquotes = False  # two hyphens are an option


def _lead_to_pages(app: Any, name: str, text: list[str]) -> None:
    path = Path(app.env.doc2path(name))
    if path.suffix == ".md" and path.parent != HERE / "generated":
        text[0] = lead_to_pages(text[0], path.parent, path.parent)


def _reach_by_keyboard(
    app: Any, page: str, template: str, context: dict[str, Any], tree: Any
) -> None:
    """Let keys scroll what is wide, and captions of the sidebar say their level.

    These are the serious findings of axe-core (WCAG 2.1) in what Sphinx and Furo write.
    """
    body = context.get("body", "")
    context["body"] = re.sub(
        r'<(pre|div class="table-wrapper[^"]*")(?=[ >])', r'<\1 tabindex="0"', body
    )
    sidebar = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = sidebar.replace(
        'role="heading"', 'role="heading" aria-level="2"'
    )


def setup(app: Any) -> None:
    """Links in pages lead to files, as a reader of the repository needs them."""
    app.connect("source-read", _lead_to_pages)
    app.connect("html-page-context", _reach_by_keyboard, priority=900)  # after Furo

"""Sphinx configuration of the site; `docs/build_site.py` writes its pages to build/source and calls Sphinx."""

from docutils.nodes import SkipNode
from latex2mathml.converter import convert
from pygments.lexer import RegexLexer, bygroups
from pygments.token import Generic, Keyword

from cablestudy import __version__
from cablestudy.cli.help import examples

project = "cablestudy"
author = "the cablestudy authors"
copyright = author
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "sphinx_click"]

nitpicky = True
# types of docstrings in words ("sequence of str") are no references
nitpick_ignore_regex = [("py:.*", ".*")]

smartquotes = False  # two hyphens are an option
myst_fence_as_directive = ["math"]  # as code hosts write equations
html_math_renderer = "mathml"  # which browsers show without a font or script from elsewhere
myst_heading_anchors = 4  # links to headings as code hosts make them
myst_links_external_new_tab = False
suppress_warnings = ["myst.xref_ambiguous"]

numpydoc_show_class_members = False
numpydoc_xref_param_type = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"

templates_path = []
exclude_patterns = []
html_theme = "pydata_sphinx_theme"
html_title = "cablestudy"
html_static_path = ["_static"]
html_css_files = ["cablestudy.css"]
html_show_sourcelink = False
html_copy_source = False
html_sidebars = {"tutorial": [], "gallery": [], "index": []}
html_theme_options = {
    "show_prev_next": True,
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "show_nav_level": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "pygments_light_style": "tango",
    "pygments_dark_style": "monokai",
}


class Console(RegexLexer):
    """A block of the terminal: commands after `$ `, and what they print as it is."""

    name = "console"
    tokens = {"root": [(r"(\$ )(.*\n)", bygroups(Generic.Prompt, Keyword.Namespace)), (r".*\n", Generic.Output)]}  # noqa: RUF012


def show_examples(app, context, lines):
    """Put the examples of a command into a block of code."""
    lines[:] = [".. code-block:: bash", "", *(f"   {line}" for line in examples(context.command.name))]


def typeset(translator, node):
    """Write an equation as MathML."""
    translator.body.append(f'<div class="equation">{convert(node.astext(), display="block")}</div>')
    raise SkipNode


def setup(app):
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", inline_renderers=(typeset, None), block_renderers=(typeset, None))
    app.add_lexer("console", Console)
    app.connect("sphinx-click-process-epilog", show_examples)

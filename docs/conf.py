# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Sphinx: written pages, and those of the catalogue and the library, made from the sources."""

from pathlib import Path
import sys

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import catalogue  # noqa: E402

project = 'linkage_ros'
author = 'linkage_ros contributors'
project_copyright = '2026, linkage_ros contributors'

extensions = ['myst_parser', 'sphinx.ext.autodoc', 'sphinx.ext.autosummary', 'sphinx.ext.napoleon']
myst_heading_anchors = 3
autosummary_generate = False
autodoc_member_order = 'bysource'
autodoc_preserve_defaults = True
autodoc_typehints = 'none'  # the docstrings name the types
default_role = 'py:obj'
napoleon_google_docstring = False
napoleon_use_ivar = True
strip_signature_backslash = True  # a name may end in _
exclude_patterns = ['_build']
smartquotes = False

html_theme = 'furo'
html_title = 'linkage_ros'
html_show_sphinx = False
html_static_path = ['_static']
html_css_files = ['page.css']
html_theme_options = {'announcement': (
    'No <code>ros2</code> command? <em>Install</em> says what to type instead: '
    '<em>Without the ros2 command line</em>.')}


def setup(app):
    """Write the pages of the catalogue before Sphinx reads pages."""
    app.connect('builder-inited', lambda app: catalogue.write(HERE / 'mechanisms'))

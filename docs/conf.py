# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

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

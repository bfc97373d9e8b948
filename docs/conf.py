# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License");
# you may not use this file except in compliance with the License.
# You may obtain a copy of the License at
#
#     http://www.apache.org/licenses/LICENSE-2.0
#
# Unless required by applicable law or agreed to in writing, software
# distributed under the License is distributed on an "AS IS" BASIS,
# WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
# See the License for the specific language governing permissions and
# limitations under the License.

"""Sphinx: Markdown pages, and those of the catalogue, which are made from the sources."""

from pathlib import Path
import sys

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import catalogue  # noqa: E402

project = 'linkage_ros'
author = 'linkage_ros contributors'
project_copyright = '2026, linkage_ros contributors'

extensions = ['myst_parser']
myst_heading_anchors = 3
exclude_patterns = ['_build']
smartquotes = False

html_theme = 'furo'
html_title = 'linkage_ros'
html_show_sphinx = False


def setup(app):
    """Write the pages of the catalogue before Sphinx reads pages."""
    app.connect('builder-inited', lambda app: catalogue.write(HERE / 'mechanisms'))

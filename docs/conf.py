# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

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

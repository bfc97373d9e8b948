# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""What was measured, put into the pages between two marks."""

from pathlib import Path

DOCS = Path(__file__).parents[1] / 'docs'
BEGIN, END = '<!-- measured -->', '<!-- end of what is measured -->'


def write(page, text):
    """Replace what a page of docs/ says between the marks."""
    before, _, rest = (DOCS / page).read_text().partition(BEGIN)
    after = rest.partition(END)[2]
    (DOCS / page).write_text(f'{before}{BEGIN}\n\n{text.rstrip()}\n\n{END}{after}')


def written(page):
    """Return what a page of docs/ says between the marks."""
    return (DOCS / page).read_text().partition(BEGIN)[2].partition(END)[0].strip()

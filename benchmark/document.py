# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What was measured, put into the pages, each part between two marks of its own."""

from pathlib import Path

DOCS = Path(__file__).parents[1] / 'docs'
END = '<!-- end of what is measured -->'


def write(page, text, part='measured'):
    """Replace what a page of docs/ says between the marks of a part."""
    before, begin, rest = _split(page, part)
    after = rest.partition(END)[2]
    (DOCS / page).write_text(f'{before}{begin}\n\n{text.rstrip()}\n\n{END}{after}')


def written(page, part='measured'):
    """Return what a page of docs/ says between the marks of a part."""
    return _split(page, part)[2].partition(END)[0].strip()


def _split(page, part):
    return (DOCS / page).read_text().partition(f'<!-- {part} -->')

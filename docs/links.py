# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Check a folder of web pages: whatever a page links to on this machine must be there."""

from html.parser import HTMLParser
from pathlib import Path
import sys
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The places in a page that can be linked to, and what it links to."""

    def __init__(self, file: Path):
        super().__init__()
        self.places, self.links = set(), []
        self.feed(file.read_text(encoding='utf-8'))

    def handle_starttag(self, tag, attrs):
        """Note the names, links and sources of a tag."""
        attributes = dict(attrs)
        self.places |= {attributes[key] for key in ('id', 'name') if attributes.get(key)}
        self.links += [attributes[key] for key in ('href', 'src') if attributes.get(key)]


def broken(folder: Path):
    """Yield a line for each link that leads nowhere."""
    pages = {file.resolve(): Page(file) for file in sorted(folder.rglob('*.html'))}
    if not pages:
        yield f'{folder}: no pages'
    for file, page in pages.items():
        for link in page.links:
            url = urlsplit(link)
            if url.scheme or url.netloc:
                continue
            target = (file.parent / unquote(url.path)).resolve() if url.path else file
            if target.is_dir():
                target /= 'index.html'
            if not target.exists():
                yield f'{file}: {link} does not exist'
            elif url.fragment and target in pages \
                    and unquote(url.fragment) not in pages[target].places:
                yield f'{file}: {link} has no such place'


if __name__ == '__main__':
    problems = list(broken(Path(sys.argv[1])))
    print('\n'.join(problems), end='\n' if problems else '', file=sys.stderr)
    sys.exit(bool(problems))

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Texts of users and other programs: plain, and short enough to be quoted in a message."""

from difflib import get_close_matches
import reprlib
from typing import Any, Iterable

# Maximum number of letters of a quoted value, of a whole message, and of a line in a terminal.
MAX_QUOTED, MESSAGE, MAX_LINE = 60, 599, 20_000

_short = reprlib.Repr()
_short.maxstring = _short.maxother = _short.maxlong = MAX_QUOTED
_short.maxlevel = 3
_short.maxlist = _short.maxtuple = _short.maxdict = MAX_QUOTED // 3


def plain_text(value: Any) -> Any:
    """Return a text of any class (numpy's, an enum's) as plain text, all else as it is."""
    return str.__str__(value) if isinstance(value, str) else value


def truncated(text: str, limit: int = MAX_QUOTED) -> str:
    """Return a text as one line of limited length, with unprintable letters escaped."""
    start = ''.join(c if c.isprintable() else ascii(c)[1:-1] for c in text[:limit + 1])
    return start if len(start) <= limit else start[:limit - 3] + '...'


def brief(text: Any) -> str:
    """Return a text as a whole message: one line of limited length."""
    return truncated(str(text), MESSAGE)


def sentence(text: Any) -> str:
    """Return a text for a terminal: one line of limited length, as is each of its words."""
    return truncated(' '.join(map(brief, str(text).split())), MAX_LINE)


class RequestError(Exception):
    """An invalid request to a command; each of its texts is a sentence on a line of its own."""

    def __init__(self, *texts: Any):
        self.lines = [*map(sentence, texts)]
        super().__init__(' '.join(self.lines))


def short_repr(value: Any) -> str:
    """Return a value as Python writes it, at most MAX_QUOTED letters of it."""
    try:
        return truncated(_short.repr(value))
    except Exception:
        # An integer of more digits than Python writes, or a class that cannot write itself.
        return f'a {truncated(type(value).__name__, MAX_QUOTED - 2)}'


def n_inputs(count: int) -> str:
    """Return '1 input', '2 inputs' and so on."""
    return f'{count} input' + 's' * (count != 1)


def did_you_mean(word: Any, names: Iterable[str]) -> str:
    """Return a suggestion, to end a sentence, of the name most similar to a word; '' if none."""
    by_case = {name.lower(): name for name in names}
    text = word[:MAX_QUOTED].lower() if isinstance(word, str) else ''
    near = get_close_matches(text, by_case, 1, 0.7)
    return ''.join(f'; did you mean {truncated(by_case[name])}?' for name in near)


def suggestion(word: Any, names: Iterable[str], limit: int = MAX_QUOTED) -> str:
    """Return the end of a sentence on an unknown word: the allowed names, and the most similar."""
    names = list(names)
    return f'; allowed: {join_names(names, limit)}{did_you_mean(word, names)}'


def join_names(names: Iterable[str], limit: int = MAX_QUOTED) -> str:
    """Return names separated by commas; of many, the first ones and the number of all."""
    names = list(names)
    shown, text = [], ''
    for name in names:
        shown.append(truncated(name, limit // 2))
        text = ', '.join(shown)
        if len(text) > limit:
            return ', '.join((*shown[:-1], f'... ({len(names)})'))
    return text or 'none'

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Linkages as text: one line per joint, in the order in which the joints are placed.

The page "Joint lines" of the documentation explains words and numbers; FORMS has the arguments.

A dyad stays on its side of first -> second as long as it can be assembled, except at a change
point. A dyad between a ground joint and a crank pin has one if the longest and the shortest of
the four bars are together as long as the other two: it stretches or folds just as the crank
passes the ground line. There it continues smoothly and changes sides, so a parallelogram stays a
parallelogram; `left` or `right` in its line is the side at a crank angle of a quarter turn. The
block of a slider on a crank pin has one where its rod is square to the line, and continues
smoothly, too; `out` or `in` is then the side where the pin is farthest along the line. A linkage
with one change point in a turn repeats only after two turns, so its crank angle counts beyond a
turn. Where an arm has no length, what stands on it has the limit from both sides if they agree,
as at a change point; else it is NaN.
"""

from __future__ import annotations

from math import prod
import re
from typing import Any, Iterable, Mapping, NamedTuple, Sequence

import numpy as np

from .arithmetic import ARITHMETIC_WORDS, Formula, IN_RANGE, in_range
from ..geometry.builder import Builder, ConstructionError, Gear
from ...cache import cached
from ...formula.expression import Real
from ...words import did_you_mean, join_names, short_repr, truncated

_WORDS = {'left': 1.0, 'right': -1.0, 'out': 1.0, 'in': -1.0}
_JOINTS = ('CENTRE', 'BASE', 'FIRST', 'SECOND', 'POINT', 'CORNER', 'POLE', 'PIN', 'PIVOT',
           'ORIGIN', 'JOINT', 'TOWARDS', 'LINK')
_NUMBERS = ('X', 'Y', 'Z', 'U', 'V', 'W', 'LENGTH', 'DISTANCE', 'OFFSET', 'ANGLE', 'RATIO')

# The arguments of each word, in the order of its construction's parameters; options in brackets.
# Each word of INPUTS adds an input, unless that is geared to another.
FORMS = {
    'ground': ('ground X Y',),
    'crank': ('crank CENTRE LENGTH [up] [zero JOINT] [geared INPUT RATIO ANGLE] [called NAME]',),
    'cylinder': (
        'cylinder BASE PIVOT LENGTH left|right [geared INPUT RATIO DISTANCE] [called NAME]',),
    'carriage': ('carriage ORIGIN along TOWARDS DISTANCE DISTANCE '
                 '[geared INPUT RATIO DISTANCE] [called NAME]',),
    'yoke': ('yoke PIN ORIGIN along TOWARDS',),
    'block': ('block JOINT X Y',),
    'dyad': ('dyad FIRST SECOND LENGTH LENGTH left|right',),
    'rigid': ('rigid FIRST SECOND LENGTH LENGTH left|right',),
    'line': ('line FIRST SECOND DISTANCE',),
    'mirror': ('mirror POINT FIRST SECOND',),
    'parallelogram': ('parallelogram CORNER FIRST SECOND',),
    'antiparallelogram': ('antiparallelogram CORNER FIRST SECOND',),
    'image': ('image POINT FIRST SECOND',),
    'mirrored': ('mirrored FIRST SECOND',),
    'inversor': ('inversor POLE PIN LENGTH LENGTH',),
    'slot': ('slot PIVOT PIN OFFSET out|in LENGTH',),
    'slider': ('slider PIN LENGTH ORIGIN ANGLE out|in',
               'slider PIN LENGTH ORIGIN along TOWARDS out|in'),
}
INPUTS = 'crank', 'cylinder', 'carriage'
_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]{0,63}')
# Reserved names of dimensions: words of arithmetic, and parameters of `mechanisms.create`.
_RESERVED = (*ARITHMETIC_WORDS, 'joints', 'tracer', 'branches')
# Reserved names of inputs: the ground, and groups of parameters.
_RESERVED_INPUTS = 'ground', 'dimensions', 'branches'
# Maximum number of lines, images in mirror lines included: each mirror line doubles them.
MAX_LINES = 2000
# Maximum number of letters of a line, and of an error message.
_MAX_LINE, _MAX_ERROR = 10000, 240
# A larger angle [rad] must be written with `deg` or `pi`: otherwise degrees were probably meant.
_TURN = 6.2832

formula = cached(1024)(Formula)


class Argument(NamedTuple):
    """An argument of a word: its kind in the form, its text, and its option, if any."""

    kind: str
    text: str
    option: str = ''


class Line(NamedTuple):
    """One construction: the joints it places, its word, and the word's arguments."""

    text: str
    names: tuple[str, ...]
    word: str
    args: tuple[str, ...]
    arguments: tuple[Argument, ...] = ()
    # The ground joints of each mirror line in which it is an image, in order; and of what.
    mirrors: tuple[tuple[str, ...], ...] = ()
    original: Line | None = None

    @property
    def depends_on(self) -> tuple[str, ...]:
        """Return the joints that it is constructed from."""
        return tuple(arg.text for arg in self.arguments if arg.kind in _JOINTS)

    @property
    def drives(self) -> bool:
        """Whether it adds an input."""
        # A motor is a word of rod lines.
        return self.word in (*INPUTS, 'motor') and not any(
            arg.option == 'geared' for arg in self.arguments)

    @property
    def input_name(self) -> str:
        """Return the name of its input, which may be geared; empty for the default name."""
        return next((arg.text for arg in self.arguments if arg.kind == 'NAME'), '')

    @property
    def sides(self) -> tuple[str, ...]:
        """Return the words for its branches of +1 and -1, if it has two."""
        return next((('left', 'right') if kind == 'left|right' else ('out', 'in')
                     for kind, _, _ in self.arguments if '|' in kind), ())

    def numbers(self) -> Iterable[tuple[str, Formula]]:
        """Yield its numbers, each with its kind; raise ValueError for an invalid one."""
        for kind, text, _ in self.arguments:
            if kind in _NUMBERS:
                try:
                    yield kind, formula(text)
                except ValueError as error:
                    raise self.error(error) from None

    def error(self, problem: object) -> ValueError:
        """Return the error that names this line."""
        return _error(self.text, f'{problem}{_hint(self.args)}')


def _error(line: str, problem: object) -> ValueError:
    return ValueError(truncated(f'joint line "{truncated(line)}": {problem}', _MAX_ERROR))


def _hint(args: Iterable[str]) -> str:
    """Return a hint for a frequent mistake, or an empty text."""
    for arg in args:
        if arg.count('(') != arg.count(')') or arg[0] in '+*/,)' or arg[-1] in '+-*/(':
            return '; arithmetic has no spaces: 2*r, not 2 * r'
        if ',' in arg and 'max(' not in arg:
            return '; numbers are separated by spaces, without commas'
        if '\N{DEGREE SIGN}' in arg or arg in ('deg', 'rad'):
            return '; an angle is in rad, or in degrees: 30deg'
    return ''


def parse(texts: Iterable[str]) -> list[Line]:
    """Return the lines of a linkage; raise ValueError that names an invalid line."""
    lines: list[Line] = []
    for text in texts:
        line = parsed(text)
        lines += _mirrored(lines, line) if line.word == 'mirrored' else [line]
        if len(lines) > MAX_LINES:
            raise line.error(f'a linkage has up to {MAX_LINES} lines, images included')
    check_order(lines)
    return [line for line in lines if line.names]


def _mirrored(lines: list[Line], mirror: Line) -> list[Line]:
    """
    Return a mirror line, which places nothing, and the images of lines in it.

    Lines placed from it alone have none.
    """
    on_mirror = set(mirror.depends_on)
    count: dict[str, int] = {}
    images = [mirror._replace(names=())]
    for line in lines:
        count[line.word] = count.get(line.word, 0) + (not line.input_name)
        if on_mirror >= {*line.names} or line.depends_on and on_mirror >= {*line.depends_on} \
                and line.word in ('line', 'carriage'):
            on_mirror |= {*line.names}
            continue
        if line.word == 'ground':
            images.append(parsed(f'{line.names[0]}{mirror.names[0]} image {line.names[0]} '
                                 f'{" ".join(mirror.depends_on)}')._replace(text=mirror.text))
            continue
        args = [_image(line.word, arg, '' if arg.text in on_mirror else mirror.names[0])
                for arg in line.arguments if arg.option not in ('geared', 'called')]
        if line.word in INPUTS:
            number = count[line.word] if count[line.word] > 1 else ''
            ratio = -1 if line.word == 'crank' else 1
            args += [f'geared {line.input_name or line.word + str(number)} {ratio} 0']
        names = [name + mirror.names[0] for name in line.names[::-1]]
        images.append(parsed(f'{" ".join(names)} {line.word} {" ".join(args)}')._replace(
            text=mirror.text, mirrors=(*line.mirrors, mirror.depends_on),
            original=line.original or line))
    return images


def _image(word: str, arg: Argument, suffix: str) -> str:
    """Return the text of an argument in the image of a line."""
    if arg.kind in _JOINTS:
        text = arg.text + suffix
    elif arg.kind == 'left|right':
        text = 'right' if arg.text == 'left' else 'left'
    else:
        across = (word, arg.kind) in (('slot', 'OFFSET'), ('block', 'Y'))
        text = f'-({arg.text})' if across else arg.text
    word = 'along' if arg.kind == 'TOWARDS' else arg.option if arg.option != arg.text else ''
    return f'{word} {text}'.strip()


def parsed(text: str, forms: Mapping[str, tuple[str, ...]] = FORMS) -> Line:
    """Return one line; raise ValueError if it has none of the forms."""
    if len(text) > _MAX_LINE:
        raise _error(text, f'a line has up to {_MAX_LINE} letters, this has {len(text)}')
    parts = text.split()
    indices = [i for i, part in enumerate(parts) if part in forms and i > 0]
    if not indices:
        for part in parts[1:]:
            if hint := did_you_mean(part, forms):
                raise _error(text, f'unknown construction {short_repr(part)}{hint}')
        raise _error(text, f'expected NAME and one of the constructions {", ".join(forms)}')
    at = indices[0]
    line = Line(text, tuple(parts[:at]), parts[at], tuple(parts[at + 1:]))
    names = 3 if line.word == 'inversor' else 1
    fitting = [arguments for form in forms[line.word]
               if (arguments := _matched(form, line.args)) is not None]
    if len(line.names) != names or not fitting:
        words = [i for i in indices if parts[i - 1] not in ('geared', 'called')]
        several = '; one line per joint' if len(words) > 1 else ''
        expected = ' or '.join(f'"{"NAME " * names}{form}"' for form in forms[line.word])
        raise line.error(f'expected {expected}{several}')
    line = line._replace(arguments=tuple(fitting[-1]))
    for name in line.names:
        if not _NAME.fullmatch(name) or name in forms:
            raise line.error(f'{short_repr(name)} cannot name a joint: a name is a letter, then '
                             'up to 63 letters, digits and underscores, but not a construction')
    if line.input_name and (
            not _NAME.fullmatch(line.input_name) or line.input_name in _RESERVED_INPUTS):
        raise line.error(f'{short_repr(line.input_name)} cannot name an input: a name is a letter'
                         ', then up to 63 letters, digits and underscores, but not '
                         f'{", ".join(_RESERVED_INPUTS)}')
    for kind, arg, _ in line.arguments:
        if '|' in kind and arg not in kind.split('|'):
            raise line.error(f'{short_repr(arg)} must be {kind.replace("|", " or ")}')
    for kind, number in line.numbers():
        if 'deg' in number.words and kind != 'ANGLE':
            raise line.error(
                f'{short_repr(number.text)} is in degrees, but {kind} is not an angle')
    return line


def _matched(form: str, args: tuple[str, ...]) -> list[Argument] | None:
    """Return a word's arguments according to a form; None if they do not match it."""
    required, *options = re.split(r' *\[|\] *\[', form.rstrip(']'))
    _, *kinds = required.split()
    if len(args) < len(kinds) or any(_is_literal(kind) and kind != arg
                                     for kind, arg in zip(kinds, args)):
        return None
    arguments = [Argument(kind, arg) for kind, arg in zip(kinds, args) if not _is_literal(kind)]
    rest = list(args[len(kinds):])
    for word, *kinds in map(str.split, options):
        if rest[:1] == [word] and len(rest) > len(kinds):
            # An option of one word is that word.
            arguments += [Argument(kind, arg, word)
                          for kind, arg in zip(kinds or [word], rest[1:] if kinds else rest)]
            del rest[:1 + len(kinds)]
    return None if rest else arguments


def _is_literal(kind: str) -> bool:
    """Return whether a part of a form is written literally."""
    return kind.islower() and '|' not in kind


def check_order(lines: Sequence[Line], what: str = 'joint', placed: Sequence[str] = (),
                bars: Sequence[str] = ()) -> None:
    """
    Raise ValueError unless each line places something new, from what is placed before it.

    `placed` is there from the beginning; nothing is placed from what lines of `bars` place.
    """
    where = {name: number for number, line in reversed([*enumerate(lines, 1)])
             for name in line.names if line.word not in bars}
    taken, known = {*placed}, dict.fromkeys(placed)
    for number, line in enumerate(lines, 1):
        if len(set(line.depends_on)) < len(line.depends_on):
            raise line.error(f'the {what}s that it is placed from must differ')
        for name in line.depends_on:
            if name not in known and where.get(name, 0) > number:
                raise line.error(
                    f'{what} {name} is placed later, in line {where[name]}: move it up; if it '
                    f'depends on {(line.names or line.text.split())[0]}, they cannot be solved: '
                    'only dyads, groups of two bars, can, not Assur groups of class III as a '
                    'platform on three bars')
            if name not in known:
                raise line.error(f'{what} {truncated(name)} is not placed before; there are: '
                                 f'{join_names(known)}{did_you_mean(name, known)}')
        for name in line.names:
            if name in taken:
                raise line.error(f'{what} {name} is placed already')
            taken.add(name)
            if line.word not in bars:
                known[name] = None


def check_numbers(design: Any, dimensions: Mapping) -> None:
    """Raise ValueError that names the line of an invalid number, for dimensions or arrays."""
    for line in design.lines:
        for kind, number in line.numbers():
            value, text = number.value(dimensions), number.text
            if not np.all(in_range(value)):
                raise line.error(f'{short_repr(text)} must be {IN_RANGE}')
            if kind == 'LENGTH' and not np.all(value > 0.0):
                raise line.error(f'a bar must be longer than zero, got {truncated(text)}')
            if kind == 'ANGLE' and np.any(np.abs(value) > _TURN) and not number.is_angle:
                plain = text.lstrip('-').replace('.', '').isdigit()
                degrees = f'{text}deg' if plain else f'({text})deg'
                raise line.error(f'an angle is in rad, and {truncated(text)} is more than a turn; '
                                 f'in degrees it is written {truncated(degrees)}')


def branches(lines: Iterable[Line]) -> dict:
    """Return the assembly sign, +1 or -1, of each joint with two; an image has its original's."""
    return {line.names[0]: int(_WORDS[arg])
            for line in lines if line.word != 'rigid' and not line.original
            for kind, arg, _ in line.arguments if '|' in kind}


def points(lines: Iterable[Line]) -> list[str]:
    """Return the joints that lines place."""
    return [name for line in lines for name in line.names]


def check_name(name: str) -> None:
    """Raise ValueError if a name is not valid for a dimension."""
    if not isinstance(name, str) or not _NAME.fullmatch(name) or name in _RESERVED:
        raise ValueError(f'{short_repr(name)} cannot name a dimension: a name is a letter, then up'
                         f' to 63 letters, digits and underscores, but not {", ".join(_RESERVED)}')


def lengths(lines: Iterable[Line]) -> dict:
    """Return every dimension that the lines name, and whether it is used as a length."""
    used: dict[str, bool] = {}
    for line in lines:
        for kind, number in line.numbers():
            for name in number.names:
                used[name] = used.get(name, False) or (kind == 'LENGTH' and number.text == name)
    return used


def draw(builder: Builder, lines: Iterable[Line], symbols: Mapping[str, Real],
         signs: Mapping[str, int]) -> None:
    """Place the joints of a linkage, one line after the other."""
    for line in lines:
        plain: list[Any] = []
        options: dict[str, list[Any]] = {}
        for arg in line.arguments:
            values = options.setdefault(arg.option, []) if arg.option else plain
            values.append(_value(line, arg, symbols, signs))
        named = {word: Gear(*values) if word == 'geared' else values[0]
                 for word, values in options.items()}
        names = line.names if len(line.names) > 1 else line.names[0]
        try:
            builder.drawn, builder.mirrors = line, line.mirrors
            getattr(builder, line.word)(names, *plain, **named)
        except ConstructionError as error:
            raise line.error(error) from None


def _value(line: Line, arg: Argument, symbols: Mapping[str, Real],
           signs: Mapping[str, int]) -> str | Real | float | bool:
    """Return the value that a construction takes for an argument of its line."""
    if arg.kind in _NUMBERS:
        return formula(arg.text).expression(symbols)
    if '|' in arg.kind:
        # An image is on the other side where its original is.
        drawn = branches([line.original or line])
        return _WORDS[arg.text] * prod(signs.get(name, sign) * sign
                                       for name, sign in drawn.items())
    return True if arg.kind == arg.text else arg.text

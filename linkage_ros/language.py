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

"""
Linkages written down: one line a joint, in the order they are placed.

    O ground 0 0              a joint fixed to the ground at x y
    A crank O m [up]          on the crank circle of radius m about O, zero to the right [or up]
    B dyad A Q b c left       joined to A by a bar b and to Q by a bar c, left of A -> Q
    P rigid A B d e right     corner of a rigid triangle on bar AB, d from A, e from B
    P line A B d              on the line of bar AB, d from A; negative: on the other side of A
    B mirror O A C            mirror image of O in the line AC: the far corner of a kite
    C parallelogram B A D     corner opposite B of a parallelogram on the bars BA and BD
    B C D inversor P A a b    Peaucellier cell from pole P to pin A: long bars a, rhombus b
    L slot Q A e out d        tip, d from Q, of a lever about Q; A in its slot, e to its left
    S slider A r G p out      block on a line through G in direction p [rad], on a rod r from A

A joint's name begins with a letter, and a letter, digit or underscore follows. `left` and `right`
are as seen along the first two joints; `out` is the half of a slot on the tip's side, or the block
ahead of the pin; `in` the other. A number is a length [m], an angle [rad], a dimension's name, or
a sum, difference, product, quotient or max() of these, without spaces. A dimension that is the
length of a bar must be positive; one that is not may be zero or negative.

A dyad keeps to its side of first -> second for as long as it can be assembled. Only where it is
hung between a ground joint and a crank pin, and stretches or folds just as the crank passes the
ground line (a change point: the longest and shortest of the four bars together as long as the
other two), it goes on smoothly, which changes sides: a parallelogram stays a parallelogram. The
side written is then the one at a crank angle of a quarter turn. So does the block of a slider hung
on a crank pin where the rod stands upright on the line; `out` and `in` are then as they are where
the pin is farthest along it. With one change point in a turn the linkage is the same again only
after two turns: its crank angle counts beyond a turn.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from typing import Iterable, List, Mapping, NamedTuple, Tuple

from .expression import dimension, Number, Real, real, where
from .planar import LEFT, RIGHT
from .sketch import Sketch, SketchError

_WORDS = {'left': LEFT, 'right': RIGHT, 'out': 1.0, 'in': -1.0, 'up': True}
_JOINTS = ('CENTRE', 'FIRST', 'SECOND', 'POINT', 'CORNER', 'POLE', 'PIN', 'PIVOT', 'ORIGIN')
_NUMBERS = ('X', 'Y', 'LENGTH', 'DISTANCE', 'OFFSET', 'ANGLE')

# What follows each word, in the order its construction takes it.
_FORMS = {
    'ground': 'ground X Y', 'crank': 'crank CENTRE LENGTH [up]',
    'dyad': 'dyad FIRST SECOND LENGTH LENGTH left|right',
    'rigid': 'rigid FIRST SECOND LENGTH LENGTH left|right',
    'line': 'line FIRST SECOND DISTANCE', 'mirror': 'mirror POINT FIRST SECOND',
    'parallelogram': 'parallelogram CORNER FIRST SECOND',
    'inversor': 'inversor POLE PIN LENGTH LENGTH',
    'slot': 'slot PIVOT PIN OFFSET out|in LENGTH',
    'slider': 'slider PIN LENGTH ORIGIN ANGLE out|in',
}
_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*')
_OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
              ast.Div: operator.truediv}


class Line(NamedTuple):
    """One construction: the joints it places, its word, and what follows the word."""

    text: str
    names: Tuple[str, ...]
    word: str
    args: Tuple[str, ...]

    def arguments(self) -> Iterable[Tuple[str, str]]:
        """Return what follows the word, each with its kind."""
        return zip(_FORMS[self.word].split()[1:], self.args)

    def error(self, problem: str) -> ValueError:
        """Return the error that names this line."""
        return ValueError(f'joint line "{self.text}": {problem}')


def parse(texts: Iterable[str]) -> List[Line]:
    """Return the lines of a linkage; raise ValueError with the line that has no such form."""
    return [_parsed(text) for text in texts]


def _parsed(text: str) -> Line:
    parts = str(text).split()
    found = [i for i, part in enumerate(parts) if part in _FORMS and i > 0]
    if not found:
        raise ValueError(f'joint line "{text}": expected NAME and one of the constructions '
                         f'{", ".join(_FORMS)}')
    at = found[0]
    line = Line(str(text), tuple(parts[:at]), parts[at], tuple(parts[at + 1:]))
    form = _FORMS[line.word].split()[1:]
    least = sum(not word.startswith('[') for word in form)
    names = 3 if line.word == 'inversor' else 1
    if len(line.names) != names or not least <= len(line.args) <= len(form):
        expected = ' '.join(['NAME'] * names)
        raise line.error(f'expected "{expected} {_FORMS[line.word]}"')
    for name in line.names:
        if not _NAME.fullmatch(name) or name in _FORMS:
            raise line.error(f'{name!r} is no name for a joint: a letter, then letters, digits '
                             'and underscores, but none of the constructions')
    for kind, arg in zip(form, line.args):
        if '|' in kind and arg not in kind.split('|') or kind == '[up]' and arg != 'up':
            raise line.error(f'{arg!r} must be {kind.strip("[]").replace("|", " or ")}')
    return line


def branches(lines: Iterable[Line]) -> dict:
    """Return the assembly sign, +1 or -1, of each joint that can be assembled in two ways."""
    return {line.names[0]: int(_WORDS[arg])
            for line in lines if line.word in ('dyad', 'slot', 'slider')
            for kind, arg in line.arguments() if '|' in kind}


def lengths(lines: Iterable[Line]) -> dict:
    """Return every dimension that the lines name, and whether it is used as a length."""
    found = {}
    for line in lines:
        for kind, arg in line.arguments():
            if kind in _NUMBERS:
                for name in _names(line, arg):
                    found[name] = found.get(name, False) or (kind == 'LENGTH' and arg == name)
    return found


def has_literal_lengths(lines: Iterable[Line]) -> bool:
    """Return whether any line has a length, other than zero, that is no dimension's multiple."""
    def literal(tree):
        if isinstance(tree, ast.Constant):
            return tree.value != 0.0
        if isinstance(tree, ast.UnaryOp):
            return literal(tree.operand)
        if isinstance(tree, ast.BinOp) and isinstance(tree.op, (ast.Mult, ast.Div)):
            return literal(tree.left) and literal(tree.right)
        children = tree.args if isinstance(tree, ast.Call) else ast.iter_child_nodes(tree)
        return any(map(literal, children))

    return any(literal(_tree(line, arg)) for line in lines for kind, arg in line.arguments()
               if kind in _NUMBERS and kind != 'ANGLE')


def draw(sketch: Sketch, lines: Iterable[Line], symbols: Mapping[str, Real],
         signs: Mapping[str, int]):
    """Place the joints of a linkage, one line after the other."""
    for line in lines:
        for name in line.names:
            if name in sketch.points:
                raise line.error(f'joint {name} is placed already')
        joints = [arg for kind, arg in line.arguments() if kind in _JOINTS]
        if len(set(joints)) < len(joints):
            raise line.error('the joints it stands on must differ')
        args = [_argument(sketch, line, kind, arg, symbols, signs)
                for kind, arg in line.arguments()]
        names = line.names if len(line.names) > 1 else line.names[0]
        try:
            getattr(sketch, line.word)(names, *args)
        except SketchError as error:
            raise line.error(error) from None


def _argument(sketch, line, kind, arg, symbols, signs):
    """Return what a construction takes for one word of its line."""
    if kind in _JOINTS:
        if arg not in sketch.points:
            placed = ', '.join(sketch.points) or 'none'
            raise line.error(f'joint {arg} is not placed before; there are: {placed}')
        return arg
    if kind not in _NUMBERS:
        return signs.get(line.names[0], _WORDS[arg])
    value = real(_value(line, _tree(line, arg), symbols))
    if kind == 'LENGTH' and value.value is not None and not value.value > 0.0:
        raise line.error(f'a bar must be longer than zero, got {arg}')
    return value


def _tree(line: Line, text: str) -> ast.expr:
    try:
        return ast.parse(text, mode='eval').body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise line.error(f'{text!r} is no number, dimension or arithmetic on them') from None


def _names(line: Line, text: str) -> set:
    return {node.id for node in ast.walk(_tree(line, text))
            if isinstance(node, ast.Name) and node.id != 'max'}


def _value(line: Line, tree: ast.expr, symbols: Mapping[str, Real]) -> Number:
    if isinstance(tree, ast.Constant) and type(tree.value) in (int, float):
        if not abs(tree.value) < math.inf:
            raise line.error(f'{ast.unparse(tree)} is too large')
        return real(tree.value)
    if isinstance(tree, ast.Name) and tree.id in symbols:
        return symbols[tree.id]
    if isinstance(tree, ast.UnaryOp) and isinstance(tree.op, ast.USub):
        return -real(_value(line, tree.operand, symbols))
    if isinstance(tree, ast.BinOp) and type(tree.op) in _OPERATORS:
        left, right = (_value(line, side, symbols) for side in (tree.left, tree.right))
        if isinstance(tree.op, ast.Div) and right.value == 0.0:
            raise line.error(f'{ast.unparse(tree)} divides by zero')
        return _OPERATORS[type(tree.op)](left, right)
    if isinstance(tree, ast.Call) and getattr(tree.func, 'id', '') == 'max' \
            and len(tree.args) == 2:
        first, second = (_value(line, arg, symbols) for arg in tree.args)
        return where(first < second, second, first)
    known = ', '.join(symbols) or 'none'
    raise line.error(f'{ast.unparse(tree)!r} is no number, dimension or arithmetic on them; '
                     f'dimensions: {known}')


def symbols_of(dimensions: Iterable[str], signed: Iterable[str]) -> dict:
    """Return the leaves of expressions for named dimensions."""
    return {name: dimension(name, positive=name not in signed) for name in dimensions}

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The operations that some expressions need, each once, in an order of evaluation, and their code.

What depends on dimensions alone is a constant of the list.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Mapping, Sequence

from .expression import Real, unknown

# Python's parser limits the nesting of parentheses.
DEEPEST = 16


@dataclass(frozen=True)
class Dialect:
    """Spelling of operations and numbers in code, and the names that the code uses."""

    templates: Mapping[str, str]
    names: Mapping[str, Any]
    number: Callable[[float], str] = repr


class Listing:
    """The operations of outputs, each once, in an order of evaluation."""

    def __init__(self, outputs: Sequence[Real], decided: Mapping[Real, bool]):
        self.entries: list[tuple[Real, tuple]] = []
        self._decided = decided
        self._numbers: dict[tuple, int] = {}
        self._known: dict[Real, int] = {}
        for x in unknown(outputs, self._needed, self._known):
            self._known[x] = self._enter(x)
        self.outputs = [self._known[x] for x in outputs]
        self._uses = self._count_uses()
        # The values of dimensions alone that varying operations use.
        self.constants = [n for n in self._uses if not self.entries[n][0].varies
                          and self.entries[n][0].op != 'constant']

    def _needed(self, node: Real) -> tuple:
        if node.op == 'where' and node.args[0] in self._decided:
            return (node.args[1 if self._decided[node.args[0]] else 2],)
        return node.operands

    def _enter(self, node: Real) -> int:
        needed = self._needed(node)
        if len(needed) == 1 and node.op in ('where', 'rated'):
            return self._known[needed[0]]
        args = tuple(self._known[a] for a in needed) or node.args
        key = node.op, args
        if key not in self._numbers:
            self._numbers[key] = len(self.entries)
            self.entries.append((node, args))
        return self._numbers[key]

    def _count_uses(self) -> dict[int, int]:
        """Return the number of uses of each value, in an order of evaluation."""
        uses: dict[int, int] = {}
        waiting = list(self.outputs)
        while waiting:
            number = waiting.pop()
            uses[number] = uses.get(number, 0) + 1
            node, args = self.entries[number]
            if uses[number] == 1 and node.varies and node.op != 'argument':
                waiting.extend(args)
        return dict(sorted(uses.items()))

    def operations(self) -> tuple:
        """Return the operations as (number, name, operands), the constants and the outputs."""
        return [(number, self.entries[number][0].op, self.entries[number][1])
                for number in self._uses if number not in self.constants
                ], self.constants, self.outputs

    def statements(self, dialect: Dialect) -> tuple[list[tuple[str, str]], list[str]]:
        """Return the assignments as (name, code) and the code of each output."""
        # Operands that a template repeats are evaluated before.
        repeating = {name: [i for i in range(2) if code.count(f'{{{i}}}') > 1]
                     for name, code in dialect.templates.items()}
        repeated = {args[i] for node, args in map(self.entries.__getitem__, self._uses)
                    for i in repeating.get(node.op, ())}
        leaves = {'constant': dialect.number, 'argument': 'x{}'.format}
        text: dict[int, str] = {}
        depth = dict.fromkeys(self._uses, 0)
        lines = []
        for number, uses in self._uses.items():
            node, args = self.entries[number]
            if number in self.constants:
                text[number] = f'k{number}'
            elif node.op in leaves:
                text[number] = leaves[node.op](*args)
            else:
                text[number] = dialect.templates[node.op].format(*(text[a] for a in args))
                depth[number] = 1 + max(depth[a] for a in args)
                if uses > 1 or number in repeated or depth[number] > DEEPEST:
                    lines.append((f'v{number}', text[number]))
                    text[number], depth[number] = f'v{number}', 0
        return lines, [text[n] for n in self.outputs]

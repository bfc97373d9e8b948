# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""
Actuators to joints and joints to actuators, as C functions.

Both are outputs of the linkage. Positions are converted through the inputs, velocities by the
exact Jacobians, efforts by their transposes, so that power is conserved.
"""

import math
from typing import Dict, Iterator, List, Sequence, Tuple

from .axes import actuators, Axis, axis, joints, start
from .code import Code, open_linkage
from .inverses import Inverses
from .names import comment, constants, distinct, field, filled, literal, prefix, template
from ..formula.expression import arctangent, Real
from ..formula.program import Program
from ..scene import SceneMechanism

# Limits by precision. A Jacobian is `singular` below this part of its size, and below `least` for
# Newton's method, which ends where `enough` is left of a position [rad, sizes], and may leave
# `close`, times the rate or `steepest`; an input may be beyond an end by `slack`.
LIMITS = {'double': {'singular': 1e-6, 'least': 1e-12, 'enough': 1e-14, 'close': 1e-13,
                     'steepest': 4e6, 'slack': 1e-9},
          'float': {'singular': 1e-3, 'least': 1e-5, 'enough': 2e-6, 'close': 4e-6,
                    'steepest': 1e3, 'slack': 1e-5}}
# The longest step of Newton's method [rad, sizes], and its finest part. The start of a closed form
# that misses by more than `other` is of another assembly, and tried last: as if `last` further.
# The way outside a sweep of what is measured counts `outside` times more.
COMMON = {'longest': 0.5, 'finest': 2.0 ** -12, 'other': 1e-2, 'last': 1e6, 'outside': 10.0,
          'infinity': math.inf, 'half': 0.5}
# Samples for the first pose of a search.
SAMPLES = 4096


class Sides:
    """
    Writes the actuators and joints of a mechanism, and inverses of its other outputs.

    See `axes.joints` for `names`.
    """

    def __init__(self, machine: SceneMechanism, names: Sequence[str] = (), single: bool = False,
                 is_open: bool = False, outputs: Sequence[Tuple[str, ...]] = ()):
        self.machine, self.name = machine, machine.name
        self.linkage = open_linkage(machine.linkage) if is_open else machine.linkage
        self.code = Code(machine.name, self.linkage, single, is_open)
        self.sizes = [input_.size for input_ in machine.linkage.inputs]
        # Pairs of what stands in a point, and the tag of their function.
        self.pairs = {'': (actuators(machine), joints(machine, names))}
        tags = distinct('_'.join(['', *(field(self.linkage, each) for each in group)])
                        for group in outputs)
        self.pairs.update((tag, ([], [axis(machine, output) for output in group]))
                          for tag, group in zip(tags, outputs))
        self.values: Dict[str, object] = {
            'name': machine.name, 'N': prefix(machine.name), 'n': len(self.sizes),
            'number': self.code.number, 'f': self.code.suffix, 'sides': len(self.pairs) + 1,
            'given': f'const {machine.name}_linkage *c, ' if is_open else '',
            'types': f'const {machine.name}_linkage *, ' if is_open else '',
            'pass': 'c, ' if is_open else '', 'samples': SAMPLES,
            **{key: self.code.literal(value)
               for key, value in {**COMMON, **LIMITS[self.code.number]}.items()}}
        self._inverses = Inverses(machine.linkage, self.code, self.values, self.pairs[''])

    def text(self) -> str:
        """Return all types and functions."""
        first, second = self.pairs['']
        tables = [first, *(own for _, own in self.pairs.values())]
        tags = ['actuators', 'joints', *(tag[1:] for tag in self.pairs if tag)]
        return filled(template('transmission.h.in'), {
            **self.values, **self._inverses.within(), 'at': '\n'.join(map(self._at, self.pairs)),
            'inverses': '\n'.join(map(self._inverses.function, range(len(tags)), tags, tables)),
            'about': self._about(),
            'enums': self._enum('actuator', first) + '\n' + self._enum('joint', second),
            'actuator_names': ', '.join(literal(each.name) for each in first),
            'joint_names': ', '.join(literal(each.name) for each in second),
            'scales': ', '.join('{ %s }' % self.code.rows(
                (1.0 / each.size, 0.5 * each.turn) for each in own) for own in tables),
            'ranges': self.code.rows(self._ranges()),
            'ends': self.code.rows(self._ends())})

    @property
    def poses(self) -> int:
        """Return the largest number of poses of a call, once the text is written."""
        return self._inverses.poses

    def _counted(self, i: int, ends: Sequence[float]) -> Tuple[float, ...]:
        """Return values of an input in units of its size."""
        unit = self.sizes[i] * self.machine.scale_of(self.linkage.inputs[i].name)
        return tuple(end / unit for end in ends)

    def _ranges(self) -> Iterator[Tuple[float, ...]]:
        """Yield the start of each input, the range of its samples, and their step."""
        for i, (drive, first) in enumerate(zip(self.machine.inputs.values(), start(self.machine))):
            low, high = self._counted(i, drive.ends or max(
                drive.reach, key=lambda arc: arc[1] - arc[0]))
            yield first / self.sizes[i], low, high - low, math.sqrt((i + 1) ** 2 + 1.0) % 1.0

    def _ends(self) -> Iterator[Tuple[float, ...]]:
        """Yield the ends of each input's sweep, with what may be beyond them by rounding."""
        slack = LIMITS[self.code.number]['slack']
        for i, drive in enumerate(self.machine.inputs.values()):
            low, high = self._counted(i, drive.ends or (-math.inf, math.inf))
            yield low - slack, high + slack

    def _enum(self, side: str, axes: Sequence[Axis]) -> str:
        upper = f'{prefix(self.name)}_{side.upper()}'
        return 'enum { ' + ', '.join(f'{upper}_{name} = {i}' for i, name in enumerate(
            constants(each.name for each in axes))) + ' };'

    def _about(self) -> str:
        return comment('; '.join(f'{side}: ' + ', '.join(
            f'{each.name} [{"rad" if self.linkage.is_angle(each.output) else "m"}]'
            for each in axes) for side, axes in zip(('Actuators', 'joints'), self.pairs[''])))

    def _at(self, tag: str) -> str:
        """Return the function for a pose: positions, rates by each input, and loads."""
        code, pairs = self.code, self.pairs[tag]
        names = list(dict.fromkeys(each.output for axes in pairs for each in axes))
        loads = [] if tag else list(self._loads())
        outputs = names + [output for output, _ in loads]
        pose = self.linkage.bind(Program(self._checked(tuple(outputs)), len(self.sizes)))

        def ending(codes: List[str]) -> List[str]:
            count = len(outputs)
            by = [codes[count + i * count:][:count] for i in range(len(self.sizes))]
            body: List[str] = []
            rates, places = [], []
            for side, axes in enumerate(pairs):
                for i, each in enumerate(axes):
                    k = names.index(each.output)
                    places.append(f'p->position[{side}][{i}]')
                    body += self._position(places[-1], each, codes[k])
                    rates += [f'    p->rate[{side}][{i}][{j}] = '
                              f'{code.times(by[j][k], each.factor * size)};'
                              for j, size in enumerate(self.sizes)]
            body += [f'    if (!isfinite({" + ".join(places)}))\n        return 0;',
                     '    if (!is_rated)\n        return 1;', *rates]
            powers = [[code.times(by[j][len(names) + k], -load * size)
                       for k, (_, load) in enumerate(loads)] for j, size in enumerate(self.sizes)]
            return [*body, *(
                f'    p->load[{j}] = {" + ".join(each) or code.literal(0.0)};'
                for j, each in enumerate(powers)), '    return 1;']

        return code.function(
            '/* Place it at inputs, each in rad or in its size; 0 if it cannot be assembled. */\n'
            f'static inline int {self.name}_at{tag}({self.values["given"]}'
            f'const {code.number} *q, int is_rated, {self.name}_point *p)', pose,
            [code.times(f'q[{i}]', size) for i, size in enumerate(self.sizes)], ending)

    def _checked(self, outputs: Tuple[str, ...]) -> List[Real]:
        """Return outputs and their rates by each input, NaN unless all joints are assembled."""
        linkage, structure = self.machine.linkage, self.linkage.structure
        row = structure.checked(outputs)
        if self.code.is_open or len(linkage.inputs) > 1 or not linkage.inputs[0].is_whole(
                linkage.reach()):
            return row
        # It can be assembled at any input: no limit needs to be checked.
        return [*map(_undivided, map(structure.output, outputs)), *row[len(outputs):]]

    def _position(self, place: str, each: Axis, value: str) -> Iterator[str]:
        code = self.code
        yield f'    {place} = {code.times(value, each.factor)}' + (
            f' + {code.literal(each.offset)};' if each.offset else ';')
        if each.wraps:
            turn = code.literal(math.tau)
            yield (f'    {place} -= {turn} * floor{code.suffix}({place} / {turn} + '
                   f'{code.literal(0.5)});')

    def _loads(self) -> Iterator[Tuple[str, float]]:
        """Yield outputs on which the scene's loads work, with their factors."""
        scale, links = self.machine.scale, {link.name: link for link in self.linkage.links}
        for name, load in self.machine.loads.items():
            if not isinstance(load, float):
                yield from ((f'{name}.{way}', scale * part) for way, part in zip('xy', load))
                continue
            while name in links:
                if links[name].kind != 'prismatic':
                    yield name, load
                name = links[name].parent


def _undivided(value: Real) -> Real:
    """Return an angle without the length by which both of its coordinates are divided."""
    if value.op != 'atan2':
        return value
    (y, length), (x, other) = map(_fraction, value.args)
    return arctangent(y, x) if length is other and length.op == 'sqrt' else value


def _fraction(x: Real) -> Tuple[Real, Real]:
    """Return the numerator and the divisor of an expression."""
    if x.op == 'divide':
        return x.args
    if x.op == 'rated':
        return _fraction(x.args[0])
    if x.op == 'negative':
        numerator, divisor = _fraction(x.args[0])
        return -numerator, divisor
    return x, x

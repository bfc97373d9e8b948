# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Actuators to joints and joints to actuators, as C functions.

Both are outputs of the linkage. Positions are converted through the inputs, velocities by the
exact Jacobians, efforts by their transposes, so that power is conserved.
"""

from importlib.resources import files
from itertools import product
import math
from typing import Dict, Iterable, Iterator, List, Sequence, Tuple

import numpy as np

from .axes import actuators, Axis, axis, joints, start
from .code import Code, open_linkage
from .names import comment, constants, field, filled, literal
from ..formula.expression import arctangent, Real, real
from ..formula.program import Program
from ..linkage.builder import in_metres
from ..linkage.inverse_linkage import InverseLinkage, Mode
from ..scene import SceneMechanism

# In double and in single precision: below which part of its size a Jacobian is singular, and in a
# search; what a search may miss, an input may be beside its sweep, and what is near enough.
LIMITS = {'double': (1e-6, 1e-12, 1e-13, 1e-9, 1e-14),
          'float': (1e-3, 1e-5, 4e-6, 1e-5, 2e-6)}
# Poses from a closed form and of a search, its longest step [rad, sizes] and the smallest part.
CLOSED, SEARCHED, LONGEST, FINEST = 4, 64, 0.5, 2.0 ** -12
# A start of a closed form that is off by more is for another assembly [rad, sizes].
OTHER = 1e-2
# What is tried last is taken as further away by this.
LAST = 1e6
# Inputs that are no further apart are one [rad, sizes].
ALIKE = 1e-6
# Samples for the first pose of a search.
SAMPLES = 4096


def template(name: str) -> str:
    """Return a template of this room."""
    return files(__package__).joinpath('templates', name).read_text()


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
        for group in outputs:
            own = [axis(machine, output) for output in group]
            self.pairs['_' + '_'.join(field(self.linkage, each) for each in group)] = [], own
        number, one = self.code.literal, {'half': 0.5, 'zero': 0.0, 'one': 1.0, 'two': 2.0}
        limits = dict(zip(('singular', 'least', 'close', 'slack', 'enough'),
                          LIMITS[self.code.number]), longest=LONGEST, finest=FINEST,
                      other=OTHER, last=LAST, infinity=math.inf)
        self.values: Dict[str, object] = {
            'name': machine.name, 'N': machine.name.upper(), 'n': len(self.sizes),
            'number': self.code.number, 'f': self.code.suffix, 'sides': len(self.pairs) + 1,
            'given': f'const {machine.name}_linkage *c, ' if is_open else '',
            'types': f'const {machine.name}_linkage *, ' if is_open else '',
            'pass': 'c, ' if is_open else '', 'samples': SAMPLES, 'closed': CLOSED,
            **{key: number(value) for key, value in {**one, **limits}.items()}}
        self.poses = 0

    def text(self) -> str:
        """Return all types and functions."""
        machine, (first, second) = self.machine, self.pairs['']
        scales = [first, *(own for _, own in self.pairs.values())]
        inverses = [self._inverse(0, 'actuators', first), *(
            self._inverse(i, tag[1:] or 'joints', own)
            for i, (tag, (_, own)) in enumerate(self.pairs.items(), 1))]
        return filled(template('transmission.h'), {
            **self.values, 'at': '\n'.join(map(self._at, self.pairs)),
            'inverses': '\n'.join(inverses), 'within': self._within(),
            'clamped': (f' && !(is_strict && {self.name}_within(q, 1)\n            && at('
                        f'{self.values["pass"]}q, side < 2, p))') if self._arcs() else '',
            'about': self._about(),
            'enums': self._enum('actuator', first) + '\n' + self._enum('joint', second),
            'actuator_names': ', '.join(literal(each.name) for each in first),
            'joint_names': ', '.join(literal(each.name) for each in second),
            'scales': ', '.join(self._rows((1.0 / each.size, 0.5 * each.turn) for each in own)
                                for own in scales),
            'ways': self._rows((at, *way) for at, way in zip(self._start(), self._ways()))[1:-1],
            'ends': self._rows(self._counted(i, drive.ends or (-math.inf, math.inf))
                               for i, drive in enumerate(machine.inputs.values()))[1:-1]})

    def _rows(self, rows: Iterable[Sequence[float]]) -> str:
        return '{ ' + ', '.join(f'{{ {self.code.row(row)} }}' for row in rows) + ' }'

    def _counted(self, i: int, ends: Sequence[float]) -> Tuple[float, ...]:
        """Return values of an input in units of its size."""
        unit = self.sizes[i] * self.machine.scale_of(self.linkage.inputs[i].name)
        return tuple(end / unit for end in ends)

    def _start(self) -> List[float]:
        return [value / size for value, size in zip(start(self.machine), self.sizes)]

    def _ways(self) -> Iterator[Tuple[float, ...]]:
        """Yield the start, range and step of each input's samples."""
        for i, drive in enumerate(self.machine.inputs.values()):
            low, high = self._counted(i, drive.ends or max(
                drive.reach, key=lambda arc: arc[1] - arc[0]))
            yield low, high - low, math.sqrt((i + 1) ** 2 + 1.0) % 1.0

    def _enum(self, side: str, axes: Sequence[Axis]) -> str:
        upper = f'{self.name}_{side}'.upper()
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
            return [*self._strokes(), *body, *(
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

    def _strokes(self) -> Iterator[str]:
        """Yield the code that refuses inputs beyond their strokes."""
        for i, (drawn, input_, size) in enumerate(zip(
                self.linkage.structure.built.inputs, self.machine.linkage.inputs, self.sizes)):
            if not input_.turns:
                low, high = (self.code.constant(in_metres(real(end)) / size, value / size)
                             for end, value in zip(drawn[2:4], input_[2:4]))
                yield f'    if (!(q[{i}] >= {low} && q[{i}] <= {high}))\n        return 0;'

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

    def _inverse(self, side: int, tag: str, axes: Sequence[Axis]) -> str:
        """Return the function from positions to the inputs."""
        linkage, code = self.machine.linkage, self.code
        inputs = {input_.name: i for i, input_ in enumerate(linkage.inputs)}
        values = [code.times(
            f'position[{i}]' + (f' - {code.literal(each.offset)}' if each.offset else ''),
            1.0 / each.factor) for i, each in enumerate(axes)]
        outputs = tuple(each.output for each in axes)
        closed = None if inputs.keys() >= {*outputs} else linkage.inverse(outputs).closed
        start = ' '.join(f'start[0][{i}] = near[{i}];' for i in inputs.values())
        made, count, steps, how, stop, moved = '', 1, f'{CLOSED}', 'By its gear', 'break;', ''
        strict, tries = '0', CLOSED
        if closed:
            made, count = self._modes(tag, outputs, closed, values)
            start, how = f'{self.name}_modes_{tag}(position, start);', 'In closed form'
            strict, tries = f'far < {code.literal(LAST)}', CLOSED + 2
            if code.is_open and linkage.dimensions:
                start = (f'if (c->is_own)\n        {start}\n    else\n        for (k = 0; k < '
                         f'{count}; k++)\n            for (i = 0; i < {len(inputs)}; i++)\n'
                         f'                start[k][i] = k ? {code.literal(math.nan)} : near[i];')
                steps, how = f'c->is_own ? {CLOSED} : {SEARCHED}', (
                    'In closed form; with other dimensions by a search')
                strict, tries = f'c->is_own && {strict}', SEARCHED
        elif not inputs.keys() >= {*outputs}:
            steps, tries, how = f'{SEARCHED}', SEARCHED + 1, 'By a search'
            if len(inputs) == 1 and not code.is_open:
                middles = [0.5 * (low + high) / self.sizes[0] for low, high, *_ in
                           linkage.monotone(outputs[0], math.inf)[0]]
                count, stop, moved = 1 + len(middles), '', (
                    f'far = {self.name}_away(start[next], near);')
                start += ''.join(f'\n    start[{k}][0] = {code.literal(value)};'
                                 for k, value in enumerate(middles, 1))
        for value, output in zip(values, outputs):
            if output in inputs:
                i = inputs[output]
                start += (f'\n    for (k = 0; k < {count}; k++)\n        start[k][{i}] = '
                          f'{code.times(value, 1.0 / self.sizes[i])};')
        most = count * tries
        self.poses = max(self.poses, most)
        measured = side == 0 and how != 'By its gear'
        return made + filled(template('inverse.h'), {
            **self.values, 'tag': tag, 'side': side, 'count': count, 'steps': steps, 'stop': stop,
            'moved': moved, 'strict': strict,
            'starts': f'    {start}', 'how': f'{how}, {most} poses at most',
            'at': f'{self.name}_at' + (f'_{tag}' if side > 1 else ''),
            'turns': self._rows((input_.turn, 1.0 / input_.turn) if input_.turns and
                                input_.name not in outputs else (0.0, 0.0)
                                for input_ in linkage.inputs)[1:-1],
            'inside': f'\n                && {self.name}_inside(start[next])' * measured})

    def _modes(self, tag: str, outputs: Tuple[str, ...], closed: InverseLinkage,
               values: Sequence[str]) -> Tuple[str, int]:
        """Return the function for the inputs of all assembly modes, and their number."""
        inputs, number = self.machine.linkage.inputs, self.code.number
        n, code = len(inputs), Code(self.name, self.machine.linkage, number == 'float')
        # If an input has a period of several turns, each turn has its own pose.
        turns, modes = list(product(*closed.turns)), self._own_modes(outputs, closed)
        count = len(modes) * len(turns)
        program = Program([value for mode in modes for value in mode.inputs], len(values),
                          closed.given)

        def ending(codes: List[str]) -> List[str]:
            body = []
            for k, (mode, turned) in enumerate(product(range(len(modes)), turns)):
                for i in range(n):
                    place, value = f'start[{k}][{i}]', codes[mode * n + i]
                    value += f' + {code.literal(turned[i])}' if turned[i] else ''
                    body.append(f'    {place} = {code.times(value, 1.0 / self.sizes[i])};')
                if self._arcs():
                    body.append(f'    {place} = {self.name}_within(start[{k}], 0) ? {place} : '
                                f'{code.literal(math.nan)};')
            return body

        return code.function(
            '/* The inputs in each assembly mode, NAN where there is none. */\n'
            f'static inline void {self.name}_modes_{tag}(const {number} position[{n}],\n'
            f'    {number} start[{count}][{n}])',
            self.machine.linkage.bind(program), values, ending), count

    def _arcs(self) -> List[Tuple[float, float]]:
        """Return middles and half the lengths of the reach, [] where it has no ends."""
        inputs = self.machine.linkage.inputs
        if len(inputs) > 1 or inputs[0].is_whole(self.machine.linkage.reach()):
            return []
        inside = LIMITS[self.code.number][-1]
        return [(0.5 * (low + high) / inputs[0].size, 0.5 * (high - low) / inputs[0].size - inside)
                for low, high in self.machine.linkage.reach()]

    def _within(self) -> str:
        """Return the function that holds the input to its reach, '' where that has no ends."""
        arcs, input_ = self._arcs(), self.machine.linkage.inputs[0]
        turn = input_.turn if input_.turns else 0.0
        return filled(template('within.h'), {
            **self.values, 'arc_count': len(arcs), 'arcs': self._rows(arcs)[1:-1],
            'turn': self.code.literal(turn), 'by_turn': self.code.literal(turn and 1.0 / turn)
            }) if arcs else ''

    def _own_modes(self, outputs: Tuple[str, ...], closed: InverseLinkage) -> Sequence[Mode]:
        """Return the assembly modes in which a linkage of one input is anywhere in its reach."""
        linkage, modes = self.machine.linkage, closed.modes
        if len(outputs) > 1:
            return modes
        # Between extremes of the output the mode is the same; in the middle two may meet.
        pieces, _ = linkage.monotone(outputs[0], math.inf)
        inputs = np.array([low + 0.382 * (high - low) for low, high, *_ in pieces])
        starts = linkage.bind(Program([mode.inputs[0] for mode in modes], 1, closed.given)).over(
            linkage.posed((), outputs).over(inputs)[0])
        gaps, turn = np.add.outer(closed.turns[0], starts) - inputs, linkage.inputs[0].turn
        if linkage.inputs[0].turns:
            gaps -= turn * np.round(gaps / turn)
        is_own = np.abs(gaps).min(axis=0) < ALIKE * linkage.inputs[0].size
        return [mode for mode, own in zip(modes, is_own.any(axis=1)) if own] if is_own.any(
            axis=0).all() else modes

    def checks(self) -> Iterator[Tuple[Real, str]]:
        """Yield expressions of dimensions that must be positive, with their error messages."""
        built = self.linkage.structure.built
        for bar in built.bars:
            yield bar.length, f'the bar {bar.first}-{bar.second} must be longer than zero'
        for name, height in built.triangles.items():
            yield (abs(height) + real(1.0),
                   f'no triangle has the sides at {name}: each must be shorter than the others')
        for input_ in built.inputs:
            if not input_.turns:
                yield real(input_.high) - input_.low, f'the {input_.name} must have a way to go'


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

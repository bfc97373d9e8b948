# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A mechanism as a C99 header: pose and rates, actuators and joints, the inverse of some outputs.

The operations and their order are those of the Python code, so the results are equal up to the C
library's sine, cosine and arctangent. What all mechanisms have in common is `linkage.h`.
"""

from __future__ import annotations

from typing import List, NamedTuple, Sequence

import numpy as np

from .axes import actuators, Axis, axis, check_inverse, joints, loads
from .code import Code, indented
from .formulas import Formulas
from .model import Model
from .names import comment, constants, distinct, field, filled, prefix, template
from ..scene import SceneMechanism
from ..words import listed, plain_text

# Number of inputs at which the error of `float` is measured.
SAMPLED = 2001


class Request(NamedTuple):
    """
    A mechanism to be written.

    Attributes
    ----------
    machine : SceneMechanism
        Mechanism of a scene; lengths include its scale, and only its first leg is written.
    outputs : sequence of str
        Outputs, as for `input_for`, with an inverse each.
    joints : sequence of str
        Commanded joints, see `axes.joints`.
    passive : sequence of Axis
        Joints that are not commanded, in a function of their own.

    """

    machine: SceneMechanism
    outputs: Sequence[str] = ()
    joints: Sequence[str] = ()
    passive: Sequence[Axis] = ()


def written(machine: SceneMechanism, outputs: Sequence[str] = (), single: bool = False,
            joints: Sequence[str] = ()) -> str:
    """
    Return the header of a mechanism, see `Request`; `single`: with float instead of double.

    Raises
    ------
    ValueError
        If an output or a joint does not exist, there are too few of them, or without an inverse.

    """
    return printed([Request(machine, outputs, joints)], single)


def printed(requests: Sequence[Request], single: bool = False) -> str:
    """Return the headers of mechanisms, one after another, and what they have in common."""
    most = max(len(request.machine.inputs) for request in requests)
    common = template('linkage.h')
    return '\n'.join(header(request, single, most, '' if i else common)
                     for i, request in enumerate(requests))


def header(request: Request, single: bool, most: int, common: str) -> str:
    """Return a header that begins with the text `common`, for `most` inputs in the program."""
    return _Header(request, single).text(most, common)


class _Header:
    """Writes one header."""

    def __init__(self, request: Request, single: bool):
        self.machine, self.name = request.machine, request.machine.name
        self.linkage = linkage = request.machine.linkage
        if self.name == 'lkr' or self.name.startswith('lkr_'):
            raise ValueError(f'{self.name} cannot be the name of a mechanism in C: names that '
                             'begin with lkr are those that all linkages share')
        outputs, n = [plain_text(output) for output in request.outputs], len(linkage.inputs)
        for output in outputs:
            linkage.check_output(output)
        if outputs and n > 1 and len(outputs) != n:
            raise ValueError(f'{self.name} has {n} inputs: as many outputs are needed, '
                             f'got {listed(outputs)}')
        groups = [(output,) for output in outputs] if n == 1 else [tuple(outputs)] * bool(outputs)
        inverses = [[axis(self.machine, output, output) for output in group] for group in groups]
        for axes in inverses:
            check_inverse(self.machine, axes)
        self._sides = actuators(self.machine), joints(self.machine, request.joints)
        needed = [each.output for axes in (*self._sides, *inverses) for each in axes]
        self._code = Code(linkage, single)
        self._formulas = Formulas(self.machine, self._code, [
            *needed, *(output for output, _ in loads(self.machine))])
        tags = distinct('_'.join(['', *(field(linkage, each) for each in group)])
                        for group in groups)
        self._models = [Model(self.machine, self._code, self._formulas, self._sides)]
        self._models += [Model(self.machine, self._code, self._formulas, ([], axes), tag)
                         for axes, tag in zip(inverses, tags)]
        self._inverses = list(zip(tags, inverses))
        self._passive = request.passive

    def text(self, most: int, common: str) -> str:
        """Return the whole header."""
        first, *others = self._models
        models = [first.text(), *(text for model, (tag, axes) in zip(others, self._inverses)
                                  for text in (model.text(), self._inverse(tag, axes)))]
        models += [first.passive(self._passive)] * bool(self._passive)
        return filled(template('mechanism.h.in'), {
            'about': '\n'.join(f' * {line}' for line in self._about()),
            'name': self.name, 'N': prefix(self.name), 'common': common.rstrip(), 'most': most,
            'inputs': len(self.linkage.inputs), 'float': int(self._code.number == 'float'),
            'number': self._code.number, 'pose': self._formulas.text(),
            'enums': '\n'.join(map(self._enum, ('actuator', 'joint'), self._sides)),
            'axes': self._axes(), 'model': models[0], 'inverses': '\n'.join(models[1:])})

    def _about(self) -> List[str]:
        linkage = self.linkage
        lengths = ', '.join(f'{name} = {length:.9g}'
                            for name, length in linkage.dimensions.items())
        inputs = ', '.join(f'{input_.name} [{input_.unit}]' for input_ in linkage.inputs)
        scale = f', times {self.machine.scale:.9g}' if self.machine.scale != 1.0 else ''
        lines = [f'{self.name}: {linkage.type}, written by linkage_ros.',
                 f'Lengths [m]{scale}: {lengths or "those of the joint lines"}.',
                 f'Input: {inputs}. Angles [rad] count counterclockwise.', *self._reach(),
                 f'A call takes at most {max(model.poses for model in self._models)} poses.']
        return lines + [self._error()] * (self._code.number == 'float')

    def _reach(self) -> List[str]:
        if len(self.linkage.inputs) > 1 or self.linkage.inputs[0].is_part:
            return []
        ranges = ' or '.join(f'[{low:.6g}, {high:.6g}]' for low, high in self.machine.first.reach)
        return [f'It can be assembled in {ranges} {self.linkage.inputs[0].unit}.']

    def _enum(self, side: str, axes: Sequence[Axis]) -> str:
        upper = f'{prefix(self.name)}_{side.upper()}'
        return 'enum { ' + ', '.join(f'{upper}_{name} = {i}' for i, name in enumerate(
            constants(each.name for each in axes))) + ' };'

    def _axes(self) -> str:
        return comment('; '.join(f'{side}: ' + ', '.join(
            f'{each.name} [{"rad" if self.linkage.is_angle(each.output) else "m"}]'
            for each in axes) for side, axes in zip(('Actuators', 'joints'), self._sides)))

    def _inverse(self, tag: str, axes: Sequence[Axis]) -> str:
        """Return the users' inverse: from outputs and near inputs, in scene units, to inputs."""
        formulas, code, n = self._formulas, self._code, len(axes)
        number, units = code.number, [input_.size * formulas.unit(input_.name)
                                      for input_ in self.linkage.inputs]
        names = ', '.join(f'{each.output} [{"rad" if self.linkage.is_angle(each.output) else "m"}]'
                          for each in axes)
        if n == 1:
            what, out, given, near, made = (
                formulas.inputs[0], formulas.given[0], '&value', ['near'],
                [f'*{formulas.given[0]}'])
            head = f'{number} value, {number} near, {number} *{out}'
        else:
            what, given = 'inputs', 'value'
            near, made = ([f'{name}[{i}]' for i in range(n)] for name in ('near', 'inputs'))
            head = f'const {number} value[{n}], const {number} near[{n}], {number} inputs[{n}]'
        return '\n'.join([
            f'/* The {what} for {names}, nearest to `near`, whole turns included. Returns 0, and',
            f'   leaves {what} alone, where there is none. */',
            f'static inline int {self.name}_{what}_for{tag}({head})', '{',
            *indented([
                f'{number} q[{n}];', 'lkr_point p;',
                *(f'q[{i}] = {code.times(each, 1.0 / units[i])};' for i, each in enumerate(near)),
                f'if (!{self.name}_from{tag}({given}, q, &p)) {{', '    return 0;', '}',
                *(f'{each} = {code.times(f"q[{i}]", units[i])};' for i, each in enumerate(made)),
                'return 1;']), '}', ''])

    def _error(self) -> str:
        """Describe the error of single precision over the reach."""
        linkage = self.linkage
        if len(linkage.inputs) > 1:
            return 'float: how far joints are off was not measured, as there are several inputs.'
        (low, high), *_ = linkage.reach()
        edge = 0.0 if linkage.inputs[0].is_whole([(low, high)]) else 0.01 * (high - low)
        theta = np.linspace(low + edge, high - edge, SAMPLED).astype(np.float32)
        pose = linkage.posed(linkage.points, ())
        exact = pose.over(theta.astype(float))
        worst = np.nanmax(np.abs(pose.searched(theta) - exact)) / linkage.longest
        return (f'float: joints are off by up to {worst:.1g} of the longest bar at {SAMPLED} '
                'poses over the reach, without its outermost hundredth.')

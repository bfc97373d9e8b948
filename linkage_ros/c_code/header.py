# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A mechanism as a C99 header: pose and rates, actuators and joints, the inverse of some outputs.

The operations and their order are those of the Python code, so the results are equal up to the C
library's sine, cosine and arctangent. What all mechanisms have in common is `linkage.h`.
"""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, NamedTuple, Sequence

import numpy as np

from .axes import actuators, Axis, axis, check_inverse, joints, loads
from .code import Code, indented
from .formulas import Formulas
from .names import comment, constants, distinct, field, filled, parameter, prefix, template
from .tables import Tables
from ..scene import SceneMechanism
from ..words import listed, plain_text

# Number of inputs at which the error of `float` is measured.
SAMPLED = 2001
# Poses from a solution of an inverse or from the near inputs, as in `linkage.h`: Newton's method,
# and one without rates.
POSES = 5
INVERSE = """\
/* The @what@ for @outputs@, nearest to `near`, whole turns included. Returns 0, and
   leaves @what@ alone, where there is none. */
static inline int @name@_@what@_for@tag@(@parameters@)
{
@body@
}
"""


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
    first, *others = headers(requests, single, '@common@')
    return '\n'.join([first.replace('@common@', template('linkage.h').rstrip()), *(
        other.replace('@common@\n', '') for other in others)])


def headers(requests: Sequence[Request], single: bool, common: str) -> List[str]:
    """Return the headers of mechanisms in one program, each with a text `common`."""
    made = [_Header(request, single) for request in requests]
    sizes = {'inputs': max(each.values['own_inputs'] for each in made),
             'solutions': max(each.values['own_solutions'] for each in made)}
    return [filled(template('mechanism.h.in'), {**each.values, **sizes, 'common': common})
            for each in made]


class _Header:
    """Writes one header: `values` are those of its template."""

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
        sides = actuators(self.machine), joints(self.machine, request.joints)
        code = Code(linkage, single)
        formulas = Formulas(self.machine, code, [
            *(each.output for axes in (*sides, *inverses) for each in axes),
            *(output for output, _ in loads(self.machine))])
        tags = distinct('_'.join(['', *(field(linkage, each) for each in group)])
                        for group in groups)
        first = Tables(self.machine, code, formulas, sides)
        others = [Tables(self.machine, code, formulas, ([], axes), tag)
                  for axes, tag in zip(inverses, tags)]
        model = first.text() + (first.passive(request.passive) if request.passive else '')
        parts = [text for each, axes, tag in zip(others, inverses, tags)
                 for text in (each.text(), self._inverse(axes, tag, code))]
        solutions = max(each.solutions for each in (first, *others))
        about = [*self._about(), f'A call takes at most {POSES * (solutions + 1)} poses.',
                 *([self._error()] if single else [])]
        whole = ' + '.join(f'p->{each}' for each in formulas.fields.values())
        self.values: Dict[str, Any] = {
            'about': '\n'.join(f' * {line}' for line in about),
            'name': self.name, 'N': prefix(self.name), 'float': int(single),
            'number': code.number, 'own_inputs': n, 'own_solutions': solutions,
            'fields': formulas.struct(), 'pose': formulas.function(),
            'parameters': ', '.join(f'{code.number} {each}' for each in formulas.parameters),
            'arguments': ', '.join(formulas.parameters), 'by': ', '.join(formulas.by),
            'by_places': ', '.join(f'&{by}' for by in formulas.by),
            'by_pointers': ', '.join(f'{self.name}_pose *{by}' for by in formulas.by),
            'inputs_named': ' and by '.join(formulas.inputs),
            'whole': '\n'.join(indented([f'return isfinite({whole});'])),
            'enums': '\n'.join(map(self._enum, ('actuator', 'joint'), sides)),
            'axes': comment('; '.join(f'{side}: {self._with_units(axes)}' for side, axes in zip(
                ('Actuators', 'joints'), sides))),
            'model': model, 'inverses': '\n'.join(parts)}

    def _about(self) -> Iterator[str]:
        linkage = self.linkage
        lengths = ', '.join(f'{name} = {length:.9g}'
                            for name, length in linkage.dimensions.items())
        inputs = ', '.join(f'{input_.name} [{input_.unit}]' for input_ in linkage.inputs)
        scale = f', times {self.machine.scale:.9g}' if self.machine.scale != 1.0 else ''
        yield f'{self.name}: {linkage.type}, written by linkage_ros.'
        yield f'Lengths [m]{scale}: {lengths or "those of the joint lines"}.'
        yield f'Input: {inputs}. Angles [rad] count counterclockwise.'
        if len(linkage.inputs) == 1 and not linkage.inputs[0].is_part:
            arcs = ' or '.join(
                f'[{low:.6g}, {high:.6g}]' for low, high in self.machine.first.reach)
            yield f'It can be assembled in {arcs} {linkage.inputs[0].unit}.'

    def _enum(self, side: str, axes: Sequence[Axis]) -> str:
        upper = f'{prefix(self.name)}_{side.upper()}'
        return 'enum { ' + ', '.join(f'{upper}_{name} = {i}' for i, name in enumerate(
            constants(each.name for each in axes))) + ' };'

    def _with_units(self, axes: Sequence[Axis]) -> str:
        return ', '.join(f'{each.name} [{"rad" if self.linkage.is_angle(each.output) else "m"}]'
                         for each in axes)

    def _inverse(self, axes: Sequence[Axis], tag: str, code: Code) -> str:
        """Return the users' inverse: from outputs and near inputs, in scene units, to inputs."""
        n, number = len(axes), code.number
        names = [*self.machine.inputs]
        if n == 1:
            what, place = names[0], parameter(names[0])
            near, made, value = ['near'], [f'*{place}'], '&value'
            parameters = f'{number} value, {number} near, {number} *{place}'
        else:
            what, value = 'inputs', 'value'
            near, made = ([f'{name}[{i}]' for i in range(n)] for name in ('near', what))
            parameters = ', '.join([f'const {number} value[{n}]', f'const {number} near[{n}]',
                                    f'{number} inputs[{n}]'])
        units = [input_.size * self.machine.scale_of(input_.name)
                 for input_ in self.linkage.inputs]
        lines = [
            f'{number} q[LKR_MAX_INPUTS];', 'lkr_point p;',
            *(f'q[{i}] = {code.times(each, 1.0 / units[i])};' for i, each in enumerate(near)),
            f'if (!lkr_inverse(&{self.name}_model{tag}, LKR_JOINTS, {value}, q, &p)) {{',
            '    return 0;', '}',
            *(f'{each} = {code.times(f"q[{i}]", units[i])};' for i, each in enumerate(made)),
            'return 1;']
        return filled(INVERSE, {
            'what': what, 'name': self.name, 'tag': tag,
            'outputs': self._with_units(axes), 'parameters': parameters,
            'body': '\n'.join(indented(lines))})

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

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
A mechanism as a C99 header: pose and rates, actuators and joints, the inverse of some outputs.

The operations and their order are those of the Python code, so the results are equal up to the C
library's sine, cosine and arctangent. What all mechanisms have in common is `linkage.h`.
"""

from __future__ import annotations

from typing import Any, Iterator, NamedTuple, Sequence

from .axes import actuators, Axis, axis, invertible, joints, loads
from .code import Code
from .formulas import Formulas
from .names import distinct, field, filled, template
from .tables import Tables
from ..linkage import Mechanism
from ..scene import SceneMechanism
from ..words import join_names, n_inputs, plain_text

# Poses of a solution of an inverse: the first, again with its rates, and after a step of Newton's
# method.
POSES = 3


class Request(NamedTuple):
    """
    A mechanism to be written.

    Attributes
    ----------
    mechanism : SceneMechanism
        Mechanism of a scene; lengths include its scale, and only its first leg is written.
    outputs : sequence of str
        Outputs, as for `input_for`, with an inverse each.
    joints : sequence of str
        Commanded joints, see `axes.joints`.
    passive : sequence of Axis
        Joints that are not commanded, of which a transmission has the states.

    """

    mechanism: SceneMechanism
    outputs: Sequence[str] = ()
    joints: Sequence[str] = ()
    passive: Sequence[Axis] = ()


def written(mechanism: SceneMechanism, outputs: Sequence[str] = (), single: bool = False,
            joints: Sequence[str] = ()) -> str:
    """
    Return the header of a mechanism, see `Request`; `single`: with float instead of double.

    Raises
    ------
    ValueError
        If an output or a joint does not exist, there are too few of them, or without an inverse.

    """
    return printed([Request(mechanism, outputs, joints)], single)


def printed(requests: Sequence[Request], single: bool = False) -> str:
    """Return the headers of mechanisms, one after another, and what they have in common."""
    later = [''] * (len(requests) - 1)
    return '\n'.join(headers(requests, single, [template('linkage.h').rstrip(), *later]))


def headers(requests: Sequence[Request], single: bool, common: Sequence[str]) -> list[str]:
    """Return the headers of mechanisms in one program, each with a text of `common`."""
    values = [_values(request, single) for request in requests]
    sizes = {size: max(fields[f'own_{size}'] for fields in values)
             for size in ('inputs', 'joints', 'solutions')}
    return [filled(template('mechanism.h.in'), {**fields, **sizes, 'common': text})
            for fields, text in zip(values, common)]


def _values(request: Request, single: bool) -> dict[str, Any]:
    """Return the values of the template of a header."""
    mechanism, linkage = request.mechanism, request.mechanism.linkage
    name, code = mechanism.name, Code(mechanism, single)
    sides = actuators(mechanism), joints(mechanism, request.joints)
    inverses = _inverses(mechanism, request.outputs)
    formulas = Formulas(mechanism, code, [
        *(axis.output for axes in (*sides, *inverses.values()) for axis in axes),
        *(output for output, _ in loads(mechanism))])
    tables = Tables(mechanism, code, formulas)
    what, where = (_with_units(linkage, axes) for axes in sides)
    parts = [tables.text(f'{name}_model', f'Actuators: {what}; joints: {where}', sides,
                         request.passive)]
    parts += [tables.text(f'{name}_for_{tag}', f'{join_names(mechanism.inputs)} for '
                          f'{_with_units(linkage, axes)}', ([], axes))
              for tag, axes in inverses.items()]
    _, counts, functions = zip(*tables.solutions.values())
    about = [*_about(mechanism), f'A call takes at most {POSES * max(counts)} poses.']
    return {
        'about': '\n'.join(f' * {line}' for line in about), 'name': name, 'float': int(single),
        'number': code.number, 'suffix': '##f' * single, 'own_inputs': len(linkage.inputs),
        'own_joints': len(sides[1]) + len(request.passive), 'own_solutions': max(counts),
        'fields': formulas.struct(), 'pose': formulas.function(),
        'model': '\n'.join([*functions, *parts])}


def _inverses(mechanism: SceneMechanism, texts: Sequence[str]) -> dict[str, list[Axis]]:
    """Return the axes of each inverse, by the end of its name."""
    outputs, n = [*map(plain_text, texts)], len(mechanism.inputs)
    for output in outputs:
        mechanism.linkage.check_there(output)
    if outputs and n > 1 and len(outputs) != n:
        raise ValueError(f'{mechanism.name} has {n_inputs(n)}: as many outputs are needed, '
                         f'got {join_names(outputs)}')
    groups = [invertible(mechanism, [axis(mechanism, output, output)
                                     for output in outputs[i:i + n]])
              for i in range(0, len(outputs), n)]
    return dict(zip(distinct('_'.join(field(mechanism.linkage, x.output) for x in axes)
                             for axes in groups), groups))


def _about(mechanism: SceneMechanism) -> Iterator[str]:
    linkage = mechanism.linkage
    lengths = ', '.join(f'{name} = {length:.9g}' for name, length in linkage.dimensions.items())
    inputs = ', '.join(f'{input_.name} [{input_.unit}]' for input_ in linkage.inputs)
    scale = f', times {mechanism.scale:.9g}' if mechanism.scale != 1.0 else ''
    yield f'{mechanism.name}: {linkage.type}, written by linkage_ros.'
    yield f'Lengths [m]{scale}: {lengths or "those of the joint lines"}.'
    yield f'Input: {inputs}. Angles [rad] count counterclockwise.'
    if len(linkage.inputs) == 1 and not linkage.inputs[0].is_part:
        arcs = ' or '.join(f'[{low:.6g}, {high:.6g}]' for low, high in mechanism.first.reach)
        yield f'It can be assembled in {arcs} {linkage.inputs[0].unit}.'


def _with_units(linkage: Mechanism, axes: Sequence[Axis]) -> str:
    return ', '.join(f'{axis.name} [{"rad" if linkage.is_angle(axis.output) else "m"}]'
                     for axis in axes)

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A ROS 2 package with mechanisms of a scene as transmissions of ros2_control."""

from pathlib import Path
import re
from typing import Dict, Mapping, Sequence, Tuple
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from . import header
from .axes import actuators, Axis, joints, passive
from .names import comment, distinct, filled, literal, template
from ..scene import SceneMechanism

# Names of packages.
PACKAGE = re.compile(r'(?=.{2,64}$)[a-z](_?[a-z0-9])*', re.ASCII)


def package(name: str, scene: str, mechanisms: Sequence[Tuple[SceneMechanism, Sequence[str]]]
            ) -> Dict[Path, str]:
    """
    Return the files of a package, by their path in it.

    Parameters
    ----------
    name : str
        The package's name.
    scene : str
        The name of the scene's file.
    mechanisms : sequence of (SceneMechanism, sequence of str)
        The mechanisms, each with its commanded joints; see `axes.joints`.

    Raises
    ------
    ValueError
        If a joint does not exist, or joints do not determine all inputs.

    """
    classes = distinct(
        re.sub(r'(?<=[a-z])(?=[A-Z])', '_', mechanism.name).title().replace('_', '')
        for mechanism, _ in mechanisms)
    parts, requests = [], []
    for class_, (mechanism, chosen) in zip(classes, mechanisms):
        commanded = joints(mechanism, chosen)
        others = passive(mechanism, commanded)
        requests.append(header.Request(mechanism, (), chosen, others))
        parts.append(_values(name, class_, mechanism, commanded, others))
    common = {
        'package': name, 'namespace': f'{name}_plugins', 'scene': escape(comment(scene)),
        'mechanisms': ' '.join(part['name'] for part in parts),
        'table': '\n'.join(part['row'] for part in parts)}
    files = {path: filled(template(Path(path).name), common) for path in (
        'CMakeLists.txt', 'package.xml', 'README.md', 'src/transmission-of.hpp',
        'include/linkage_ros/linkage_transmission.hpp')}
    files |= {
        'plugins.xml': '\n'.join([f'<library path="{name}">', *(
            filled(template('plugin.xml'), part) for part in parts), '</library>\n']),
        'urdf/transmissions.xml': '\n'.join(['<!-- Written by linkage_ros. -->', *(
            filled(template('transmission.xml'), part) for part in parts)]),
        'src/plugins.cpp': '\n'.join([
            '// Written by linkage_ros. SPDX-License-Identifier: Apache-2.0',
            *(f'#include "{part["name"]}.hpp"' for part in parts),
            '#include "pluginlib/class_list_macros.hpp"\n',
            *(filled(template('export.cpp.in'), part) for part in parts)]),
        'src/linkage.h': template('linkage.h')}
    texts = header.headers(requests, False, ['#include "linkage.h"'] * len(parts))
    for part, text in zip(parts, texts):
        own = part['name']
        files[f'src/{own}_linkage.h'] = text
        files[f'src/{own}.hpp'] = filled(template('mechanism.hpp'), part)
        files[f'test/test_{own}.cpp'] = filled(template('test.cpp'), part)
    return {Path(path): text for path, text in files.items()}


def ranges(mechanism: SceneMechanism) -> str:
    """Return the sweeps or reaches of the inputs as an initializer of C++."""
    arcs = [max(settings.arcs, key=np.ptp) for settings in mechanism.inputs.values()]
    return '{%s}' % ', '.join('{%r, %r}' % (*map(float, arc),) for arc in arcs)


def _values(package_name: str, class_: str, mechanism: SceneMechanism, commanded: Sequence[Axis],
            others: Sequence[Axis]) -> Mapping[str, str]:
    """Return the values of a mechanism's templates."""
    def rows(axes: Sequence[Axis]) -> str:
        return ', '.join(f'{{{literal(axis.name)}, {literal(axis.role)}}}' for axis in axes)

    sides = actuators(mechanism), commanded
    named = [escape(comment(', '.join(axis.name for axis in axes))) for axes in sides]
    return {
        'package': package_name, 'namespace': f'{package_name}_plugins', 'class': class_,
        'name': mechanism.name, 'ranges': ranges(mechanism),
        'actuators': rows(sides[0]), 'joints': rows([*commanded, *others]),
        'passive_function': f'{mechanism.name}_passive' if others else 'nullptr',
        'axes': ' and '.join(named),
        'lines': '\n'.join(f'  <{kind} name={quoteattr(axis.name)} role={quoteattr(axis.role)}/>'
                           for kind, axes in zip(('actuator', 'joint'), sides) for axis in axes),
        'row': f'| `{package_name}/{class_}` | {named[0]} | {named[1]} |'}

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A ROS 2 package with mechanisms of a scene as transmissions of ros2_control."""

from pathlib import Path
import re
from typing import Dict, Mapping, Sequence, Tuple
from xml.sax.saxutils import escape, quoteattr

from . import header
from .axes import actuators, Axis, joints, passive
from .names import comment, distinct, filled, literal, template
from ..scene import SceneMechanism

# Names of packages.
PACKAGE = re.compile(r'(?=.{2,64}$)[a-z](_?[a-z0-9])*', re.ASCII)


def package(name: str, scene: str, machines: Sequence[Tuple[SceneMechanism, Sequence[str]]]
            ) -> Dict[Path, str]:
    """
    Return the files of a package, by their path in it.

    Parameters
    ----------
    name : str
        The package's name.
    scene : str
        The name of the scene's file.
    machines : sequence of (SceneMechanism, sequence of str)
        The mechanisms, each with its commanded joints; see `axes.joints`.

    Raises
    ------
    ValueError
        If a joint does not exist, or joints do not determine all inputs.

    """
    classes = distinct(
        re.sub(r'(?<=[a-z])(?=[A-Z])', '_', machine.name).title().replace('_', '')
        for machine, _ in machines)
    parts = [_values(name, class_, machine, joints(machine, chosen))
             for class_, (machine, chosen) in zip(classes, machines)]
    common = {
        'package': name, 'namespace': f'{name}_plugins', 'scene': escape(comment(scene)),
        'mechanisms': ' '.join(part['name'] for part in parts),
        'table': '\n'.join(part['row'] for part in parts)}
    files = {Path(path): filled(template(Path(path).name), common) for path in (
        'CMakeLists.txt', 'package.xml', 'README.md', 'src/transmission-of.hpp',
        'include/linkage_ros/linkage_transmission.hpp')}
    files[Path('plugins.xml')] = f'<library path="{name}">\n' + ''.join(
        filled(template('plugin.xml'), part) for part in parts) + '</library>\n'
    files[Path('urdf/transmissions.xml')] = '<!-- Written by linkage_ros. -->\n' + ''.join(
        filled(template('transmission.xml'), part) for part in parts)
    files[Path('src/plugins.cpp')] = '\n'.join([
        '// Written by linkage_ros. SPDX-License-Identifier: Apache-2.0',
        *(f'#include "{part["name"]}.hpp"' for part in parts),
        '#include "pluginlib/class_list_macros.hpp"\n',
        *(f'PLUGINLIB_EXPORT_CLASS(\n  {name}_plugins::{class_}Loader, '
          'transmission_interface::TransmissionLoader)' for class_ in classes), ''])
    files[Path('src/linkage.h')] = template('linkage.h')
    written = header.headers([
        header.Request(machine, (), chosen, passive(machine, joints(machine, chosen)))
        for machine, chosen in machines], False, '#include "linkage.h"')
    for part, text in zip(parts, written):
        mechanism = part['name']
        files[Path(f'src/{mechanism}_linkage.h')] = text
        files[Path(f'src/{mechanism}.hpp')] = filled(template('mechanism.hpp'), part)
        files[Path(f'test/test_{mechanism}.cpp')] = filled(template('test.cpp'), part)
    return files


def _values(package_name: str, class_: str, machine: SceneMechanism,
            commanded: Sequence[Axis]) -> Mapping[str, str]:
    driven, others = actuators(machine), passive(machine, commanded)
    roles = list(machine.inputs), [axis.output for axis in commanded]

    def rows(axes: Sequence[Axis], own: Sequence[str]) -> str:
        return ', '.join(f'{{{literal(axis.name)}, {literal(role)}}}'
                         for axis, role in zip(axes, own))

    def listed(axes: Sequence[Axis]) -> str:
        return escape(comment(', '.join(axis.name for axis in axes)))

    lines = [f'  <{kind} name={quoteattr(axis.name)} role={quoteattr(role)}/>'
             for kind, axes, own in zip(('actuator', 'joint'), (driven, commanded), roles)
             for axis, role in zip(axes, own)]
    return {
        'package': package_name, 'namespace': f'{package_name}_plugins', 'class': class_,
        'name': machine.name, 'n': str(len(driven)), 'actuators': rows(driven, roles[0]),
        'joints': rows(commanded, roles[1]),
        'passive': rows(others, [each.output for each in others]) and '{%s}' % rows(
            others, [each.output for each in others]),
        'passive_count': str(len(others)),
        'passive_function': f'{machine.name}_passive' if others else 'nullptr',
        'axes': f'{listed(driven)} and {listed(commanded)}',
        'lines': '\n'.join(lines),
        'row': f'| `{package_name}/{class_}` | {listed(driven)} | {listed(commanded)} |'}

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A ROS 2 package with mechanisms of a scene as transmissions of ros2_control."""

from pathlib import Path
import re
from typing import Mapping, Sequence
from xml.sax.saxutils import escape, quoteattr

from . import header
from .axes import actuators, Axis, joints, passive
from .names import comment, distinct, filled, literal, template
from ..scene import SceneMechanism

# Names of packages.
PACKAGE = re.compile(r'(?=.{2,64}$)[a-z](_?[a-z0-9])*', re.ASCII)


def package(name: str, scene: str, mechanisms: Sequence[tuple[SceneMechanism, Sequence[str]]]
            ) -> dict[Path, str]:
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
    types = distinct(
        re.sub(r'(?<=[a-z])(?=[A-Z])', '_', mechanism.name).title().replace('_', '')
        for mechanism, _ in mechanisms)
    parts, requests = [], []
    for type_, (mechanism, chosen) in zip(types, mechanisms):
        commanded = joints(mechanism, chosen)
        others = passive(mechanism, commanded)
        requests.append(header.Request(mechanism, (), chosen, others))
        parts.append(_parts(name, type_, mechanism, commanded, others))
    values = {
        'package': name, 'namespace': f'{name}_plugins', 'scene': escape(comment(scene)),
        **{key: '\n'.join(part[key] for part in parts) for key in parts[0]}}
    headers = header.headers(requests, False, ['#include "linkage.h"'] * len(requests))
    return {
        **{Path('src', f'{request.mechanism.name}_linkage.h'): text
           for request, text in zip(requests, headers)},
        Path('src/linkage.h'): template('linkage.h'),
        **{path: filled(template(path.name), values) for path in map(Path, (
            'CMakeLists.txt', 'package.xml', 'plugins.xml', 'src/plugins.cpp',
            'urdf/transmissions.xml'))}}


def _parts(package_name: str, type_: str, mechanism: SceneMechanism, commanded: Sequence[Axis],
           others: Sequence[Axis]) -> Mapping[str, str]:
    """Return what a mechanism adds to the files that all have in common."""
    def rows(axes: Sequence[Axis]) -> str:
        return ', '.join(f'{{{literal(axis.name)}, {literal(axis.role)}}}' for axis in axes)

    sides, name = (actuators(mechanism), commanded), mechanism.name
    first, second = (escape(comment(', '.join(axis.name for axis in axes))) for axes in sides)
    plugin, loader = f'{package_name}/{type_}', f'{package_name}_plugins::{type_}Loader'
    described = [f'  <{kind} name={quoteattr(axis.name)} role={quoteattr(axis.role)}/>'
                 for kind, axes in zip(('actuator', 'joint'), sides) for axis in axes]
    return {
        'includes': f'#include "{name}_linkage.h"',
        'linkages': f'const Linkage {name}_linkage{{{name}_model, {{{rows(sides[0])}}}, '
                    f'{{{rows([*commanded, *others])}}}}};\n'
                    f'using {type_}Loader = LoaderOf<{name}_linkage>;',
        'exports': 'PLUGINLIB_EXPORT_CLASS(\n'
                   f'  {loader}, transmission_interface::TransmissionLoader)',
        'classes': f'  <class name="{plugin}" type="{loader}"\n'
                   '         base_class_type="transmission_interface::TransmissionLoader">\n'
                   f'    <description>The linkage {name} between {first} and {second}.'
                   '</description>\n  </class>',
        'transmissions': '\n'.join([
            f'<transmission name="{name}">', f'  <plugin>{plugin}</plugin>', *described,
            '</transmission>'])}

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""A ROS 2 package with mechanisms of a scene as transmissions of ros2_control."""

from pathlib import Path
import re
from typing import Mapping, Sequence
from xml.sax.saxutils import escape, quoteattr

from . import header
from .axes import actuators, Axis, joints, passive
from .names import comment, filled, literal, template
from ..scene import SceneMechanism


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
        If the name is none of a package, a joint does not exist, or joints do not determine all
        inputs.

    """
    if not re.fullmatch('(?=.{2,64}$)[a-z](_?[a-z0-9])*', name, re.ASCII):
        raise ValueError("--out must end in the package's name: 2 to 64 lower-case letters, "
                         f'digits and single underscores, a letter first, not {name!r}')
    parts, requests = [], []
    for mechanism, chosen in mechanisms:
        commanded = joints(mechanism, chosen)
        requests.append(header.Request(mechanism, (), chosen, passive(mechanism, commanded)))
        parts.append(_parts(name, requests[-1], commanded))
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


def _parts(package_name: str, request: header.Request, commanded: Sequence[Axis]
           ) -> Mapping[str, str]:
    """Return what a mechanism adds to the files that all have in common."""
    def rows(axes: Sequence[Axis]) -> str:
        return ', '.join(f'{{{literal(axis.name)}, {literal(axis.role)}}}' for axis in axes)

    mechanism = request.mechanism
    sides, name = (actuators(mechanism), commanded), mechanism.name
    plugin, loader = f'{package_name}/{name}', f'{package_name}_plugins::{name}_loader'
    described = [f'  <{kind} name={quoteattr(axis.name)} role={quoteattr(axis.role)}/>'
                 for kind, axes in zip(('actuator', 'joint'), sides) for axis in axes]
    return {
        'includes': f'#include "{name}_linkage.h"',
        'linkages': f'const Linkage {name}_linkage{{{name}_model, {{{rows(sides[0])}}}, '
                    f'{{{rows([*commanded, *request.passive])}}}}};\n'
                    f'using {name}_loader = LoaderOf<{name}_linkage>;',
        'exports': 'PLUGINLIB_EXPORT_CLASS(\n'
                   f'  {loader}, transmission_interface::TransmissionLoader)',
        'classes': f'  <class name="{plugin}" type="{loader}"\n'
                   '         base_class_type="transmission_interface::TransmissionLoader"/>',
        'transmissions': '\n'.join([
            f'<transmission name="{name}">', f'  <plugin>{plugin}</plugin>', *described,
            '</transmission>'])}

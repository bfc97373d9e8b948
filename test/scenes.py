# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scenes of one mechanism, and those of the package."""

from pathlib import Path

from linkage_ros import scene
from linkage_ros.scene.writing import without_defaults

ROOT = Path(__file__).parents[1]
EXAMPLES = [*sorted((ROOT / 'config').glob('*.yaml')), *sorted((ROOT / 'examples').glob('*.yaml'))]


def example(name):
    """Return the parameters of an example."""
    return without_defaults(scene.load(str(next(
        path for path in EXAMPLES if path.stem == name))))


def alone(linkage, name='m', **settings):
    """Return the mechanism of a type or of joint lines, alone in its scene; __ is a point."""
    if not isinstance(linkage, dict):
        linkage = {'type': linkage} if isinstance(linkage, str) else {
            'type': 'custom', 'joints': [*linkage]}
    return scene.read({'mechanisms': [name], **{
        f'{name}.{key.replace("__", ".")}': value for key, value in {**linkage, **settings}.items()
    }}).mechanisms[name]

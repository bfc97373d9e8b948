# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scenes of one mechanism."""

from linkage_ros import scene


def alone(linkage, name='m', **settings):
    """Return the mechanism of a type or of joint lines, alone in its scene; __ is a point."""
    if not isinstance(linkage, dict):
        linkage = {'type': linkage} if isinstance(linkage, str) else {
            'type': 'custom', 'joints': [*linkage]}
    return scene.read({'mechanisms': [name], **{
        f'{name}.{key.replace("__", ".")}': value for key, value in {**linkage, **settings}.items()
    }}).mechanisms[name]

# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Scenes of one mechanism, joint lines that several files ask about, and the package's scenes."""

from pathlib import Path

from linkage_ros import mechanisms, scene
from linkage_ros.scene.writing import in_yaml, without_defaults

ROOT = Path(__file__).parents[1]
EXAMPLES = [*sorted((ROOT / 'config').glob('*.yaml')), *sorted((ROOT / 'examples').glob('*.yaml'))]

# A toe whose crank is on a moving link, a cylinder below a boom, an engine that is out of line, a
# four-bar with a rocker, one that is dragged round, and a slotted lever.
CASSIE = ['O ground 0 0', 'F crank O 0.4', 'K rigid O F 0.07 0.35 right', 'A crank K 0.05 zero F',
          'B dyad A F 0.35 0.06 right']
BOOM = ['O ground 0 0', 'P ground 0.5 -0.2', 'B cylinder P O 1.1 right']
ENGINE = ['O ground 0 0', 'G ground 0 -20', 'A crank O 40', 'B slider A 120 G 0.5 out',
          'P rigid A B 50 90 left']
LIFT = ['O ground 0 0', 'Q ground 1 0', 'A crank O 0.3', 'B dyad A Q 1 0.6 left']
DRAG = ['O ground 0 0', 'Q ground 0.3 0', 'A crank O 1', 'B dyad A Q 0.9 1.1 left']
SLOT = ['O ground 0 0', 'Q ground 0 -0.045', 'A crank O 0.02 up', 'L slot Q A 0 out 0.08']

# The ankle of a Unitree G1, from its maker's model.
G1 = (
    'pitch hinge ground at 0 0 0 axis 0 1 0 within -50deg 30deg',
    'roll hinge pitch at 0 0 -0.0176 axis 1 0 0 within -15deg 15deg',
    'right motor ground at 0.022 0 0.2159 axis 1 0 0',
    'left motor ground at 0.022 0 0.1509 axis 1 0 0',
    'R rod right 0.0395 -0.0164 0.2112 roll 0.022 -0.015 -0.0096',
    'L rod left 0.035 0.0165 0.1469 roll 0.022 0.015 -0.0096')


def example(name):
    """Return the parameters of an example."""
    return without_defaults(scene.load(str(next(path for path in EXAMPLES if path.stem == name))))


def scene_file(folder, values):
    """Return a parameter file with values by full parameter name."""
    path = folder / 'scene.yaml'
    path.write_text(in_yaml(values))
    return path


def custom(*joints, **more):
    """Return a linkage of joint lines."""
    return mechanisms.create('custom', joints=joints, **more)


def alone(linkage, name='m', **settings):
    """Return the mechanism of a type or of joint lines, alone in its scene; __ is a point."""
    if not isinstance(linkage, dict):
        linkage = {'type': linkage} if isinstance(linkage, str) else {
            'type': 'custom', 'joints': [*linkage]}
    return scene.read({'mechanisms': [name], **{
        f'{name}.{key.replace("__", ".")}': value for key, value in {**linkage, **settings}.items()
    }}).mechanisms[name]

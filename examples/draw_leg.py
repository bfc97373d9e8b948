# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Draw the leg as its motors move it, from its URDF and its scene, without ROS.

    python examples/draw_leg.py leg.png
"""

import math
from pathlib import Path
import sys
from xml.etree import ElementTree

from linkage_ros import scene
from matplotlib import pyplot
from matplotlib.colors import LightSource
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
import numpy as np

HERE = Path(__file__).parent
PARTS = 0.1, 0.35, 0.65, 0.95


def joints(mechanisms, part):
    """Return the positions of all joints, by name, at a part of each sweep."""
    found = {}
    for mechanism in mechanisms:
        drive = mechanism.first
        low, high = drive.sweep
        value = low + part * (high - low)
        angles = mechanism.linkage.joint_angles(value)
        found.update((called.name, called.of(angles[link]))
                     for link, called in mechanism.joints.items())
        found[drive.source], _ = mechanism.to_source(drive, value, 0.0)
    return found


def turned(axis, angle):
    """Return the rotation about an axis, by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def numbers(element, key):
    """Return the three numbers of an attribute, zeros where it is not there."""
    text = '' if element is None else element.get(key, '')
    return np.array([float(word) for word in text.split()] or [0.0] * 3)


def placed(element, frame, axis=(0.0, 0.0, 0.0), angle=0.0):
    """Return rotation and place of what has an origin in a frame, turned about an axis."""
    rotation, place = frame
    origin = element.find('origin')
    roll, pitch, yaw = numbers(origin, 'rpy')
    own = turned((0, 0, 1), yaw) @ turned((0, 1, 0), pitch) @ turned((1, 0, 0), roll)
    return rotation @ own @ turned(axis, angle), place + rotation @ numbers(origin, 'xyz')


def prism(shape):
    """Return the faces of a box or a cylinder; of a ball, a short cylinder's."""
    if shape.tag == 'box':
        size = numbers(shape, 'size')
        round_ = [(-1, -1), (1, -1), (1, 1), (-1, 1)] * size[:2] / 2.0
        height = size[2]
    else:
        radius = float(shape.get('radius'))
        turn = np.linspace(0.0, math.tau, 17)[:-1]
        round_ = radius * np.transpose([np.cos(turn), np.sin(turn)])
        height = float(shape.get('length', radius))
    low, high = (np.insert(round_, 2, z, axis=1) for z in (-height / 2.0, height / 2.0))
    sides = np.stack([low, np.roll(low, -1, 0), np.roll(high, -1, 0), high], axis=1)
    return [low, high, *sides]


def faces(robot, positions):
    """Yield the faces of all links and their colours, joints standing where they are said to."""
    frames = {robot.find('link').get('name'): (np.eye(3), np.zeros(3))}
    for joint in robot.iter('joint'):
        parent, child = (joint.find(end).get('link') for end in ('parent', 'child'))
        frames[child] = placed(joint, frames[parent], numbers(joint.find('axis'), 'xyz'),
                               positions.get(joint.get('name'), 0.0))
    colours = {material.get('name'): material.find('color').get('rgba').split()
               for material in robot.findall('material')}
    for link in robot.iter('link'):
        for visual in link.iter('visual'):
            rotation, place = placed(visual, frames[link.get('name')])
            colour = [float(x) for x in colours[visual.find('material').get('name')]]
            for face in prism(visual.find('geometry')[0]):
                yield face @ rotation.T + place, colour


def main(out):
    """Draw four poses."""
    robot = ElementTree.parse(HERE / 'leg.urdf').getroot()
    mechanisms = scene.load(HERE / 'leg.yaml').mechanisms.values()
    figure, row = pyplot.subplots(
        1, len(PARTS), figsize=(8.0, 2.5), dpi=100, subplot_kw={'projection': '3d'})
    figure.subplots_adjust(-0.02, -0.1, 1.02, 1.0, wspace=-0.1)
    for axes, part in zip(row, PARTS):
        polygons, shades = zip(*faces(robot, joints(mechanisms, part)))
        axes.add_collection3d(Poly3DCollection(
            polygons, facecolors=shades, shade=True, lightsource=LightSource(20.0, 30.0)))
        axes.set(xlim=(-0.28, 0.2), ylim=(-0.18, 0.3), zlim=(-0.42, 0.16), proj_type='ortho')
        axes.set_box_aspect((0.48, 0.48, 0.58), zoom=1.45)
        axes.view_init(elev=16.0, azim=52.0)
        axes.set_axis_off()
    figure.savefig(out)


if __name__ == '__main__':
    main(*sys.argv[1:])

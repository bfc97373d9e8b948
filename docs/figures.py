# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
Draw the curves in docs/commands.md and docs/forces.md, without ROS.

    python docs/figures.py FOLDER
"""

from pathlib import Path
import sys

from linkage_ros import mechanisms, palette, scene
from matplotlib import pyplot
import numpy as np

ROOT = Path(__file__).parents[1]
COLOURS = palette.BAR, palette.DRIVEN, palette.GREEN


def bucket(folder):
    """Draw an excavator whose bucket goes along a straight line, and what its cylinders do."""
    linkage = scene.load(str(ROOT / 'config' / 'excavator.yaml')).mechanisms['excavator'].linkage
    outputs = ['T.x', 'T.y', 'angle(H,T)']
    inputs = np.array([1.0, 1.15, 1.05])
    start = np.array([float(linkage.joint_angles(inputs, [name])[name]) for name in outputs])
    way = np.linspace(0.0, 1.0, 61)
    found, inverse = [], linkage.inverse(outputs)
    for part in way:
        inputs, _ = inverse.follow(start + part * np.array([-1.2, 0.0, -0.3]), inputs)
        found.append(inputs)
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(7.5, 3.0), layout='constrained')
    for inputs, shade in zip(found[::20], (0.25, 0.45, 0.7, 1.0)):
        place = linkage.solve(inputs)
        for first, second in (*linkage.bars, *linkage.cylinders):
            left.plot(*np.transpose([place[first], place[second]]), color=palette.BAR,
                      alpha=shade, linewidth=1.2)
    left.plot(*np.transpose([linkage.solve(inputs)['T'] for inputs in found]),
              color=palette.LOCUS, linewidth=2.0)
    left.set(aspect='equal', xlabel='x [m]', ylabel='y [m]')
    for own, input_, colour, beside in zip(np.transpose(found), linkage.inputs, COLOURS,
                                           (6, 0, -6)):
        right.plot(1.2 * way, own, color=colour)
        right.annotate(input_.name, (1.2, own[-1]), xytext=(4, beside), textcoords='offset points',
                       va='center', color=colour)
    right.margins(y=0.1)
    right.set(xlabel='way of the bucket [m]', ylabel='length [m]', xlim=(0.0, 1.75))
    figure.savefig(folder / 'commands.png', dpi=100)


def torque(folder):
    """Draw what the crank of Jansen's leg holds over a turn, with a load at its foot."""
    leg = mechanisms.create('jansen')
    theta = np.linspace(-np.pi, np.pi, 721)
    figure, axes = pyplot.subplots(figsize=(7.5, 2.8), layout='constrained')
    loads = {'60 N up at the foot': {'G': (0.0, 60.0)},
             '20 N back at the foot': {'G': (-20.0, 0.0)}}
    for (name, load), colour in zip(loads.items(), COLOURS):
        held = 0.01 * leg.effort(theta, load)[:, 0]
        axes.plot(np.degrees(theta), held, color=colour)
        place = int(np.argmax(held))
        axes.annotate(name, (np.degrees(theta[place]), held[place]), xytext=(8, 4),
                      textcoords='offset points', color=colour)
    axes.margins(y=0.12)
    axes.axhline(0.0, color=palette.FRAME, linewidth=0.8)
    axes.set(xlabel='crank angle [degrees]', ylabel='torque [N m]', xlim=(-180, 180),
             xticks=range(-180, 181, 60))
    figure.savefig(folder / 'forces.png', dpi=100)


if __name__ == '__main__':
    target = Path(sys.argv[1])
    bucket(target)
    torque(target)

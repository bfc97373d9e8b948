# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Pictures of what was received: one PNG a mechanism, and all of them moving in one GIF."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
import numpy as np
from PIL import Image

# Colours that colour-blind people tell apart (Okabe and Ito).
LINK, JOINT, LOCUS, TRACER = '#0072b2', '#e69f00', '#009e73', '#d55e00'
MARGIN = 0.08
OTHER_POSES = 6
LABEL_DISTANCE = 0.03
FRAMES_PER_SECOND = 12
TRAIL_SECONDS = 0.8
COLOURS = 48


def portrait(motion, file):
    """Draw the clearest pose, some others, and the traced curve."""
    figure = Figure(figsize=(7.0, 6.5), dpi=120, layout='constrained')
    axes = figure.subplots()
    axes.set(xlabel='x [m]', ylabel='y [m]')
    panel = Panel(axes, motion)
    for other in np.linspace(0, len(motion.bars), OTHER_POSES, endpoint=False, dtype=int):
        axes.add_collection(LineCollection(motion.bars[other], colors=LINK, alpha=0.15, lw=2))
    axes.plot(*motion.traced.T, color=TRACER, lw=1.5, zorder=2, label='traced joint, as received')
    index = _clearest(motion)
    panel.show(index)
    _name_joints(axes, motion, index)
    figure.legend(loc='outside lower center', ncols=4, frameon=False)
    figure.savefig(file)


def _clearest(motion):
    """Return the index of the message whose joints are farthest apart."""
    places = motion.points[:, 0] @ (1, 1j)
    apart = abs(places[:, :, None] - places[:, None, :])
    itself = np.eye(places.shape[1], dtype=bool)
    return apart.min(axis=(1, 2), initial=np.inf, where=~itself).argmax()


def _name_joints(axes, motion, index):
    """Write each joint's name at the place around it that is farthest from all lines."""
    radius = LABEL_DISTANCE * np.ptp(window(motion), axis=0).max()
    around = radius * np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False))
    start, end = motion.bars[index].swapaxes(0, 1) @ (1, 1j)
    along = np.linspace(0.0, 1.0, 100)[:, None]
    lines = np.concatenate([(start + along * (end - start)).ravel(), motion.locus @ (1, 1j)])
    for name, joint in zip(motion.machine.points, motion.points[index, 0] @ (1, 1j)):
        place = max(joint + around, key=lambda candidate: abs(lines - candidate).min())
        axes.text(place.real, place.imag, name, fontsize=12, ha='center', va='center', zorder=6,
                  path_effects=[withStroke(linewidth=3, foreground='white')])


def animation(motions, file, seconds, progress):
    """Draw all mechanisms side by side, at the times that the messages are stamped with."""
    figure = Figure(figsize=(13.0, 3.7), dpi=80, layout='constrained')
    canvas = FigureCanvasAgg(figure)
    columns = figure.subplots(1, len(motions), width_ratios=[
        np.divide(*np.ptp(window(motion), axis=0)) for motion in motions])
    panels = [Panel(axes, motion) for axes, motion in zip(columns, motions)]
    canvas.draw()
    figure.set_layout_engine('none')
    still = canvas.copy_from_bbox(figure.bbox)
    start = max(motion.times[0] for motion in motions)
    frames = []
    for time in progress(np.arange(start, start + seconds, 1.0 / FRAMES_PER_SECOND)):
        canvas.restore_region(still)
        for panel, motion in zip(panels, motions):
            panel.show(motion.at(time), motion.at(time - TRAIL_SECONDS))
            panel.redraw()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB'))
    palette = frames[-1].quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    frames[0].save(file, save_all=True, append_images=frames[1:], loop=0,
                   duration=1000 // FRAMES_PER_SECOND)


def window(motion) -> np.ndarray:
    """Return the lower left and the upper right corner [m] of all that was received, with room."""
    everything = np.concatenate([motion.points.reshape(-1, 2), motion.locus])
    low, high = everything.min(axis=0), everything.max(axis=0)
    room = MARGIN * (high - low).max()
    return np.array([low - room, high + room])


class Panel:
    """Axes that show one mechanism at one time after another."""

    def __init__(self, axes, motion):
        xlim, ylim = window(motion).T
        axes.set(xlim=xlim, ylim=ylim)
        axes.set_aspect('equal')
        axes.set_title(motion.machine.name.replace('_', ' '))
        axes.grid(alpha=0.3)
        axes.plot(*motion.locus.T, color=LOCUS, lw=5, alpha=0.5, label='traced curve')
        self._trail, = axes.plot([], [], color=TRACER, lw=2, zorder=2, animated=True)
        self._links = LineCollection([], colors=LINK, lw=3, zorder=3, animated=True,
                                     capstyle='round', label='links')
        axes.add_collection(self._links)
        self._joints, = axes.plot([], [], 'o', color=JOINT, mec='black', ms=6, zorder=4,
                                  animated=True, label='joints')
        self._axes = axes
        self._motion = motion

    def show(self, index, trail_from=None):
        """Show the message of an index, and where the traced joint was since another."""
        self._links.set_segments(self._motion.bars[index])
        self._joints.set_data(*self._motion.points[index].reshape(-1, 2).T)
        if trail_from is not None:
            self._trail.set_data(*self._motion.traced[trail_from:index + 1].T)

    def redraw(self):
        """Draw what moves onto what stands still."""
        for artist in (self._trail, self._links, self._joints):
            self._axes.draw_artist(artist)

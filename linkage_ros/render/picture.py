# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Pictures of mechanisms side by side at any time, with Matplotlib and without a screen."""

import math
import warnings

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
import numpy as np

from . import layers
from .cycle import Cycle
from .parts import DEFAULT
from ..palette import FRAME, GRID
from ..scene import SceneError

DOTS_PER_INCH = 100
CROWDED = 'the size is too small for the drawn parts: choose a larger one, or hide a part'
PADDING = 0.1  # inches, around everything
MAX_POSES = 24  # poses in which the joints' names keep clear of the links


class Picture:
    """
    Mechanisms side by side, each on axes of its own.

    Parameters
    ----------
    mechanisms : sequence of SceneMechanism
        The mechanisms.
    size : (int, int)
        Width and height in pixels.
    trace : str
        One of parts.TRACES.
    parts : collection of str
        Some of parts.PARTS.
    motions : sequence, optional
        The motion of each mechanism, by default its Cycle: objects with a cycle's `period`,
        `slides`, `prefixes`, `course`, `pose`, `curve` and `locus`.

    """

    def __init__(self, mechanisms, size=(720, 720), trace='whole', parts=DEFAULT, motions=None):
        width, height = size
        self.figure = Figure((width / DOTS_PER_INCH, height / DOTS_PER_INCH), DOTS_PER_INCH,
                             layout='constrained', facecolor='white')
        self.figure.get_layout_engine().set(w_pad=PADDING, h_pad=PADDING)
        self._canvas = FigureCanvasAgg(self.figure)
        count = len(mechanisms)
        columns = min(max(round(math.sqrt(count * width / height)), 1), count)
        rows = math.ceil(count / columns)
        unit = min(max(min(width / columns, height / rows) / 720, 0.4), 2.0)
        axes = self.figure.subplots(rows, columns, squeeze=False).flat
        self.panels = [Panel(panel_axes, mechanism, motion, trace, parts, unit, count == 1)
                       for panel_axes, mechanism, motion in zip(
                           axes, mechanisms, motions or map(Cycle, mechanisms))]
        for unused in axes[count:]:
            unused.remove()
        self.period = self.panels[0].cycle.period

    def arrange(self, times):
        """
        Place axes and names such that the pictures at these times [turns] are readable.

        Raises
        ------
        SceneError
            If there is too little room.

        """
        self.show(times[0])
        with warnings.catch_warnings():
            warnings.filterwarnings('error', 'constrained_layout not applied')
            for _ in range(2):  # the axes' size depends on their labels, these on their limits
                try:
                    self.figure.get_layout_engine().execute(self.figure)
                except UserWarning:
                    raise SceneError(CROWDED) from None
                for panel in self.panels:
                    panel.fill()
        self.figure.set_layout_engine('none')
        chosen = times[::math.ceil(len(times) / MAX_POSES)]
        for panel in self.panels:
            panel.settle([self.seconds(turns) / panel.cycle.period for turns in chosen])

    def show(self, turns):
        """Move all panels to a time [turns of the first mechanism's crank]."""
        for panel in self.panels:
            panel.show(self.seconds(turns) / panel.cycle.period)

    def at(self, turns):
        """Return the picture at a time [turns], shape (height, width, 3), 8 bits per colour."""
        self.show(turns)
        self._canvas.draw()
        return np.array(self._canvas.buffer_rgba())[..., :3]

    def seconds(self, turns):
        """Return the duration of turns [s]; 0 if the first mechanism stands still."""
        return turns * self.period if math.isfinite(self.period) else 0.0


class Panel:
    """One mechanism on its axes."""

    def __init__(self, axes, mechanism, cycle, trace, parts, unit, single):
        self.mechanism, self.cycle = mechanism, cycle
        self._axes = axes
        self._margin = 14 + 30 * unit  # pixels, for pivots, slots and names
        self._joints = layers.indices(mechanism.linkage, mechanism.points)
        self.moving: list = [layers.Trace(axes, mechanism, self.cycle, trace, unit)]
        if 'floor' in parts:
            self.moving.append(layers.Floor(axes, mechanism, self.cycle, unit))
        if 'guides' in parts:
            layers.guides(axes, mechanism, self.cycle, unit)
        self.moving.append(layers.Legs(axes, mechanism, self.cycle, parts, unit))
        if 'labels' in parts and len(self.cycle.prefixes) == 1:
            self.moving.append(layers.Names(axes, mechanism, self.cycle, unit))
        if parts & {'title', 'dimensions'}:
            self.moving.append(layers.Headline(axes, mechanism, parts, unit, single))
        self._dress('axes' in parts, unit)

    def _dress(self, axes_shown, unit):
        if not axes_shown:
            self._axes.set_axis_off()
            return
        self._axes.set_xlabel('x [m]', fontsize=10 + 3 * unit)
        self._axes.set_ylabel('y [m]', fontsize=10 + 3 * unit)
        self._axes.tick_params(labelsize=9 + 2 * unit, color=FRAME)
        self._axes.set_axisbelow(True)
        self._axes.grid(color=GRID)
        self._axes.spines[:].set_color(FRAME)
        self._axes.locator_params(nbins=min(max(int(8 * unit), 4), 10))

    def fill(self):
        """Set limits around all that is drawn, at one scale; SceneError if too small."""
        course, joints = self.cycle.course, len(self.mechanism.linkage.points)
        places = [course[:, :, self._joints].reshape(-1, 2), course[:, :, joints:].reshape(-1, 2)]
        places += [line.get_xydata() for line in self._axes.lines if len(line.get_xdata()) > 2]
        drawn = np.concatenate(places)
        low, high = np.nanmin(drawn, axis=0), np.nanmax(drawn, axis=0)
        pixels = np.array(self._axes.get_window_extent().size)
        if pixels.min() < 3.0 * self._margin:
            raise SceneError(CROWDED)
        half = 0.5 * pixels * ((high - low) / (pixels - 2.0 * self._margin)).max()
        centre = 0.5 * (low + high)
        self._axes.set(xlim=(centre[0] - half[0], centre[0] + half[0]),
                       ylim=(centre[1] - half[1], centre[1] + half[1]))

    def settle(self, times):
        """Place the joints' names for poses at these times [turns]."""
        for names in [layer for layer in self.moving if isinstance(layer, layers.Names)]:
            names.settle(np.stack([self.cycle.pose(turns).places for turns in times]))

    def show(self, turns):
        """Move all layers to a time [turns of the crank]."""
        self.pose = self.cycle.pose(turns)
        for layer in self.moving:
            layer.show(self.pose)

    def columns(self):
        """Return the names of the `values`."""
        name = self.mechanism.name
        joints = [f'{leg}{joint}_{axis}' for leg in self.cycle.prefixes
                  for joint in self.mechanism.points for axis in 'xy']
        return [f'{name}_{part}' for part in (*self.mechanism.inputs, *joints)]

    def values(self):
        """Return the shown inputs [rad or m] and joints [m]."""
        return [*self.pose.inputs, *self.pose.places[:, self._joints].ravel().tolist()]

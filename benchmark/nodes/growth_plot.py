# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A picture of what a scene costs over the number of its mechanisms."""

import statistics

from linkage_ros import palette
import matplotlib
from matplotlib.ticker import LogLocator

from .report import grown

matplotlib.use('Agg')
from matplotlib import pyplot  # noqa: E402

PANELS = {'cpu': 'CPU time [us a message]', 'memory': 'memory [MiB]',
          'begun': 'CPU time of the start [s]', 'changed': 'a change is answered after [ms]'}
# Name, colour, dashes, marker, and where the name is beside the middle of the curve.
LOOKS = (('kinematics', palette.BLUE, '-', 'o', (-5, 7), 'right'),
         ('bare node', palette.DARK, '--', 's', (5, -13), 'left'))


def draw(rows, path):
    """Draw both nodes, a panel for each thing that grows."""
    found = [pair for pair in grown(rows) if 'mechanism' in pair[0]['scene']]
    counts = [own['mechanisms'] for own, _ in found]
    figure, axes = pyplot.subplots(2, 2, figsize=(7.4, 5.6), sharex=True)
    for axis, (what, title) in zip(axes.flat, PANELS.items()):
        for i, (name, colour, dashes, marker, beside, side) in enumerate(LOOKS):
            values = [statistics.median(pair[i][what]) for pair in found]
            axis.plot(counts, values, color=colour, linestyle=dashes, marker=marker, markersize=5)
            middle = len(counts) // 2
            axis.annotate(name, (counts[middle], values[middle]), beside, ha=side,
                          textcoords='offset points', color=colour, fontsize=9)
        axis.set(xscale='log', yscale='log')
        axis.margins(y=0.15)
        low, high = axis.get_ylim()
        axis.yaxis.set_major_locator(LogLocator(
            subs=(1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)))
        axis.yaxis.set_major_formatter('{x:g}')
        axis.set_xticks(counts, map(str, counts))
        axis.minorticks_off()
        axis.set_title(title, loc='left', fontsize=10, weight='bold')
        axis.grid(True, color=palette.GRID)
    for axis in axes[1]:
        axis.set_xlabel('mechanisms')
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)

# Copyright 2026 linkage_ros contributors
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the
# License is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either
# express or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pictures of a run: time a pose over the number of poses and over the error, each curve named."""

from linkage_ros import palette
import matplotlib
from PIL import Image

from .report import chosen, TITLES
from .timing import BATCHES

matplotlib.use('Agg')
from matplotlib import pyplot  # noqa: E402

# Inches and dots: the pages show it half as large.
SIZE, DPI = (7.4, 7.2), 200
# Errors below this are drawn as this.
LEAST = 0.3
MANY = 1000
# How far apart the names of two curves are, in parts of a panel's height.
APART = 0.068
# Told apart by marker and dashes as well: ours, C, and the kinds of peers.
LOOKS = (
    (palette.BLUE, '-', 'o'), (palette.BLUE, '-', 's'), (palette.DARK, '-', 'D'),
    (palette.ORANGE, '--', '^'), (palette.GREEN, '-.', 'v'), (palette.VERMILION, ':', 'P'),
    (palette.PURPLE, (0, (6, 1)), 'X'), (palette.SKY, (0, (3, 1, 1, 1)), '*'))


def draw(result, folder):
    """Draw a picture of every linkage that was run."""
    for kind, title in TITLES.items():
        curves = chosen(result, kind)
        if curves:
            _picture(title, curves, folder / f'{kind}.png')


def _picture(title, curves, path):
    figure, (above, below) = pyplot.subplots(2, figsize=SIZE)
    _panel(above, [(curve.name, sorted(
        (batch, row['median_us']) for batch, row in curve.batches.items())) for curve in curves])
    above.set(xlabel='poses asked for at once', xticks=BATCHES, xticklabels=map(str, BATCHES))
    above.minorticks_off()
    below.invert_xaxis()
    _panel(below, [(curve.name, [
        (max(row['max_scaled'], LEAST), row['median_us']) for row in curve.settings(MANY)])
        for curve in curves])
    below.set(xlabel='largest error within a turn [2⁻⁵³ of the longest bar]')
    for axis, what in ((above, 'over how many are asked for'),
                       (below, f'over the error, {MANY} at once; right: exact')):
        axis.set_title(f'{title}: time a pose {what}', loc='left', fontsize=11, weight='bold')
    figure.subplots_adjust(left=0.1, right=0.68, top=0.96, bottom=0.07, hspace=0.33)
    figure.savefig(path, dpi=DPI)
    pyplot.close(figure)
    few = Image.new('P', (1, 1))
    few.putpalette(_shades())
    Image.open(path).convert('RGB').quantize(palette=few, dither=Image.Dither.NONE).save(
        path, optimize=True)


def _shades():
    """Return red, green and blue of all colours, fading into white: a picture needs no others."""
    colours = sorted({'#000000', *(colour for colour, *_ in LOOKS)})
    faded = [(1.0 + fade * (part - 1.0)) for colour in colours
             for fade in (0.0, 0.25, 0.5, 0.75, 1.0) for part in palette.rgb(colour)]
    return [round(255 * part) for part in (
        *faded, *palette.rgb(palette.FRAME), *palette.rgb(palette.GRID))]


def _panel(axis, curves):
    """Draw curves, (name, points (x, microseconds)), and name each where it ends on the right."""
    axis.set(xscale='log', yscale='log', ylabel='CPU time [ns a pose]')
    axis.grid(True, color=palette.GRID)
    axis.set_axisbelow(True)
    ends = []
    for (name, points), (colour, dashes, marker) in zip(curves, LOOKS):
        if points:
            x, y = zip(*((x, 1e3 * us) for x, us in points))
            ours = colour == palette.BLUE
            axis.plot(x, y, color=colour, linestyle=dashes, marker=marker,
                      markersize=7, linewidth=2.4 if ours else 1.5, zorder=3 if ours else 2)
            ends.append((name, colour, marker, points))
    _name(axis, ends)


def _name(axis, ends):
    """Write names beside a panel, none over another, with a line to where each curve ends."""
    axis.figure.canvas.draw()
    to_panel = axis.transData + axis.transAxes.inverted()
    placed = []
    for name, colour, marker, points in ends:
        spots = to_panel.transform([(x, 1e3 * us) for x, us in points])
        placed.append((*max(spots.tolist()), name, colour, marker))
    placed.sort(key=lambda end: end[1])
    heights = _spread([height for _, height, *_ in placed])
    for (x, y, name, colour, marker), height in zip(placed, heights):
        weight = 'bold' if colour == palette.BLUE else 'normal'
        axis.plot([x, 1.03], [y, height], transform=axis.transAxes, clip_on=False, zorder=1,
                  color=palette.FRAME, linewidth=0.8)
        axis.plot([1.045], [height], transform=axis.transAxes, clip_on=False, color=colour,
                  marker=marker, markersize=6)
        axis.text(1.07, height, name, transform=axis.transAxes, va='center', fontsize=9,
                  weight=weight, color=palette.DARK)


def _spread(heights):
    """Return ascending heights, moved apart as little as it takes within 0 to 1."""
    moved = []
    for height in heights:
        moved.append(max(height, moved[-1] + APART) if moved else max(height, 0.0))
    over = max(0.0, moved[-1] - 1.0) if moved else 0.0
    limit = 1.0 + over
    for i in reversed(range(len(moved))):
        limit = moved[i] = min(moved[i] - (over if i == len(moved) - 1 else 0.0), limit)
        limit -= APART
    return moved

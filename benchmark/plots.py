# Copyright 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Work-precision plots: error to the right, time upwards, one line a method over its knob."""

import matplotlib
from matplotlib.lines import Line2D

from .report import any_of, failed, methods, TITLES

matplotlib.use('Agg')
from matplotlib import pyplot  # noqa: E402

PANELS = {1: 'one pose at a time', 1000: '1000 poses at a time'}
MARKERS = 'osD^v<>Pp*hXd8H'
COLOURS = ('tab:blue', 'tab:orange', 'tab:green', 'tab:purple', 'tab:brown', 'tab:pink',
           'tab:gray', 'tab:olive', 'tab:cyan', 'navy', 'teal', 'goldenrod', 'darkgreen',
           'peru', 'indigo')
LEAST = 0.3
CAPTION = """\
Error: in units of 2^-53 x the longest bar, or of the sensitivity to the rounding of the inputs\
 where that is larger;
over the poses that did not fail. Hollow: some poses failed (share in the legend). Dashed: each\
 pose is found from the one before."""


def draw(result, folder):
    """Draw a plot for every linkage that was run."""
    for kind, title in TITLES.items():
        lines = _lines(result, kind)
        if lines:
            _plot(title, lines, folder / f'{kind}.png')


def _lines(result, kind):
    """Return {method: [rows by batch, one a knob]}, without those for a part of the points."""
    found = {}
    for (name, _), rows in methods(result, kind).items():
        if any_of(rows)['kind'] != 'part':
            found.setdefault(name, []).append(rows)
    return found


def _plot(title, lines, path):
    figure, axes = pyplot.subplots(1, 2, figsize=(13, 7), sharex=True)
    looks = {name: _look(number, any_of(knobs[0])['kind'])
             for number, (name, knobs) in enumerate(lines.items())}
    for axis, (batch, panel) in zip(axes, PANELS.items()):
        for name, knobs in lines.items():
            _line(axis, [rows[batch] for rows in knobs if batch in rows], looks[name])
        axis.set(xscale='log', yscale='log', title=panel,
                 xlabel='largest error within a turn')
        axis.grid(True, which='major', color='0.9')
        axis.set_axisbelow(True)
    axes[0].set_ylabel('time per pose [µs]')
    figure.suptitle(f'{title}: run time against error', x=0.01, ha='left', weight='bold')
    figure.legend(handles=[_entry(name, knobs, looks[name]) for name, knobs in lines.items()],
                  loc='center left', bbox_to_anchor=(0.735, 0.5), frameon=False, fontsize=8.5,
                  labelspacing=0.6)
    figure.text(0.01, 0.01, CAPTION, fontsize=8.5, color='0.3', va='bottom')
    figure.subplots_adjust(left=0.055, right=0.73, top=0.9, bottom=0.15, wspace=0.13)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _look(number, kind):
    colour = {'ours': 'crimson', 'limit': 'black'}.get(kind)
    return {'color': colour or COLOURS[number % len(COLOURS)],
            'marker': MARKERS[number % len(MARKERS)],
            'markersize': 9 if colour else 6,
            'linewidth': 2 if colour else 1.2,
            'zorder': 4 if colour else 2}


def _line(axis, rows, look):
    """Draw a line through the knob's settings; where poses fail the marker is hollow."""
    drawn = [row for row in rows
             if row['median_us'] is not None and row['max_scaled'] is not None]
    if not drawn:
        return
    errors = [max(row['max_scaled'], LEAST) for row in drawn]
    times = [row['median_us'] for row in drawn]
    style = '--' if drawn[0]['follows'] else '-'
    axis.plot(errors, times, **{**look, 'marker': ''}, linestyle=style)
    for error, time, row in zip(errors, times, drawn):
        fill = {'markerfacecolor': 'white'} if failed(row) else {}
        axis.plot(error, time, **{**look, **fill}, linestyle='')


def _entry(name, knobs, look):
    rows = [any_of(rows) for rows in knobs]
    shares = sorted(100 * failed(row) / row['angles'] for row in rows)
    told = name if len(rows) == 1 else f'{name}\n{_range(rows)}'
    if shares[-1]:
        told += (f' (fails {shares[-1]:.0f} %)' if shares[-1] - shares[0] < 1
                 else f' (fails {shares[0]:.0f}-{shares[-1]:.0f} %)')
    fill = {'markerfacecolor': 'white'} if shares[0] else {}
    return Line2D([], [], label=told, linestyle='--' if rows[0]['follows'] else '-',
                  **{**look, **fill})


def _range(rows):
    """Return the settings of the knob: all of a few, the ends of many."""
    knobs = [row['knob'] for row in rows]
    return ', '.join(knobs) if len(', '.join(knobs)) < 34 else f'{knobs[0]} … {knobs[-1]}'

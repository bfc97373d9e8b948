# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The layers of a picture, drawn with Matplotlib: traces, guides, legs, floor, headline and names.

Each adds artists to axes and moves them.
"""

import math
import re
import textwrap

from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
import numpy as np

from .cycle import SAMPLES
from ..linkage import GROUND
from ..palette import BAR, DARK, DRIVEN, EARTH, FLOOR, GREY, LOCUS, TRACK
from ..robot_model import shapes

FADING_TURNS = 0.3  # turns after which a fading trace is gone
STANCE_HEIGHT = 0.06  # of a foot curve's height: below that the foot is on the ground
MIN_STRIDE = 0.02  # of the longest bar: a foot that stands has marks, too
MIN_CURVE_POINTS = 20  # points: a line that has more is a curve
MAX_BEND = 1e-9  # of a curve's length: largest deviation of a straight line
MAX_WHITENESS = 0.7  # how white the last of many pairs of legs is

HALO = [withStroke(linewidth=3, foreground='white')]
PIVOT_SIZE = 13  # points, from its top to its bottom
PIVOT = Path([(0.0, 0.0), (-0.6, -1.0), (0.6, -1.0), (0.0, 0.0)], closed=True)
# Lines in drawing order: colour, width, cap, and how much wider the rim is.
LINES = {'bars': (BAR, 5.5, 'round', 0.0), 'slots': ('white', 13.5, 'round', 3.5),
         'rods': (DARK, 4.0, 'round', 0.0), 'cranks': (DRIVEN, 5.5, 'round', 0.0),
         'bodies': (TRACK, 9.0, 'projecting', 3.5), 'driven': (DRIVEN, 9.0, 'projecting', 3.5)}
# Marks: shape, size, colours of the inside and the edge, width of the edge, place in the order.
DOTS = {'pivots': (PIVOT, 2.0 * PIVOT_SIZE, EARTH, EARTH, 1.0, 0.05),
        'joints': ('o', 9.0, 'white', DARK, 2.2, 0.8),
        'tracer': ('o', 11.0, LOCUS, DARK, 1.6, 0.9)}


def whiter(colour, part: float):
    """Blend a colour with white by a fraction."""
    return tuple(np.array(to_rgb(colour)) * (1.0 - part) + part)


def indices(linkage, names):
    """Return the indices of joints among those of a linkage."""
    return [linkage.points.index(name) for name in names]


class Trace:
    """The curve of the tracer: whole, growing, fading, or the part that a foot stands on."""

    def __init__(self, axes, mechanism, cycle, kind, unit):
        self._cycle, self._kind = cycle, kind
        self._tracer = mechanism.linkage.points.index(mechanism.tracer)
        bold = {'color': LOCUS, 'lw': 3 * unit, 'zorder': 2}
        self.lines = axes.add_collection(LineCollection([], **bold), autolim=False)
        curve = cycle.locus(mechanism) if kind in ('whole', 'stance') else np.empty(0)
        for side in (1.0, -1.0)[:1 + mechanism.mirrored] if len(curve) else ():
            foot = curve * (side, 1.0)
            if kind == 'stance':
                axes.plot(*foot.T, color=whiter(LOCUS, 0.65), lw=1.2 * unit, zorder=2)
                foot = standing(foot)
            axes.plot(*foot.T, **bold)

    def show(self, pose):
        """Draw the curve up to the tracer."""
        if self._kind == 'growing':
            start, end = 0.0, min(pose.turns, float(self._cycle.turns))
            curves = self._cycle.curve(self._tracer, start, end)
            self.lines.set_segments(np.moveaxis(curves, 1, 0))
        elif self._kind == 'fading':
            curves = self._cycle.curve(self._tracer, pose.turns - FADING_TURNS, pose.turns)
            pieces = np.stack([curves[:-1], curves[1:]], axis=2)
            ages = np.linspace(1.0, 0.0, len(pieces))
            self.lines.set_segments(pieces.reshape(-1, 2, 2))
            self.lines.set_color(np.repeat([whiter(LOCUS, age) for age in ages],
                                           pieces.shape[1], axis=0))


def standing(curve):
    """Return a foot's curve (n, 2), NaN where the foot is not on the ground."""
    height = curve[:, 1] - np.fmin.reduce(curve[:, 1])
    return np.where(height[:, None] <= STANCE_HEIGHT * np.fmax.reduce(height), curve, np.nan)


def guides(axes, mechanism, cycle, unit):
    """Draw the crank circle, a straight traced line, and guides on the ground."""
    linkage = mechanism.linkage
    first_leg = cycle.course[:, 0]
    dashed = {'color': GREY, 'lw': 1.6 * unit, 'ls': (0, (6, 4)), 'zorder': 1}
    around = np.exp(1j * np.linspace(0.0, math.tau, 361))
    # A crank on a moving link draws no circle.
    for bar in [bar for bar in shapes.cranks(linkage) if bar[0] in linkage.grounded]:
        centre, pin = first_leg[0, indices(linkage, bar)]
        circle = centre @ (1, 1j) + around * math.dist(centre, pin)
        axes.plot(circle.real, circle.imag, **dashed)
    line = straight(cycle.locus(mechanism))
    if line is not None:
        axes.axline(*line, **dashed)
    for shape, ends in cycle.slides:
        if shape.kind == shapes.GUIDE and shape.start.link == GROUND:
            for track in cycle.course[0, :1 + mechanism.mirrored, ends]:
                axes.plot(*track.T, color=TRACK, lw=8 * unit, zorder=1, solid_capstyle='round')


def straight(curve):
    """Return two points of a curve that is a straight line, else None."""
    curve = curve[np.isfinite(curve).all(axis=1)]
    if len(curve) < 2:
        return None
    middle = curve.mean(axis=0)
    _, (length, width), directions = np.linalg.svd(curve - middle, full_matrices=False)
    return (middle, middle + length * directions[0]) if width <= MAX_BEND * length > 0.0 else None


class Legs:
    """The links and joints; each pair of legs is paler than the one before."""

    def __init__(self, axes, mechanism, cycle, parts, unit):
        linkage = mechanism.linkage
        joints = np.array(indices(linkage, mechanism.points))
        # The indices of all that is drawn of a leg, by part.
        self._indices = {
            **lines_of(mechanism, cycle), 'joints': joints,
            'pivots': joints[fixed(cycle.course)[joints]],
            'tracer': indices(linkage, [mechanism.tracer]),
            'plates': [indices(linkage, plate)
                       for plate in shapes.plates(linkage, mechanism.points)]}
        sides = 1 + mechanism.mirrored
        thin = unit * (1.0 if len(cycle.prefixes) == 1 else 0.7)
        self.legs = [(leg, artists(
            axes, parts, MAX_WHITENESS * (leg // sides) / mechanism.leg_pairs, thin))
            for leg in reversed(range(len(cycle.prefixes)))]

    def show(self, pose):
        """Move the legs."""
        for leg, parts in self.legs:
            places = pose.places[leg]
            for part, artist in parts.items():
                indices = self._indices[part]
                if part in DOTS:
                    artist.set_data(*places[indices].T)
                else:
                    artist.set_verts([places[ends] for ends in indices])


def lines_of(mechanism, cycle):
    """Return the indices of the ends of a leg's lines, by part."""
    linkage, shown = mechanism.linkage, set(mechanism.points)
    cranks = shapes.cranks(linkage)
    lines: dict[str, list] = {part: [] for part in LINES}
    for part, bars in (('cranks', cranks), ('rods', linkage.cylinders),
                       ('bars', [bar for bar in linkage.bars if bar not in cranks])):
        lines[part] = [indices(linkage, bar) for bar in bars if shown.issuperset(bar)]
    for shape, ends in cycle.slides:
        part = 'slots' if shape.kind == shapes.GUIDE else (
            'driven' if shape.slide.name in mechanism.inputs else 'bodies')
        if part != 'slots' or shape.start.link != GROUND:
            lines[part].append(ends)
    return {part: np.array(ends, int).reshape(-1, 2) for part, ends in lines.items()}


def artists(axes, parts, white, unit):
    """Return the artists of one leg by part."""
    made: dict = {}
    zorder = 10.0 + 10.0 * (1.0 - white)
    if 'links' in parts:
        made['plates'] = PolyCollection([], facecolors=whiter(BAR, 0.78 + 0.22 * white),
                                        zorder=zorder)
        for place, (part, (colour, width, cap, rim)) in enumerate(LINES.items(), start=1):
            made[part] = LineCollection(
                [], colors=whiter(colour, white), lw=width * unit, capstyle=cap,
                zorder=zorder + 0.1 * place, path_effects=rim and [withStroke(
                    linewidth=(width + rim) * unit, foreground=whiter(DARK, white))])
        for collection in made.values():
            axes.add_collection(collection, autolim=False)
    if 'joints' in parts:
        for part, (marker, size, colour, edge, width, above) in DOTS.items():
            made[part], = axes.plot(
                [], [], ls='', marker=marker, ms=size * unit, mfc=whiter(colour, white),
                mec=whiter(edge, white), mew=width * unit, zorder=zorder + above)
    return made


def fixed(course):
    """Return which joints of the first leg never move."""
    return np.ptp(course[:, 0], axis=0).max(axis=1) == 0.0


class Floor:
    """The floor, which moves with the lowest foot."""

    MARKS = 9  # per turn

    def __init__(self, axes, mechanism, cycle, unit):
        self._tracer = mechanism.linkage.points.index(mechanism.tracer)
        feet = cycle.course[:, :, self._tracer]
        lowest = np.nan_to_num(feet[:-1, :, 1], nan=np.inf).argmin(axis=1)
        steps = np.diff(feet[:, :, 0], axis=0)[np.arange(len(lowest)), lowest]
        self._way = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])
        # After a turn, marks are at the places of other marks; a single foot moves them back.
        turn = abs(self._way[-1])
        stride = max(np.ptp(self._way), MIN_STRIDE * mechanism.scale * mechanism.linkage.longest)
        self.spacing = turn / self.MARKS if turn > 0.1 * stride else 0.5 * stride
        self._axes = axes
        style = {'color': FLOOR, 'zorder': 1, 'capstyle': 'round'}
        self._line, self.marks = (axes.add_collection(
            LineCollection([], lw=width * unit, **style), autolim=False) for width in (3, 2))

    def show(self, pose):
        """Move the floor under the lowest foot."""
        level = np.fmin.reduce(pose.places[:, self._tracer, 1])
        samples = len(self._way)
        way = np.interp(pose.turns * SAMPLES % (samples - 1), np.arange(samples), self._way)
        low, high = self._axes.get_xlim()
        self._line.set_segments([[(low, level), (high, level)]])
        first = low + (way - low) % self.spacing - self.spacing
        marks = np.arange(first, high + self.spacing, self.spacing)
        depth = 0.22 * self.spacing
        self.marks.set_segments([[(x, level), (x - depth, level - depth)] for x in marks])


class Headline:
    """Above the axes: the name, the dimensions, the inputs, and a lever's angle."""

    def __init__(self, axes, mechanism, parts, unit, single):
        self._linkage, self._has_readings = mechanism.linkage, 'title' in parts
        self._columns = 4 if single and unit >= 0.6 else 2
        self._fixed_lines = [] if single else [mechanism.name.replace('_', ' ')]
        if 'dimensions' in parts:
            sizes = self._linkage.dimensions.items()
            words = ',  '.join(f'{name}\u00a0=\u00a0{value:g}' for name, value in sizes)
            self._fixed_lines += textwrap.wrap(words, 60 if single else 28)
        self.text = axes.set_title('', loc='left', fontsize=5 + 10 * unit if single else 11.5)

    def show(self, pose):
        """Update the text."""
        short = self._columns == 2
        texts = readings(self._linkage, pose.inputs, short) if self._has_readings else []
        # Spaces as wide as a digit: a reading hardly moves those after it.
        rows = ['  '.join(text.ljust(11, '\u2007') for text in texts[k:k + self._columns])
                for k in range(0, len(texts), self._columns)]
        self.text.set_text('\n'.join([*self._fixed_lines, *rows]))


def readings(linkage, inputs, short=False):
    """Return texts of the inputs and, for a slotted lever, of its angle and the ratios."""
    if not hasattr(linkage, 'reduction'):
        return [reading(re.sub(r'^crank(?=\d*$)', 'θ', input_.name), value) if input_.is_angle
                else f'{input_.name} = {value:.4g} m'
                for input_, value in zip(linkage.inputs, inputs)]
    theta = math.remainder(inputs[0], math.tau)
    lever = float(linkage.joint_angles(theta)['lever'])
    angles = [reading('θ', theta), reading('φ', lever)]
    if short:
        return angles
    return angles + [f'φ/θ = {rounded(lever / theta, 3) if theta else "–"}',
                     f'dφ/dθ = {rounded(float(linkage.reduction(theta)), 3)}']


def reading(name, angle):
    """Return an angle [rad] as text in degrees."""
    return f'{name} = {rounded(math.degrees(angle), 1)}°'


def rounded(number, digits):
    """Return a rounded number as text, without the sign of a zero."""
    return f'{round(number, digits) + 0.0:.{digits}f}'.replace('-', '−')


class Names:
    """The joints' names, at places that rarely overlap other parts."""

    DIRECTIONS = np.exp(1j * np.linspace(0.0, math.tau, 24, endpoint=False))

    def __init__(self, axes, mechanism, cycle, unit):
        linkage = mechanism.linkage
        self._axes = axes
        self._index = indices(linkage, mechanism.points)
        lines = *linkage.bars, *((link.joint, link.tip) for link in linkage.links)
        self._bars = np.array([indices(linkage, line) for line in lines])
        self._fixed, self._pivot = np.flatnonzero(fixed(cycle.course)), 1j * PIVOT_SIZE * unit
        # Distance from the joint [points], and half of what the name is wider than one letter.
        self._distance = 5 + 8 * unit
        self._wider = [0.25 * (8 + 6 * unit) * (len(name) - 1) for name in mechanism.points]
        self.artists = [axes.annotate(
            name, (0.0, 0.0), (0.0, 0.0), textcoords='offset points', fontsize=8 + 6 * unit,
            ha='center', va='center', zorder=100, path_effects=HALO,
            annotation_clip=False, in_layout=False) for name in mechanism.points]

    def settle(self, poses):
        """Choose each name's place beside its joint, for poses of shape (n, legs, joints, 2)."""
        joints = self._points(poses[:, 0])
        start, end = np.moveaxis(joints[:, self._bars], -1, 0)
        curves = [self._points(line.get_xydata()[::9]) for line in self._axes.lines
                  if len(line.get_xdata()) > MIN_CURVE_POINTS]
        # All that a name keeps clear of, as points.
        drawn = np.hstack([joints, joints[:, self._fixed] - self._pivot, *(
            start + part * (end - start) for part in np.linspace(0.0, 1.0, 25)), *(
            np.broadcast_to(curve, (len(joints), len(curve))) for curve in curves)])
        for text, index, wider in zip(self.artists, self._index, self._wider):
            offsets = self._distance * self.DIRECTIONS + wider * self.DIRECTIONS.real
            tried = joints[:, [index]] + offsets
            room = np.min([np.fmin.reduce(abs(tried[..., None] + end - drawn[:, None]), axis=2)
                           for end in {-wider, 0.0, wider}], axis=0)
            room = np.nan_to_num(np.minimum(room, self._distance))
            best = offsets[room.mean(axis=0).argmax()]
            text.set_position((best.real, best.imag))
            half = (0.5 * self._distance + wider) * np.linspace(-1.0, 1.0, 5)
            drawn = np.hstack([drawn, joints[:, [index]] + best + half])

    def _points(self, places):
        """Return places [m] on paper [points], as complex numbers."""
        points = self._axes.transData.transform(places.reshape(-1, 2)) @ (1, 1j)
        return points.reshape(places.shape[:-1]) * 72 / self._axes.figure.dpi

    def show(self, pose):
        """Move the names with their joints."""
        for text, index in zip(self.artists, self._index):
            text.xy = tuple(pose.places[0, index])

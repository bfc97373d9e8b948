# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""
The pages of the catalogue: one a mechanism, from its docstring, its lines and what it does.

What is on a page is kept nowhere else: text and sources are the docstring of the mechanism's
module, what it is for is below, tables and figures follow from the mechanism itself.
"""

import math
from pathlib import Path
import re
import sys
import textwrap

from linkage_ros import mechanisms, palette, scene
from linkage_ros.linkage import joint_lines
from linkage_ros.linkage.geometry import planar
from linkage_ros.render import files
from linkage_ros.render.cli import parser
from linkage_ros.render.cycle import Cycle
from linkage_ros.render.parts import DEFAULT
from linkage_ros.render.picture import Picture
from matplotlib.figure import Figure
import numpy as np

SECONDS, FPS, COLOURS = 3.0, 15, 64
SIZE = 360, 360
SHOWN_AT = 0.13  # turns: a pose in which few joints are in line
CHANGE, CHANGE_OF_LEVER = 0.05, 0.2  # of a dimension, in the figure that shows what it does
ROOM = 0.25  # around the unchanged curve, in that figure
COLUMNS = 4  # of figures
SHOWN = 3  # mechanisms in a row

# How several cranks move in the pictures; one crank turns, or swings through its reach.
MOTIONS = {'five_bar': {'crank.sweep': [1.2, 1.9], 'crank2.sweep': [1.25, 1.95],
                        'crank2.speed': 1.5}}

# What a mechanism is for, and who built it.
USES = {
    'water_drop': ('Drawing and showing: two bars, their mirror image and a pen.',
                   'Keishiro Ueki, who showed it on Twitter.'),
    'jansen': ('Legs that walk on level ground with an even body, many on one crankshaft.',
               'Theo Jansen, from 1990 on, for his strandbeesten, which walk on beaches by wind.'),
    'peaucellier': ('An exact straight line without a guide.',
                    'Charles-Nicolas Peaucellier, 1864; Lipman Lipkin found it by himself, 1871.'),
    'slotted_lever': ('A lever moved by a pin: steering, flaps, grippers on a hobby servo; '
                      'shaping machines.', 'No inventor is known.'),
    'chebyshev_lambda': ('Legs, and a nearly straight line over half a turn.',
                         'Pafnuty Chebyshev, whose walking machine was shown in Paris in 1878.'),
    'five_bar': ('Pick and place, drawing, legs: light arms, since both motors stand still.',
                 'No inventor is known; as a robot it is called a double SCARA.'),
    'four_bar': ('Wipers, doors, suspensions, grippers: most loops of most machines.',
                 'Older than its theory; Franz Grashof said in 1883 which bar can turn.'),
    'hoeken': ('Pushing along a line at an even speed: feeders, walking toys.',
               'Karl Hoecken, 1926.'),
    'klann': ('Legs that lift their feet high and step over things.',
              'Joe Klann, 1994; patented 2001.'),
    'pantograph': ('Copying a motion larger or smaller: drawing, engraving, robot legs.',
                   'Christoph Scheiner, 1603; published 1631.'),
    'slider_crank': ('Engines, pumps, compressors, presses.',
                     'Saw mills had it in the 3rd century: one is cut on a sarcophagus in '
                     'Hierapolis.'),
    'watt': ('Guiding a rod nearly straight; today rear axles of cars.',
             'James Watt, 1784, for the piston rod of his steam engine.'),
    'whitworth': ('Shaping and slotting machines: slow while it cuts, quick on the way back.',
                  'Joseph Whitworth, in the 19th century, for his machine tools.'),
}

# What is written in letters in a docstring.
SIGNS = {r'\btheta\b': 'θ', r'\bphi\b': 'φ', r'\bpi\b': 'π', r'\bsqrt ?(?=[\d(])': '√',
         r'\^2\b': '²', r'\+-': '±', '->': '→'}

# Where the formulas of the words are.
FORMULAS = {
    'dyad': planar.dyad, 'rigid': planar.triangle, 'mirror': planar.mirror,
    'inversor': planar.inversor, 'slot': planar.slot, 'slider': planar.slider,
}


def write(folder: Path):
    """Write all pages and their figures."""
    folder.mkdir(exist_ok=True)
    for type_ in mechanisms.TYPES:
        draw(type_, folder)
        (folder / f'{type_}.md').write_text(page(type_))
    (folder / 'index.md').write_text(index())
    (folder / 'constructions.md').write_text(construction_page())
    (folder / 'render.txt').write_text(parser().format_help())


def title(type_: str) -> str:
    """Return a mechanism's name as a heading."""
    return type_.replace('_', ' ').capitalize()


def paragraphs(type_: str):
    """Return the paragraphs of a mechanism's docstring as Markdown."""
    return list(doc_blocks(sys.modules[f'linkage_ros.mechanisms.{type_}'].__doc__))


def markdown(text: str) -> str:
    """Return plain text, but for its `code`, such that Markdown takes nothing in it as markup."""
    parts = re.split(r'(`[^`]*`)', text)
    parts[::2] = [re.sub(r'([\\*_<>\[\]|#])', r'\\\1', typeset(part)) for part in parts[::2]]
    return ''.join(parts)


def typeset(text: str) -> str:
    """Return text with the signs that stand for words in formulas."""
    for word, sign in SIGNS.items():
        text = re.sub(word, sign, text)
    return text


def use(type_: str) -> str:
    """Return what a mechanism is for and who built it, where that is written down."""
    return '**For:** {}<br>\n**Built by:** {}\n'.format(*USES[type_]) if type_ in USES else ''


def index() -> str:
    """Return the page that shows all mechanisms."""
    cells = [f'[![{title(t)}]({t}.gif)]({t}.md)<br>[{title(t)}]({t}.md)'
             f'<br>{USES.get(t, [""])[0]}' for t in mechanisms.TYPES]
    cells += [''] * (-len(cells) % SHOWN)
    rows = [cells[k:k + SHOWN] for k in range(0, len(cells), SHOWN)]
    pages = '\n'.join(mechanisms.TYPES)
    return f"""\
# Mechanisms

{table([''] * SHOWN, rows)}

Each is a few [constructions](constructions.md). Any other planar linkage of dyads is written in
the same words: type `custom`, in [a scene](../tutorial.md) or in Python.

On the pages, a joint's angle counts counterclockwise from its zero: for links on the ground from
+x, else from the parent's bar. To try a type, `four_bar.yaml`:

```yaml
/**:
  ros__parameters:
    mechanisms: [four_bar]
```

```console
$ python -m linkage_ros.render four_bar.yaml --out four_bar.gif
$ ros2 run linkage_ros scene --ros-args --params-file four_bar.yaml
```

```{{toctree}}
:hidden:

{pages}
```
"""


def page(type_: str) -> str:
    """Return the page of a mechanism."""
    linkage = mechanisms.create(type_)
    design = mechanisms.design(type_)
    summary, *rest = paragraphs(type_)
    return f"""\
# {title(type_)}

{summary}

![{title(type_)}, its joints named]({type_}.svg) ![{title(type_)}, moving]({type_}.gif)

{use(type_)}
{chr(10).join(part + chr(10) for part in rest)}
## Dimensions

{table(['name', 'default [m]'], dimensions(design))}

Each dimension {100 * change(linkage):g} % smaller and larger, and {effect(linkage)}:

![Curves for changed dimensions]({type_}_dimensions.svg)

## Construction

{table(['joint', 'construction'], constructions(design))}

{reach(linkage)} The traced joint is {linkage.tracer}; the longest bar is {linkage.longest:g} m.
{branches(linkage)}

## Joints

{table(['joint state', 'kind', 'parent', 'at', 'points to', 'zero'], links(linkage))}

## In Python

```python
from linkage_ros import mechanisms

linkage = mechanisms.create('{type_}')
linkage.solve({0.5 if len(linkage.inputs) == 1 else [1.2, 1.3]}, points=('{linkage.tracer}',))
```
"""


def table(head, rows) -> str:
    """Return a Markdown table."""
    return '\n'.join(f'| {" | ".join(row)} |' for row in [head, ['---'] * len(head), *rows])


def dimensions(design):
    """Return a row for each dimension: its name and default."""
    return ((f'`{name}`', f'{default:g}') for name, default in design.dimensions.items())


def effect(linkage) -> str:
    """Return in words what `traced` returns."""
    if hasattr(linkage, 'reduction'):
        return 'the lever angle over the crank angle from -180° to 180°'
    return f'the curve that {linkage.tracer} then draws'


def constructions(design):
    """Yield a row for each line: its joints, and its construction with what is known of it."""
    for line in design.lines:
        text = f'`{line.text.split(maxsplit=len(line.names))[-1]}`'
        formulas = f'[{line.word}](constructions.md#{line.word})' if line.word in FORMULAS else ''
        yield ', '.join(line.names), f'{text} {formulas}'


def construction_page() -> str:
    """Return the page of the constructions: how they pass change points, and their formulas."""
    _, _, change_points = doc_blocks(joint_lines.__doc__)
    intro = '\n\n'.join(doc_blocks(planar.__doc__))
    sections = '\n\n'.join(f'### {word}\n\n' + '\n\n'.join(doc_blocks(function.__doc__))
                           for word, function in FORMULAS.items())
    return f"""\
# Constructions

[Joint lines](../which-word.md) explains the words.

## Change points

{change_points}

## Formulas

{intro}

{sections}
"""


def doc_blocks(text):
    """Return the paragraphs of a docstring as Markdown; indented ones are formulas."""
    first, *rest = text.strip().split('\n\n')
    rest = textwrap.dedent('\n\n'.join(rest)).split('\n\n') if rest else []
    for block in (first, *rest):
        if block.startswith('    '):
            yield f'```text\n{typeset(textwrap.dedent(block))}\n```'
        else:
            yield markdown(' '.join(block.split()))





def reach(linkage) -> str:
    """Return in words which crank angles can be assembled."""
    if len(linkage.inputs) > 1:
        return 'How far one crank reaches depends on where the others are.'
    arcs = linkage.reach()
    if arcs[0][1] - arcs[0][0] >= math.tau:
        return 'The crank turns all round.'
    ends = ' or '.join(f'from {math.degrees(lo):.4g}° to {math.degrees(hi):.4g}°'
                       for lo, hi in arcs)
    return f'The crank swings {ends}.'


def branches(linkage) -> str:
    """Return in words which joints can be assembled in two ways."""
    if not linkage.branches:
        return 'It has one way to be assembled.'
    signs = ', '.join(f'`{joint}: {sign:+d}`' for joint, sign in linkage.branches.items())
    return f'Branches, each +1 or -1: {signs}.'


def links(linkage):
    """Yield a row for each moving link."""
    for link in linkage.links:
        zero = '' if link.kind == 'prismatic' else f'{math.degrees(link.zero):g}°'
        yield f'`{link.name}`', link.kind, link.parent, link.joint, link.tip, zero


def mechanism(type_, **lengths):
    """Return a mechanism of a scene, its cranks as slow as the pictures need."""
    given = {f'{type_}.dimensions.{name}': value for name, value in lengths.items()}
    given.update({f'{type_}.{name}': value for name, value in MOTIONS.get(type_, {}).items()})
    return scene.read({'mechanisms': [type_], **given}).mechanisms[type_]


def draw(type_, folder):
    """Write the figures of a mechanism: named joints, in motion, and changed dimensions."""
    one = mechanism(type_)
    still = Picture([one], SIZE)
    still.arrange([SHOWN_AT])
    files.still(still, SHOWN_AT, folder / f'{type_}.svg')
    moving = Picture([one], SIZE, 'fading', DEFAULT - {'labels', 'title', 'axes'})
    turns = moving.panels[0].cycle.turns
    frames = round(turns * SECONDS * FPS)
    times = [turns * k / frames for k in range(frames)]
    moving.arrange(times)
    files.gif(moving, times, FPS, 0, COLOURS, folder / f'{type_}.gif')
    family(type_).savefig(folder / f'{type_}_dimensions.svg', metadata={'Date': None})


def family(type_):
    """Return a figure of the traced curves when each dimension changes."""
    defaults = mechanisms.defaults(type_)
    part = change(mechanisms.create(type_))
    columns = min(len(defaults), COLUMNS)
    rows = math.ceil(len(defaults) / columns)
    figure = Figure((1.9 * columns, 1.9 * rows + 0.4), layout='constrained')
    axes = figure.subplots(rows, columns, squeeze=False).flat
    for unused in axes[len(defaults):]:
        unused.remove()
    for panel, (name, value) in zip(axes, defaults.items()):
        difference = part * (value or max(defaults.values()))
        panel.set_title(name, fontsize=11)
        panel.set(xticks=[], yticks=[])
        for sign, colour, dashes in ((-1, palette.BLUE, '--'), (0, palette.DARK, '-'),
                                     (1, palette.VERMILION, '-.')):
            curve = traced(type_, {name: value + sign * difference})
            panel.plot(*curve.T, color=colour, ls=dashes, lw=1.6)
        frame(panel, panel.lines[1].get_xydata(), part == CHANGE)
    figure.legend(axes[0].lines, ['smaller', 'as in the catalogue', 'larger'], ncols=3,
                  frameon=False, loc='lower center')
    below = 0.35 / figure.get_figheight()
    figure.get_layout_engine().set(rect=(0.0, below, 1.0, 1.0 - below))
    return figure


def frame(axes, curve, equal):
    """Set limits around a curve, at one scale for both directions if they are to be equal."""
    low, high = np.nanmin(curve, axis=0), np.nanmax(curve, axis=0)
    half = (0.5 + ROOM) * (high - low)
    if equal:
        half[:] = half.max()
        axes.set_aspect('equal')
    centre = 0.5 * (low + high)
    axes.set(xlim=(centre[0] - half[0], centre[0] + half[0]),
             ylim=(centre[1] - half[1], centre[1] + half[1]))


def change(linkage) -> float:
    """Return how much of a dimension is changed in the figure."""
    return CHANGE_OF_LEVER if hasattr(linkage, 'reduction') else CHANGE


def traced(type_, changed):
    """Return the tracer's curve [m], or a lever's angle over the crank's [rad]; empty if none."""
    try:
        one = mechanism(type_, **changed)
    except scene.SceneError:
        return np.empty((0, 2))
    if hasattr(one.linkage, 'reduction'):
        thetas = np.linspace(-math.pi, math.pi, 361)
        return np.stack([thetas, one.linkage.joint_angles(thetas, ('lever',))['lever']], axis=1)
    return Cycle(one).locus(one)

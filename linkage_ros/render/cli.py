# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""The command `render`: command line and drawing."""

import argparse
from dataclasses import replace
import math
from os.path import realpath
from pathlib import Path
import shutil

from . import parts
from .. import scene
from ..cli import add_scene, chosen, Parser, RequestError, run, within
from ..linkage import Formula
from ..optional import needs
from ..words import suggestion

IMAGES, VIDEOS = ('.png', '.svg'), ('.gif', '.mp4')
FPS, MAX_GIF_FPS, MAX_FPS = 25.0, 50.0, 240.0
MIN_SIDE, MAX_SIDE = 64, 8192
MAX_FRAMES, MAX_COLOURS = 10000, 255

EPILOG = """\
examples:
  render config/jansen.yaml --out leg.gif
  render config/water_drop.yaml --out drop.gif --trace growing --turns 2
  render config/strandbeest.yaml --out walk.gif --show floor --hide axes,title --size 960x540
  render config/slotted_lever.yaml --out lever.svg --angle 40 --data joints.csv
"""


def main(args=None) -> int:
    """Run the command line; return the exit code."""
    return run('render', draw, args)


def parsed(args):
    """Return the options of the command line; raise RequestError if they are invalid."""
    arguments = parser().parse_args(args)
    ending = arguments.out.suffix.lower()
    if ending not in IMAGES + VIDEOS:
        raise RequestError(f'--out must end in {", ".join(IMAGES + VIDEOS)}, not {arguments.out}')
    arguments.moving = ending in VIDEOS
    for option, (endings, *_) in OPTIONS.items():
        if getattr(arguments, option) is not None and ending not in endings:
            raise RequestError(
                f'--{option} is for {" and ".join(endings)} only, not for {ending}')
    if ending == '.mp4' and any(side % 2 for side in arguments.size):
        raise RequestError('--size must be two even numbers for .mp4')
    if ending == '.mp4' and not shutil.which('ffmpeg'):
        raise RequestError('ffmpeg, which writes .mp4, is not installed: apt install ffmpeg, or '
                           'choose .gif')
    if ending == '.gif' and (arguments.fps or FPS) > MAX_GIF_FPS:
        raise RequestError(
            f'--fps must be at most {MAX_GIF_FPS:g} for .gif, not {arguments.fps:g}')
    if arguments.data and realpath(arguments.data) in map(
            realpath, (arguments.out, arguments.scene)):
        raise RequestError('--data must be another file than SCENE and --out')
    for file in filter(None, (arguments.out, arguments.data)):
        if not file.absolute().parent.is_dir():
            raise RequestError(f'{file} cannot be written: there is no folder {file.parent}')
    return arguments


def draw(args):
    """Write the files that a command line requests."""
    arguments = parsed(args)
    mechanisms = chosen(scene.load(arguments.scene).mechanisms, arguments.mechanism)
    if arguments.angle is not None:
        mechanisms[0] = started(mechanisms[0], math.radians(arguments.angle))
    with needs('matplotlib'):
        from matplotlib import style

        from . import files
        from .picture import Picture

    for mechanism in mechanisms:
        mechanism.check_planar()
    default = parts.DEFAULT_IN_MOTION if arguments.moving else parts.DEFAULT
    out, fps = arguments.out, arguments.fps or FPS
    with style.context('default', after_reset=True):
        picture = Picture(mechanisms, arguments.size, arguments.trace,
                          (default | arguments.show) - arguments.hide)
        times = moments(arguments, picture)
        picture.arrange(times)
        if out.suffix.lower() == '.gif':
            files.gif(picture, times, fps, arguments.loop or 0,
                      arguments.colours or MAX_COLOURS, out)
        elif arguments.moving:
            files.mp4(picture, times, fps, out)
        else:
            files.still(picture, times[0], out)
        if arguments.data:
            files.data(picture, times, arguments.data)


def started(mechanism, angle):
    """Return a mechanism whose crank starts at an angle [rad]; raise RequestError if it cannot."""
    first, input_ = mechanism.first, mechanism.first.input
    if not input_.is_angle:
        raise RequestError(f'--angle is for a crank: {mechanism.name} is driven by a length; it '
                           'is drawn at its start')
    if first.sweep and not input_.holds(first.sweep, angle, angle):
        raise RequestError(f'the {input_.quantity} never reaches {angle:.6g} rad: it stays inside '
                           f'{scene.in_words([first.sweep])} rad')
    return replace(mechanism, inputs={
        **mechanism.inputs, input_.name: replace(first, start=angle)})


def moments(arguments, picture):
    """Return the times to draw [turns of the first input]."""
    if not arguments.moving:
        return [0.0]
    if not math.isfinite(picture.period):
        first = picture.panels[0].mechanism
        raise RequestError(f'{first.name}.{first.first.input.name}.speed is 0, and its turns are '
                           'what an animation shows')
    turns = arguments.turns or 1.0
    frames = arguments.frames or max(round(turns * picture.period * (arguments.fps or FPS)), 1)
    if frames > MAX_FRAMES:
        raise RequestError(f'this would be {frames} frames, more than {MAX_FRAMES}: choose '
                           'fewer with --frames, --turns or --fps')
    return [turns * k / frames for k in range(frames)]


def parser() -> Parser:
    """Return the parser of the command line."""
    made = Parser('render', description='Draw a scene: a picture (.png, .svg) or an animation '
                  '(.gif, .mp4).', epilog=EPILOG,
                  formatter_class=argparse.RawDescriptionHelpFormatter)
    add_scene(made, help="the scene's parameter file")
    # As 0.1.0 has it.
    made.add_argument('--mechanisms', dest='mechanism', type=words, help=argparse.SUPPRESS)
    made.add_argument('--out', metavar='FILE', type=Path, required=True,
                      help=f'output file, which ends in {", ".join(IMAGES + VIDEOS)}')
    made.add_argument('--data', metavar='FILE', type=Path,
                      help='also write the drawn values as CSV: time [s], inputs [rad or m] and '
                      'joints [m], with all digits')
    made.add_argument('--trace', choices=parts.TRACES, default='whole',
                      help="the traced joint's curve: whole (default), growing in the first turn, "
                      'fading after 0.3 turns, stance (whole, and bold where the foot is on the '
                      'ground), or none')
    made.add_argument('--show', metavar='PART,...', type=parts_of_a_picture, default=frozenset(),
                      help='draw these too: dimensions, floor (which moves with the foot on it), '
                      "labels (the joints' names, by default not in animations)")
    made.add_argument('--hide', metavar='PART,...', type=parts_of_a_picture, default=frozenset(),
                      help=f'leave out some of {", ".join(parts.PARTS)}')
    made.add_argument('--size', metavar='WxH', type=size, default=(720, 720),
                      help='pixels (default: 720x720)')
    groups = {IMAGES: made.add_argument_group('for .png and .svg'),
              VIDEOS: made.add_argument_group('for .gif and .mp4')}
    for option, (endings, metavar, type_, text) in OPTIONS.items():
        groups[IMAGES if endings == IMAGES else VIDEOS].add_argument(
            f'--{option}', metavar=metavar, type=type_, help=text)
    return made


def degrees(text):
    """Return an angle [degrees] from a number or from arithmetic such as pi/2."""
    try:
        formula = Formula(text.removeprefix('+'))
        value = float(formula.value({}))
    except (ValueError, KeyError):
        raise argparse.ArgumentTypeError(f'must be a finite angle, such as 30, pi/6 or 30deg, '
                                         f'not {text}') from None
    return math.degrees(value) if formula.is_angle else value


def words(text):
    """Return the words between commas."""
    return [word for word in text.split(',') if word]


def parts_of_a_picture(text):
    """Return the parts between commas."""
    for word in words(text):
        if word not in parts.PARTS:
            raise argparse.ArgumentTypeError(
                f'unknown part {word}{suggestion(word, parts.PARTS, 200)}')
    return frozenset(words(text))


def size(text):
    """Return width and height, from text such as 720x720."""
    width, height = map(within(int, MIN_SIDE, MAX_SIDE), text.lower().split('x'))
    return width, height


size.__name__ = 'WxH'

# Options that are for some endings only: these, a name of the value, its type, and what it is.
OPTIONS = {
    'angle': (IMAGES, 'DEG', degrees, "the first mechanism's crank angle, in degrees or as in "
              'pi/2 or 90deg (default: where it starts, as all others)'),
    'turns': (VIDEOS, 'N', within(float, 0.001, 1000.0), "turns of the first mechanism's crank, "
              'or periods of its oscillation (default: 1)'),
    'fps': (VIDEOS, 'N', within(float, 0.001, MAX_FPS), f'frames per second (default: {FPS:g})'),
    'frames': (VIDEOS, 'N', within(int, 1, MAX_FRAMES),
               "frames in all (default: in real time, by the crank's speed)"),
    'loop': (('.gif',), 'N', within(int, 0, 65536),
             'number of times that a .gif plays (default: 0, endlessly)'),
    'colours': (('.gif',), 'N', within(int, 2, MAX_COLOURS),
                f'colours of a .gif: fewer make it smaller (default: {MAX_COLOURS})')}

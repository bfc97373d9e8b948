# SPDX-FileCopyrightText: 2026 linkage_ros contributors
# SPDX-License-Identifier: Apache-2.0

"""Writes pictures as PNG, SVG, GIF or MP4 and their data as CSV: the same bytes each time."""

from contextlib import contextmanager, suppress
import csv
import os
from pathlib import Path
import subprocess
import tempfile

import matplotlib
import numpy as np
from PIL import Image

from ..words import RequestError

PALETTE_FRAMES = 8
# How long a GIF shows a picture at most [ms]: Pillow makes one of equal ones.
MAX_GIF_MS = 655350
# Pillow looks colours up in a palette by their upper six bits: white would become another grey.
SIX_BITS = 0b11111100

# Fonts as outlines, and names from a fixed salt: an SVG that is the same everywhere.
SVG = {'svg.hashsalt': 'linkage_ros', 'svg.fonttype': 'path'}

# Options of ffmpeg for files without time, place and machine.
REPRODUCIBLE = ('-threads', '1', '-fflags', '+bitexact', '-flags:v', '+bitexact',
                '-map_metadata', '-1')


def still(picture, turns, file: Path):
    """Write a picture at a time [turns] as PNG or SVG."""
    picture.show(turns)
    format_ = file.suffix[1:].lower()
    metadata = {'png': {'Software': None}, 'svg': {'Date': None}}[format_]
    with matplotlib.rc_context(SVG), replacing(file) as new:
        picture.figure.savefig(new, format=format_, metadata=metadata)


def gif(picture, times, fps, loop, colours, file: Path):
    """
    Write a picture at some times as a GIF, with one palette for all frames.

    Parameters
    ----------
    picture : Picture
        Picture to animate.
    times : sequence of float
        Times of the frames [turns].
    fps : float
        Frames per second.
    loop : int
        Number of repetitions; 0: endless.
    colours : int
        Largest number of colours.
    file : Path
        Output file.

    """
    def reduced(pixels):
        return Image.fromarray(pixels & SIX_BITS)

    sample = [picture.at(turns) for turns in times[::-(-len(times) // PALETTE_FRAMES)]]
    palette = reduced(np.concatenate(sample)).quantize(
        colours, Image.Quantize.MAXCOVERAGE, kmeans=1)
    # White is 255 again.
    shown = [255 * value // SIX_BITS for value in palette.getpalette()]
    frames = []
    for turns in times:
        frame = reduced(picture.at(turns)).quantize(palette=palette, dither=Image.Dither.NONE)
        frame.putpalette(shown)
        frames.append(frame)
    # A GIF counts hundredths of a second, Pillow milliseconds.
    ends = [10 * round(100.0 * k / fps) for k in range(len(frames) + 1)]
    if ends[-1] > MAX_GIF_MS:
        raise RequestError('a .gif lasts 655 s at most: choose a higher --fps, or .mp4')
    repeats = {} if loop == 1 else {'loop': max(loop - 1, 0)}
    with replacing(file) as new:
        frames[0].save(new, 'GIF', save_all=True, append_images=frames[1:],
                       duration=np.diff(ends).tolist(), **repeats)


def mp4(picture, times, fps, file: Path):
    """Write a picture at some times as MP4; raise OSError with ffmpeg's message if it fails."""
    height, width, _ = picture.at(times[0]).shape
    with replacing(file) as new, tempfile.TemporaryFile() as messages:
        encoder = subprocess.Popen([
            'ffmpeg', '-v', 'error', '-y', '-f', 'rawvideo', '-pix_fmt', 'rgb24',
            '-video_size', f'{width}x{height}', '-framerate', f'{fps:g}', '-i', '-',
            '-c:v', 'libx264', '-crf', '18', '-pix_fmt', 'yuv420p', '-movflags', '+faststart',
            *REPRODUCIBLE, '-f', 'mp4', new], stdin=subprocess.PIPE, stderr=messages)
        assert encoder.stdin
        with suppress(BrokenPipeError), encoder.stdin as pipe:
            for turns in times:
                pipe.write(picture.at(turns).tobytes())
        if encoder.wait():
            messages.seek(0)
            raise OSError(f'ffmpeg failed: {messages.read().decode(errors="replace").strip()}')


def data(picture, times, file: Path):
    """Write the drawn data: time [s], inputs [rad or m] and joints [m], one row per picture."""
    with replacing(file) as new, open(new, 'w', newline='') as lines:
        writer = csv.writer(lines, lineterminator='\n')
        writer.writerow(['time', *(name for panel in picture.panels for name in panel.columns())])
        for turns in times:
            picture.show(turns)
            values = [value for panel in picture.panels for value in panel.values()]
            writer.writerow([picture.seconds(turns), *values])


@contextmanager
def replacing(file: Path):
    """
    Yield the path of a new file, which replaces the old one on success.

    What a link leads to is replaced. A device, such as /dev/stdout, is written itself.
    """
    if file.exists() and not file.is_file():
        yield file
        return
    file = Path(os.path.realpath(file))
    new = file.with_name(f'.{file.name}.{os.getpid()}.new')
    try:
        yield new
        new.replace(file)
    finally:
        new.unlink(missing_ok=True)
